"""Cases of `changing.py` whose arrays hold indices for gradients and grids: NumPy's, PyTorch's and JAX's.

Tensors of PyTorch and arrays of JAX share the memory that another process writes to.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from changing_arrays import Changing
from draws import REFUSALS

import topleft as tl
from topleft._core.base.arrays import as_checked_triangles
from topleft._core.gradients import tensors
from topleft._core.gradients.pictures import AttributePictures
from topleft._core.gradients.tensors import EdgeRule, PixelGrid, TexelFilter, TexelLook, TexelsBeyond

Case = tuple[str, Callable[[], Any]]

#: What PyTorch raises for a tensor that it refuses.
TENSOR_REFUSALS = (*REFUSALS, RuntimeError)


def attempts(*calls: Callable[[], Any]) -> None:
    """Make some calls, each whatever becomes of the others."""
    for call in calls:
        with suppress(*TENSOR_REFUSALS):
            call()


class Picture:
    """A mesh in clip space with attributes and a texture, and what its pixels show: arrays that change."""

    def __init__(self, changing: Changing) -> None:
        draw, rng = changing.draw, changing.rng
        self.b, self.h, self.w = draw.of([1, 2]), draw.source.integer(1, 40), draw.of([1, 9, 30, 60, 300])
        n, self.k, self.dtype = draw.of([40, 1, 3, 400, 5000]), draw.of([3, 1, 4, 5]), draw.of(["f4", "f8"])
        self.n = n
        groups = rng.integers(0, n, (n, 1))
        tri = (4 * groups + rng.permuted(np.tile(np.arange(4), (n, 1)), axis=1)[:, :3]).astype(np.int32)
        pos = np.repeat(rng.uniform(-1, 1, (self.b, n, 4)), 4, axis=1)
        pos += rng.normal(0, draw.of([0.5, 0.1, 0.02]), pos.shape)
        pos[..., 3] = 1 + rng.uniform(-0.2, 0.4, pos.shape[:2])
        self.pos = changing.share("pos", pos.astype(self.dtype))
        self.tri = changing.share("tri", tri.astype(draw.of(["i4", "i4", "i8"])), 4 * n)
        self.ranges = changing.share("ranges", np.array([[n // 2, n - n // 2], [0, n]], draw.of(["i4", "i8"])), n)
        self.across = changing.share("across", tensors.find_halves_across(tri), 3 * n)
        self.attr = changing.numbers("attr", (draw.of([1, self.b]), 4 * n, self.k), 0, 1, self.dtype)
        ids = np.stack([tl.rasterize(one, tri, (self.w, self.h)).triangle for one in pos])
        self.ids = changing.share("ids", ids, n)
        grid = PixelGrid(tri, self.b, self.h, self.w)
        drawn = tensors.points(grid, pos.astype(self.dtype), [(one, 0) for one in ids], is_flipped=True, with_db=True)
        self.rast, self.rast_db = (changing.share(name, one) for name, one in zip(("rast", "db"), drawn, strict=True))
        self.color, self.g_out = (self.of_pixels(changing, name, self.k) for name in ("color", "g_out"))
        self.g_rast = self.of_pixels(changing, "g_rast", 4)
        self.is_cube = draw.chance(3)
        texels = (6, 8, 8, self.k) if self.is_cube else (16, 8, self.k)
        self.levels = []
        while len(self.levels) < 3:
            self.levels.append(changing.numbers("tex", (1, *texels), 0, 1, self.dtype))
            texels = (*texels[:-3], texels[-3] // 2, texels[-2] // 2, self.k)
        n_axes = 3 if self.is_cube else 2
        self.uv, self.uv_da = self.of_pixels(changing, "uv", n_axes), self.of_pixels(changing, "uv_da", 2 * n_axes)
        self.edges = draw.of(["area", "silhouette", "straight-through"])
        self.filter = draw.of(list(TexelFilter))
        self.beyond = TexelsBeyond.CUBE if self.is_cube else draw.of(list(TexelsBeyond)[:3])
        self.threads = draw.of([1, 2, 3])

    def of_pixels(self, changing: Changing, name: str, n: int) -> np.ndarray:
        """Numbers of pixels."""
        return changing.numbers(name, (self.b, self.h, self.w, n), -1, 1, self.dtype)

    def __str__(self) -> str:
        return f"{self.b}x{self.h}x{self.w} of {self.n} {self.edges} {self.filter.name} {self.beyond.name}"


def gradients(changing: Changing) -> Case:
    """The kernels behind tensors, with triangles that were checked once."""
    p = Picture(changing)
    rule = EdgeRule[p.edges.replace("-", "_").upper()]
    wanted = range(p.k)

    def call() -> None:
        grid = PixelGrid(as_checked_triangles(p.tri, p.pos.shape[1]), p.b, p.h, p.w, p.threads)
        g_da = np.concatenate([p.color, p.color], -1)
        look = TexelLook(p.levels, p.filter, p.beyond, p.uv, p.uv_da, None, p.threads)
        own = AttributePictures(grid, rule, p.across, p.pos, p.ids.copy(), p.attr)
        attempts(
            lambda: tensors.points(grid, p.pos, [(one, 0) for one in p.ids], is_flipped=True, with_db=True),
            lambda: tensors.points_vjp(grid, p.pos, p.rast, p.g_rast, p.rast_db),
            lambda: tensors.values(grid, p.attr, p.rast, p.rast_db, wanted),
            lambda: tensors.values_vjp(grid, p.attr, p.rast, p.g_out, p.rast_db, g_da, wanted),
            lambda: tensors.texels(look),
            lambda: tensors.texels_vjp(look, p.g_out),
            lambda: tensors.halves_across(p.tri.astype(np.int32)),
            lambda: smooth(grid, rule, p),
            lambda: own.squares(p.color),
            lambda: own.vjp(p.g_out, own.unpack(own.pack(own.picture()[1]))),
        )

    return f"gradients {p}", call


def smooth(grid: PixelGrid, rule: EdgeRule, p: Picture) -> None:
    """Smooth silhouettes, and backward by an outline that was found before."""
    outline = tensors.outline_of(grid, p.pos, p.across)
    tensors.smooth(grid, rule, outline, p.pos, p.rast, p.color)
    tensors.smooth_vjp(grid, rule, outline, p.pos, p.rast, p.color, p.g_out)


def backward(changing: Changing) -> Case:
    """Gradients of `Fragments`, and of areas."""
    draw, rng = changing.draw, changing.rng
    w, h = draw.source.integer(1, 60), draw.source.integer(1, 40)
    n = draw.of([40, 1, 400])
    vertices = changing.share("vertices", rng.uniform(-5, 60, (3 * n, 3)).astype(draw.of(["f8", "f4"])))
    triangles = changing.share("triangles", np.arange(3 * n).reshape(n, 3).astype(draw.of(["i4", "i8"])), 3 * n)
    values, uv = changing.numbers("values", (3 * n, 3), 0, 1, "f8 f4"), changing.numbers("uv", (3 * n, 2), 0, 1, "f8")
    picture, grad = (changing.numbers(name, (h, w, 3), -1, 1, "f8") for name in ("picture", "grad"))
    texture, colors = changing.numbers("texture", (5, 7, 3), 0, 1, "f8"), changing.numbers("colors", (n, 3), 0, 1, "f8")
    edges = draw.of(["area", "silhouette", "straight-through"])

    def call() -> None:
        frags = tl.rasterize(vertices, triangles, (w, h))
        attempts(
            lambda: frags.interpolate_vjp(values, grad),
            lambda: frags.sample_vjp(texture, uv, grad, filter="trilinear"),
            lambda: frags.barycentric_vjp(grad),
            lambda: frags.depth_vjp(grad[..., 0]),
            lambda: frags.antialias(picture, edges=edges),
            lambda: frags.antialias_vjp(picture, grad, edges=edges),
            lambda: tl.area_vjp(vertices, triangles, (w, h), grad, colors=colors),
        )

    return f"backward {w}x{h} {edges}", call


def grids(changing: Changing) -> Case:
    """Voxels and atlases."""
    draw, rng = changing.draw, changing.rng
    n = draw.of([12, 1, 200])
    vertices = changing.share("vertices", rng.uniform(0, 1, (3 * n, 3)).astype(draw.of(["f8", "f4"])))
    triangles = changing.share("triangles", np.arange(3 * n).reshape(n, 3).astype(draw.of(["i4", "i8"])), 3 * n)
    uv, values = changing.numbers("uv", (3 * n, 2), 0, 1, "f4 f8"), changing.numbers("values", (3 * n, 2), 0, 1)
    picture = changing.numbers("picture", (20, 30, 3), 0, 255, "u1")
    rule = draw.of(["center", "touched", "area"])
    camera = tl.Camera.look_at((4, 3, 2), (0.5, 0.5, 0.5))

    def call() -> None:
        mesh = tl.Mesh(vertices, triangles, uv=uv)
        attempts(
            lambda: tl.voxelize(mesh, 12, solid=draw.chance(2), rule="touched" if rule == "touched" else "center"),
            lambda: tl.bake(mesh, values, (33, 20), rule=rule, gutter=3),
            lambda: tl.bake(mesh, [picture], 24, rule=rule, cameras=[camera]),
        )

    return f"grids {n} {rule}", call


def torch_tensors(changing: Changing) -> Case:
    """Each function of `topleft.torch`, forward and backward."""
    import torch

    import topleft.torch as dr

    p, context = Picture(changing), dr.RasterizeContext()
    names = ("pos", "tri", "ranges", "across", "attr", "rast", "rast_db", "color", "uv", "uv_da")
    arrays = [torch.from_numpy(getattr(p, name)) for name in names]
    pos, tri, ranges, across, attr, rast, rast_db, color, uv, uv_da = arrays
    tex, *mip = map(torch.from_numpy, p.levels)
    size, is_hashed = (p.h, p.w), changing.draw.chance(2)
    modes: Any = {"filter_mode": p.filter.name.lower().replace("_", "-"), "boundary_mode": p.beyond.name.lower()}
    drawn: Any = {"topology_hash": across if is_hashed else None, "edges": p.edges}

    def back(function: Callable[..., Any], *given: torch.Tensor) -> None:
        """Compute a result of tensors that want gradients, in the memory that changes, and the gradients."""
        leaves = [one.detach().requires_grad_() for one in given]
        found = function(*leaves)
        parts = [one for one in (found if isinstance(found, tuple) else (found,)) if one.requires_grad]
        torch.autograd.grad(sum(one.square().sum() for one in parts), leaves, allow_unused=True)

    def call() -> None:
        attempts(
            lambda: back(lambda v: dr.rasterize(context, v, tri, size), pos),
            lambda: back(lambda v: dr.DepthPeeler(context, v, tri, size).rasterize_next_layer(), pos),
            lambda: back(lambda v: dr.DepthPeeler(context, v, tri, size, ranges).rasterize_next_layer(), pos[0]),
            lambda: back(lambda v: dr.rasterize(context, v, tri, size, ranges), pos[0]),
            lambda: back(lambda a, r, d: dr.interpolate(a, r, tri, d, "all"), attr, rast, rast_db),
            lambda: back(lambda t, at, da: dr.texture(t, at, da, None, mip, **modes), tex, uv, uv_da),
            lambda: back(lambda c, v: dr.antialias(c, rast, v, tri, **drawn), color, pos),
            lambda: back(lambda v, a: dr.render(context, v, tri, a, size, **drawn), pos, attr),
            lambda: back(lambda v, a: dr.photometric_loss(context, v, tri, a, color, **drawn), pos, attr),
            lambda: dr.antialias_construct_topology_hash(tri),
        )

    return f"torch {p} {'hash' * is_hashed}", call


def jax_arrays(changing: Changing) -> Case:
    """Each function of `topleft.jax`, forward and backward."""
    import jax

    import topleft.jax as dj

    jax.config.update("jax_enable_x64", True)
    p = Picture(changing)
    names = ("pos", "tri", "attr", "rast", "rast_db", "color", "uv", "uv_da")
    pos, tri, attr, rast, rast_db, color, uv, uv_da = (jax.numpy.from_dlpack(getattr(p, name)) for name in names)
    tex = jax.numpy.from_dlpack(p.levels[0])
    modes: Any = {"filter_mode": p.filter.name.lower().replace("_", "-"), "boundary_mode": p.beyond.name.lower()}

    def back(function: Callable[..., Any], *given: Any) -> None:
        """Compute a result and its gradients."""
        found, vjp = jax.vjp(function, *given)
        jax.block_until_ready(vjp(found))

    def call() -> None:
        attempts(
            lambda: back(lambda v: dj.rasterize(v, tri, (p.h, p.w)), pos),
            lambda: back(lambda a, r, d: dj.interpolate(a, r, tri, d), attr, rast, rast_db),
            lambda: back(lambda t, at, da: dj.texture(t, at, uv_da=da, **modes), tex, uv, uv_da),
            lambda: back(lambda c, v: dj.antialias(c, rast, v, tri, edges=p.edges), color, pos),
            lambda: back(lambda v, a: dj.render(v, tri, a, (p.h, p.w), edges=p.edges), pos, attr),
        )

    return f"jax {p}", call
