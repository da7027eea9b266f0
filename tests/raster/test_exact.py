"""Vertices that are not snapped: every sample by the exact sign of the numbers that stand in the array."""

import comparing
import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, kept, on, one_by_one, sharing
from exact_cases import BITING_EDGES, KETTNER_A1, SIZE, exact_scenes, kettner_grid, lattice, tilted_grid
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import CLIP_SCENES, clip_scenes, soup, with_depth

import topleft as tl
from topleft._core import engine
from topleft.methods import reference
from topleft.methods.reference import sampling

EXACT = {"subpixel_bits": "exact"}
SQUARES = "outer", "inner"

exact_overdraw = kept(reference.overdraw)


def overdraw(scene, **options):
    """The counts of a scene of vertices that are not snapped."""
    return tl.overdraw(*scene.arrays, **scene.view | EXACT | options)


# ---- against the reference ------------------------------------------------------------------------------------------


@ON_EACH_ISA
@settings(max_examples=80)
@given(scene=exact_scenes())
def test_overdraw_of_hostile_floats_is_that_of_the_reference(isa, scene):
    with on(isa):
        assert (overdraw(scene) == exact_overdraw(*scene.arrays, **scene.view)).all()


@ON_EACH_ISA
@settings(max_examples=40)
@given(scene=exact_scenes(), x=st.integers(-12, 20), y=st.integers(-9, 12), width=st.integers(1, 30))
def test_window_holds_the_crop(isa, scene, x, y, width):
    with on(isa):
        whole = overdraw(soup(scene.vertices, (64, 48)), origin=(-16, -16))
        part = overdraw(soup(scene.vertices, (width, 20)), origin=(x, y))
    assert (part == whole[y + 16 : y + 36, x + 16 : x + 16 + width]).all()


@ON_EACH_ISA
@settings(max_examples=30)
@given(scene=exact_scenes(6), cull=st.sampled_from(["back", "front"]))
def test_cull_goes_by_the_exact_turn(isa, scene, cull):
    with on(isa):
        assert (overdraw(scene, cull=cull) == exact_overdraw(*scene.arrays, **scene.view, cull=cull)).all()


@settings(max_examples=12)
@given(scene=exact_scenes(3), n_samples=st.sampled_from([2, 4, 8, 16]))
def test_samples_are_those_of_the_reference(scene, n_samples):
    covered = sampling.sample_coverage(*scene.arrays, n_samples, **scene.view)
    share = tl.coverage(*scene.arrays, **scene.view, sampling=f"msaa{n_samples}")
    assert (share == covered.mean(axis=-1, dtype=np.float32)).all()


@pytest.mark.parametrize("depth_test", ["less", "greater", None])
@settings(max_examples=25)
@given(scene=exact_scenes(3), seed=st.integers(0, 99))
def test_depth_is_that_of_the_plane_that_is_not_moved(depth_test, scene, seed):
    scene = with_depth(scene, np.random.default_rng(seed))
    frags = tl.rasterize(*scene.arrays, depth_test=depth_test, **scene.view)
    largest = abs(scene.vertices[:, 2]).max()
    for fragment in reference.fragments(*scene.arrays, **scene.view):
        at = fragment.row, fragment.column
        if frags.triangle[at] != fragment.piece.triangle:
            continue
        exact = float(fragment.depth())
        bound = np.spacing(np.float32(abs(exact))) / 2 + 2.0**-35 * largest
        assert abs(frags.depth[at] - exact) <= bound
    assert (frags.mask == reference.coverage(*scene.arrays, **scene.view)).all()


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64, np.int32, np.int64])
def test_numbers_of_each_type_are_kept(dtype):
    vertices = (np.random.default_rng(3).uniform(-2, 26, (60, 2))).astype(dtype)
    scene = soup(vertices, SIZE)
    assert (overdraw(scene) == exact_overdraw(*scene.arrays, **EXACT)).all()


