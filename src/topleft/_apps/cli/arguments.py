"""The arguments of `topleft render`, as words of the command line or as keys of a job file."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable
from typing import Any, Literal, NoReturn, get_args

from topleft._apps.cli.animation import ANIMATION_SUFFIXES
from topleft._core.base.arrays import as_crease, as_point_size, as_scale, as_seconds
from topleft._core.base.color import DEFAULT_COLOR
from topleft._core.base.defaults import (
    DEFAULT_CREASE,
    DEFAULT_FOV_Y_DEG,
    DEFAULT_POINT_SIZE,
    DEFAULT_SIZE,
    PICTURE_SUFFIXES,
    SUFFIXES,
    THREE_QUARTER_DEG,
)
from topleft._core.base.options import LAYER_NAMES, Sampling, check_layers
from topleft.annex.files import LIMITS
from topleft.errors import TopleftError
from topleft.scenes import SHAPES
from topleft.typing import CullOption, ShadingOption

FAILED, REFUSED = 1, 2
"""Exit status: a part of the work failed; nothing could be done."""

UP_HELP = "the axis that points up: z for most CAD, print, scan and map files (default: as COLLADA says, else y)"

SUBPIXEL_BITS_HELP = "vertices snap to 2^-N pixels, 0 to 16, or stay where they are: exact (default 8)"

LAYERS_OF_ONE_VIEW = tuple(name for name in LAYER_NAMES if name != "flow")
"""Flow needs a second camera, or a second place."""

RENDER_HELP = f"""\
MESH is a file (OBJ, PLY, glTF, GLB, STL, OFF, and others that trimesh reads) or the name of a built-in shape:
{", ".join(SHAPES)}.

OUT is a file or a folder:
  knot.png           one picture; with --views 12: knot-000.png to knot-011.png
  pictures/          a folder, made if need be: pictures/bunny.png, or pictures/bunny-000.png, ...
  a/{{name}}-{{view}}.jpg   a pattern: {{name}} of the mesh, {{view}} and {{index}} of the mesh in the list, as numbers,
                     {{layer}}; several layers without it: knot-color.png, knot-depth.png, ...
  a/{{folder}}/{{name}}.png  {{folder}} is that of the mesh, below the one that all meshes lie in
Meshes of one name and different formats have the format in theirs: bunny-obj.png, bunny-ply.png. Further ones have
numbers, unless {{folder}} or {{index}} tells them apart: tree.png, tree-2.png.
Formats: {" ".join(SUFFIXES)} (PNG in a folder). A picture of that name is replaced, a mesh never.

--layers: {", ".join(LAYERS_OF_ONE_VIEW[:8])},
{", ".join(LAYERS_OF_ONE_VIEW[8:])}; id is short for triangle.
.npz holds all layers of a view in one file, and clip_from_world, the 4x4 matrix; without --layers color, triangle and
depth. .npy and TIFF hold ids as int32 (-1: nothing) and all other numbers as float32 (depth and distances: +inf where
nothing is). In a PNG they are 16-bit numbers, 0 where nothing is: ids plus 1, distances in thousandths, depth from 1
to 65535; normals and barycentrics are 8-bit. Text chunks say it: number = topleft:offset + topleft:scale * value.
--shading ids, depth or normals makes pictures of them to look at, and .npy files with the numbers behind.

--jobs-file: TOML or JSON. Keys are the long options without dashes in front, and mesh; each job may have its own. Keys
outside of jobs, and options of the command line, hold unless a job has its own:
  size = [512, 512]                          {{"size": [512, 512],
  [[job]]                                     "job": [
  mesh = ["bunny.obj", "spot.obj"]              {{"mesh": ["bunny.obj", "spot.obj"],
  out = "thumbs/{{name}}-{{view}}.png"              "out": "thumbs/{{name}}-{{view}}.png",
  views = 12                                     "views": 12}}]}}

--animation of a glTF file that has animations shows one of them from 0 to its end, --fps frames a second, by one
camera. With --views the mesh stands still, at rest or at --time, and the camera goes around it, as with files that have
no animations.

