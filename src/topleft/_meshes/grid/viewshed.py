"""Viewsheds: the parts of a terrain that are visible from a point, and the least visible height elsewhere.

Input: a height grid, or a mesh that is sampled on a grid, and an eye. Output: `Viewshed`. Kernel: csrc/grid/viewshed.c.

Based on: Franklin, W. R. and C. K. Ray, "Higher Isn't Necessarily Better: Visibility Algorithms and Experiments", SDH
1994 (R3: the line to each cell by itself).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, MeshLike
from topleft._core.base.arrays import as_number, as_real
from topleft._core.base.grid import Grid
from topleft._core.base.memory import FRESH
from topleft._core.base.threads import run_parts, threads_for
from topleft._meshes.field.field import height_map
from topleft._meshes.scene.adapt import as_polygons

EARTH_RADIUS = 6_370_997.0
"""Metres, of the sphere of GDAL's curvature coefficient."""


@dataclass(frozen=True, eq=False)
class Viewshed:
    """The result of `viewshed`.

    Attributes
    ----------
    visible : (H, W) bool
        Whether a point `target_height` above the ground is visible.
    above : (H, W) float64
        The least visible height above the ground, 0 where the ground is visible; NaN without ground, or too far away.
    grid : Grid
        Where the cells are.

    Examples
    --------
    >>> import numpy as np, topleft as tl
    >>> heights = np.zeros((1, 5))
    >>> heights[0, 2] = 3.0
    >>> seen = tl.viewshed(heights, (0.5, 0.5), eye_height=1.0)
    >>> seen.visible.tolist(), seen.above.tolist()
    ([[True, True, True, False, False]], [[0.0, 0.0, 0.0, 4.0, 5.0]])
    """

    visible: npt.NDArray[np.bool_]
    above: F64
    grid: Grid

    def __repr__(self) -> str:
        width, height = self.grid.size
        return f"Viewshed({width}x{height}, {np.count_nonzero(self.visible)} cells seen)"


def viewshed(
    terrain: npt.ArrayLike | MeshLike,
    eye: Sequence[float] | npt.NDArray[Any],
    *,
    grid: Grid | None = None,
    pixel_size: float | tuple[float, float] | None = None,
    eye_height: float | None = None,
    target_height: float = 0.0,
    max_distance: float | None = None,
    curvature: float = 0.0,
    threads: int | None = None,
) -> Viewshed:
    """The parts of a terrain that are visible from a point.

    Parameters
    ----------
    terrain : (H, W) array_like, or a mesh
        Heights at the middles of cells, NaN where there is no ground, which hides nothing. Or whatever `as_mesh` takes,
        a TIN, say: its upper surface by `height_map`.
    eye : (x, y) or (x, y, z)
        Where the eye is, in the units of the grid; within the middles of the outermost cells.
    grid : Grid, optional
        Where the cells are. By default, cells of an array are 1 wide and high, and y grows down from its first row;
        a mesh needs `grid` or `pixel_size`.
    pixel_size : float or (float, float), optional
        Width and height of a cell, of a mesh without a grid.
    eye_height : float, optional
        How high the eye is above the ground at (x, y), instead of z. The default is 0.
    target_height : float
        The height above the ground of points to be seen.
    max_distance : float, optional
        Cells farther away in the plane are skipped.
    curvature : float
        The share of the Earth's curvature that counts, for units of metres: 0 none, 1 all, 6/7 with the usual
        refraction of light (GDAL's ``-cc 0.85714``).
    threads : int, optional
        Never changes a bit.

    Returns
    -------
    Viewshed

    Raises
    ------
    ValueError
        If the eye is not within the grid, there is no ground under an eye without z, or a number is out of range.

    Notes
    -----
    The line of sight to the middle of a cell is tested wherever it crosses a line between the middles of neighbouring
    cells, along rows and along columns, where the ground is between their heights. So only the inside of a square of
    four middles lies between two tests. The time grows with the cells times the sides of the grid: flat ground, where
    nothing can be skipped, is the worst, 4.7 s of a core of a Zen 3 for 1000 x 1000 cells, so a quarter of an hour for
    6000 x 6000.

    Examples
    --------
    >>> import numpy as np, topleft as tl
    >>> x, y = np.meshgrid(np.arange(80), np.arange(60))
    >>> hills = 5 * np.sin(x / 7) * np.cos(y / 9)
    >>> seen = tl.viewshed(hills, (40.5, 30.5), eye_height=2.0)
    >>> seen.visible.shape, bool(seen.visible[30, 40])
    ((60, 80), True)
    """
    heights, cells = heights_of(terrain, grid, pixel_size)
    place = as_real("eye", eye)
    if place.shape not in ((2,), (3,)) or not np.isfinite(place).all():
        raise ValueError(f"eye must be finite (x, y) or (x, y, z), got {np.asarray(eye).tolist()}")
    if len(place) == 3 and eye_height is not None:
        raise ValueError("an eye has z or eye_height, got both")
    eye_height = 0.0 if eye_height is None else eye_height
    numbers = {"target_height": target_height, "curvature": curvature, "eye_height": eye_height}
    for name, value in numbers.items():
        if not np.isfinite(as_number(name, value)):
            raise ValueError(f"{name} must be finite, got {value!r}")
    most = np.inf if max_distance is None else as_number("max_distance", max_distance)
    if not most >= 0:
        raise ValueError(f"max_distance must be at least 0, got {max_distance!r}")
    at = cells.to_pixels(place[None, :2])[0] - 0.5
    last = np.array(cells.size) - 1
    if not ((at >= 0) & (at <= last)).all():
        raise ValueError(f"eye must lie within the middles of the cells, got ({place[0]}, {place[1]}) on {cells!r}")
    z = float(place[2]) if len(place) == 3 else ground_at(heights, at) + float(eye_height)
    with np.errstate(divide="ignore"):
        columns, rows = (1 / (np.arange(n) - p) for n, p in zip(cells.size, at.tolist(), strict=True))
    place, cell, falls = np.array([*at, z]), np.array(cells.pixel_size), curvature / (2 * EARTH_RADIUS)
    blocks = tops_of(tops_of(np.where(np.isnan(heights), -np.inf, heights)).T).T
    blocks = np.ascontiguousarray(blocks)
    above: F64 = FRESH.empty("viewshed", heights.shape, np.float64)

    def view_rows(first: int, end: int) -> None:
        engine.view_heights(heights, blocks, place, columns, rows, cell, falls, most * most, first, end, above)

    # a part for each row, for Ctrl-C is heard between parts alone
    run_parts(view_rows, len(heights), len(heights), threads_for(threads, heights.size))
    with np.errstate(invalid="ignore"):
        return Viewshed(above <= target_height, above, cells)


