"""What else is drawn of vertices that are not snapped: colours that blend or run between them, layers, lit meshes."""

import comparing
import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, kept, on, one_by_one
from exact_cases import exact_scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import CLIP_SCENES, soup, with_depth

import topleft as tl
from topleft.methods import reference
from topleft.methods.reference import blend as ref_blend
from topleft.methods.reference import peel as ref_peel

EXACT = {"subpixel_bits": "exact"}
MODES = ["replace", "over", "add", "multiply", "max", "min"]
fill, blend, overdraw = kept(reference.fill), kept(ref_blend.blend), kept(reference.overdraw)


def colors_of(n, n_channels, seed, dtype=np.uint8):
    """Random colours."""
    rng = np.random.default_rng(seed)
    colors = rng.integers(0, 256, (n, n_channels)).astype(dtype)
    return colors if dtype == np.uint8 else colors / np.float32(255)


# ---- colours --------------------------------------------------------------------------------------------------------


@ON_EACH_ISA
@settings(max_examples=40)
@given(scene=exact_scenes(), seed=st.integers(0, 99))
def test_colors_of_vertices_are_rounded_as_the_reference_rounds_them(isa, scene, seed):
    colors = colors_of(len(scene.vertices), 3, seed)
    expected = fill(*scene.arrays[:2], colors, scene.size, per="vertex", **scene.view)
    with on(isa):
        found = tl.fill(*scene.arrays[:2], colors, scene.size, per="vertex", **scene.view)
    assert (found == expected).all()


def test_colors_of_vertices_on_the_grid_meet_ties_to_even():
    """Values of 1/2 everywhere: corners on quarters of a pixel and colours 4 apart."""
    vertices = np.array([[0, 0], [8, 0], [0, 8], [8, 8]]) + 0.25
    colors, triangles = np.array([[0], [4], [8], [12]], np.uint8), [[0, 1, 2], [1, 3, 2]]
    found = tl.fill(vertices, triangles, colors, (9, 9), per="vertex", **EXACT)
    assert (found == tl.fill(vertices, triangles, colors, (9, 9), per="vertex")).all()
    assert (found == reference.fill(vertices, triangles, colors, (9, 9), per="vertex", **EXACT)).all()


@settings(max_examples=30)
@given(scene=exact_scenes(3), seed=st.integers(0, 99))
def test_float_colors_of_vertices_are_those_of_the_reference(scene, seed):
    colors = colors_of(len(scene.vertices), 2, seed, np.float32)
    expected = reference.fill(*scene.arrays[:2], colors, scene.size, per="vertex", **scene.view).astype(float)
    found = tl.fill(*scene.arrays[:2], colors, scene.size, per="vertex", **scene.view)
    assert abs(found - expected).max(initial=0) <= 2.0**-24  # half a unit of float32 below 1, and 2**-30


@pytest.mark.parametrize("make", CLIP_SCENES.values(), ids=CLIP_SCENES)
def test_colors_of_vertices_in_clip_space_are_those_of_the_reference(make):
    scene = make(np.random.default_rng(1))
    colors = colors_of(len(scene.vertices), 3, 1)
    view = scene.view | EXACT
    expected = reference.fill(*scene.arrays[:2], colors, scene.size, per="vertex", **view)
    found = tl.fill(*scene.arrays[:2], colors, scene.size, per="vertex", **view)
    assert (found == expected).all()


@ON_EACH_ISA
@pytest.mark.parametrize("per", ["triangle", "vertex"])
@settings(max_examples=20)
@given(scene=exact_scenes(), seed=st.integers(0, 99), mode=st.sampled_from(MODES))
def test_blended_colors_are_those_of_the_reference(isa, per, scene, seed, mode):
    n = len(scene.triangles if per == "triangle" else scene.vertices)
    colors, options = colors_of(n, 4, seed), {"per": per, "background": 77}
    expected = blend(*scene.arrays[:2], colors, scene.size, mode=mode, **options, **scene.view)
    with on(isa):
        found = tl.fill(*scene.arrays[:2], colors, scene.size, blend=mode, **options, **scene.view)
    assert (found == expected).all()


