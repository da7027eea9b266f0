"""`topleft.torch` beside float64 loops, beside finite differences, and in programs like the samples of nvdiffrast."""

import math
import re

import numpy as np
import pytest
import tensor_reference as reference

torch = pytest.importorskip("torch")

import topleft.torch as dr  # noqa: E402 (imports torch)
from topleft import scenes  # noqa: E402
from topleft._core.base.arrays import as_frozen  # noqa: E402
from topleft._core.raster import operations  # noqa: E402
from topleft._core.raster.verbs import rasterize as draw  # noqa: E402

CTX = dr.RasterizeContext(threads=1)
F64 = torch.float64
BOUNDARIES = ("wrap", "clamp", "zero")


def matrix(azimuth=0.6, distance=3.5, near=1.0, far=10.0):
    """Clip space from a world that turns about y, seen from a distance."""
    c, s = math.cos(azimuth), math.sin(azimuth)
    turn = np.array([[c, 0, s, 0], [0.2 * s, 1, -0.2 * c, 0], [-s, 0.2, c, -distance], [0, 0, 0, 1]])
    a, b = -(far + near) / (far - near), -2 * far * near / (far - near)
    return np.array([[2.0, 0, 0, 0], [0, 2, 0, 0], [0, 0, a, b], [0, 0, -1, 0]]) @ turn


def in_clip(vertices, **pose):
    return np.column_stack([vertices, np.ones(len(vertices))]) @ matrix(**pose).T


def cube(dtype=F64, **pose):
    """A cube of 8 vertices in clip space (1, 8, 4), and its 12 triangles."""
    vertices = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    tri = [part for a, b, c, d in quads for part in ((a, b, c), (a, c, d))]
    return torch.tensor(in_clip(vertices, **pose), dtype=dtype)[None], torch.tensor(tri, dtype=torch.int32)


def soup(n=12, seed=3):
    """Random triangles in clip space, some behind the eye or cut by the near plane."""
    rng = np.random.default_rng(seed)
    pos = rng.normal(size=(3 * n, 4)) * [1, 1, 0.7, 0.4] + [0, 0, 0, 1]
    return torch.tensor(pos)[None], torch.arange(3 * n, dtype=torch.int32).reshape(n, 3)


def random(*shape, seed=0, dtype=F64):
    return torch.tensor(np.random.default_rng(seed).random(shape), dtype=dtype)


def raises(kind, message):
    return pytest.raises(kind, match=re.escape(message))


# rasterize


@pytest.mark.parametrize("scene", [cube, soup])
def test_rasterize_is_the_loop_over_pixels_and_triangles(scene):
    pos, tri = scene()
    rast, rast_db = dr.rasterize(CTX, pos, tri, (20, 28))
    expected, expected_db, is_close = reference.rasterize(pos[0].numpy(), tri.numpy(), 20, 28)
    same = rast[0, ..., 3].numpy() == expected[..., 3]
    assert (same | is_close).all()
    assert (same & (expected[..., 3] > 0)).sum() > 100
    np.testing.assert_allclose(rast[0].numpy()[same], expected[same], rtol=0, atol=1e-11)
    # Central differences of 1e-4 pixel: their error is that of float64 over the step.
    np.testing.assert_allclose(rast_db[0].numpy()[same], expected_db[same], rtol=1e-6, atol=1e-7)


def test_rasterize_of_float32_is_that_of_float64_within_its_bound():
    pos, tri = cube(torch.float32)
    rast, rast_db = dr.rasterize(CTX, pos, tri, (20, 28))
    exact, exact_db = dr.rasterize(CTX, pos.double(), tri, (20, 28))
    assert rast.dtype == rast_db.dtype == torch.float32
    assert torch.equal(rast[..., 3].double(), exact[..., 3])
    np.testing.assert_allclose(rast[..., :3].numpy(), exact[..., :3].numpy(), rtol=0, atol=2.0**-21)
    # A derivative is a difference of two products, each a few roundings of float32 off.
    np.testing.assert_allclose(rast_db.numpy(), exact_db.numpy(), rtol=0, atol=2.0**-20 * exact_db.abs().max().item())


def test_rasterize_row_0_is_at_the_bottom():
    pos = torch.tensor([[[-1.0, -1, 0, 1], [3, -1, 0, 1], [-1, 0, 0, 1]]])
    rast, _ = dr.rasterize(CTX, pos, torch.tensor([[0, 1, 2]]), (4, 2))
    assert rast[0, :, 0, 3].tolist() == [1, 1, 0, 0]


