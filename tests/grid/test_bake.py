"""Atlases against the values that meshes have at the middles of texels, against exact areas, and against pictures."""

from dataclasses import replace

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on

import topleft as tl

SIZE = (37, 29)


def sheet(rng, n=6):
    """A wavy square whose texture coordinates are its x and y, and its values a plane: u + 2 v, 3 u - v."""
    t = np.linspace(0.1, 0.9, n)
    u, v = (grid.reshape(-1) for grid in np.meshgrid(t, t))
    inner, move = (np.minimum(u, v) > 0.101) & (np.maximum(u, v) < 0.899), 0.2 * (t[1] - t[0])
    u, v = u + inner * rng.uniform(-move, move, u.shape), v + inner * rng.uniform(-move, move, v.shape)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1)
    triangles = np.concatenate([np.stack([i, i + 1, i + n + 1], 1), np.stack([i, i + n + 1, i + n], 1)])
    mesh = tl.Mesh(np.stack([u, v, 0.1 * np.sin(7 * u)], 1), triangles, uv=np.stack([u, v], 1))
    return mesh, np.stack([u + 2 * v, 3 * u - v], 1).astype(np.float32)


def middles(size):
    """u and v of the middles of texels, (H, W) each."""
    width, height = size
    return np.meshgrid((np.arange(width) + 0.5) / width, 1 - (np.arange(height) + 0.5) / height)


@ON_EACH_ISA
@pytest.mark.parametrize("rule", ["center", "touched", "area"])
def test_linear_values_are_those_of_the_plane(isa, rule):
    rng = np.random.default_rng(1)
    mesh, values = sheet(rng)
    u, v = middles(SIZE)
    with on(isa):
        baked = tl.bake(mesh, values, SIZE, rule=rule, gutter=0)
        assert_same(tl.bake(mesh, values[mesh.triangles], SIZE, rule=rule, gutter=0).values, baked.values)
        assert_same(tl.bake(mesh, values, SIZE, rule=rule, gutter=0, threads=3).values, baked.values)
    is_inner = (u > 0.13) & (u < 0.87) & (v > 0.14) & (v < 0.86)
    assert baked.mask[is_inner].all()
    expected = np.stack([u + 2 * v, 3 * u - v], axis=2)
    np.testing.assert_allclose(baked.values[is_inner], expected[is_inner], atol=2e-6)
    assert (baked.values[~baked.mask] == 0).all()


def test_every_texel_whose_middle_lies_in_a_chart_is_owned_once():
    mesh, _ = sheet(np.random.default_rng(2))
    baked = tl.bake(mesh, "triangle", SIZE, gutter=0)
    width, height = SIZE
    points = np.stack([mesh.uv[:, 0] * width, (1 - mesh.uv[:, 1]) * height], axis=1)
    assert_same(baked.triangle, tl.rasterize(points, mesh.triangles, SIZE, subpixel_bits="exact").triangle)
    assert (tl.overdraw(points, mesh.triangles, SIZE, subpixel_bits="exact")[baked.mask] == 1).all()


def shares(points, triangles, size):
    """The area that each triangle covers of each texel, (T, H, W)."""
    return np.stack([tl.coverage(points, [one], size, sampling="area", subpixel_bits=16) for one in triangles])


def test_area_means_are_weighed_by_the_area_that_triangles_cover():
    """Constant values of triangles, smaller than a texel and larger."""
    mesh, _ = sheet(np.random.default_rng(3), n=5)
    size = (9, 7)
    points = np.stack([mesh.uv[:, 0] * size[0], (1 - mesh.uv[:, 1]) * size[1]], axis=1)
    values = np.random.default_rng(4).uniform(size=len(mesh.triangles)).astype(np.float32)
    baked = tl.bake(mesh, np.repeat(values[:, None, None], 3, axis=1), size, rule="area", gutter=0)
    area = shares(points, mesh.triangles, size)
    total = area.sum(axis=0)
    assert_same(baked.mask, total > 0)
    expected = np.einsum("thw,t->hw", area, values) / np.where(total > 0, total, 1)
    clear = total > 0.01  # coverage snaps to 2**-16 texel
    np.testing.assert_allclose(baked.values[..., 0][clear], expected[clear], atol=2e-3)
    assert (area[baked.triangle[clear], *np.nonzero(clear)] >= area.max(axis=0)[clear] - 1e-3).all()


