"""Materials that what is behind shows through: against layers composited one by one, whatever the order."""

from dataclasses import replace

import numpy as np
import pytest
import shading_reference as reference
from comparing import assert_same

import topleft as tl
from topleft._core.base.memory import FRESH, SCRATCH
from topleft._core.raster.peel import peel_meshes
from topleft._meshes.picture.blended import blended_masks
from topleft._meshes.picture.draw_scene import draw_ids
from topleft._meshes.picture.placed import Placed
from topleft._meshes.picture.shade import ShadingOptions
from topleft._meshes.picture.shot import Shot

SIZE = (120, 90)
CAMERA = tl.Camera.look_at((0.3, 0.2, 4))
RNG = np.random.default_rng(5)
RED = tl.Material((230, 60, 40), opacity=0.5, alpha_mode="blend")
BLUE = tl.Material((40, 80, 230), opacity=0.3, alpha_mode="blend")
SOLID = tl.Material((60, 190, 90))
CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def panes(order, materials, distances, shift=0.2):
    """Squares behind each other, one with each material, which stand in the mesh in some order."""
    steps = enumerate(distances)
    vertices = [CORNERS * [1 + shift / 2 * k, 1 - shift / 4 * k, 1] + [shift * k, shift / 2 * k, z] for k, z in steps]
    vertices = np.concatenate([vertices[k] for k in order])
    triangles = np.concatenate([TRIANGLES + 4 * i for i in range(len(order))])
    rows = np.repeat(order, 2)
    return tl.Mesh(vertices, triangles, materials=materials, material_of_triangle=rows)


MATERIALS = (RED, BLUE, SOLID, replace(RED, color=(240, 240, 20), opacity=0.8))
DISTANCES = (0.9, 0.4, -0.3, -0.8)  # the last one lies behind what is opaque
MESH = panes((2, 0, 3, 1), MATERIALS, DISTANCES)


def expected_of(mesh, camera, size, background, **look):
    """Each pane drawn alone, as if it were opaque, and laid over the others in the order of their depth, in light."""
    layers = []
    for row, material in enumerate(mesh.materials):
        triangles = mesh.triangles[mesh.material_of_triangle == row]
        own = replace(mesh, triangles=triangles, materials=[replace(material, alpha_mode="opaque")],
                      material_of_triangle=None)  # fmt: skip
        frags = tl.rasterize_mesh(own, camera, size)
        depth, picture = frags.depth, tl.shade(frags, own, camera, **look)
        alpha = np.where(frags.mask, material.opacity if material.alpha_mode == "blend" else 1.0, 0)
        layers.append((depth, reference.decode(picture[..., :3]), alpha))
    order = np.argsort(np.stack([depth for depth, _, _ in layers]), axis=0)
    light, through = np.zeros((*size[::-1], 3)), np.ones(size[::-1])
    for k in order:
        own_light = np.choose(k[..., None], [own for _, own, _ in layers])
        alpha = np.choose(k, [own for _, _, own in layers])
        light += (through * alpha)[..., None] * own_light
        through = through * (1 - alpha)
    ground = reference.decode(background[:3]) * (background[3] / 255)
    total = 1 - through * (1 - background[3] / 255)
    light = (light + through[..., None] * ground) / np.maximum(total, 1e-9)[..., None]
    return reference.encode(light), 255 * total


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (2, 0, 3, 1)])
@pytest.mark.parametrize("background", [(255, 255, 255, 255), (10, 20, 30, 100), (0, 0, 0, 0)])
def test_blended_panes_are_laid_over_what_is_behind(order, background):
    mesh = panes(order, MATERIALS, DISTANCES)
    got = tl.render(mesh, CAMERA, SIZE, background=background)
    color, alpha = expected_of(mesh, CAMERA, SIZE, background)
    assert np.abs(got[..., 3] - alpha).max() <= 0.51 + 3 * 0.5  # opacity of each layer in 255ths
    seen = alpha > 0
    # two layers of colours and opacities in whole levels, where some light is divided by little opacity
    assert np.abs(got[..., :3] - color)[seen].max() < 2.5
    assert np.abs(got[..., :3] - color)[seen].mean() < 0.5


