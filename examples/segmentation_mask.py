"""Masks for segmentation: which object shows in each pixel, with its box, exact to the pixel.

Training data for a detector: a picture, masks that tile it without gaps or doubles, and boxes from the masks.
"""

import numpy as np
from picture import beside, output_path

import topleft as tl

SIZE = (320, 320)
COLORS = np.array([[228, 87, 70], [66, 135, 196], [88, 168, 92], [240, 180, 60]], np.uint8)


def main() -> None:
    path = output_path(__doc__)
    parts, starts = [], [0]
    for name, place, scale in [
        ("torus-knot", (-0.75, 0.1, -0.3), 0.55),
        ("icosahedron", (0.8, -0.1, -0.35), 0.75),
        ("torus", (0.15, -0.45, 0.75), 0.62),
        ("cube", (-0.75, -0.4, 0.95), 0.36),
    ]:
        vertices, triangles = tl.scenes.shape(name)
        parts.append((vertices * scale + place, triangles))
        starts.append(starts[-1] + len(triangles))
    first_vertex = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    mesh = tl.Mesh(
        np.vstack([vertices for vertices, _ in parts]),
        np.vstack([triangles + first for (_, triangles), first in zip(parts, first_vertex, strict=False)]),
    )
    camera = tl.Camera.framing(mesh, azimuth_deg=15, elevation_deg=28, fit="points")
    triangle = tl.rasterize_mesh(mesh, camera, SIZE).triangle

    # The triangles of object i are starts[i] to starts[i + 1]; -1 stays -1, nothing.
    labels = np.searchsorted(starts, triangle, side="right") - 1
    masks = [labels == i for i in range(len(parts))]
    assert sum(mask.sum() for mask in masks) == (triangle >= 0).sum()

    picture = np.full((*SIZE[::-1], 3), 255, np.uint8)
    for mask, color in zip(masks, COLORS, strict=True):
        picture[mask] = color
        rows, columns = np.nonzero(mask)
        top, bottom, left, right = rows.min(), rows.max(), columns.min(), columns.max()
        picture[[top, bottom], left : right + 1] = 40
        picture[top : bottom + 1, [left, right]] = 40
        print(f"box {left},{top} to {right},{bottom}: {mask.sum()} pixels")
    tl.save_image(path, beside(tl.render(mesh, camera, SIZE), picture))


if __name__ == "__main__":
    main()
