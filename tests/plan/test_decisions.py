"""What the shipped costs decide, on a grid of cases: a change of the table that decides otherwise shows.

`python tests/plan/test_decisions.py` prints `DECIDED` anew, for a change that is meant.
"""

import hashlib
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from topleft._core.base.options import Sink
from topleft._core.raster import choices
from topleft._core.raster.cluster_draw import Survey
from topleft._core.raster.view import View

SIZES = ((64, 64), (255, 300), (256, 256), (800, 500), (1000, 500), (1920, 1080), (3840, 2160))
COUNTS = tuple(int(base * 10**k) for k in range(8) for base in (1, 1.5, 2, 3, 6, 9))
SHARES = (0.0, 0.05, 0.1, 0.15, 0.2, 0.33, 0.34, 0.5, 0.6, 0.7, 0.8, 0.81, 0.9, 1.0)
SINKS = (Sink.MASK, Sink.SAMPLES, Sink.COUNT, Sink.LABEL, Sink.PAINT, Sink.NEAREST)


def views(*options, sizes=SIZES):
    """Views of each size with each of some options."""
    return [View.parse(size, {"threads": 1, **some}) for size in sizes for some in options]


def scenes(view):
    """Work as choices meet it: so many triangles, of which some are seen, in so many layers and rows each."""
    for n, seen, layers, rows in product(COUNTS[::3], (1.0, 0.06), (0.01, 0.3, 2.0, 30.0), (1.0, 4.2, 4.4, 40.0)):
        work = (seen * n, layers, min(rows * seen * n, layers * view.size[0] * view.size[1]))
        yield SimpleNamespace(guess=work, n_triangles=n, n_vertices=n // 2, has_depth=True)


def surveys():
    """What becomes of clusters."""
    return [Survey(out, 0.0, 1 - out - front, front) for out in SHARES for front in SHARES if out + front <= 1]


def of_scenes(choice, *options):
    """A choice for each view and scene."""
    return [choice(view, snapped) for view in views(*options) for snapped in scenes(view)]


def arrays_by_threads():
    return [f(3, *n) for n in zip(COUNTS, COUNTS, strict=True) for f in (choices.threads_to_snap,)] + [
        choices.threads_to_convert(3, n) for n in COUNTS
    ]


def draws_by_threads():
    samplings = ({"threads": None}, {"threads": None, "sampling": "msaa4"}, {"threads": None, "sampling": "area"})
    return [n for sink in SINKS for n in of_scenes(lambda v, s: choices.threads_to_draw(v, s, sink), *samplings)]  # noqa: B023


def shares():
    view = View.parse((64, 64), {})
    return [choices.is_sliced(view, n, parts, Sink.NEAREST) for n in COUNTS for parts in (1, 2, 4, 16)]


def clusters():
    culled = views({}, {"cull": "back"}, sizes=SIZES[:1])
    kept = [choices.pays_to_cluster(n, drawn, k) for n in COUNTS for drawn in (0, 1) for k in (1, 15, 16)]
    snapped = [choices.pays_to_snap_all(n, w * h) for n in COUNTS for w, h in SIZES]
    together = [choices.pays_to_share_instances(n, rows) for n in COUNTS for rows in (7.5, 8.0)]
    drawn = [choices.pays_to_draw_clusters(view, n, s) for view in culled for n in COUNTS for s in surveys()]
    return kept + snapped + together + drawn


def sampled():
    options = [{"cull": cull, "sampling": f"msaa{n}"} for cull in ("none", "back") for n in (2, 4, 16)]
    return [
        choices.pays_to_draw_samples(view, n, survey, lambda b=beyond: b)
        for view in views(*options, sizes=SIZES[2::3])
        for n, survey, beyond in product(COUNTS[1::2], surveys()[::3], (0.0, 0.01, 0.5))
    ]


def instances():
    options = {}, {"cull": "back"}, {"sampling": "msaa4"}
    return [
        choices.pays_to_draw_instances(view, n_instances, n, survey, lambda k=layers: k)
        for view in views(*options, sizes=SIZES[:1])
        for n, survey, (layers, n_instances) in product(COUNTS[::2], surveys(), ((1.0, 2), (2.9, 40), (3.0, 1000)))
    ]


def flat():
    return of_scenes(lambda v, s: choices.pays_without_depth(v, s), {})


def sorting():
    return [b for sink in SINKS for b in of_scenes(lambda v, s: choices.pays_to_sort(v, s, sink), {})]  # noqa: B023


def bounds():
    return of_scenes(lambda v, s: choices.pays_to_bound(v, s, Sink.NEAREST), {})


def blending():
    grounds = (True, False, 4), (True, True, 4), (False, True, 4), (False, False, 16)
    return [
        rows
        for lays, is_packed, n_bytes in grounds
        for rows in of_scenes(
            lambda v, s: choices.rows_to_blend(v, s, n_bytes * v.size[0], lays_ground=lays, is_packed=is_packed),  # noqa: B023
            {},
            {"sampling": "area"},
        )
    ]


def colours():
    return of_scenes(lambda v, s: choices.is_direct(v, s, np.dtype(np.uint8), is_flat=True), {})


def labels():
    options = {"sampling": "msaa2"}, {"sampling": "msaa8"}
    return of_scenes(lambda v, s: choices.pays_to_sort_labels(v, s, 1), *options)


GRIDS = (
    arrays_by_threads, draws_by_threads, shares, clusters, sampled, instances, flat, sorting, bounds,
    blending, colours, labels,
)  # fmt: skip

#: Of each grid: cases, how many are not the commonest, and the beginning of a hash of all.
DECIDED = {
    "arrays_by_threads": (96, 32, "278bfa1eff08511b"),
    "draws_by_threads": (64512, 35122, "a4fdd235a45a623f"),
    "shares": (192, 48, "deedb067a68f7d6a"),
    "clusters": (11664, 4492, "e0525a33df0266eb"),
    "sampled": (32832, 8994, "b88453e7e4a55581"),
    "instances": (24624, 9329, "5647fd5ae1372f66"),
    "flat": (3584, 1746, "8f1a4ea8ea41e1ec"),
    "sorting": (21504, 2630, "2d1f9fff08607133"),
    "bounds": (3584, 1190, "dc8188969683147d"),
    "blending": (28672, 24576, "fa4ac31c7f40f8c6"),
    "colours": (3584, 1520, "778993070f0538f7"),
    "labels": (7168, 2944, "9f41a14eaea4aa86"),
}  # fmt: skip


def summary(decided):
    """Cases, how many are not the commonest, and a hash."""
    values, counts = np.unique(np.array(decided, np.int64), return_counts=True)
    assert len(values) > 1
    text = ",".join(map(str, map(int, decided)))
    return len(decided), int(counts.sum() - counts.max()), hashlib.sha256(text.encode()).hexdigest()[:16]


@pytest.mark.parametrize("grid", GRIDS)
def test_shipped_costs_decide_as_measured(force, grid):
    force(available_threads=8)
    assert summary(grid()) == DECIDED[grid.__name__]


if __name__ == "__main__":
    with choices.forced(available_threads=8):
        for one in GRIDS:
            print(f'    "{one.__name__}": {summary(one())},'.replace("'", '"'))