def test_touched_texels_are_those_that_triangles_meet():
    mesh, values = sheet(np.random.default_rng(5), n=20)
    is_kept = np.random.default_rng(6).uniform(size=len(mesh.triangles)) < 0.4
    small = replace(mesh, triangles=mesh.triangles[is_kept], uv=mesh.uv * 0.6)
    baked = tl.bake(small, values, (16, 16), rule="touched", gutter=0)
    points = np.stack([small.uv[:, 0] * 16, (1 - small.uv[:, 1]) * 16], axis=1)
    met = tl.coverage(points, small.triangles, (16, 16), sampling="outer", subpixel_bits="exact")
    assert_same(baked.mask, met)
    owned = tl.bake(small, values, (16, 16), gutter=0)
    assert_same(baked.values[owned.mask], owned.values[owned.mask])
    assert baked.mask.sum() > owned.mask.sum()


def test_sliver_between_middles_has_the_value_of_its_nearest_point():
    sliver = tl.Mesh([[0, 0, 0], [4, 0, 0], [4, 0.1, 0]], [[0, 1, 2]], uv=[[0, 0.7], [1, 0.7], [1, 0.72]])
    assert not tl.bake(sliver, "position", 4, gutter=0).mask.any()
    baked = tl.bake(sliver, "position", 4, rule="touched", gutter=0)
    assert baked.mask.tolist() == [[False] * 4, [True] * 4, [False] * 4, [False] * 4]
    np.testing.assert_allclose(baked.values[1, :, 0], [0.5, 1.5, 2.5, 3.5], atol=0.02)


def test_touched_texels_have_the_values_at_the_nearest_points():
    corners = np.random.default_rng(8).uniform(1, 15, (3, 3, 2))
    uv = np.stack([corners[..., 0], 16 - corners[..., 1]], -1).reshape(9, 2) / 16
    mesh = tl.Mesh(np.pad(corners.reshape(9, 2), [(0, 0), (0, 1)]), np.arange(9).reshape(3, 3), uv=uv)
    with pytest.warns(tl.MeshWarning, match="overlap"):
        baked, inside = (tl.bake(mesh, "position", 16, rule=rule, gutter=0) for rule in ("touched", "center"))
    for y, x in np.argwhere(baked.mask & ~inside.mask).tolist():
        a, middle = corners[baked.triangle[y, x]], (x + 0.5, y + 0.5)
        along = np.roll(a, -1, 0) - a
        share = np.clip(((middle - a) * along).sum(1) / (along * along).sum(1), 0, 1)
        points = a + share[:, None] * along
        nearest = points[np.argmin(((points - middle) ** 2).sum(1))]
        np.testing.assert_allclose(baked.values[y, x, :2], nearest, atol=1e-5)


@ON_EACH_ISA
@pytest.mark.parametrize("gutter", [1, 3, 8, 40])
def test_gutter_has_what_the_nearest_texel_has(isa, gutter):
    rng = np.random.default_rng(gutter)
    mesh, _ = sheet(rng)
    mesh = replace(mesh, triangles=mesh.triangles[rng.uniform(size=len(mesh.triangles)) < 0.3])
    size = (70, 33)
    with on(isa):
        bare, full = (tl.bake(mesh, "triangle", size, gutter=g) for g in (0, gutter))
        assert_same(tl.bake(mesh, "triangle", size, gutter=gutter, threads=3).values, full.values)
    assert_same(full.mask, bare.mask)
    at = np.argwhere(bare.mask)
    for y, x in np.argwhere(~bare.mask).tolist():
        squared = ((at - (y, x)) ** 2).sum(axis=1)
        nearest = {int(bare.values[tuple(one)]) for one in at[squared == squared.min()]}
        assert int(full.values[y, x]) in (nearest if squared.min() <= gutter * gutter else {-1})