@pytest.mark.parametrize("make", CLIP_SCENES.values(), ids=CLIP_SCENES)
@pytest.mark.parametrize("per", ["triangle", "vertex"])
def test_blended_pieces_stand_in_the_order_of_their_triangles(make, per):
    scene = make(np.random.default_rng(2))
    colors = colors_of(len(scene.triangles if per == "triangle" else scene.vertices), 4, 2)
    view = scene.view | EXACT
    expected = ref_blend.blend(*scene.arrays[:2], colors, scene.size, per=per, mode="over", **view)
    for threads in (1, 3):
        found = tl.fill(*scene.arrays[:2], colors, scene.size, per=per, blend="over", threads=threads, **view)
        assert (found == expected).all()


@pytest.mark.parametrize("per", ["triangle", "vertex"])
@pytest.mark.parametrize("mode", ["replace", "add"])
def test_samples_of_colors_are_the_mean_of_pictures(per, mode):
    """Of a picture four times as large, at centres that lie where the samples do: of two diagonal ones."""
    vertices = np.random.default_rng(3).uniform(0, 12, (18, 2))
    triangles = np.arange(18).reshape(-1, 3)
    colors = colors_of(6 if per == "triangle" else 18, 1, 4, np.float32)
    found = tl.fill(vertices, triangles, colors, (12, 12), per=per, blend=mode, sampling="msaa2", **EXACT)
    each = [tl.fill(vertices - at, triangles, colors, (12, 12), per=per, blend=mode, **EXACT) for at in (0.25, -0.25)]
    assert abs(found - np.mean(each, axis=0)).max() < 1e-6


@ON_EACH_ISA
@pytest.mark.parametrize("on_grid", [False, True])
@one_by_one("side", [0.75, 3, 11, 40, 61, 130])
def test_ones_that_add_up_count_the_triangles(isa, side, on_grid):
    """Queues of triangles of all sizes, those that lanes cannot take between them, in windows and on threads."""
    rng = np.random.default_rng(int(side * 4))
    corners = rng.uniform(-9, 130, (400, 1, 2)) + rng.uniform(-0.5, 0.5, (400, 3, 2)) * side
    corners[::50] *= 2
    corners[::3] = np.round(corners[::3] * 2) / 2 if on_grid else np.nextafter(np.round(corners[::3]), np.inf)
    vertices, triangles = corners.reshape(-1, 2), np.arange(1200).reshape(-1, 3)
    ones = np.ones((400, 1), np.float32)
    with on(isa):
        for threads, origin in ((1, (0, 0)), (3, (-7, 11))):
            view = EXACT | {"threads": threads, "origin": origin}
            added = tl.fill(vertices, triangles, ones, (120, 90), blend="add", **view)[..., 0]
            assert (added == tl.overdraw(vertices, triangles, (120, 90), **view)).all()


# ---- layers ---------------------------------------------------------------------------------------------------------


@ON_EACH_ISA
@settings(max_examples=25)
@given(scene=exact_scenes(), seed=st.integers(0, 99), test=st.sampled_from(["less", "greater"]))
def test_layers_are_those_of_the_reference(isa, scene, seed, test):
    scene = with_depth(scene, np.random.default_rng(seed))
    with on(isa):
        layers = tl.peel(*scene.arrays, layers=3, depth_test=test, **scene.view)
        frags = tl.rasterize(*scene.arrays, depth_test=test, **scene.view)
    assert (layers.triangle[..., 0] == frags.triangle).all()
    assert (layers.depth[..., 0] == frags.depth).all()
    assert (layers.count == np.minimum(3, overdraw(*scene.arrays, **scene.view))).all()


