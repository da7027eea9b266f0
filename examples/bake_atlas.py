"""Bake a texture: what is known on the surface of a mesh, written into its UV atlas.

Positions and normals are baked; whatever can be computed from them becomes a texel: here stripes, and light from above.
A gutter round the chart keeps filters from seeing the background.
"""

from dataclasses import replace

import numpy as np
from picture import beside, output_path

import topleft as tl

ATLAS = (320, 320)


def torus(segments: int, sections: int) -> tl.Mesh:
    """A torus cut along two circles, so that its chart is a rectangle."""
    u, v = np.meshgrid(np.linspace(0, 1, segments + 1), np.linspace(0, 1, sections + 1), indexing="ij")
    ring, around = 2 * np.pi * u, 2 * np.pi * v
    far = 1 + 0.45 * np.cos(around)
    points = np.stack([far * np.cos(ring), 0.45 * np.sin(around), -far * np.sin(ring)], axis=-1)
    corner = (np.arange(segments)[:, None] * (sections + 1) + np.arange(sections)).reshape(-1, 1)
    quads = corner + [0, sections + 1, sections + 2, 1]
    uv = np.stack([u, v], axis=-1) * 0.95 + 0.025
    return tl.Mesh(points.reshape(-1, 3), quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3), uv=uv.reshape(-1, 2))


def main() -> None:
    path = output_path(__doc__)
    mesh = torus(96, 48)
    position, normal = (tl.bake(mesh, what, ATLAS).values for what in ("position", "normal"))
    stripes = np.sin(9 * np.arctan2(position[..., 2], position[..., 0]) + 14 * position[..., 1]) > 0
    light = 0.45 + 0.55 * np.clip(normal @ np.array([0.3, 0.9, 0.3]), 0, 1)
    texture = np.where(stripes[..., None], (226, 120, 70), (250, 236, 206)) * light[..., None]
    texture = np.rint(texture).astype(np.uint8)

    # The texture on the mesh, to look at.
    material = tl.Material(texture=tl.Texture(texture), unlit=True)
    seen = tl.render(replace(mesh, materials=[material]), size=ATLAS, sampling="msaa4")
    tl.save_image(path, beside(texture, seen))


if __name__ == "__main__":
    main()
