"""Holes in meshes, scenes, layers and glass: what is behind them shows, whatever the order, threads and window."""

from dataclasses import replace

import numpy as np
import pytest
import shading_reference as reference
from comparing import assert_same
from engine_cases import assert_same_everywhere
from layer_views import look
from leaf_cases import CAMERA, HOLES, LEAF, N_LAYERS, SIZE, cut, layers

import topleft as tl
from topleft._meshes.picture.holes import cuts_of, draw_visible
from topleft._meshes.picture.shot import Shot
from topleft._meshes.picture.transparent import solid_layers

ORDER = (2, 0, 3, 1)
ON_EACH_BITS = pytest.mark.parametrize("bits", [8, "exact"])
CLEAR = (0, 0, 0, 0)


def expected_ids(mesh, bits):
    """Each layer drawn and tested by itself; the nearest that is left, of all pixels."""
    nearest, ids = np.full(SIZE[::-1], np.inf), np.full(SIZE[::-1], -1)
    for k in range(N_LAYERS + 1):
        own = replace(mesh, triangles=mesh.triangles[2 * k : 2 * k + 2], materials=(), material_of_triangle=None)
        frags = tl.rasterize_mesh(own, CAMERA, SIZE, subpixel_bits=bits)
        w = reference.Weights(frags, own, CAMERA, SIZE, is_snapped=bits == 8)
        opacity = reference.sample(LEAF.texture, w.of(own.uv), w.slopes_of(own.uv))[:, 3]
        is_left = np.zeros(SIZE[::-1], bool)
        is_left[w.rows, w.cols] = (opacity >= 0.5) | (k == N_LAYERS)
        is_left &= frags.depth < nearest
        nearest[is_left] = frags.depth[is_left]
        ids[is_left] = frags.triangle[is_left] + 2 * k
    return ids


@ON_EACH_BITS
@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (2, 0, 3, 1)])
def test_cutout_shows_the_nearest_that_is_left(order, bits):
    mesh = layers(order)
    got, expected = cut(mesh, subpixel_bits=bits).triangle, expected_ids(mesh, bits)
    assert len(np.unique(expected)) == 2 * (N_LAYERS + 1) + 1
    # float32 opacity of 0.5 to a few units in the last place: no pixel of these scenes is that close.
    assert_same(got, expected.astype(np.int32))


def test_cutout_without_holes_is_the_visibility_buffer():
    mesh = layers((0, 1, 2, 3))
    full = replace(mesh, materials=(tl.Material(texture=LEAF.texture, alpha_cutoff=1e-6), mesh.materials[1]))
    solid = np.full_like(HOLES, 255)
    solid[0, 0, 3] = 254
    full = replace(full, materials=(replace(full.materials[0], texture=tl.Texture(solid)), mesh.materials[1]))
    before, after = tl.rasterize_mesh(full, CAMERA, SIZE), cut(full)
    assert_same(after.triangle, before.triangle)
    assert_same(after.depth, before.depth)


@ON_EACH_BITS
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_cutout_has_the_same_bits_everywhere(sampling, bits):
    mesh = layers(ORDER)

    def draw(size, **view):
        frags = cut(mesh, size, sampling=sampling, subpixel_bits=bits, **view)
        return frags.samples_triangle, frags.samples_depth

    assert_same_everywhere(draw, SIZE, [((21, 17), (40, 33))], (1, 3))


@ON_EACH_BITS
def test_cutout_of_a_triangle_that_the_near_plane_cuts(bits):
    floor = [[-9, 0, 8], [9, 0, 8], [0, 0, -60]]
    mesh = tl.Mesh(floor, [[0, 1, 2]], uv=np.array(floor)[:, [0, 2]] / 4, materials=(LEAF,))
    camera = tl.Camera.look_at((0, 1, 5), (0, 0.2, 0), near=0.1, far=1000)
    before = tl.rasterize_mesh(mesh, camera, SIZE, subpixel_bits=bits).mask
    frags = draw_visible(Shot.of(mesh, camera, SIZE), subpixel_bits=bits)
    assert not (frags.mask & ~before).any()
    assert 0.3 < frags.mask.sum() / before.sum() < 0.8  # 7 of 15 diagonals, and the far end is the mean of all


