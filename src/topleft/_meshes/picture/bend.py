"""Bends edges: splits triangles until their sides are straight in the picture of a lens, to within a tolerance.

Input: vertices and triangles in world space, a camera with a lens. Output: `BentMesh`, which a camera without the lens
draws as the lens would show the mesh.

Kernels do it (`csrc/mesh/bend.c`): where the lens bends no edge of a triangle by half of the tolerance, by a bound on
its second derivative, the triangle is not looked at. Other edges are halved (in space) where their picture, at a
quarter, half or three quarters of their length, is off by more than the tolerance from that of a straight edge
there, its depth too, unless it is shorter than a pixel there, or where they span a large angle. The test
reads the edge alone, so triangles that share it split it alike, and no gap opens.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F32, F64, I32
from topleft._core.base.arrays import set_aligned
from topleft._core.base.cached import cached_property
from topleft._core.base.color import spread_colors
from topleft._core.base.memory import empty
from topleft._core.base.options import parse
from topleft._core.base.threads import run_parts, threads_of_rows
from topleft._meshes.camera.camera import Camera
from topleft._meshes.camera.lens import FLIP, Lens
from topleft._meshes.model.mesh import Mesh, keep_corner_normals
from topleft._meshes.model.normals import CornerNormals, moved
from topleft.typing import CullOption

WIDEST = np.radians(160)
"""Points farther from the axis are never drawn: a triangle round the back of the axis would cover everything. Those
that pass the test have a cap of less than 10 degrees and end before that."""

MAX_PARTS, MAX_PARTS_OF_ONE = 1 << 22, 8
"""Most parts of a mesh, beside so many for each of its triangles: 0.7 GB."""

N_TRIED = 1 << 10
"""So many of more triangles are split alone, to tell how many parts all will have."""

N_ANGLES, N_AZIMUTHS = 513, 128
"""Rings of directions to find in the picture."""

FRAME_MARGIN = 1.05
"""Points beyond so many times the frame's half sides are out of the picture."""

N_BENDS, N_ROUND = 4, 32
"""How many directions the second derivative of a lens is taken at: out from the axis in a ring, and round it."""

BEND_MARGIN = 2.0
"""How much more than the largest second derivative found a lens may have between them."""

LONGEST_CHORD, LONGEST_CHORD_OF_RANGES = 0.249, 0.0436
"""Chords of directions below the angle at which edges are halved in any case, and where depth is the range: 1 -
cos(w/2) < 2^-12."""


class SubdividedTriangles(NamedTuple):
    """The parts of triangles that are not drawn as they are."""

    source: I32  # (T',): the triangle of the mesh that each triangle of the bent mesh is, or is a part of
    rows: npt.NDArray[np.intp]  # (P,): the triangles that are parts
    weights: F64  # (P, 3, 3): each corner of a part as a mean of the corners of its triangle
    is_outline: npt.NDArray[np.uint8]  # (P, 3): which sides (0-1, 1-2, 2-0) of a part lie on a side of its triangle


