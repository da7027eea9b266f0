"""Levels of textures, made by blocks of rows: the same numbers as of the whole picture at once."""

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on, one_by_one
from shading_reference import halved

import topleft as tl
from topleft._meshes.model import texture as module

RNG = np.random.default_rng(2)


def levels_at_once(image, light):
    """The texels of all levels, each halved as a whole."""
    level = np.concatenate([light[image[..., :3]], image[..., 3:] / 255], axis=2)[::-1]
    parts = []
    while True:
        padded = np.concatenate([level, level[:, :1]], axis=1)
        parts.append(np.rint(65535 * padded).astype(np.uint16).reshape(-1, 4))
        if max(level.shape[:2]) == 1:
            return np.concatenate([*parts, np.zeros((1, 4), np.uint16)])
        level = halved(level)


@one_by_one("size", [(1, 1), (1, 9), (9, 1), (3, 5), (31, 17), (64, 48), (100, 63), (129, 65), (101, 7)])
@pytest.mark.parametrize("n_texels", [1, 333, 1 << 17])
@pytest.mark.parametrize("encoding", ["srgb", "linear"])
@ON_EACH_ISA
def test_levels_by_blocks_of_rows_are_those_of_the_whole(isa, size, n_texels, encoding, monkeypatch):
    monkeypatch.setattr(module, "BLOCK_TEXELS", n_texels)
    image = RNG.integers(0, 256, (*size, 4)).astype(np.uint8)
    rows = module.level_rows(size[1], size[0], has_halves=True)
    light = module.LIGHT_OF_BYTE[encoding]
    with on(isa):
        assert_same(module.texels_of(image, rows, light=light), levels_at_once(image, light))


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
@pytest.mark.parametrize("cutoff", [0.2, 0.35, 0.5])
def test_levels_of_a_cutout_let_through_what_the_picture_does(wrap, cutoff):
    image = np.zeros((48, 36, 4), np.uint8)
    image[..., 3] = np.random.default_rng(3).choice([0, 255, 150], (12, 9), p=[0.5, 0.4, 0.1]).repeat(4, 0).repeat(4, 1)
    rows = module.level_rows(36, 48, has_halves=True)
    texels = module.texels_of(image, rows, light=module.LIGHT_OF_BYTE["srgb"])
    before = texels.copy()
    module.keep_coverage(texels, rows, 65535 * cutoff, (wrap, wrap))
    assert_same(texels[:, :3], before[:, :3])
    assert_same(texels[: rows[1][0]], before[: rows[1][0]])
    shares = []
    for offset, width, height in rows[:-2]:
        level = texels[offset : offset + height * (width + 1), 3].reshape(height, width + 1)
        assert_same(level[:, -1], level[:, 0])
        around = module.around_points(level[:, :-1], (wrap, wrap))
        shares.append(module.n_above(around, 1, 65535 * cutoff) / module.N_COVERAGE_POINTS)
    assert 0.1 < shares[0] < 0.6
    assert np.abs(np.subtract(shares, shares[0])).max() < 0.003  # of 4096 points a thousandth may miss


def test_opaque_textures_and_those_without_halvings_are_cut_as_they_are():
    for texture in (tl.Texture(np.full((4, 4), 9, np.uint8)), tl.Texture(np.zeros((4, 4, 4), np.uint8), "bilinear")):
        assert texture.compiled_cut_at(0.5) is texture.compiled
    clear = tl.Texture(np.zeros((4, 4, 4), np.uint8))
    assert clear.compiled_cut_at(0.5) is clear.compiled_cut_at(0.5) is not clear.compiled


def test_a_texture_without_halvings_has_one_level():
    assert module.level_rows(5, 3, has_halves=False) == [(0, 5, 3)]
    assert module.level_rows(5, 3, has_halves=True) == [(0, 5, 3), (18, 2, 1), (21, 1, 1)]


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"encoding": "gamma"}, ValueError, "encoding must be one of 'srgb', 'linear', got 'gamma'"),
        ({"uv_set": 2}, ValueError, "uv_set must be 0 or 1, got 2"),
        ({"transform": np.eye(3)}, ValueError, r"transform must be \(2, 3\) finite numbers, got shape \(3, 3\)"),
        ({"transform": np.full((2, 3), np.nan)}, ValueError, r"transform must be \(2, 3\) finite numbers"),
    ],
)
def test_wrong_textures_are_named(options, error, message):
    with pytest.raises(error, match=message):
        tl.Texture([[0, 255]], **options)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"metallic": 1.5}, ValueError, "metallic must lie in 0 to 1, got 1.5"),
        ({"roughness": -0.5}, ValueError, "roughness must be finite and not negative, got -0.5"),
        ({"opacity": 2}, ValueError, "opacity must lie in 0 to 1, got 2"),
        ({"emission": (1, 2)}, ValueError, r"emission must be three finite numbers, got \(1, 2\)"),
        ({"emission": (1, 2, -3)}, ValueError, "emission must be finite and not negative, got -3"),
        ({"alpha_mode": "glass"}, ValueError, "alpha_mode must be one of 'opaque', 'mask', 'blend', got 'glass'"),
        ({"normal_texture": 3}, TypeError, "normal_texture must be a Texture, got int"),
    ],
)
def test_wrong_materials_are_named(options, error, message):
    with pytest.raises(error, match=message):
        tl.Material(**options)
