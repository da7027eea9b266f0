"""Bends edges: splits triangles until their sides are straight in the picture of a lens, to within a tolerance.

Input: vertices and triangles in world space, a camera with a lens. Output: `BentMesh`, which a camera without the lens
draws as the lens would show the mesh.

An edge is halved (in space) where its picture, at a quarter, half or three quarters of its length, is off by more than
the tolerance from what a straight edge would show there, its depth too, unless it is shorter than a pixel there, or
where it spans a large angle. That is a question to the edge alone, and triangles that share an edge share its ends: so
they split it alike, and no gap opens.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, I64
from topleft._core.base.arrays import set_aligned
from topleft._core.base.options import Cull, parse
from topleft._meshes.camera.camera import Camera
from topleft._meshes.camera.lens import FLIP, Lens
from topleft._meshes.model.mesh import Mesh, keep_corner_normals
from topleft._meshes.model.normals import CornerNormals, moved

Bools = npt.NDArray[np.bool_]
Parts = tuple[I64, I64, F64, Bools]
"""Triangles (N, 3), their sources (N,), weights (N, 3, 3) and which sides are outline (N, 3)."""

LEAST_EDGE_COSINE = engine.cosine_and_sine(math.degrees(0.25))[0]
"""Edges of a greater angle, as the lens sees them, are halved in any case: so every triangle is small enough on the
sphere of directions for the test of what the picture cannot show."""

MAX_RANGE_ERROR = 2.0**-12
"""Relative error of the distance that a fisheye has for depth: longer edges are halved, too."""

WIDEST = np.radians(160)
"""What lies farther from the axis is never drawn: a triangle round the back of the axis would cover everything. Those
that pass the test have a cap of less than 10 degrees and end before that."""

MAX_HALVINGS = 24
"""No edge is halved more often; only one that passes through the lens would be."""

SHORT_PX = 0.5
"""An edge that stays so near to its middle in the picture is not halved for its bend: no pixel would tell."""

MAX_PARTS, MAX_PARTS_OF_ONE = 1 << 22, 8
"""Most parts of a mesh, beside so many for each of its triangles: 1.5 GB while they are made."""

N_TO_FORECAST, N_TRIED = 1 << 15, 1 << 10
"""From so many parts on that may be split again, so many of them are split alone, to tell how many all will be."""

N_ANGLES, N_AZIMUTHS = 513, 128
"""Rings of directions that are asked where they lie in the picture."""

FRAME_MARGIN = 1.05
"""What lies beyond so many times the frame's half sides is out of the picture."""

# Corners 0, 1, 2 and the middles 3, 4, 5 of sides 0-1, 1-2, 2-0. For each set of halved sides (bit k: side k) the
# triangles that come of it, in the winding of the whole.
_TURN = {0: 1, 1: 2, 2: 0, 3: 4, 4: 5, 5: 3}
_ONE = [(0, 3, 2), (3, 1, 2)]
_TWO = [(3, 1, 4), (0, 3, 4), (0, 4, 2)]


def _turned(pieces: list[tuple[int, int, int]], n_turns: int) -> list[tuple[int, int, int]]:
    for _ in range(n_turns):
        pieces = [(_TURN[a], _TURN[b], _TURN[c]) for a, b, c in pieces]
    return pieces


PIECES = {
    0b001: _ONE, 0b010: _turned(_ONE, 1), 0b100: _turned(_ONE, 2),
    0b011: _TWO, 0b110: _turned(_TWO, 1), 0b101: _turned(_TWO, 2),
    0b111: [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)],
}  # fmt: skip
_SIDES = ({0, 3, 1}, {1, 4, 2}, {2, 5, 0})