@dataclass(frozen=True, eq=False)
class BentMesh:
    """Triangles that a camera without lens draws as the lens would show the mesh."""

    points_eye: F64
    """(V', 3), for `Camera.clip_from_eye`: first the vertices of the mesh that are used, then vertices of parts."""
    triangles: I32  # (T', 3): rows of `points_eye`; triangles that the lens cannot see are left out
    parts: SubdividedTriangles | None  # None: the triangles of the mesh

    __setstate__ = set_aligned

    @cached_property
    def source(self) -> I32:
        """The triangle of the mesh that each is a part of, (T',)."""
        return np.arange(len(self.triangles), dtype=np.int32) if self.parts is None else self.parts.source

    @cached_property
    def wholes(self) -> I32:
        """The triangle of the mesh that each part belongs to, (T' + 1,); the last is for part -1, none."""
        return np.append(self.source, np.int32(-1))

    def whole_ids(self, ids: I32) -> I32:
        """Return ids of parts as ids of the triangles of the mesh."""
        return ids if self.parts is None else self.wholes[ids]

    def at_corners(self, corners: npt.NDArray[Any]) -> F64:
        """Values (T', 3, K) at the corners of the parts, from values (T, 3, K) at the corners of the mesh."""
        values: F64 = corners[self.source].astype(np.float64)
        if self.parts is not None:
            values[self.parts.rows] = weighed(self.parts.weights, values[self.parts.rows])
        return values

    def mesh_of(self, mesh: Mesh) -> Mesh:
        """Return the parts as a mesh: positions and attributes of the whole mesh where the parts have corners."""
        parts = self.parts
        if parts is None:
            return mesh
        split = self.triangles[parts.rows].ravel()
        corners = mesh.triangles[parts.source[parts.rows]]

        def spread(values: npt.NDArray[Any]) -> F64:
            of_parts = np.zeros((len(self.points_eye), values.shape[1]))
            of_parts[: len(values)] = values
            of_parts[split] = weighed(parts.weights, values[corners]).reshape(-1, values.shape[1])
            return of_parts

        rows = mesh.material_of_triangle
        creased = None if mesh.is_faceted else mesh.corner_normals()
        of_vertices = None if mesh.is_faceted else spread(mesh.vertex_normals())
        made = Mesh(
            spread(mesh.vertices),
            self.triangles,
            None if creased is not None else of_vertices,
            None if mesh.colors is None else spread_colors(mesh.colors, mesh.color_interpolation == "linear", spread),
            None if mesh.uv is None else spread(mesh.uv).astype(np.float32),
            mesh.materials,
            None if rows is None else rows[parts.source],
            None if mesh.uv1 is None else spread(mesh.uv1).astype(np.float32),
            crease=mesh.crease,
            color_interpolation=mesh.color_interpolation,
        )
        if creased is not None and of_vertices is not None:
            first = len(of_vertices)
            of_corner = creased.of_corner[parts.source] + np.int32(first)
            own = weighed(parts.weights, creased.rows[creased.of_corner[parts.source[parts.rows]]]).reshape(-1, 3)
            own_rows = np.arange(len(own), dtype=np.int32) + np.int32(first + len(creased.rows))
            of_corner[parts.rows] = own_rows.reshape(-1, 3)
            table = np.concatenate([of_vertices, creased.rows, own])
            keep_corner_normals(made, CornerNormals(table, of_corner, made.triangles.ravel()))
        return made

    def outline(self, projection: F64, cull: str, mask: npt.NDArray[np.bool_] | None) -> npt.NDArray[np.intp]:
        """The parts of the edges of the mesh as triangles (N, 3) without area, each edge once, for `wireframe`.

        `cull` and `mask`, of triangles of the mesh, leave out the edges that no other triangles have.
        """
        x, y = engine.product(self.points_eye[:, :2] / -self.points_eye[:, 2:], projection[:2, :2].T)[self.triangles].T
        area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
        sign = {"none": 0, "back": 1, "front": -1}[parse(CullOption, "cull", cull)]
        is_drawn = np.ones(self.triangles.shape, bool)
        places: npt.NDArray[np.signedinteger[Any]] = self.triangles
        if self.parts is not None:  # parts have other points than the mesh
            is_drawn[self.parts.rows] = self.parts.is_outline
            _, same = np.unique(self.points_eye, axis=0, return_inverse=True)
            first = np.empty(len(same), np.intp)
            first[same[::-1]] = np.arange(len(same))[::-1]
            places = first[same][self.triangles]
        if sign:
            is_drawn &= (area * sign > 0)[:, None]
        if mask is not None:
            is_drawn &= mask[self.source][:, None]
        ends = np.stack([places, np.roll(places, -1, axis=1)], axis=-1)[is_drawn]
        ends = np.unique(np.sort(ends, axis=1), axis=0)
        return ends[:, [0, 1, 1]]