@ON_EACH_BITS
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_cutout_keeps_what_has_no_holes_and_is_cut_by_the_near_plane(sampling, bits):
    corners = np.array([[-9, 0, 8], [9, 0, 8], [0, 0, -60], [-1, 0.1, 3], [1, 0.1, 3], [0, 2, 3]])
    rows, uv = [1, 0], corners[:, :2] / 4
    mesh = tl.Mesh(corners, [[0, 1, 2], [3, 4, 5]], uv=uv, materials=(LEAF, tl.Material()), material_of_triangle=rows)
    camera = tl.Camera.look_at((0, 1, 5), (0, 0.2, 0), near=0.1, far=1000)
    options = {"sampling": sampling, "subpixel_bits": bits}
    alone = [replace(mesh, triangles=mesh.triangles[k : k + 1], material_of_triangle=[1 - k]) for k in range(2)]
    floor = tl.rasterize_mesh(alone[0], camera, SIZE, **options)
    frags, leaf = (draw_visible(Shot.of(own, camera, SIZE), **options) for own in (mesh, alone[1]))
    shows_floor, shows_leaf = floor.samples_triangle == 0, leaf.samples_triangle == 0
    assert (shows_floor & ~shows_leaf).sum() > 1000
    assert shows_leaf.sum() > 1000
    assert_same(frags.samples_triangle, np.select([shows_leaf, shows_floor], [1, 0], -1).astype(np.int32))


WIRES = np.full((64, 64, 4), 200, np.uint8)
WIRES[..., 3] = np.where((np.indices((64, 64)) % 16 < 3).any(axis=0), 255, 0)
SOFT = WIRES.copy()
SOFT[..., 3] = 255 - 3 * np.hypot(*(np.indices((64, 64)) - 32))  # a spot that fades


@pytest.mark.parametrize("size", [64, 41, 32, 23, 16])
@pytest.mark.parametrize(
    ("image", "cutoff", "opacity"), [(WIRES, 0.5, 1), (WIRES, 0.1, 1), (SOFT, 0.7, 1), (SOFT, 0.35, 0.5)]
)
def test_cutout_keeps_its_area_in_small_pictures(image, cutoff, opacity, size):
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    material = tl.Material(texture=tl.Texture(image), alpha_cutoff=cutoff, opacity=opacity)
    mesh = tl.Mesh(square, [[0, 1, 2], [0, 2, 3]], uv=(square[:, :2] + 1) / 2, materials=[material])
    camera = tl.Camera.look_at((0, 0, 5), (0, 0, 0), ortho_height=2)
    large, small = (
        tl.render(mesh, camera, (n, n), sampling="msaa16", background="transparent")[..., 3].mean() / 255
        for n in (256, size)
    )
    assert 0.2 < large < 0.7
    assert abs(small - large) < 0.06  # what is between two halvings; without their scales up to 0.6


@ON_EACH_BITS
def test_render_cuts_holes_out(bits):
    mesh = layers((0, 1, 2, 3))
    alone = replace(mesh, triangles=mesh.triangles[:2], materials=(LEAF,), material_of_triangle=None)
    picture = tl.render(alone, CAMERA, SIZE, background=(0, 0, 0, 0), subpixel_bits=bits)
    assert_same(picture[..., 3] == 255, cut(alone, subpixel_bits=bits).mask)
    assert 0.2 < (picture[..., 3] == 255).sum() / tl.rasterize_mesh(alone, CAMERA, SIZE).mask.sum() < 0.8


def test_holes_are_cut_in_the_memory_of_a_rasterizer():
    own, mesh = tl.Rasterizer(SIZE), layers((0, 1, 2, 3))
    frags = draw_visible(Shot.of(mesh, CAMERA, SIZE), own)
    assert_same(frags.triangle, cut(mesh).triangle)
    again = draw_visible(Shot.of(layers((3, 2, 1, 0)), CAMERA, SIZE), own)
    assert np.shares_memory(again.triangle, frags.triangle)
    with pytest.raises(ValueError, match="rasterizer must have the size"):
        tl.render(mesh, CAMERA, (8, 8), rasterizer=own)


def pieces(mesh):
    """The leaves and the wall of `layers`, an instance each."""
    rows = mesh.material_of_triangle[::2]
    return [
        replace(
            mesh,
            triangles=mesh.triangles[2 * k : 2 * k + 2],
            materials=(mesh.materials[row],),
            material_of_triangle=None,
        )
        for k, row in enumerate(rows.tolist())
    ]


MESH = layers(ORDER)
SCENE = tl.Scene(pieces(MESH))


@ON_EACH_BITS
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
@pytest.mark.parametrize("threads", [1, 3])
def test_layers_of_a_scene_are_those_of_one_mesh(sampling, threads, bits):
    names = ("depth", "distance", "silhouette", "alpha", "world_position")
    options = {"sampling": sampling, "threads": threads, "subpixel_bits": bits}
    one, many = (
        tl.render_layers(subject, CAMERA, SIZE, layers=("triangle", "instance", *names), **options)
        for subject in (MESH, SCENE)
    )
    for name in names:
        assert_same(np.nan_to_num(many[name]), np.nan_to_num(one[name]))
    seen = many["triangle"] >= 0
    assert np.unique(many["instance"]).tolist() == [-1, *range(N_LAYERS + 1)]
    assert_same(np.where(seen, 2 * many["instance"] + many["triangle"], -1), one["triangle"])


