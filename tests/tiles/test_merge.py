"""Visibility buffers of shares of the triangles make that of all, to the bit."""

import functools
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import topleft as tl


def whole_and_scene(seed, depth_test, n=40, size=(37, 29), flat=False):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-5, 42, (30, 3))
    points[:, 2] = rng.integers(0, 3, 30) / 2 if flat else points[:, 2]
    triangles = rng.integers(0, 30, (n, 3))
    return points, triangles, tl.rasterize(points, triangles, size, depth_test=depth_test)


def assert_merged(found, whole):
    """Ids and depths that were merged are those that were drawn at once."""
    for got, expected in zip(found, (whole.samples_triangle, whole.samples_depth), strict=True):
        assert got.tobytes() == expected.tobytes()


@given(
    seed=st.integers(0, 2**32),
    cuts=st.lists(st.integers(0, 40), max_size=5),
    depth_test=st.sampled_from(["less", "greater", None]),
    flat=st.booleans(),
    order=st.randoms(use_true_random=False),
)
@settings(max_examples=60, deadline=None)
def test_neighbouring_shares_in_any_order_make_the_whole(seed, cuts, depth_test, flat, order):
    points, triangles, whole = whole_and_scene(seed, depth_test, flat=flat)
    bounds = [0, *sorted(cuts), 40]
    shares = list(itertools.pairwise(bounds))
    order.shuffle(shares)
    buffers = (tl.rasterize(points, triangles[a:b], (37, 29), depth_test=depth_test) for a, b in shares)
    assert_merged(tl.merge(buffers, triangles=[a for a, _ in shares], depth_test=depth_test), whole)


@pytest.mark.parametrize("depth_test", ["less", "greater", None])
@pytest.mark.parametrize("threads", [1, 3])
def test_scattered_shares_make_the_whole(depth_test, threads):
    points, triangles, whole = whole_and_scene(9, depth_test)
    owner = np.random.default_rng(2).integers(0, 3, 40)
    shares = [np.flatnonzero(owner == i) for i in range(3)]
    buffers = [tl.rasterize(points, triangles[own], (37, 29), depth_test=depth_test) for own in shares]
    assert_merged(tl.merge(buffers, triangles=shares, depth_test=depth_test, threads=threads), whole)
    assert (buffers[1].triangle < len(shares[1])).all()  # what was given is as it was


def test_merging_in_a_tree_is_merging_at_once():
    points, triangles, whole = whole_and_scene(11, "less")
    buffers = []
    for first in range(0, 40, 10):
        frags = tl.rasterize(points, triangles[first : first + 10], (37, 29))
        ids = np.where(frags.triangle < 0, -1, frags.triangle + first).astype(np.int32)
        buffers.append((ids, frags.depth))
    pairs = [tl.merge(buffers[i : i + 2]) for i in (0, 2)]
    assert_merged(functools.reduce(lambda a, b: tl.merge([a, b]), pairs), whole)


def test_samples_are_merged_one_by_one():
    points, triangles, _ = whole_and_scene(12, "less")
    whole = tl.rasterize(points, triangles, (37, 29), sampling="msaa4")
    shares = [tl.rasterize(points, triangles[a : a + 20], (37, 29), sampling="msaa4") for a in (0, 20)]
    assert_merged(tl.merge(shares, triangles=[0, 20]), whole)


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_scenes_are_merged_with_their_instances(sampling):
    """Ids of a scene are those of all triangles; shares of its instances make the whole."""
    cube = tl.Mesh(*tl.scenes.cube())
    moved = [np.eye(4) for _ in range(4)]
    for i in range(4):
        moved[i][:3, 3] = i, 0.3 * i, -0.5 * i
    scene = tl.Scene([tl.Instance(cube, place) for place in moved])
    camera = tl.Camera.framing(scene)
    whole = tl.rasterize_mesh(scene, camera, (67, 41), sampling=sampling)
    parts = [tl.Scene(scene.instances[i : i + 2]) for i in (0, 2)]
    shares = [tl.rasterize_mesh(part, camera, (67, 41), sampling=sampling) for part in parts]
    ids, depth = tl.merge(shares, triangles=[0, 2 * len(cube.triangles)])
    wished = (whole.samples_id, whole.samples_depth) if sampling == "msaa4" else (whole.id, whole.depth)
    assert len(np.unique(whole.instance)) == 5
    assert np.array_equal(ids, wished[0])
    assert np.array_equal(depth, wished[1])


