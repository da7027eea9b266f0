"""Computes coarser levels of a mesh, each with a bound on its distance from the mesh.

In: a mesh. Out: `Levels`. fast-simplification collapses edges (`collapse.py`); each level is measured against the
surface that it replaces (`distance.py`).

A vertex of a level takes its attributes from the nearest point on the triangles round the vertices that were merged
into it. Other triangles may be nearer, across a seam or a thin wall: they are not read.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, I32
from topleft._core.base.arrays import shown
from topleft._core.base.color import spread_colors
from topleft._core.base.threads import ProcessLock
from topleft._meshes.lod.collapse import STUCK, Collapsed, border_points, collapse, collapser, open_sides, wanted_of
from topleft._meshes.lod.distance import TriangleTree, measure
from topleft._meshes.lod.levels import Level, Levels, keep_levels, kept_levels
from topleft._meshes.lod.parts import JOINED, LEAST_PARTED, OF_PART, Parts, sort_in_parts
from topleft._meshes.model.mesh import FloatArray, Mesh, coincident
from topleft._meshes.model.normals import unit_or_zero

#: Levels are measured against the mesh itself, or against its finest level with at most 300,000 triangles, whose bound
#: is added: it is small beside the bounds of coarser levels, and measuring takes time in proportion to the triangles.
MOST_TO_COMPARE = 300_000

#: The last level is the one before a level with 1/n of its triangles and more than n to this power times its bound:
#: that level has lost a part. On smooth surfaces bounds are proportional to the area of triangles, so to n.
MOST_POWER = 2.0

#: A level with more triangles is the last if its parts cannot be collapsed: the package takes 300 bytes a triangle.
MOST_WHOLE = 2_000_000

#: The attributes of vertices, by their names in a mesh.
ATTRIBUTES = ("normals", "colors", "uv", "uv1")


_lock = ProcessLock(threading.RLock)


class Corners(NamedTuple):
    """A mesh that shares points only where all attributes are equal."""

    points: F64  # (N, 3)
    triangles: I32  # (T, 3)
    attributes: dict[str, npt.NDArray[Any]]  # (N, K) each
    material: I32 | None  # (N,) rows; triangles of different materials share no point
    mixes_light: bool = False  # whether colours are interpolated in linear light


def simplify(mesh: Mesh, *, ratio: float = 0.25, smallest: int = 200) -> Levels:
    """The mesh and coarser levels of it, each with a bound on its distance from the mesh; cached with the mesh.

    Parameters
    ----------
    mesh : Mesh
    ratio : float
        The triangles of a level, as a share of the triangles of the level before, 0.05 to 0.75.
    smallest : int
        No level has fewer triangles than about this number, at least 4.

    Returns
    -------
    Levels
        `levels[0]` is the mesh. The last level is the one whose edges cannot be collapsed. `render(tolerance=)` uses
        the levels for as long as the mesh lives; `levels.save(path)` writes them.

    Raises
    ------
    TypeError
        If `mesh` is no `Mesh`.
    ValueError
        If an option is out of range.
    MissingPackageError
        If fast-simplification is not installed: ``pip install fast-simplification``.

    Notes
    -----
    The bound is a bound on the two-sided Hausdorff distance of the surfaces as they are drawn, float32 or float64, in
    units of object space: it holds for each point of both, borders included, whatever the collapser did.

    Vertices at equal places with equal attributes are merged, and unused vertices are dropped. A vertex of a level
    takes its normal, colour and texture coordinates from the nearest point of the level before, among the triangles
    round the vertices that were merged into it. Open borders do not change, vertex by vertex, nor do the seams where
    attributes jump or materials meet: colours do not bleed and surfaces do not crack, but no level is coarser than its
    borders and seams. A mesh without normals has levels without normals, which crease at an equal angle.

    Levels of a mesh of 500,000 triangles or more consist of parts, whose borders do not change within a level either.
    `render` and `rasterize_mesh` draw each part at the coarsest level that the view allows.

    Examples
    --------
    >>> import topleft as tl
    >>> torus = tl.Mesh(*tl.scenes.torus())
    >>> levels = tl.simplify(torus)  # doctest: +SKIP
    >>> [len(level.mesh.triangles) for level in levels]  # doctest: +SKIP
    [16384, 4096, 1024, 256]
    """
    if not isinstance(mesh, Mesh):
        raise TypeError(f"mesh must be a Mesh, got {shown(mesh)}; of a Scene simplify its meshes")
    if not 0.05 <= ratio <= 0.75:
        raise ValueError(f"ratio must lie in 0.05 to 0.75, got {ratio!r}")
    if smallest < 4:
        raise ValueError(f"smallest must be at least 4, got {smallest!r}")
    collapser()
    with _lock:
        return keep_levels(mesh, Levels(mesh, *coarser_levels(mesh, ratio, smallest)))


def levels_of(mesh: Mesh) -> Levels:
    """The cached levels of a mesh; computes them at the first call."""
    with _lock:
        return kept_levels(mesh) or simplify(mesh)


def coarser_levels(mesh: Mesh, ratio: float, smallest: int) -> tuple[list[Level], Parts | None]:
    """The coarser levels of a mesh, and the parts of a large mesh and its levels."""
    levels: list[Level] = []
    corners, rows = corners_of(mesh)
    center = corners.points.min(axis=0) / 2 + corners.points.max(axis=0) / 2 if len(corners.points) else np.zeros(3)
    n = len(corners.triangles)
    n_joins = round(math.log(n / OF_PART, JOINED)) if n >= LEAST_PARTED else 0
    starts = np.array([0, n])
    if n_joins:
        order, starts = sort_in_parts(corners.points, corners.triangles, n_joins)
        corners, rows = corners._replace(triangles=corners.triangles[order]), rows[order]
    layers = [Layer(mesh, corners, starts, np.zeros(len(starts) - 1), [])]
    anchor = layers[0]
    base: Layer | None = layers[0]
    while base is not None:
        coarser = coarser_layer(base, ratio, smallest, mesh)
        if coarser is not None:
            bounds, known = measured(anchor, coarser, center)
            bound, n_before, n = float(bounds.max()), len(base.corners.triangles), len(coarser.corners.triangles)
            if levels and bound > (n_before / n) ** MOST_POWER * levels[-1].bound:
                coarser = None
        if coarser is None:  # a single part may have spoiled the level: try again without parts
            base = base.as_one()
            continue
        levels.append(Level(coarser.mesh, bound, known))
        layers.append(coarser._replace(bounds=bounds))
        base = layers[-1]
        if len(anchor.corners.triangles) > MOST_TO_COMPARE:
            anchor = layers[-1]
    is_parted = n_joins > 0 and len(levels) > 0
    columns = tuple(layer.starts for layer in layers), tuple(layer.bounds for layer in layers)
    return levels, Parts(rows, *columns) if is_parted else None


class Layer(NamedTuple):
    """A level and its parts: where the triangles of each part begin, and bounds of the distances from the mesh."""

    mesh: Mesh
    corners: Corners
    starts: npt.NDArray[np.int64]
    bounds: F64
    whole: list[TriangleTree]  # the surface of all parts, empty before its first use

    @property
    def n_parts(self) -> int:
        """How many parts the level has."""
        return len(self.starts) - 1

    def as_one(self) -> Layer | None:
        """The level as a single part; None if it has a single part, or is too large to be collapsed at once."""
        n = len(self.corners.triangles)
        if self.n_parts == 1 or n > MOST_WHOLE:
            return None
        return self._replace(starts=np.array([0, n]), bounds=self.bounds.max(keepdims=True))

    def part(self, i: int, n: int) -> tuple[Corners, I32]:
        """Part i of n, each joined from n_parts / n parts of the level, and the rows of its points."""
        step = self.n_parts // n
        triangles = self.corners.triangles[self.starts[step * i] : self.starts[step * (i + 1)]]
        used, compact = np.unique(triangles, return_inverse=True)
        attributes = {name: array[used] for name, array in self.corners.attributes.items()}
        material = None if self.corners.material is None else self.corners.material[used]
        return self.corners._replace(
            points=self.corners.points[used], triangles=compact.reshape(-1, 3).astype(np.int32), attributes=attributes,
            material=material,
        ), used  # fmt: skip

    def surface(self, i: int, n: int, center: F64) -> TriangleTree:
        """The surface of part i of n; the surface of the whole level is cached."""
        if n > 1:
            part, _ = self.part(i, n)
            return TriangleTree.of_mesh(part.points, part.triangles, center)
        if not self.whole:
            self.whole.append(TriangleTree.of_mesh(self.mesh.vertices, self.mesh.triangles, center))
        return self.whole[0]


def measured(anchor: Layer, coarser: Layer, center: F64) -> tuple[F64, float]:
    """Upper bounds of the distances of a level's parts from the mesh, by way of `anchor`; and a lower bound."""
    n = coarser.n_parts
    before = anchor.bounds.reshape(n, -1).max(axis=1)
    distances = [measure(anchor.surface(i, n, center), coarser.surface(i, n, center)) for i in range(n)]
    bounds = before + np.array([apart.bound for apart in distances])
    return bounds, max(0.0, *(apart.known - bound for apart, bound in zip(distances, before.tolist(), strict=True)))


