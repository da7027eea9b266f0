"""`topleft explain`: how a view of a mesh is drawn, and why."""

from __future__ import annotations

import argparse
from typing import Any, get_args

from topleft import Points, plan
from topleft._apps.cli.arguments import (
    SUBPIXEL_BITS_HELP,
    UsageError,
    add_command,
    add_orbit_arguments,
    positive,
    size,
    subpixel_bits,
    tolerance,
)
from topleft._apps.cli.targets import MeshSource, Orbit
from topleft._core.base.defaults import DEFAULT_SIZE
from topleft._core.base.options import Sampling
from topleft.typing import CullOption


def run_explain(options: argparse.Namespace) -> int:
    """Print how a view of a mesh is drawn: the choice of each stage and its reason."""
    mesh = MeshSource(options.mesh)()
    if isinstance(mesh, Points):
        raise UsageError(f"{options.mesh!r} holds points: plans are of triangles")
    orbit = Orbit(options.azimuth, options.elevation, options.fov, options.up, options.ortho)
    camera = orbit(mesh, options.size)
    outputs = {"fill": ("color",), "rasterize": ("triangle", "depth")}.get(options.verb, (options.verb,))
    explained = plan(
        mesh,
        camera,
        options.size,
        outputs=outputs,
        tolerance=options.tolerance,
        cull=options.cull,
        sampling=options.sampling,
        subpixel_bits=options.subpixel_bits,
        threads=options.threads,
    )
    if options.measure:
        explained.measure()
    if options.json:
        import json

        print(json.dumps(explained.to_dict(), indent=1))
    else:
        print(explained.explain())
    return 0


def add_explain_command(commands: Any) -> None:
    """Add the command to the parsers of the command line."""
    add = add_orbit_arguments(add_command(commands, "explain", run_explain, "tell how a mesh is drawn, and why"))
    add("mesh", metavar="MESH", help="a file or a built-in shape")
    verbs = ["rasterize", "coverage", "overdraw", "fill"]
    add("--verb", choices=verbs, default=verbs[0], help="(default %(default)s)")
    add("--size", type=size, default=DEFAULT_SIZE, metavar="WxH", help="pixels (default {}x{})".format(*DEFAULT_SIZE))
    add("--cull", choices=get_args(CullOption), default="none", help="leave out triangles (default none)")
    add("--sampling", choices=[str(mode) for mode in Sampling], default="center", help="of a pixel (default center)")
    add("--subpixel-bits", type=subpixel_bits, default=8, metavar="N|exact", help=SUBPIXEL_BITS_HELP)
    add("--tolerance", type=tolerance, default=0.0, metavar="PX", help="by which outlines may be off (default 0)")
    add("--threads", type=positive, metavar="N", help="(default: as many as pay)")
    add("--measure", action="store_true", help="draw it, and show the times of the stages")
    add("--json", action="store_true", help="numbers and sentences as JSON")
