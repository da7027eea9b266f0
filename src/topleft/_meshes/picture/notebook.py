"""Makes the picture that a mesh or a visibility buffer shows of itself in a notebook.

Input: `Mesh`, `Fragments`. Output: PNG as bytes, which their `_repr_png_` returns. Arrays stay plain arrays;
docs/design/fields.md tells why.
"""

from __future__ import annotations

import numpy as np

from topleft._core.base.color import id_colors
from topleft._core.raster.fragments import Fragments
from topleft._meshes.io import png
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.picture.render import render

MESH_SIZE = (480, 360)
MAX_SIDE_PX = 1024
"""Larger buffers are shown with every second pixel, or third."""


def png_of_mesh(mesh: Mesh) -> bytes | None:
    """The three-quarter view of the mesh; `None` if there is nothing to see."""
    return png.encode(render(mesh, size=MESH_SIZE)) if len(mesh.triangles) else None


def png_of_fragments(frags: Fragments) -> bytes | None:
    """A colour for each triangle, transparent where there is none; `None` if there are no pixels."""
    if not frags.triangle.size:
        return None
    step = -(-max(frags.triangle.shape) // MAX_SIDE_PX)
    ids = frags.triangle[::step, ::step]
    picture = np.zeros((*ids.shape, 4), np.uint8)
    seen = ids >= 0
    picture[seen, :3], picture[seen, 3] = id_colors(ids[seen]), 255
    return png.encode(picture)


def register() -> None:
    """Give meshes and visibility buffers the method that IPython asks for a picture."""
    Mesh._repr_png_ = png_of_mesh  # type: ignore[attr-defined]
    Fragments._repr_png_ = png_of_fragments  # type: ignore[attr-defined]
