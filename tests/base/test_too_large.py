"""Memory that is not there: told with the bytes that are wanted, before anything is drawn."""

import numpy as np
import pytest

import topleft as tl
from topleft._core.base import memory

SCENE = [[0.0, 0, 0], [60, 0, 0.5], [0, 50, 1]], [[0, 1, 2]]
SIZE = (64, 48)
CUBE = tl.Mesh(*tl.scenes.shape("cube"))
CAMERA = tl.Camera.framing(CUBE)


class Little:
    """NumPy on a machine with little memory: what is asked for at once is refused beyond a limit."""

    def __init__(self, limit):
        self._limit = limit

    def __getattr__(self, name):
        return getattr(np, name)

    def empty(self, shape, dtype=float):
        if np.prod(shape) * np.dtype(dtype).itemsize > self._limit:
            raise MemoryError
        return np.empty(shape, dtype)


PAIRS = {
    "rasterize": (lambda: tl.rasterize(*SCENE, SIZE), 2 * 4 * 64 * 48),
    "rasterize msaa4": (lambda: tl.rasterize(*SCENE, SIZE, sampling="msaa4"), 2 * 4 * 4 * 64 * 48),
    "peel": (lambda: tl.peel(*SCENE, SIZE, layers=3), 2 * 3 * 4 * 64 * 48),
    "points": (lambda: tl.points(SCENE[0], SIZE), 2 * 4 * 64 * 48),
    "a scene": (lambda: tl.rasterize_mesh(tl.Scene([CUBE, CUBE]), CAMERA, SIZE), 2 * 4 * 64 * 48),
}


@pytest.mark.parametrize("name", PAIRS)
def test_ids_and_depth_that_do_not_fit_together_are_refused_with_their_bytes(monkeypatch, name):
    draw, n_bytes = PAIRS[name]
    monkeypatch.setattr(memory, "MIN_CHECKED_BYTES", 1)
    monkeypatch.setattr(memory, "np", Little(n_bytes))
    draw()
    monkeypatch.setattr(memory, "np", Little(n_bytes - 1))
    with pytest.raises(MemoryError, match=f"no memory for 2 arrays of {n_bytes:,} bytes together"):
        draw()


def test_a_plan_of_exact_vertices_asks_for_no_picture():
    assert tl.plan(*SCENE, (2**31 - 1, 2**31 - 1), subpixel_bits="exact").verb == "rasterize"
    assert tl.plan(*SCENE, (0, 2**31 - 1), subpixel_bits="exact", sampling="msaa16").verb == "rasterize"  # of no pixels
