"""Weights of pixels, vectors of them at a time: the same bits as integers and float64, one pixel after the other."""

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on

import topleft as tl

SIZE = (61, 37)


def expected_weights(corners_fx, inv_w, x_px, y_px, bits):
    """Edge functions as integers, doubled; then float64, summed in the order that makes the area positive."""
    p = [2 * x_px * 2**bits + 2**bits, 2 * y_px * 2**bits + 2**bits]
    edges = []
    for k in range(3):
        (ax, ay), (bx, by) = corners_fx[(k + 1) % 3], corners_fx[(k + 2) % 3]
        edges.append((bx - ax) * (p[1] - 2 * ay) - (by - ay) * (p[0] - 2 * ax))
    sign = 1 if sum(edges) > 0 else -1
    parts = [float(sign * edge) * q for edge, q in zip(edges, inv_w, strict=True)]
    first, second, third = parts if sign > 0 else (parts[0], parts[2], parts[1])
    return [part / (first + second + third) for part in parts]


def check(frags, triangles, corners_fx, inv_w, bits, values):
    weights, mixed = frags.barycentric(), frags.interpolate(values, background=7)
    expected = np.zeros((*frags.triangle.shape, 3), np.float32)
    sums = np.full((*frags.triangle.shape, values.shape[1]), 7, np.float32)
    for y, x in np.argwhere(frags.mask).tolist():
        corners = triangles[frags.triangle[y, x]].tolist()
        own = expected_weights([corners_fx[i] for i in corners], [inv_w[i] for i in corners], x, y, bits)
        expected[y, x] = own
        a, b, c = (values[i].astype(np.float64) for i in corners)
        sums[y, x] = (own[0] * a + own[1] * b) + own[2] * c
    assert_same(weights, expected)
    assert_same(mixed, sums)


@ON_EACH_ISA
@pytest.mark.parametrize("reach", [4, 60, 3000])
@pytest.mark.parametrize("bits", [0, 8, 12])
def test_weights_of_pixel_space_are_those_of_integers(isa, reach, bits):
    # 3000: boxes that int32 does not hold
    rng = np.random.default_rng(reach + bits)
    vertices = rng.uniform(0, SIZE, (40, 2)).repeat(3, axis=0) + rng.uniform(-reach, reach, (120, 2))
    triangles = rng.permutation(120).astype(np.int32).reshape(40, 3) if reach == 60 else np.arange(120).reshape(40, 3)
    for n_channels in (1, 2, 3, 4, 7):
        with on(isa):
            frags = tl.rasterize(vertices, triangles, SIZE, subpixel_bits=bits)
            corners = np.rint(vertices * 2**bits).astype(int).tolist()
            check(frags, triangles, corners, [1.0] * 120, bits, rng.standard_normal((120, n_channels), np.float32))


@ON_EACH_ISA
@pytest.mark.parametrize("spread", [2, 250])
def test_weights_of_clip_space_are_those_of_float64(isa, spread):
    # 250: 1/w that vectors do not take
    rng = np.random.default_rng(spread)
    w = np.exp2(rng.uniform(-spread, spread, (60, 1)))
    vertices = np.hstack([rng.uniform(-1.2, 1.2, (60, 3)) * [1, 1, 0.5] * w, w])
    triangles = rng.permutation(60).astype(np.int32).reshape(20, 3)
    with on(isa):
        frags = tl.rasterize(vertices, triangles, SIZE)
        x = np.rint((vertices[:, 0] / w[:, 0] + 1) * (SIZE[0] / 2) * 256).astype(int)
        y = np.rint((1 - vertices[:, 1] / w[:, 0]) * (SIZE[1] / 2) * 256).astype(int)
        corners = list(zip(x.tolist(), y.tolist(), strict=True))
        check(frags, triangles, corners, (1 / w[:, 0]).tolist(), 8, rng.standard_normal((60, 3), np.float32))


@ON_EACH_ISA
def test_weights_of_vertices_far_more_than_pixels_are_the_same(isa):
    mesh, camera = tl.Mesh(*tl.scenes.blob(20_000)), tl.Camera.look_at((2, 3, 4))
    with on(isa):
        frags = tl.rasterize_mesh(mesh, camera, SIZE)  # 10,000 vertices, 2,257 pixels: 1/w where it is asked for
        wide = tl.rasterize_mesh(mesh, camera, (200, 100), viewport=SIZE)  # for 20,000: of all at first
        assert_same(wide.barycentric()[: SIZE[1], : SIZE[0]], frags.barycentric())
