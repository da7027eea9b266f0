"""The command line: `render`, `mask`, `bop`, `bake`, `raster`, `explore`, `explain`, `doctor`, `info`.

Exit status: 0, all pictures were written; 1, some of several inputs failed and the rest were written, or, with
--strict, a mesh lacks something of its file; 2, nothing was written, for a reason in one line on stderr.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import NoReturn

from topleft import build_info
from topleft._apps.cli.arguments import FAILED, REFUSED, RENDER_HELP, Parser, add_command, add_render_arguments
from topleft._apps.cli.bake import add_bake_command
from topleft._apps.cli.bop import add_bop_command
from topleft._apps.cli.doctor import add_doctor_command
from topleft._apps.cli.explain import add_explain_command
from topleft._apps.cli.explore import add_explore_command
from topleft._apps.cli.mask import add_mask_command
from topleft._apps.cli.raster import add_raster_command
from topleft._apps.cli.render import run_render
from topleft._apps.cli.report import TOLD, complain, complain_of_lacks, one_line
from topleft._core.base.notes import listening
from topleft.errors import MeshWarning


def main(arguments: Sequence[str] | None = None) -> int:
    """Return the exit status of the command line, `sys.argv` unless arguments are given."""
    parser = parser_of_commands()
    options = parser.parse_args(arguments)
    if options.run is None:
        parser.print_help()
        return 0
    try:
        with warnings.catch_warnings(), listening() as lacks, hearing_sigterm():
            warnings.showwarning = tell_of_ours  # type: ignore[assignment]
            status: int = options.run(options)
        complain_of_lacks(lacks)
    except TOLD as error:
        complain(one_line(error))
        return REFUSED
    except KeyboardInterrupt:
        complain("interrupted")
        return 130
    except Terminated:
        complain("terminated")
        return 143
    except RuntimeError as error:
        if type(error).__name__ != "BrokenProcessPool":  # by name: its module is not imported for one mesh
            raise
        complain("a process that draws was killed, maybe for want of memory: try fewer --jobs, then --resume")
        return FAILED
    return status


def tell_of_ours(message: Warning | str, category: type[Warning], filename: str, *_: object) -> None:
    """Print a warning of topleft in one line; those of other packages are for programmers."""
    if category in (UserWarning, MeshWarning) and f"{os.sep}topleft{os.sep}" in filename:
        complain(" ".join(str(message).split()))


class Terminated(BaseException):
    """SIGTERM: like Ctrl-C it ends the command, with its processes and temporary files."""


@contextmanager
def hearing_sigterm() -> Iterator[None]:
    """Raise `Terminated` on SIGTERM meanwhile, in the main thread: only it may set handlers."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(*_: object) -> NoReturn:
        raise Terminated

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def run_info(_: argparse.Namespace) -> int:
    """Print which instruction sets were built, and the one in use."""
    for name, value in build_info().items():
        if isinstance(value, Mapping):
            print(f"{name}:", *(f"  {key}: {item}" for key, item in value.items()), sep="\n")
        else:
            print(f"{name}:", *(value if isinstance(value, (list, tuple)) else [value]), file=sys.stdout)
    return 0


def parser_of_commands() -> Parser:
    """Return the parser of all commands with their options."""
    parser = Parser(prog="topleft", description="Exact triangle rasterization on the CPU.")
    parser.add_argument("--version", action="version", version=f"topleft {build_info()['version']}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")
    parser.set_defaults(run=None)
    add_command(commands, "info", run_info, "print the version and the build")
    add_render_arguments(add_command(commands, "render", run_render, "render meshes to pictures", RENDER_HELP))
    add_explain_command(commands)
    add_mask_command(commands)
    add_bop_command(commands)
    add_bake_command(commands)
    add_raster_command(commands)
    add_explore_command(commands)
    add_doctor_command(commands)
    return parser