class LensMap:
    """Where a lens shows each direction in a picture: made monotone beyond the angles that the picture shows.

    The polynomials of a lens turn back somewhere beyond the angles that they were fitted to, and would fold points
    there into the picture. From the angle `limit` on, the picture goes on outwards, evenly.
    """

    def __init__(self, lens: Lens, px_from_plane: F64, half_size_px: tuple[float, float]) -> None:
        self.lens = lens
        self.px_from_plane = px_from_plane
        is_fisheye = not lens.has_planar_range
        self.table = engine.LensTable(is_fisheye, *lens.terms, px_from_plane.tolist(), lens.tolerance_px)
        angles = np.linspace(0, lens.max_angle, N_ANGLES)
        around = _circle(N_AZIMUTHS)
        with np.errstate(all="ignore"):  # beyond the turn there may be anything
            rings = lens.distort(_rings(angles, around)).reshape(N_ANGLES, N_AZIMUTHS, 2)
            steps = np.diff((rings * around).sum(axis=2), axis=0).min(axis=1)
        turns = np.flatnonzero(~(steps > 0))
        last = int(turns[0]) if len(turns) else N_ANGLES - 1
        last = max(last, 1)
        self._extend(angles, rings, last)
        all_angles = np.linspace(0, np.pi, N_ANGLES)
        everywhere = self.px(self.table.places(_rings(all_angles, around) * FLIP))
        in_frame = (np.abs(everywhere) <= FRAME_MARGIN * np.array(half_size_px)).all(axis=1)
        shown = np.flatnonzero(in_frame.reshape(N_ANGLES, -1).any(axis=1))
        step = all_angles[1]
        self.max_angle = min(float(all_angles[shown[-1]]) + 2 * step if len(shown) else np.pi, WIDEST)
        # The extension may begin a little beyond the visible angles: the tamer, the fewer edges there are halved.
        self._extend(angles, rings, min(last, int(np.searchsorted(angles, self.max_angle + 2 * step))))
        least_cosine, _ = engine.cosine_and_sine(min(math.degrees(self.max_angle) / 2 + 45, 89.9))
        # Rounding of cosines near 1: 1e-7 is more than it.
        self.table.set_frame(least_cosine, *engine.cosine_and_sine(math.degrees(self.max_angle + 1e-7)))
        self._set_rings(min(self.max_angle, self.limit))

    def px(self, place: F64) -> F64:
        """Pixels (N, 2) from the middle of the picture, y up, of places in the image plane."""
        (xx, xy, x0), (yx, yy, y0) = self.px_from_plane.tolist()
        x, y = place[:, 0], place[:, 1]
        return np.stack([xx * x + xy * y + x0, yx * x + yy * y + y0], axis=1)  # BLAS takes six times as long

    def _extend(self, angles: F64, rings: F64, last: int) -> None:
        """From angles[last] on, go outwards as fast as before it, and at least as fast as on the whole way there."""
        self.limit = float(angles[last])
        radius = np.sqrt((rings[[last - 1, last]] ** 2).sum(axis=2)).mean(axis=1)
        slope = max((radius[1] - radius[0]) / (angles[last] - angles[last - 1]), radius[1] / angles[last])
        self.table.go_on_from(self.limit, *engine.cosine_and_sine(math.degrees(self.limit)), float(slope))

    def _set_rings(self, widest: float) -> None:
        """Find the chords between directions, ring by ring out from the axis, below which no edge is bent.

        The picture of an edge differs from a straight one by its second derivative, along the plane or, of a fisheye,
        along great circles, times the square of its length over 8. Rings end at even steps of the sine of half the
        angle, and each is bounded by the largest derivative within it.
        """
        n, step = engine.LENS_RINGS, widest / 256
        outermost, _ = engine.cosine_and_sine(math.degrees(widest - 2 * step))
        if not 0 < outermost < 1:
            return
        cosines = 1 - (np.arange(1, n * N_BENDS + 1) / (n * N_BENDS)) ** 2 * (1 - outermost)
        with np.errstate(all="ignore"):
            bends = self._bends(np.append(1.0, cosines), step)
            allowed = 8 * self.lens.tolerance_px / (BEND_MARGIN * np.maximum.accumulate(bends))
        most = np.float64(LONGEST_CHORD if self.lens.has_planar_range else LONGEST_CHORD_OF_RANGES)
        ends = slice(N_BENDS, None, N_BENDS)
        if self.lens.has_planar_range:  # the plane is longer than the sphere of directions, by 1 / cos^2 at most
            allowed[1:] *= cosines**4
        found = np.minimum(allowed[ends], most**2)
        self.table.set_rings(outermost, np.where(found > 1e-10, found, -1.0).astype(np.float32))

    def _bends(self, cosines: F64, step: float) -> F64:
        """The largest second derivatives (N,), in pixels, in rings of these cosines."""
        around = _circle(N_ROUND)
        sines = np.sqrt((1 - cosines) * (1 + cosines))[:, None, None]
        ahead = np.broadcast_to(cosines[:, None, None], (len(cosines), N_ROUND, 1))
        here = np.concatenate([sines * around, ahead], axis=2)
        out = np.concatenate([ahead * around, np.broadcast_to(-sines, ahead.shape)], axis=2)
        turned = np.stack([-around[:, 1], around[:, 0], np.zeros(N_ROUND)], axis=1)
        ways = [out, np.broadcast_to(turned, out.shape), (out + turned) / math.sqrt(2)]
        cosine, sine = engine.cosine_and_sine(math.degrees(step))
        if self.lens.has_planar_range:
            here = here / ahead
            ways = [
                np.broadcast_to(np.array(way), out.shape) for way in ((1, 0, 0), (0, 1, 0), (0.5**0.5, 0.5**0.5, 0))
            ]
            cosine, sine = 1.0, step

        def seen(points: F64) -> F64:
            return self.px(self.lens.distort(points.reshape(-1, 3))).reshape(*points.shape[:2], 2)

        middle = seen(here)
        ends = [(seen(cosine * here + sine * way), seen(cosine * here - sine * way)) for way in ways]
        xx, yy, half = (((a - middle) + (b - middle)) / step**2 for a, b in ends)
        squares = xx**2 + yy**2 + 2 * (half - (xx + yy) / 2) ** 2
        bends = np.sqrt(squares.sum(axis=2))
        if not self.lens.has_planar_range:  # a share of a chord is not that share of its arc
            bends += 0.01 * np.sqrt(sum(((a - b) ** 2).sum(axis=2) for a, b in ends[:2])) / (2 * step)
        return np.asarray(bends.max(axis=1))


