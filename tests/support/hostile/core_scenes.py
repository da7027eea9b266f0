"""Each kernel once on dust, middle and large triangles: for valgrind, which takes 20 to 50 times as long as the CPU."""

import numpy as np

import topleft as tl

SIZE = (640, 480)
N_AND_EXTENT = ((4000, 6), (1500, 40), (60, 600))


def main() -> None:
    rng, one = np.random.default_rng(0), {"threads": 1}
    for n, extent in N_AND_EXTENT:
        corners = rng.random((n, 1, 2)) * SIZE + (rng.random((n, 3, 2)) - 0.5) * extent
        vertices = np.column_stack([corners.reshape(-1, 2), rng.random(3 * n)])
        triangles = np.arange(3 * n, dtype=np.int32).reshape(-1, 3)
        flat = vertices[:, :2].copy(), triangles, SIZE
        colors = rng.integers(0, 256, (n, 4), dtype=np.uint8)
        for sampling in ("center", "msaa4", "area"):
            tl.coverage(*flat, sampling=sampling, **one)
        tl.overdraw(*flat, **one)
        frags = tl.rasterize(vertices, triangles, SIZE, **one)
        frags.barycentric(), frags.interpolate(vertices), frags.sample(colors[:16].reshape(4, 4, 4), flat[0] / 99)
        tl.merge([frags, frags], **one)
        for sampling in ("center", "msaa4"):
            tl.rasterize(vertices, triangles, SIZE, subpixel_bits="exact", sampling=sampling, **one)
        for blend in ("replace", "over"):
            tl.fill(flat[0], triangles, colors, SIZE, per="triangle", blend=blend, **one)
        for antialias in (False, True):
            tl.wireframe(*flat, antialias=antialias, **one)
        tl.composite(tl.peel(vertices, triangles, SIZE, **one), colors, per="triangle", **one)
        tl.polygons((flat[0], np.arange(0, 3 * n + 1, 3), np.arange(n + 1)), SIZE, values="index", **one)
        tl.overlap(flat[0], SIZE, triangles=triangles, **one)
        tl.field(flat[:2], vertices[:, 2], SIZE, extent=(0, 640, 0, 480), **one)
        tl.height_map((vertices, triangles), tl.Grid(SIZE, (0, 640, 0, 480)), **one)
        tl.points(vertices[:n], SIZE, point_size=extent / 2, **one)
    tl.render(tl.Mesh(*tl.scenes.shape("torus-knot")), size=SIZE, threads=1)


if __name__ == "__main__":
    main()
