"""A terrain, given as a TIN in map coordinates, as rasters: land cover per pixel, and heights for the shade.

Coordinates are eastings and northings of UTM, metres, half a million and five million: they go to pixels in float64.
"""

import numpy as np
from picture import output_path

import topleft as tl

WEST, SOUTH = 684_000.0, 5_412_000.0
COVER = np.array([[96, 148, 190], [222, 208, 160], [150, 184, 110], [92, 138, 82], [150, 140, 130], [245, 245, 245]])


def terrain(n: int = 90, side: float = 1000.0) -> tuple[np.ndarray, np.ndarray]:
    """A TIN (V, 3), (T, 3): points of an uneven grid, on hills."""
    rng = np.random.default_rng(11)
    x, y = np.meshgrid(np.linspace(0, side, n), np.linspace(0, side, n))
    inner = np.s_[1:-1, 1:-1]
    for axis in (x, y):
        axis[inner] += rng.uniform(-0.35, 0.35, (n - 2, n - 2)) * side / n
    z = sum(
        height * np.sin(x / side * a + p) * np.sin(y / side * b + q)
        for height, a, b, p, q in [(60, 5, 4, 0, 1), (32, 9, 11, 1, 0), (14, 23, 19, 2, 3), (6, 41, 45, 1, 1)]
    )
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1, 1)
    triangles = np.concatenate([corner + [0, 1, n], corner + [1, n + 1, n]])
    return np.column_stack([x.ravel() + WEST, y.ravel() + SOUTH, z.ravel()]), triangles


def main() -> None:
    path = output_path(__doc__)
    points, triangles = terrain()
    cover = np.digitize(points[triangles, 2].mean(axis=1), [-45, -25, 10, 40, 62]).astype(np.float32)

    grid = tl.Grid.around((points, triangles), pixel_size=4.0)
    labels = tl.field((points, triangles), cover, grid, per="triangle")
    heights = tl.height_map((points, triangles), grid)

    south, east = np.gradient(heights, *grid.pixel_size[::-1])
    light = np.clip((1 + 0.8 * (south - east)) / np.sqrt(1 + south**2 + east**2), 0.35, 1.25)
    picture = COVER[labels.astype(int)] * light[..., None]
    for label, share in enumerate(np.bincount(labels.astype(int).ravel()) * np.prod(grid.pixel_size) / 1e4):
        print(f"cover {label}: {share:.2f} ha")
    tl.save_image(path, np.clip(picture, 0, 255).astype(np.uint8))


if __name__ == "__main__":
    main()
