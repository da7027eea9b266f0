"""OpenGL on Mesa's software rasterizer llvmpipe, by moderngl on EGL: no display, no GPU.

Needs Mesa's EGL library (Debian: libegl1 libgl1-mesa-dri). The mesh is uploaded before; a call clears, draws and reads
the pictures back into NumPy arrays. The vertex shader turns y over, so that row 0 is on top.
"""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing, llvmpipe_context
from benchmarks.scenes.cases import Scene

MODULE = DISTRIBUTION = "moderngl"
TASKS = ("visibility", "depth-2d", "mask", "fill", "labels", "smooth", "smooth-fill", "views", "views-png")
THREADS = True
SAMPLES = 4
"""Of a pixel, for smooth pictures: all that llvmpipe has."""

VERTEX_SHADER = """
#version 330
uniform mat4 clip_from_input;
in vec3 position;
#ifdef COLORED
in vec3 color;
flat out vec3 flat_color;
#endif
void main() {
    gl_Position = clip_from_input * vec4(position, 1);
#ifdef COLORED
    flat_color = color;
#endif
}
"""
# Integer targets are cleared to 0: ids go in one higher.
ID_SHADER = """
#version 330
out int id;
void main() { id = gl_PrimitiveID + 1; }
"""
COLOR_SHADER = """
#version 330
flat in vec3 flat_color;
out vec4 color;
void main() { color = vec4(flat_color, 1); }
"""
MASK_SHADER = """
#version 330
out float covered;
void main() { covered = 1; }
"""


def environment(threads: int) -> dict[str, str]:
    """0 rasterizer threads: the calling thread draws."""
    return {"LP_NUM_THREADS": str(threads if threads > 1 else 0), "LIBGL_ALWAYS_SOFTWARE": "1",
            "GALLIUM_DRIVER": "llvmpipe"}  # fmt: skip


def clip_from_input(scene: Scene) -> np.ndarray:
    """The matrix (4, 4) that also turns the picture over: OpenGL's row 0 is at the bottom."""
    width, height = scene.size
    if scene.transform is not None:
        return np.diag([1.0, -1.0, 1.0, 1.0]) @ scene.transform
    return np.array([[2 / width, 0, 0, -1], [0, 2 / height, 0, -1], [0, 0, 2, -1], [0, 0, 0, 1]])


def prepare(scene: Scene, threads: int) -> Drawing:
    """Upload, compile, and give the call."""
    if scene.views is not None:
        from benchmarks.peers.views import draw_by_llvmpipe

        return draw_by_llvmpipe(scene, threads)
    import moderngl

    context = llvmpipe_context()
    width, height = scene.size
    vertices, triangles = scene.vertices, scene.triangles
    if scene.task == "smooth-fill":  # corners of its own for every triangle: a colour per vertex is one per triangle
        vertices, triangles = vertices[triangles].reshape(-1, 2), np.arange(3 * len(triangles)).reshape(-1, 3)
    position = np.zeros((len(vertices), 3), np.float32)
    position[:, : vertices.shape[1]] = vertices
    indices = np.ascontiguousarray(triangles, np.int32)
    with_depth = scene.task in ("visibility", "depth-2d")
    source, shader = VERTEX_SHADER, ID_SHADER
    buffers = [(context.buffer(position.tobytes()), "3f", "position")]
    if scene.task in ("fill", "smooth-fill"):
        source, shader = VERTEX_SHADER.replace("#version 330", "#version 330\n#define COLORED"), COLOR_SHADER
        colors = np.zeros((len(position), 4), np.uint8)
        colors[indices, :3] = scene.colors[:, None]
        buffers.append((context.buffer(colors.tobytes()), "3f1 1x1", "color"))
    elif scene.task in ("mask", "smooth"):
        shader = MASK_SHADER
    program = context.program(vertex_shader=source, fragment_shader=shader)
    program["clip_from_input"].write(clip_from_input(scene).T.astype("f4").tobytes())
    mesh = context.vertex_array(program, buffers, context.buffer(indices.tobytes()))

    channels = {"fill": (4, "f1"), "smooth-fill": (4, "f1"), "mask": (1, "f1"), "smooth": (1, "f1")}
    n_channels, dtype = channels.get(scene.task, (1, "i4"))
    target = context.texture(scene.size, n_channels, dtype=dtype)
    depth_target = context.depth_texture(scene.size) if with_depth else None
    frame = drawn = context.framebuffer([target], depth_target)
    if scene.task in ("smooth", "smooth-fill"):
        drawn = context.framebuffer([context.renderbuffer(scene.size, n_channels, samples=SAMPLES)])
    drawn.use()
    culling = moderngl.CULL_FACE if scene.cull == "back" else moderngl.NOTHING
    context.enable_only(culling | (moderngl.DEPTH_TEST if with_depth else moderngl.NOTHING))
    context.front_face = "cw"  # turned over
    picture = np.zeros((height, width, n_channels), np.int32 if dtype == "i4" else np.uint8)
    depth = np.ones((height, width), np.float32)

    def draw() -> None:
        drawn.use()
        drawn.clear(0, 0, 0, 0, depth=1.0)
        mesh.render(moderngl.TRIANGLES)
        if drawn is not frame:
            context.copy_framebuffer(frame, drawn)
        frame.read_into(picture, components=n_channels, dtype=dtype, alignment=1)
        if with_depth:
            frame.read_into(depth, components=1, attachment=-1, dtype="f4", alignment=1)

    def result() -> dict[str, np.ndarray]:
        if scene.task in ("fill", "smooth-fill"):
            return {"color": picture[..., :3]}
        if scene.task == "smooth":
            return {"smooth": picture[..., 0]}
        if scene.task == "mask":
            return {"mask": picture[..., 0] > 0}
        ids = picture[..., 0] - 1
        return {"triangle": ids, **({"depth": np.where(ids < 0, np.float32(np.inf), depth)} if with_depth else {})}

    gives = {"fill": "RGBA", "mask": "mask", "labels": "id"}
    gives |= {"smooth": f"{SAMPLES} samples", "smooth-fill": f"RGBA, {SAMPLES} samples"}
    return Drawing(draw, result, gives.get(scene.task, "id + depth"), "upload")
