"""Charts (a) and (b): a family of triangles, filled by every method, pure twin and peer; time beside error.

Out: `families`, `coverage`, `pure`, `peers`, `antialiasing` of a record, the rows of one family. Errors are counted
against the exact picture of the vertices as they are, so that the snap counts as an error, too.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.accuracy import pure
from benchmarks.accuracy.options import AccuracyOptions
from benchmarks.harness.errors import coverage
from benchmarks.harness.peer_turns import MASK_TASKS, SMOOTH_TASKS, Peers, smooth_coverage
from benchmarks.harness.turns import spread, take_turns, turn_of
from benchmarks.scenes.families import FAMILIES, NO_SNAP, Entry, Family, Triangles, entries, in_cells, strewn
from topleft.methods.reference.integers import ExactPicture
from topleft.methods.reference.integers import areas as exact_areas

Rows = dict[str, list[dict[str, Any]]]


def measure_family(family: Family, options: AccuracyOptions) -> Rows:
    """Return the rows of one family, by the name of the list that they belong to."""
    timed = strewn(family, max(1, int(family.n_timed * options.scale)), options.frame_px)
    facts: dict[str, Any] = {"name": family.name, "what": family.what}
    facts |= {"n_timed": len(timed[1]), "area_px": round(float(areas(timed).sum()))}
    with tempfile.TemporaryDirectory() as folder:
        rows = measure_masks(family, timed, facts, options, Path(folder))
        rows["antialiasing"] = measure_antialiasing(family, timed, facts, options, Path(folder))
    return {"families": [facts], **rows}


def measure_no_snap(options: AccuracyOptions) -> Rows:
    """Return `no_snap`: the errors of vertices that are not snapped, family by family, and the time beside 8 bits.

    The ratio of calls that take turns does not depend on other work of the machine, so rows of another time than
    those of `coverage` stand beside them.
    """
    rows = []
    for family in FAMILIES.values():
        facts: dict[str, Any] = {}
        timed = strewn(family, max(1, int(family.n_timed * options.scale)), options.frame_px)
        pair = [Entry("auto", NO_SNAP), Entry("auto", 8)]
        with tempfile.TemporaryDirectory() as folder:
            (wrong, _), _ = count_errors(family, pair, Peers(Path(folder)), facts, options)
        turns = [turn_of(call) for call in mask_calls(pair, timed, options)]
        exact, snapped = take_turns(turns, options.rounds, options.seconds)
        row = {"family": family.name, "method": "auto", "precision": NO_SNAP, "wrong_px": wrong}
        rows.append(row | {"n_edge_px": facts["n_edge_px"]} | spread(exact / snapped, 1.0, "times_8_bits"))
    return {"no_snap": rows}


def measure_masks(
    family: Family, timed: Triangles, facts: dict[str, Any], options: AccuracyOptions, folder: Path
) -> Rows:
    """Return `coverage`, `pure` and `peers`; methods and peers take turns, adds the scene to `facts`."""
    chosen = entries(options.methods)
    peers = Peers(folder)
    try:
        peers.start(options.peers, MASK_TASKS, timed, options.frame_px)
        wrong, wrong_of_peers = count_errors(family, chosen, peers, facts, options)
        peers.show(timed, options.frame_px)
        turns = [turn_of(call) for call in mask_calls(chosen, timed, options)]
        their_turns = peers.turns()
        times = take_turns([*turns, *their_turns.values()], options.rounds, options.seconds)
        gives = peers.facts()
    finally:
        peers.stop()
    own, theirs = times[: len(chosen)], times[len(chosen) :]
    rows: Rows = {"coverage": [], "pure": [], "peers": []}
    for entry, n_wrong, took in zip(chosen, wrong, own, strict=True):
        row = {"family": family.name, "method": entry.method, "precision": entry.precision, "wrong_px": n_wrong}
        rows["coverage"].append(row | per_unit(took, facts))
    for name, took in zip(their_turns, theirs, strict=True):
        row = {"family": family.name, "peer": name, "gives": gives[name], "wrong_px": wrong_of_peers[name]}
        rows["peers"].append(row | per_unit(took, facts))
    rows["peers"] += skipped_rows(family, peers)
    rows["pure"] = [measure_twin(twin, family, rows["coverage"], options) for twin in pure.TWINS
                    if twin.entry in chosen]  # fmt: skip
    return rows


def count_errors(
    family: Family, chosen: Sequence[Entry], peers: Peers, facts: dict[str, Any], options: AccuracyOptions
) -> tuple[list[int], dict[str, int]]:
    """Return how many pixels each entry and each peer got wrong; frames are drawn until there is enough."""
    import topleft as tl

    rasterizer = tl.Rasterizer((options.frame_px, options.frame_px), threads=1)
    wrong, wrong_of_peers = [0] * len(chosen), dict.fromkeys(peers.children, 0)
    facts |= {"n_triangles": 0, "n_edge_px": 0}
    seed = 0
    while facts["n_edge_px"] < options.edge_px:
        seed += 1
        scene = in_cells(family, seed, options.frame_px)
        exact = ExactPicture(*scene, rasterizer.size)
        facts["n_edge_px"] += int(exact.is_edge.sum())
        facts["n_triangles"] += len(scene[1])
        is_covered = exact.count > 0
        for i, entry in enumerate(chosen):
            drawn = rasterizer.coverage(*entry.orient(scene), **entry.options())
            wrong[i] += int((drawn != is_covered).sum())
        for name, picture in peers.show(scene, options.frame_px).items():
            wrong_of_peers[name] += int((coverage(picture) != is_covered).sum())
    return wrong, wrong_of_peers


def mask_calls(chosen: Sequence[Entry], scene: Triangles, options: AccuracyOptions) -> list[partial[Any]]:
    """Return the functions that draw the mask of the scene, entry by entry."""
    import topleft as tl

    rasterizer = tl.Rasterizer((options.frame_px, options.frame_px), threads=1)
    return [partial(rasterizer.coverage, *entry.orient(scene), **entry.options()) for entry in chosen]


def measure_twin(
    twin: pure.Twin, family: Family, rows: list[dict[str, Any]], options: AccuracyOptions
) -> dict[str, Any]:
    """Return the row of a pure twin: its own time, and the error of its kernel."""
    size = (pure.FRAME_PX, pure.FRAME_PX)
    cells = in_cells(family, 1, pure.FRAME_PX)
    n = twin.n_timed[family.name]
    pure.check(twin, (cells[0], cells[1][:n]), size)
    took = pure.times_ms(twin, strewn(family, n, pure.FRAME_PX), size, options.rounds)
    entry = (twin.entry.method, twin.entry.precision)
    (kernel,) = (row for row in rows if (row["method"], row["precision"]) == entry)
    row = {"family": family.name, "twin": twin.name, "method": entry[0], "precision": entry[1]}
    return row | {"wrong_px": kernel["wrong_px"], "n_timed": n} | spread(took, 1e6 / n, "ns_triangle")


def measure_antialiasing(
    family: Family, timed: Triangles, facts: dict[str, Any], options: AccuracyOptions, folder: Path
) -> list[dict[str, Any]]:
    """Return time and error of each way to sample: root of the mean squared error of coverage over edge pixels."""
    import topleft as tl

    rasterizer = tl.Rasterizer((options.frame_px, options.frame_px), threads=1)
    scene = in_cells(family, 1, options.frame_px)
    exact, is_edge = exact_areas(*scene, rasterizer.size), ExactPicture(*scene, rasterizer.size).is_edge

    def rms(drawn: NDArray[Any]) -> float:
        return float(f"{np.sqrt(((drawn.astype(np.float64) - exact)[is_edge] ** 2).mean()):.4g}")

    ways = samplings()
    peers = Peers(folder)
    try:
        peers.start(options.peers, SMOOTH_TASKS, scene, options.frame_px)
        errors = {name: rms(smooth_coverage(drawn)) for name, drawn in peers.show(scene, options.frame_px).items()}
        peers.show(timed, options.frame_px)
        their_turns = peers.turns()
        turns = [turn_of(partial(rasterizer.coverage, *timed, sampling=way)) for way in ways]
        times = take_turns([*turns, *their_turns.values()], options.rounds, options.seconds)
        gives = peers.facts()
    finally:
        peers.stop()
    rows = []
    for way, took in zip(ways, times, strict=False):
        row = {"family": family.name, "sampling": way, "rms": rms(rasterizer.coverage(*scene, sampling=way))}
        rows.append(row | per_unit(took, facts))
    for name, took in zip(their_turns, times[len(ways) :], strict=True):
        row = {"family": family.name, "peer": name, "gives": gives[name], "rms": errors[name]}
        rows.append(row | per_unit(took, facts))
    return rows + skipped_rows(family, peers)


def skipped_rows(family: Family, peers: Peers) -> list[dict[str, Any]]:
    """Return a row for each peer that did not take part."""
    return [{"family": family.name, "peer": name, "skipped": why} for name, why in peers.skipped.items()]


def per_unit(took_ms: NDArray[np.float64], facts: dict[str, Any]) -> dict[str, float]:
    """Median time and its quartiles for a triangle, and for a pixel of area."""
    per_px = float(np.median(took_ms)) * 1e6 / max(facts["area_px"], 1)
    return spread(took_ms, 1e6 / facts["n_timed"], "ns_triangle") | {"ns_px": float(f"{per_px:.4g}")}


def areas(scene: Triangles) -> NDArray[np.float64]:
    """The area of each triangle."""
    vertices, triangles = scene
    a, b, c = vertices[triangles].swapaxes(0, 1)
    return np.abs((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])) / 2


def samplings() -> list[str]:
    """The ways to sample that the installed library has and that estimate how much of a pixel is covered."""
    from topleft._core.base.options import Sampling

    return [str(value) for value in Sampling if value not in ("outer", "inner")]
