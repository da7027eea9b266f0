"""VTK off screen: the depth buffer of a mesh that is resident in OpenGL (here Mesa's llvmpipe)."""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.peers.llvmpipe_peer import environment as mesa_environment
from benchmarks.peers.views import draw_by_vtk, open_vtk_window, vtk_actor
from benchmarks.scenes.cases import Scene

MODULE = DISTRIBUTION = "vtk"
TASKS = ("visibility", "views", "views-png")
THREADS = True


def environment(threads: int) -> dict[str, str]:
    """As for llvmpipe."""
    return mesa_environment(threads) | {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}


def prepare(scene: Scene, threads: int) -> Drawing:
    """The matrix of the scene is the projection; the view is the identity."""
    if scene.views is not None:
        return draw_by_vtk(scene, threads)
    import vtk
    from vtkmodules.util.numpy_support import vtk_to_numpy

    width, height = scene.size
    actor = vtk_actor(scene)
    actor.GetProperty().SetLighting(False)
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    renderer.AddActor(actor)
    camera = open_vtk_window(scene, renderer, window)
    camera.SetPosition(0, 0, 0)
    camera.SetFocalPoint(0, 0, -1)
    buffer = vtk.vtkFloatArray()

    def draw() -> None:
        window.Render()
        window.GetZbufferData(0, 0, width - 1, height - 1, buffer)

    def picture() -> dict[str, np.ndarray]:
        depth = vtk_to_numpy(buffer).reshape(height, width)[::-1]
        return {"depth": np.where(depth < 1, depth, np.float32(np.inf))}

    return Drawing(draw, picture, "depth", "upload")
