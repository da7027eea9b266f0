"""Normals of visible pixels, by the kernel that has them for the light.

Input: `Fragments`, the mesh and the camera they were made with. Output: unit vectors (H, W, 3) float32.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topleft import _engine
from topleft._base.threads import count_threads, parse_threads, run_parts
from topleft._camera.camera import Camera
from topleft._model.mesh import Mesh
from topleft._raster.fragments import Fragments
from topleft._shade.look import Look

__all__ = ["shade_normals"]

SHOW_NORMALS = 1  # tl_show in csrc/shading.h


def shade_normals(
    frags: Fragments, mesh: Mesh, camera: Camera, turn: npt.NDArray[np.float64], *, threads: int | None = None
) -> npt.NDArray[np.float32]:
    """Unit normals (H, W, 3) float32 of the visible pixels, on the side that is seen, 0 where nothing is.

    Parameters
    ----------
    frags, mesh, camera
        As in `topleft.shade.shade`.
    turn : (3, 3) float64
        From eye space to where the normals are wanted.
    threads : int, optional
        Never changes a bit.

    Notes
    -----
    A triangle seen from behind has its normals turned round as a whole, never pixel by pixel: so a mesh whose faces are
    inverted looks like one whose faces are not, and no edge of light runs through a triangle. Where those of the
    corners cancel, or there are none, it is the normal of the face.
    """
    ids = np.require(frags.triangle, np.int32, ["C", "A"])
    if not len(mesh.triangles) or 0 in ids.shape:
        return np.zeros((*ids.shape, 3), np.float32)
    out = np.empty((*ids.shape, 3), np.float32)
    scene = frags._snapped
    look = Look(scene, mesh, camera, ids.shape[::-1], None, is_flat=False)
    look.set_turn(SHOW_NORMALS, turn)
    n_threads = count_threads(parse_threads(threads), len(mesh.triangles))

    def shade_rows(first: int, end: int) -> None:
        _engine.shade_normals(scene, look.shading, ids, out, first, end - first)

    run_parts(shade_rows, len(ids), n_threads)
    return out
