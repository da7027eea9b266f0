"""Makes triangles of faces and cells as other libraries keep them: faces of any number of corners, skins of solids.

Input: meshes of meshio, pyvista and matplotlib, or arrays; `adapt.py` tells the kind. Output: `Polygons`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._core.base.arrays import as_array
from topleft._meshes.model.polygons import triangulate
from topleft.typing import PerOption

CUTS = {
    "triangle6": ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    "triangle7": ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 6), (4, 5, 6), (5, 3, 6)),
    "quad8": ((0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 6), (4, 6, 7)),
    "quad9": ((0, 4, 8), (0, 8, 7), (4, 1, 5), (4, 5, 8), (8, 5, 2), (8, 2, 6), (7, 8, 6), (7, 6, 3)),
}
"""Triangles of the quadratic surface cells of meshio, between all of their points."""

SIDES = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}
"""Surface cells by the number of their points, as sides of solids."""

SURFACE_CELLS = ("triangle", "quad", "polygon", *CUTS)

SIDES_OF_SOLID = {
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "voxel": ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)),
}
"""Corners of the sides of solid cells, counter-clockwise seen from outside."""

EDGES_OF_SOLID = {
    "tetra": ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)),
    "hexahedron": (
        (0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7),
    ),
    "wedge": ((0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (0, 3), (1, 4), (2, 5)),
    "pyramid": ((0, 1), (1, 2), (2, 3), (0, 3), (0, 4), (1, 4), (2, 4), (3, 4)),
}  # fmt: skip
"""Edges of solid cells in the order in which quadratic cells have points on them, behind the corners."""

SIDES_WITH_MIDDLE = {"hexahedron": (5, 3, 2, 4, 0, 1), "wedge": (2, 3, 4), "pyramid": (0,)}
"""Sides in the order in which cells have points in the middle of them, behind those of edges."""

SOLID_OF_CELL = {
    "tetra": "tetra", "tetra10": "tetra", "hexahedron": "hexahedron", "hexahedron20": "hexahedron",
    "hexahedron24": "hexahedron", "hexahedron27": "hexahedron", "wedge": "wedge", "wedge15": "wedge",
    "wedge18": "wedge", "pyramid": "pyramid", "pyramid13": "pyramid", "pyramid14": "pyramid", "voxel": "voxel",
}  # fmt: skip

CELL_OF_VTK = {
    5: "triangle", 7: "polygon", 9: "quad", 10: "tetra", 11: "voxel", 12: "hexahedron", 13: "wedge", 14: "pyramid",
    22: "triangle6", 23: "quad8", 24: "tetra10", 25: "hexahedron20", 26: "wedge15", 27: "pyramid13", 28: "quad9",
    29: "hexahedron27", 32: "wedge18", 33: "hexahedron24", 34: "triangle7",
}  # fmt: skip
"""The cells of VTK, by their numbers."""


class Polygons(NamedTuple):
    """Points, and triangles that know which face they were cut from."""

    points: npt.NDArray[Any]
    """(V, 2) or (V, 3)."""

    triangles: npt.NDArray[Any]
    """(T, 3) integers."""

    faces: npt.NDArray[np.int64] | None
    """(T,) the face, of any number of corners, that each triangle is a part of; `None`: faces are the triangles."""

    n_faces: int

    not_drawn: tuple[str, ...] = ()
    """Kinds of cells that the triangles are not of."""

    @property
    def points_in_space(self) -> npt.NDArray[Any]:
        """(V, 3): z is 0 where points are flat."""
        if self.points.ndim == 2 and self.points.shape[1] == 2:
            return np.column_stack([self.points, np.zeros(len(self.points))])
        return self.points


def of_triangulation(subject: Any) -> Polygons:
    """Triangles of matplotlib's Triangulation that are not masked."""
    points = np.column_stack([as_array("x", subject.x), as_array("y", subject.y)])
    triangles, mask = as_array("triangles", subject.triangles), getattr(subject, "mask", None)
    if mask is None:
        return Polygons(points, triangles, None, len(triangles))
    kept = np.flatnonzero(~np.asarray(mask))
    return Polygons(points, triangles[kept], kept, len(triangles))


def of_arrays(subject: Any) -> Polygons:
    """Triangles of an object with `vertices` and `faces` or `triangles`."""
    faces = getattr(subject, "faces", None)
    return _plain(subject.vertices, subject.triangles if faces is None else faces)


def of_pair(subject: Any) -> Polygons:
    """Triangles of (vertices, triangles)."""
    return _plain(*subject)