@ON_EACH_ISA
@pytest.mark.parametrize("make", CLIP_SCENES.values(), ids=CLIP_SCENES)
def test_clip_space_is_that_of_the_reference(isa, make):
    for seed in range(2):
        scene = make(np.random.default_rng(seed))
        view = scene.view | EXACT
        with on(isa):
            assert (tl.overdraw(*scene.arrays, **view) == exact_overdraw(*scene.arrays, **view)).all()


@settings(max_examples=40)
@given(scene=clip_scenes())
def test_ids_of_clip_space_are_those_of_the_reference(scene):
    view = scene.view | EXACT
    frags = tl.rasterize(*scene.arrays, depth_test=None, **view)
    assert (frags.triangle == reference.ids(*scene.arrays, depth_test=None, **view)).all()


def largest_error(found, exact):
    """The largest distance of float32 numbers from fractions."""
    return max(abs(f - float(e)) for f, e in zip(found.ravel().tolist(), exact.ravel().tolist(), strict=True))


@pytest.mark.parametrize("make", CLIP_SCENES.values(), ids=CLIP_SCENES)
def test_weights_of_clip_space_are_those_of_the_reference(make):
    scene = make(np.random.default_rng(1))
    view = scene.view | EXACT
    weights = tl.rasterize(*scene.arrays, depth_test=None, **view).barycentric()
    exact = reference.barycentric(*scene.arrays, depth_test=None, **view)
    assert largest_error(weights, exact) <= 2.0**-23  # half a unit of float32 below 2, and what float64 errs by


@settings(max_examples=30)
@given(scene=exact_scenes(3), seed=st.integers(0, 99))
def test_weights_and_values_of_hostile_floats_are_those_of_the_reference(scene, seed):
    values = np.random.default_rng(seed).uniform(0, 1, (len(scene.vertices), 2)).astype(np.float32)
    frags = tl.rasterize(*scene.arrays, **scene.view)
    assert largest_error(frags.barycentric(), reference.barycentric(*scene.arrays, **scene.view)) <= 2.0**-24
    exact = reference.interpolate(*scene.arrays[:2], values, scene.size, **scene.view)
    assert largest_error(frags.interpolate(values), exact) <= 2.0**-24


# ---- named scenes ---------------------------------------------------------------------------------------------------


@ON_EACH_ISA
def test_kettner_grid_of_nearly_collinear_corners_turns_as_it_does(isa):
    corners = [kettner_grid(i, j) for i in range(0, 256, 17) for j in range(0, 256, 17)]
    scene = soup(np.concatenate(corners), (26, 26))
    turns = [np.sign(a[1] - a[0]) for a, _, _ in corners]  # of b - p and c - p with b, c on the diagonal
    with on(isa):
        picture = overdraw(scene)
        drawn = [overdraw(soup(c, (26, 26)), cull="back").any() for c in corners]
    assert (picture == exact_overdraw(*scene.arrays, **EXACT)).all()
    assert not any(is_drawn for turn, is_drawn in zip(turns, drawn, strict=True) if turn == 0)


@ON_EACH_ISA
def test_kettner_points_a1_are_drawn_as_they_lie(isa):
    i, j, k = np.array(np.meshgrid(*[np.arange(9)] * 3)).reshape(3, -1)
    triangles = np.stack([i, j, k], 1)[(i < j) & (j < k)]
    with on(isa):
        picture = tl.overdraw(KETTNER_A1, triangles, (28, 28), **EXACT)
    assert (picture == exact_overdraw(KETTNER_A1, triangles, (28, 28), **EXACT)).all()


@ON_EACH_ISA
@pytest.mark.parametrize("step", [2.0**-52, 2.0**-48, 2.0**-30])
def test_shewchuk_tilted_grid_covers_each_pixel_once(isa, step):
    vertices, triangles = tilted_grid(step=step)
    with on(isa):
        inner = tl.overdraw(vertices, triangles, (24, 24), **EXACT)[1:22, 1:22]
    assert (inner == 1).all()


# ---- watertight -----------------------------------------------------------------------------------------------------


