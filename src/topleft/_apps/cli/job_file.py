"""Job files: TOML or JSON to the arguments that the command line would have taken.

Input: a file, and the arguments of the command line, which hold where the file says nothing. Output: parsed arguments
for each of its jobs.
"""

from __future__ import annotations

import argparse
import copy
import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from topleft._apps.cli.arguments import UsageError, add_picture_arguments, meant


class JobParser(argparse.ArgumentParser):
    """A parser that raises its complaints."""

    def error(self, message: str) -> NoReturn:
        """Raise it."""
        raise UsageError(message)


def read_jobs(path: Path, options: argparse.Namespace) -> list[argparse.Namespace]:
    """Return the arguments of each job."""
    document = _parsed(path)
    jobs = document.pop("job", None)
    if not isinstance(jobs, list) or not jobs or not all(isinstance(job, dict) for job in jobs):
        raise UsageError(f'{str(path)!r} must have jobs: [[job]] in TOML, a list "job" of objects in JSON')
    parser = JobParser(add_help=False, allow_abbrev=False)
    add_picture_arguments(parser)
    keys = {action.dest: action for action in parser._actions}
    found = []
    for i, job in enumerate(jobs, 1):
        try:
            found.append(_arguments({**document, **job}, keys, parser, options))
        except UsageError as error:
            raise UsageError(f"{str(path)!r}, job {i}: {error}") from None
    return found


def _parsed(path: Path) -> dict[str, Any]:
    if path.suffix.lower() not in (".toml", ".json"):
        raise UsageError(f"a job file must end in .toml or .json, got {str(path)!r}")
    data = path.read_bytes()
    try:
        text = data.decode()
        document = tomllib.loads(text) if path.suffix.lower() == ".toml" else json.loads(text)
    except RecursionError:
        raise UsageError(f"cannot read {str(path)!r}: it is nested too deeply") from None
    except ValueError as error:  # raised by both readers, and by decoding
        raise UsageError(f"cannot read {str(path)!r}: {error}") from None
    if not isinstance(document, dict):
        raise UsageError(f"{str(path)!r} must hold an object, got {type(document).__name__}")
    return document


def _arguments(
    job: Mapping[str, Any], keys: Mapping[str, argparse.Action], parser: JobParser, options: argparse.Namespace
) -> argparse.Namespace:
    words, meshes = [], job.get("mesh", [])
    for key, value in job.items():
        if key == "mesh":
            continue
        action = keys.get(key.replace("-", "_"))
        if action is None:
            guess = meant(key, ["mesh", *keys])
            raise UsageError(f"there is no key {key!r}{guess or '; there are mesh, ' + ', '.join(keys)}")
        words += _words(action, key, value)
    meshes = [meshes] if isinstance(meshes, str) else meshes
    if not isinstance(meshes, list) or not meshes or not all(isinstance(mesh, str) for mesh in meshes):
        raise UsageError(f"mesh must be a name or a list of names, got {job.get('mesh')!r}")
    given = copy.copy(options)
    given.meshes = meshes
    return parser.parse_args(words, given)  # `given` holds unless a word replaces it


def _words(action: argparse.Action, key: str, value: object) -> list[str]:
    """A key and its value as words of the command line."""
    option = action.option_strings[-1]
    if action.nargs == 0:
        if not isinstance(value, bool):
            raise UsageError(f"{key} must be true or false, got {value!r}")
        return [option] if value else []
    if isinstance(value, list):
        value = ("x" if key == "size" else ",").join(map(str, value))
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise UsageError(f"{key} must be text, a number or a list, got {value!r}")
    return [f"{option}={value}"]