def test_a_scene_is_its_mesh_and_instances_hide_each_other():
    scene = tl.Scene([
        replace(MESH, triangles=MESH.triangles[MESH.material_of_triangle == row], materials=[material],
                material_of_triangle=None) for row, material in enumerate(MATERIALS)
    ])  # fmt: skip
    assert_same(tl.render(scene, CAMERA, SIZE), tl.render(MESH, CAMERA, SIZE))


def test_what_is_opaque_is_drawn_as_ever():
    opaque = replace(MESH, materials=[SOLID] * 4)
    assert blended_masks(tl.Scene([opaque]), ShadingOptions.parse()) is None
    alone = replace(MESH, triangles=MESH.triangles[MESH.material_of_triangle == 2], materials=[SOLID],
                    material_of_triangle=None)  # fmt: skip
    clear = [replace(one, opacity=0) if one.alpha_mode == "blend" else one for one in MATERIALS]
    assert_same(tl.render(replace(MESH, materials=clear), CAMERA, SIZE), tl.render(alone, CAMERA, SIZE))


def test_full_opacity_is_opaque():
    full = [replace(one, opacity=1) for one in MATERIALS]
    assert blended_masks(tl.Scene([replace(MESH, materials=full)]), ShadingOptions.parse()) is None
    nearly = replace(MESH, materials=[replace(one, texture=tl.Texture([[[255, 255, 255, 254]]])) for one in full],
                     uv=np.zeros((len(MESH.vertices), 2)))  # fmt: skip
    assert blended_masks(tl.Scene([nearly]), ShadingOptions.parse()) is not None
    got, expected = (tl.render(mesh, CAMERA, SIZE).astype(int) for mesh in (nearly, replace(MESH, materials=full)))
    assert np.abs(got - expected).max() <= 12.92 * 255 / 255 + 1  # a 255th of white behind what is black


def test_opacity_is_that_of_material_texture_and_vertices():
    texture = tl.Texture(np.full((2, 2, 4), [255, 255, 255, 128], np.uint8))
    colors = np.full((4, 4), [255, 255, 255, 102], np.uint8)
    pane = tl.Mesh(CORNERS, TRIANGLES, colors=colors, uv=CORNERS[:, :2], uv1=CORNERS[:, :2])
    moved = replace(texture, uv_set=1, transform=[[1, 0, 0.3], [0, 1, 0]])

    def alpha(**options):
        material = tl.Material(alpha_mode="blend", unlit=True, **options)
        return tl.render(pane, CAMERA, SIZE, material=material, background=(0, 0, 0, 0))[45, 60, 3]

    assert alpha() == 102
    assert alpha(texture=texture) == alpha(texture=moved) == round(102 * 128 / 255)
    assert alpha(opacity=0.5, texture=texture) == round(0.5 * 102 * 128 / 255)
    plain = replace(pane, colors=None)
    assert tl.render(plain, CAMERA, SIZE, material=RED, background=(0, 0, 0, 0))[45, 60, 3] == 128


def test_colours_with_alpha_are_honoured_without_a_material():
    colors = np.full((4, 4), [255, 0, 0, 51], np.uint8)
    pane = tl.Mesh(CORNERS, TRIANGLES, colors=colors)
    got = tl.render(pane, CAMERA, SIZE, shading="unlit", background=(0, 0, 0, 0))[45, 60]
    assert got.tolist() == [255, 0, 0, 51]
    solid = replace(pane, materials=[tl.Material()])  # a material that says that it is opaque
    assert tl.render(solid, CAMERA, SIZE, background=(0, 0, 0, 0))[45, 60, 3] == 255
    half = np.array([255, 255, 51, 51])
    mixed = replace(
        pane, colors=np.c_[colors[:, :3], half].astype(np.uint8), triangles=[[0, 1, 1], [0, 1, 2], [0, 2, 3]]
    )
    assert 51 < tl.render(mixed, CAMERA, SIZE, background=(0, 0, 0, 0))[60, 60, 3] < 255


