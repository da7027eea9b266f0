"""The study of the cases: its arguments, and who takes part."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace

from benchmarks.harness.arguments import (
    add_names,
    add_number,
    add_out,
    add_pin,
    options_of,
    positive,
    refuse_unknown,
    set_options,
)  # fmt: skip
from benchmarks.harness.contestants import known_peers
from benchmarks.harness.records import Record, Save
from benchmarks.harness.rounds import Options, run_cases
from benchmarks.peers import PEERS
from benchmarks.report.study import Study
from benchmarks.run import scene_tables, smooth_tables, tables
from benchmarks.scenes.cases import CASES, TRIALS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    set_options(parser, Options((), list(PEERS), ()))
    add_names(parser, "--scene", "scenes", "cases, or beginnings of their names")
    add_names(parser, "--peer", "peers", "peers; all unless given, none: no names", "*")
    add_names(parser, "--isa", "isas", "scalar, avx2, avx512; all unless given")
    parser.add_argument("--threads", nargs="+", type=positive, metavar="N")
    add_number(parser, "--repeats", "repeats", "rounds")
    parser.add_argument("--seconds", type=float, metavar="S", help="length of a turn, at least a call (%(default)s)")
    add_pin(parser)
    parser.add_argument("--no-check", dest="check", action="store_false", help="leave the pictures uncompared")
    add_out(parser)


def run(arguments: argparse.Namespace, save: Save) -> Record:
    """Measure the cases of the arguments, checked."""
    import topleft as tl

    available = tl.build_info()["isa_available"]
    options = options_of(Options, arguments)
    refuse_unknown("--isa", options.isas, available)
    refuse_unknown("--peer", options.peers, known_peers())
    isas, scenes = options.isas or available[::-1], find_scenes(options.scenes)
    return run_cases(replace(options, scenes=scenes, isas=isas), save)


def find_scenes(names: Sequence[str]) -> list[str]:
    """Cases by name, or by the beginning of it; all of them for none."""
    if not names:
        return [name for name in CASES if name not in TRIALS]
    found = []
    for name in names:
        matches = [name] if name in CASES else [case for case in CASES if case.startswith(name)]
        if not matches:
            raise ValueError(f"no scene {name!r}; there are {', '.join(CASES)}")
        found += [match for match in matches if match not in found]
    return found


STUDY = Study("run", "measure", add_arguments, run, tables.lines, {**scene_tables.PARTS, **smooth_tables.PARTS})
