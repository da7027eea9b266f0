"""Makes the picture that a mesh or a visibility buffer shows of itself in a notebook.

Input: `Mesh`, `Fragments`. Output: PNG as bytes, which their `_repr_png_` returns. Arrays stay plain arrays;
docs/design/fields.md tells why.
"""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from topleft._core.base.color import id_colors
from topleft._core.raster.fragments import Fragments
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.picture.render import render

MESH_SIZE = (480, 360)
MAX_SIDE_PX = 1024
"""Larger buffers are shown with every second pixel, or third."""


def png_of_mesh(mesh: Mesh) -> bytes | None:
    """The three-quarter view of the mesh; `None` if there is nothing to see."""
    return _png(render(mesh, size=MESH_SIZE)) if len(mesh.triangles) else None


def png_of_fragments(frags: Fragments) -> bytes | None:
    """A colour for each triangle, transparent where there is none; `None` if there are no pixels."""
    if not frags.triangle.size:
        return None
    step = -(-max(frags.triangle.shape) // MAX_SIDE_PX)
    ids = frags.triangle[::step, ::step]
    picture = np.zeros((*ids.shape, 4), np.uint8)
    seen = ids >= 0
    picture[seen, :3], picture[seen, 3] = id_colors(ids[seen]), 255
    return _png(picture)


def _png(picture: npt.NDArray[Any]) -> bytes:
    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG")
    return file.getvalue()
