"""A scene with textures, materials and lights: three shapes on a tiled floor.

Meshes are placed by matrices; the floor's tiles shrink to less than a pixel towards the horizon, and stay quiet there.
"""

import numpy as np
from picture import output_path

import topleft as tl

SIZE = (480, 240)


def grid_mesh(points: np.ndarray, uv: np.ndarray, material: tl.Material) -> tl.Mesh:
    """A mesh of a grid of points (M, N, 3), whose seams have vertices of their own."""
    rows, columns = points.shape[:2]
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    quads = corner[:, None] + [0, 1, columns + 1, columns]
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return tl.Mesh(points.reshape(-1, 3), triangles, uv=uv.reshape(-1, 2), materials=(material,))


def tiles(dark: tuple[int, int, int], light: tuple[int, int, int]) -> tl.Texture:
    """Two by two tiles with joints."""
    image = np.empty((128, 128, 3), np.uint8)
    image[:], image[:64, :64], image[64:, 64:] = dark, light, light
    image[::64], image[:, ::64] = (90, 90, 96), (90, 90, 96)
    return tl.Texture(image)


def floor() -> tl.Mesh:
    x, z = np.meshgrid([-30.0, 30.0], [-30.0, 6.0])
    points = np.stack([x, np.zeros_like(x), z], axis=-1)
    material = tl.Material(texture=tiles((150, 155, 165), (205, 205, 200)), unlit=True)
    return grid_mesh(points, points[..., [0, 2]] / 2, material)


def ring() -> tl.Mesh:
    """A torus with a texture of stripes."""
    u, v = np.meshgrid(np.linspace(0, 1, 97), np.linspace(0, 1, 49))
    long, short = 2 * np.pi * u, 2 * np.pi * v
    radius = 1 + 0.42 * np.cos(short)
    points = np.stack([radius * np.cos(long), 0.42 * np.sin(short), radius * np.sin(long)], axis=-1)
    stripes = np.array([[(233, 190, 80)] * 3 + [(40, 60, 105)] * 5], np.uint8)
    material = tl.Material(texture=tl.Texture(np.repeat(stripes, 8, axis=1)), specular=0.5, shininess=60)
    return grid_mesh(points[::-1], np.stack([10 * u + 2 * v, v], axis=-1)[::-1], material)


def shape(name: str, material: tl.Material) -> tl.Mesh:
    vertices, triangles = tl.scenes.shape(name)
    return tl.Mesh(vertices, triangles, materials=(material,))


def at(x: float, y: float, z: float, *, size: float = 1.0, tilt_deg: float = 0.0) -> np.ndarray:
    """World from object."""
    matrix = np.eye(4)
    c, s = size * np.cos(np.radians(tilt_deg)), size * np.sin(np.radians(tilt_deg))
    matrix[:3] = [[size, 0, 0, x], [0, c, -s, y], [0, s, c, z]]
    return matrix


def main() -> None:
    knot = shape("torus-knot", tl.Material((206, 72, 56), specular=0.7, shininess=90))
    ball = shape("sphere", tl.Material((70, 140, 130), specular=0.35, shininess=25))
    scene = tl.Scene([
        floor(),
        (ring(), at(-2.5, 1.15, -0.6, tilt_deg=62)),
        (knot, at(0.4, 1.45, 0, size=0.85)),
        (ball, at(2.9, 0.9, -0.4, size=0.9)),
    ])  # fmt: skip
    lights = [
        tl.Light((-0.5, 1.0, 0.7), color=(255, 244, 225), intensity=0.85),
        tl.Light((4, 2.5, 2.5), kind="point", color=(150, 190, 255), intensity=1.2, falloff=0.12),
    ]
    camera = tl.Camera.look_at((0.3, 2.7, 7.4), (0.25, 1.25, 0), fov_y_deg=30)
    sky = (214, 224, 234)
    picture = tl.render(
        scene, camera, SIZE, lights=lights, ambient=0.12, background=sky, fog=tl.Fog(9, 34, sky), sampling="msaa8"
    )
    tl.save_image(path := output_path(__doc__), picture[..., :3])
    print(f"{scene.n_triangles} triangles -> {path.name}")


if __name__ == "__main__":
    main()