@ON_EACH_ISA
@one_by_one("side", [1 / 3, 1, 2, 3, 7, 13, 40])
@pytest.mark.parametrize("n_steps", [0, 2])
def test_lattice_on_centres_covers_each_pixel_once(isa, side, n_steps):
    vertices, triangles = lattice(side, 0.5, n_steps, np.random.default_rng(5))
    with on(isa):
        counts = tl.overdraw(vertices, triangles, (96, 64), **EXACT)
    assert (counts == 1).all()


@ON_EACH_ISA
@pytest.mark.parametrize("hub", [(48.5, 32.5), (48.1 + 0.2 + 0.2, 32.3 + 0.1 + 0.1), (np.nextafter(48.5, 0), 32.5)])
def test_fan_of_needles_about_a_centre_covers_each_pixel_once(isa, hub):
    angle = np.sort(np.random.default_rng(7).uniform(0, 2 * np.pi, 5000))
    ring = hub + 200 * np.stack([np.cos(angle), np.sin(angle)], -1)
    i = np.arange(1, 5001)
    triangles = np.stack([0 * i, i, np.roll(i, -1)], 1)
    with on(isa):
        counts = tl.overdraw(np.concatenate([[hub], ring]), triangles, (96, 64), **EXACT)
    assert (counts == 1).all()


@ON_EACH_ISA
@pytest.mark.parametrize("far", [1e7, 1e15, 1e300])
def test_corners_far_away_leave_no_gap(isa, far):
    """A fan over the whole picture, whose corners lie on four rays: products of 1e300 overflow float64."""
    rng = np.random.default_rng(11)
    hub = rng.uniform(20, 40, 2)
    vertices = np.array([hub, [far, -far / 3], [far / 7, far], [-far, far / 5], [-far / 9, -far]])
    triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]
    with on(isa):
        counts = tl.overdraw(vertices, triangles, (64, 48), **EXACT)
    assert (counts == 1).all()


def test_t_junction_on_the_line_to_the_last_bit_is_closed():
    """(0.1, 0.1) lies on the line from 0 to (0.3, 0.3) exactly, and so do its halves: all are drawn as they are."""
    t, far = 0.1 * 200, 0.3 * 200
    vertices = np.array([[0, 0], [t, t], [far, far], [far, 0], [0, far]])
    counts = tl.overdraw(vertices, [[0, 1, 4], [1, 2, 4], [0, 2, 3]], (60, 60), **EXACT)
    assert (counts == 1).all()


# ---- the same bits --------------------------------------------------------------------------------------------------


def mixed_scene(rng, n=3000, size=(200, 140)):
    """Triangles of 0.5 to 150 px with depth, some of them on 2**-8 px."""
    sides = rng.choice([0.5, 3, 9, 25, 150], (n, 1, 1), p=[0.3, 0.3, 0.2, 0.15, 0.05])
    corners = rng.uniform(-10, size, (n, 1, 2)) + rng.uniform(-0.5, 0.5, (n, 3, 2)) * sides
    corners[::7] = np.round(corners[::7] * 2) / 2
    return soup(np.concatenate([corners, rng.uniform(-2, 2, (n, 3, 1))], -1).reshape(-1, 3), size)


def test_every_instruction_set_and_thread_count_draws_the_same_bits():
    """With threads that set up all triangles, and with threads that each take a share of them."""
    scene = mixed_scene(np.random.default_rng(1))
    pictures = []
    for isa in tl.build_info()["isa_available"]:
        with on(isa):
            for threads, is_sliced in ((1, False), (2, False), (2, True), (3, True), (8, True)):
                with sharing(is_sliced):
                    frags = tl.rasterize(*scene.arrays, **EXACT, threads=threads)
                    squares = [overdraw(scene, threads=threads, sampling=kind) for kind in SQUARES]
                    counts = overdraw(scene, threads=threads, origin=(7, 11))
                    pictures.append((frags.triangle, frags.depth, overdraw(scene, threads=threads), counts, *squares))
    for other in pictures[1:]:
        for mine, first in zip(other, pictures[0], strict=True):
            comparing.assert_same(mine, first)


