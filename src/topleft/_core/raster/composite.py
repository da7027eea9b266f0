"""Order-independent transparency: colours of sorted layers, seen through each other.

In: `DepthLayers` and colours.  Out: a picture with alpha.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core import engine
from topleft._core.base.arrays import apart_from, as_array, as_background, as_drawn_colors, as_number, as_out
from topleft._core.base.memory import empty
from topleft._core.base.options import parse
from topleft._core.base.threads import available_threads, parse_threads, run_parts
from topleft._core.raster.peel import DepthLayers
from topleft.typing import PerOption

#: Interpolated colours that are held at a time by each thread.
BAND_BYTES = 4 << 20

#: Below this many pixels one thread composites a picture.
MIN_PIXELS_PER_THREAD = 1 << 16


def composite(
    layers: DepthLayers,
    colors: ArrayLike,
    *,
    opacity: float | None = None,
    per: PerOption = "auto",
    background: ArrayLike | None = None,
    out: NDArray[Any] | None = None,
    threads: int | None = None,
) -> NDArray[Any]:
    """Return the picture of transparent layers, the same for every order of the triangles.

    Parameters
    ----------
    layers : DepthLayers
        The result of `peel`.
    colors : array_like of uint8 or float32
        Of the triangles (T, C), of the vertices (V, C), or of each layer of each pixel (H, W, K, C): straight colours,
        the last channel alpha, C 2 or 4; with `opacity` C is 1 or 3. uint8 runs to 255, float32 to 1. Of a scene T
        counts the triangles of all instances, and there are no colours of vertices.
    opacity : float, 0 to 1, optional
        Alpha of all colours, which then have no channel for it; with uint8 rounded to one of its 255 steps.
    per : "auto", "triangle", "vertex" or "pixel"
        The owners of the colours; "auto" decides by the shape, which must not fit two.
    background : array_like, shape (C,), optional
        The colour behind all layers, in the range of the colours, with alpha; nothing unless given.
    out : ndarray, shape (H, W, C), optional
        Where the result goes.
    threads : int, optional
        How many threads work; never changes a bit.

    Returns
    -------
    ndarray of uint8 or float32, shape (H, W, C)
        Straight colours with alpha, C counting it; 0 where nothing is.

    Raises
    ------
    ValueError
        If colours fit no, or two, of the shapes, have no alpha or one too many, or an option is out of range.
    TypeError
        If `layers` are none, or colours are neither uint8 nor float.

    Notes
    -----
    Layer k counts ``w[k] = a[k] * (1 - a[0]) * ... * (1 - a[k-1])``; the colour is the mean of the colours by w, the
    alpha their sum: "over", from front to back. This is computed in float64 and rounded once: uint8 to nearest, ties
    to even. Colours of vertices are perspective-correct, alpha too, and rounded to float32 before. Surfaces behind
    the last peeled layer are not seen.

    References
    ----------
    T. Porter, T. Duff, Compositing Digital Images, 1984; C. Everitt, Interactive Order-Independent Transparency, 2001.

    Examples
    --------
    >>> import topleft as tl
    >>> vertices = [[0, 0, 5], [4, 0, 5], [0, 4, 5], [0, 0, 0], [2, 0, 2], [0, 2, 2]]
    >>> layers = tl.peel(vertices, [[0, 1, 2], [3, 4, 5]], (3, 1))
    >>> tl.composite(layers, [[200], [0]], opacity=0.5, background=(100, 255))[0].tolist()
    [[75, 255], [150, 255], [150, 255]]
    """
    if not isinstance(layers, DepthLayers):
        raise TypeError(f"layers must be the result of peel, got {type(layers).__name__}")
    n_layers, height, width = layers.planes[0].shape
    palette = as_palette(apart_from(out, "colors", colors), opacity)
    wish = find_owner(palette, per, layers)
    n_channels, is_u8 = palette.shape[-1], palette.dtype == np.uint8
    ground = as_background(background, palette.reshape(-1, n_channels))
    if ground is not None:
        ground = np.ascontiguousarray(np.broadcast_to(ground, (n_channels,)), np.float32)
    shape = (height, width, n_channels)
    result = empty(shape, palette.dtype) if out is None else as_out("out", out, shape, palette.dtype.type)
    canvas = result if result.flags.carray else empty(shape, palette.dtype)
    rows_at_once = max(1, BAND_BYTES // max(1, 4 * n_layers * width * n_channels))

    def draw_rows(first: int, end: int) -> None:
        for top in range(first, end, rows_at_once):
            n_rows = min(rows_at_once, end - top)
            own = palette if wish == "triangle" else colors_of_rows(layers, palette, wish, top, n_rows)
            engine.composite(
                layers.planes[0], layers.n_triangles, top, n_rows, engine.as_bytes(own), wish == "triangle", is_u8,
                n_channels, ground, engine.as_bytes(canvas),
            )  # fmt: skip

    n_threads = parse_threads(threads) or min(available_threads(), max(1, height * width // MIN_PIXELS_PER_THREAD))
    run_parts(draw_rows, height, min(n_threads, max(1, height)))
    if canvas is not result:
        result[...] = canvas
    return result


def as_palette(colors: ArrayLike, opacity: float | None) -> NDArray[Any]:
    """Return contiguous uint8 or float32 colours with alpha."""
    array = as_drawn_colors(as_array("colors", colors))
    allowed = (2, 4) if opacity is None else (1, 3)
    if array.ndim not in (2, 4) or array.shape[-1] not in allowed:
        reason = "alpha among them" if opacity is None else "with opacity"
        raise ValueError(
            f"colors must have {allowed[0]} or {allowed[1]} channels, {reason}, and shape (T, C), (V, C) or "
            f"(H, W, K, C), got {array.shape}"
        )
    if opacity is not None:
        if not 0 <= as_number("opacity", opacity) <= 1:
            raise ValueError(f"opacity must lie in 0 to 1, got {opacity}")
        alpha = np.rint(255 * opacity) if array.dtype == np.uint8 else opacity
        array = np.concatenate([array, np.full((*array.shape[:-1], 1), alpha, array.dtype)], -1)
    return array


def find_owner(palette: NDArray[Any], per: str, layers: DepthLayers) -> str:
    """Return the owner of a row of colours: "triangle", "vertex" or "pixel"."""
    n_layers, height, width = layers.planes[0].shape
    rows: dict[str, tuple[int, ...]] = {"triangle": (layers.n_triangles,), "pixel": (height, width, n_layers)}
    if layers.n_vertices is not None:
        rows["vertex"] = (layers.n_vertices,)
    if per == "pixel" or (per == "auto" and palette.ndim == 4):
        choices = ["pixel"]
    elif parse(PerOption, "per", per) == "auto":
        choices = [name for name in ("triangle", "vertex") if palette.shape[:-1] == rows.get(name)]
        if len(choices) > 1:
            raise ValueError(
                f"colors fit triangles and vertices, {len(palette)} of each: say per='triangle' or 'vertex'"
            )
    else:
        choices = [per]
    if not choices or palette.shape[:-1] != rows.get(choices[0]):
        wishes = [f"{shape} for {name}s" for name, shape in rows.items() if per in ("auto", name)]
        raise ValueError(f"colors must have rows of shape {' or '.join(wishes)}, got {palette.shape[:-1]}")
    return choices[0]


def colors_of_rows(layers: DepthLayers, palette: NDArray[Any], wish: str, top: int, n_rows: int) -> NDArray[np.float32]:
    """Return the colours of each layer in some rows, (K, n_rows, W, C) float32."""
    if wish == "pixel":
        return np.ascontiguousarray(np.moveaxis(palette[top : top + n_rows], 2, 0), np.float32)
    return np.stack([layers.rows(k, top, n_rows).interpolate(palette) for k in range(len(layers))])
