"""Surfaces: the arrays of a mesh as the shading kernels read them, made once per mesh.

Input: `Mesh`. Output: `Surface`, rows of four float32 each, in the space of the mesh or in that of the eye.
"""

from __future__ import annotations

from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from topleft._model.mesh import Mesh
from topleft._model.normals import box_of_triangles, color_rows, face_normal_rows, moved, turned_faces, unit_rows
from topleft._shade.frame import turn_of_normals

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


class Surface:
    """What shading needs of a mesh, each part made when it is first asked for.

    Attributes
    ----------
    positions : (V, 3) float
        As in the mesh, or in eye space.
    center : (3,) float64
        The middle of the mesh: the origin of the space that light is computed in, so that float32 is fine enough.
    """

    def __init__(self, mesh: Mesh, view: F64 | None = None) -> None:
        """`view`: (4, 4), takes the mesh to eye space first."""
        self._triangles = mesh.triangles
        self._vertex_normals = mesh.vertex_normals()  # the method would hold the mesh, which is the key of `_surfaces`
        self._colors = mesh.colors
        self._view = view
        self.positions = mesh.vertices if view is None else moved(mesh.vertices, view)

    @cached_property
    def center(self) -> F64:
        """The middle of the box round the vertices in use."""
        low, high = box_of_triangles(self.positions, self._triangles).astype(self.positions.dtype)
        return np.asarray(low / 2 + high / 2, np.float64)

    @cached_property
    def normals(self) -> F32:
        """(V, 4): unit normals, 0 where there is none, and 1."""
        return unit_rows(self._vertex_normals, None if self._view is None else turn_of_normals(self._view))

    @cached_property
    def face_normals(self) -> F32:
        """(T, 4): unit normals of the triangles, on the side from which they run counter-clockwise, and 1."""
        return face_normal_rows(self.positions, self._triangles)

    @cached_property
    def is_turned(self) -> npt.NDArray[np.uint8] | None:
        """(T,): 1 where the normals of the corners point to the other side than the triangle; None if none does."""
        turned = turned_faces(self.positions, self._triangles, self.normals)
        return turned if turned.view(np.bool_).any() else None

    @cached_property
    def colors(self) -> F32 | None:
        """(V, 4): sRGB of the vertices, 0 to 255, and 1; None if they have none."""
        return None if self._colors is None else color_rows(self._colors)


_surfaces: WeakKeyDictionary[Mesh, Surface] = WeakKeyDictionary()


def surface_of(mesh: Mesh) -> Surface:
    """The surface of a mesh in its own space, made once."""
    surface = _surfaces.get(mesh)
    if surface is None:
        surface = _surfaces[mesh] = Surface(mesh)
    return surface
