"""What a child process draws, in a module that it can import."""

import topleft as tl


def render_in_child(_=None):
    mesh = tl.Mesh(*tl.scenes.blob(4_000))
    return tl.render(mesh, tl.Camera.framing(mesh), (64, 48), threads=2).tobytes()


def put_picture(queue):
    queue.put(render_in_child())