def test_depth_of_a_window_is_that_of_the_picture():
    scene = mixed_scene(np.random.default_rng(2))
    whole = tl.rasterize(*scene.arrays, **EXACT)
    part = tl.rasterize(*scene.arrays[:2], (90, 77), origin=(37, 21), **EXACT)
    comparing.assert_same(part.depth, whole.depth[21:98, 37:127])


@ON_EACH_ISA
def test_vertices_on_the_grid_give_the_snapped_picture(isa):
    scene = mixed_scene(np.random.default_rng(4))
    vertices = np.round(scene.vertices[:, :2] * 256) / 256
    with on(isa):
        for kind in ("center", *SQUARES):
            exact = tl.overdraw(vertices, scene.triangles, scene.size, **EXACT, sampling=kind)
            assert (exact == tl.overdraw(vertices, scene.triangles, scene.size, sampling=kind)).all()


def count(vertices, size, band):
    """Draw counts with bands of a width other than the proved one."""
    triangles = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    out = np.empty(size[::-1], np.int32)
    exact = engine.UnsnappedPoints(vertices, triangles, band=band)
    how, records = (0, 0, 8, 0, 0, 0), np.empty(0, np.uint8)
    source = engine.Source(vertices)
    mesh = engine.SnappedMesh(source, records, None, triangles, None, how, None, exact=exact)
    mesh.draw(engine.Target(1, out, None, None), 0, size[1])
    return out


@pytest.mark.parametrize("isa", [isa for isa in tl.build_info()["isa_available"] if isa != "scalar"])
@pytest.mark.parametrize("edge", BITING_EDGES)
def test_bands_a_quarter_as_wide_draw_wrong_pixels(isa, edge):
    """What the proof of the bands is for; scalar lanes take no float32 for boxes of this size."""
    vertices = np.concatenate([edge, [[7.3, 3.3]]])
    expected = exact_overdraw(vertices, [[0, 1, 2]], (64, 56), **EXACT)
    with on(isa):
        assert (count(vertices, (64, 56), 1.0) == expected).all()
        assert (count(vertices, (64, 56), 0.25) != expected).any()


def beside_samples(rng, n, reach, side=2.0):
    """Corners (n, 3, 2) of triangles of up to 2 `side`, 8 px apart, of which an edge passes a sample within `reach`."""
    place = np.arange(n)[:, None] // [1, 126] % 126 * 8 + 8.5 + rng.integers(0, 3, (n, 2))
    along = rng.uniform(-side, side, (n, 2))
    across = along[:, ::-1] * [-1, 1] / np.linalg.norm(along, axis=1, keepdims=True)
    share, near = rng.uniform(0.05, 0.95, (n, 1)), place + across * rng.uniform(-reach, reach, (n, 1))
    third = place + across * rng.choice([-1, 1], (n, 1)) + along * rng.uniform(-0.5, 0.5, (n, 1))
    return np.stack([near - share * along, near + (1 - share) * along, third], axis=1)


@ON_EACH_ISA
def test_bands_of_small_boxes_draw_wrong_pixels_when_they_are_a_twentieth_as_wide(isa):
    """Edges that pass samples within 2**-22 px: float32 errs by less than the proof allows, but by more than that."""
    size = 1024, 1024
    vertices = beside_samples(np.random.default_rng(0), 100_000, 2.0**-22).reshape(-1, 2)
    with on(isa):
        proved = count(vertices, size, 1.0)
        assert (count(vertices, size, 0.05) != proved).any()
        assert (count(vertices, size, 2.0) == proved).all()


# ---- other verbs, and what is refused -------------------------------------------------------------------------------


