"""Each choice is enough: hundreds of random scenes, drawn with the choice forced on and off, have the same bits."""

from dataclasses import fields

import numpy as np
import pytest

import topleft as tl
from topleft._core.base.memory import KeptMemory
from topleft._core.base.options import Sink
from topleft._core.raster import choices, sampling, snap
from topleft._core.raster.costs import Costs, cost_table
from topleft._core.raster.snap import snap_mesh
from topleft._core.raster.view import View

SIZE = (21, 17)


def random_triangles(rng, n_components=2):
    """Vertices and triangles of a small scene: of all sizes, some without area, some far outside."""
    n = int(rng.integers(1, 40))
    centre = rng.uniform(-6, 26, (n, 1, 2))
    reach = rng.choice([0.4, 2.0, 8.0, 60.0, 3000.0], (n, 1, 1), p=[0.2, 0.3, 0.3, 0.15, 0.05])
    xy = centre + reach * rng.uniform(-1, 1, (n, 3, 2))
    if rng.integers(3) == 0:
        xy = np.rint(xy)
    vertices = xy.reshape(-1, 2)
    if n_components == 3:
        vertices = np.hstack([vertices, rng.uniform(-1, 1, (3 * n, 1))])
    return vertices, np.arange(3 * n, dtype=rng.choice([np.int32, np.int64])).reshape(n, 3)


def bits_of(frags):
    """Ids and the bits of depth."""
    return np.stack([frags.triangle, frags.depth.view(np.int32)])


def both_ways(draw, **forced):
    """What is drawn with a choice as it is made, and with it forced."""
    chosen = draw()
    with choices.forced(**forced):
        return chosen, draw()


@pytest.mark.parametrize("depth_test", ["less", "greater", None])
def test_flat_depth_left_out_gives_the_same_bits(depth_test):
    rng = np.random.default_rng(1)
    n_flat = 0
    for _ in range(150):
        vertices, triangles = random_triangles(rng, int(rng.integers(2, 4)))
        if vertices.shape[1] == 3:
            vertices[:, 2] = rng.choice([0.0, -0.0, 0.5, -3.7, 1e-300, -1e-300, 1e-42, 3e38])
        options = {
            "depth_test": depth_test,
            "background_depth": rng.choice([None, 7.0]),
            "cull": str(rng.choice(["none", "back"])),
            "threads": int(rng.integers(1, 4)),
        }

        def draw(arrays=(vertices, triangles), options=options):
            return tl.rasterize(*arrays, SIZE, **options)

        never, always = both_ways(draw, pays_without_depth=True)
        assert (bits_of(never) == bits_of(always)).all()
        assert (never.barycentric() == always.barycentric()).all()
        n_flat += never.mask.any()
    assert n_flat > 100


def random_affine(rng):
    """A matrix whose last row is 0 0 0 1, from object space of about [-1, 1] to clip space."""
    matrix = np.eye(4)
    matrix[:3] = rng.uniform(-1, 1, (3, 4)) * rng.choice([0.3, 1.0, 4.0])
    if rng.integers(4) == 0:
        matrix[3, 3] = -0.0 + 1
    return matrix


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_weights_without_w_have_the_same_bits(dtype, monkeypatch):
    rng = np.random.default_rng(2)
    for _ in range(200):
        n = int(rng.integers(1, 40))
        vertices = rng.uniform(-1.2, 1.2, (3 * n, 3)) * rng.choice([1.0, 1.0, 1e6], (3 * n, 1))
        vertices[rng.integers(0, 3 * n)] *= rng.choice([1.0, 1e30])
        options = {
            "transform": random_affine(rng),
            "near_clip": bool(rng.integers(2)),
            "far_clip": bool(rng.integers(2)),
            "clip_depth": str(rng.choice(["minus_one_to_one", "zero_to_one"])),
        }
        triangles = np.arange(3 * n).reshape(n, 3)

        def draw(vertices=vertices, triangles=triangles, options=options):
            try:
                frags = tl.rasterize(vertices.astype(dtype), triangles, SIZE, **options)
                return np.concatenate([bits_of(frags), frags.barycentric().view(np.int32).transpose(2, 0, 1)])
            except ValueError as error:
                return str(error)

        chosen = draw()
        with monkeypatch.context() as patch:
            patch.setattr(snap, "is_affine", lambda _: False)
            assert np.array_equal(chosen, draw())


@pytest.mark.parametrize("row", [[0, 0, 0, 2], [0, 0, 1e-30, 1], [0, 0, 0, -1], [1, 0, 0, 0]])
def test_weights_have_w_unless_every_w_is_one(row):
    matrix = np.eye(4)
    matrix[3] = row
    assert not snap.is_affine(matrix)


