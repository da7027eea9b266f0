"""Levels of textures, made by blocks of rows: the same numbers as of the whole picture at once."""

import numpy as np
import pytest
from comparing import assert_same

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
        level = module.halved_along(module.halved_along(level, 0), 1)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (3, 5), (31, 17), (64, 48), (100, 63), (129, 65), (101, 7)])
@pytest.mark.parametrize("n_texels", [1, 40, 333, 1 << 17])
@pytest.mark.parametrize("encoding", ["srgb", "linear"])
def test_levels_by_blocks_of_rows_are_those_of_the_whole(size, n_texels, encoding, monkeypatch):
    monkeypatch.setattr(module, "BLOCK_TEXELS", n_texels)
    image = RNG.integers(0, 256, (*size, 4)).astype(np.uint8)
    rows = module.level_rows(size[1], size[0], has_halves=True)
    light = module.LIGHT_OF_BYTE[module.Encoding(encoding)]
    assert_same(module.texels_of(image, rows, light=light), levels_at_once(image, light))


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
