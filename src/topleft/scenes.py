"""Deterministic scenes and built-in shapes: arrays made from a seed or a formula, never from a file.

Output: vertices and triangles (and colours), in pixel space (x right, y down, centres at +0.5) or in object space.
Tests, benchmarks, docs and the command line all draw from here, so a picture can be named by its scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
U8 = npt.NDArray[np.uint8]
Shape = tuple[F64, I32]

GOLDEN_RATIO = (1 + 5**0.5) / 2


# Scenes in pixel space


def large_triangle(width: int = 3840, height: int = 2160) -> Shape:
    """A triangle that covers about half of the frame.

    Returns
    -------
    vertices : (3, 2) float64, pixels
    triangles : (1, 3) int32
    """
    vertices = np.array([[10.3, 5.7], [width - 20.1, 300.2], [700.9, height - 10.4]])
    return vertices, np.array([[0, 1, 2]], dtype=np.int32)


def random_triangles(
    n: int, size_px: float, width: int = 1920, height: int = 1080, seed: int = 1
) -> tuple[F64, I32, U8]:
    """Separate triangles strewn over the frame, each with its depth and colour.

    Parameters
    ----------
    n : int
        Number of triangles.
    size_px : float
        Diameter of the circle round a triangle, pixels; the corners lie at 0.7 to 1.0 of its radius.
    width, height : int
        The frame in which the centres are uniform, pixels.
    seed : int
        Seed of the generator.

    Returns
    -------
    vertices : (3 n, 3) float64, x and y in pixels, z in (0, 1), equal for the three corners
    triangles : (n, 3) int32
    colors : (n, 3) uint8
    """
    _check_frame(width, height)
    rng = np.random.default_rng(seed)
    center_px = rng.uniform([0, 0], [width, height], (n, 1, 2))
    third_turns = np.array([0, 2, 4]) * np.pi / 3
    angle = rng.uniform(0, 2 * np.pi, (n, 1)) + third_turns + rng.uniform(-0.6, 0.6, (n, 3))
    radius_px = 0.5 * size_px * rng.uniform(0.7, 1.0, (n, 3))
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    xy_px = center_px + radius_px[..., None] * direction
    z = np.repeat(rng.uniform(0.05, 0.95, (n, 1, 1)), 3, axis=1)
    vertices = np.concatenate([xy_px, z], axis=-1).reshape(-1, 3)
    triangles = np.arange(3 * n, dtype=np.int32).reshape(n, 3)
    return vertices, triangles, rng.integers(0, 256, (n, 3), dtype=np.uint8)


def planar_mesh(n_points: int, width: int = 1920, height: int = 1080, seed: int = 2) -> Shape:
    """A Delaunay triangulation that tiles the whole frame: each pixel is covered by exactly one triangle.

    Needs scipy, of the extras `test` and `bench`.

    Returns
    -------
    vertices : (n_points + 4, 2) float64, pixels
    triangles : (k, 3) int32, k about 2 * n_points
    """
    from scipy.spatial import Delaunay

    _check_frame(width, height)
    rng = np.random.default_rng(seed)
    corners = np.array([[-1.0, -1.0], [width + 1, -1], [-1, height + 1], [width + 1, height + 1]])
    inner = rng.uniform([-1, -1], [width + 1, height + 1], (n_points, 2))
    vertices = np.concatenate([corners, inner])
    return vertices, Delaunay(vertices).simplices.astype(np.int32)


def _check_frame(width: float, height: float) -> None:
    if not (math.isfinite(width) and math.isfinite(height)):
        raise ValueError(f"width and height must be finite, got {width} and {height}")


TUTORIAL_SIZE = (640, 400)
"""Width and height of the frame of the tutorial scenes."""

_TUTORIAL_TRIANGLES = {
    "wide": [(10, 190), (630, 180), (300, 240)],
    "tall": [(310, 10), (330, 390), (280, 210)],
    "vertical-edge": [(200, 50), (200, 350), (450, 180)],
    "horizontal-edge": [(100, 80), (540, 80), (350, 340)],
    "right-angled": [(100, 50), (100, 350), (500, 350)],
    "coincident-vertices": [(120, 100), (120, 100), (480, 300)],
    "single-point": [(320, 200), (320, 200), (320, 200)],
    "horizontal-sliver": [(20, 200), (620, 201), (300, 201)],
    "vertical-sliver": [(320, 20), (321, 380), (321, 200)],
    "horizontal-line": [(20, 200), (620, 200), (300, 200)],
    "vertical-line": [(320, 20), (320, 380), (320, 150)],
}


def _tutorial_triangle(corners: list[tuple[int, int]]) -> Shape:
    return np.array(corners, dtype=float), np.array([[0, 1, 2]], dtype=np.int32)


def two_triangles() -> Shape:
    """The upper left and the lower right half of a square: they share the edge from (100, 50) to (50, 100)."""
    return np.array([[50.0, 50], [100, 50], [50, 100], [100, 100]]), np.array([[0, 1, 2], [1, 2, 3]], dtype=np.int32)


def square_of_four() -> Shape:
    """The square of `two_triangles` as four triangles round its centre (75, 75)."""
    vertices = np.array([[50.0, 50], [100, 50], [100, 100], [50, 100], [75, 75]])
    return vertices, np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], dtype=np.int32)


def composite_triangle(*, major: str = "right") -> Shape:
    """A triangle cut at its middle vertex into a flat bottom and a flat top, which share the edge in row 70.

    Scanline fillers call it composite, and draw it as two flat triangles; its long (major) edge is on the right or on
    the left.
    """
    x = np.array([70.0, 50, 80, 100])  # the top, the middle vertex, the cut of the long edge, the bottom
    vertices = np.stack([x if major == "right" else 150 - x, [50.0, 70, 70, 110]], axis=-1)
    return vertices, np.array([[0, 1, 2], [1, 3, 2]], dtype=np.int32)


def tight_fan(n: int = 16, *, sideways: bool = False) -> Shape:
    """A fan of `n` triangles from (50, 50), downwards or to the right: 100 pixels long, 3 wide at the far end."""
    rim = np.stack([50.0 + 3 * np.arange(n + 1), np.full(n + 1, 150.0)], axis=-1)
    vertices = np.concatenate([[[50.0, 50.0]], rim[:, ::-1] if sideways else rim])
    i = np.arange(1, n + 1, dtype=np.int32)
    return vertices, np.stack([0 * i, i, i + 1], axis=-1)


TUTORIAL_SCENES: Mapping[str, Callable[[], Shape]] = MappingProxyType(
    {name: partial(_tutorial_triangle, corners) for name, corners in _TUTORIAL_TRIANGLES.items()}
    | {
        "two-triangles": two_triangles,
        "square-of-four": square_of_four,
        "composite-major-right": composite_triangle,
        "composite-major-left": partial(composite_triangle, major="left"),
        "tight-fan": tight_fan,
        "tight-fan-sideways": partial(tight_fan, sideways=True),
    }
)
"""The test scenes of tutorials by name: functions that return vertices, on whole pixels, and triangles.