def weighed(weights: F64, corners: npt.NDArray[Any]) -> F64:
    """Values (T, 3, K) at the corners of parts, from values (T, 3, K) at the corners of their triangles."""
    sums: F64 = weights[:, :, 0, None] * corners[:, None, 0]
    for k in (1, 2):
        sums += weights[:, :, k, None] * corners[:, None, k]
    return sums


def _circle(n: int) -> F64:
    """Directions (n, 2) round the axis."""
    return np.array([engine.cosine_and_sine(degrees) for degrees in (np.arange(n) * (360 / n)).tolist()])


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
    """The mesh, vertices (V, 3) in the world, as a lens in front of the camera sees it in a picture of this size.

    `near_clip`: whether triangles nearer than the near plane may be left out.
    """
    projection = camera.clip_from_eye(size)
    # A place (x, y) in the image plane is the direction (x, -y, -1) in eye axes.
    half = np.array([[size[0] / 2], [size[1] / 2]])
    px_from_plane = half * projection[:2, :3] * FLIP
    table = _lens_map(lens, px_from_plane.tobytes(), (max(size[0], 1), max(size[1], 1))).table
    # Window depth is below 0 for ranges under this one.
    near = float(projection[2, 3] / (projection[2, 2] - 1)) if near_clip else 0.0
    dtype: Any = np.float32 if np.asarray(vertices).dtype == np.float32 else np.float64
    given: npt.NDArray[np.floating[Any]] = np.ascontiguousarray(vertices, dtype)
    corners, source = np.ascontiguousarray(triangles, np.int32), engine.Source(given)
    n_vertices, n_triangles, eye_from = len(given), len(corners), np.ascontiguousarray(camera.view, np.float64)
    bent, records = empty((n_vertices, 3), np.float64), empty((n_vertices, 4), np.float32)

    def bend_rows(first: int, end: int) -> None:
        table.bend_vertices(source, eye_from, near, first, end, bent, records)

    run_parts(bend_rows, n_vertices, threads_of_rows(n_vertices))
    ids, outside = empty((2, n_triangles + 16), np.int32)
    n_bent, n_outside = table.find_bent(records, corners, 0, n_triangles, ids, outside)
    if not n_bent and not n_outside:
        return BentMesh(bent, corners, None)
    is_kept = np.ones(n_triangles, bool)
    is_kept[ids[:n_bent]] = is_kept[outside[:n_outside]] = False
    kept = np.flatnonzero(is_kept).astype(np.int32)
    split = _split(table, lens, moved(given, eye_from), records, corners, ids[:n_bent], len(kept), near)
    return _joined(bent, corners, kept, split)


class _Split(NamedTuple):
    """Parts of triangles, in their order, and points that the vertices do not have."""

    triangles: I32
    source: I32
    weights: F64
    is_outline: npt.NDArray[np.uint8]
    points: F64


def _split(
    table: engine.LensTable, lens: Lens, points: F64, records: F32, triangles: I32, ids: I32, n_kept: int, near: float
) -> _Split:
    """Split listed triangles; refuse to make too many parts before they are made."""
    most = MAX_PARTS + MAX_PARTS_OF_ONE * len(triangles)
    step = max(1, len(ids) // N_TRIED)
    n_tried = n_kept
    for every in dict.fromkeys((step, 1)):
        tried = np.ascontiguousarray(ids[::every])
        n_parts, n_points = table.count_parts(points, records, triangles, tried, near, (most - n_kept) // every)
        n_tried = n_kept + every * n_parts
        if n_tried > most:
            raise ValueError(
                f"the lens splits {len(triangles)} triangles into more than {most} parts: give it a larger "
                f"tolerance_px than {lens.tolerance_px:g}, or leave out the triangles that are far larger than the "
                "picture shows"
            )
    own, source = np.empty((n_parts, 3), np.int32), np.empty(n_parts, np.int32)
    weights, is_outline = np.empty((n_parts, 3, 3)), np.empty((n_parts, 3), np.uint8)
    own_points = np.empty((n_points, 3))
    table.write_parts(points, records, triangles, ids, near, own, source, weights, is_outline, own_points)
    return _Split(own, source, weights, is_outline, own_points)


def _joined(bent: F64, triangles: I32, kept: I32, split: _Split) -> BentMesh:
    """The triangles that are drawn as they are, and the parts of others, in the order of the mesh."""
    source = np.concatenate([kept, split.source])
    order = np.argsort(source, kind="stable")
    rows = np.flatnonzero(order >= len(kept))
    own = np.concatenate([triangles[kept], split.triangles])[order]
    parts = SubdividedTriangles(source[order], rows, split.weights, split.is_outline)
    return BentMesh(np.concatenate([bent, split.points]), own, parts)
