"""Resample a turned grid onto another so that nothing is lost: each cell gives each pixel its exact share of area.

Conservative remapping, as for rain, populations or photons: the sum over the new grid is the sum over the old one.
"""

import numpy as np
from picture import beside, output_path, ramp

import topleft as tl

N = 24  # cells a side of the old grid
SIDE = 40  # pixels a side of the new one
ZOOM = 8


def main() -> None:
    path = output_path(__doc__)
    y, x = np.mgrid[:N, :N] + 0.5
    amounts = np.exp(-((x - 15) ** 2 + (y - 9) ** 2) / 30) + ((x // 3 + y // 3) % 2) * 0.4

    turn = np.radians(27)
    corners = np.mgrid[: N + 1, : N + 1].reshape(2, -1).T[:, ::-1] - N / 2
    corners = corners @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) * 1.15 + SIDE / 2
    first = (np.arange(N)[:, None] * (N + 1) + np.arange(N)).ravel()
    cell_area = 1.15**2

    result = np.zeros((SIDE, SIDE))
    for corner, amount in zip(first, amounts.ravel(), strict=True):
        quad = corners[[corner, corner + 1, corner + N + 2, corner + N + 1]]
        origin = np.floor(quad.min(axis=0)).astype(int)
        width, height = np.ceil(quad.max(axis=0)).astype(int) - origin
        share = tl.coverage(
            quad, [[0, 1, 2], [0, 2, 3]], (width, height), origin=tuple(origin), sampling="area", subpixel_bits=16
        )
        result[origin[1] : origin[1] + height, origin[0] : origin[0] + width] += amount * share / cell_area
    print(f"sum before {amounts.sum():.6f}, after {result.sum():.6f}")
    assert abs(result.sum() / amounts.sum() - 1) < 1e-5

    before = ramp(np.kron(amounts, np.ones((13, 13))))  # 312 px
    after = ramp(np.kron(result, np.ones((ZOOM, ZOOM))))[4:-4]
    tl.save_image(path, beside(before, after))


if __name__ == "__main__":
    main()