`docs/guide/methods.md` has the errors of each method on them, in pixels.
"""


# From object space to pixels


def to_clip(vertices: F64, matrix: F64) -> F64:
    """Clip-space vertices (V, 4) of object-space vertices (V, 3), by a (4, 4) clip-from-object matrix."""
    return np.concatenate([vertices, np.ones((len(vertices), 1))], axis=-1) @ np.asarray(matrix).T


def to_pixels(clip: F64, width: int = 1920, height: int = 1080) -> F64:
    """Pixel-space vertices (V, 3) of clip-space vertices (V, 4) with w > 0: x px, y px (down), z in [0, 1]."""
    clip = np.asarray(clip, np.float64)
    ndc = clip[:, :3] / clip[:, 3:]
    return np.stack([(ndc[:, 0] + 1) * width / 2, (1 - ndc[:, 1]) * height / 2, (ndc[:, 2] + 1) / 2], axis=-1)


# Shapes in object space: closed, outward counter-clockwise


def blob(n_triangles: int, seed: int = 3) -> Shape:  # noqa: ARG001
    """A bumpy sphere of about `n_triangles`, radius about 1, with a vertex per column at either pole.

    `seed` is there for the sake of the signature that all scenes share; the bumps are a formula.

    Returns
    -------
    vertices : (m, 3) float64, object space
    triangles : (k, 3) int32; triangles at the poles have no area
    """
    columns = max(8, round(math.sqrt(n_triangles)))
    rows = max(4, n_triangles // (2 * columns))
    theta = np.linspace(0, np.pi, rows + 1)[:, None]
    phi = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None, :]
    large_bumps = 0.08 * np.sin(7 * phi) * np.sin(5 * theta)
    small_bumps = 0.03 * np.cos(23 * phi + 17 * theta) * np.sin(theta) ** 2
    radius = 1 + large_bumps + small_bumps
    vertices = np.stack(
        [radius * np.sin(theta) * np.cos(phi), radius * np.cos(theta) + 0 * phi, radius * np.sin(theta) * np.sin(phi)],
        axis=-1,
    )
    return vertices.reshape(-1, 3), _grid_triangles(rows, columns)


def _smooth_blob(n_triangles: int = 20_000) -> Shape:
    """The blob with a vertex at either pole and no empty triangles, for shading."""
    vertices, triangles = blob(n_triangles)
    columns = int(triangles[0, 2])  # the second row starts below vertex 0
    remap = np.arange(len(vertices))
    remap[:columns] = 0
    remap[-columns:] = len(vertices) - columns
    a, b, c = remap[triangles].T
    has_area = (a != b) & (b != c) & (c != a)
    used, compact = np.unique(remap[triangles[has_area]], return_inverse=True)
    return vertices[used], compact.reshape(-1, 3).astype(np.int32)


def torus(radius: float = 1.0, tube_radius: float = 0.4, segments: int = 128, sections: int = 64) -> Shape:
    """A ring in the plane y = 0: `segments` along it, `sections` round its tube."""
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    curve = radius * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=-1)
    tangent = np.stack([-np.sin(angle), 0 * angle, np.cos(angle)], axis=-1)
    return _tube(curve, tangent, -curve, tube_radius, sections)


def torus_knot(p: int = 2, q: int = 3, tube_radius: float = 0.32, segments: int = 512, sections: int = 48) -> Shape:
    """The (p, q) knot on a torus of radii 1 and 0.5 about the z axis, with a round tube."""
    t = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    ring = 1 + 0.5 * np.cos(q * t)
    ring_t = -0.5 * q * np.sin(q * t)
    cos, sin = np.cos(p * t), np.sin(p * t)
    curve = np.stack([ring * cos, ring * sin, 0.5 * np.sin(q * t)], axis=-1)
    tangent = np.stack([ring_t * cos - p * ring * sin, ring_t * sin + p * ring * cos, 0.5 * q * np.cos(q * t)], axis=-1)
    outward_of_torus = np.stack([np.cos(q * t) * cos, np.cos(q * t) * sin, np.sin(q * t)], axis=-1)
    return _tube(curve, tangent, outward_of_torus, tube_radius, sections)


def icosphere(subdivisions: int = 2) -> Shape:
    """The unit sphere: an icosahedron with its triangles quartered `subdivisions` times."""
    vertices, triangles = _ICOSAHEDRON
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    for _ in range(subdivisions):
        edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges, index = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = (index.reshape(-1, 3) + len(vertices)).T
        a, b, c = triangles.T
        corners = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        triangles = np.concatenate([np.stack(corner, axis=-1) for corner in corners])
        middle = vertices[edges].sum(axis=1)
        vertices = np.concatenate([vertices, middle / np.linalg.norm(middle, axis=1, keepdims=True)])
    return vertices, triangles.astype(np.int32)


def tetrahedron() -> Shape:
    """The regular tetrahedron with corners on alternate corners of the cube, faces not smoothed."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    return _faceted(corners, np.array([[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]]))