@dataclass(frozen=True)
class BentMesh:
    """Triangles that a camera without lens draws as the lens would show the mesh.

    Attributes
    ----------
    points_eye : (V', 3) float64
        Eye space: what `Camera.clip_from_eye` takes to clip space.
    triangles : (T', 3) int64
        Rows of `points_eye`; what the lens cannot see is left out.
    source : (T',) int64
        The triangle of the mesh that each is a part of.
    weights : (T', 3, 3) float64
        Each corner as a mean of the corners of that triangle.
    is_outline : (T', 3) bool
        Which sides (0-1, 1-2, 2-0) lie on a side of that triangle.
    """

    points_eye: F64
    triangles: I64
    source: I64
    weights: F64
    is_outline: Bools

    __setstate__ = set_aligned

    @property
    def wholes(self) -> npt.NDArray[np.int32]:
        """The triangle of the mesh that each part belongs to, (T' + 1,); the last is for part -1, none."""
        return np.append(self.source, -1).astype(np.int32)

    def mesh_of(self, mesh: Mesh) -> Mesh:
        """Return the parts as a mesh: positions and attributes of the whole mesh where the parts have corners."""
        corners = mesh.triangles[self.source]

        def spread(values: npt.NDArray[Any]) -> F64:
            of_parts = np.zeros((int(self.triangles.max(initial=-1)) + 1, values.shape[1]))
            of_parts[self.triangles.ravel()] = weighed(self.weights, values[corners]).reshape(-1, values.shape[1])
            return of_parts

        rows = mesh.material_of_triangle
        creased = None if mesh.is_faceted else mesh.corner_normals()
        of_vertices = None if mesh.is_faceted else spread(mesh.vertex_normals())
        parts = Mesh(
            spread(mesh.vertices),
            self.triangles.astype(np.int32),
            None if creased is not None else of_vertices,
            None if mesh.colors is None else np.rint(spread(mesh.colors)).astype(np.uint8),
            None if mesh.uv is None else spread(mesh.uv).astype(np.float32),
            mesh.materials,
            None if rows is None else rows[self.source],
            None if mesh.uv1 is None else spread(mesh.uv1).astype(np.float32),
            crease=mesh.crease,
        )
        if creased is not None and of_vertices is not None:
            own = weighed(self.weights, creased.rows[creased.of_corner[self.source]]).reshape(-1, 3)
            of_corner = len(of_vertices) + np.arange(self.triangles.size, dtype=np.int32).reshape(-1, 3)
            table = np.concatenate([of_vertices, own])
            keep_corner_normals(parts, CornerNormals(table, of_corner, parts.triangles.ravel()))
        return parts

    def outline(self, projection: F64, cull: str) -> I64:
        """The parts of the mesh's own edges as triangles (N, 3) without area, each edge once, for `wireframe`.

        `cull` leaves out the edges that only culled triangles have.
        """
        x, y = engine.product(self.points_eye[:, :2] / -self.points_eye[:, 2:], projection[:2, :2].T)[self.triangles].T
        area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
        sign = {Cull.NONE: 0, Cull.BACK: 1, Cull.FRONT: -1}[parse(Cull, "cull", cull)]
        is_drawn = self.is_outline & (area * sign > 0 if sign else np.ones(len(area), bool))[:, None]
        ends = np.stack([self.triangles, np.roll(self.triangles, -1, axis=1)], axis=-1)[is_drawn]
        ends = np.unique(np.sort(ends, axis=1), axis=0)
        return ends[:, [0, 1, 1]]


