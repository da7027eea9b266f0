"""Textures of the engine's tensors: the same numbers on every instruction set, with any channels, in both dtypes."""

from itertools import product

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, on

from topleft._core.gradients.tensors import TexelFilter, TexelLook, TexelsBeyond, texels, texels_vjp


def look(how, beyond, dtype=np.float64, n_channels=3, size=(20, 12)):
    """Look up a random texture at 133 places, some of them beyond it and on edges, with footprints and biases."""
    rng, is_cube = np.random.default_rng(3), beyond is TexelsBeyond.CUBE
    height, width = (size[1], size[1]) if is_cube else size
    levels = []
    while not levels or (how > TexelFilter.LINEAR and max(height, width) > 1):
        levels.append(rng.random((1, *(6,) * is_cube, height, width, n_channels)))
        height, width = max(1, height // 2), max(1, width // 2)
    n_axes = 3 if is_cube else 2
    uv = rng.normal(size=(1, 7, 19, n_axes))
    uv[0, ::2] = np.sign(uv[0, ::2]) * [1, 1, 0.4][:n_axes] + 0.02 * uv[0, ::2]
    uv[0, 0, :2] = [[np.nan, 0, 1][:n_axes], [1, 1e30, 1][:n_axes]]
    slopes, bias = 0.2 * rng.normal(size=(1, 7, 19, 2 * n_axes)), rng.normal(size=(1, 7, 19))
    where = [uv, slopes, bias] if how > TexelFilter.LINEAR else [uv]
    of_dtype = [one.astype(np.float32).astype(dtype) for one in where]
    return TexelLook([one.astype(np.float32).astype(dtype) for one in levels], how, beyond, *of_dtype, threads=1)


def found(at):
    """Return the texture, the gradients of its levels and those of where it is looked at."""
    out = texels(at)
    g = np.sin(np.arange(out.size, dtype=at.uv.dtype)).reshape(out.shape)
    g[0, 3, 4:9] = 0
    levels, *where = texels_vjp(at, g)
    return [out, *levels, *(one for one in where if one is not None)]


@ON_EACH_ISA
def test_texels_have_the_same_bits_on_each_instruction_set(isa):
    for how, beyond, dtype, n in product(TexelFilter, TexelsBeyond, (np.float32, np.float64), (1, 3, 6)):
        at, both = look(how, beyond, dtype, n), []
        for name in ("scalar", isa):
            with on(name):
                both.append([one.tobytes() for one in found(at)])
        assert both[0] == both[1], (how, beyond, dtype, n)


@pytest.mark.parametrize("beyond", TexelsBeyond)
def test_texels_of_float32_are_those_of_float64(beyond):
    for how, n in product(TexelFilter, (1, 2, 3, 4, 5)):
        of_f32, of_f64 = (found(look(how, beyond, dtype, n)) for dtype in (np.float32, np.float64))
        for one, other in zip(of_f32, of_f64, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-6 * np.abs(other).max())


@pytest.mark.parametrize("beyond", TexelsBeyond)
def test_texels_vjp_is_the_transpose_of_the_lookup(beyond):
    # What a texture gives is linear in its texels: <g, L t> = <L' g, t>.
    for how in TexelFilter:
        at = look(how, beyond)
        out = texels(at)
        g = np.sin(np.arange(out.size, dtype=np.float64)).reshape(out.shape)
        levels = texels_vjp(at, g)[0]
        products = [np.sum(one * own) for one, own in zip(levels, at.levels, strict=True)]
        np.testing.assert_allclose(sum(products), np.sum(out * g), rtol=1e-12)


def test_texels_vjp_without_texels_or_places_leaves_them_out():
    at = look(TexelFilter.LINEAR_MIPMAP_LINEAR, TexelsBeyond.WRAP)
    g = np.ones((1, 7, 19, 3))
    levels, *where = texels_vjp(at, g)
    of_places, of_texels = texels_vjp(at, g, of_levels=False), texels_vjp(at, g, of_places=False)
    assert of_places[0] == []
    assert of_texels[1:] == (None, None, None)
    for one, other in zip([*levels, *where], [*of_texels[0], *of_places[1:]], strict=True):
        np.testing.assert_array_equal(one, other)
