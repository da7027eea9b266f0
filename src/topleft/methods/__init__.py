"""The registry: the only list of the library's methods of filling, with the claims of each.

`METHODS` are the production methods: exact, with identical buffers. `CLASSICS` are methods of the literature, as
published, to compare with; a variant's name stands after a slash. Their kernels are imported on first use.

classics/    draws triangles as the literature does: a compiled kernel for each classic
reference/   draws triangles exactly and slowly, in integers and fractions: the reference of all methods
twins/       the classics in Python
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from topleft.typing import WindingOption

__all__ = ["CLASSICS", "METHODS", "Claims", "Kernel", "Method", "find_method", "load_kernel"]


class Kernel(Protocol):
    """Draws triangles in order over a cleared window of the picture."""

    def __call__(
        self,
        vertices: NDArray[np.float64],
        triangles: NDArray[np.int32],
        pixels: NDArray[np.uint8],
        window: tuple[int, int, int, int],
        sink: int,
        variant: str = "",
        subpixel_bits: int = 8,
    ) -> None:
        """Take pixel-space vertices, indices, the bytes of the buffer, (x, y, width, height) and a `Sink`."""


@dataclass(frozen=True, slots=True)
class Claims:
    """The claims of a method; `tests/methods/test_claims.py` proves each answer, the "no" as well as the "yes".

    Attributes
    ----------
    exact : bool
        Every sample is decided without rounding under the method's fill rule, for the vertices that it works on.
    watertight : bool
        Triangles that share edges leave no sample between them out; where a method calculates in float32, with
        corners within 2**22 px (`failure_scenes.py` shows failures far beyond).
    top_left : bool
        A sample on an edge is drawn when the edge is top or left, and not otherwise.
    sub_pixel : bool
        A shift of less than a pixel can change the picture.
    integer_vertices : bool
        Vertices are truncated to whole pixels first, and a pixel is sampled where its vertex would be.
    overdraws_shared_edges : bool
        Some sample of a mesh is drawn more than once.
    winding : str
        Which triangles are drawn: "either", "clockwise" or "counter-clockwise", as seen on the screen.
    """

    exact: bool = False
    watertight: bool = False
    top_left: bool = False
    sub_pixel: bool = False
    integer_vertices: bool = False
    overdraws_shared_edges: bool = False
    winding: WindingOption = "either"


@dataclass(frozen=True, slots=True)
class Method:
    """A method to fill triangles, and its claims.

    Attributes
    ----------
    name : str
        The value of ``method=``; of a classic, the file of its kernel and, after a slash, the variant.
    summary : str
        How it finds the covered samples.
    source : str
        Author, title, year.
    claims : Claims
    code : int or None
        `tl_method` in ``csrc/topleft.h``; None for a classic.
    limit : float
        A classic takes ``|x|`` and ``|y|`` below it: pixels, or sub-pixels when `has_subpixel_bits`.
    has_subpixel_bits : bool
        Whether ``subpixel_bits`` means anything to a classic.
    """

    name: str
    summary: str
    source: str
    claims: Claims
    code: int | None = None
    limit: float = np.inf
    has_subpixel_bits: bool = False


EXACT = Claims(exact=True, watertight=True, top_left=True, sub_pixel=True)

# fmt: off
METHODS = {method.name: method for method in (
    Method("auto", "the cheaper of edge and scanline for each triangle", "", EXACT, 0),
    Method("edge", "integer edge functions, stepped by additions, one test a sample",
           "J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988", EXACT, 1),
    Method("scanline", "row ends by one floor division an edge, then stepped quotient and remainder",
           "J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965", EXACT, 2),
)}
# fmt: on

ALIASES = {"topleft": "auto"}
"""Further words of ``method=``: the library by its name, in tables beside other methods."""

PINEDA = METHODS["edge"].source
GIESEN = "F. Giesen, Optimizing the basic rasterizer, 2013"
TUTORIAL_2 = "xterminal86, Software 3D renderer tutorial, part 2: Triangle, 2023"
TUTORIAL_3 = "xterminal86, Software 3D renderer tutorial, part 3: Scanline is a lie, 2023"
SOKOLOV = "D. Sokolov, tinyrenderer, lesson 2: Triangle rasterization and back face culling, 2015"
WYLIE = "C. Wylie, G. Romney, D. Evans, A. Erdahl, Half-tone perspective drawings by computer, 1967"
FENG = "Y. Feng, face3d, 2018"

#: Integer products of differences stay below 2**61; the published codes have 32 bits, which end at 2**14.
INT_LIMIT = 2.0**29
#: A Bresenham line is walked from its top, so this bounds the time of a triangle.
WALK_LIMIT = 2.0**21

#: The claims that several classics share.
ON_WHOLE_PIXELS = Claims(exact=True, watertight=True, top_left=True, integer_vertices=True)
EDGES_INCLUDED = Claims(exact=True, watertight=True, integer_vertices=True, overdraws_shared_edges=True)
EDGES_TWICE = Claims(integer_vertices=True, overdraws_shared_edges=True)
CLOSED = Claims(watertight=True, integer_vertices=True, overdraws_shared_edges=True)
FLOATS = Claims(sub_pixel=True, overdraws_shared_edges=True)

integer, walked = partial(Method, limit=INT_LIMIT), partial(Method, limit=WALK_LIMIT)
snapped = partial(integer, has_subpixel_bits=True)

# fmt: off
CLASSICS = {method.name: method for method in (
    integer("point_in_triangle", "three cross products for every pixel of the bounding box, edges included",
            TUTORIAL_3, EDGES_INCLUDED),
    integer("point_in_triangle/top-left", "three cross products, with a bias on edges that are neither top nor left",
            TUTORIAL_3, ON_WHOLE_PIXELS),
    snapped("edge_increment", "integer edge functions of sub-pixel vertices, stepped by additions", GIESEN, EXACT),
    integer("edge_increment/integer", "integer edge functions of vertices on whole pixels", GIESEN, ON_WHOLE_PIXELS),
    snapped("edge_increment/bottom-right", "integer edge functions, without top and left edges",
            "K. Dyrkorn, A fast and precise triangle rasterizer, 2022",
            Claims(exact=True, watertight=True, sub_pixel=True)),
    snapped("zigzag", "stepped edge functions, turning round at the triangle's sides", PINEDA, EXACT),
    walked("bresenham_scanline", "two Bresenham lines from the top down, outermost pixels, spans with both ends",
           TUTORIAL_2, EDGES_TWICE),
    walked("bresenham_scanline/top-left",
           "two Bresenham lines, first pixels of runs, without right ends and last rows", TUTORIAL_2, EDGES_TWICE),
    walked("bresenham_scanline/wireframe", "the outlines of the flat triangles of the fill",
           TUTORIAL_2, EDGES_TWICE),
    integer("lerp_scanline",
            "the long and a short edge interpolated in float32 a row, truncated, spans with both ends",
            SOKOLOV, CLOSED),
    integer("lerp_scanline/plus-one", "interpolated edges, heights of short edges plus 1, with the last row",
            SOKOLOV, EDGES_TWICE),
    integer("row_crossing", "crossings of each row and the three edges in float32, rounded; least to greatest",
            WYLIE, CLOSED),
    integer("row_crossing/zero-area-test", "crossings of rows and edges, without empty triangles", WYLIE, CLOSED),
    integer("row_crossing/cull-back", "crossings of rows and edges, without empty triangles and back faces",
            WYLIE, replace(CLOSED, winding="counter-clockwise")),
    integer("row_crossing/cull-front", "crossings of rows and edges, without empty triangles and front faces",
            WYLIE, replace(CLOSED, winding="clockwise")),
    Method("float_barycentric", "three float32 weights for every pixel centre of the bounding box, edges included",
           FENG, FLOATS),
    Method("float_barycentric/float64", "three float64 weights for every pixel centre of the box", FENG, FLOATS),
)}
# fmt: on


def find_method(name: object) -> Method:
    """Return a method by its name.

    Raises
    ------
    ValueError
        If there is no such method.
    """
    method = {**METHODS, **CLASSICS}.get(ALIASES.get(name, name)) if isinstance(name, str) else None
    if method is None:
        raise ValueError(
            f"method must be one of {', '.join(map(repr, METHODS))}, got {name!r}; "
            f"methods to compare with are {', '.join(map(repr, CLASSICS))}"
        )
    return method


def load_kernel(method: Method) -> tuple[Kernel, str]:
    """Return the kernel of a classic and the name of its variant ("" for the first form)."""
    from topleft.methods.classics import classic_kernels

    name, _, variant = method.name.partition("/")
    return partial(classic_kernels.draw, name), variant
