"""The command line: `topleft render MESH [MESH ...] -o OUT` and `topleft info`.

Exit status: 0, all pictures were written; 1, some of several inputs failed and the rest were written; 2, nothing could
be done with what was asked, told in one line on stderr.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt
from PIL import ImageColor

from topleft._isa import build_info
from topleft.camera import DEFAULT_FOV_Y_DEG, THREE_QUARTER_DEG, Camera
from topleft.errors import MissingPackageError, TopleftError
from topleft.files import SUFFIXES, load, save_image
from topleft.fragments import Fragments
from topleft.mesh import Mesh
from topleft.models import Cull
from topleft.render import DEFAULT_SIZE, draw_edges, rasterize_mesh
from topleft.scenes import SHAPES, shape
from topleft.shade import DEFAULT_COLOR, Shading, eye_normals, shade

FAILED, REFUSED = 1, 2
"""Exit statuses: a part of the work failed; nothing could be done."""

RENDER_HELP = f"""\
MESH is a file that trimesh reads (OBJ, PLY, STL, glTF, GLB, OFF, ...) or the name of a built-in shape:
{', '.join(SHAPES)}.

OUT is a file or a folder:
  knot.png           one picture; with --views 12: knot-000.png to knot-011.png
  pictures/          a folder, made if need be: pictures/bunny.png, or pictures/bunny-000.png, ...
  a/{{name}}-{{view}}.jpg   a pattern: {{name}} of the mesh, {{view}} and {{index}} of the mesh in the list, as numbers
Formats: {' '.join(SUFFIXES)} (PNG in a folder). A picture of that name is replaced, a mesh never.
.npy holds the numbers behind the picture: ids int32 (-1: nothing), depth float32 (window depth, +inf: nothing), normals
float32 (eye space), else the RGBA picture. .npz holds color, triangle, depth and clip_from_world, the 4x4 matrix.
"""


class UsageError(TopleftError):
    """What was asked for makes no sense."""


@dataclass(frozen=True)
class Job:
    """One mesh and where its pictures go."""

    source: str
    targets: tuple[Path, ...]


class Parser(argparse.ArgumentParser):
    """An argument parser that complains in one line."""

    def error(self, message: str) -> NoReturn:
        """Leave with exit status 2."""
        self.exit(REFUSED, f"topleft: {message} (try: {self.prog} --help)\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Return the exit status of the command line, `sys.argv` unless arguments are given."""
    options = _parser().parse_args(arguments)
    try:
        status: int = options.run(options)
    except (TopleftError, OSError, ValueError, MemoryError) as error:
        _complain(_one_line(error))
        return REFUSED
    except KeyboardInterrupt:
        _complain("interrupted")
        return 130
    return status


def run_info(_: argparse.Namespace) -> int:
    """Print what was built and what runs."""
    for name, value in build_info().items():
        if isinstance(value, Mapping):
            print(f"{name}:", *(f"  {key}: {item}" for key, item in value.items()), sep="\n")
        else:
            print(f"{name}:", *(value if isinstance(value, (list, tuple)) else [value]))
    return 0


def run_render(options: argparse.Namespace) -> int:
    """Render every mesh; one that fails does not stop the rest."""
    jobs = plan_jobs(options.meshes, options.out, options.views)
    for folder in dict.fromkeys(target.parent for job in jobs for target in job.targets):
        _check_writable(folder)
    failed = []
    with _Progress(sum(len(job.targets) for job in jobs)) as progress:
        for job in jobs:
            try:
                for _ in render_job(job, options):
                    progress.step()
            except MissingPackageError:
                raise
            except (TopleftError, OSError, ValueError, MemoryError) as error:
                if len(jobs) == 1:
                    raise
                failed.append(job.source)
                progress.complain(_one_line(error))
    if failed:
        _complain(f"{len(failed)} of {len(jobs)} meshes failed: {' '.join(failed)}")
        return FAILED
    return 0