def test_threads_over_arrays_give_the_same_bits():
    rng = np.random.default_rng(4)
    for _ in range(500):
        vertices, triangles = random_triangles(rng, 3)
        triangles = triangles.astype(np.int64)

        def draw(arrays=(vertices, triangles)):
            return bits_of(tl.rasterize(*arrays, SIZE, threads=3))

        chosen, forced = both_ways(draw, pays_to_share=True)
        assert (chosen == forced).all()


@pytest.mark.parametrize(
    ("points", "depth"),
    [
        ([[0, 0, 2.5], [1, 1, 2.5]], 2.5),
        ([[0, 0, -0.0], [1, 1, 0.0]], 0.0),
        ([[0, 0, 1], [1, 1, 1], [2, 2, 2], [3, 3, 1], [4, 4, 1], [5, 5, 1]], None),
        ([[0, 0, np.nan]], None),
        (np.empty((0, 3)), None),
    ],
)
def test_common_depth_is_that_of_every_vertex(points, depth):
    assert choices.common_depth(np.asarray(points), has_depth=True, is_clip_space=False) == depth


def test_clip_space_is_never_flat():
    assert choices.common_depth(np.ones((3, 4)), has_depth=True, is_clip_space=True) is None


def test_sinks_of_fragments():
    found = [choices.fragment_sink(test, has_depth=True) for test in (None, "less", "greater")]
    assert found == [Sink.PAINT, Sink.NEAREST, Sink.FARTHEST]
    assert choices.fragment_sink("less", has_depth=False) is Sink.PAINT


def test_vertices_without_depth_are_planned_as_they_are_drawn():
    vertices, triangles = random_triangles(np.random.default_rng(5))
    plan = tl.plan(vertices, triangles, SIZE).measure(1)
    (stage,) = (one for one in plan.stages if one.name == "depth")
    assert (stage.choice, stage.timed_in) == ("no test, ids alone", "method")
    assert "depth" not in plan.measured_ms


def test_depth_is_left_out_where_that_pays():
    def is_left_out(n, size_px, size):
        rng = np.random.default_rng(9)
        corners = np.array([[0, 0], [size_px, 0], [0, size_px]])
        vertices = (rng.uniform(0, size[0], (n, 1, 2)) + corners).reshape(-1, 2)
        vertices = np.hstack([vertices, np.full((3 * n, 1), 0.5)])
        plan = tl.plan(vertices, np.arange(3 * n).reshape(n, 3), size)
        return next(one.choice for one in plan.stages if one.name == "depth") == "no test, ids alone"

    assert is_left_out(4000, 20, (512, 512))
    assert not is_left_out(400, 20, (512, 512))
    assert is_left_out(4000, 20, (128, 128))
    assert not is_left_out(100, 20, (128, 128))
    assert is_left_out(20, 2000, (512, 512))


def random_clip_space(rng):
    """Vertices and triangles of a small scene in clip space, many of them cut by the near and far planes."""
    n = int(rng.integers(1, 40))
    vertices = rng.uniform(-1.5, 1.5, (3 * n, 4))
    vertices[:, 3] = rng.uniform(-0.5, 2.0, 3 * n)
    return vertices, np.arange(3 * n, dtype=np.int32).reshape(n, 3)


@pytest.mark.parametrize("n_components", [3, 4])
def test_samples_in_bands_and_whole_give_the_same_bits(force, n_components):
    rng = np.random.default_rng(7)
    force(plane_bytes=8 * SIZE[0] * 4)  # bands of four rows
    for _ in range(300):
        vertices, triangles = random_clip_space(rng) if n_components == 4 else random_triangles(rng, 3)
        options = {"sampling": "msaa4", "cull": str(rng.choice(["none", "back", "front"])), "threads": 1}

        def draw(arrays=(vertices, triangles), options=options):
            frags = tl.rasterize(*arrays, SIZE, **options)
            return np.stack([frags.samples_triangle, frags.samples_depth.view(np.int32)])

        chosen, whole = both_ways(draw, can_slice=False)
        assert (chosen == whole).all()


def test_colours_with_labels_and_without_are_the_same():
    rng = np.random.default_rng(9)
    for _ in range(300):
        vertices, triangles = random_triangles(rng)
        colors = rng.integers(0, 256, (len(triangles), int(rng.integers(1, 5))), np.uint8)

        def draw(arrays=(vertices, triangles, colors)):
            return tl.fill(*arrays, SIZE, per="triangle")

        labels, direct = (both_ways(draw, is_direct=v)[1] for v in (False, True))
        assert (labels == direct).all()


