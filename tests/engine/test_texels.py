"""Arrays looked up at pixels, and slopes: against float64 by the formulas, the same bits on every instruction set."""

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, assert_same_everywhere, on

import topleft as tl

SIZE = (32, 16)
#: Pixels, on whole numbers so that the snap moves nothing, and w; uv, which leave the array on all sides.
X_Y_W = np.array([[0, 0, 1], [32, 1, 4], [30, 16, 2], [1, 15, 0.5]])
UV = np.random.default_rng(0).uniform(-1.3, 2.4, (4, 2))
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def clip_of(x_y_w):
    """Clip space of pixels; a power of two a side and of w, so no number is rounded."""
    x, y, w = x_y_w.T
    return np.stack([(2 * x / SIZE[0] - 1) * w, (1 - 2 * y / SIZE[1]) * w, 0 * w, w], axis=1)


def planes_at(x, y, corners, values):
    """Values of a triangle at a point of the picture: weights l / sum(l), l = M^-1 (x, y, 1)."""
    own = X_Y_W[corners]
    l = np.linalg.solve((own * [1, 1, 0] * own[:, 2:] + own * [0, 0, 1]).T, [x, y, 1])  # noqa: E741
    return l / l.sum() @ values[corners]


def means(values):
    """The next halving along the first axis: each the mean over its part, which is whole in m-ths of a texel."""
    m = max(1, len(values) // 2)
    return np.stack([part.mean(axis=0) for part in np.array_split(np.repeat(values, m, axis=0), m)])


def texel(level, row, column, wraps):
    def of(i, n, wrap):
        if wrap == "clamp":
            return min(max(i, 0), n - 1)
        return i % n if wrap == "repeat" else min(i % (2 * n), 2 * n - 1 - i % (2 * n))

    return level[of(row, level.shape[0], wraps[1]), of(column, level.shape[1], wraps[0])]


def between(level, u, v, wraps):
    x, y = u * level.shape[1] - 0.5, (1 - v) * level.shape[0] - 0.5
    left, top = int(np.floor(x)), int(np.floor(y))
    a, b = x - left, y - top
    upper = (1 - a) * texel(level, top, left, wraps) + a * texel(level, top, left + 1, wraps)
    lower = (1 - a) * texel(level, top + 1, left, wraps) + a * texel(level, top + 1, left + 1, wraps)
    return (1 - b) * upper + b * lower


def expected(frags, texture, how, wraps):
    """The picture by the formulas, float64, pixel by pixel; and how many halvings down it looked."""
    levels = [texture.astype(np.float64)]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(means(means(levels[-1]).swapaxes(0, 1)).swapaxes(0, 1))
    height, width, n_channels = texture.shape
    out, lods = np.zeros((*frags.triangle.shape, n_channels)), []
    for row, column in np.argwhere(frags.mask):
        corners, x, y, step = FACES[frags.triangle[row, column]], column + 0.5, row + 0.5, 1e-4
        u, v = planes_at(x, y, corners, UV)
        if how == "nearest":
            out[row, column] = texel(levels[0], int(np.floor((1 - v) * height)), int(np.floor(u * width)), wraps)
            continue
        sides = [planes_at(x + dx, y + dy, corners, UV) - planes_at(x - dx, y - dy, corners, UV)
                 for dx, dy in ((step, 0), (0, step))]  # fmt: skip
        longest = max(np.hypot(*(side / (2 * step) * [width, height])) for side in sides)
        lod = min(max(np.log2(longest), 0), len(levels) - 1) if how == "trilinear" else 0
        fine = int(lod)
        lods.append(lod)
        out[row, column] = (1 - lod + fine) * between(levels[fine], u, v, wraps)
        if lod > fine:
            out[row, column] += (lod - fine) * between(levels[fine + 1], u, v, wraps)
    return out, lods


@ON_EACH_ISA
@pytest.mark.parametrize("wraps", [("repeat", "mirror"), ("mirror", "clamp"), ("clamp", "repeat")])
@pytest.mark.parametrize("how", ["nearest", "bilinear", "trilinear"])
@pytest.mark.parametrize("shape", [(16, 8, 1), (21, 35, 3), (1, 7, 33), (5, 1, 2)])
def test_sample_is_the_formula(isa, shape, how, wraps):
    texture = np.random.default_rng(1).normal(size=shape).astype(np.float32)
    with on(isa):
        frags = tl.rasterize(clip_of(X_Y_W), FACES, SIZE)
        found = frags.sample(texture, UV, filter=how, wrap=wraps)
    picture, lods = expected(frags, texture, how, wraps)
    # uv of a pixel are float32: off by 2^-24 of up to 3 times 35 texels, between texels that differ by up to 8.
    np.testing.assert_allclose(found, picture, rtol=0, atol=1e-4)
    if how == "trilinear" and shape == (21, 35, 3):
        assert min(lods) < 0.5
        assert max(lods) > 1.5


def test_slopes_and_samples_have_the_same_bits_everywhere():
    mesh = tl.Mesh(*tl.scenes.shape("torus-knot"))
    camera, uv = tl.Camera.framing(mesh), mesh.vertices[:, :2]
    texture = np.random.default_rng(2).normal(size=(64, 48, 5)).astype(np.float32)

    def draw(size, **view):
        frags = tl.rasterize_mesh(mesh, camera, size, **view)
        return frags.interpolate(uv, derivatives=True)[1], frags.sample(texture, uv, wrap="mirror")

    assert_same_everywhere(draw, (48, 32), [((9, 7), (30, 20))], (1, 3))


def test_texture_keeps_its_levels_unless_they_are_large(monkeypatch):
    texture = tl.Texture(np.random.default_rng(3).integers(0, 256, (16, 16, 4), np.uint8))
    first = texture.value_levels()
    assert texture.value_levels() is first
    monkeypatch.setattr("topleft._meshes.model.texture.MOST_KEPT_BYTES", first.texels.nbytes - 1)
    large = tl.Texture(texture.image)
    assert large.value_levels() is not large.value_levels()
    assert_same(large.value_levels().texels, first.texels)


@pytest.mark.parametrize("wrap", ["repeat", "mirror", "clamp"])
@pytest.mark.parametrize("how", ["nearest", "bilinear", "trilinear"])
@pytest.mark.parametrize("far", [1e9, -1e20, 3e38])
def test_uv_beyond_all_texels_find_one_of_them(far, how, wrap):
    frags = tl.rasterize([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 4))
    found = frags.sample(np.full((3, 5), 2.0), [[far, -far]] * 3, filter=how, wrap=wrap)
    assert found[frags.mask].tolist() == [2.0] * int(frags.mask.sum())


def test_uv_that_are_no_numbers_give_none():
    frags = tl.rasterize([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 4))
    for how in ("bilinear", "trilinear"):
        assert np.isnan(frags.sample(np.eye(4), [[np.nan, 0]] * 3, filter=how)[frags.mask]).all()
