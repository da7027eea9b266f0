"""Clouds of points: positions with colours and normals, drawn as discs or squares; checked once, here.

Input: anything NumPy can read. Output: `Points`, whose arrays the other stages use as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import F64, U8
from topleft._core.base.arrays import INT32_MAX, as_point_size, set_read_only
from topleft._core.base.cached import cached_property
from topleft._core.base.defaults import DEFAULT_POINT_SIZE
from topleft._core.base.options import parse
from topleft._meshes.model.mesh import FloatArray, as_color_array, as_real_array, extreme_points, read_only
from topleft.typing import PointShapeOption, PointUnitOption


@dataclass(frozen=True, eq=False, repr=False)
class Points:
    """Points in the world, drawn as discs or squares that face the viewer.

    Parameters
    ----------
    positions : (N, 3) array_like of real numbers
        Finite; float32 and float64 stay as they are, everything else becomes float64.
    colors : (N, 3) or (N, 4) array_like of uint8, optional
        sRGB colours; alpha is not read.
    normals : (N, 3) array_like of real numbers, optional
        Directions, of any length. Points with normals are lit, others have their colours as they are.
    size : float or (N,) array_like
        Diameter of a disc, side of a square, of all points or of each; positive.
    unit : {"px", "world"}
        The unit of `size`: pixels, whatever the distance, or units of the world, smaller with distance.
    shape : {"disc", "square"}

    Raises
    ------
    ValueError
        If an array has another shape, a position is not finite, a size is not positive, or an option is unknown.
    TypeError
        If an array holds another kind of number.

    Notes
    -----
    The arrays are read-only views: of the caller's memory where the dtype allows. `topleft.points` says which pixels a
    point covers.

    Examples
    --------
    >>> import topleft as tl
    >>> cloud = tl.Points([[0, 0, 0], [1, 2, 0]], size=3)
    >>> cloud
    Points(2, disc of 3 px)
    >>> cloud.bounds.tolist()
    [[0.0, 0.0, 0.0], [1.0, 2.0, 0.0]]
    """

    positions: FloatArray
    colors: U8 | None = None
    normals: FloatArray | None = None
    size: float | F64 = DEFAULT_POINT_SIZE
    unit: PointUnitOption = "px"
    shape: PointShapeOption = "disc"

    if TYPE_CHECKING:  # anything that NumPy reads may be given; the types above are kept

        def __init__(
            self,
            positions: npt.ArrayLike,
            colors: npt.ArrayLike | None = None,
            normals: npt.ArrayLike | None = None,
            size: npt.ArrayLike = DEFAULT_POINT_SIZE,
            unit: PointUnitOption = "px",
            shape: PointShapeOption = "disc",
        ) -> None: ...

    def __post_init__(self) -> None:
        keep = object.__setattr__  # the dataclass is frozen, and its arrays are coerced
        positions = as_real_array(self.positions, "positions")
        if len(positions) > INT32_MAX:
            raise ValueError(f"there must be at most {INT32_MAX} points, got {len(positions)}")
        bad = np.flatnonzero(~np.isfinite(positions).all(axis=1))
        if len(bad):
            row = int(bad[0])
            raise ValueError(f"positions[{row}] = {positions[row].tolist()} must be finite")
        keep(self, "positions", read_only(positions))
        if self.colors is not None:
            keep(self, "colors", read_only(as_color_array(self.colors, len(positions))))
        if self.normals is not None:
            normals = as_real_array(self.normals, "normals")
            if len(normals) != len(positions):
                raise ValueError(f"normals must have shape ({len(positions)}, 3), got {normals.shape}")
            keep(self, "normals", read_only(normals))
        keep(self, "size", as_point_size("size", self.size, len(positions)))
        keep(self, "unit", parse(PointUnitOption, "unit", self.unit))
        keep(self, "shape", parse(PointShapeOption, "shape", self.shape))

    def __len__(self) -> int:
        return len(self.positions)

    def __repr__(self) -> str:
        size = f"{self.size:g}" if isinstance(self.size, float) else "own size"
        return f"Points({len(self)}, {self.shape} of {size} {self.unit})"

    @property
    def bounds(self) -> F64:
        """Lower and upper corner (2, 3) float64 of the box round the positions.

        Raises
        ------
        ValueError
            If there are no points.
        """
        ends = self.extreme_points()
        return np.stack([ends.min(axis=0), ends.max(axis=0)])

    def extreme_points(self) -> F64:
        """Positions (7, 3), float64, which have the box and the bounding sphere of all; found once.

        Raises
        ------
        ValueError
            If there are no points.
        """
        if not len(self):
            raise ValueError("a cloud without points has no bounds")
        return self._extreme_points

    @cached_property
    def _extreme_points(self) -> F64:
        found: F64 = read_only(extreme_points(lambda: self.positions))
        return found

    def __getstate__(self) -> dict[str, Any]:
        """The state for another process, which computes the rest itself."""
        names = ("positions", "colors", "normals", "size", "unit", "shape")
        return {name: self.__dict__[name] for name in names}

    __setstate__ = set_read_only
