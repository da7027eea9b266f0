"""A field of a finite-element mesh on a regular grid, NaN outside: one call, exact ownership of each pixel.

The speed of an ideal flow past a cylinder, given at the nodes of an unstructured mesh, finer near the cylinder.
"""

import numpy as np
from picture import output_path, ramp

import topleft as tl


def main() -> None:
    path = output_path(__doc__)
    n_rings, n_around = 40, 120
    radius = np.geomspace(1, 4.2, n_rings)[:, None]
    angle = np.arange(n_around) * 2 * np.pi / n_around + np.arange(n_rings)[:, None] * np.pi / n_around
    nodes = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1).reshape(-1, 2)
    ring, k = np.mgrid[: n_rings - 1, :n_around].reshape(2, -1)
    here, onward = ring * n_around + k, ring * n_around + (k + 1) % n_around
    inner = np.stack([here, onward, here + n_around], axis=1)
    outer = np.stack([onward, onward + n_around, here + n_around], axis=1)
    triangles = np.concatenate([inner, outer])
    z = nodes[:, 0] + 1j * nodes[:, 1]
    speed = np.abs(1 - 1 / z**2)  # potential flow: 0 at the front and the back, 2 at the sides

    grid = tl.Grid((560, 320), (-3.5, 3.5, -2, 2))
    values = tl.field((nodes, triangles), speed, grid)
    print(f"speed from {np.nanmin(values):.3f} to {np.nanmax(values):.3f}, {np.isnan(values).sum()} pixels outside")
    picture = ramp(values, 0, 2)
    tenths = np.floor(np.nan_to_num(values) * 10)
    lines = (tenths != np.roll(tenths, 1, axis=0)) | (tenths != np.roll(tenths, 1, axis=1))
    picture[lines] = picture[lines] // 4 * 3
    tl.save_image(path, picture)


if __name__ == "__main__":
    main()