def test_rasterize_of_several_pictures_is_each_by_itself():
    views = [cube(azimuth=a)[0] for a in (0.1, 0.7)]
    tri = cube()[1]
    both = dr.rasterize(CTX, torch.cat(views), tri, (16, 16))
    for k, view in enumerate(views):
        alone = dr.rasterize(CTX, view, tri, (16, 16))
        assert all(torch.equal(one[k], other[0]) for one, other in zip(both, alone, strict=True))


def test_rasterize_of_ranges_has_ids_of_the_whole_tri():
    pos, tri = cube()
    ranges = torch.tensor([[0, 12], [4, 3], [12, 0]], dtype=torch.int32)
    rast, _ = dr.rasterize(CTX, pos[0], tri, (16, 16), ranges=ranges)
    alone, _ = dr.rasterize(CTX, pos, tri[4:7], (16, 16))
    assert torch.equal(rast[1, ..., 3], torch.where(alone[0, ..., 3] > 0, alone[0, ..., 3] + 4, 0))
    assert torch.equal(rast[0], dr.rasterize(CTX, pos, tri, (16, 16))[0][0])
    assert not rast[2].any()


def test_rasterize_reads_vertices_without_a_copy_and_copies_triangles_once(monkeypatch):
    pos, tri = cube(torch.float32)
    seen = []
    monkeypatch.setattr(
        operations, "draw", lambda v, t, *rest, **more: seen.append((v, t)) or draw(v, t, *rest, **more)
    )
    dr.rasterize(CTX, pos, tri, (8, 8))
    assert seen[0][0].ctypes.data == pos.data_ptr()
    assert as_frozen(seen[0][1]) is seen[0][1]


def test_rasterize_without_derivatives_returns_none_of_them():
    pos, tri = cube()
    _, rast_db = dr.rasterize(dr.RasterizeGLContext(output_db=False), pos, tri, (8, 6))
    assert rast_db.shape == (1, 8, 6, 0)


def test_rasterize_of_nothing_is_zeros():
    pos, tri = cube()
    rast, rast_db = dr.rasterize(CTX, pos, tri[:0], (3, 4))
    assert rast.shape == rast_db.shape == (1, 3, 4, 4)
    assert not rast.any()


@pytest.mark.parametrize("dtype", [torch.float32, F64])
def test_ids_beyond_float32_come_back(dtype):
    n = (1 << 24) + 5
    tri = torch.tensor([[0, 1, 2]], dtype=torch.int32).expand(n, 3)
    corners = torch.tensor([[-1.0, -1, 0, 1], [3, -1, 0, 1], [-1, 3, 0, 1]], dtype=dtype)
    ranges = torch.tensor([[(1 << 24) - 2, 1], [(1 << 24) - 1, 1], [1 << 24, 1], [n - 1, 1]])
    rast, _ = dr.rasterize(CTX, corners, tri, (1, 1), ranges=ranges)
    assert rast[:2, 0, 0, 3].tolist() == [(1 << 24) - 1, 1 << 24]
    out, _ = dr.interpolate(torch.tensor([[0.0], [8], [0]], dtype=F64), rast, tri)  # which reads the ids
    assert out.flatten().tolist() == [2.0] * 4
    with raises(IndexError, f"rast must hold ids of the {n - 1} triangles of tri plus 1, got {n}"):
        dr.interpolate(torch.zeros(3, 1), rast, tri[1:])


def test_peeler_shows_what_is_behind():
    pos, tri = cube()
    with dr.DepthPeeler(CTX, pos, tri, (24, 24)) as peeler:
        layers = [peeler.rasterize_next_layer() for _ in range(6)]
    first = dr.rasterize(CTX, pos, tri, (24, 24))
    assert all(torch.equal(one, other) for one, other in zip(layers[0], first, strict=True))
    front, back = layers[0][0][0], layers[1][0][0]
    both = (front[..., 3] > 0) & (back[..., 3] > 0)
    assert both.sum() > 100
    assert (front[..., 2] < back[..., 2])[both].all()
    assert not layers[5][0].any()


# interpolate