class LensMap:
    """What a lens sees of all directions, and where in a picture: made monotone beyond what the picture can show.

    The polynomials of a lens turn back somewhere beyond the angles that they were fitted to, and would fold what lies
    there into the picture. From the angle `limit` on, the picture goes on outwards, evenly.
    """

    def __init__(self, lens: Lens, px_from_plane: F64, half_size_px: tuple[float, float]) -> None:
        self.lens = lens
        self.px_from_plane = px_from_plane
        angles = np.linspace(0, lens.max_angle, N_ANGLES)
        azimuth_deg = np.arange(N_AZIMUTHS) * (360 / N_AZIMUTHS)
        around = np.array([engine.cosine_and_sine(degrees) for degrees in azimuth_deg.tolist()])
        with np.errstate(all="ignore"):  # beyond the turn there may be anything
            rings = lens.distort(_rings(angles, around)).reshape(N_ANGLES, N_AZIMUTHS, 2)
            steps = np.diff((rings * around).sum(axis=2), axis=0).min(axis=1)
        turns = np.flatnonzero(~(steps > 0))
        last = int(turns[0]) if len(turns) else N_ANGLES - 1
        last = max(last, 1)
        self._extend(angles, rings, last)
        all_angles = np.linspace(0, np.pi, N_ANGLES)
        self.least_cosine = 0.0
        everywhere, _ = self(_rings(all_angles, around))
        in_frame = (np.abs(self.px(everywhere)) <= FRAME_MARGIN * np.array(half_size_px)).all(axis=1)
        shown = np.flatnonzero(in_frame.reshape(N_ANGLES, -1).any(axis=1))
        step = all_angles[1]
        self.max_angle = min(float(all_angles[shown[-1]]) + 2 * step if len(shown) else np.pi, WIDEST)
        # A little beyond what shows the extension may begin: the tamer, the fewer edges there are halved.
        self._extend(angles, rings, min(last, int(np.searchsorted(angles, self.max_angle + 2 * step))))
        self.least_cosine, _ = engine.cosine_and_sine(min(math.degrees(self.max_angle) / 2 + 45, 89.9))

    def __call__(self, points: F64) -> tuple[F64, F64]:
        """Places (N, 2) in the image plane and ranges (N,) of points (N, 3), both finite whatever the points are."""
        off_axis, angle = engine.off_axis(points)
        sides, length = points[:, :2], off_axis[:, None]
        around = np.divide(sides, length, out=np.zeros((len(points), 2)), where=length > 0)
        around[(off_axis == 0) & (angle > 0), 0] = 1.0
        far = np.sqrt(engine.row_products(points, points))
        reach = np.maximum(self.lens.range_along(points), far * self.least_cosine)
        return self._place(points, around, angle), np.maximum(reach, np.finfo(float).tiny)

    def px(self, place: F64) -> F64:
        """Pixels (N, 2) from the middle of the picture, y up, of places in the image plane."""
        (xx, xy, x0), (yx, yy, y0) = self.px_from_plane.tolist()
        x, y = place[:, 0], place[:, 1]
        return np.stack([xx * x + xy * y + x0, yx * x + yy * y + y0], axis=1)  # BLAS takes six times as long

    def _extend(self, angles: F64, rings: F64, last: int) -> None:
        """From angles[last] on, go outwards as fast as before it, and at least as fast as on the whole way there."""
        self.limit = angles[last]
        radius = np.sqrt((rings[[last - 1, last]] ** 2).sum(axis=2)).mean(axis=1)
        self.slope = max((radius[1] - radius[0]) / (angles[last] - angles[last - 1]), radius[1] / angles[last])

    def _place(self, points: F64, around: F64, angle: F64) -> F64:
        place = np.empty((len(points), 2))
        near = angle <= self.limit
        place[near] = self.lens.distort(points[near])
        beyond = ~near
        if beyond.any():
            rim = np.empty((beyond.sum(), 3))
            cosine, sine = engine.cosine_and_sine(math.degrees(self.limit))
            rim[:, :2], rim[:, 2] = sine * around[beyond], cosine
            outwards = self.slope * (angle[beyond] - self.limit)
            place[beyond] = self.lens.distort(rim) + outwards[:, None] * around[beyond]
        return place


def weighed(weights: F64, corners: npt.NDArray[Any]) -> F64:
    """Values (T, 3, K) at the corners of parts, of those (T, 3, K) at the corners of their triangles."""
    sums: F64 = weights[:, :, 0, None] * corners[:, None, 0]
    for k in (1, 2):
        sums += weights[:, :, k, None] * corners[:, None, k]
    return sums


def _rings(angles: F64, around: F64) -> F64:
    """Directions (N_ANGLES * N_AZIMUTHS, 3) at these angles from the axis."""
    cosine, sine = np.array([engine.cosine_and_sine(degrees) for degrees in np.degrees(angles).tolist()]).T
    sides = sine[:, None, None] * around
    ahead = np.broadcast_to(cosine[:, None, None], (*sides.shape[:2], 1))
    return np.concatenate([sides, ahead], axis=2).reshape(-1, 3)


@lru_cache(maxsize=32)
def _lens_map(lens: Lens, px_from_plane: bytes, size: tuple[int, int]) -> LensMap:
    matrix = np.frombuffer(px_from_plane).reshape(2, 3)
    return LensMap(lens, matrix, (size[0] / 2, size[1] / 2))


