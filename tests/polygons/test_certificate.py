"""Which rings neither cross nor touch, and what the area of each counts: against a comparison of all edges."""

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, on
from polygon_cases import star

from topleft._core.base.memory import SCRATCH
from topleft._core.polygons.polygons import frame_of
from topleft._core.polygons.prepared import prepare
from topleft._core.polygons.rings import as_rings

SEEDS = range(60)


def certified(rings, rule="evenodd"):
    """Whether the rings of a polygon of whole sub-pixels are simple, and the weight of each."""
    found, frame = frame_of(as_rings([[np.asarray(ring) / 256 for ring in rings]]), (9, 9), (0, 0), 8, 1, 1)
    prepared = prepare(SCRATCH, found, frame, is_nonzero=rule == "nonzero")
    prepared.certify(assume_valid=False)
    return bool(prepared.compiled.which_are_simple()[0]), prepared.compiled.weights_of_rings().tolist()


def do_edges_meet(rings):
    """Whether any two edges have a point in common that is not the corner between them."""
    for ring in (kept := [ring[(ring != np.roll(ring, 1, axis=0)).any(axis=1)] for ring in rings]):
        if len(ring) < 3:
            return True
    a, b = np.concatenate(kept), np.concatenate([np.roll(ring, -1, axis=0) for ring in kept])
    follows = np.concatenate([np.roll(np.arange(len(r)), -1) + n for r, n in zip(kept, starts_of(kept), strict=True)])

    def side(p, q, r):
        return np.sign((q - p)[..., 0] * (r - p)[..., 1] - (q - p)[..., 1] * (r - p)[..., 0])

    p, q, r, s = a[:, None], b[:, None], a[None], b[None]
    meets = (side(p, q, r) * side(p, q, s) <= 0) & (side(r, s, p) * side(r, s, q) <= 0)
    meets &= (np.maximum(p, q) >= np.minimum(r, s)).all(axis=-1) & (np.maximum(r, s) >= np.minimum(p, q)).all(axis=-1)
    i = np.arange(len(a))
    d, e = b - a, (b - a)[follows]
    turns_on = (d[:, 0] * e[:, 1] != d[:, 1] * e[:, 0]) | ((d * e).sum(axis=1) > 0)
    meets[i, i] = False
    meets[i[turns_on], follows[turns_on]] = meets[follows[turns_on], i[turns_on]] = False
    return bool(meets.any())


def starts_of(rings):
    return np.cumsum([0, *(len(ring) for ring in rings[:-1])])


def comb(rng, n, size):
    """Teeth side by side, turned by any angle: boxes say nothing."""
    at, angle = np.arange(n), rng.uniform(0, 7)
    teeth = np.stack([at // 2 * 3 + at % 2, np.where(at % 2, size * rng.uniform(0.1, 1, n), 0)], 1)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.concatenate([teeth, [[2 * n, -9], [-9, -9]]]) @ turn


def spiral(rng, n, size):
    """A strip wound round a point."""
    angles = np.linspace(0.5, rng.uniform(3, 40), n)
    arms = [
        (size / 50 * angles + far)[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1) for far in (0, size / 90)
    ]
    return np.concatenate([arms[0], arms[1][::-1]])


def fractal(rng, n, size):
    """A square whose edges break again and again."""
    ring = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]) * size
    while len(ring) < n:
        along = np.roll(ring, -1, axis=0) - ring
        across = np.stack([-along[:, 1], along[:, 0]], 1) * rng.uniform(-0.15, 0.15, (len(ring), 1))
        ring = np.stack([ring, ring + along / 2 + across], 1).reshape(-1, 2)
    return ring


def noise(rng, n, size):
    return star(n, size, size * rng.choice([0, 0.02, 0.3]), rng.choice([0, 0.001]), int(rng.integers(99)))


def ring_of(seed):
    rng = np.random.default_rng(seed)
    shape = (comb, spiral, fractal, noise)[seed % 4]
    ring = np.round(shape(rng, int(rng.integers(4, 120)), rng.choice([40, 400, 4000]))).astype(np.int64)
    return np.repeat(ring, rng.integers(1, 3, len(ring)), axis=0) if seed % 5 == 0 else ring


@ON_EACH_ISA
def test_rings_are_simple_where_no_edges_meet(isa):
    found = []
    for seed in SEEDS:
        ring = ring_of(seed)
        with on(isa):
            found.append(certified([ring])[0])
        assert found[-1] == (not do_edges_meet([ring])), seed
    assert 10 < sum(found) < 55


@ON_EACH_ISA
@pytest.mark.parametrize("rule", ["evenodd", "nonzero"])
def test_weights_of_nested_rings_count_what_the_rule_holds(isa, rule):
    """Rings in rings, in any direction and order: by even-odd every second is a hole, by nonzero it depends."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        turns, order = rng.choice([-1, 1], 6), rng.permutation(6)
        circle = np.linspace(0, 2 * np.pi, 50, endpoint=False)
        unit = np.stack([np.cos(circle), np.sin(circle)], 1)
        rings = [np.round((3000 - 400 * k) * unit).astype(np.int64)[:: turns[k]] for k in range(6)]
        rings.append(np.round(9000 + 100 * unit).astype(np.int64))
        turns, order = np.append(turns, 1), np.append(order, 6)
        outside = np.append(np.concatenate([[0], np.cumsum(-turns[:5])]), 0)
        holds = (lambda w: w & 1) if rule == "evenodd" else (lambda w: (w != 0).astype(int))
        expected = turns * (holds(outside - turns) - holds(outside))
        with on(isa):
            assert certified([rings[k] for k in order], rule) == (True, expected[order].tolist())


def test_rings_far_out_are_compared_in_wide_integers():
    for seed in SEEDS:
        ring = ring_of(seed)
        assert certified([ring * 2**20])[0] == certified([ring])[0]


def test_many_holes_are_told_from_those_that_touch():
    rng = np.random.default_rng(1)
    corners = 4 * np.stack(np.divmod(rng.permutation(900), 30), 1)[:, None] + np.array([[0, 0], [2, 0], [0, 2]])
    border = np.array([[-9, -9], [200, -9], [200, 200], [-9, 200]])
    simple, weights = certified([*corners, border])
    assert simple
    assert set(weights[:-1]) == {-weights[-1]}
    touching = corners.copy()
    touching[450] += touching[17, 1] - touching[450, 0]
    assert not certified([*touching, border])[0]


def test_ring_of_many_corners_is_simple_until_one_crosses():
    ring = np.round(256 * star(100_000, 2000)).astype(np.int64)
    assert certified([ring])[0]
    ring[5000:5002] = ring[[5001, 5000]]
    assert not certified([ring])[0]
