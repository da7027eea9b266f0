"""Draws several samples a pixel, or the exact area of it: sample positions, bands of rows, cells between edges."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.memory import Memory
from topleft._core.base.options import Sink
from topleft._core.base.threads import run_parts
from topleft._core.raster.costs import cost_table

#: From the centre of the pixel, x right and y down, in sixteenths of a pixel: the standard patterns of Direct3D 11.
POSITIONS: dict[int, tuple[tuple[int, int], ...]] = {
    1: ((0, 0),),
    2: ((4, 4), (-4, -4)),
    4: ((-2, -6), (6, -2), (-6, 2), (2, 6)),
    8: ((1, -3), (-1, 3), (5, 1), (-3, -5), (-5, 5), (-7, -1), (3, 7), (7, -7)),
    16: (
        (1, 1), (-1, -3), (-3, 2), (4, -1), (-5, -2), (2, 5), (5, 3), (3, -5),
        (-2, 6), (0, -7), (-4, -6), (-6, 4), (-8, 0), (7, -4), (6, 7), (-7, -8),
    ),
}  # fmt: skip

#: Sub-pixel bits of the coarsest grid that all samples lie on.
SAMPLE_GRID_BITS = 4

#: Cells that are held at a time; a larger picture is drawn in several passes over the triangles.
MAX_CELLS = 1 << 28


def sample_positions(n_samples: int, grid_bits: int) -> NDArray[np.int32]:
    """Return where the samples lie from the pixel's centre, int32 (S, 2), in units of ``2**-grid_bits`` pixels."""
    return np.array(POSITIONS[n_samples], np.int32) << np.int32(grid_bits - SAMPLE_GRID_BITS)


class SamplePass(NamedTuple):
    """A mesh that is drawn as samples see it, in memory that is given, by some threads."""

    memory: Memory
    mesh: engine.SnappedMesh
    positions: NDArray[np.int32]
    n_threads: int

    @property
    def meshes(self) -> list[engine.SnappedMesh]:
        """The mesh as each sample sees it."""
        return [self.mesh.at_sample(x, y) for x, y in self.positions.tolist()]

    def sort_bands(self, shape: tuple[int, int], n_pixels: int) -> engine.Bins:
        """Return the triangles of each band of up to `n_pixels`; none when an index lies outside the vertices."""
        height, width = shape
        band_bits = bits_of_bands(shape, n_pixels, self.n_threads)
        room = self.memory.scratch("bins", (3, self.mesh.n_triangles + 16), np.int32)
        bins = engine.Bins(self.mesh, height, width, int(np.abs(self.positions).max()), band_bits, room)
        if bins.bad_row < 0:
            bins.fill(self.memory.scratch("bands", (bins.n_listed + 1,), np.int32))
        return bins


def draw_planes(
    own: SamplePass, sink: Sink, pixels: NDArray[Any], depth: NDArray[np.float32] | None, *, is_near: bool
) -> bool:
    """Draw each sample into its plane of (S, H, W) arrays; returns whether an index lies outside the vertices.

    The mesh is set up once, its triangles sorted into bands of rows, and band after band is drawn for one sample after
    the other. A mesh that is not near (see `tl_kernels.draw`) is drawn as a whole for each sample.
    """
    n_samples, height, width = pixels.shape
    depths = [None] * n_samples if depth is None else list(depth)
    targets = [engine.Target(sink, plane, z, None) for plane, z in zip(pixels, depths, strict=True)]
    return (draw_sorted if is_near else draw_each)(own, targets, (height, width))


def draw_each(own: SamplePass, targets: list[engine.Target], shape: tuple[int, int]) -> bool:
    """Draw each sample into its target, a whole picture each; returns as `draw_planes` does."""
    bad_rows = [
        max(run_parts(lambda first, end, s=s, t=t: s.draw(t, first, end - first), shape[0], own.n_threads))  # type: ignore[misc]
        for s, t in zip(own.meshes, targets, strict=True)
    ]
    return max(bad_rows) >= 0