def coarser_layer(layer: Layer, ratio: float, smallest: int, mesh: Mesh) -> Layer | None:
    """The next level, before its distances are measured; None where no edge can be collapsed."""
    n_before = len(layer.corners.triangles)
    if layer.n_parts == 1:
        has_more = bool(layer.corners.attributes) or layer.corners.material is not None
        collapsed = collapse_to(layer.corners, ratio, smallest, with_pairs=has_more)
        if collapsed is None:
            return None
        corners = next_corners(layer.corners, collapsed)
        starts = np.array([0, len(corners.triangles)])
    else:
        n = layer.n_parts // JOINED
        corners, starts = joined_parts(layer, [coarser_part(*layer.part(i, n), ratio, smallest) for i in range(n)])
        if len(corners.triangles) > STUCK * n_before:
            return None
    corners = stored(corners, mesh)
    return Layer(level_mesh(corners, mesh), corners, starts, np.zeros(len(starts) - 1), [])


def collapse_to(corners: Corners, ratio: float, smallest: int, *, with_pairs: bool) -> Collapsed | None:
    """The corners collapsed to a share of their triangles; None where too many triangles are left."""
    n_wanted = wanted_of(corners.triangles, ratio, smallest)
    if not n_wanted:
        return None
    collapsed = collapse(corners.points, corners.triangles, n_wanted, with_pairs=with_pairs)
    return collapsed if 0 < len(collapsed.triangles) <= STUCK * len(corners.triangles) else None


