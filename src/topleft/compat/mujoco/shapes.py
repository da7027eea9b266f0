"""Meshes of MuJoCo's geoms: primitives in the slices and stacks of MuJoCo, meshes and height fields of a model.

Input: the type and size of a geom, an `MjModel`. Output: `Mesh` with texture coordinates, in the space of the geom.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

import topleft as tl
from topleft.compat._arrays import F64

PLANE, HFIELD, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH, SDF = range(9)
ARROW, ARROW1, ARROW2, FLEX, SKIN, TRIANGLE = 100, 101, 102, 105, 106, 108
"""Of mjtGeom."""

TAKES_SIZE = (SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, ARROW, ARROW1, ARROW2, TRIANGLE)
"""Geoms whose mesh follows from their size."""

SHARP = 0.8
"""Cosine to the normal of the face below which a corner of a mesh takes the normal of the face."""


class Parts:
    """Surfaces that become one mesh: each a grid of points (N, M), or corners of triangles."""

    def __init__(self) -> None:
        self.points: list[F64] = []
        self.normals: list[F64] = []
        self.uv: list[F64] = []
        self.triangles: list[npt.NDArray[np.int64]] = []

    def add(self, points: Any, normals: Any, uv: Any, triangles: Any) -> None:
        """Add points (V, 3) with normals and texture coordinates (V, 2), whose v runs up, and triangles."""
        first = sum(map(len, self.points))
        self.points.append(np.asarray(points, np.float64).reshape(-1, 3))
        self.normals.append(np.broadcast_to(np.asarray(normals, np.float64), self.points[-1].shape))
        self.uv.append(np.asarray(uv, np.float64).reshape(-1, 2))
        self.triangles.append(np.asarray(triangles, np.int64) + first)

    def add_turned(self, radius: F64, height: F64, across: F64, along: F64, n_slices: int, v: F64) -> None:
        """Add what a line of radii and heights (N,) makes, turned about z; `across` and `along`: its normals."""
        angle = 2 * math.pi * np.arange(n_slices + 1) / n_slices
        x, y = np.cos(angle), np.sin(angle)
        rows, columns = np.ones((len(radius), 1)), np.ones(n_slices + 1)
        points = np.stack([radius[:, None] * x, radius[:, None] * y, height[:, None] * columns], axis=2)
        normals = np.stack([across[:, None] * x, across[:, None] * y, along[:, None] * columns], axis=2)
        uv = np.stack([rows * angle / (2 * math.pi), v[:, None] * columns], axis=2)
        i = np.arange((len(radius) - 1) * (n_slices + 1)).reshape(-1, n_slices + 1)[:, :-1]
        lower, upper = i, i + n_slices + 1
        quads = np.stack([lower, lower + 1, upper + 1, lower, upper + 1, upper], axis=2).reshape(-1, 2, 3)
        has_area = np.repeat([radius[:-1] > 0, radius[1:] > 0], n_slices, axis=1).T  # at a pole one is empty
        self.add(points, normals.reshape(-1, 3), uv, quads[has_area])

    def add_disk(self, radius: tuple[float, float], height: float, side: int, n_slices: int) -> None:
        """Add a disk at a height, which faces up or down."""
        angle = 2 * math.pi * np.arange(n_slices) / n_slices
        x, y = np.append(np.cos(angle), 0), np.append(np.sin(angle), 0)
        k = np.arange(n_slices)
        fan = np.stack([k, (k + 1) % n_slices, np.full(n_slices, n_slices)], axis=1)[:, ::side]
        points = np.stack([radius[0] * x, radius[1] * y, np.full(n_slices + 1, height)], axis=1)
        self.add(points, (0, 0, side), np.stack([0.5 + 0.5 * x, 0.5 - 0.5 * y], axis=1), fan)

    def mesh(self) -> tl.Mesh:
        """All of it as one mesh."""
        points, normals, uv = (np.concatenate(own) for own in (self.points, self.normals, self.uv))
        return tl.Mesh(points, np.concatenate(self.triangles), normals, uv=uv)


def primitive(kind: int, size: tuple[float, float, float], quality: tuple[int, int]) -> tl.Mesh:
    """The mesh of a primitive of half sizes, in slices and stacks as MuJoCo has them."""
    n_slices, n_stacks = quality
    x, y, z = size
    parts = Parts()
    if kind in (SPHERE, ELLIPSOID):
        angle = math.pi / 2 * np.arange(-(n_stacks // 2), n_stacks // 2 + 1) / (n_stacks // 2)
        radius = np.where(abs(angle) < math.pi / 2, np.cos(angle), 0.0)
        parts.add_turned(radius, np.sin(angle), radius, np.sin(angle), n_slices, 0.5 + angle / math.pi)
        return stretched(parts.mesh(), size)
    if kind == CAPSULE:
        n, end = n_stacks // 2, (x + y) / 2
        angle = math.pi / 2 * np.arange(n + 1) / n
        radius, height = np.where(angle < math.pi / 2, np.cos(angle), 0.0), z + end * np.sin(angle)
        share = 0.5 + 0.5 * height / (z + end)
        slope = np.sin(angle) / end  # `stretched` divides across by the radius, too
        parts.add_turned(radius[::-1], -height[::-1], radius[::-1], -slope[::-1], n_slices, 1 - share[::-1])
        parts.add_turned(radius, height, radius, slope, n_slices, share)
        sides = np.array([-z, z])
        parts.add_turned(np.ones(2), sides, np.ones(2), np.zeros(2), n_slices, 0.5 + 0.5 * sides / (z + end))
        return stretched(parts.mesh(), (x, y, 1))
    if kind == CYLINDER:
        add_tube(parts, (x, y), -z, z, n_slices, (True, True))
        return parts.mesh()
    if kind == BOX:
        for axis in range(3):
            for side in (-1, 1):
                u, v = np.eye(3)[(axis + 1) % 3] * side, np.eye(3)[(axis + 2) % 3]
                corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], np.float64)
                points = np.array(size) * (side * np.eye(3)[axis] + corners[:, :1] * u + corners[:, 1:] * v)
                parts.add(points, side * np.eye(3)[axis], 0.5 + 0.5 * corners, [[0, 1, 2], [0, 2, 3]])
        return parts.mesh()
    if kind in (ARROW, ARROW1, ARROW2):
        wide = 1.0 if kind == ARROW1 else 1.75
        low, neck = (-z / 3, z / 3) if kind == ARROW2 else (0.0, z / 3)
        add_tube(parts, (x, y), low, neck, n_slices, (kind != ARROW2, kind != ARROW2))
        for side in (1, -1) if kind == ARROW2 else (1,):
            far = neck + z / 6
            bent = math.sqrt(0.5)
            line = np.array([neck, far] if side > 0 else [-far, -neck])
            reach = np.array([wide, 0.0])[::side]
            cone = Parts()
            cone.add_turned(reach, line, np.full(2, bent), np.full(2, side * bent), n_slices, np.array([0.0, 1.0]))
            own = stretched(cone.mesh(), (x, y, 1))
            parts.add(own.vertices, own.normals, own.uv, own.triangles)
        return parts.mesh()
    if kind == TRIANGLE:
        parts.add([[0, 0, 0], [x, 0, 0], [0, y, 0]], (0, 0, 1), [[0, 0], [1, 0], [0, 1]], [[0, 1, 2]])
        return parts.mesh()
    raise ValueError(f"there is no primitive of triangles of type {kind}")


def add_tube(
    parts: Parts, radius: tuple[float, float], low: float, high: float, n: int, ends: tuple[bool, bool]
) -> None:
    """Add a cylinder, with disks at its ends."""
    tube = Parts()
    tube.add_turned(np.ones(2), np.array([low, high]), np.ones(2), np.zeros(2), n, np.array([0.0, 1.0]))
    own = stretched(tube.mesh(), (*radius, 1.0))
    parts.add(own.vertices, own.normals, own.uv, own.triangles)
    for height, side, has_one in ((low, -1, ends[0]), (high, 1, ends[1])):
        if has_one:
            parts.add_disk(radius, height, side, n)


def stretched(mesh: tl.Mesh, size: tuple[float, float, float]) -> tl.Mesh:
    """The mesh times a size, its normals by the inverse of it."""
    scale = np.array(size, np.float64)
    assert mesh.normals is not None
    return tl.Mesh(mesh.vertices * scale, mesh.triangles, mesh.normals / np.maximum(scale, 1e-12), uv=mesh.uv)


def plane(half: tuple[float, float], reach: float) -> tl.Mesh:
    """The rectangle of a plane; a side of 0 has no end, and is drawn as far as `reach`, a texture repeats there."""
    sides = [own if own > 0 else reach for own in half]
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * sides
    scale = [0.5 / own if own > 0 else 0.5 for own in half]
    shift = [0.5 if own > 0 else 0.0 for own in half]
    points = np.concatenate([corners, np.zeros((4, 1))], axis=1)
    return tl.Mesh(points, [[0, 1, 2], [0, 2, 3]], np.tile([0.0, 0, 1], (4, 1)), uv=corners * scale + shift)


def laid(mesh: tl.Mesh, across: float, down: float, shift: float) -> tl.Mesh:
    """The mesh with a texture that repeats so often; t of OpenGL runs down: t = down (1 - v) + shift, and v = 1 - t."""
    assert mesh.uv is not None
    uv = mesh.uv.astype(np.float64) * [across, down] + [shift, 1 - down - shift]
    return tl.Mesh(mesh.vertices, mesh.triangles, mesh.normals, uv=uv, crease=mesh.crease)


def asset(model: Any, i: int) -> tl.Mesh:
    """A mesh of a model: mesh k for 2 k, its convex hull for 2 k + 1."""
    k, is_hull = divmod(i, 2)
    first, n = int(model.mesh_vertadr[k]), int(model.mesh_vertnum[k])
    points = np.array(model.mesh_vert[first : first + n], np.float64)
    if is_hull:
        graph = model.mesh_graph[int(model.mesh_graphadr[k]) :]
        n_points, n_faces = int(graph[0]), int(graph[1])
        begin = 2 + 3 * n_points + 3 * n_faces
        return tl.Mesh(points, np.array(graph[begin : begin + 3 * n_faces]).reshape(-1, 3), crease=0)
    rows = slice(int(model.mesh_faceadr[k]), int(model.mesh_faceadr[k]) + int(model.mesh_facenum[k]))
    faces, normal_rows = model.mesh_face[rows].astype(np.int64), model.mesh_facenormal[rows].astype(np.int64)
    normals = np.array(model.mesh_normal[int(model.mesh_normaladr[k]) :], np.float64)
    if int(model.mesh_texcoordadr[k]) >= 0:
        uv_rows = model.mesh_facetexcoord[rows].astype(np.int64)
        uv = np.array(model.mesh_texcoord[int(model.mesh_texcoordadr[k]) :], np.float64)
        return of_corners(points, faces, normals, normal_rows, uv * [1, -1] + [0, 1], uv_rows)
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    flat = np.cross(b - a, c - a)
    flat /= np.maximum(np.sqrt((flat**2).sum(axis=1, keepdims=True)), 1e-300)
    is_sharp = (normals[normal_rows] * flat[:, None]).sum(axis=2) < SHARP
    own = np.where(is_sharp, len(normals) + np.arange(len(faces))[:, None], normal_rows)
    return of_corners(points, faces, np.concatenate([normals, flat]), own, None, None)


def of_corners(points: F64, faces: Any, normals: F64, normal_rows: Any, uv: F64 | None, uv_rows: Any) -> tl.Mesh:
    """The mesh whose corners have rows of points, normals and texture coordinates; equal corners are one vertex."""
    key = faces.ravel() * len(normals) + normal_rows.ravel()
    if uv is not None:
        key = key * len(uv) + uv_rows.ravel()
    _, first, vertex = np.unique(key, return_index=True, return_inverse=True)
    laid = None if uv is None else uv[uv_rows.ravel()[first]]
    rows = faces.ravel()[first], normal_rows.ravel()[first]
    return tl.Mesh(points[rows[0]], vertex.reshape(-1, 3), normals[rows[1]], uv=laid)


def height_field(model: Any, i: int) -> tl.Mesh:
    """A height field of a model, with its sides and its bottom."""
    n_rows, n_columns = int(model.hfield_nrow[i]), int(model.hfield_ncol[i])
    x, y, z, base = model.hfield_size[i].tolist()
    first = int(model.hfield_adr[i])
    data = np.array(model.hfield_data[first : first + n_rows * n_columns], np.float64).reshape(n_rows, n_columns)
    across, up = np.meshgrid(np.linspace(-x, x, n_columns), np.linspace(-y, y, n_rows))
    top = np.stack([across, up, z * data], axis=2)
    k = np.arange(n_rows * n_columns).reshape(n_rows, n_columns)
    a, b, c, d = (own.ravel() for own in (k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]))
    triangles = [np.stack([d, a, c], axis=1), np.stack([a, b, c], axis=1)]
    rim = np.concatenate([k[0, :-1], k[:-1, -1], k[-1, :0:-1], k[:0:-1, 0]])
    low = top.reshape(-1, 3)[rim] * [1, 1, 0] - [0, 0, base]
    n, j = n_rows * n_columns, np.arange(len(rim))
    beside, following = (j + 1) % len(rim), rim[(j + 1) % len(rim)]
    triangles += [np.stack([n + j, n + beside, following], axis=1), np.stack([n + j, following, rim], axis=1)]
    corners = [n + int(np.flatnonzero(rim == own)[0]) for own in (k[0, 0], k[-1, 0], k[-1, -1], k[0, -1])]
    triangles.append(np.array([[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]))
    return tl.Mesh(np.concatenate([top.reshape(-1, 3), low]), np.concatenate(triangles), crease=0)


def on_cube(mesh: tl.Mesh, scale: Any = (1, 1, 1), n_squares: int = 6, texels: int = 64) -> tl.Mesh:
    """The mesh with texture coordinates in the six squares of a cube, one over the other, by direction from the centre.

    Each triangle lies in the square of its middle; half a texel at the rim of a square is left out.
    """
    corners = mesh.vertices[mesh.triangles].astype(np.float64) * np.asarray(scale, np.float64)
    middle = corners.mean(axis=1)
    axis = np.argmax(np.abs(middle), axis=1)
    is_low = np.take_along_axis(middle, axis[:, None], axis=1)[:, 0] < 0
    square = 2 * axis + is_low
    x, y, z = np.moveaxis(corners, 2, 0)
    across = np.choose(square[:, None], [-z, z, x, x, x, -x])
    down = np.choose(square[:, None], [-y, -y, z, -z, -y, -y])
    most = np.maximum(np.abs(np.take_along_axis(corners, axis[:, None, None], axis=2)[:, :, 0]), 1e-12)
    rim = 0.5 - 0.5 / texels
    s, t = (0.5 + rim * np.clip(own / most, -1, 1) for own in (across, down))
    uv = np.stack([s, 1 - (t + (square[:, None] if n_squares == 6 else 0)) / n_squares], axis=2).reshape(-1, 2)
    normals = None if mesh.normals is None else mesh.normals[mesh.triangles].reshape(-1, 3)
    triangles = np.arange(3 * len(corners)).reshape(-1, 3)
    return tl.Mesh(mesh.vertices[mesh.triangles].reshape(-1, 3), triangles, normals, uv=uv, crease=mesh.crease)