def cube() -> Shape:
    """The cube [-1, 1]**3: 24 vertices, four per face, so that its faces are not smoothed."""
    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return _faceted(corners, np.array(sides))


def octahedron() -> Shape:
    """The regular octahedron with corners at distance 1 on the axes, faces not smoothed."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    upper = np.array([[0, 1, 2], [3, 2, 1], [0, 2, 4], [3, 4, 2]])
    lower = np.array([[0, 5, 1], [3, 1, 5], [0, 4, 5], [3, 5, 4]])
    return _faceted(corners, np.concatenate([upper, lower]))


def icosahedron() -> Shape:
    """The regular icosahedron with corners at distance 1, faces not smoothed."""
    vertices, triangles = _ICOSAHEDRON
    return _faceted(vertices / np.linalg.norm(vertices, axis=1, keepdims=True), triangles)


def _grid_triangles(rows: int, columns: int) -> I32:
    """Triangles of a grid of (rows + 1, columns) vertices that is closed from the last column to the first."""
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    upper = np.stack([a, b, c], axis=-1).reshape(-1, 3)
    lower = np.stack([b, d, c], axis=-1).reshape(-1, 3)
    return np.concatenate([upper, lower]).astype(np.int32)


def _tube(curve: F64, tangent: F64, toward: F64, tube_radius: float, sections: int) -> Shape:
    """A closed tube round a closed curve; `toward` (n, 3) fixes where a section starts, so nothing twists."""
    tangent = tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = toward - (toward * tangent).sum(axis=1, keepdims=True) * tangent
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    binormal = np.cross(tangent, normal)
    angle = np.linspace(0, 2 * np.pi, sections, endpoint=False)[:, None]
    offset = np.cos(angle) * normal[:, None] + np.sin(angle) * binormal[:, None]
    vertices = (curve[:, None] + tube_radius * offset).reshape(-1, 3)
    return vertices, (_grid_triangles(len(curve), sections) % len(vertices)).astype(np.int32)


def _faceted(corners: F64, polygons: npt.NDArray[Any]) -> Shape:
    """Convex polygons (n, k) of shared corners as a mesh in which no two of them share a vertex."""
    n, k = polygons.shape
    fan = np.array([[0, i, i + 1] for i in range(1, k - 1)])
    triangles = (np.arange(n)[:, None, None] * k + fan).reshape(-1, 3)
    return corners[polygons].reshape(-1, 3), triangles.astype(np.int32)


_ICOSAHEDRON = (
    np.array(
        [[-1, GOLDEN_RATIO, 0], [1, GOLDEN_RATIO, 0], [-1, -GOLDEN_RATIO, 0], [1, -GOLDEN_RATIO, 0]]
        + [[0, -1, GOLDEN_RATIO], [0, 1, GOLDEN_RATIO], [0, -1, -GOLDEN_RATIO], [0, 1, -GOLDEN_RATIO]]
        + [[GOLDEN_RATIO, 0, -1], [GOLDEN_RATIO, 0, 1], [-GOLDEN_RATIO, 0, -1], [-GOLDEN_RATIO, 0, 1]]
    ),
    np.array(
        [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11]]
        + [[1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8]]
        + [[3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9]]
        + [[4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]]
    ),
)


def _fine_sphere() -> Shape:
    """The unit sphere of 20480 triangles: no corner shows in the outline."""
    return icosphere(5)


SHAPES: Mapping[str, Callable[..., Shape]] = MappingProxyType(
    {
        "blob": _smooth_blob,
        "cube": cube,
        "icosahedron": icosahedron,
        "icosphere": icosphere,
        "octahedron": octahedron,
        "sphere": _fine_sphere,
        "tetrahedron": tetrahedron,
        "torus": torus,
        "torus-knot": torus_knot,
    }
)
"""The built-in shapes by name: each a function that returns vertices and triangles."""


def shape(name: str, **parameters: Any) -> Shape:
    """A built-in shape: closed, outward counter-clockwise, about as large as the unit sphere.

    Parameters
    ----------
    name : str
        A name of `SHAPES`.
    **parameters
        Parameters of the function of that name, `segments=` for the torus, say.

    Returns
    -------
    vertices : (V, 3) float64, object space
    triangles : (T, 3) int32

    Raises
    ------
    ValueError
        If there is no shape of that name.

    Examples
    --------
    >>> vertices, triangles = shape("cube")
    >>> vertices.shape, triangles.shape
    ((24, 3), (12, 3))
    """
    if not (isinstance(name, str) and name in SHAPES):
        raise ValueError(f"no built-in shape {name!r}; there are {', '.join(SHAPES)}")
    return SHAPES[name](**parameters)
