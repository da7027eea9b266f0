"""`topleft.jax` beside `topleft._core.gradients`, in jit, grad and vmap."""

import re

import numpy as np
import pytest

jax = pytest.importorskip("jax")

import jax.numpy as jnp  # noqa: E402 (JAX may be missing)

import topleft.jax as dr  # noqa: E402
from topleft import scenes  # noqa: E402

SIZE = (40, 52)


def sphere(n_pictures=2):
    """Spheres in clip space, and colours."""
    vertices, triangles = scenes.icosphere(2)
    moved = [vertices + [0.1 * k, 0.05, -2.5] for k in range(n_pictures)]
    pos = np.stack([np.column_stack([1.7 * v[:, :2], -1.2 * v[:, 2] - 2, -v[:, 2]]) for v in moved]).astype(np.float32)
    colours = np.random.default_rng(1).random((len(vertices), 3), np.float32)
    return jnp.asarray(pos), jnp.asarray(triangles, jnp.int32), jnp.asarray(colours)


TEX = jnp.asarray(np.random.default_rng(2).random((1, 8, 8, 3), np.float32))


def picture(pos, colours, tex, tri):
    """All of the functions on the way to a picture."""
    rast, rast_db = dr.rasterize(pos, tri, SIZE)
    out, out_da = dr.interpolate(colours, rast, tri, rast_db)
    out = out * dr.texture(tex, out[..., :2]) + 0.1 * out_da[..., :3]
    return dr.antialias(out, rast, pos, tri, edges="area")


def weighted(out):
    return (out * jnp.sin(jnp.arange(out.size, dtype=out.dtype)).reshape(out.shape)).sum()


def number(*given):
    return weighted(picture(*given))


def test_jit_gives_the_same_picture():
    pos, tri, colours = sphere()
    found, expected = jax.jit(picture)(pos, colours, TEX, tri), picture(pos, colours, TEX, tri)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)  # XLA rounds sums of products once


def test_gradients_are_those_of_torch():
    torch = pytest.importorskip("torch")
    from topleft import torch as of_torch

    pos, tri, colours = sphere()
    found = jax.jit(jax.grad(number, argnums=(0, 1, 2)))(pos, colours, TEX, tri)
    given = [torch.tensor(np.asarray(one), requires_grad=True) for one in (pos, colours, TEX)]
    triangles, context = torch.tensor(np.asarray(tri)), of_torch.RasterizeContext()
    rast, rast_db = of_torch.rasterize(context, given[0], triangles, SIZE)
    out, out_da = of_torch.interpolate(given[1], rast, triangles, rast_db, "all")
    out = out * of_torch.texture(given[2], out[..., :2]) + 0.1 * out_da[..., :3]
    out = of_torch.antialias(out, rast, given[0], triangles, edges="area")
    weights = torch.tensor(np.asarray(jnp.sin(jnp.arange(out.numel(), dtype=jnp.float32)))).reshape(out.shape)
    expected = torch.autograd.grad((out * weights).sum(), given)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other.numpy(), rtol=1e-4, atol=1e-4 * np.abs(other.numpy()).max())


@pytest.mark.parametrize("mode", ["linear-mipmap-nearest", "linear-mipmap-linear"])
@pytest.mark.parametrize("given", [("uv_da", "mip_level_bias"), ("uv_da",), ("mip_level_bias",)])
def test_mipmaps_and_their_gradients_are_those_of_torch(mode, given):
    torch = pytest.importorskip("torch")
    from topleft import torch as of_torch

    rng = np.random.default_rng(4)
    where = {"uv_da": rng.random((1, 5, 7, 4), np.float32) - 0.5, "mip_level_bias": rng.random((1, 5, 7), np.float32)}
    uv, how = rng.random((1, 5, 7, 2), np.float32), {"filter_mode": mode, "boundary_mode": "clamp", "max_mip_level": 2}

    def run(texture, tex, uv, *more):
        return texture(tex, uv, **dict(zip(given, more, strict=True)), **how)

    arrays = np.asarray(TEX), uv, *(where[name] for name in given)
    found, pull = jax.vjp(lambda *a: run(dr.texture, *a), *map(jnp.asarray, arrays))
    tensors = [torch.tensor(one, requires_grad=True) for one in arrays]
    expected = run(of_torch.texture, *tensors)
    np.testing.assert_allclose(found, expected.detach().numpy(), rtol=1e-6)
    weights = rng.random(found.shape, np.float32)
    of_torch_too = torch.autograd.grad((expected * torch.tensor(weights)).sum(), tensors)
    for one, other in zip(pull(jnp.asarray(weights)), of_torch_too, strict=True):
        np.testing.assert_allclose(one, other.numpy(), rtol=1e-5, atol=1e-6)


def test_vmap_is_one_sample_after_the_other():
    pos, tri, colours = sphere(3)
    of_one = jax.jit(jax.grad(lambda p: number(p[None], colours, TEX, tri)))
    for found, one in zip(jax.vmap(of_one)(pos), pos, strict=True):
        np.testing.assert_allclose(found, of_one(one), rtol=1e-5, atol=1e-6)  # XLA rounds sums of products once