def render_job(job: Job, options: argparse.Namespace) -> Iterator[Path]:
    """Write the pictures of one mesh and give the name of each."""
    mesh = read_mesh(job.source)
    width, height = options.size
    for i_view, target in enumerate(job.targets):
        camera = Camera.framing(
            mesh,
            azimuth_deg=options.azimuth + 360 * i_view / len(job.targets),
            elevation_deg=options.elevation,
            fov_y_deg=options.fov,
            up=options.up,
            ortho=options.ortho,
            aspect=width / height,
        )
        frags = rasterize_mesh(mesh, camera, options.size, cull=options.cull, threads=options.threads)
        target.parent.mkdir(parents=True, exist_ok=True)
        save_image(target, _content(target, frags, mesh, camera, options), background=_opaque(options.background))
        yield target


def read_mesh(source: str) -> Mesh:
    """The mesh of a file or the built-in shape of that name."""
    if source in SHAPES:
        return Mesh(*shape(source))
    if not Path(source).exists() and Path(source).name == source and "." not in source:
        raise UsageError(f"there is no file and no built-in shape {source!r}; shapes: {', '.join(SHAPES)}")
    return load(source)


def plan_jobs(sources: Sequence[str], out: str, n_views: int) -> list[Job]:
    """What is to be written where, before anything is.

    Raises
    ------
    UsageError
        If two pictures would have the same name, or a picture that of a mesh, or OUT cannot hold them all.
    """
    pattern = _pattern(out, n_meshes=len(sources), n_views=n_views)
    owner_of: dict[str, str] = {}
    jobs = []
    for i_mesh, source in enumerate(sources):
        name = source if source in SHAPES else Path(source).stem
        targets = []
        for i_view in range(n_views):
            # Not str.format: a folder may have other braces in its name.
            filled = pattern.replace("{view}", f"{i_view:03d}").replace("{index}", f"{i_mesh:03d}")
            targets.append(Path(filled.replace("{name}", name)))
            key = str(targets[-1].absolute()).casefold()  # on some disks Bunny.png is bunny.png
            if key in owner_of:
                raise UsageError(
                    f"{owner_of[key]!r} and {source!r} would both be written to {str(targets[-1])!r}; "
                    "put {index} into OUT or give each a folder"
                )
            owner_of[key] = source
        jobs.append(Job(source, tuple(targets)))
    meshes = [Path(source) for source in sources if source not in SHAPES and Path(source).exists()]
    for target in (target for job in jobs for target in job.targets if target.exists()):
        if any(target.samefile(mesh) for mesh in meshes):
            raise UsageError(f"OUT would overwrite the mesh {str(target)!r}")
    return jobs


def _pattern(out: str, *, n_meshes: int, n_views: int) -> str:
    """OUT as a file name with {name}, {view} and {index} where several pictures need them."""
    path = Path(out)
    is_folder = out.endswith(("/", "\\")) or path.is_dir() or not path.suffix
    if not out or (path.suffix.lower() not in SUFFIXES and not is_folder):
        raise UsageError(f"OUT must end in one of {' '.join(SUFFIXES)}, or in / for a folder, got {out!r}")
    if is_folder:
        return str(path / ("{name}-{view}.png" if n_views > 1 else "{name}.png"))
    if n_meshes > 1 and "{name}" not in out and "{index}" not in out:
        raise UsageError(f"several meshes need a folder or {{name}} in OUT, got {out!r}")
    if n_views > 1 and "{view}" not in out:
        return str(path.with_name(f"{path.stem}-{{view}}{path.suffix}"))
    return out


def _check_writable(folder: Path) -> None:
    """Find out before any work whether pictures can be put into a folder, made or yet to be made."""
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir():
        raise UsageError(f"cannot write to the folder {str(folder)!r}: {str(existing)!r} is a file")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise UsageError(f"cannot write to the folder {str(folder)!r}: permission denied")


def _content(
    target: Path, frags: Fragments, mesh: Mesh, camera: Camera, options: argparse.Namespace
) -> npt.NDArray[Any] | dict[str, npt.NDArray[Any]]:
    """What goes into the file: the picture, or the numbers behind it."""
    suffix = target.suffix.lower()
    if suffix == ".npy":
        if options.shading == Shading.IDS:
            return frags.triangle
        if options.shading == Shading.DEPTH:
            return frags.depth
        if options.shading == Shading.NORMALS:
            normals = np.zeros((*frags.triangle.shape, 3), dtype=np.float32)
            normals[frags.mask] = eye_normals(frags, mesh, camera, is_smooth=True)
            return normals
    color = shade(frags, mesh, camera, shading=options.shading, color=options.color, background=options.background)
    if options.wireframe:
        draw_edges(color, frags, mesh, camera, cull=options.cull, threads=options.threads)
    if suffix != ".npz":
        return color
    matrix = camera.clip_from_world(options.size)
    return {"color": color, "triangle": frags.triangle, "depth": frags.depth, "clip_from_world": matrix}