def _plain(vertices: npt.ArrayLike, triangles: npt.ArrayLike) -> Polygons:
    points = as_array("vertices", vertices)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise ValueError(f"points must have shape (V, 2) or (V, 3), got {points.shape}")
    if isinstance(triangles, list | tuple) and len({np.size(face) for face in triangles}) > 1:
        n_corners = np.array([np.size(face) for face in triangles])
        corners = np.concatenate([np.asarray(face).ravel() for face in triangles])
        if corners.dtype.kind not in "iu":
            raise TypeError(f"triangles must be integers, got {corners.dtype}")
        return _of_faces(points, corners, n_corners)
    corners = as_array("triangles", triangles)
    if corners.ndim == 2 and corners.shape[1] > 3 and corners.dtype.kind in "iu":
        return _of_blocks(points, [corners])
    return Polygons(points, corners, None, corners.shape[0] if corners.ndim else 0)


def of_cells(subject: Any) -> Polygons:
    """Triangles of the cells of a mesh of meshio."""
    return _of_cells(as_array("points", subject.points), subject.cells)


def _of_cells(points: npt.NDArray[Any], blocks: Iterable[Any]) -> Polygons:
    """Triangles of the surface cells of meshio, block after block; where there are none, of the skin of solid ones."""
    blocks = [block for block in blocks if len(block.data)]
    has_surface = any(block.type in SURFACE_CELLS for block in blocks)
    drawn: Collection[str] = SURFACE_CELLS if has_surface else SOLID_OF_CELL
    kept = [(block.type, as_array("cells", block.data)) for block in blocks if block.type in drawn]
    if not kept:
        kinds = ", ".join(block.type for block in blocks) or "none"
        raise ValueError(f"mesh has no triangles: its cells are {kinds}")
    if has_surface:
        polygons = _of_surface(points, kept)
    else:
        polygons = _skin(points, [(SOLID_OF_CELL[kind], cells) for kind, cells in kept])
    not_drawn = dict.fromkeys(block.type for block in blocks if block.type not in drawn)
    return polygons._replace(not_drawn=tuple(not_drawn))


def _of_surface(points: npt.NDArray[Any], kept: list[tuple[str, npt.NDArray[Any]]]) -> Polygons:
    """Triangles of surface cells by kind; the parts of a quadratic cell have its number."""
    parts = [cells[:, np.array(CUTS[kind])].reshape(-1, 3) if kind in CUTS else cells for kind, cells in kept]
    polygons = _of_blocks(points, parts)
    if all(kind not in CUTS for kind, _ in kept):
        return polygons
    n_parts = np.concatenate([np.full(len(cells), len(CUTS.get(kind, "1"))) for kind, cells in kept])
    cells_of_parts = np.repeat(np.arange(len(n_parts)), n_parts)
    faces = cells_of_parts if polygons.faces is None else cells_of_parts[polygons.faces]
    return polygons._replace(faces=faces, n_faces=len(n_parts))


def data_of(subject: Any, name: str) -> tuple[npt.NDArray[Any], PerOption]:
    """The values of points or cells that a mesh of meshio or pyvista has by a name, and which of both they are of."""
    known = []
    tables: tuple[tuple[str, PerOption], ...] = (("point_data", "vertex"), ("cell_data", "triangle"))
    for table, per in tables:
        there: Any = getattr(subject, table, {})
        names = list(there.keys())
        if name in names:
            values = there[name]
            if isinstance(values, list):  # by blocks of cells, as meshio has it
                pairs = zip(values, subject.cells, strict=True)
                values = [rows for rows, block in pairs if block.type in SURFACE_CELLS and len(block.data)]
                if not values:
                    raise ValueError(
                        f"values {name!r} are of solid cells, and their skin is drawn: take some of points"
                    )
                values = np.concatenate(values)
            return np.asarray(values), per
        known += names
    raise ValueError(
        f"values must be numbers or a name of data of the mesh ({', '.join(known) or 'none'}), got {name!r}"
    )


def of_grid(subject: Any) -> Polygons:
    """Triangles of the cells of pyvista's UnstructuredGrid: one array, before each cell its number of points."""
    points, padded = as_array("points", subject.points), as_array("cells", subject.cells).ravel().astype(np.int64)
    kinds = as_array("celltypes", subject.celltypes).ravel()
    starts, sizes = _rows_of_padded(padded)
    if len(starts) != len(kinds):
        raise ValueError(f"mesh has {len(starts)} cells and {len(kinds)} types of cells")
    blocks = []
    for kind in np.unique(kinds).tolist():
        for size in np.unique(sizes[kinds == kind]).tolist():
            rows = padded[starts[(kinds == kind) & (sizes == size)][:, None] + np.arange(size)]
            blocks.append(_Block(CELL_OF_VTK.get(kind, f"VTK's {kind}"), rows))
    return _of_cells(points, blocks)


class _Block(NamedTuple):
    type: str
    data: npt.NDArray[np.int64]


