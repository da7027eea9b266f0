"""The exact picture of the explorer is that of the reference, sample by sample."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from topleft._apps.explore.exact import draw_exact
from topleft.methods import reference
from topleft.methods.reference import sampling

SIZE, ORIGIN = (9, 7), (2, -1)

#: Halves and quarters put vertices and edges on samples; other numbers do not.
COORDINATES = st.one_of(
    st.integers(-8, 48).map(lambda n: n / 4), st.floats(-3, 14, width=32), st.just(1e7), st.just(-1e-9)
)
POINTS = st.lists(st.tuples(COORDINATES, COORDINATES), min_size=3, max_size=6)
DEPTHS = st.lists(st.sampled_from([0.0, 0.25, 0.5, 1.0]), min_size=6, max_size=6)
CORNERS = st.lists(st.tuples(*[st.integers(0, 2)] * 3), min_size=1, max_size=4)


@given(POINTS, CORNERS, st.sampled_from([1, 2, 4]))
def test_exact_owners_and_counts_are_those_of_the_reference(points, corners, n_samples):
    vertices, triangles = np.array(points), np.array(corners) + len(points) - 3
    positions = sampling.SAMPLE_POSITIONS[n_samples]
    owners, counts = draw_exact(vertices, triangles, SIZE, ORIGIN, positions)
    for k, sample in enumerate(positions):
        view = {"origin": ORIGIN, "sample": sample, "subpixel_bits": "exact"}
        assert (owners[..., k] == reference.ids(vertices, triangles, SIZE, **view)).all()
        assert (counts[..., k] == reference.overdraw(vertices, triangles, SIZE, **view)).all()


@given(POINTS, CORNERS, DEPTHS, st.sampled_from(["less", "greater"]), st.sampled_from(["none", "back", "front"]))
def test_exact_owners_with_depth_are_those_of_the_reference(points, corners, depths, depth_test, cull):
    vertices = np.column_stack([np.array(points), depths[: len(points)]])
    triangles = np.array(corners) + len(points) - 3
    owners, _ = draw_exact(vertices, triangles, SIZE, ORIGIN, ((0, 0),), cull=cull, depth_test=depth_test)
    view = {"origin": ORIGIN, "subpixel_bits": "exact", "cull": cull}
    assert (owners[..., 0] == reference.ids(vertices, triangles, SIZE, depth_test=depth_test, **view)).all()
