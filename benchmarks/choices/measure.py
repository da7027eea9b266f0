"""The choices before a draw, beside their alternatives: time of both in turns, on many scenes, with the same bits.

In: scenes of `scenes.py`, ways of `ways.py`. Out: a record with a row for each scene and choice.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.choices.scenes import Scene, scenes
from benchmarks.choices.ways import CHOICES, THREADED
from benchmarks.harness.arguments import Options, count, fraction, names, refuse_unknown
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save, forget, tell
from benchmarks.harness.turns import digits, quartiles
from benchmarks.harness.ways import Ways, check_same_bits, take_rounds


@dataclass(frozen=True)
class ChoiceOptions(Options):
    choices: Sequence[str] = names("--choice", "measure these alone; all unless given")
    scenes: Sequence[str] = names("--scene", "scenes, or beginnings of their names")
    rounds: int = count(7, "--repeats", "rounds")
    seconds: float = fraction(0.002, "--seconds", "length of a turn, at least a call")
    scale: float = fraction(1.0, "--scale", "of triangles and frames", "X")


def run_choices(options: ChoiceOptions, record: Record | None = None, save: Save = forget) -> Record:
    """Return a record, or the rows that were measured anew; `save` gets it after each scene.

    Raises
    ------
    ValueError
        If a choice is unknown.
    AssertionError
        If two ways draw different bits.
    """
    refuse_unknown("--choice", options.choices, CHOICES)
    rows = []
    for scene in chosen_scenes(options):
        for choice in options.choices or CHOICES:
            row = measure_choice(choice, scene, CHOICES[choice](scene), options)
            if row:
                rows.append(row)
                tell(row_text(row))
        save(with_rows(record, rows))
    return with_rows(record, rows)


def chosen_scenes(options: ChoiceOptions) -> Iterator[Scene]:
    """Give the scenes with names that begin so."""
    for scene in scenes(options.scale):
        if not options.scenes or scene.label.startswith(tuple(options.scenes)):
            yield scene


def measure_choice(choice: str, scene: Scene, ways: Ways, options: ChoiceOptions) -> dict[str, Any] | None:
    """Return a row, None where there is nothing to choose."""
    if len(ways) < 2:
        return None
    check_same_bits(scene.label, ways)
    clock = time.perf_counter if choice in THREADED else time.thread_time
    times = take_rounds(ways, options.rounds, options.seconds, clock)
    own = times[0]
    others = [
        {"way": way.name, "ms": digits(np.median(took)), "chosen_by_other": by_other(own, took, choice)}
        for way, took in zip(ways[1:], times[1:], strict=True)
    ]
    return {
        "choice": choice,
        "scene": scene.name,
        "kind": scene.kind,
        "verb": scene.verb,
        "sampling": scene.sampling,
        "size": list(scene.size),
        "n_triangles": len(scene.arrays[1]),
        "chosen": ways[0].name,
        "ms": quartiles(own),
        "others": others,
        "ratio": max(1.0, *(other["chosen_by_other"][1] for other in others)),
    }


def by_other(own: NDArray[np.float64], took: NDArray[np.float64], choice: str) -> list[float]:
    """Return the quartiles of the ratios of the rounds; for threads the ratio of the least times is the middle one.

    Other programs on the machine take a thread away from some rounds, and CPU time does not leave that out.
    """
    ratios = quartiles(own[: len(took)] / took)
    return [ratios[0], digits(own.min() / took.min()), ratios[2]] if choice in THREADED else ratios


def with_rows(record: dict[str, Any] | None, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return a record with these rows in place of older ones of the same choice and scene."""
    new = {key_of(row): row for row in rows}
    old = {} if record is None else {key_of(row): row for row in record["rows"]}
    order = {name: i for i, name in enumerate(CHOICES)}
    merged = sorted((old | new).values(), key=lambda row: order.get(row["choice"], len(order)))
    return {"kind": "choices"} | (record or {}) | describe() | {"rows": merged}


def key_of(row: dict[str, Any]) -> tuple[str, ...]:
    """Return the key of a row."""
    return row["choice"], row["scene"], row["verb"], row["sampling"]


def row_text(row: dict[str, Any]) -> str:
    """Return a row for the terminal."""
    others = ", ".join(f"{other['way']} {other['chosen_by_other'][1]:.2f}" for other in row["others"])
    what = f"{row['scene']}, {row['verb']} {row['sampling']}"
    return f"{row['choice']:18} {what:58} {row['chosen']:16} {row['ms'][1]:9.3f} ms  x {row['ratio']:.2f}  ({others})"