def _skin(points: npt.NDArray[Any], solids: list[tuple[str, npt.NDArray[Any]]]) -> Polygons:
    """Triangles of the sides of solid cells that no second cell has, between all points of a side."""
    sides: dict[int, list[npt.NDArray[np.int64]]] = {3: [], 4: []}
    width = 4 if all(cells.shape[1] <= 8 for _, cells in solids) else 9
    for kind, cells in solids:
        corners_of_sides = SIDES_OF_SOLID[kind]
        middle = points[cells[:, : 1 + max(max(side) for side in corners_of_sides)]].mean(axis=1)
        for side, points_of_side in zip(corners_of_sides, _points_of_sides(kind, cells.shape[1]), strict=True):
            n = len(side)
            rows = np.full((len(cells), width), -1, np.int64)
            rows[:, : len(points_of_side)] = cells[:, points_of_side]
            first, *_, last = corners = np.moveaxis(points[rows[:, :n]], 1, 0)
            # Programs do not agree which way round a wedge goes.
            is_inwards = (np.cross(corners[1] - first, last - first) * (corners.mean(axis=0) - middle)).sum(axis=1) < 0
            turned = [*range(n)[::-1], *range(n, 2 * n - 1)[::-1], *range(2 * n - 1, 9)]
            rows[is_inwards] = rows[is_inwards][:, [column for column in turned if column < width]]
            sides[n].append(rows)
    kept = []
    for n, rows in ((n, np.concatenate(parts)) for n, parts in sides.items() if parts):
        _, first, n_cells = np.unique(np.sort(rows[:, :n], axis=1), axis=0, return_index=True, return_counts=True)
        rows = rows[np.sort(first[n_cells == 1])]
        n_points = (rows != -1).sum(axis=1)
        kept += [(SIDES[size], rows[n_points == size, :size]) for size in np.unique(n_points).tolist()]
    return _of_surface(points, kept)


def _points_of_sides(solid: str, n_points: int) -> list[list[int]]:
    """The columns of cells with so many points that make each side: corners, middles of edges, the middle."""
    edges, with_middle = EDGES_OF_SOLID.get(solid, ()), SIDES_WITH_MIDDLE.get(solid, ())
    sides = SIDES_OF_SOLID[solid]
    n_corners = 1 + max(max(side) for side in sides)
    n_linear = n_corners + len(edges)
    if not edges or n_points < n_linear:
        return [list(side) for side in sides]
    found = []
    for i, side in enumerate(sides):
        pairs = zip(side, (*side[1:], side[0]), strict=True)
        middles = [n_corners + edges.index((min(pair), max(pair))) for pair in pairs]
        center = [n_linear + with_middle.index(i)] if i in with_middle[: n_points - n_linear] else []
        found.append([*side, *middles, *center])
    return found


def of_padded(subject: Any) -> Polygons:
    """Triangles of the faces of pyvista: one array, before each face its number of corners."""
    points, padded = as_array("points", subject.points), as_array("faces", subject.faces)
    if padded.ndim == 2:
        return _plain(points, padded)
    if getattr(subject, "n_strips", 0):
        raise ValueError("mesh has strips of triangles: take its triangulate()")
    if padded.size % 4 == 0 and (padded[::4] == 3).all():
        triangles = padded.reshape(-1, 4)[:, 1:]
        return Polygons(points, triangles, None, len(triangles))
    starts, sizes = _rows_of_padded(padded)
    within = np.arange(int(sizes.sum())) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    return _of_faces(points, padded[np.repeat(starts, sizes) + within], sizes)


def _rows_of_padded(padded: npt.NDArray[Any]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Where the rows of one array begin, and their lengths; each row has its length before it."""
    starts, sizes, at, numbers = [], [], 0, padded.tolist()
    while at < len(numbers):
        size = numbers[at]
        if size < 0 or at + 1 + size > len(numbers):
            raise ValueError(f"faces[{at}] = {size} must be a number of corners that follow")
        starts.append(at + 1)
        sizes.append(size)
        at += 1 + size
    return np.array(starts, np.int64), np.array(sizes, np.int64)


def _of_blocks(points: npt.NDArray[Any], blocks: list[npt.NDArray[Any]]) -> Polygons:
    """Faces (N, K) as K - 2 triangles each."""
    if all(block.shape[1] == 3 for block in blocks):
        triangles = blocks[0] if len(blocks) == 1 else np.concatenate(blocks)
        return Polygons(points, triangles, None, len(triangles))
    n_corners = np.concatenate([np.full(len(block), block.shape[1]) for block in blocks])
    return _of_faces(points, np.concatenate([block.ravel() for block in blocks]), n_corners)


def _of_faces(points: npt.NDArray[Any], corners: npt.NDArray[Any], n_corners: npt.NDArray[Any]) -> Polygons:
    rows, faces = triangulate(points, corners, n_corners)
    return Polygons(points, corners[rows], faces, len(n_corners))