def tops_of(heights: F64) -> F64:
    """The maxima of each VIEW_BLOCK + 1 rows; blocks share a row."""
    size = engine.VIEW_BLOCK
    return np.stack([heights[i : i + size + 1].max(axis=0) for i in range(0, len(heights), size)])


def heights_of(terrain: Any, grid: Grid | None, pixel_size: Any) -> tuple[F64, Grid]:
    """The heights (H, W) and their grid."""
    if not isinstance(grid, Grid | None):
        raise TypeError(f"grid must be a Grid or None, got {type(grid).__name__}")
    if isinstance(terrain, np.ndarray | list) or hasattr(terrain, "__array__") or hasattr(terrain, "__dlpack__"):
        if pixel_size is not None:
            raise ValueError("pixel_size is for a mesh: give the Grid of an array")
        heights = np.ascontiguousarray(as_real("terrain", terrain))
        if heights.ndim != 2 or 0 in heights.shape:
            raise ValueError(f"terrain must have shape (H, W) with cells, got {heights.shape}")
        height, width = heights.shape
        cells = Grid((width, height), (0.0, float(width), 0.0, float(height)), "down") if grid is None else grid
        if cells.size != (width, height):
            raise ValueError(f"grid must have the {width} x {height} cells of the terrain, got {cells.size}")
        return heights, cells
    if (grid is None) == (pixel_size is None):
        raise ValueError("a mesh needs either a grid or a pixel_size")
    mesh = as_polygons(terrain)
    surface = mesh.points, mesh.triangles
    cells = Grid.around(surface, pixel_size=pixel_size) if grid is None else grid
    return height_map(surface, cells), cells


def ground_at(heights: F64, at: F64) -> float:
    """The height interpolated between four cells, or between two where the grid is a cell wide."""
    column, row = (min(int(p), max(n - 2, 0)) for p, n in zip(at.tolist(), heights.shape[::-1], strict=True))
    square = heights[row : row + 2, column : column + 2]
    x, y = float(at[0]) - column, float(at[1]) - row
    weights = np.outer([1 - y, y], [1 - x, x])[: square.shape[0], : square.shape[1]]
    used = weights > 0
    height = float((square[used] * weights[used]).sum() / weights[used].sum())
    if not np.isfinite(height):
        raise ValueError("there is no ground under the eye: give its z")
    return height