The mesh fills 95 % of the frame; with --views the camera keeps its distance, so the mesh keeps its size. One line at
the end lists the parts of files that meshes lack, missing textures, say.

Exit status: 0, all was written; 1, something failed, which is listed, and the rest was written, or --strict and a
mesh lacks something; 2, nothing was written.

--report FILE.json: how many were "written", "skipped" and "failed", and of each of "pictures" its "mesh", "status",
"files", "size", "bytes", "seconds", "warnings" and "error".
"""

MAX_VIEWS = 100_000
"""Most views of a turntable: each is a job that is made before the first is drawn."""


class UsageError(TopleftError):
    """The arguments contradict each other, or name nothing."""


class Parser(argparse.ArgumentParser):
    """An argument parser that complains in one line."""

    def error(self, message: str) -> NoReturn:
        """Leave with exit status 2."""
        words = message.split() if message.startswith("unrecognized") else []
        unknown = [word.partition("=")[0] for word in words if word.startswith("-")]
        guess = meant(unknown[0], self._options()) if unknown else ""
        self.exit(REFUSED, f"topleft: {message}{guess} (try: {self.prog} --help)\n")

    def _options(self) -> list[str]:
        """The options of this parser and of its commands."""
        found = [name for action in self._actions for name in action.option_strings]
        commands = [action.choices for action in self._actions if isinstance(action, argparse._SubParsersAction)]
        return found + [name for parsers in commands for parser in parsers.values() for name in parser._options()]


def meant(word: str, known: Iterable[str]) -> str:
    """Return the known word that is nearest to an unknown word, as the end of a message."""
    from difflib import get_close_matches  # 3 ms that only errors need

    found = get_close_matches(word, list(known), 1)
    return f"; did you mean {found[0]}?" if found else ""


def number(read: Callable[[float], float], wish: str) -> Callable[[str], float]:
    """The type of an argument: a number that `read` checks with a ValueError."""

    def checked(text: str) -> float:
        try:
            return read(float(text))
        except ValueError:
            raise argparse.ArgumentTypeError(f"must be {wish}, got {text!r}") from None

    return checked


def within(low: float, high: float) -> Callable[[float], float]:
    """A check that a number lies from `low` to `high`."""

    def checked(value: float) -> float:
        if not low <= value <= high:
            raise ValueError
        return value

    return checked


tolerance = number(within(0, sys.float_info.max), "a number of pixels, 0 or more")
SECONDS = number(as_seconds, "a number of seconds, 0 or more")
CREASE = number(as_crease, "an angle from 0 to 180 degrees")
SHARE = number(within(0, 1), "a number from 0 to 1")
POINT_SIZE = number(lambda size: float(as_point_size("--point-size", size, 1)), "a positive number of pixels")
# a GIF counts hundredths of a second; slower than 10 s a frame is a mistake
RATE = number(within(0.1, 100), "a number from 0.1 to 100")


def add_command(commands: Any, name: str, run: Callable[[argparse.Namespace], int], help: str, more: str = "") -> Any:  # noqa: A002
    """Return the parser of a new command, which its docstring describes; `more` stands below its arguments."""
    parser = commands.add_parser(
        name, help=help, description=run.__doc__, epilog=more, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.set_defaults(run=run)
    return parser


def add_render_arguments(parser: argparse.ArgumentParser) -> None:
    """Add all arguments of `topleft render`."""
    parser.add_argument("meshes", nargs="*", metavar="MESH", help="a file or a built-in shape")
    add_picture_arguments(parser)
    many = parser.add_argument_group("many pictures")
    add = many.add_argument
    add("--jobs", type=positive, default=1, metavar="N", help="pictures that are drawn side by side (default 1)")
    add("--dask", metavar="local|ADDRESS", help="draw on a Dask cluster: tcp://HOST:PORT, or --jobs processes here")
    add("--jobs-file", metavar="FILE", help="jobs to render, as TOML or JSON; see below")
    add("--resume", action="store_true", help="leave out pictures whose files were made of this very input")
    add("--strict", action="store_true", help="exit with 1 if a mesh lacks something of its file: a texture, say")
    add("--report", metavar="FILE", help="the result of each picture, as JSON; see below")
    add(
        "--warnings",
        choices=["short", "all"],
        default="short",
        help="parts of files that meshes lack: the first few in one line (default), or all, a line each",
    )
    add("--sheet", metavar="FILE", help=f"all pictures on one sheet: {' '.join(PICTURE_SUFFIXES)}")
    add(
        "--animation",
        metavar="FILE",
        help="the clip of an animated file, which --clip chooses, or --views of other meshes one after the other "
        f"({{name}} of the mesh): {' '.join(ANIMATION_SUFFIXES)}; see below",
    )
    add("--fps", type=RATE, default=20.0, metavar="N", help="frames a second of an animation (default 20)")


def add_picture_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that a job of a job file may have, too."""
    add = parser.add_argument
    add("-o", "--out", metavar="OUT", help="a file, a folder or a pattern")
    add(
        "--size",
        type=size,
        default=DEFAULT_SIZE,
        metavar="WxH",
        help="pixels, or the side (default {}x{})".format(*DEFAULT_SIZE),
    )
    add("--views", type=views, default=1, metavar="N", help="a turntable of N pictures (default 1)")
    add("--layers", type=_layers, default=(), metavar="NAME,...", help="layers to write; see below (default color)")
    add(
        "--depth-scale",
        type=number(as_scale, "a positive number"),
        default=0.001,
        metavar="X",
        help="units of a step of distances in PNG, as BOP has it: 1 for millimetres (default 0.001: of metres)",
    )
    add("--time", type=SECONDS, metavar="SECONDS", help="of an animation of a glTF file (default: at rest)")
    add("--clip", type=_clip, metavar="N|NAME|all", help="the animation of a file, from 0 (default the first)")
    add_scale(parser)
    add(
        "--threads",
        type=positive,
        metavar="N",
        help="of a picture (default: as many as there are cores, 1 with --jobs)",
    )
    add = add_orbit_arguments(parser.add_argument_group("camera"))
    add("--camera", type=_index, metavar="N", help="the camera N of a glTF file, from 0")
    add = parser.add_argument_group("look").add_argument
    add(
        "--shading",
        choices=get_args(ShadingOption),
        default="smooth",
        metavar="NAME",
        help=f"{', '.join(get_args(ShadingOption))} (default smooth)",
    )
    add("--color", type=_rgb, default=DEFAULT_COLOR, metavar="COLOR", help="of a mesh without colours")
    add(
        "--background",
        type=_rgba,
        metavar="COLOR",
        help="a name, #rrggbb[aa] or transparent (default white; behind white meshes and on sheets a light blue-grey)",
    )
    add(
        "--crease",
        type=CREASE,
        default=DEFAULT_CREASE,
        metavar="DEG",
        help="edges that bend by more are sharp, of a mesh without normals; 0: all, 180: none (default %(default)g)",
    )
    add("--texture", metavar="FILE", help="a picture for all of a mesh that has texture coordinates")
    add("--matcap", metavar="FILE", help="a picture of a lit sphere, for --shading matcap")
    add(
        "--environment",
        metavar="SKY,GROUND",
        help="light from all around: a colour, one above and one below, or a picture of all directions",
    )
    add("--opacity", type=SHARE, metavar="X", help="0 to 1: like glass; each layer hides X")
    add(
        "--tolerance",
        type=tolerance,
        default=0.0,
        metavar="PX",
        help="draw a coarser level of the mesh, its outline off by at most PX pixels (default 0: the mesh)",
    )
    add("--wireframe", action="store_true", help="draw the edges over it")
    add(
        "--cull",
        choices=get_args(CullOption),
        help="the side to leave out, whatever materials say (default: backs of those that have one side)",
    )
    samplings = [str(mode) for mode in Sampling if mode is Sampling.CENTER or mode.n_samples > 1]
    add(
        "--sampling",
        choices=samplings,
        metavar="NAME",
        help=f"samples of a pixel: {', '.join(samplings)} (default msaa4; center with --layers, .npz, --opacity and "
        "--shading ids or depth)",
    )
    add("--subpixel-bits", type=subpixel_bits, default=8, metavar="N|exact", help=SUBPIXEL_BITS_HELP)
    add(
        "--point-size",
        type=POINT_SIZE,
        default=DEFAULT_POINT_SIZE,
        metavar="PX",
        help="of clouds of points: the diameter of a point, pixels (default %(default)g)",
    )
    add("--root", metavar="FOLDER", help="meshes may name files of this folder, too (default: of their folder alone)")
    for option, limit in LIMITS.items():
        add(f"--{option.replace('_', '-')}", type=positive, metavar="N", help=f"refuse files of more {limit.what}")


