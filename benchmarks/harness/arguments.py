"""Options of commands: the fields of a dataclass, each with the argument that sets it."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar

Kind = TypeVar("Kind")


def option(default: Any, flags: str, help: str = "", **words: Any) -> Any:  # noqa: A002
    """A field, and the words of `add_argument`; without flags the argument has a place."""
    return field(default=default, metadata={"flags": flags.split(), "words": {"help": help, **words}})


def count(default: int | Sequence[int], flag: str, help: str = "", metavar: str = "N", **words: Any) -> Any:  # noqa: A002
    """A number from 1 on, or several."""
    shown = default if isinstance(default, int) else " ".join(map(str, default))
    return option(default, flag, f"{help} ({shown})".strip(), type=positive, metavar=metavar, **words)


def fraction(default: float, flag: str, help: str, metavar: str = "S") -> Any:  # noqa: A002
    """A number with a fraction: seconds, or a scale."""
    return option(default, flag, f"{help} (%(default)s)", type=float, metavar=metavar)


def names(flag: str, help: str, default: Sequence[str] = (), nargs: str = "+") -> Any:  # noqa: A002
    """Names."""
    return option(default, flag, help, nargs=nargs, metavar="NAME")


def switch(flag: str, help: str) -> Any:  # noqa: A002
    """A field that is False unless the flag is given."""
    return option(False, flag, help, action="store_true")


def pinned() -> Any:
    """The CPUs that processes are pinned to."""
    return option((), "--pin", "n threads: the first n of them", type=cpus, metavar="CPU[,CPU...]")


@dataclass(frozen=True, kw_only=True)
class Options:
    """The option of every study that keeps a record."""

    record: Path | None = option(None, "-o --out", "the record", type=Path, metavar="FILE.json")


def add_options(parser: argparse.ArgumentParser, kind: type) -> None:
    """Declare the arguments of a kind of options."""
    for own in fields(kind):
        if own.metadata:
            flags, words = own.metadata["flags"], own.metadata["words"]
            named = {"dest": own.name} if flags else {}
            parser.add_argument(*(flags or [own.name]), default=own.default, **named, **words)


def options_of(kind: type[Kind], arguments: argparse.Namespace) -> Kind:
    """Return the options that the arguments set."""
    return kind(**{own.name: getattr(arguments, own.name) for own in fields(kind) if own.metadata})  # type: ignore[arg-type]


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
