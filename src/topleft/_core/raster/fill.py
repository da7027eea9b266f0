"""Fills a picture with the colours of triangles: of the visible triangle of a pixel, or blended in their order.

Several samples are resolved: their colours are averaged, as values or in linear light. With straight alpha
colours are weighted by it: the mean of premultiplied colours, made straight again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, cast, get_args

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from topleft._core import engine
from topleft._core.base.arrays import apart_from, as_array, as_background, as_colors, shown
from topleft._core.base.color import srgb_tables
from topleft._core.base.memory import Memory
from topleft._core.base.options import Sampling, Sink, parse
from topleft._core.base.threads import run_parts
from topleft._core.raster import choices
from topleft._core.raster.choices import FillRoute
from topleft._core.raster.classic import fill_classic
from topleft._core.raster.rasterize import Canvas, draw, draw_all_samples
from topleft._core.raster.sampling import SAMPLE_GRID_BITS, SamplePass, draw_means, sample_positions
from topleft._core.raster.snap import Snapped, snap_mesh
from topleft._core.raster.view import View
from topleft.typing import AlphaOption, BlendOption, PerOption, ResolveOption

BLEND_CODES = {mode: code for code, mode in enumerate(get_args(BlendOption))}  # tl_blend in csrc/topleft.h


@dataclass(frozen=True, slots=True)
class Style:
    """The options of `fill` that other verbs do not have, not yet checked."""

    per: PerOption
    background: ArrayLike | None
    blend: BlendOption
    alpha: AlphaOption
    resolve: ResolveOption
    dtype: DTypeLike | None = None


@dataclass(frozen=True, slots=True)
class Blending:
    """How `fill` puts a colour into a pixel."""

    mode: BlendOption
    alpha: AlphaOption
    by_area: bool
    has_alpha: bool

    @classmethod
    def parse(cls, mode: object, alpha: object, colors: NDArray[Any], view: View) -> Blending:
        """Check the options of a call."""
        n_channels = 1 if colors.ndim == 1 else colors.shape[1]
        modes = parse(BlendOption, "blend", mode), parse(AlphaOption, "alpha", alpha)
        chosen = cls(*modes, by_area=view.sampling is Sampling.AREA, has_alpha=n_channels in (2, 4))
        if chosen.mode == "over" and not chosen.has_alpha:
            raise ValueError(
                f"colors must have 2 or 4 channels, the last of them alpha, for blend 'over', got {n_channels}"
            )
        if view.classic and chosen.mode != "replace":
            raise ValueError(f"blend must be 'replace' for method {view.classic.name!r}, got {str(chosen.mode)!r}")
        return chosen

    @property
    def is_needed(self) -> bool:
        """False when a triangle simply replaces the colour of its samples."""
        return self.by_area or self.mode != "replace"

    @property
    def codes(self) -> tuple[int, bool]:
        """The mode as kernels know it, and whether colours have been multiplied by alpha."""
        return BLEND_CODES[self.mode], self.alpha == "premultiplied"

    @property
    def is_straight(self) -> bool:
        """Whether the mode treats the last channel as alpha that colours have not been multiplied by."""
        return self.has_alpha and self.alpha == "straight" and self.mode in ("over", "replace")


class Painting(NamedTuple):
    """A snapped mesh, its colours, and the contiguous pixels that they are written to."""

    memory: Memory
    snapped: Snapped
    view: View
    colors: NDArray[Any]
    pixels: NDArray[Any]
    transfer: engine.Transfer | None  # how samples are averaged; None: the mean of values
    is_flat: bool  # a row of colours belongs to a triangle, not to a vertex
    ground: NDArray[Any] | None  # the colour that all pixels get first; None: they stay as they are

    @property
    def n_channels(self) -> int:
        """Numbers of a colour."""
        return 1 if self.colors.ndim == 1 else self.colors.shape[1]

    @property
    def is_u8(self) -> bool:
        """Whether colours are uint8; otherwise they are float32."""
        return self.colors.itemsize == 1

    @property
    def ground_bytes(self) -> NDArray[np.uint8] | None:
        """The ground as kernels read it."""
        return None if self.ground is None else engine.as_bytes(np.full(self.pixels.shape[2:] or 1, self.ground))

    def with_ground_laid(self) -> Painting:
        """Give all pixels the ground: the first row, and the others row by row, which NumPy copies fast."""
        self.pixels[:1] = self.ground
        self.pixels[1:] = self.pixels[:1]
        return self._replace(ground=None)

    def samples(self, n_threads: int) -> SamplePass:
        """Return the pass that draws its samples."""
        positions = sample_positions(self.view.sampling.n_samples, self.view.grid_bits)
        return SamplePass(self.memory, self.snapped.mesh, positions, n_threads)


def draw_fill(
    memory: Memory, vertices: ArrayLike, triangles: ArrayLike, colors: ArrayLike, view: View, style: Style, out: object
) -> NDArray[Any]:
    """Draw as `fill` does, in this memory."""
    if view.sampling in (Sampling.OUTER, Sampling.INNER):
        raise ValueError(
            f"sampling {str(view.sampling)!r} gives no order: fill takes 'center', 'msaa2' to 'msaa16' and 'area'"
        )
    colors = apart_from(out, "colors", colors)
    if style.dtype is not None:
        return draw_labels(memory, vertices, triangles, colors, view, style, out)
    palette = as_colors(colors)
    blending = Blending.parse(style.blend, style.alpha, palette, view)
    transfer = parse_resolve(style.resolve, palette, view, is_straight=blending.is_straight)
    if view.classic:
        return fill_classic(view.classic, memory, vertices, triangles, palette, view, style.per, style.background, out)
    snapped = snap_mesh(memory, vertices, triangles, view, with_depth=False, out=out)
    is_flat = colors_are_flat(len(palette), snapped.n_triangles, snapped.n_vertices, style.per)
    shape = (*view.size[::-1], *palette.shape[1:])
    ground = as_background(style.background, palette)
    with Canvas.of(memory, "fill", out, shape, palette.dtype.type, keep=ground is None) as (result, canvas):
        if ground is None and out is None:
            ground = np.zeros((), palette.dtype)
        painting = Painting(memory, snapped, view, palette, canvas, transfer, is_flat, ground)
        route = choices.fill_route(
            view, snapped.work, palette, is_flat=is_flat, is_mixed=blending.is_needed, has_ground=ground is not None
        )
        if ground is not None and not choices.lays_ground(route, view, is_flat=is_flat):
            painting = painting.with_ground_laid()
        if route is FillRoute.SHAPES:
            fill_large_shapes(painting, blending)
        elif route is FillRoute.BLENDED:
            blend(painting, blending)
        elif route is FillRoute.SAMPLES:
            paint_samples(painting)
        elif route is FillRoute.LABELS:
            paint(painting)
    view.mark("shade")
    return result


def draw_labels(
    memory: Memory, vertices: ArrayLike, triangles: ArrayLike, labels: ArrayLike, view: View, style: Style, out: object
) -> NDArray[Any]:
    """`fill` with integers that are no colours: each pixel has exactly the label of its triangle."""
    try:
        dtype = np.dtype(style.dtype)
    except (TypeError, ValueError):
        raise TypeError(f"dtype must be one of integers, for labels, got {shown(style.dtype)}") from None
    if dtype.kind not in "iub":
        raise TypeError(f"dtype must be one of integers, for labels, got {dtype}")
    array = as_array("colors", labels)
    if array.dtype.kind not in "iub" or array.ndim not in (1, 2):
        raise TypeError(f"colors must be integers of shape (T,) or (T, C) with dtype=, got {array.dtype} {array.shape}")
    own = array.astype(dtype)
    if not np.array_equal(own, array):
        raise ValueError(f"colors must fit {dtype}, got {array.min()}..{array.max()}")
    wishes = (
        ("per", style.per, ("auto", "triangle")), ("blend", style.blend, ("replace",)),
        ("sampling", str(view.sampling), ("center",)),
    )  # fmt: skip
    for name, value, choices_of in wishes:
        if value not in choices_of:
            raise ValueError(f"{name} must be {choices_of[-1]!r} for labels, which do not mix, got {value!r}")
    view.refuse_classic("labels")
    snapped = snap_mesh(memory, vertices, triangles, view, with_depth=False, out=out)
    if len(own) != snapped.n_triangles:
        raise ValueError(f"colors must have {snapped.n_triangles} rows, one per triangle, for labels, got {len(own)}")
    ground = as_array("background", 0 if style.background is None else style.background)
    if ground.shape not in ((), own.shape[1:]) or not np.array_equal(ground.astype(dtype), ground):
        raise ValueError(f"background must be one {dtype}, or one for each channel, got {shown(style.background)}")
    ids: NDArray[np.int32] = memory.scratch("labels", view.size[::-1], np.int32)
    draw(memory, snapped, view, choices.drawing(view, snapped.work, Sink.LABEL), ids)
    if 0 in view.size or not snapped.n_triangles:
        ids[...] = -1
    shape = (*ids.shape, *own.shape[1:])
    with Canvas.of(memory, "fill", out, shape, dtype.type, keep=style.background is None) as (result, canvas):
        if out is not None and style.background is None:
            canvas[ids >= 0] = own[ids[ids >= 0]]
        else:
            rows = np.concatenate([own, np.broadcast_to(ground.astype(dtype), (1, *own.shape[1:]))])
            np.take(rows, ids, axis=0, out=canvas, mode="wrap")  # id -1 is the last
    return result


def colors_are_flat(n_colors: int, n_triangles: int, n_vertices: int, per: str) -> bool:
    """Tell whether a row of colours belongs to a triangle; otherwise it belongs to a vertex."""
    choice = parse(PerOption, "per", per)
    fits_triangles, fits_vertices = n_colors == n_triangles, n_colors == n_vertices
    if choice == "auto" and fits_triangles and fits_vertices and n_colors:
        raise ValueError(
            f"colors has {n_colors} rows, and there are as many triangles as vertices: "
            "say per='triangle' or per='vertex'"
        )
    if choice != "vertex" and fits_triangles:
        return True
    if choice != "triangle" and fits_vertices:
        return False
    wish = {
        "triangle": f"{n_triangles} rows, one per triangle",
        "vertex": f"{n_vertices} rows, one per vertex",
        "auto": f"{n_triangles} rows, one per triangle, or {n_vertices}, one per vertex",
    }[choice]
    raise ValueError(f"colors must have {wish}, got {n_colors}")


def fill_large_shapes(p: Painting, blending: Blending) -> None:
    """Write every pixel once, row by row: a few large triangles."""
    n_samples, under = p.view.sampling.n_samples, cast("NDArray[np.uint8]", p.ground_bytes)
    grid_bits = p.view.grid_bits if n_samples > 1 else SAMPLE_GRID_BITS
    positions = sample_positions(n_samples, grid_bits)

    def fill_rows(first: int, end: int) -> int:
        return p.snapped.mesh.fill_large_shapes(
            p.pixels, first, end - first, p.colors, *blending.codes, p.transfer, under, positions
        )

    if max(run_parts(fill_rows, p.view.size[1], choices.threads_to_draw(p.view, p.snapped.work, Sink.LABEL))) >= 0:
        p.snapped.refuse()
    p.view.mark("draw")


def paint(p: Painting) -> None:
    """Draw coloured triangles: first which triangle shows in each pixel, then its colour."""
    labels = p.memory.scratch("labels", p.pixels.shape[:2], np.int32)
    drawing = choices.drawing(p.view, p.snapped.work, Sink.LABEL)
    draw(p.memory, p.snapped, p.view, drawing, labels)
    palette, flat, under = engine.as_bytes(p.colors), engine.as_bytes(p.pixels), p.ground_bytes

    def paint_rows(first: int, end: int) -> None:
        p.snapped.mesh.paint(labels, palette, flat, first, end - first, p.is_flat, p.is_u8, p.n_channels, under)

    run_parts(paint_rows, len(labels), drawing.n_threads)


def paint_samples(p: Painting) -> None:
    """Draw coloured triangles, each pixel the mean of its samples."""
    drawing = choices.drawing(p.view, p.snapped.work, Sink.LABEL)
    samples = p.samples(drawing.n_threads)
    if (
        p.is_flat
        and choices.can_slice(p.view)
        and choices.pays_to_sort_labels(p.view, p.snapped.work, drawing.n_threads)
    ):
        if draw_means(samples, engine.Palette(p.colors, p.transfer), p.pixels, p.ground):
            p.snapped.refuse()
        p.view.mark("draw")
        return
    if p.ground is not None:
        p = p.with_ground_laid()
    shape = len(samples.positions), *p.pixels.shape[:2]
    labels: NDArray[np.int32] = p.memory.scratch("sample labels", shape, np.int32)
    draw_all_samples(samples, p.snapped, p.view, drawing.sink, labels, None, in_bands=not p.is_flat)
    if p.is_flat:
        resolve_flat(p, labels, drawing.n_threads)
    else:
        resolve_gouraud(p, samples, labels)


def blend(p: Painting, blending: Blending) -> None:
    """Blend coloured triangles; with several samples a pixel each sample is a picture.

    A ground is there with one sample a pixel.
    """
    work, n_samples = p.snapped.work, p.view.sampling.n_samples
    n_threads = choices.threads_to_draw(p.view, work, Sink.LABEL)
    if n_samples == 1:
        pictures, meshes = p.pixels[None], [p.snapped.mesh]
    else:
        meshes = p.samples(n_threads).meshes
        pictures = p.memory.scratch("sample colors", (n_samples, *p.pixels.shape), p.colors.dtype)
        pictures[...] = p.pixels
    row_bytes = (4 if p.is_u8 else 4 * p.n_channels) * p.view.size[0]
    band_rows = choices.rows_to_blend(
        p.view, work, row_bytes, lays_ground=p.ground is not None, is_packed=p.is_u8 and p.n_channels != 4
    )
    for mesh, picture in zip(meshes, pictures, strict=True):
        if blend_picture(p, mesh, picture, blending, n_threads, band_rows):
            p.snapped.refuse()
    p.view.mark("draw")
    if n_samples > 1:
        resolve_colors(p, pictures, n_threads)


def blend_picture(
    p: Painting, mesh: engine.SnappedMesh, pixels: NDArray[Any], blending: Blending, n_threads: int, band_rows: int
) -> bool:
    """Blend a mesh into a picture of one sample; returns whether a triangle has an index outside the vertices.

    `band_rows`: so many are finished before the next.
    """
    height, width = pixels.shape[:2]
    n_parts, n_channels, is_u8 = min(height, n_threads), p.n_channels, p.is_u8
    flat, palette, under = engine.as_bytes(pixels), engine.as_bytes(p.colors), p.ground_bytes
    shape = n_parts, min(band_rows, -(-height // n_parts)) * width
    packed = p.memory.scratch("packed", shape, np.int32) if is_u8 and n_channels != 4 else [None] * n_parts
    n_cells = engine.blend_cells(width)
    cells = p.memory.constant("cells", n_parts * n_cells, engine.CELL_CLEAR) if blending.by_area else None

    def blend_part(i: int, _: int) -> int:
        first, end = height * i // n_parts, height * (i + 1) // n_parts
        own = None if cells is None else cells[n_cells * i : n_cells * (i + 1)]
        return mesh.blend(
            flat, width, first, end - first, palette, n_channels, is_u8, p.is_flat,
            *blending.codes, band_rows, under, packed[i], own,
        )  # fmt: skip

    return max(run_parts(blend_part, n_parts, n_parts)) >= 0


def parse_resolve(resolve: object, colors: NDArray[Any], view: View, *, is_straight: bool) -> engine.Transfer | None:
    """Return how samples are averaged; None for the mean of values."""
    is_linear = parse(ResolveOption, "resolve", resolve) == "linear"
    if is_linear and colors.dtype != np.uint8:
        raise ValueError(
            f"resolve 'linear' takes sRGB colours of uint8, got {colors.dtype}: float32 is averaged as it is"
        )
    n_channels = 1 if colors.ndim == 1 else colors.shape[1]
    if view.sampling.n_samples == 1 or not (is_linear or is_straight):
        return None
    return engine.Transfer(srgb_tables() if is_linear else None, n_channels - (n_channels in (2, 4)), is_straight)


def resolve_flat(p: Painting, labels: NDArray[np.int32], n_threads: int) -> None:
    """Write the mean colour of the triangles that the samples see, labels (S, H, W)."""
    palette = engine.Palette(p.colors, p.transfer)
    run_parts(lambda first, end: palette.mean_flat(labels, p.pixels, first, end - first), labels.shape[1], n_threads)


def resolve_gouraud(p: Painting, samples: SamplePass, labels: NDArray[np.int32]) -> None:
    """Write the mean of the colours at the samples, interpolated at each of them."""
    painted = p.memory.scratch("sample colors", (len(labels), *p.pixels.shape), p.colors.dtype)
    palette, meshes = engine.as_bytes(p.colors), samples.meshes

    def resolve_rows(first: int, end: int) -> None:
        painted[:, first:end] = p.pixels[first:end]
        for mesh, own, picture in zip(meshes, labels, painted, strict=True):
            flat = engine.as_bytes(picture)
            mesh.paint(own, palette, flat, first, end - first, False, p.is_u8, p.n_channels)
        engine.mean_colors(painted, p.pixels, first, end - first, p.n_channels, p.transfer)

    run_parts(resolve_rows, labels.shape[1], samples.n_threads)


def resolve_colors(p: Painting, painted: NDArray[Any], n_threads: int) -> None:
    """Write the mean of the colours of the samples, (S, H, W[, C])."""

    def resolve_rows(first: int, end: int) -> None:
        engine.mean_colors(painted, p.pixels, first, end - first, p.n_channels, p.transfer)

    run_parts(resolve_rows, len(p.pixels), n_threads)