def add_orbit_arguments(parser: Any) -> Callable[..., Any]:
    """Add the arguments of `targets.Orbit` to a parser or a group, and return what adds others."""
    azimuth, elevation = THREE_QUARTER_DEG
    add: Callable[..., Any] = parser.add_argument
    add("--azimuth", type=float, default=azimuth, metavar="DEG", help="right of the front (default %(default)g)")
    add("--elevation", type=float, default=elevation, metavar="DEG", help="above level (default %(default)g)")
    add("--fov", type=float, default=DEFAULT_FOV_Y_DEG, metavar="DEG", help="bottom to top (default %(default)g)")
    add("--ortho", action="store_true", help="no perspective")
    add("--up", choices=["y", "z"], help=UP_HELP)
    return add


def add_scale(parser: argparse.ArgumentParser) -> None:
    """Add --scale."""
    parser.add_argument(
        "--scale",
        type=number(as_scale, "a positive number"),
        default=1.0,
        metavar="X",
        help="factor of the coordinates of a file: 0.001 makes metres of millimetres (default 1)",
    )


def size(text: str) -> tuple[int, int]:
    """The width and height of a picture, or its side."""
    width, cross, height = text.lower().partition("x")
    height = height if cross else width
    if not (width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT, 1280x720 say, or the side of a square, got {text!r}")
    return int(width), int(height)


def views(text: str) -> int:
    """A number of views."""
    n = positive(text)
    if n > MAX_VIEWS:
        raise argparse.ArgumentTypeError(f"must be at most {MAX_VIEWS}, got {n:,}" if n < 10**18 else "is too large")
    return n


def positive(text: str) -> int:
    """A positive whole number."""
    if not (text.isdecimal() and int(text)):
        raise argparse.ArgumentTypeError(f"must be a positive whole number, got {text!r}")
    return int(text)


def subpixel_bits(text: str) -> int | Literal["exact"]:
    """The grid that vertices snap to."""
    if text == "exact":
        return "exact"
    if not (text.isdecimal() and int(text) <= 16):
        raise argparse.ArgumentTypeError(f"must be a whole number from 0 to 16, or exact, got {text!r}")
    return int(text)


def _index(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"must be a whole number from 0, got {text!r}")
    return int(text)


def _clip(text: str) -> int | str:
    return int(text) if text.isdecimal() else text


def _layers(text: str) -> tuple[str, ...]:
    try:
        given = (name.strip() for name in text.split(","))
        names = check_layers("triangle" if name == "id" else name for name in given)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    if "flow" in names:
        raise argparse.ArgumentTypeError("layer 'flow' needs two cameras: see topleft.render_layers")
    return names


def _rgba(text: str) -> tuple[int, ...]:
    if text.lower() in ("transparent", "none"):
        return (0, 0, 0, 0)
    from PIL import ImageColor

    try:
        return ImageColor.getcolor(text, "RGBA")  # type: ignore[return-value]
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a colour name or #rrggbb, got {text!r}") from None


def _rgb(text: str) -> tuple[int, ...]:
    return _rgba(text)[:3]
