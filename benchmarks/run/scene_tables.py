"""Tables of a record of meshes, strewn triangles and fills, for docs/measured/performance.md and the README."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from typing import Any

from benchmarks.harness.records import Record
from benchmarks.peers import OURS
from benchmarks.report.tables import commit_text, number, table_text
from benchmarks.run.tables import is_crowded, ratio

Scene = dict[str, Any]
Run = dict[str, Any]

MESHES = ["blob-10k", "blob-100k", "blob-1m", "blob-10m"]
STREWN = ["random-1000x400", "random-10000x100", "random-100000x10", "random-1000000x4", "frames-near-first",
          "frames-far-first"]  # fmt: skip
ISA_NAMES = {"avx512": "AVX-512", "avx2": "AVX2", "scalar": "scalar code"}
FILLS = ["large-4k", "fill-4k", "fill-1000x300", "fill-20000x40", "fill-200000x8", "labels-planar"]


def scenes_of(record: Record, names: list[str]) -> list[Scene]:
    """The scenes of these names that the record has, in their order."""
    found = {scene["scene"]: scene for scene in record["scenes"]}
    return [found[name] for name in names if name in found]


def own_run(scene: Scene, isa: str, n_threads: int = 1, name: str | None = None) -> Run | None:
    """The time of topleft for the scene itself; `name`: for the one beside it."""
    wanted = {"peer": OURS, "scene": name or scene["scene"], "isa": isa, "threads": n_threads}
    return next((run for run in scene["runs"] if run.items() >= wanted.items()), None)


def isas_of(record: Record) -> list[str]:
    """Instruction sets that took part, the widest first."""
    return list(dict.fromkeys(run["isa"] for scene in record["scenes"] for run in scene["runs"] if run["peer"] == OURS))


def time_text(run: Run | None) -> str:
    """The median, marked where others used the CPU."""
    return number(run["median_ms"]) + "!" * is_crowded(run) if run else "-"


def ratio_text(run: Run | None, other: Run | None) -> str:
    """How many times as long as the other a run takes, pair by pair."""
    return f"{ratio(run, other):.2f}x" if run and other else "-"


def own_cells(scene: Scene, isas: list[str]) -> list[str]:
    """A time for each instruction set, and the first one's gain by a second thread."""
    alone = [own_run(scene, isa) for isa in isas]
    return [*map(time_text, alone), ratio_text(alone[0], own_run(scene, isas[0], 2))]


def own_head(isas: list[str]) -> list[str]:
    """The heads of these cells."""
    return [*isas, f"two threads ({isas[0]})"]


def facts_text(record: Record) -> str | None:
    """The origin of the figures."""
    if not scenes_of(record, [*MESHES, *STREWN, *FILLS]):
        return None
    machine, options = record["machine"], record["options"]
    peers = {run["peer"]: run for scene in record["scenes"] for run in scene["runs"] if run["peer"] != OURS}
    versions = "".join(f", {name} {run['version']}" for name, run in peers.items())
    wrong = sum((run["error"] or {}).get("wrong_px") or 0
                for scene in record["scenes"] for run in scene["runs"] if run["peer"] == OURS)  # fmt: skip
    return (
        f"{machine['cpu']}, {machine['cpus']} CPUs, {machine['system']}, Python {machine['python']}, at "
        f"{commit_text(record)}, {record['date'][:10]}{versions}; medians of {options['repeats']} rounds of "
        f"{options['seconds']:g} s a turn. Pixels of ours that are not those of the exact picture: {wrong:,}. "
        "!: others used the CPU, too."
    )


def headline_text(record: Record) -> str | None:
    """The sentences that begin the README and its page: the time of a mesh, and of the peer."""
    scenes = scenes_of(record, MESHES)
    own = next((scene for scene in scenes if scene["scene"] == "blob-100k"), None)
    if own is None:
        return None
    isas = isas_of(record)
    runs = {ISA_NAMES.get(isa, isa): own_run(own, isa) for isa in isas}
    times = ", ".join(f"{number(run['median_ms'])} ms with {name}" for name, run in runs.items() if run)
    text = f"A mesh of {rounded(own)} triangles takes {times}, for ids and depth at 1920x1080 on one core"
    pairs = [(scene, ratio(peer, first)) for scene in scenes
             if (peer := peer_run(scene)) and (first := own_run(scene, isas[0]))]  # fmt: skip
    if peer := peer_run(own):
        low, high = (of(pairs, key=lambda pair: pair[1]) for of in (min, max))
        text += (
            f". The fastest other renderer that Python can call, {peer['peer']}, takes {number(peer['median_ms'])} ms "
            f"there: {low[1]:.1f} times as long with {rounded(low[0])} triangles, {high[1]:.1f} times with "
            f"{rounded(high[0])}"
        )
    return textwrap.fill(f"{text} ({record['machine']['cpu'].split(',')[0]}, {record['date'][:10]}).", 120)


def peer_run(scene: Scene) -> Run | None:
    """The time of the peer on one thread."""
    return next((run for run in scene["runs"] if run["peer"] != OURS and run["threads"] == 1), None)


def rounded(scene: Scene) -> str:
    """The number of triangles to one digit."""
    return f"{float(format(scene['n_triangles'], '.1g')):,.0f}"


def meshes_text(record: Record) -> str | None:
    """A row for each mesh: instruction sets, threads, wide arrays, no cull, the peer."""
    scenes, isas = scenes_of(record, MESHES), isas_of(record)
    if not scenes:
        return None
    rows = []
    for scene in scenes:
        first = own_run(scene, isas[0])
        wide, both = (
            next(iter(scenes_of(record, [scene["scene"] + end])), None) for end in ("-f64", "-nocull")
        )  # fmt: skip
        beside = own_run(wide, isas[0], name=scene["scene"]) if wide else None
        peer = peer_run(scene)
        peak = first.get("peak_mb") if first else None
        rows.append([
            f"{scene['n_triangles']:,}",
            *own_cells(scene, isas),
            ratio_text(own_run(wide, isas[0]) if wide else None, beside),
            time_text(own_run(both, isas[0]) if both else None),
            time_text(peer),
            ratio_text(peer, first),
            "-" if peak is None else f"{peak:.0f}",
        ])  # fmt: skip
    head = ["float64 and int64", "nothing culled", "llvmpipe, read back", "over ours", "peak MB"]
    return table_text(["triangles", *own_head(isas), *head], rows)


def rows_text(names: list[str]) -> Callable[[Record], str | None]:
    """A table with a row for each of these scenes."""

    def text(record: Record) -> str | None:
        scenes, isas = scenes_of(record, names), isas_of(record)
        if not scenes:
            return None
        rows = [[scene["scene"], f"{scene['n_triangles']:,}", *own_cells(scene, isas)] for scene in scenes]
        return table_text(["scene", "triangles", *own_head(isas)], rows)

    return text


PARTS: dict[str, Callable[[Record], str | None]] = {
    "headline": headline_text,
    "scene-facts": facts_text,
    "meshes": meshes_text,
    "other-scenes": rows_text([*STREWN, *FILLS]),
}
"""The parts of the page by their markers `<!-- table: NAME -->`."""
