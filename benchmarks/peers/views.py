"""Many views: shaded pictures of one mesh from all sides, by topleft and by its peers.

One call draws all views, into memory one after the other, or into a PNG file each. All light is in eye space: the
headlight of topleft, for the peers as Lambert's law with a grey of its own. Peers write PNG by Pillow at level 1, the
fastest that it has; topleft by its own writer.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers import Drawing, llvmpipe_context
from benchmarks.scenes.cases import Scene

LIGHT = np.array([-0.35, 0.45, 1.0]) / np.linalg.norm([-0.35, 0.45, 1.0])
AMBIENT = 0.1

VERTEX_SHADER = """
#version 330
uniform mat4 clip_from_eye, eye_from_object;
in vec3 position, normal;
out vec3 normal_eye;
void main() {
    normal_eye = mat3(eye_from_object) * normal;
    gl_Position = clip_from_eye * (eye_from_object * vec4(position, 1));
}
"""
FRAGMENT_SHADER = """
#version 330
uniform vec3 light;
uniform float ambient;
in vec3 normal_eye;
out vec4 color;
void main() { color = vec4(vec3(ambient + (1 - ambient) * max(0, dot(normalize(normal_eye), light))), 1); }
"""


def drawing(scene: Scene, draw_view: Callable[[int], np.ndarray], gives: str, untimed: str) -> Drawing:
    """The call that draws all views, by a function that draws one and returns its picture (H, W[, C]) uint8."""
    from PIL import Image

    folder = Path(tempfile.mkdtemp(prefix="topleft-views-"))
    found: list[np.ndarray] = []

    def draw() -> None:
        for i in range(len(scene.views)):
            picture = draw_view(i)
            if scene.task == "views-png":
                Image.fromarray(picture).save(folder / f"{i}.png", compress_level=1)
        found[:] = [picture]

    def result() -> dict[str, np.ndarray]:
        return {"color": _rgb(found[0])}

    return Drawing(draw, result, gives, untimed)


def _rgb(picture: np.ndarray) -> np.ndarray:
    return np.repeat(picture[..., None], 3, axis=2) if picture.ndim == 2 else picture[..., :3]


def draw_by_topleft(scene: Scene, threads: int) -> Drawing:
    """`render_batch`: the calling thread for one, a pool of threads for several."""
    import topleft as tl

    mesh = tl.Mesh(scene.vertices, scene.triangles, scene.normals)
    cameras = [tl.Camera(view, scene.transform) for view in scene.views]
    folder = Path(tempfile.mkdtemp(prefix="topleft-views-"))
    is_png = scene.task == "views-png"
    options = {"cull": scene.cull, "background": (0, 0, 0)}
    jobs = [
        tl.Job(mesh, camera, scene.size, options, folder / f"{i}.png" if is_png else None)
        for i, camera in enumerate(cameras)
    ]
    found = []

    def draw() -> None:
        for result in tl.render_batch(jobs, executor=threads if threads > 1 else None):
            found[:] = [result.picture]

    def picture() -> dict[str, np.ndarray]:
        return {"color": _rgb(tl.render(mesh, cameras[-1], scene.size, **options) if is_png else found[0])}

    return Drawing(draw, picture, "RGBA", "")


def draw_by_llvmpipe(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """OpenGL: light in the pixel, read back as RGB."""
    import moderngl

    context = llvmpipe_context()
    program = context.program(vertex_shader=VERTEX_SHADER, fragment_shader=FRAGMENT_SHADER)
    turned_over = np.diag([1.0, -1.0, 1.0, 1.0]) @ scene.transform  # OpenGL's row 0 is at the bottom
    program["clip_from_eye"].write(turned_over.T.astype("f4").tobytes())
    program["light"].write(LIGHT.astype("f4").tobytes())
    program["ambient"].value = AMBIENT
    rows = np.hstack([scene.vertices, scene.normals]).astype(np.float32)
    indices = context.buffer(np.ascontiguousarray(scene.triangles, np.int32).tobytes())
    mesh = context.vertex_array(program, [(context.buffer(rows.tobytes()), "3f 3f", "position", "normal")], indices)
    frame = context.framebuffer([context.texture(scene.size, 4)], context.depth_renderbuffer(scene.size))
    frame.use()
    context.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
    context.front_face = "cw"  # turned over
    width, height = scene.size
    matrices = [view.T.astype("f4").tobytes() for view in scene.views]

    def draw_view(i: int) -> np.ndarray:
        picture = np.empty((height, width, 3), np.uint8)
        program["eye_from_object"].write(matrices[i])
        frame.clear(0, 0, 0, 1, depth=1.0)
        mesh.render(moderngl.TRIANGLES)
        frame.read_into(picture, components=3, alignment=1)
        return picture

    return drawing(scene, draw_view, "RGB", "upload")


def open_vtk_window(scene: Scene, renderer: Any, window: Any) -> Any:
    """Make a window off screen; return the camera; its projection is the matrix of the scene."""
    import vtk

    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetSize(*scene.size)
    window.AddRenderer(renderer)
    matrix = vtk.vtkMatrix4x4()
    matrix.DeepCopy(scene.transform.reshape(-1).tolist())
    camera = renderer.GetActiveCamera()
    camera.SetExplicitProjectionTransformMatrix(matrix)
    camera.SetUseExplicitProjectionTransformMatrix(True)
    return camera


def vtk_actor(scene: Scene) -> Any:
    """Return the mesh of a scene, with normals if it has them, culled as the scene says."""
    import vtk
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

    points, cells, mesh = vtk.vtkPoints(), vtk.vtkCellArray(), vtk.vtkPolyData()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(scene.vertices, np.float32), deep=True))
    cells.SetData(3, numpy_to_vtkIdTypeArray(np.ascontiguousarray(scene.triangles, np.int64).reshape(-1), deep=True))
    mesh.SetPoints(points)
    mesh.SetPolys(cells)
    if scene.normals is not None:
        mesh.GetPointData().SetNormals(numpy_to_vtk(scene.normals, deep=True))
    mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
    mapper.SetInputData(mesh)
    actor.SetMapper(mapper)
    actor.GetProperty().SetBackfaceCulling(scene.cull == "back")
    return actor


def draw_by_vtk(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """VTK: Gouraud or Phong as its mapper sees fit, a headlight, read back as RGB."""
    import vtk
    from vtkmodules.util.numpy_support import vtk_to_numpy

    width, height = scene.size
    actor = vtk_actor(scene)
    look = actor.GetProperty()
    look.SetInterpolationToPhong()
    look.SetAmbient(AMBIENT)
    look.SetDiffuse(1 - AMBIENT)
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    renderer.AddActor(actor)
    light = vtk.vtkLight()
    light.SetLightTypeToCameraLight()
    light.SetPosition(*LIGHT)
    light.SetFocalPoint(0, 0, 0)
    renderer.AddLight(light)
    renderer.SetAutomaticLightCreation(False)
    camera = open_vtk_window(scene, renderer, window)
    places = [np.linalg.inv(view) for view in scene.views]
    pixels = vtk.vtkUnsignedCharArray()

    def draw_view(i: int) -> np.ndarray:
        eye = places[i]
        camera.SetPosition(*eye[:3, 3])
        camera.SetFocalPoint(*(eye[:3, 3] - eye[:3, 2]))
        camera.SetViewUp(*eye[:3, 1])
        window.Render()
        window.GetPixelData(0, 0, width - 1, height - 1, 0, pixels, 0)
        return vtk_to_numpy(pixels).reshape(height, width, 3)[::-1]

    return drawing(scene, draw_view, "RGB", "upload")


def set_up_riley(size: tuple[int, int], scale_y: float, threads: int) -> tuple[Any, Any, Any]:
    """Return how triangles are written, a camera in the origin with that focal length, and options."""
    import riley

    convention = riley.ConnectConvention(riley.EElemType.TRI3, riley.EConnectAxis.ROW, 0, riley.ENodeOrder.RILEY)
    camera = riley.Camera(
        pixels_num=size, pixels_size=(2 / (scale_y * size[1]),) * 2, pos_world=(0.0, 0.0, 0.0),
        rot_world=(0.0, 0.0, 0.0), roi_cent_world=(0.0, 0.0, -1.0), focal_length=1.0, sub_sample=1,
    )  # fmt: skip
    config = riley.RasterConfig(
        parallel=threads, save_strategy=riley.SaveStrategy.memory, image_save_mode=riley.ImageSaveMode.grey,
        report=riley.ReportMode.off,
    )  # fmt: skip
    return convention, camera, config


def draw_by_riley(scene: Scene, threads: int) -> Drawing:
    """riley-raster: light at the vertices, which are turned into eye space for every view."""
    import riley

    width, height = scene.size
    triangles = scene.triangles.astype(np.int64)
    convention, camera, config = set_up_riley(scene.size, scene.transform[1, 1], threads)

    def draw_view(i: int) -> np.ndarray:
        points, values = _lit_vertices(scene, i)
        shader = riley.NodalShader(np.ascontiguousarray(255 * values[:, None]), scaling_type=riley.ScaleStrategy.none)
        mesh = riley.create_mesh(convention, riley.MeshType.tri3opt, points, triangles, shader)
        return riley.raster(mesh, camera, config).reshape(height, width).astype(np.uint8)

    return drawing(scene, draw_view, "grey", "")


def deodr_scene(scene: Scene, triangles: np.ndarray, n_vertices: int, **arrays: np.ndarray) -> Any:
    """Return triangles (T, 3) uint32 in pixels, untextured, of one channel: `ij`, `depths` and `colors` of vertices."""
    from deodr import differentiable_renderer as renderer

    width, height = scene.size
    n = len(triangles)
    return renderer.Scene2DBase(
        faces=triangles, faces_uv=triangles, textured=np.zeros(n, bool), uv=np.zeros((n_vertices, 2)),
        shade=np.zeros(n_vertices), shaded=np.zeros(n, bool), edgeflags=np.zeros((n, 3), bool), height=height,
        width=width, nb_colors=1, texture=np.zeros((0, 0, 1)), background_color=np.zeros(1), clockwise=False,
        backface_culling=scene.cull == "back", strict_edge=True, perspective_correct=False,
        integer_pixel_centers=False, **arrays,
    )  # fmt: skip


def draw_by_deodr(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """DEODR: light at the vertices, which are projected by NumPy for every view."""
    from deodr import differentiable_renderer as renderer

    width, height = scene.size
    triangles = np.ascontiguousarray(scene.triangles, np.uint32)
    image, depth = np.zeros((height, width, 1)), np.zeros((height, width))

    def draw_view(i: int) -> np.ndarray:
        points, values = _lit_vertices(scene, i)
        clip = points @ scene.transform[:, :3].T + scene.transform[:, 3]
        ndc = clip[:, :3] / clip[:, 3:]
        ij = np.ascontiguousarray((ndc[:, :2] * [1, -1] + 1) * [width / 2, height / 2])
        depths = np.ascontiguousarray((ndc[:, 2] + 1) / 2)  # it wants them positive
        colors = np.ascontiguousarray(values[:, None])
        world = deodr_scene(scene, triangles, len(colors), ij=ij, depths=depths, colors=colors)
        renderer.renderScene(world, 0, image, depth, False, None, None, False)
        return (255 * image[..., 0]).astype(np.uint8)

    return drawing(scene, draw_view, "grey + depth", "")


def _lit_vertices(scene: Scene, i: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices in eye space (V, 3) float64, and their light (V,) from 0 to 1."""
    view = scene.views[i]
    points = scene.vertices.astype(np.float64) @ view[:3, :3].T + view[:3, 3]
    light = LIGHT @ view[:3, :3]
    return points, AMBIENT + (1 - AMBIENT) * np.maximum(0, scene.normals @ light)
