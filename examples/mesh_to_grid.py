"""A mesh on two grids: solid voxels, and a normal map baked from a finer mesh."""

import numpy as np
from picture import beside, output_path, ramp

import topleft as tl

SIZE = (150, 150)


def voxels() -> np.ndarray:
    """The voxels of a torus knot, each a cube with the colour of its height."""
    found = tl.voxelize(tl.scenes.shape("torus-knot"), 36)
    cube = tl.Mesh(*tl.scenes.cube())
    colors = ramp(np.linspace(0, 1, found.values.shape[1])[None])[0]
    instances = []
    for (_, y, _), middle in zip(np.argwhere(found.values), found.points(), strict=True):
        place = np.diag([0.46 * found.pitch] * 3 + [1.0])
        place[:3, 3] = middle
        instances.append(tl.Instance(cube, place, color=colors[y].tolist()))
    return tl.render(tl.Scene(instances), size=SIZE, sampling="msaa4")


def normal_map() -> np.ndarray:
    """The bumps of a fine sheet in the frame of a flat one."""
    t = np.linspace(0, 1, 161)
    u, v = np.meshgrid(t, t)
    height = 0.02 * np.sin(40 * u) * np.sin(40 * v) + 0.03 * np.exp(-60 * ((u - 0.5) ** 2 + (v - 0.5) ** 2))
    corner = (np.arange(160)[:, None] * 161 + np.arange(160)).reshape(-1, 1)
    triangles = (corner + [0, 1, 162, 161])[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    fine = tl.Mesh(np.stack([u, v, height], -1).reshape(-1, 3), triangles)
    square = [[0, 0], [1, 0], [1, 1], [0, 1]]
    flat = tl.Mesh(np.c_[square, [0, 0, 0, 0]], [[0, 1, 2], [0, 2, 3]], uv=square)
    baked = tl.bake(flat, "tangent_normal", SIZE, source=fine)
    return np.rint(127.5 + 127.5 * baked.values).astype(np.uint8)


def main() -> None:
    tl.save_image(output_path(__doc__), beside(voxels(), normal_map()))


if __name__ == "__main__":
    main()