@ON_EACH_ISA
@pytest.mark.parametrize("size", [(1024, 1024), (8192, 64)])
def test_transform_that_rounds_nothing_changes_no_bit(isa, size):
    """Behind a transform tiny boxes are tested at vertices rounded to 2**-18 px first, in windows of up to 4096 px."""
    rng, n, half = np.random.default_rng(5), 15_000, np.array(size) / 2
    corners = beside_samples(rng, n, 2.0**-18, 0.8)
    corners[:2_000] = np.round(corners[:2_000] * 2) / 2
    reach = rng.choice([1, 20, 1e4, 1e6], (2_000, 1, 1))
    corners[-2_000:] += rng.uniform(-1, 1, (2_000, 3, 2)) * reach
    corners = np.round(corners * 2.0**30) / 2.0**30
    depth = rng.integers(0, 2**16, (n, 3, 1)) / 2.0**17 + 0.25
    pixels = np.concatenate([corners, depth], axis=2).reshape(-1, 3)
    clip = np.concatenate([(pixels[:, :2] - half) / half * [1, -1], 2 * pixels[:, 2:] - 1], axis=1)
    triangles = np.arange(3 * n, dtype=np.int32).reshape(-1, 3)
    with on(isa):
        expected = tl.rasterize(pixels, triangles, size, **EXACT)
        found = tl.rasterize(clip, triangles, size, transform=np.eye(4), **EXACT)
    assert (found.triangle == expected.triangle).all()
    assert (found.depth == expected.depth).all()


def test_samples_of_fill_and_rasterize_are_those_of_coverage():
    scene = mixed_scene(np.random.default_rng(6), 300)
    vertices, triangles = scene.vertices[:, :2], scene.triangles
    options = EXACT | {"sampling": "msaa4"}
    frags = tl.rasterize(vertices, triangles, scene.size, **options)
    share = (frags.samples_triangle >= 0).mean(axis=-1, dtype=np.float32)
    assert (share == tl.coverage(vertices, triangles, scene.size, **options)).all()
    white = tl.fill(vertices, triangles, np.ones((len(triangles), 1), np.float32), scene.size, **options)
    assert (white[..., 0] == share).all()


TRIANGLE = [[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 4)


@pytest.mark.parametrize(
    ("verb", "options", "message"),
    [
        (tl.coverage, {"sampling": "area"}, r"subpixel_bits must be in 0\.\.16 for sampling 'area', got 'exact'"),
        (tl.coverage, {"method": "float_barycentric"}, r"0\.\.16 for method 'float_barycentric.*got 'exact'"),
        (tl.coverage, {"origin": (2**48, 0)},
         "origin and size must lie within 281474976710656 pixels of 0 for 'exact'"),
        (tl.coverage, {"subpixel_bits": "exacter"}, "subpixel_bits must be an integer, got 'exacter'"),
    ],
)  # fmt: skip
def test_what_is_not_there_says_so(verb, options, message):
    with pytest.raises((ValueError, TypeError), match=message):
        verb(*TRIANGLE, **EXACT | options)


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        (
            [[0, 0], [np.nan, 0], [0, 4]],
            r"vertices must be finite where a triangle uses them, got \[nan, 0.0\] in row 1",
        ),
        ([[0, 0], [4, -np.inf], [0, 4]], r"vertices must be finite where a triangle uses them, got \[4.0, -inf\]"),
        ([[0, 0], [2**53 + 2, 0], [0, 4]], r"vertices must lie within 2\*\*53 as integers for 'exact'"),
        ([[0, 0, 0, 1], [1, 0, np.inf, 1], [0, 1, 0, 1]], r"vertices must be finite where .*, inf, 1.0\] in row 1"),
    ],
)
def test_vertices_that_cannot_be_drawn_are_named(vertices, message):
    with pytest.raises(ValueError, match=message):
        tl.overdraw(vertices, [[0, 1, 2]], (4, 4), **EXACT)


def test_error_leaves_no_trace_in_out():
    out = np.full((4, 4), 7, np.int32)
    with pytest.raises(ValueError, match="finite"):
        tl.overdraw([[0, 0], [np.inf, 0], [0, 4]], [[0, 1, 2]], (4, 4), out=out, **EXACT)
    assert (out == 7).all()


def test_depth_that_float32_cannot_hold_is_named():
    with pytest.raises(ValueError, match="vertices must have a depth that float32 can hold"):
        tl.rasterize([[0, 0, 0], [4, 0, 1e39], [0, 4, 0]], *TRIANGLE[1:], **EXACT)