def test_interpolate_is_the_loop():
    pos, tri = cube()
    rast, _ = dr.rasterize(CTX, pos, tri, (20, 28))
    attr = random(8, 5)
    out, out_da = dr.interpolate(attr[None], rast, tri)
    np.testing.assert_allclose(out[0].numpy(), reference.interpolate(attr.numpy(), rast[0].numpy(), tri.numpy()))
    assert out_da.shape == (1, 20, 28, 0)
    assert torch.equal(out, dr.interpolate(attr, rast, tri)[0])


def test_interpolate_has_the_attributes_of_each_picture():
    pos, tri = cube()
    rast, _ = dr.rasterize(CTX, torch.cat([pos, pos]), tri, (12, 12))
    attr = random(2, 8, 3)
    out, _ = dr.interpolate(attr, rast, tri)
    assert torch.equal(out[1], dr.interpolate(attr[1], rast[1:], tri)[0][0])


def test_interpolate_derivatives_are_differences_of_pixels():
    pos, tri = cube()
    rast, rast_db = dr.rasterize(CTX, pos, tri, (20, 28))
    attr = random(8, 3)
    _, some = dr.interpolate(attr, rast, tri, rast_db, diff_attrs=[2, -3])
    _, all_of_them = dr.interpolate(attr, rast, tri, rast_db, diff_attrs="all")
    assert torch.equal(some, all_of_them[..., [4, 5, 0, 1]])
    for i, j in (rast[0, ..., 3] > 0).nonzero().tolist()[::17]:
        row = tri[int(rast[0, i, j, 3]) - 1].numpy()
        x, y = reference.center(i, j, 20, 28)

        def value(x, y, row=row):
            return reference.weights_at(pos[0].numpy()[row], x, y) @ attr.numpy()[row]

        by_x = (value(x + 1e-4 / 28, y) - value(x - 1e-4 / 28, y)) / 1e-4
        by_y = (value(x, y + 1e-4 / 20) - value(x, y - 1e-4 / 20)) / 1e-4
        expected = np.stack([by_x, by_y], 1).ravel()
        np.testing.assert_allclose(all_of_them[0, i, j].numpy(), expected, rtol=1e-6, atol=1e-7)


