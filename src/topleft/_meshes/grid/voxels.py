"""Voxels: the cubes of a regular grid that a mesh fills, or that its surface meets.

Input: a `Mesh` or `Scene`. Output: `Voxels`, an array (X, Y, Z) and its transform. The kernels are csrc/sink/peel.c
and csrc/grid/voxels.c.

Based on: Schwarz, M. and H.-P. Seidel, "Fast Parallel Surface and Solid Voxelization on GPUs", SIGGRAPH Asia 2010.
"""

from __future__ import annotations

import math
import operator
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, I32, U8, MeshLike
from topleft._core.base.arrays import as_count, as_number, as_real, shown
from topleft._core.base.memory import FRESH, SCRATCH, check_fits
from topleft._core.base.options import parse
from topleft._core.base.threads import Part, run_parts, threads_for
from topleft._core.raster.snap import snap_mesh
from topleft._core.raster.view import View
from topleft._meshes.model.normals import moved
from topleft._meshes.scene.scene import Scene, as_meshes, scene_of
from topleft.errors import MeshWarning
from topleft.typing import VoxelRuleOption

SAMPLES = (1, 2, 4, 8)
MOST_ALONG = 1 << 14
"""Voxels, or samples of them, along an axis."""

BYTES_OF_PART = COLUMNS_OF_PART = 1 << 22
"""A part takes 15 ms at most: bytes of arrays, of which shares of samples take longest; columns of voxels of triangles
whose boxes fill the grid."""

U64 = npt.NDArray[np.uint64]


@dataclass(frozen=True, eq=False)
class Voxels:
    """The result of `voxelize`.

    Attributes
    ----------
    values : (X, Y, Z) bool, or float32 with several samples
        Whether a voxel is filled, or the share of it that is.
    transform : (4, 4) float64
        Space of the mesh from indices (x, y, z): integers are the middles of voxels, as in trimesh.
    pitch : float
        The side of a voxel.
    n_odd : int
        Columns along z that the surface crosses an odd number of times: 0 for a closed mesh. Their last crossing is
        dropped.

    Examples
    --------
    >>> import topleft as tl
    >>> voxels = tl.voxelize(tl.scenes.cube(), 4)
    >>> voxels.values.shape, voxels.pitch, voxels.volume, voxels.n_odd
    ((4, 4, 4), 0.5, 8.0, 0)
    >>> voxels.points()[0].tolist()
    [-0.75, -0.75, -0.75]
    """

    values: npt.NDArray[Any]
    transform: F64
    pitch: float
    n_odd: int

    def __repr__(self) -> str:
        shape = "x".join(map(str, self.values.shape))
        return f"Voxels({shape}, pitch={self.pitch:.6g}, {np.count_nonzero(self.values)} filled)"

    @property
    def volume(self) -> float:
        """The volume of the filled voxels."""
        return float(self.values.sum(dtype=np.float64)) * self.pitch**3

    def points(self) -> F64:
        """The middles of the voxels that are filled, or partly so: (N, 3) float64."""
        return np.argwhere(self.values) * self.pitch + self.transform[:3, 3]


class VoxelGrid(NamedTuple):
    """Cubes side by side."""

    shape: tuple[int, int, int]
    pitch: float
    low: F64
    """The corner from which they begin."""

    def to_voxels(self, points: npt.NDArray[Any], samples: int = 1) -> F64:
        """Points (V, 3) in voxels from the corner, or in samples of voxels."""
        voxel_points: F64 = np.subtract(points, self.low, dtype=np.float64)
        voxel_points *= samples / self.pitch
        return voxel_points


