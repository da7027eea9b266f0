"""Prints what the package and some of its extras need, a requirement a line: needs.py test,dask."""

import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

PROJECT = tomllib.loads(Path(__file__).parents[1].joinpath("pyproject.toml").read_text(encoding="utf-8"))["project"]


def needs(extras: str) -> Iterator[str]:
    """Yield what extras need; one may name others."""
    for extra in extras.split(","):
        for need in PROJECT["optional-dependencies"][extra]:
            own = re.fullmatch(r"topleft\[(.*)\]", need)
            yield from needs(own[1]) if own else [need]


print(*PROJECT["dependencies"], *needs(sys.argv[1]), sep="\n")