def bend(
    vertices: npt.NDArray[np.floating[Any]],
    triangles: npt.NDArray[np.integer[Any]],
    camera: Camera,
    lens: Lens,
    size: tuple[int, int],
    *,
    near_clip: bool = True,
) -> BentMesh:
    """The mesh as a lens in front of the camera sees it in a picture of this size.

    Parameters
    ----------
    vertices : (V, 3) float
        World positions.
    triangles : (T, 3) integers
    camera : Camera
    lens : Lens
        That of the camera.
    size : (width, height), pixels
        Of the whole picture.
    near_clip : bool
        Whether what lies nearer than the near plane may be left out.

    Returns
    -------
    BentMesh
    """
    projection = camera.clip_from_eye(size)
    # A place (x, y) in the image plane is the direction (x, -y, -1) in eye axes.
    half = np.array([[size[0] / 2], [size[1] / 2]])
    px_from_plane = half * projection[:2, :3] * FLIP
    lens_map = _lens_map(lens, px_from_plane.tobytes(), (max(size[0], 1), max(size[1], 1)))
    points = moved(vertices, camera.view) * FLIP
    # Window depth is below 0 for ranges under this one.
    near = projection[2, 3] / (projection[2, 2] - 1) if near_clip else 0.0
    return _Subdivision(lens_map, points, lens.tolerance_px, near).run(np.asarray(triangles, np.int64))


class _Subdivision:
    """The vertices so far, in camera axes, with where they are seen."""

    def __init__(self, lens_map: LensMap, points: F64, tolerance_px: float, near: float) -> None:
        self.lens_map, self.tolerance_px, self.near = lens_map, tolerance_px, near
        self.points = np.empty((0, 3))
        self.place, self.reach, self.direction = np.empty((0, 2)), np.empty(0), np.empty((0, 3))
        self._add(points)

    def run(self, triangles: I64) -> BentMesh:
        """Halve edges until all are straight enough; then put the triangles back in the order of the mesh."""
        most = MAX_PARTS + MAX_PARTS_OF_ONE * len(triangles)
        n_to_forecast = N_TO_FORECAST
        done: list[Parts] = []
        for done in self._rounds(triangles):
            n_parts, n_live = _count(done), len(done[-1][0])
            if n_live > n_to_forecast and n_parts <= most:
                n_parts += self._forecast(done[-1][0], most) - n_live
                n_to_forecast = 4 * n_live
            if n_parts > most:
                raise ValueError(
                    f"the lens splits {len(triangles)} triangles into more than {most} parts: give it a larger "
                    f"tolerance_px than {self.tolerance_px:g}, or leave out the triangles that are far larger than the "
                    "picture shows"
                )
        triangles, source, weights, is_outline = _joined(done)
        order = np.argsort(source, kind="stable")
        bent = np.stack([self.place[:, 0] * self.reach, -self.place[:, 1] * self.reach, -self.reach], axis=1)
        return BentMesh(bent, triangles[order], source[order], weights[order], is_outline[order])

    def _forecast(self, triangles: I64, most: int) -> int:
        """About how many parts there will be of these: as many as of some of them, tried alone."""
        step = len(triangles) // N_TRIED
        used, corners = np.unique(triangles[::step], return_inverse=True)
        trial = _Subdivision(self.lens_map, self.points[used], self.tolerance_px, self.near)
        n_parts = 0
        for done in trial._rounds(corners.reshape(-1, 3)):
            n_parts = step * _count(done)
            if n_parts > most:
                break
        return n_parts

    def _rounds(self, triangles: I64) -> Iterator[list[Parts]]:
        """Halve edges until all are straight enough; yields the parts so far, the last of which may be split again."""
        parts: Parts = (
            triangles,
            np.arange(len(triangles)),
            np.broadcast_to(np.eye(3), (len(triangles), 3, 3)),
            np.ones((len(triangles), 3), bool),
        )
        done: list[Parts] = []
        for _ in range(MAX_HALVINGS):
            parts = _rows(parts, self._may_show(parts[0]))
            sides = np.stack([parts[0], np.roll(parts[0], -1, axis=1)], axis=-1)
            sides.sort(axis=-1)
            keys, which = np.unique(sides[..., 0] * len(self.points) + sides[..., 1], return_inverse=True)
            low, high = np.divmod(keys, len(self.points))
            is_bent = self._is_bent(low, high)
            if not is_bent.any():
                break
            middle = np.full(len(keys), -1)
            middle[is_bent] = len(self.points) + np.arange(is_bent.sum())
            self._add((self.points[low[is_bent]] + self.points[high[is_bent]]) / 2)
            middles = middle[which.reshape(-1, 3)]
            masks = (middles >= 0) @ np.array([1, 2, 4])
            done.append(_rows(parts, masks == 0))
            pieces = [_split(_rows(parts, masks == mask), middles[masks == mask], mask) for mask in PIECES]
            parts = _joined(pieces)
            yield [*done, parts]
        yield [*done, _rows(parts, self._may_show(parts[0]))]

    def _add(self, points: F64) -> None:
        place, reach = self.lens_map(points)
        far = np.sqrt(engine.row_products(points, points))[:, None]
        direction = np.divide(points, far, out=np.tile([0.0, 0.0, 1.0], (len(points), 1)), where=far > 0)
        self.points = np.concatenate([self.points, points])
        self.place = np.concatenate([self.place, place])
        self.reach = np.concatenate([self.reach, reach])
        self.direction = np.concatenate([self.direction, direction])

    def _may_show(self, triangles: I64) -> Bools:
        """False where no point of a triangle can be in the picture.

        Its directions lie in the cap round their middle that holds the corners (caps below 90 degrees are convex).
        """
        corners = self.direction[triangles]
        middle = corners.sum(axis=1)
        length = np.sqrt(engine.row_products(middle, middle))
        middle /= np.maximum(length, 1e-300)[:, None]
        cosine = np.min([engine.row_products(corners[:, k], middle) for k in range(3)], axis=0)
        _, off_axis = engine.off_axis(middle)
        is_cap = (length > 1e-6) & (cosine > 1e-6)
        # Rounding of the arc cosine near 1: 1e-7 is more than it.
        is_outside = is_cap & (off_axis - np.arccos(np.clip(cosine, -1, 1)) > self.lens_map.max_angle + 1e-7)
        is_too_near = (self.reach[triangles] < self.near).all(axis=1)
        return ~(is_outside | is_too_near)

    def _is_bent(self, low: I64, high: I64) -> Bools:
        """Whether edges have to be halved; nothing but their ends is looked at, and the ends may change places."""
        cosine = engine.row_products(self.direction[low], self.direction[high])
        is_bent = cosine < LEAST_EDGE_COSINE
        ask = np.flatnonzero(~is_bent)
        a, b = low[ask], high[ask]
        px_a, px_b = self.lens_map.px(self.place[a]), self.lens_map.px(self.place[b])
        off = np.zeros(len(ask))
        middle = (px_a + px_b) / 2
        spread_px = _largest(px_a - middle)
        for share in (0.25, 0.5, 0.75):
            place, reach = self.lens_map((1 - share) * self.points[a] + share * self.points[b])
            weight_a, weight_b = (1 - share) * self.reach[a], share * self.reach[b]
            mean = weight_a + weight_b
            straight = (weight_a[:, None] * px_a + weight_b[:, None] * px_b) / mean[:, None]
            px = self.lens_map.px(place)
            spread_px = np.maximum(spread_px, _largest(px - middle))
            off = np.maximum(off, _largest(px - straight) / self.tolerance_px)
            if not self.lens_map.lens.has_planar_range:
                off = np.maximum(off, np.abs(reach - mean) / (MAX_RANGE_ERROR * mean))
        is_bent[ask] = (off > 1) & (spread_px > SHORT_PX)
        return is_bent