def test_layers_by_index_are_those_of_the_reference():
    vertices = np.random.default_rng(5).uniform(-2, 26, (36, 2))
    scene = soup(vertices, (24, 16))
    ids, _ = ref_peel.layers(*scene.arrays, 4, **EXACT)
    for threads in (1, 2):
        assert (tl.peel(*scene.arrays, layers=4, threads=threads, **EXACT).triangle == ids).all()


def test_attributes_of_a_layer_are_those_of_its_triangles():
    vertices = np.random.default_rng(6).uniform(-2, 26, (30, 3))
    triangles = np.arange(30).reshape(-1, 3)
    second = tl.peel(vertices, triangles, (24, 16), layers=2, **EXACT).layer(1)
    x = second.interpolate(vertices[:, 0].astype(np.float32))[second.mask]
    assert abs(x - (np.nonzero(second.mask)[1] + 0.5)).max() < 1e-5


# ---- meshes ---------------------------------------------------------------------------------------------------------


def ball(n=3):
    """A sphere with normals and colours."""
    vertices, triangles, *_ = tl.scenes.icosphere(n)
    colors = ((np.asarray(vertices) + 1.5) * 80).astype(np.uint8)
    return tl.Mesh(vertices, triangles, colors=colors)


CAMERA = tl.Camera.look_at((2, 1.5, 2.5), (0, 0, 0))
FLAT = np.diag([0.5, 0.5, -0.5, 1.0])


@ON_EACH_ISA
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
@pytest.mark.parametrize("shading", ["smooth", "flat", "normals", "depth"])
def test_lit_picture_differs_from_the_snapped_one_at_outlines_alone(isa, sampling, shading):
    mesh = ball()
    with on(isa):
        exact, snapped = (
            tl.rasterize_mesh(mesh, CAMERA, (96, 72), sampling=sampling, subpixel_bits=bits) for bits in ("exact", 16)
        )
        pictures = [tl.shade(frags, mesh, CAMERA, shading=shading).astype(int) for frags in (exact, snapped)]
    same = (exact.samples_triangle == snapped.samples_triangle).all(axis=-1)
    assert same.mean() > 0.99
    assert abs(pictures[0] - pictures[1])[same].max() <= 1  # of 255: the snap moves a vertex by 2**-17 px


def test_lit_sliver_that_the_snap_would_collapse_has_a_colour():
    """A strip of triangles 1e-13 px wide along a column of centres, lit by the normals of its corners."""
    y = np.linspace(-0.9, 0.9, 9)
    x = np.full(9, 1 / 16)  # of a picture of 32 px: the column of centres at 16.5 px
    corners = np.concatenate([np.stack([x - 1e-14, y, 0 * y], 1), np.stack([x + 1e-14, y, 0 * y], 1)])
    i = np.arange(8)
    triangles = np.concatenate([np.stack([i, i + 9, i + 1], 1), np.stack([i + 1, i + 9, i + 10], 1)])
    mesh = tl.Mesh(corners, triangles, colors=np.full((18, 3), 200, np.uint8))
    camera = tl.Camera.from_matrix(FLAT)
    frags = tl.rasterize_mesh(mesh, camera, (32, 32), **EXACT)
    picture = tl.shade(frags, mesh, camera, shading="unlit")
    assert frags.mask[:, 16].sum() == 14
    assert (picture[frags.mask] == [200, 200, 200, 255]).all()
    assert not tl.rasterize_mesh(mesh, camera, (32, 32)).mask.any()


@pytest.mark.parametrize("sampling", ["center", "msaa2"])
def test_picture_through_glass_differs_from_the_snapped_one_at_outlines_alone(sampling):
    """Layers that blend, the nearest of which is peeled, over what is opaque."""
    mesh = ball(2)
    glass = tl.Mesh(
        mesh.vertices, mesh.triangles, materials=[tl.Material(color=(50, 120, 230), opacity=0.5, alpha_mode="blend")]
    )
    scene = tl.Scene([glass, tl.Instance(mesh, np.diag([0.5, 0.5, 0.5, 1.0]))])
    exact, snapped = (
        tl.render(scene, CAMERA, (64, 48), sampling=sampling, subpixel_bits=b).astype(int) for b in ("exact", 16)
    )
    assert (abs(exact - snapped).max(axis=-1) <= 1).mean() > 0.99
    assert (exact[..., :3] != 255).any(axis=-1).mean() > 0.3


