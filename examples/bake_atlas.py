"""Bake a texture: what is known on the surface of a mesh, written into its UV atlas.

The triangles are drawn where they lie in the atlas, and positions and normals interpolated there; whatever can be
computed from them becomes a texel: here stripes, and light from above. A border round each island keeps filters from
seeing the background.
"""

import numpy as np
from picture import beside, output_path

import topleft as tl

ATLAS = (320, 320)


def main() -> None:
    path = output_path(__doc__)
    segments, sections = 96, 48
    vertices, triangles = tl.scenes.torus(1.0, 0.45, segments, sections)
    # The atlas is cut along two circles. A triangle that crosses one has corners on both sides, so UVs are per corner.
    ring, around = np.divmod(triangles, sections)
    uv = np.stack([ring / segments, around / sections], axis=-1)
    uv += (uv.max(axis=1, keepdims=True) - uv) > 0.5
    corners_px = 8 + uv.reshape(-1, 2) * (np.array(ATLAS) - 16)
    islands = np.arange(triangles.size).reshape(-1, 3)

    frags = tl.rasterize(corners_px, islands, ATLAS)
    mesh = tl.Mesh(vertices, triangles)
    position = frags.interpolate(vertices[triangles])
    normal = frags.interpolate(mesh.vertex_normals()[triangles])
    stripes = np.sin(9 * np.arctan2(position[..., 2], position[..., 0]) + 14 * position[..., 1]) > 0
    light = 0.45 + 0.55 * np.clip(normal @ np.array([0.3, 0.9, 0.3]), 0, 1)
    texture = np.where(stripes[..., None], (226, 120, 70), (250, 236, 206)) * light[..., None]
    texture[~frags.mask] = 0

    # Grow the island by the mean of the neighbours that are baked already.
    baked = frags.mask.copy()
    for _ in range(6):
        shifts = [np.s_[:-2, 1:-1], np.s_[2:, 1:-1], np.s_[1:-1, :-2], np.s_[1:-1, 2:]]
        known, padded = np.pad(baked, 1), np.pad(texture, ((1, 1), (1, 1), (0, 0)))
        count = sum(known[s].astype(int) for s in shifts)
        total = sum(padded[s] * known[s][..., None] for s in shifts)
        grow = ~baked & (count > 0)
        texture[grow] = total[grow] / count[grow][:, None]
        baked |= grow
    texture = np.rint(texture).astype(np.uint8)

    # The texture on the mesh, to look at: texels picked by interpolated UVs.
    frags = tl.rasterize_mesh(mesh, size=ATLAS)
    place = 8 + frags.interpolate(uv) * (np.array(ATLAS) - 16)
    column, row = np.clip(place.astype(int), 0, ATLAS[0] - 1).transpose(2, 0, 1)
    seen = np.where(frags.mask[..., None], texture[row, column], 255).astype(np.uint8)
    tl.save_image(path, beside(texture, seen))


if __name__ == "__main__":
    main()
