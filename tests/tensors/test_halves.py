"""What lies across the edges of triangles."""

import numpy as np
import pytest

from topleft._core.gradients.tensors import find_halves_across


def halves_across(triangles):
    """Return the same as a loop over the edges."""
    at_edge, starts = {}, {}
    for i, corners in enumerate(triangles.tolist()):
        for k in range(3):
            start, end = corners[(k + 1) % 3], corners[(k + 2) % 3]
            at_edge.setdefault((min(start, end), max(start, end)), []).append(3 * i + k)
            starts[3 * i + k] = start
    found = np.full(triangles.size, -1)
    for halves in at_edge.values():
        for half, other in zip(halves, halves[1:] + halves[:1], strict=True):
            if half != other:
                found[half] = -2 - other if len(halves) > 2 or starts[half] == starts[other] else other
    return found.reshape(triangles.shape)


@pytest.mark.parametrize("n_vertices", [2, 4, 9])
def test_halves_across_are_those_of_a_loop(n_vertices):
    rng = np.random.default_rng(n_vertices)
    for n in (0, 1, 2, 5, 30):
        triangles = rng.integers(0, n_vertices, (n, 3)).astype(np.int32)
        np.testing.assert_array_equal(find_halves_across(triangles), halves_across(triangles))


def test_halves_across_of_three_at_an_edge_look_at_the_next():
    found = find_halves_across(np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], np.int32))
    assert found[:, 2].tolist() == [-2 - 5, -2 - 8, -2 - 2]