class CoarserPart(NamedTuple):
    """A part of the next level, and the points of its border: their rows in the part, and in the level before."""

    corners: Corners
    border: npt.NDArray[np.int64]
    border_before: npt.NDArray[np.int64]


def coarser_part(part: Corners, rows_before: npt.NDArray[Any], ratio: float, smallest: int) -> CoarserPart:
    """A part of the next level with an equal border, to the bit; `rows_before`: of its points in the level before.

    The part itself, if no edge can be collapsed or the border would change.
    """
    border = border_points(part.triangles)
    collapsed = collapse_to(part, ratio, smallest, with_pairs=True)
    if collapsed is None or collapsed.into is None or not keeps_border(part.triangles, collapsed):
        return CoarserPart(part, border, rows_before[border])
    corners, rows = next_corners(part, collapsed), collapsed.into[border].astype(np.int64)
    corners.points[rows] = part.points[border]
    for name, array in corners.attributes.items():
        array[rows] = part.attributes[name][border]
    return CoarserPart(corners, rows, rows_before[border])


def keeps_border(triangles: I32, collapsed: Collapsed) -> bool:
    """Whether the open sides are equal before and after the collapse."""
    assert collapsed.into is not None
    before = np.sort(collapsed.into[open_sides(triangles)], axis=1)
    after = open_sides(collapsed.triangles)
    return np.array_equal(before[np.lexsort(before.T)], after[np.lexsort(after.T)])


def joined_parts(layer: Layer, parts: list[CoarserPart]) -> tuple[Corners, npt.NDArray[np.int64]]:
    """A level of parts that share the points of their borders, and where the triangles of each part begin."""
    row_of: I32 = np.full(len(layer.corners.points), -1, np.int32)
    triangles, fresh, n = [], [], 0
    for part in parts:
        rows = row_of[part.border_before]
        is_there = rows >= 0
        is_new = np.ones(len(part.corners.points), np.bool_)
        is_new[part.border[is_there]] = False
        numbers = (n - 1 + np.cumsum(is_new)).astype(np.int32)
        numbers[part.border[is_there]] = rows[is_there]
        row_of[part.border_before] = numbers[part.border]
        triangles.append(numbers[part.corners.triangles])
        fresh.append(is_new)
        n += int(is_new.sum())

    def join(arrays: Iterable[npt.NDArray[Any]]) -> Any:
        return np.concatenate([array[is_new] for array, is_new in zip(arrays, fresh, strict=True)])

    before = layer.corners
    material = None if before.material is None else join(part.corners.material for part in parts)  # type: ignore[misc]
    joined = before._replace(
        points=join(part.corners.points for part in parts),
        triangles=np.concatenate(triangles),
        attributes={name: join(part.corners.attributes[name] for part in parts) for name in before.attributes},
        material=material,
    )
    return joined, np.cumsum([0, *map(len, triangles)], dtype=np.int64)


def stored(corners: Corners, mesh: Mesh) -> Corners:
    """The corners with points rounded as in the mesh of the level, so that the bound holds for the drawn points."""
    return corners._replace(points=corners.points.astype(mesh.vertices.dtype).astype(np.float64))