@ON_EACH_BITS
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_picture_of_a_scene_is_that_of_one_mesh(sampling, bits):
    options = {"shading": "unlit", "sampling": sampling, "subpixel_bits": bits}
    expected = tl.render(MESH, CAMERA, SIZE, **options)
    assert (expected != tl.render(replace(MESH, uv=None), CAMERA, SIZE, **options)).any()
    assert_same(tl.render(SCENE, CAMERA, SIZE, **options), expected)


def test_hole_of_a_turned_instance_shows_the_other():
    wall = tl.Mesh([[-9, -9, -1], [9, -9, -1], [9, 9, -1], [-9, 9, -1]], [[0, 1, 2], [0, 2, 3]])
    turn = np.diag([-1.0, 1.0, -1.0, 1.0])  # half a turn: its back is seen
    leaf = pieces(MESH)[1]
    found = look(CAMERA, "instance", subject=tl.Scene([(leaf, turn), wall]))["instance"]
    assert set(np.unique(found[30:40, 35:45])) == {0, 1}
    covered = look(CAMERA, "instance", subject=tl.Scene([(replace(leaf, materials=()), turn), wall]))["instance"]
    assert (covered[30:40, 35:45] == 0).all()


def test_material_of_a_look_cuts_all_instances():
    bare = tl.Scene([replace(instance.mesh, materials=()) for instance in SCENE])
    wall = len(SCENE) - 1
    got = tl.render_layers(bare, CAMERA, SIZE, layers=("color", "instance"), material=LEAF)["instance"]
    expected = tl.render_layers(SCENE, CAMERA, SIZE, layers="instance")["instance"]
    assert (got[expected != wall] == expected[expected != wall]).all()
    assert (got[expected == wall] == -1).any()


@ON_EACH_BITS
def test_cutout_of_a_scene_with_an_edge_at_the_near_plane(bits):
    near = tl.Camera.look_at((0.4, 0.3, 0.55), (0.4, 0.3, -3), near=0.5, far=9, fov_y_deg=120)
    tilt = np.eye(4)
    tilt[2, 0] = 0.9
    moved = [replace(mesh, vertices=mesh.vertices @ tilt[:3, :3].T) for mesh in pieces(MESH)]
    whole = replace(MESH, vertices=MESH.vertices @ tilt[:3, :3].T)
    one, many = (
        look(near, "depth", subject=subject, subpixel_bits=bits)["depth"] for subject in (whole, tl.Scene(moved))
    )
    assert np.isfinite(one).any()
    assert_same(many, one)


# ---- glass ----------------------------------------------------------------------------------------------------------


def expected_layers(n, bits=8):
    """Every leaf cut by itself, sorted by depth, then id."""
    ids, depth = [], []
    for k, mesh in enumerate(pieces(MESH)):
        frags = cut(mesh, subpixel_bits=bits)
        ids.append(np.where(frags.mask, frags.triangle + 2 * k, -1))
        depth.append(np.where(frags.mask, frags.depth, np.inf))
    order = np.argsort(depth, axis=0, kind="stable")[:n]
    return np.take_along_axis(np.array(ids), order, 0), np.take_along_axis(np.array(depth), order, 0)


@ON_EACH_BITS
@pytest.mark.parametrize("n", [1, 3, 5])
@pytest.mark.parametrize("threads", [1, 3])
def test_layers_of_glass_are_those_that_are_left(n, threads, bits):
    options = {"layers": n, "threads": threads, "subpixel_bits": bits}
    found = solid_layers(Shot.of(SCENE, CAMERA, SIZE), cuts_of(SCENE, None), **options)
    ids, depth = expected_layers(n, bits)
    assert_same(found.planes[0], ids.astype(np.int32))
    assert_same(found.planes[1], depth.astype(np.float32))


@pytest.mark.parametrize("subject", [MESH, SCENE], ids=["mesh", "scene"])
def test_glass_is_as_opaque_as_its_layers(subject):
    picture = tl.render_transparent(subject, CAMERA, SIZE, opacity=0.2, background=CLEAR)  # 51 / 255
    count = (expected_layers(5)[0] >= 0).sum(0)
    assert len(np.unique(count)) > 3
    assert_same(picture[..., 3], np.rint(255 * (1 - 0.8**count)).astype(np.uint8))