def _opaque(color: tuple[int, int, int, int]) -> tuple[int, int, int]:
    """What JPEG shows for a background: white if it is transparent."""
    return color[:3] if color[3] else (255, 255, 255)


class _Progress:
    """A bar on stderr when a person looks at it and there is more than one picture; nothing otherwise."""

    def __init__(self, n_pictures: int) -> None:
        self._bar: Any = None
        if n_pictures > 1 and sys.stderr.isatty():
            try:
                from tqdm import tqdm
            except ImportError:
                return
            self._bar = tqdm(total=n_pictures, unit="picture", file=sys.stderr)

    def __enter__(self) -> _Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def step(self) -> None:
        if self._bar is not None:
            self._bar.update()

    def complain(self, message: str) -> None:
        if self._bar is not None:
            self._bar.clear()
        _complain(message)


def _complain(message: str) -> None:
    print(f"topleft: {message}", file=sys.stderr)


def _one_line(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return "not enough memory for a mesh or picture of this size"
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename!r}" if error.filename else error.strerror
    return " ".join(str(error).split())


def _parser() -> Parser:
    parser = Parser(prog="topleft", description="Exact triangle rasterization on the CPU.")
    parser.add_argument("--version", action="version", version=f"topleft {build_info()['version']}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    info = commands.add_parser("info", help="print the version and what was built", description=run_info.__doc__)
    info.set_defaults(run=run_info)
    render = commands.add_parser(
        "render",
        help="render meshes to pictures",
        description="Render meshes to pictures.",
        epilog=RENDER_HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    render.set_defaults(run=run_render)
    add = render.add_argument
    azimuth, elevation = THREE_QUARTER_DEG
    width, height = DEFAULT_SIZE
    add("meshes", nargs="+", metavar="MESH", help="a file or a built-in shape")
    add("-o", "--out", required=True, metavar="OUT", help="a file, a folder or a pattern")
    add("--size", type=_size, default=DEFAULT_SIZE, metavar="WxH", help=f"pixels (default {width}x{height})")
    add("--azimuth", type=float, default=azimuth, metavar="DEG", help="right of the front (default %(default)g)")
    add("--elevation", type=float, default=elevation, metavar="DEG", help="above level (default %(default)g)")
    add("--fov", type=float, default=DEFAULT_FOV_Y_DEG, metavar="DEG", help="bottom to top (default %(default)g)")
    add("--ortho", action="store_true", help="no perspective")
    add("--up", choices=["y", "z"], default="y", help="the axis that points up (default y)")
    add("--shading", choices=[str(mode) for mode in Shading], default="smooth", help="(default smooth)")
    add("--color", type=_rgb, default=DEFAULT_COLOR, metavar="COLOR", help="of a mesh without colours")
    add("--background", type=_rgba, default=(255, 255, 255, 255), metavar="COLOR",
        help="a name, #rrggbb[aa] or transparent (default white)")
    add("--cull", choices=[str(side) for side in Cull], default="none", help="leave out triangles (default none)")
    add("--wireframe", action="store_true", help="draw the edges over it")
    add("--views", type=_positive, default=1, metavar="N", help="a turntable of N pictures (default 1)")
    add("--threads", type=_positive, default=None, metavar="N", help="(default: as many as there are cores)")
    return parser


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.lower().partition("x")
    if not (cross and width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT, 1280x720 say, got {text!r}")
    return int(width), int(height)


def _positive(text: str) -> int:
    if not (text.isdecimal() and int(text)):
        raise argparse.ArgumentTypeError(f"must be a positive whole number, got {text!r}")
    return int(text)


def _rgba(text: str) -> tuple[int, ...]:
    if text.lower() in ("transparent", "none"):
        return (0, 0, 0, 0)
    try:
        return ImageColor.getcolor(text, "RGBA")  # type: ignore[return-value]
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a colour name or #rrggbb, got {text!r}") from None


def _rgb(text: str) -> tuple[int, ...]:
    return _rgba(text)[:3]