def corners_of(mesh: Mesh) -> tuple[Corners, I32]:
    """The corners of a mesh, without triangles that have two corners at equal places, and the rows of its triangles."""
    attributes = {name: getattr(mesh, name) for name in ATTRIBUTES}
    attributes = {name: array for name, array in attributes.items() if array is not None}
    rows = mesh.material_of_triangle
    first, group = coincident(mesh.vertices, *attributes.values())
    corners = group[mesh.triangles]
    place = coincident(mesh.vertices)[1] if attributes else group
    a, b, c = place[mesh.triangles].T
    is_whole = (a != b) & (b != c) & (c != a)
    if not is_whole.any():
        is_whole[:] = True
    corners, rows = corners[is_whole], None if rows is None else rows[is_whole]
    if rows is None:
        key = corners.ravel()
    else:  # a vertex of two materials is duplicated
        key = corners.ravel() * len(mesh.materials) + rows.repeat(3)
    used, compact = np.unique(key, return_inverse=True)
    vertex = used if rows is None else used // len(mesh.materials)
    source = first[vertex]
    return Corners(
        mesh.vertices[source].astype(np.float64),
        compact.reshape(-1, 3).astype(np.int32),
        {name: array[source] for name, array in attributes.items()},
        None if rows is None else (used % len(mesh.materials)).astype(np.int32),
        mesh.color_interpolation == "linear",
    ), np.flatnonzero(is_whole).astype(np.int32)


def next_corners(corners: Corners, collapsed: Collapsed) -> Corners:
    """The corners of the next level."""
    attributes, material = corners.attributes, corners.material
    into = collapsed.into
    if into is None:
        return Corners(collapsed.points, collapsed.triangles, {}, None)
    if attributes:
        triangle, weights = nearest_before(corners, collapsed.points, into)
        rows = corners.triangles[triangle]
        attributes = {
            name: mixed(name, array, rows, weights, corners.mixes_light) for name, array in attributes.items()
        }
    if material is not None:
        is_left = into >= 0
        of_next = np.empty(len(collapsed.points), np.int32)
        of_next[into[is_left]] = material[is_left]
        material = of_next
    return Corners(collapsed.points, collapsed.triangles, attributes, material, corners.mixes_light)


def nearest_before(corners: Corners, points: F64, into: I32) -> tuple[npt.NDArray[np.intp], F64]:
    """The triangle (N,) nearest to each new point, and the weights (N, 3) of its corners at the nearest point."""
    point = into[corners.triangles].ravel()
    triangle = np.repeat(np.arange(len(corners.triangles), dtype=np.int32), 3)[point >= 0]
    point = point[point >= 0]
    feet = np.empty((len(point), 3))
    squared = np.empty(len(point))
    engine.set_feet(corners.points, corners.triangles, points, triangle, point, feet, squared)
    order = np.lexsort((triangle, squared, point))
    starts = np.flatnonzero(np.diff(point[order], prepend=-1))
    best = order[starts]  # every new point has triangles: a row for each point, in order
    nearest = triangle[best].astype(np.intp)
    return nearest, weights_of(corners.points[corners.triangles[nearest]], feet[best])


def weights_of(corners: F64, points: F64) -> F64:
    """Barycentric weights (N, 3) of points (N, 3) on triangles (N, 3, 3): at least 0, their sum 1."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    across = np.cross(b - a, c - a)
    parts = [np.cross(c - b, points - b), np.cross(a - c, points - c), np.cross(b - a, points - a)]
    weights = np.stack([np.einsum("ij,ij->i", part, across) for part in parts], axis=1).clip(0)
    total = weights.sum(axis=1, keepdims=True)
    # A triangle without area is a line: its nearest corner has weight 1.
    nearest = ((corners - points[:, None]) ** 2).sum(axis=2).argmin(axis=1)
    return np.where(total > 0, weights / np.where(total > 0, total, 1), np.eye(3)[nearest])


def mixed(name: str, array: npt.NDArray[Any], rows: I32, weights: F64, mixes_light: bool) -> npt.NDArray[Any]:
    """An attribute interpolated between three vertices; colours in linear light or as stored."""

    def mix(values: npt.NDArray[Any]) -> F64:
        mean: F64 = np.einsum("ij,ijk->ik", weights, values[rows].astype(np.float64))
        return mean

    if name == "colors":
        return spread_colors(array, mixes_light, mix)
    return (unit_or_zero(mix(array)) if name == "normals" else mix(array)).astype(array.dtype)


def level_mesh(corners: Corners, original: Mesh) -> Mesh:
    """The mesh of a level; its positions have the dtype of the original."""
    vertices: FloatArray = corners.points.astype(original.vertices.dtype)
    rows = None if corners.material is None else corners.material[corners.triangles[:, 0]]
    return Mesh(
        vertices,
        corners.triangles,
        materials=original.materials,
        material_of_triangle=rows,
        crease=original.crease,
        color_interpolation=original.color_interpolation,
        up=original.up,
        **corners.attributes,
    )