@pytest.mark.parametrize("mode", ["mask", "blend"])
def test_alpha_of_vertices_is_tested_or_blended(mode):
    alpha = np.array([255, 255, 0, 0])
    pane = tl.Mesh(CORNERS, TRIANGLES, colors=np.c_[np.full((4, 3), 255), alpha].astype(np.uint8),
                   materials=[tl.Material(alpha_mode=mode)])  # fmt: skip
    got = tl.render(pane, tl.Camera.look_at((0, 0, 4), ortho_height=2), (64, 64), background=(0, 0, 0, 0))[:, 32, 3]
    share = (np.arange(64) + 0.5) / 64
    if mode == "mask":
        assert_same(got, np.where(share >= 0.5, 255, 0).astype(np.uint8))
    else:
        assert np.abs(got - 255 * share).max() <= 0.51


def test_several_samples_are_composited_by_themselves():
    got = tl.render(MESH, CAMERA, SIZE, sampling="msaa4").astype(float)
    large = tl.render(MESH, CAMERA, (SIZE[0] * 4, SIZE[1] * 4)).reshape(SIZE[1], 4, SIZE[0], 4, 4)
    light = reference.decode(large[..., :3]).mean(axis=(1, 3))
    error = np.abs(got[..., :3] - reference.encode(light))
    assert error.mean() < 1.5  # 4 samples for 16 along the edges
    inner = (large == large[:, :1, :, :1]).all(axis=(1, 3, 4))
    assert error[inner].max() <= 1.5
    single = tl.render(MESH, CAMERA, SIZE).astype(float)
    assert np.abs(got - single)[inner].max() <= 1


def test_every_sample_sees_all_layers_of_small_triangles():
    knot = tl.Mesh(*tl.scenes.shape("torus-knot"))  # 49,152 triangles of a few pixels
    camera, size = tl.Camera.framing(knot), (200, 200)
    mesh = replace(knot, materials=[tl.Material((255, 0, 0), opacity=0.4, alpha_mode="blend")])
    count = tl.visible_layers(knot, camera, size, layers=16).count
    alpha = tl.render(mesh, camera, size, background=(0, 0, 0, 0))[..., 3]
    assert np.abs(alpha - 255 * (1 - 0.6**count)).max() < 0.6
    near = np.stack([np.roll(count, (dy, dx), (0, 1)) for dy in (-1, 0, 1) for dx in (-1, 0, 1)])
    inner = (near == count).all(axis=0)  # no outline near: samples see as many, but for folds between the centres
    assert (count[inner] == 4).sum() > 1000
    many = tl.render(mesh, camera, size, background=(0, 0, 0, 0), sampling="msaa4")[..., 3]
    assert (np.abs(many[inner].astype(int) - alpha[inner]) > 1).mean() < 1e-3
    placed = Placed.parse(Shot.of(tl.Scene([knot]), camera, size), {"sampling": "msaa4"})
    frags, snapped = draw_ids(FRESH, placed), [placed.snap(0)]
    for k, at in enumerate(placed.positions):
        ids, depth = peel_meshes(SCRATCH, [snapped], placed.view, 16, is_farthest=False, at_fx=at)
        assert_same(ids[0], frags.drawn_planes[0][k])
        assert_same(depth[0], frags.drawn_planes[1][k])


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_many_layers_are_all_looked_at(sampling):
    n = 12
    mesh = panes(tuple(RNG.permutation(n)), [replace(RED, opacity=0.1)] * n, np.linspace(1, -1, n), 0.01)
    got = tl.render(mesh, CAMERA, SIZE, background=(0, 0, 0, 0), sampling=sampling)[45, 62, 3]
    assert abs(int(got) - 255 * (1 - (1 - 26 / 255) ** n)) <= 1