# texture


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("mode", ["nearest", "linear"])
def test_texture_is_the_loop(mode, boundary):
    tex, uv = random(2, 5, 7, 3), 4 * random(2, 6, 8, 2, seed=1) - 1.5
    out = dr.texture(tex, uv, filter_mode=mode, boundary_mode=boundary)
    one = getattr(reference, mode)
    for b, i, j in np.ndindex(2, 6, 8):
        expected = one(tex[b].numpy(), *uv[b, i, j].tolist(), boundary)
        np.testing.assert_allclose(out[b, i, j].numpy(), expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_texture_of_a_mipmap_is_the_loop(boundary):
    tex, uv = random(1, 8, 16, 2), 3 * random(2, 5, 6, 2, seed=1) - 1
    uv_da = torch.exp2(-8 * random(2, 5, 6, 1, seed=2)) * (random(2, 5, 6, 4, seed=3) - 0.5)
    uv_da[0, 0, 0] = 0
    bias = random(2, 5, 6, seed=4) - 0.5
    out = dr.texture(tex, uv, uv_da, bias, boundary_mode=boundary)
    levels = reference.halvings(tex[0].numpy())
    for place in np.ndindex(2, 5, 6):
        given = *uv[place].tolist(), uv_da[place].numpy(), bias[place].item()
        np.testing.assert_allclose(out[place].numpy(), reference.trilinear(levels, *given, boundary), atol=1e-12)


def test_texture_of_the_nearest_level_is_that_level():
    tex, uv = random(1, 8, 8, 1), random(1, 1, 4, 2, seed=1)
    given = {"mip_level_bias": torch.tensor([[[-1.0, 0.4, 0.6, 9.0]]]), "max_mip_level": 2}
    out = dr.texture(tex, uv, filter_mode="linear-mipmap-nearest", **given)
    levels = reference.halvings(tex[0].numpy())
    expected = [reference.linear(levels[k], *uv[0, 0, j].tolist(), "wrap") for j, k in enumerate((0, 0, 1, 2))]
    np.testing.assert_allclose(out[0, 0].numpy(), expected, atol=1e-12)
    assert torch.equal(dr.texture(tex, uv, **given), dr.texture(tex, uv, filter_mode="linear-mipmap-linear", **given))


def test_texture_takes_levels_that_are_made_before():
    tex, uv, uv_da = random(1, 8, 8, 3), random(1, 4, 4, 2), random(1, 4, 4, 4) / 4
    mip = dr.texture_construct_mip(tex)
    for one, other in zip([tex, *mip], reference.halvings(tex[0].numpy()), strict=True):
        np.testing.assert_allclose(one[0].numpy(), other)
    assert torch.equal(dr.texture(tex, uv, uv_da, mip=mip), dr.texture(tex, uv, uv_da))
    assert torch.equal(
        dr.texture(tex, uv, uv_da, mip=mip, max_mip_level=1), dr.texture(tex, uv, uv_da, max_mip_level=1)
    )


def test_texture_at_no_place_is_that_at_the_origin():
    uv = torch.tensor([[[[math.nan, 0.0], [math.inf, 0], [-math.inf, 0], [1e30, 0]]]])
    for boundary in BOUNDARIES:
        assert torch.isfinite(dr.texture(random(1, 4, 4, 1), uv, boundary_mode=boundary)).all()


# cube maps


#: OpenGL 4.6, table 8.19: of each face the direction to its middle, of its columns and of its rows.
FACES = (("+x", "-z", "-y"), ("-x", "+z", "-y"), ("+y", "+x", "+z"), ("-y", "+x", "-z"), ("+z", "+x", "-y"),
         ("-z", "-x", "-y"))  # fmt: skip


def axis(name):
    return np.eye(3)["xyz".index(name[1])] * (1 if name[0] == "+" else -1)


def on_cube(face, u, v):
    """The point of a cube of half side 1 at (u, v) of a face, which may lie beyond it."""
    middle, along_u, along_v = map(axis, FACES[face])
    return middle + (2 * u - 1) * along_u + (2 * v - 1) * along_v


def to_cube(direction):
    """The face that a direction meets, and u and v there."""
    largest = int(np.argmax(np.abs(direction)))
    face = 2 * largest + int(direction[largest] < 0)
    point = direction / np.abs(direction[largest])
    return face, *((point @ axis(name) + 1) / 2 for name in FACES[face][1:])


def texel_of_cube(tex, face, i, j):
    """A texel, or the nearest one of another face beyond an edge; None beyond a corner."""
    n = tex.shape[1]
    if 0 <= i < n and 0 <= j < n:
        return tex[face, i, j]
    if not (0 <= i < n or 0 <= j < n):
        return None
    wanted = on_cube(face, (j + 0.5) / n, (i + 0.5) / n)
    others = [place for place in np.ndindex(6, n, n) if place[0] != face]
    distances = [np.linalg.norm(on_cube(f, (b + 0.5) / n, (a + 0.5) / n) - wanted) for f, a, b in others]
    return tex[others[int(np.argmin(distances))]]


def linear_on_cube(tex, face, u, v):
    x, y = u * tex.shape[1] - 0.5, v * tex.shape[1] - 0.5
    j, i = math.floor(x), math.floor(y)
    quad = [texel_of_cube(tex, face, i + di, j + dj) for di in (0, 1) for dj in (0, 1)]
    rest = np.mean([one for one in quad if one is not None], axis=0)
    a, b, c, d = (rest if one is None else one for one in quad)
    return (1 - y + i) * ((1 - x + j) * a + (x - j) * b) + (y - i) * ((1 - x + j) * c + (x - j) * d)


def directions(n=200, seed=5):
    """Some to all sides, some next to edges and to corners."""
    found = np.random.default_rng(seed).normal(size=(n, 3))
    found[::4] = np.sign(found[::4]) * [1, 1, 0.3] + 0.02 * found[::4]
    found[1::4] = np.sign(found[1::4]) + 0.05 * found[1::4]
    return found


@pytest.mark.parametrize("n", [1, 2, 5])
@pytest.mark.parametrize("mode", ["nearest", "linear"])
def test_cube_map_is_the_loop(mode, n):
    tex, given = random(2, 6, n, n, 3), directions()
    uv = torch.tensor(given.reshape(2, 10, 10, 3))
    out = dr.texture(tex, uv, filter_mode=mode, boundary_mode="cube").reshape(-1, 3)
    for k, direction in enumerate(given):
        face, u, v = to_cube(direction)
        own = tex[k // 100].numpy()
        near = own[face, min(int(v * n), n - 1), min(int(u * n), n - 1)]
        expected = near if mode == "nearest" else linear_on_cube(own, face, u, v)
        np.testing.assert_allclose(out[k].numpy(), expected, atol=1e-12)


def test_cube_map_with_halvings_is_the_loop():
    tex, given = random(1, 6, 4, 4, 2), directions(60, seed=6)
    by = random(60, 3, 2, seed=7).numpy() - 0.5
    out = dr.texture(tex, torch.tensor(given.reshape(1, 6, 10, 3)), torch.tensor(by.reshape(1, 6, 10, 6)),
                     boundary_mode="cube", max_mip_level=1).reshape(-1, 2)  # fmt: skip
    levels = [tex[0].numpy(), tex[0].numpy().reshape(6, 2, 2, 2, 2, 2).mean(axis=(2, 4))]
    for k, direction in enumerate(given):
        face, u, v = to_cube(direction)
        h = 1e-7
        steps = []
        for axis_of_picture in (0, 1):
            ends = [direction + sign * h * by[k, :, axis_of_picture] for sign in (1, -1)]
            middle, *rest = map(axis, FACES[face])
            (u1, v1), (u0, v0) = ([(one @ side / abs(one @ middle) + 1) / 2 for side in rest] for one in ends)
            steps.append([4 * (u1 - u0) / (2 * h), 4 * (v1 - v0) / (2 * h)])
        longer = np.linalg.svd(np.array(steps), compute_uv=False)[0]
        level = min(max(math.log2(longer), 0), 1)
        one, other = (linear_on_cube(own, face, u, v) for own in levels)
        np.testing.assert_allclose(out[k].numpy(), (1 - level) * one + level * other, atol=1e-6)


def test_cube_map_runs_on_across_edges():
    tex = random(1, 6, 4, 4, 1)
    edge = np.array([[1.0, t, 1.0] for t in np.linspace(-0.99, 0.99, 20)])
    sides = [torch.tensor((edge + [0, 0, shift])[None, None]) for shift in (1e-9, -1e-9)]
    one, other = (dr.texture(tex, side, boundary_mode="cube") for side in sides)
    torch.testing.assert_close(one, other, atol=1e-7, rtol=0)


def test_cube_map_along_no_direction_is_0():
    uv = torch.tensor([[[[0.0, 0, 0], [math.nan, 1, 0], [math.inf, 1, 0]]]], requires_grad=True)
    out = dr.texture(torch.ones(1, 6, 2, 2, 1), uv, boundary_mode="cube")
    assert out.flatten().tolist() == [0, 0, 0]
    out.sum().backward()
    assert not uv.grad.any()


def test_gradients_of_cube_maps():
    tex, uv = (
        random(1, 6, 2, 2, 2).requires_grad_(),
        torch.tensor(directions(6).reshape(1, 2, 3, 3), requires_grad=True),
    )
    uv_da = (random(1, 2, 3, 6, seed=8) - 0.5).requires_grad_()
    assert torch.autograd.gradcheck(lambda *given: dr.texture(*given, boundary_mode="cube"), (tex, uv, uv_da))


# antialias


@pytest.mark.parametrize("azimuth", [0.0, 0.6, 1.3])
def test_antialias_is_the_loop(azimuth):
    pos, tri = cube(azimuth=azimuth)
    rast, _ = dr.rasterize(CTX, pos, tri, (20, 28))
    color = random(1, 20, 28, 3)
    out = dr.antialias(color, rast, pos, tri)
    expected = reference.antialias(color[0].numpy(), rast[0].numpy(), pos[0].numpy(), tri.numpy())
    assert not torch.equal(out, color)
    np.testing.assert_allclose(out[0].numpy(), expected, rtol=0, atol=1e-12)
    again = dr.antialias(color, rast, pos, tri, topology_hash=dr.antialias_construct_topology_hash(tri))
    assert torch.equal(out, again)


@pytest.mark.parametrize("shift", [0.0, 0.1, 0.4, 0.6, 0.9])
@pytest.mark.parametrize("axes", [(0, 1), (1, 0)])
def test_antialias_of_an_upright_edge_is_the_exact_area(shift, axes):
    pos = torch.tensor([[[-2.0, -2, 0, 1], [shift / 4, -2, 0, 1], [shift / 4, 2, 0, 1], [-2, 2, 0, 1]]])
    pos = pos[..., [*axes, 2, 3]]
    tri = torch.tensor([[0, 1, 2], [0, 2, 3]])
    rast, _ = dr.rasterize(CTX, pos, tri, (8, 8))
    picture = dr.antialias((rast[..., 3:] > 0).double(), rast, pos, tri)[0, ..., 0]
    row = picture[3] if axes == (0, 1) else picture[:, 3]
    np.testing.assert_allclose(row.numpy(), [1, 1, 1, 1, shift, 0, 0, 0], atol=1e-6)  # edges are float32


def layers(n=9):
    """Triangles one over the other, each at a depth and a w of its own: none cuts another."""
    rng = np.random.default_rng(5)
    corners = rng.uniform(-0.8, 0.8, (n, 1, 2)) + rng.uniform(-0.9, 0.9, (n, 3, 2))
    w, z = rng.uniform(0.5, 2, (n, 1, 1)) * np.ones((n, 3, 1)), np.linspace(-0.9, 0.9, n)[:, None, None]
    pos = np.concatenate([corners * w, z * w, w], axis=2).reshape(1, -1, 4)
    return torch.tensor(pos), torch.arange(3 * n, dtype=torch.int32).reshape(n, 3)


@pytest.mark.parametrize("scene", [cube, layers])
def test_straight_through_is_the_loop(scene):
    pos, tri = scene()
    pos.requires_grad_()
    rast, _ = dr.rasterize(CTX, pos, tri, (20, 28))
    color, grad = random(1, 20, 28, 3), random(1, 20, 28, 3, seed=1)
    out = dr.antialias(color, rast.detach(), pos, tri, edges="straight-through")
    assert torch.equal(out, color)
    (found,) = torch.autograd.grad(out, pos, grad)
    given = (one[0].detach().numpy() for one in (color, grad, rast, pos))
    expected = reference.straight_through(*given, tri.numpy())
    np.testing.assert_allclose(found[0].numpy(), expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_antialias_leaves_edges_within_a_surface():
    pos, tri = soup(1)
    pos = torch.tensor([[[-1.0, -1, 0, 1], [1, -1, 0, 1], [1, 1, 0, 1], [-1, 1, 0, 1]]])
    tri = torch.tensor([[0, 1, 2], [0, 2, 3]])
    rast, _ = dr.rasterize(CTX, pos, tri, (8, 8))
    color = random(1, 8, 8, 3, dtype=torch.float32)
    assert torch.equal(dr.antialias(color, rast, pos, tri), color)


# gradients, against finite differences


def test_gradients_of_rasterize_and_interpolate():
    pos, tri = cube()
    attr = random(8, 2)

    def run(pos, attr):
        rast, rast_db = dr.rasterize(CTX, pos, tri, (5, 6))
        return dr.interpolate(attr, rast, tri, rast_db, "all")

    assert torch.autograd.gradcheck(run, (pos.requires_grad_(), attr.requires_grad_()))


def test_gradients_of_weights_that_are_clamped():
    """Corners are snapped outwards by 0.0005 px or more, to centres of pixels, where the weights leave [0, 1]."""
    low, high, w = -0.624875, 0.62475, np.array([1, 2, 0.5])
    corners = np.array([[low, low], [high, low], [low, high]])
    quarter = np.array([[0.0, 1], [-1, 0]])
    turns = [np.roll(corners @ np.linalg.matrix_power(quarter, k % 4), k, axis=0) for k in (0, 5, 10)]
    pos = torch.tensor(np.stack([np.c_[w[:, None] * turn, 0.1 * w**2, w] for turn in turns]), requires_grad=True)

    def run(pos):
        return dr.rasterize(CTX, pos, torch.tensor([[0, 1, 2]]), (8, 8))

    u, v, _, number = run(pos)[0].detach().unbind(-1)
    for is_clamped in (u == 0, v == 0, u + v > 1 - 1e-9):
        assert (is_clamped & (number > 0)).sum() > 3
    assert torch.autograd.gradcheck(run, (pos,))


@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_gradients_of_texture(boundary):
    tex, uv, uv_da = random(1, 4, 4, 2), 2 * random(1, 3, 3, 2, seed=1) - 0.5, random(1, 3, 3, 4, seed=2) / 2
    given = [one.requires_grad_() for one in (tex, uv, uv_da)]
    assert torch.autograd.gradcheck(lambda *args: dr.texture(*args, boundary_mode=boundary), given)


def test_gradients_of_antialias():
    pos, tri = cube()
    rast, _ = dr.rasterize(CTX, pos, tri, (7, 7))
    color = random(1, 7, 7, 2)
    given = color.requires_grad_(), pos.requires_grad_()
    assert torch.autograd.gradcheck(lambda color, pos: dr.antialias(color, rast, pos, tri), given)
    once, twice = (
        torch.autograd.grad(dr.antialias(color, rast, pos, tri, pos_gradient_boost=boost)[..., 0].sum(), pos)[0]
        for boost in (1.0, 2.0)
    )
    torch.testing.assert_close(twice, 2 * once)


# programs like the samples of nvdiffrast


def test_sample_earth_is_the_loop():
    vertices, triangles = scenes.icosphere(1)
    uv = torch.tensor(
        np.column_stack([np.arctan2(vertices[:, 0], vertices[:, 2]) / 6.3 + 0.5, vertices[:, 1] / 2 + 0.5])
    )
    pos, tri, tex = torch.tensor(in_clip(vertices))[None], torch.tensor(triangles, dtype=torch.int32), random(16, 32, 3)
    rast, rast_db = dr.rasterize(CTX, pos, tri, resolution=[12, 12])
    texc, texd = dr.interpolate(uv[None], rast, tri, rast_db=rast_db, diff_attrs="all")
    color = dr.texture(tex[None], texc, texd, filter_mode="linear-mipmap-linear", max_mip_level=3)
    color = color * torch.clamp(rast[..., -1:], 0, 1)
    expected = np.zeros((12, 12, 3))
    found, found_db, _ = reference.rasterize(pos[0].numpy(), tri.numpy(), 12, 12)
    at = reference.interpolate(uv.numpy(), found, triangles)
    levels = reference.halvings(tex.numpy())[:4]
    for i, j in zip(*found[..., 3].nonzero(), strict=True):
        a, b, c = uv.numpy()[triangles[int(found[i, j, 3]) - 1]]
        uv_da = np.outer(a - c, found_db[i, j, :2]) + np.outer(b - c, found_db[i, j, 2:])
        expected[i, j] = reference.trilinear(levels, *at[i, j], uv_da, 0, "wrap")
    assert np.array_equal(rast[0, ..., 3].numpy(), found[..., 3])
    np.testing.assert_allclose(color[0].numpy(), expected, atol=1e-6)


# what is refused


POS, TRI = cube(torch.float32)
RAST = torch.zeros((1, 4, 4, 4))
COLOR = torch.zeros((1, 4, 4, 3))
UV = torch.zeros((1, 4, 4, 2))


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda: dr.RasterizeContext("cuda"), ValueError, "device must be 'cpu' or None, got 'cuda'"),
        (lambda: dr.rasterize(None, POS, TRI, (4, 4)), TypeError, "glctx must be a RasterizeContext, got NoneType"),
        (lambda: dr.rasterize(CTX, POS[0], TRI, (4, 4)), ValueError, "pos must have shape (B, V, 4), or (V, 4) with"),
        (lambda: dr.rasterize(CTX, POS.half(), TRI, (4, 4)), TypeError, "pos must be float32 or float64, got"),
        (lambda: dr.rasterize(CTX, POS.numpy(), TRI, (4, 4)), TypeError, "pos must be a torch.Tensor, got ndarray"),
        (lambda: dr.rasterize(CTX, POS.to("meta"), TRI, (4, 4)), TypeError, "pos must be on the CPU, got device"),
        (lambda: dr.rasterize(CTX, POS, TRI.float(), (4, 4)), TypeError, "tri must be int32 or int64, got torch"),
        (lambda: dr.rasterize(CTX, POS, TRI.byte(), (4, 4)), TypeError, "tri must be int32 or int64, got torch.uint8"),
        (lambda: dr.rasterize(CTX, POS, TRI[:, :2], (4, 4)), ValueError, "tri must have shape (T, 3), got (12, 2)"),
        (lambda: dr.rasterize(CTX, POS, TRI + 1, (4, 4)), IndexError, "triangles must hold indices in [0, 8)"),
        (lambda: dr.rasterize(CTX, POS, TRI, 4), TypeError, "resolution must be two integers, got 4"),
        (
            lambda: dr.rasterize(CTX, POS[0], TRI, (4, 4), ranges=torch.tensor([[0, 13]])),
            ValueError,
            "ranges must lie within the 12 triangles, row 0 is [0, 13]",
        ),
        (lambda: dr.interpolate(POS, RAST[..., :3], TRI), ValueError, "rast must have shape (B, H, W, 4), got"),
        (lambda: dr.interpolate(POS[:, :7], RAST, TRI), IndexError, "triangles must hold indices in [0, 7)"),
        (lambda: dr.interpolate(POS, RAST + 13, TRI), IndexError, "rast must hold ids of the 12 triangles of tri plus"),
        (lambda: dr.interpolate(POS, RAST, TRI, diff_attrs="all"), ValueError, "rast_db must have shape (1, 4, 4, 4)"),
        (lambda: dr.interpolate(POS, RAST, TRI, RAST, [4]), IndexError, "diff_attrs must lie in [0, 4)"),
        (lambda: dr.interpolate(POS, RAST, TRI, RAST, "some"), ValueError, "diff_attrs must be 'all', integers or"),
        (lambda: dr.texture(COLOR, UV, boundary_mode="cube"), ValueError, "uv must have shape (B, H, W, 3)"),
        (lambda: dr.texture(COLOR, COLOR, boundary_mode="cube"), ValueError, "tex must have shape (1, 6, N, N, C)"),
        (lambda: dr.texture(COLOR, UV, boundary_mode="mirror"), ValueError, "'wrap', 'clamp', 'zero' or 'cube', got"),
        (lambda: dr.texture(COLOR, UV, filter_mode="cubic"), ValueError, "filter_mode must be 'auto', 'nearest'"),
        (lambda: dr.texture(COLOR, UV, filter_mode="linear-mipmap-linear"), ValueError, "needs uv_da or mip_level"),
        (lambda: dr.texture(COLOR.byte(), UV), TypeError,
         "tex must be float16, bfloat16, float32 or float64, got torch.uint8: pass tex.float() / 255"),
        (lambda: dr.antialias(COLOR, RAST, POS, TRI, edges="all"), ValueError,
         "edges must be 'silhouette', 'area' or 'straight-through', got 'all'"),
        (lambda: dr.interpolate(POS, RAST, TRI - 1), IndexError, "triangles must hold indices in [0, 8)"),
        (lambda: dr.texture(COLOR[0], UV), ValueError, "tex must have shape (1, Ht, Wt, C) or (1, Ht, Wt, C), got"),
        (lambda: dr.texture(COLOR, COLOR), ValueError, "uv must have shape (B, H, W, 2), got (1, 4, 4, 3)"),
        (lambda: dr.texture(COLOR, UV, UV), ValueError, "uv_da must have shape (1, 4, 4, 4), got (1, 4, 4, 2)"),
        (lambda: dr.texture(COLOR, UV, RAST, mip=[COLOR]), ValueError, "mip[0] must have shape (1, 2, 2, 3), got"),
        (
            lambda: dr.texture_construct_mip(torch.zeros(1, 6, 8, 3)),
            ValueError,
            "tex must have sides that halve down to level 2, got (6, 8); max_mip_level=1 stops before",
        ),
        (lambda: dr.texture_construct_mip(COLOR, -1), ValueError, "max_mip_level must be at least 0, got -1"),
        (lambda: dr.texture_construct_mip(COLOR, cube_mode=True), ValueError, "tex must have shape (B, 6, N, N, C)"),
        (lambda: dr.antialias(COLOR, RAST[:, :3], POS, TRI), ValueError, "rast must have shape (1, 4, 4, 4), got"),
        (lambda: dr.antialias(COLOR, RAST, POS, TRI, TRI[1:]), ValueError, "topology_hash must have shape (12, 3)"),
    ],
)  # fmt: skip
def test_wrong_arguments_raise(call, kind, message):
    with raises(kind, message):
        call()


def test_peeler_has_at_most_16_layers():
    peeler = dr.DepthPeeler(CTX, POS, TRI, (2, 2))
    for _ in range(16):
        peeler.rasterize_next_layer()
    with raises(ValueError, "a DepthPeeler has at most 16 layers"):
        peeler.rasterize_next_layer()
