"""Arguments that several commands take, and how they become the options of a study."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

Options = TypeVar("Options")


def positive(text: str) -> int:
    """A number from 1 on."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {text}")
    return value


def cpus(text: str) -> list[int]:
    """`1` or `1,0`."""
    return [int(part) for part in text.split(",")]


def refuse_unknown(what: str, names: Iterable[str], known: Iterable[str]) -> None:
    """Raise a ValueError for names that do not exist."""
    if unknown := [name for name in names if name not in known]:
        raise ValueError(f"{what} must be some of {', '.join(known)}, got {', '.join(unknown)}")


def set_options(parser: argparse.ArgumentParser, options: Any) -> None:
    """Make the fields of an options object the defaults of the arguments with their names."""
    parser.set_defaults(**{field.name: getattr(options, field.name) for field in fields(options)})


def options_of(kind: type[Options], arguments: argparse.Namespace) -> Options:
    """Return an options object of the arguments with the names of its fields."""
    return kind(**{field.name: getattr(arguments, field.name) for field in fields(kind)})  # type: ignore[arg-type]


def add_out(parser: argparse.ArgumentParser, what: str = "the record") -> None:
    """Add where the record goes."""
    parser.add_argument("-o", "--out", dest="record", type=Path, metavar="FILE.json", help=what)


def add_number(parser: argparse.ArgumentParser, flag: str, field: str, what: str = "", metavar: str = "N") -> None:
    """Add a number from 1 on that goes into a field of the options."""
    parser.add_argument(flag, dest=field, type=positive, metavar=metavar, help=f"{what} (%(default)s)".strip())


def add_names(parser: argparse.ArgumentParser, flag: str, field: str, what: str, nargs: str = "+") -> None:
    """Add names that go into a field of the options."""
    parser.add_argument(flag, dest=field, nargs=nargs, metavar="NAME", help=what)


def add_scale(parser: argparse.ArgumentParser, what: str = "of triangles and frames") -> None:
    """Add the scale of the scenes."""
    parser.add_argument("--scale", type=float, metavar="X", help=f"{what} (%(default)s)")


def add_pin(parser: argparse.ArgumentParser) -> None:
    """Add the CPUs that processes are pinned to."""
    parser.add_argument("--pin", type=cpus, default=[], metavar="CPU[,CPU...]", help="n threads: the first n of them")
