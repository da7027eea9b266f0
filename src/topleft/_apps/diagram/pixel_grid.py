"""Draws magnified pixels with the triangles on them: a rasterizer's decisions, to be looked at.

In: values of pixels, triangles in pixels. Out: SVG, or PNG by Pillow.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from html import escape
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core.base.arrays import as_array, as_checked_triangles, as_count, as_path, as_size, as_vertices, shown
from topleft._core.base.color import ColorLike, as_color, id_colors
from topleft._core.base.options import Sampling, parse_sampling
from topleft._core.base.whole_file import write_whole
from topleft.annex.pictures import sample_positions
from topleft.errors import ImageError
from topleft.typing import SamplingOption

SMOOTH = 4
"""A PNG is drawn so many times as large, and reduced."""

MARGIN_PX = 0.5
"""Round the pixels, in pixels of the grid."""

INK = "#1d2733"
GRID_LINE = "#c9ced6"
EMPTY = "#ffffff"
LOW, HIGH = np.array([243, 246, 250]), np.array([44, 110, 180])
"""Colours of the least and the greatest value."""


class Shape(NamedTuple):
    """Something to draw, in units of the file."""

    kind: Literal["box", "line", "dot", "text"]
    at: tuple[float, float]
    end: tuple[float, float]
    color: str
    size: float
    text: str = ""


def pixel_grid(
    values: ArrayLike | None = None,
    vertices: ArrayLike | None = None,
    triangles: ArrayLike | None = None,
    *,
    size: int | tuple[int, int] | None = None,
    sampling: SamplingOption | None = None,
    numbers: bool = True,
    cell: int = 32,
    edge_color: ColorLike = "#d1495b",
    path: str | os.PathLike[str] | None = None,
) -> str:
    """Return a picture of magnified pixels, as SVG: their values, the triangles over them, and their samples.

    Parameters
    ----------
    values : array_like, optional
        (H, W) of bool, counts, ids (-1 stays empty) or numbers, from pale to dark; or (H, W, 3) or (H, W, 4) uint8,
        colours. Results of `coverage`, `overdraw`, `rasterize` and `fill` fit.
    vertices, triangles : array_like, shape (V, 2 or more) and (T, 3), optional
        In pixels: their edges are drawn.
    size : (width, height), optional
        How many pixels; needed without `values`.
    sampling : {"center", "msaa2", "msaa4", "msaa8", "msaa16"}, optional
        The samples to mark with dots; none unless given.
    numbers : bool
        Whether values are written into the pixels.
    cell : int
        How large a pixel is drawn, in units of the SVG or pixels of the PNG.
    edge_color : str, or integers of 0 to 255, or floats of 0 to 1
        Of the edges.
    path : path, optional
        Where to write it: .svg, or .png.

    Returns
    -------
    str
        The SVG, whatever is written.

    Raises
    ------
    ValueError
        If there are neither values nor a size, a shape does not fit, or an option is unknown.
    TypeError
        If an array holds other things than numbers.
    ImageError
        If the path ends in something else.

    Examples
    --------
    >>> import topleft as tl
    >>> vertices, triangles = [[0.5, 0.5], [7, 2], [2, 5]], [[0, 1, 2]]
    >>> mask = tl.coverage(vertices, triangles, (8, 6))
    >>> tl.pixel_grid(mask, vertices, triangles, sampling="center").count("<circle")
    48
    """
    cells = None if values is None else as_cells(values)
    if cells is None and size is None:
        raise ValueError("pixel_grid needs values or a size, got neither")
    width, height = (cells.shape[1], cells.shape[0]) if cells is not None else as_plain_size(size)
    if size is not None and as_plain_size(size) != (width, height):
        raise ValueError(f"size must be that of the values, {(width, height)}, got {size}")
    scale = as_count("cell", cell)
    shapes = list(draw_cells(cells, width, height, scale, numbers=numbers and cells is not None and cells.ndim == 2))
    if vertices is not None or triangles is not None:
        color = "#{:02x}{:02x}{:02x}".format(*as_color("edge_color", edge_color, 3))
        shapes += draw_edges(vertices, triangles, scale, color)
    if sampling is not None:
        shapes += draw_samples(parse_sampling(sampling), width, height, scale)
    full = (width + 2 * MARGIN_PX) * scale, (height + 2 * MARGIN_PX) * scale
    svg = as_svg(shapes, full)
    if path is not None:
        target = as_path("path", path)
        kind = target.suffix.lower()
        if kind not in (".svg", ".png"):
            raise ImageError(f"cannot write {str(target)!r}: format {target.suffix!r} is none of .svg .png")
        write_whole(target, lambda file: file.write(svg.encode() if kind == ".svg" else as_png(shapes, full)))
    return svg


def as_plain_size(size: object) -> tuple[int, int]:
    """A size of pixels, at least one."""
    return as_size(size, smallest=1)


def as_cells(values: ArrayLike) -> NDArray[Any]:
    """Values (H, W), or colours (H, W, 3 or 4) uint8."""
    array = as_array("values", values)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"values must be numbers, got {shown(values)}")
    is_picture = array.ndim == 3 and array.shape[2] in (3, 4) and array.dtype == np.uint8
    if not (array.ndim == 2 or is_picture) or not array.size:
        raise ValueError(f"values must have shape (H, W), or (H, W, 3) or (H, W, 4) of uint8, got {array.shape}")
    return array


def colors_of(cells: NDArray[Any]) -> NDArray[np.uint8]:
    """A colour (H, W, 3) for each value: ids by turns, other numbers from pale to dark."""
    if cells.ndim == 3:
        share = cells[..., 3:] / 255 if cells.shape[2] == 4 else 1.0
        return np.rint(cells[..., :3] * share + 255 * (1 - share)).astype(np.uint8)
    if cells.dtype.kind == "i" and cells.min() < 0:
        found = np.full((*cells.shape, 3), 255, np.uint8)
        found[cells >= 0] = id_colors(cells[cells >= 0])
        return found
    numbers = cells.astype(np.float64)
    finite = np.isfinite(numbers)
    low, high = (min(numbers[finite].min(), 0.0), numbers[finite].max()) if finite.any() else (0.0, 0.0)
    share = np.where(finite, (numbers - low) / ((high - low) or 1.0), 0.0)
    return np.rint(LOW + (HIGH - LOW) * np.clip(share, 0, 1)[..., None]).astype(np.uint8)


def draw_cells(cells: NDArray[Any] | None, width: int, height: int, scale: int, *, numbers: bool) -> Iterator[Shape]:
    """The squares of the pixels, the text in them, and the lines between them."""
    edge = MARGIN_PX * scale
    if cells is not None:
        for (row, column), color in zip(np.ndindex(height, width), colors_of(cells).reshape(-1, 3), strict=True):
            x, y = edge + column * scale, edge + row * scale
            yield Shape("box", (x, y), (x + scale, y + scale), "#{:02x}{:02x}{:02x}".format(*color), 0)
            if numbers and (text := text_of(cells[row, column])):
                ink = "#ffffff" if color @ [299, 587, 114] < 128000 else INK
                yield Shape(
                    "text", (x + scale / 2, y + scale / 2), (0, 0), ink, scale * min(0.4, 1.5 / len(text)), text
                )
    for column in range(width + 1):
        x = edge + column * scale
        yield Shape("line", (x, edge), (x, edge + height * scale), GRID_LINE, 1)
    for row in range(height + 1):
        y = edge + row * scale
        yield Shape("line", (edge, y), (edge + width * scale, y), GRID_LINE, 1)


def text_of(value: Any) -> str:
    """The text of a pixel: empty for False, 0, -1 and numbers that are not finite."""
    number = float(value)
    if value.dtype.kind == "b" or not np.isfinite(number) or number == 0 or (value.dtype.kind == "i" and number < 0):
        return ""
    return f"{number:.3g}"


def draw_edges(vertices: ArrayLike | None, triangles: ArrayLike | None, scale: int, color: str) -> list[Shape]:
    """The edges of triangles, each once."""
    if vertices is None or triangles is None:
        raise ValueError("vertices and triangles belong together: one of them is missing")
    points = as_vertices(vertices, has_transform=False).astype(np.float64)
    if points.shape[1] > 3:
        raise ValueError(f"vertices must be in pixels, (V, 2) or (V, 3), got {points.shape}")
    corners = as_checked_triangles(triangles, len(points))
    pairs = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    ends = (points[:, :2] + MARGIN_PX) * scale
    found = []
    for first, second in np.unique(pairs, axis=0).tolist():
        if np.isfinite(ends[[first, second]]).all():
            (x, y), (to_x, to_y) = ends[first].tolist(), ends[second].tolist()
            found.append(Shape("line", (x, y), (to_x, to_y), color, max(1.0, scale / 16)))
    return found


def draw_samples(sampling: Sampling, width: int, height: int, scale: int) -> Iterator[Shape]:
    """A dot at each sample."""
    if sampling in (Sampling.AREA, Sampling.OUTER, Sampling.INNER):
        raise ValueError(f"sampling {str(sampling)!r} has no samples to mark")
    n = sampling.n_samples
    offsets = (0.5 + sample_positions(n, 8) / 256).tolist()
    radius = max(0.75, scale / (16 if n <= 4 else 24))
    for row, column in np.ndindex(height, width):
        for x, y in offsets:
            at = (MARGIN_PX + column + x) * scale, (MARGIN_PX + row + y) * scale
            yield Shape("dot", at, (0, 0), INK, radius)


def as_svg(shapes: list[Shape], full: tuple[float, float]) -> str:
    """The shapes as SVG."""
    width, height = full
    full_size = f'width="{width:g}" height="{height:g}"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {full_size} viewBox="0 0 {width:g} {height:g}">',
        f'<rect width="{width:g}" height="{height:g}" fill="{EMPTY}"/>',
    ]
    for one in shapes:
        (x, y), (to_x, to_y) = one.at, one.end
        if one.kind == "box":
            lines.append(f'<rect x="{x:g}" y="{y:g}" width="{to_x - x:g}" height="{to_y - y:g}" fill="{one.color}"/>')
        elif one.kind == "line":
            ends = f'x1="{x:.6g}" y1="{y:.6g}" x2="{to_x:.6g}" y2="{to_y:.6g}"'
            lines.append(f'<line {ends} stroke="{one.color}" stroke-width="{one.size:g}" stroke-linecap="round"/>')
        elif one.kind == "dot":
            lines.append(f'<circle cx="{x:.6g}" cy="{y:.6g}" r="{one.size:g}" fill="{one.color}"/>')
        else:
            font = (
                f'font-family="sans-serif" font-size="{one.size:.4g}" text-anchor="middle" dominant-baseline="central"'
            )
            lines.append(f'<text x="{x:g}" y="{y:g}" {font} fill="{one.color}">{escape(one.text)}</text>')
    return "\n".join([*lines, "</svg>\n"])


def as_png(shapes: list[Shape], full: tuple[float, float]) -> bytes:
    """The shapes as the bytes of a PNG."""
    import io

    from PIL import Image, ImageDraw, ImageFont

    width, height = (round(side) for side in full)
    image = Image.new("RGB", (width * SMOOTH, height * SMOOTH), EMPTY)
    draw = ImageDraw.Draw(image)
    for one in shapes:
        (x, y), (to_x, to_y) = ((a * SMOOTH, b * SMOOTH) for a, b in (one.at, one.end))
        if one.kind == "box":
            draw.rectangle((x, y, to_x - 1, to_y - 1), fill=one.color)
        elif one.kind == "line":
            draw.line((x, y, to_x, to_y), fill=one.color, width=max(1, round(one.size * SMOOTH)))
        elif one.kind == "dot":
            r = one.size * SMOOTH
            draw.ellipse((x - r, y - r, x + r, y + r), fill=one.color)
        else:
            font = ImageFont.load_default(size=one.size * SMOOTH)
            draw.text((x, y), one.text, fill=one.color, font=font, anchor="mm")
    file = io.BytesIO()
    image.resize((width, height), Image.Resampling.BOX).save(file, format="PNG")
    return file.getvalue()