def listed_in_bands(vertices, cull="none"):
    """How many triangles the four bands of a picture of 16x16 pixels list together."""
    view = View.parse((16, 16), {"sampling": "msaa4", "cull": cull})
    triangles = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    snapped = snap_mesh(KeptMemory(), vertices, triangles, view, with_depth=False, out=None)
    positions = sampling.sample_positions(4, view.grid_bits)
    bins = sampling.SamplePass(KeptMemory(), snapped.mesh, positions, 1).sort_bands((16, 16), 64)
    assert bins.n_bands == 4
    return bins.n_listed


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        ([[-1, 0.9, 0, 1], [1, 0.9, 0, 1], [0, 0.6, 0, 1]], 1),  # in the first rows
        ([[-1, 0.9, 0, 1], [1, 0.9, 0, 1], [0, -0.9, 0, 1]], 4),
        ([[-1, 0.9, -3, 1], [1, 0.9, -3, 1], [0, 0.6, -3, 1]], 0),  # nothing in front of the near plane
        ([[-1, 0.9, 0, 1], [1, 0.9, 0, 1], [0, 0.6, -3, 1]], 1),  # cut
        ([[-1, 0.9, 0, 1], [1, 0.9, 0, 1], [0, -0.9, -3, 1]], 2),  # what is left of it is a third as tall
    ],
)
def test_bands_list_what_reaches_into_them(corners, expected):
    assert listed_in_bands(np.array(corners, float)) == expected


def test_cut_triangles_that_are_turned_away_are_in_no_band():
    corners = np.array([[-1, 0.9, 0, 1], [1, 0.9, 0, 1], [0, 0.6, -3, 1.0]])
    assert sorted(listed_in_bands(corners, side) for side in ("back", "front")) == [0, 1]


def guess_of(vertices, size, **view):
    """What a scene in pixels seems to hold: triangles in the picture, layers, and rows."""
    triangles = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    checked = View.parse(size, view)
    return snap_mesh(KeptMemory(), vertices, triangles, checked, with_depth=False, out=None).work.guess


def test_guess_counts_triangles_in_the_picture():
    triangle = np.array([[2.0, 2], [6, 2], [2, 6]])
    vertices = np.concatenate([triangle + [20 * i, 0] for i in range(4)])
    assert guess_of(vertices, (20, 10)) == (1.0, 8 / 200, 4.0)
    assert guess_of(vertices, (40, 10)) == (2.0, 16 / 400, 8.0)
    assert guess_of(vertices, (20, 10), origin=(80, 0)) == (0.0, 0.0, 0.0)


def test_guess_of_an_area_is_at_most_its_box_in_the_picture():
    assert guess_of(np.array([[-10.0, -10], [1000, -10], [-10, 1000]]), (10, 10)) == (1.0, 1.0, 10.0)
    assert guess_of(np.array([[2.0**30, 0], [0, 2.0**30], [0, 0]]), (10, 10)) == (1.0, 1.0, 10.0)


def test_guess_of_nothing_is_nothing():
    assert guess_of(np.empty((0, 2)), (10, 10)) == (0.0, 0.0, 0.0)


def test_colours_are_stored_as_they_come_where_few_are_seen():
    def is_direct(n_seen, n_hidden):
        triangle = np.array([[2.0, 2], [6, 2], [2, 6]])
        vertices = np.concatenate([np.tile(triangle, (n_seen, 1)), np.tile(triangle - 100, (n_hidden, 1))])
        order = np.random.default_rng(1).permutation(n_seen + n_hidden)
        triangles = np.arange(len(vertices)).reshape(-1, 3)[order]
        plan = tl.plan(vertices, triangles, (100, 100), outputs="color")
        return "painter's order" in next(stage.choice for stage in plan.stages if stage.name == "method")

    assert is_direct(100, 0)
    assert not is_direct(400, 0)
    assert is_direct(100, 2000)
    assert not is_direct(2000, 2000)


@pytest.mark.parametrize(
    ("n", "size_px", "size", "expected"), [(50, 60, (1920, 1080), 4), (1, 60, (300, 300), 1), (200, 900, (300, 300), 4)]
)
def test_threads_are_as_many_as_the_work_is_worth(force, n, size_px, size, expected):
    force(available_threads=4)
    vertices, triangles, _ = tl.scenes.random_triangles(n, size_px, *size)
    plan = tl.plan(vertices, triangles, size)
    assert plan.threads == expected
    assert tl.plan(vertices, triangles, size, threads=3).threads == 3