def test_normals_are_unit_and_those_of_the_mesh():
    mesh, _ = sheet(np.random.default_rng(6))
    baked = tl.bake(mesh, "normal", SIZE, gutter=0)
    np.testing.assert_allclose(np.linalg.norm(baked.values[baked.mask], axis=1), 1, atol=1e-6)
    flat = replace(mesh, crease=0.0)
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    faces /= np.linalg.norm(faces, axis=1)[:, None]
    baked = tl.bake(flat, "normal", SIZE, gutter=0)
    np.testing.assert_allclose(baked.values[baked.mask], faces[baked.triangle[baked.mask]], atol=1e-6)


def test_colors_are_those_of_the_vertices():
    mesh, _ = sheet(np.random.default_rng(7))
    colored = replace(mesh, colors=np.full((len(mesh.vertices), 3), [250, 10, 90], np.uint8))
    baked = tl.bake(colored, "color", SIZE, gutter=0)
    assert (baked.values[baked.mask] == [250, 10, 90]).all()
    with pytest.raises(tl.MeshError, match="'color' needs a mesh whose vertices have colours"):
        tl.bake(mesh, "color", SIZE)


def test_source_gives_the_values_of_its_nearest_points():
    """A plane above a plane: straight up, where it is."""
    low = tl.Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
                  uv=[[0, 0], [1, 0], [1, 1], [0, 1]])  # fmt: skip
    high = tl.Mesh([[0, 0, 0.25], [0.5, 0, 0.25], [0.5, 1, 0.25], [0, 1, 0.25]], [[0, 1, 2], [0, 2, 3]])
    baked = tl.bake(low, "position", 8, source=high, max_distance=0.3, gutter=0)
    assert baked.mask[:, :4].all()
    np.testing.assert_allclose(baked.values[:, 1], np.stack([np.full(8, 0.1875), 1 - (np.arange(8) + 0.5) / 8,
                                                             np.full(8, 0.25)], 1), atol=1e-6)  # fmt: skip
    distance = np.hypot((np.arange(8) + 0.5) / 8 - 0.5, 0.25)[4:]
    assert_same(baked.mask[:, 4:], np.tile(distance <= 0.3, (8, 1)))
    ids = tl.bake(low, "triangle", 8, source=high, gutter=0)
    assert (ids.values == 0).any()
    assert ids.mask.all()
    assert (ids.values >= 0).all()
    slopes = tl.Mesh(high.vertices + [[0, 0, 0], [0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]], high.triangles)
    normals = tl.bake(low, "tangent_normal", 8, source=slopes, gutter=0).values
    np.testing.assert_allclose(normals[3, 1], np.array([-1, 0, 1]) / np.sqrt(2), atol=1e-5)
    turned = replace(low, uv=low.uv[:, ::-1])  # u along y: the same normal lies along v
    normals = tl.bake(turned, "tangent_normal", 8, source=slopes, gutter=0).values
    np.testing.assert_allclose(normals[6, 3], np.array([0, -1, 1]) / np.sqrt(2), atol=1e-5)


@pytest.mark.parametrize("far", [3.0, 3e7])
def test_source_of_equally_near_triangles_gives_the_first_with_any_number_of_threads(far):
    """Above the sides of a cube each point is as near to two triangles, or to six; threads begin elsewhere."""
    cube = tl.Mesh(*tl.scenes.cube())
    corners = far * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    square = tl.Mesh(corners, [[0, 1, 2], [0, 2, 3]], uv=[[0, 0], [1, 0], [1, 1], [0, 1]])
    one, *others = (
        tl.bake(square, "triangle", 24, source=cube, gutter=0, threads=n).values for n in (1, 2, 3, 5, 7, 24)
    )
    for other in others:
        assert_same(other, one)


