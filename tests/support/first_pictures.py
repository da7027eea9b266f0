"""The picture that the command line makes of a built-in shape unless it is told otherwise, by the library."""

import topleft as tl

SIZE = (64, 48)


def shape_of(name):
    """A built-in shape as the command line takes it."""
    return tl.Mesh(*tl.scenes.shape(name), crease=30)


def camera_of(mesh, size=SIZE, **framing):
    """The camera of a single view: the picture of the mesh fills the frame."""
    return tl.Camera.framing(mesh, aspect=size[0] / size[1], fit="silhouette", **framing)


def first_picture(name, size=SIZE, **options):
    """The picture of a single view."""
    mesh = shape_of(name)
    return tl.render(mesh, camera_of(mesh, size), size, **{"sampling": "msaa4", **options})