def test_merge_of_equal_depths_takes_the_lower_index():
    rng = np.random.default_rng(1)
    ids = rng.integers(-1, 5, (2, 1003)).astype(np.int32)
    depth = np.where(ids < 0, np.inf, rng.integers(0, 3, ids.shape)).astype(np.float32)
    found_ids, found_depth = tl.merge([(ids[0], depth[0]), (ids[1], depth[1])], triangles=[0, 5])
    names = np.where(ids < 0, 2**31, ids + np.array([[0], [5]]))
    wished = np.lexsort((names, depth), axis=0)[0]
    chosen = np.take_along_axis(names, wished[None], axis=0)[0]
    assert np.array_equal(found_ids, np.where(chosen == 2**31, -1, chosen))
    assert np.array_equal(found_depth, depth.min(axis=0))


IDS, DEPTH = np.zeros((2, 3), np.int32), np.zeros((2, 3), np.float32)


def altered(ids=IDS, depth=DEPTH):
    """A visibility buffer whose arrays somebody has replaced."""
    frags = tl.points([(1, 1, 0.5)], (3, 2))
    frags.id, frags._depth, frags._planes = ids, depth, (ids[None], depth[None])
    return frags


@pytest.mark.parametrize(
    ("buffers", "options", "error", "message"),
    [
        ([altered(depth=DEPTH[:1])], {}, ValueError, r"one shape, got \(2, 3\) and \(1, 3\)"),
        ([altered(ids=IDS[:0])], {}, ValueError, r"one shape, got \(0, 3\) and \(2, 3\)"),
        ([altered(ids=IDS.astype(np.int64))], {}, TypeError, "got int64 and float32 as buffer 0"),
        ([altered(depth=DEPTH.astype(np.float64))], {}, TypeError, "got int32 and float64 as buffer 0"),
        ([], {}, ValueError, "buffers must be at least one, got none"),
        ([5], {}, TypeError, r"buffers must be Fragments or pairs \(ids, depth\), got 5 as buffer 0"),
        ([(IDS, IDS)], {}, TypeError, "buffers must be int32 and float32, got int32 and int32 as buffer 0"),
        ([(IDS, DEPTH[:1])], {}, ValueError, "buffers must have ids and depth of one shape"),
        ([(IDS, DEPTH), (IDS[:1], DEPTH[:1])], {}, ValueError, r"have one shape, got \(1, 3\) as buffer 1"),
        ([(IDS, DEPTH)], {"triangles": []}, ValueError, "triangles must have an item for each buffer, got 0"),
        ([(IDS, DEPTH)], {"triangles": [0, 1]}, ValueError, "an item for each buffer, got 2 for 1"),
        ([(IDS, DEPTH)], {"triangles": [-1]}, ValueError, "triangles must be indices from 0 to"),
        ([(IDS - 1, DEPTH)], {"triangles": [2**31]}, ValueError, "triangles must be indices from 0 to 2147483647"),
        ([(IDS, DEPTH)], {"triangles": [[]]}, ValueError, "triangles has 0 rows for buffer 0, in which"),
        ([(IDS, DEPTH)], {"triangles": [[5, 5]]}, ValueError, "triangles must ascend"),
        ([(IDS, DEPTH)], {"triangles": ["x"]}, TypeError, "triangles must be an index or a column of them"),
        ([(IDS, DEPTH)], {"depth_test": "nearer"}, ValueError, "depth_test must be one of"),
    ],
)  # fmt: skip
def test_wrong_buffers_are_told(buffers, options, error, message):
    with pytest.raises(error, match=message):
        tl.merge(buffers, **options)