@ON_EACH_ISA
def test_pictures_come_back_where_cameras_see_the_mesh(isa):
    """A ball with a texture, taken from eight sides, gets it back; what the sides do not see stays empty."""
    n = 24
    theta, phi = np.meshgrid(np.linspace(0.02, np.pi - 0.02, n), np.linspace(0, 2 * np.pi, n), indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], -1).reshape(-1, 3)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1)
    triangles = np.concatenate([np.stack([i, i + 1, i + n + 1], 1), np.stack([i, i + n + 1, i + n], 1)])
    uv = np.stack([0.02 + 0.96 * phi / (2 * np.pi), 1 - theta / np.pi], -1).reshape(-1, 2)
    x, y = np.meshgrid(np.arange(64), np.arange(64))
    image = np.stack([np.full_like(x, 90), 60 + 2 * x, 60 + 2 * y], 2).astype(np.uint8)
    ball = tl.Mesh(points, triangles, uv=uv, materials=[tl.Material(texture=tl.Texture(image, filter="bilinear"))])
    cameras = tl.viewpoints(ball, 8)
    pictures = [tl.render(ball, camera, (200, 200), shading="unlit") for camera in cameras]
    with on(isa):
        for blend in ("best", "mean"):
            baked = tl.bake(ball, pictures, 64, cameras=cameras, blend=blend, gutter=0)
            assert baked.mask.mean() > 0.85
            own = baked.mask & (y > 8) & (y < 55) & (x > 2) & (x < 61)  # poles and the seam are blurred in the pictures
            off = np.abs(baked.values[own].astype(int) - image[own])
            assert off.max() <= 6, blend
        one = tl.bake(ball, pictures[:1], 64, cameras=cameras[:1], gutter=0)
    assert 0.1 < one.mask.mean() < 0.55


def test_what_is_hidden_gets_no_color():
    quad = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    pair = [[0, 1, 2], [0, 2, 3]]
    vertices = np.concatenate([quad, np.add(quad, [0, 0, 1])])
    uv = np.concatenate([np.array([[0, 0], [0.5, 0], [0.5, 1], [0, 1]]), [[0.5, 0], [1, 0], [1, 1], [0.5, 1]]])
    mesh = tl.Mesh(vertices, np.concatenate([pair, np.add(pair, 4)]), uv=uv)
    camera = tl.Camera.look_at((0, 0, 5), near=1, far=10)
    baked = tl.bake(mesh, [np.full((64, 64, 3), 200, np.uint8)], 32, cameras=[camera], gutter=0)
    assert not baked.mask[:, :16].any()
    assert baked.mask[:, 16:].all()


def test_overlapping_and_leaving_charts_are_told():
    mesh, values = sheet(np.random.default_rng(8))
    with pytest.warns(tl.MeshWarning, match="triangles leave the square of uv"):
        tl.bake(replace(mesh, uv=mesh.uv + 0.3), values, 16)
    double = replace(mesh, triangles=np.concatenate([mesh.triangles, mesh.triangles[:1]]))
    with pytest.warns(tl.MeshWarning, match="charts overlap in"):
        tl.bake(double, values, 64)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"what": "albedo"}, ValueError, "what must be"),
        ({"what": "tangent_normal"}, ValueError, "needs a source"),
        ({"what": [1.0, 2.0]}, ValueError, "values"),
        ({"size": 0}, ValueError, "size must"),
        ({"rule": "half"}, ValueError, "rule must be"),
        ({"gutter": -1}, ValueError, r"gutter must be a number of texels in \[0, 1024\], got -1"),
        ({"max_distance": -1.0}, ValueError, "max_distance must be at least 0"),
        ({"cameras": []}, TypeError, "what must be a sequence of pictures"),
        ({"what": [np.zeros((2, 2, 3))], "cameras": [tl.Camera.look_at((0, 0, 1))]}, ValueError, r"what\[0\] must be"),
        ({"what": [], "cameras": []}, ValueError, "there must be a camera for each picture"),
    ],
)
def test_bad_options_are_refused(options, error, words):
    mesh, _ = sheet(np.random.default_rng(9))
    with pytest.raises(error, match=words):
        tl.bake(mesh, **options)


def test_mesh_without_texture_coordinates_is_refused():
    with pytest.raises(ValueError, match="got one without uv"):
        tl.bake(tl.scenes.cube(), "normal", 8)
