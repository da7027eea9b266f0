"""Blend2D, by blend2d-py: a path and a fill a triangle; it always antialiases."""

from __future__ import annotations

from benchmarks.cases import Scene
from benchmarks.peers import Drawing

MODULE, DISTRIBUTION = "blend2d", "blend2d-py"
TASKS = ("smooth-fill",)


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """Paths are built before; pixels are BGRA."""
    import blend2d

    image = blend2d.Image(*scene.size)
    paths = []
    for corners in scene.vertices[:, :2][scene.triangles].tolist():
        path = blend2d.Path()
        path.move_to(*corners[0])
        path.line_to(*corners[1])
        path.line_to(*corners[2])
        path.close()
        paths.append(path)
    values = scene.colors.tolist()

    def draw() -> None:
        context = blend2d.Context(image)
        context.set_fill_style_rgba(0, 0, 0)
        context.fill_all()
        for path, value in zip(paths, values, strict=True):
            context.set_fill_style_rgba(*value)
            context.fill_path(path)
        context.end()

    return Drawing(draw, lambda: {"color": image.asarray()[..., 2::-1]}, "RGBA", "paths")