def voxelize(
    mesh: MeshLike | Scene,
    shape: int | tuple[int, int, int] | None = None,
    *,
    pitch: float | None = None,
    bounds: npt.ArrayLike | None = None,
    solid: bool = True,
    rule: VoxelRuleOption = "center",
    samples: int = 1,
    threads: int | None = None,
) -> Voxels:
    """The voxels of a grid that a mesh fills, or that its surface meets.

    Parameters
    ----------
    mesh : Mesh, Scene, or whatever `as_mesh` takes
        Of a scene all instances, each filled separately: voxels inside two instances are filled.
    shape : int or (X, Y, Z), optional
        How many voxels along the longest side, or along each axis. Voxels are cubes: with three numbers they are large
        enough that the grid holds the box in its middle.
    pitch : float, optional
        The side of a voxel, instead of `shape`.
    bounds : (2, 3) array_like, optional
        Lower and upper corner of the space to fill; the default is the box of the mesh.
    solid : bool
        Whether the inside is filled, by the even-odd rule; otherwise the surface alone.
    rule : {"center", "touched"}
        "center": voxels with their middle inside; of a surface the voxels in which a line through the middle along an
        axis meets it. "touched": every voxel that a triangle meets, too.
    samples : 1, 2, 4 or 8
        Samples along each axis of a voxel. With 2 and more the values are the shares of samples inside, float32, for a
        solid by "center".
    threads : int, optional
        Never changes a bit.

    Returns
    -------
    Voxels

    Warns
    -----
    MeshWarning
        If columns of a solid cross the surface an odd number of times: it is not closed. If they enter it where they
        are inside: shells of one mesh overlap, or its triangles do not all turn one way.

    Raises
    ------
    ValueError
        If not exactly one of `shape` and `pitch` is set, it is out of range, the bounds are no box, or the mesh has no
        triangles and there are no bounds.

    Notes
    -----
    Seen along z, a triangle crosses the columns whose middles it covers by the top-left rule, on vertices that are
    rounded to 1/256 voxel (or sample) along x and y. So a closed mesh has an even number of crossings in every column,
    wherever parts touch. Crossings are computed to 2**-22 of the depth of the grid. "touched" is
    conservative: no voxel is missing that a triangle of the float64 vertices meets.

    Examples
    --------
    >>> import topleft as tl
    >>> ball = tl.Mesh(*tl.scenes.icosphere(4))
    >>> voxels = tl.voxelize(ball, 64)
    >>> round(voxels.volume, 1), voxels.n_odd  # 4/3 pi is 4.19
    (4.2, 0)
    >>> tl.voxelize(ball, pitch=0.5, solid=False, rule="touched").values.sum()
    np.int64(56)
    """
    subject = as_meshes(mesh)
    parse(VoxelRuleOption, "rule", rule)
    if not isinstance(solid, bool | np.bool_):
        raise TypeError(f"solid must be True or False, got {shown(solid)}")
    if as_count("samples", samples) not in SAMPLES:
        raise ValueError(f"samples must be one of {', '.join(map(str, SAMPLES))}, got {samples!r}")
    if samples > 1 and not (solid and rule == "center"):
        raise ValueError(f"samples must be 1 for a surface and for rule 'touched', got {samples}")
    grid = grid_of(subject.bounds if bounds is None else as_bounds(bounds), shape, pitch, samples)
    bodies = [(moved(item.mesh.vertices, item.transform), item.mesh.triangles) for item in scene_of(subject)]
    n_threads = threads_for(threads, sum(len(triangles) for _, triangles in bodies))
    if samples > 1:
        check_fits(grid.shape, np.float32)
        shares: npt.NDArray[np.float32] = FRESH.empty("voxels", grid.shape, np.float32)
        bits, *told = solid_bits(grid, bodies, samples, n_threads)
        sample_bits = samples.bit_length() - 1
        n_parts = n_parts_of(bits, n_threads)
        run_parts(lambda a, b: engine.count_columns(bits, sample_bits, shares, a, b), len(shares), n_parts, n_threads)
        return with_warning(grid, shares, *told)
    check_fits(grid.shape, np.bool_)
    voxels: npt.NDArray[np.bool_] = FRESH.empty("voxels", grid.shape, np.bool_)
    filled, told = voxels.view(np.uint8), [0, 0]
    if solid:
        bits, *told = solid_bits(grid, bodies, 1, n_threads)
        in_parts(lambda first, end: engine.expand_columns(bits, filled, first, end), bits, n_threads)
    else:
        in_parts(lambda first, end: filled[first:end].fill(0), filled, n_threads)
    for vertices, triangles in bodies:
        points = grid.to_voxels(vertices)
        if rule == "touched" and len(triangles):
            check_finite(points)
            most_columns = math.prod(sorted(grid.shape)[1:])
            n_parts = -(-len(triangles) // max(1, COLUMNS_OF_PART // most_columns))
            run_parts(partial(touch_part, points, triangles, filled), len(triangles), n_parts, 1)
        elif not solid:
            mark_surface(points, triangles, filled, n_threads)
    return with_warning(grid, voxels, *told)


def with_warning(grid: VoxelGrid, values: npt.NDArray[Any], n_odd: int, n_nested: int) -> Voxels:
    """The result, with a warning where a mesh is not closed, or shells of it overlap."""
    if n_nested:
        line = f"{n_nested} columns of voxels enter the mesh where they are inside: it is filled by the even-odd rule, "
        line += "overlaps of its shells are holes; instances of a scene are filled one by one"
        warnings.warn(line, MeshWarning, stacklevel=3)
    if n_odd:
        line = f"the mesh is not closed: {n_odd} columns of voxels cross it an odd number of times"
        warnings.warn(line, MeshWarning, stacklevel=3)
    transform = np.diag([grid.pitch, grid.pitch, grid.pitch, 1.0])
    transform[:3, 3] = grid.low + grid.pitch / 2
    return Voxels(values, transform, grid.pitch, n_odd)


def as_bounds(bounds: npt.ArrayLike) -> F64:
    """A box, checked."""
    box = as_real("bounds", bounds)
    if box.shape != (2, 3):
        raise ValueError(f"bounds must have shape (2, 3), got {box.shape}")
    if not (np.isfinite(box).all() and (box[0] <= box[1]).all()):
        raise ValueError(f"bounds must be a finite lower and upper corner, got {box.tolist()}")
    return box


def grid_of(box: F64, shape: object, pitch: object, samples: int) -> VoxelGrid:
    """The voxels that hold a box."""
    if (shape is None) == (pitch is None):
        raise ValueError(f"give either shape or pitch, got shape={shape!r} and pitch={pitch!r}")
    extent: F64 = np.asarray(box[1] - box[0], np.float64)
    if pitch is not None:
        side = as_number("pitch", pitch)
        if not 0 < side < np.inf:
            raise ValueError(f"pitch must be greater than 0 and finite, got {pitch!r}")
        counts = counts_of(extent, side)
    elif isinstance(shape, int | np.integer):
        side = float(extent.max()) / as_count("shape", shape) or 1.0
        counts = counts_of(extent, side)
    else:
        try:
            numbers = tuple(operator.index(n) for n in cast(Any, shape))
        except TypeError:
            raise TypeError(f"shape must be a whole number or three, got {shown(shape)}") from None
        if len(numbers) != 3 or min(numbers) < 1:
            raise ValueError(f"shape must be a number or three of at least 1, got {shown(shape)}")
        side = float((extent / numbers).max()) or 1.0
        counts = list(numbers)
    if max(counts) * samples > MOST_ALONG:
        raise ValueError(
            f"voxels must be at most {MOST_ALONG // samples} along an axis with samples={samples}, got {max(counts)}"
        )
    low = (
        box[0]
        if shape is None or isinstance(shape, int | np.integer)
        else (box[0] + box[1] - side * np.array(counts)) / 2
    )
    x, y, z = counts
    return VoxelGrid((x, y, z), side, np.asarray(low, np.float64))


def counts_of(extent: F64, pitch: float) -> list[int]:
    """How many voxels hold an extent; an excess by rounding adds none."""
    counts = np.ceil(extent / pitch * (1 - 2.0**-40))
    return [int(min(max(count, 1.0), 2.0 * MOST_ALONG)) for count in counts.tolist()]


def solid_bits(
    grid: VoxelGrid, bodies: list[tuple[npt.NDArray[Any], I32]], samples: int, n_threads: int
) -> tuple[U64, int, int]:
    """Bits of columns (X, Y, words) of the samples inside of any body; how many columns are odd, how many nested."""
    union: U64 | None = None
    n_odd = n_nested = 0
    for vertices, triangles in bodies:
        points = grid.to_voxels(vertices, samples)
        name = "columns of one" if union is not None else "columns"
        bits, n, of_fronts, of_backs = filled_columns(
            name, points, triangles, tuple(samples * n for n in grid.shape), n_threads
        )
        n_odd += n
        n_nested += 0 if n else min(of_fronts, of_backs)  # bodies may be inside out
        if union is None:
            union = bits
        else:
            in_parts(partial(add_bits, union, bits), bits, n_threads)
    assert union is not None  # a scene has an instance
    return union, n_odd, n_nested


def add_bits(union: U64, bits: U64, first: int, end: int) -> None:
    """Add the bits of rows to others."""
    np.bitwise_or(union[first:end], bits[first:end], out=union[first:end])


def n_parts_of(rows: npt.NDArray[Any], n_threads: int) -> int:
    """How many parts of an array take milliseconds each: Python hears Ctrl-C between two of them."""
    return max(n_threads, rows.nbytes // BYTES_OF_PART)


def in_parts(work: Callable[[int, int], Part], rows: npt.NDArray[Any], n_threads: int) -> list[Part]:
    """Return `work(first, end)` of parts of the rows of an array."""
    return run_parts(work, len(rows), n_parts_of(rows, n_threads), n_threads)


def filled_columns(
    name: str, points: F64, triangles: I32, shape: tuple[int, ...], n_threads: int
) -> tuple[U64, int, int, int]:
    """Bits of the columns along the last axis of a grid, filled between crossings; how many are odd.

    And in how many the winding number leaves 0 and 1, and 0 and -1.
    """
    bits, twos = empty_columns(name, shape, n_threads), empty_columns("turns of columns", shape, n_threads)
    draw_crossings(bits, twos, points, triangles, shape, n_threads)
    counts = in_parts(partial(engine.fill_columns, bits, twos), bits, n_threads)
    n_odd, of_fronts, of_backs = map(sum, zip(*counts, strict=True))
    return bits, n_odd, of_fronts, of_backs


def empty_columns(name: str, shape: tuple[int, ...], n_threads: int) -> U64:
    """Bits of the columns along the last axis of a grid, all 0."""
    n_rows, n_columns, n_steps = shape
    size = (n_rows, n_columns, engine.column_words(n_steps))
    check_fits(size, np.uint64)
    bits: U64 = SCRATCH.empty(name, size, np.uint64)
    in_parts(lambda first, end: bits[first:end].fill(0), bits, n_threads)
    return bits


def draw_crossings(
    bits: U64, twos: U64 | None, points: F64, triangles: I32, shape: tuple[int, ...], n_threads: int
) -> None:
    """Note the crossings of columns: with `twos` the steps that are filled from them, else those in which they lie."""
    n_rows, n_columns, n_steps = shape
    view = View.parse((n_columns, n_rows), {"threads": n_threads})
    seen = np.empty_like(points)
    seen[:, 0], seen[:, 1], seen[:, 2] = points[:, 1], points[:, 0], points[:, 2]
    snapped = snap_mesh(SCRATCH, seen, triangles, view, with_depth=True, out=None)

    def draw_rows(first: int, end: int) -> None:
        if engine.draw_crossings(snapped.mesh, bits, twos, n_steps, twos is None, first, end) >= 0:
            snapped.refuse()

    run_parts(draw_rows, n_rows, n_threads)


def mark_surface(points: F64, triangles: I32, filled: U8, n_threads: int) -> None:
    """Mark the voxels in which a line through the middle along an axis meets the surface."""
    flat = filled.reshape(-1)
    for axis in range(3):
        order = [(axis + 1) % 3, (axis + 2) % 3, axis]
        shape = tuple(filled.shape[k] for k in order)
        bits = empty_columns("columns", shape, n_threads)
        draw_crossings(bits, None, np.ascontiguousarray(points[:, order]), triangles, shape, n_threads)
        row, column, step = (filled.strides[k] for k in order)
        in_parts(partial(scatter_rows, bits, flat, (row, column, step)), bits, 1)


def touch_part(points: F64, triangles: I32, filled: U8, first: int, end: int) -> None:
    """Mark the voxels that triangles [first, end) meet."""
    engine.touch_voxels(points, triangles, first, end, filled)


def scatter_rows(bits: U64, flat: U8, strides: tuple[int, int, int], first: int, end: int) -> None:
    """Mark the voxels of rows [first, end) of bits."""
    engine.scatter_columns(bits[first:end], flat[first * strides[0] :], strides)


def check_finite(points: F64) -> None:
    """Raise an error where a vertex is not finite, or too far from the grid."""
    if not np.isfinite(points).all():
        i = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise ValueError(f"vertices must be finite and within 2**1000 voxels of the grid, got row {i}")