def _largest(steps: F64) -> F64:
    """The larger of both sides (N,) of steps (N, 2)."""
    return np.maximum(np.abs(steps[:, 0]), np.abs(steps[:, 1]))


def _count(many: list[Parts]) -> int:
    return sum(len(each[0]) for each in many)


def _rows(parts: Parts, keep: Bools) -> Parts:
    triangles, source, weights, is_outline = parts
    return triangles[keep], source[keep], weights[keep], is_outline[keep]


def _joined(many: list[Parts]) -> Parts:
    triangles, source, weights, is_outline = zip(*many, strict=True)
    return np.concatenate(triangles), np.concatenate(source), np.concatenate(weights), np.concatenate(is_outline)


def _split(parts: Parts, middles: I64, mask: int) -> Parts:
    """The pieces of triangles of which the same sides are halved."""
    triangles, source, weights, is_outline = parts
    six = np.concatenate([triangles, middles], axis=1)
    six_weights = np.concatenate([weights, (weights + np.roll(weights, -1, axis=1)) / 2], axis=1)
    inside = np.zeros(len(source), bool)
    found: list[Parts] = []
    for piece in PIECES[mask]:
        ends = [{first, second} for first, second in pairwise([*piece, piece[0]])]
        sides = [next((k for k in range(3) if pair <= _SIDES[k]), None) for pair in ends]
        outline = np.stack([inside if side is None else is_outline[:, side] for side in sides], axis=1)
        found.append((six[:, piece], source, six_weights[:, piece], outline))
    return _joined(found)