def in_parts(pos, tri, colours, edges):
    rast, _ = dr.rasterize(pos, tri, SIZE)
    return dr.antialias(dr.interpolate(colours, rast, tri)[0], rast, pos, tri, edges=edges)


@pytest.mark.parametrize("edges", ["area", "silhouette", "straight-through"])
def test_render_and_its_gradients_are_those_of_the_functions_one_after_the_other(edges):
    pos, tri, colours = sphere()
    np.testing.assert_allclose(
        dr.render(pos, tri, colours, SIZE, edges=edges), in_parts(pos, tri, colours, edges), atol=1e-6
    )
    found = jax.grad(lambda p, c: weighted(dr.render(p, tri, c, SIZE, edges=edges)), (0, 1))(pos, colours)
    expected = jax.grad(lambda p, c: weighted(in_parts(p, tri, c, edges)), (0, 1))(pos, colours)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6 * np.abs(other).max())


def test_render_has_the_bits_of_torch_in_jit_and_vmap():
    torch = pytest.importorskip("torch")
    from topleft import torch as of_torch

    pos, tri, colours = sphere(3)
    weights = jnp.asarray(np.random.default_rng(3).random((3, *SIZE, 3), np.float32))
    given = [torch.tensor(np.asarray(one), requires_grad=True) for one in (pos, colours)]
    expected = of_torch.render(of_torch.RasterizeContext(), given[0], torch.tensor(np.asarray(tri)), given[1], SIZE)
    expected.backward(torch.tensor(np.asarray(weights)))
    out, pull = jax.vjp(jax.jit(lambda p, c: dr.render(p, tri, c, SIZE)), pos, colours)
    for one, other in zip((out, *pull(weights)), (expected, *(one.grad for one in given)), strict=True):
        np.testing.assert_array_equal(one, other.detach().numpy())
    by_sample = jax.vmap(lambda p, w: jax.vjp(lambda q: dr.render(q[None], tri, colours, SIZE)[0], p)[1](w)[0])
    np.testing.assert_array_equal(by_sample(pos, weights), given[0].grad.numpy())


def test_render_of_no_picture_has_none():
    pos, tri, colours = sphere()
    assert dr.render(pos[:0], tri, colours, SIZE).shape == (0, *SIZE, 3)


def test_attributes_without_derivatives_have_no_columns():
    pos, tri, colours = sphere(1)
    rast, _ = dr.rasterize(pos, tri, SIZE)
    out, out_da = dr.interpolate(colours, rast, tri)
    assert (out.shape, out_da.shape) == ((1, *SIZE, 3), (1, *SIZE, 0))
    g = jax.grad(lambda c: dr.interpolate(c, rast, tri)[0].sum())(colours)
    np.testing.assert_allclose(g.sum(), 3 * (rast[..., 3] > 0).sum(), rtol=1e-5)


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda pos, tri, c: dr.rasterize(pos[0], tri, SIZE), ValueError, "pos must have shape (B, V, 4), got"),
        (lambda pos, tri, c: dr.rasterize(pos.astype(int), tri, SIZE), TypeError, "pos must be float32 or float64"),
        (lambda pos, tri, c: dr.interpolate(c, pos, tri), ValueError, "rast must have shape (B, H, W, 4), got"),
        (lambda pos, tri, c: dr.texture(c, pos), ValueError, "uv must have shape (B, H, W, 2), got"),
        (lambda pos, tri, c: dr.texture(c, pos, "cubic"), ValueError,
         "filter_mode must be 'nearest', 'linear', 'linear-m"),
        (lambda pos, tri, c: dr.texture(c, pos, boundary_mode="a"), ValueError,
         "boundary_mode must be 'wrap', 'clamp'"),
        (lambda pos, tri, c: dr.texture(TEX, jnp.zeros((1, 2, 2, 2)), "linear-mipmap-linear"), ValueError,
         "filter_mode='linear-mipmap-linear' needs uv_da or mip_level_bias"),
        (lambda pos, tri, c: dr.texture(TEX, jnp.zeros((1, 2, 2, 2)), uv_da=jnp.zeros((1, 2, 2, 2))), ValueError,
         "uv_da must have shape (1, 2, 2, 4), got"),
        (lambda pos, tri, c: dr.halvings(TEX, -1), ValueError, "max_mip_level must be at least 0, got -1"),
        (lambda pos, tri, c: dr.halvings(TEX[:, :6], None), ValueError,
         "halve down to level 2, got (6, 8); max_mip_le"),
        (lambda pos, tri, c: dr.render(pos[0], tri, c, SIZE), ValueError, "pos must have shape (B, V, 4), got"),
        (lambda pos, tri, c: dr.render(pos, tri, c[None, None], SIZE), ValueError,
         "attr must have shape (V, K), (1, V, K) or (1, V, K), got"),
        (lambda pos, tri, c: dr.render(pos, tri, c, SIZE, edges="a"), ValueError, "edges must be 'silhouette', 'area'"),
        (lambda pos, tri, c: dr.antialias(c, pos, pos, tri), ValueError, "color must have shape (B, H, W, C), got"),
    ],
)  # fmt: skip
def test_wrong_arguments_raise(call, kind, message):
    with pytest.raises(kind, match=re.escape(message)):
        call(*sphere(1))


def test_dir_shows_public_names_alone():
    assert dir(dr) == sorted(dr.__all__)