def test_threads_are_no_more_than_rows(force):
    force(available_threads=4)
    vertices, triangles, _ = tl.scenes.random_triangles(2000, 900, 4000, 2)
    assert tl.plan(vertices, triangles, (4000, 2)).threads == 2


def test_work_grows_with_what_is_seen_and_asked():
    def work(n, size_px, sink, **view):
        vertices, triangles, _ = tl.scenes.random_triangles(n, size_px)
        checked = View.parse((1920, 1080), view)
        snapped = snap_mesh(KeptMemory(), vertices, triangles, checked, with_depth=True, out=None)
        return choices.work_ns(checked, snapped.work, sink)

    few = work(1000, 40, Sink.NEAREST)
    assert few < work(2000, 40, Sink.NEAREST) < work(2000, 80, Sink.NEAREST)
    assert few > work(1000, 40, Sink.COUNT) > work(1000, 40, Sink.MASK)
    assert work(1000, 40, Sink.NEAREST, origin=(5000, 0)) == 5 * 1000 + 0.6 * 1920 * 1080
    assert work(1000, 40, Sink.NEAREST, sampling="msaa4") > 3.9 * few


@pytest.mark.parametrize("seed", range(12))
def test_no_table_of_costs_changes_a_bit(seed):
    """Every row is up to a hundred times more or less: the furthest that a file may say."""
    rng = np.random.default_rng(seed)
    wild = {
        row.name: tuple(one * 100 ** rng.uniform(-1, 1) for one in row.default)
        if isinstance(row.default, tuple)
        else row.default * 100 ** rng.uniform(-1, 1)
        for row in fields(Costs)
        if not isinstance(row.default, str)
    }
    mesh = tl.Mesh(*tl.scenes.blob(3000))
    scene = tl.Scene([mesh, (mesh, np.diag([0.5, 0.5, 0.5, 1.0]))])
    vertices, triangles = random_triangles(rng, 3)
    colors = rng.integers(0, 256, (len(triangles), 4), np.uint8)

    def draw():
        several = tl.rasterize(vertices, triangles, SIZE, sampling="msaa4", threads=2)
        found = [bits_of(tl.rasterize(vertices, triangles, SIZE)), several.samples_triangle, several.samples_depth]
        found += [tl.fill(vertices, triangles, colors, SIZE, sampling=name) for name in ("center", "msaa2", "area")]
        found += [tl.coverage(vertices, triangles, SIZE, sampling="area"), tl.overdraw(vertices, triangles, SIZE)]
        for _ in range(3):  # the third picture may be of clusters
            found += [tl.render(one, size=SIZE, sampling="msaa4", threads=2) for one in (mesh, scene)]
            found += [bits_of(tl.rasterize_mesh(mesh, size=SIZE, cull="back"))]
        return found

    for chosen, other in zip(*both_ways(draw, **wild), strict=True):
        assert chosen.tobytes() == other.tobytes()


@pytest.mark.parametrize("bits", [0, 8, 9, 16])
def test_counts_in_bands_and_as_they_come_are_equal(bits):
    rng = np.random.default_rng(bits)
    for _ in range(20):
        scene = random_triangles(rng)
        chosen, banded = both_ways(
            lambda scene=scene: tl.overdraw(*scene, SIZE, subpixel_bits=bits), pays_to_sort=True, plane_bytes=600
        )
        assert (chosen == banded).all()


def test_forced_choices_are_put_back():
    def fail():
        with choices.forced(is_flat=7, route=len, near_pixels=3):
            found.append((choices.is_flat(), choices.is_flat(1, x=2), choices.route, cost_table().near_pixels))
            with choices.forced(is_flat=8):
                found.append((choices.is_flat(), cost_table().near_pixels))
            found.append(choices.is_flat())
            raise ZeroDivisionError

    found = []
    asked, costs = choices.is_flat, cost_table()
    with pytest.raises(ZeroDivisionError):
        fail()
    assert found == [(7, 7, len, 3), (8, 3), 7]
    assert (choices.is_flat, cost_table()) == (asked, costs)


@pytest.mark.parametrize("name", ["is_flatt", "np", "Route", "forced", "ORDER_FREE"])
def test_forced_refuses_what_is_no_choice(name):
    with pytest.raises(ValueError, match=f"forced must name functions of choices or rows of Costs, got '{name}'"):
        choices.forced(**{name: 1}).__enter__()