def test_blended_holes_backs_and_edges():
    holes = np.full((8, 8, 4), 255, np.uint8)
    holes[2:5, 2:5, 3] = 0
    leaf = tl.Material((200, 200, 60), texture=tl.Texture(holes), alpha_cutoff=0.5)
    mesh = replace(
        MESH, materials=[RED, replace(BLUE, double_sided=False), leaf, RED], uv=np.tile(CORNERS[:, :2], (4, 1))
    )
    turned = replace(
        mesh, triangles=np.where(mesh.material_of_triangle[:, None] == 1, mesh.triangles[:, ::-1], mesh.triangles)
    )
    without = replace(mesh, materials=[RED, replace(BLUE, opacity=0.0), leaf, RED])
    assert_same(tl.render(turned, CAMERA, SIZE), tl.render(without, CAMERA, SIZE))
    front = tl.render(mesh, CAMERA, SIZE)
    assert (front != tl.render(without, CAMERA, SIZE)).any()
    behind = tl.rasterize_mesh(panes((0,), (RED,), DISTANCES[3:]), CAMERA, SIZE).mask
    solid = tl.render(replace(mesh, materials=[RED, BLUE, replace(leaf, alpha_mode="opaque"), RED]), CAMERA, SIZE)
    assert (front != solid)[behind].any()  # the pane behind shows through the holes
    assert (tl.render(mesh, CAMERA, SIZE, edges=True) != front).any()


@pytest.mark.parametrize("shading", ["ids", "depth", "normals"])
def test_other_pictures_show_the_nearest_surface(shading):
    opaque = replace(MESH, materials=[SOLID] * 4)
    assert_same(*(tl.render(mesh, CAMERA, SIZE, shading=shading) for mesh in (MESH, opaque)))


def test_blended_layers_and_flat_and_unlit():
    for shading in ("flat", "unlit"):
        picture = tl.render(MESH, CAMERA, SIZE, shading=shading)
        color, _ = expected_of(MESH, CAMERA, SIZE, (255, 255, 255, 255), shading=shading)
        assert np.abs(picture[..., :3] - color).max() < 2.5
    layers = tl.render_layers(MESH, CAMERA, SIZE, layers=("color",))
    assert_same(layers["color"], tl.render(MESH, CAMERA, SIZE))


def lens_of(coefficients):
    view = np.diag([1.0, 1, 1, 1])
    view[2, 3] = 4
    return tl.Camera.from_intrinsics([[90, 0, 60], [0, 90, 45], [0, 0, 1]], view, SIZE, near=0.1, far=50,
                                     distortion=coefficients)  # fmt: skip


def test_blended_through_a_lens():
    straight = tl.render(MESH, lens_of([1e-12, 0, 0, 0]).straightened(), SIZE).astype(int)
    nearly = tl.render(MESH, lens_of([1e-12, 0, 0, 0]), SIZE).astype(int)
    assert (np.abs(nearly - straight) > 2).any(axis=2).mean() < 0.01  # outlines, snapped in another way
    bent = tl.render(MESH, lens_of([-0.2, 0.05, 0, 0]), SIZE)
    assert (bent != straight).any()


def test_sampling_without_an_order_is_refused():
    with pytest.raises(ValueError, match="sampling 'area' gives no ids"):
        tl.render(MESH, CAMERA, SIZE, sampling="area")
    assert tl.render(MESH, CAMERA, (0, 4)).shape == (4, 0, 4)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_blended_lies_over_cut_out_over_opaque_triangles_of_equal_depth(order, sampling):
    clear_left = tl.Texture([[[0, 0, 255, 0], [0, 0, 255, 255]]], filter="nearest")
    body, label = tl.Material((255, 0, 0), unlit=True), tl.Material(texture=clear_left, alpha_cutoff=0.5, unlit=True)
    pane = tl.Material((255, 255, 255), opacity=0.5, alpha_mode="blend", unlit=True)
    rows = np.repeat(order, 2)
    mesh = tl.Mesh(
        np.tile(CORNERS, (3, 1)), np.concatenate([TRIANGLES + 4 * i for i in range(3)]),
        uv=np.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (3, 1)), materials=(body, label, pane), material_of_triangle=rows,
    )  # fmt: skip
    got = tl.render(mesh, CAMERA, (64, 64), sampling=sampling)
    assert got[32, 24, :3].tolist() == [255, 188, 188]  # half of the light of white, half of red
    assert got[32, 40, :3].tolist() == [188, 188, 255]
    two = replace(mesh, triangles=mesh.triangles[rows < 2], material_of_triangle=rows[rows < 2])
    got = tl.render(two, CAMERA, (64, 64), sampling=sampling)
    assert (got[32, 24, :3].tolist(), got[32, 40, :3].tolist()) == ([255, 0, 0], [0, 0, 255])
