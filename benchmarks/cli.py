"""The command line: `python -m benchmarks run`, `report`, `list`."""

from __future__ import annotations

import argparse
import functools
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks import report
from benchmarks.cases import CASES, TRIALS
from benchmarks.contestants import known_peers
from benchmarks.peers import PEERS
from benchmarks.rounds import Options, run
from benchmarks.yardstick import DEFAULT_PATTERN, Yardstick


def main(arguments: Sequence[str] | None = None) -> int:
    """Return the exit status."""
    options = parser().parse_args(arguments)
    return options.action(options)


def parser() -> argparse.ArgumentParser:
    """The arguments."""
    root = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    commands = root.add_subparsers(required=True, metavar="COMMAND")

    add = commands.add_parser("run", help="measure")
    add.set_defaults(action=run_command)
    add.add_argument("--scene", nargs="+", metavar="NAME", default=[], help="cases, or beginnings of their names")
    add.add_argument("--peer", nargs="*", metavar="NAME", default=None, help="peers; all unless given, none: no names")
    add.add_argument("--isa", nargs="+", metavar="ISA", default=None, help="scalar, avx2, avx512; all unless given")
    add.add_argument("--threads", nargs="+", type=positive, metavar="N", default=[1])
    add.add_argument("--repeats", type=positive, default=9, metavar="N", help="rounds (9)")
    add.add_argument("--seconds", type=float, default=0.1, metavar="S", help="length of a turn, at least a call (0.1)")
    add.add_argument("--pin", type=cpus, default=[], metavar="CPU[,CPU...]", help="n threads: the first n of them")
    add.add_argument("--yardstick", action="append", default=[], metavar="[SCENE=]COMMAND")
    add.add_argument("--yardstick-pattern", action="append", default=[], metavar="REGEX",
                     help="finds its figure; one for each yardstick, the last one for the rest")  # fmt: skip
    add.add_argument("--yardstick-folder", type=Path, default=Path(), metavar="FOLDER", help="where yardsticks run")
    add.add_argument("--no-check", action="store_true", help="leave the pictures uncompared")
    add.add_argument("-o", "--out", type=Path, metavar="FILE.json")

    add = commands.add_parser("report", help="print tables again")
    add.set_defaults(action=report_command)
    add.add_argument("files", nargs="+", type=Path, metavar="FILE.json")

    commands.add_parser("list", help="cases and peers").set_defaults(action=list_command)
    return root


def positive(text: str) -> int:
    """A number from 1 on."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {text}")
    return value


def cpus(text: str) -> list[int]:
    """`1` or `1,0`."""
    return [int(part) for part in text.split(",")]


def run_command(arguments: argparse.Namespace) -> int:
    """Measure, write, print."""
    try:
        options = options_of(arguments)
    except ValueError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2
    save = functools.partial(write_record, arguments.out) if arguments.out else None
    record = run(options, sys.stderr, save)
    print(*report.lines(record), sep="\n")
    return 0


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


def report_command(arguments: argparse.Namespace) -> int:
    """Print tables of records."""
    for path in arguments.files:
        print(*report.lines(json.loads(path.read_text())), sep="\n")
    return 0


def list_command(_: argparse.Namespace) -> int:
    """Print what there is."""
    for name, case in CASES.items():
        print(f"{name:22} {case.task}")
    for name, what in PEERS.items():
        print(f"{name:22} {what}")
    return 0


def write_record(path: Path, record: dict[str, Any]) -> None:
    """Write JSON beside its place, then move it there: never half a file."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_text(json.dumps(record, indent=1) + "\n")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