def draw_sorted(own: SamplePass, targets: list[engine.Target], shape: tuple[int, int]) -> bool:
    """Draw each sample into its target, band after band of rows; returns as `draw_planes` does. The mesh is near.

    A picture of one band is drawn whole.
    """
    plane_bytes = int(cost_table().plane_bytes)
    if own.n_threads == 1 and 8 * shape[0] * shape[1] <= plane_bytes:
        return draw_each(own, targets, shape)
    bins = own.sort_bands(shape, plane_bytes // 8)
    if bins.bad_row >= 0:
        return True
    draw_part = partial(engine.draw_bands, own.meshes, targets, bins)
    run_parts(draw_part, bins.n_bands, max(1, min(own.n_threads, bins.n_bands)))
    return False


def lay_background(ids: NDArray[np.int32], depth: NDArray[np.float32], sink: Sink, background: float) -> None:
    """Write the depth of the background where nothing is, unless the engine has cleared the buffer to it."""
    if background != (-np.inf if sink is Sink.FARTHEST else np.inf):
        depth[ids < 0] = background


def draw_means(own: SamplePass, palette: engine.Palette, pixels: NDArray[Any], ground: NDArray[Any] | None) -> bool:
    """Write the mean colour of the samples over (H, W[, C]) pixels, in painter's order; returns as `draw_planes` does.

    `ground`: the colour that all pixels get before. The mesh is near. Labels live no longer than a band of rows, which
    is drawn from the last triangle to the first: rows of large ones leave out samples that other large ones cover.
    """
    height, width = pixels.shape[:2]
    memory, meshes, n = own.memory, own.meshes, len(own.positions)
    bins = own.sort_bands((height, width), int(cost_table().label_bytes) // (4 * n))
    if bins.bad_row >= 0:
        return True
    n_parts = max(1, min(own.n_threads, bins.n_bands))
    labels = list(memory.scratch("sample labels", (n_parts, n, width << bins.band_bits), np.int32))
    n_words = (width << bins.band_bits) // 64 + 2
    covered = list(memory.empty("covered labels", (n_parts, n_words), np.uint64))
    row = None if ground is None else np.broadcast_to(ground, pixels.shape[1:]).astype(pixels.dtype)

    def fill_part(first: int, end: int) -> None:
        engine.fill_bands(meshes, labels.pop(), covered.pop(), palette, pixels, row, bins, first, end)

    run_parts(fill_part, bins.n_bands, n_parts)
    return False


def bits_of_bands(shape: tuple[int, int], n_pixels: int, n_threads: int) -> int:
    """Return the binary logarithm of the rows of a band of up to `n_pixels`, two bands a thread at least."""
    height, width = shape
    band_bits = max(0, (n_pixels // width).bit_length() - 1)
    while band_bits and height >> band_bits < 2 * n_threads:
        band_bits -= 1
    return band_bits


def sum_areas(
    memory: Memory,
    mesh: engine.SnappedMesh,
    pixels: NDArray[np.float32],
    n_threads: int,
    *,
    is_clamped: bool,
    half_px: int | None = None,
) -> bool:
    """Write the area that triangles cover of each pixel; returns whether a triangle has an index outside the vertices.

    With `half_px`, half a pixel in sub-pixels or more, triangles are sorted into bands of rows, whose cells stay in the
    cache. Sums are taken in 32 bits. Rows in which these might not do are drawn again in 64 bits, with the same result
    wherever both are right.
    """
    height, width = pixels.shape
    if not pixels.size:
        return False
    stride, bins = engine.area_stride(width), None
    n_rows = area_band(height, width, n_threads, in_bands=half_px is not None)
    if half_px is not None:
        own = SamplePass(memory, mesh, np.array([[half_px, half_px]], np.int32), n_threads)
        bins = own.sort_bands((height, width), n_rows * width)
        if bins.bad_row >= 0:
            return True
    n_bands = -(-height // n_rows)
    n_parts = max(1, min(n_threads, n_bands))
    cells = memory.constant("cells", n_parts * n_rows * stride, engine.CELL_CLEAR)
    unused = list(cells.reshape(n_parts, -1))

    def draw_band(cells: NDArray[np.uint8], first: int, end: int) -> int:
        status = mesh.draw_area(pixels, cells, first, end - first, False, is_clamped, bins)
        if status != engine.AREA_OVERFLOW:
            return status
        wide = engine.as_bytes(np.zeros((end - first) * stride, np.int64))
        return mesh.draw_area(pixels, wide, first, end - first, True, is_clamped, bins)

    def draw_bands(first: int, end: int) -> int:
        cells = engine.as_bytes(unused.pop())
        return max(draw_band(cells, k * n_rows, min((k + 1) * n_rows, height)) for k in range(first, end))

    return max(run_parts(draw_bands, n_bands, n_parts)) >= 0


def area_band(height: int, width: int, n_threads: int, *, in_bands: bool) -> int:
    """Return in how many rows at once areas are summed: as many as cells stay in the cache of, or are held of."""
    stride = engine.area_stride(width)
    if in_bands:
        return 1 << bits_of_bands((height, stride), int(cost_table().area_bytes) // 4, n_threads)
    n_parts = max(1, min(n_threads, height))
    return min(-(-height // n_parts), max(1, MAX_CELLS // (n_parts * stride)))
