"""The study of the cases: its arguments, and who takes part."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.harness.arguments import add_out, add_pin, positive
from benchmarks.harness.contestants import known_peers
from benchmarks.harness.records import Record
from benchmarks.harness.rounds import Options, run_cases
from benchmarks.harness.yardstick import DEFAULT_PATTERN, Yardstick
from benchmarks.peers import PEERS
from benchmarks.report.study import Save, Study
from benchmarks.run import smooth_tables, tables
from benchmarks.scenes.cases import CASES, TRIALS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("--scene", nargs="+", metavar="NAME", default=[], help="cases, or beginnings of their names")
    add("--peer", nargs="*", metavar="NAME", default=None, help="peers; all unless given, none: no names")
    add("--isa", nargs="+", metavar="ISA", default=None, help="scalar, avx2, avx512; all unless given")
    add("--threads", nargs="+", type=positive, metavar="N", default=[1])
    add("--repeats", type=positive, default=9, metavar="N", help="rounds (9)")
    add("--seconds", type=float, default=0.1, metavar="S", help="length of a turn, at least a call (0.1)")
    add_pin(parser)
    add("--yardstick", action="append", default=[], metavar="[SCENE=]COMMAND")
    add("--yardstick-pattern", action="append", default=[], metavar="REGEX",
        help="finds its figure; one for each yardstick, the last one for the rest")  # fmt: skip
    add("--yardstick-folder", type=Path, default=Path(), metavar="FOLDER", help="where yardsticks run")
    add("--no-check", action="store_true", help="leave the pictures uncompared")
    add_out(parser)


def run(arguments: argparse.Namespace, save: Save) -> Record:
    """Measure."""
    return run_cases(options_of(arguments), sys.stderr, save)


def options_of(arguments: argparse.Namespace) -> Options:
    """What the arguments ask for, checked."""
    import topleft as tl

    available = tl.build_info()["isa_available"]
    isas = arguments.isa if arguments.isa is not None else available[::-1]
    if unknown := [isa for isa in isas if isa not in available]:
        raise ValueError(f"--isa must be some of {', '.join(available)} here, got {', '.join(unknown)}")
    peers = list(PEERS) if arguments.peer is None else arguments.peer
    if unknown := [peer for peer in peers if peer not in known_peers()]:
        raise ValueError(f"--peer must be some of {', '.join(PEERS)}, got {', '.join(unknown)}")
    patterns = arguments.yardstick_pattern or [DEFAULT_PATTERN]
    patterns += [patterns[-1]] * (len(arguments.yardstick) - len(patterns))
    yardsticks = list(zip(arguments.yardstick, patterns, strict=False))
    for command, pattern in yardsticks:
        Yardstick.parse(command, pattern, arguments.yardstick_folder, [])
    return Options(
        scenes=find_scenes(arguments.scene),
        peers=peers,
        isas=isas,
        threads=arguments.threads,
        repeats=arguments.repeats,
        seconds=arguments.seconds,
        pin=arguments.pin,
        yardsticks=yardsticks,
        yardstick_folder=arguments.yardstick_folder,
        check=not arguments.no_check,
    )


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


STUDY = Study("run", "measure", add_arguments, run, tables.lines, smooth_tables.PARTS)
