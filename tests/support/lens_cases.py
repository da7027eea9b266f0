"""Lenses, and a mesh with holes to be seen through them."""

import numpy as np

import topleft as tl

LENSES = {"barrel": tl.OpenCVLens(-0.2, 0.05, 0.001, -0.002), "fisheye": tl.FisheyeLens(-0.02, 0.01)}


def pierced():
    """A square before another one; the near one has a hole in its middle."""
    image = np.full((64, 64, 4), 255, np.uint8)
    image[16:48, 16:48, 3] = 0
    corners = [[x, y, z] for z in (0, -1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    uv = [[0, 0], [1, 0], [1, 1], [0, 1]] * 2
    holed = tl.Material(texture=tl.Texture(image), alpha_cutoff=0.5)
    triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    return tl.Mesh(corners, triangles, uv=uv, materials=[holed, tl.Material()], material_of_triangle=[0, 0, 1, 1])


FRONT = tl.Camera.look_at((0, 0, 5), fov_y_deg=40)