@pytest.mark.parametrize("sampling", ["center", "msaa4", "outer", "inner"])
def test_silhouette_of_a_scene_is_that_of_its_mesh(sampling):
    mesh = ball(2)
    of_mesh = tl.silhouette(mesh, CAMERA, (64, 48), sampling=sampling, **EXACT)
    of_scene = tl.silhouette(tl.Scene([mesh]), CAMERA, (64, 48), sampling=sampling, **EXACT)
    assert of_mesh.any()
    comparing.assert_same(of_scene, of_mesh)


def test_scene_of_two_meshes_numbers_their_triangles():
    small = tl.Instance(ball(2), np.diag([0.5, 0.5, 0.5, 1.0]))
    scene = tl.Scene([tl.Instance(ball(2)), small])
    exact, snapped = (tl.rasterize_mesh(scene, CAMERA, (64, 48), subpixel_bits=bits) for bits in ("exact", 8))
    assert (exact.instance != snapped.instance).mean() < 0.01
    values = [np.asarray(instance.mesh.vertices, np.float32)[:, 0] for instance in scene]
    seen = exact.mask & (exact.id == snapped.id)
    assert abs(exact.interpolate(values) - snapped.interpolate(values))[seen].max() < 0.05


def test_backs_of_single_sided_materials_are_left_out_by_the_exact_turn():
    mesh = ball(2)
    half = np.random.default_rng(1).integers(0, 2, len(mesh.triangles))
    materials = [tl.Material(double_sided=False), tl.Material()]
    sided = tl.Mesh(mesh.vertices, mesh.triangles, materials=materials, material_of_triangle=half)
    inside = tl.Camera.look_at((0, 0, 0), (0, 0, -1), near=0.01, far=9)  # sees backs alone
    frags = tl.rasterize_mesh(sided, inside, (64, 48), **EXACT)
    assert set(half[frags.triangle[frags.mask]].tolist()) == {1}
    assert tl.rasterize_mesh(mesh, inside, (64, 48), **EXACT).mask.all()


# ---- grids ----------------------------------------------------------------------------------------------------------


def test_field_and_height_map_are_those_of_the_exact_triangles():
    vertices = np.random.default_rng(8).uniform(0, 20, (40, 2))
    mesh = tl.Mesh(np.column_stack([vertices, vertices.sum(axis=1)]), np.arange(39).reshape(-1, 3))
    grid = tl.Grid((20, 20), (0, 20, 0, 20), y="down")
    ids = tl.rasterize(vertices, mesh.triangles, (20, 20), **EXACT)
    field = tl.field(mesh, vertices.sum(axis=1), grid, **EXACT)
    assert (np.isnan(field) == ~ids.mask).all()
    x, y = np.meshgrid(np.arange(20) + 0.5, np.arange(20) + 0.5)
    assert abs(field - (x + y))[ids.mask].max() < 1e-9
    heights = tl.height_map(mesh, grid, **EXACT)
    assert (np.isnan(heights) == ~ids.mask).all()


# ---- what is refused ------------------------------------------------------------------------------------------------


TRIANGLE = [[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: tl.wireframe(*TRIANGLE, (4, 4), **EXACT), "here, got 'exact': lines run between points of the grid"),
        (lambda: tl.points(TRIANGLE[0], (4, 4), **EXACT), "here, got 'exact': the corners of points lie on the grid"),
        (lambda: tl.fill(*TRIANGLE, [9], (4, 4), sampling="area", **EXACT), "for sampling 'area', got 'exact'"),
    ],
)
def test_what_needs_the_grid_says_so(call, message):
    with pytest.raises(ValueError, match=r"subpixel_bits must be in 0\.\.16 " + message):
        call()
