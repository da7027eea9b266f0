"""`topleft bake`: the atlas of a mesh, from itself or from a finer mesh."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path
from typing import Any, get_args

import numpy as np
import numpy.typing as npt

from topleft import Baked, Mesh, bake, load, save_image
from topleft._apps.cli.arguments import UsageError, add_command, positive, size
from topleft._apps.cli.report import complain
from topleft._core.base.defaults import SUFFIXES
from topleft.errors import MeshError
from topleft.typing import BakeOption, BakeRuleOption

BAKE_HELP = """\
MESH and --source are mesh files; MESH has texture coordinates. OUT holds a value for each texel: .npy every kind; PNG
normals as normal maps do, colours, and triangles up to 65535, 65535 where there is none; TIFF positions, too.

examples:
  topleft bake robot.glb -o normals.png --what normal --size 2048
  topleft bake low.obj -o tangent.png --what tangent_normal --source high.ply --max-distance 0.02
"""


def run_bake(options: argparse.Namespace) -> int:
    """Write the atlas of a mesh."""
    if Path(options.out).suffix.lower() not in SUFFIXES:
        raise UsageError(f"-o {options.out}: the name must end in one of {' '.join(SUFFIXES)}")
    mesh = mesh_of(options.mesh)
    source = None if options.source is None else mesh_of(options.source)
    how: dict[str, Any] = {"rule": options.rule, "gutter": options.gutter, "threads": options.threads}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        baked = bake(mesh, options.what, options.size, source=source, max_distance=options.max_distance, **how)
    for one in caught:
        complain(f"{options.mesh}: {one.message}")
    Path(options.out).parent.mkdir(parents=True, exist_ok=True)
    save_image(options.out, drawn(baked, options))
    return 0


def mesh_of(path: str) -> Mesh:
    """The mesh of a file."""
    found = load(path)
    if not isinstance(found, Mesh):
        raise MeshError(f"{path} holds points, and a mesh is baked")
    return found


def drawn(baked: Baked, options: argparse.Namespace) -> npt.NDArray[Any]:
    """The values as the file holds them."""
    suffix = Path(options.out).suffix.lower()
    if suffix == ".npy" or (suffix in (".tif", ".tiff") and options.what in ("position", "triangle")):
        return baked.values
    if options.what == "triangle":
        if baked.values.max(initial=0) >= 65535:
            raise UsageError(f"-o {options.out}: this format holds triangles below 65535; write .npy or .tif")
        return np.where(baked.values < 0, 65535, baked.values).astype(np.uint16)
    if options.what == "position":
        raise UsageError(f"-o {options.out}: positions go to .npy or .tif")
    values = baked.values if options.what == "color" else baked.values * np.float32(127.5) + np.float32(127.5)
    return np.rint(values).clip(0, 255).astype(np.uint8)


def add_bake_command(commands: Any) -> None:
    """Add the command to the parsers of the command line."""
    add = add_command(
        commands,
        "bake",
        run_bake,
        "write the normals, colours, positions or triangles of a mesh into its texture",
        BAKE_HELP,
    ).add_argument
    add("mesh", metavar="MESH", help="mesh file with texture coordinates")
    add("-o", "--out", metavar="OUT", required=True, help="file to be written")
    add("--what", choices=get_args(BakeOption), default="normal", help="the values to bake (default: normal)")
    add("--size", type=size, default=(1024, 1024), metavar="WxH", help="texels (default: 1024x1024)")
    add("--rule", choices=get_args(BakeRuleOption), default="center", help="which triangles a texel has")
    add("--gutter", type=int, default=8, metavar="N", help="texels round charts (default: 8)")
    add("--source", metavar="FILE", help="another mesh: its nearest points give the values")
    add("--max-distance", type=float, metavar="D", help="of those points, units of the mesh")
    add("--threads", type=positive, metavar="N", help="threads that draw")
