"""Assigns a file to each picture before anything is drawn: from arguments to jobs.

Input: parsed arguments. Output: a list of `MeshJobs`.
"""

from __future__ import annotations

import argparse
import itertools
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from topleft import Camera, Environment, Material, Mesh, Points, Texture, load, load_cameras
from topleft._apps.batch.jobs import Job
from topleft._apps.batch.made import FromFile
from topleft._apps.cli.arguments import MAX_VIEWS, UsageError, meant
from topleft._apps.cli.report import TOLD
from topleft._core.base.array_types import Array
from topleft._core.base.color import DEFAULT_COLOR
from topleft._core.base.defaults import DEFAULT_CREASE, DEFAULT_POINT_SIZE, SUFFIXES
from topleft._core.base.options import Sampling
from topleft._core.base.remote import Location, RemotePath, location_of
from topleft._core.base.whole_file import remove_stale_parts
from topleft.annex.files import LIMITS, clip_length, read_picture
from topleft.errors import MeshError, MissingPackageError
from topleft.scenes import SHAPES, shape

SHADINGS_WITH_NUMBERS: Mapping[str, str] = {"ids": "triangle", "depth": "depth", "normals": "camera_normal"}
"""Shadings that are a layer made visible: .npy holds the layer."""

MAX_FOLDERS = 200
"""Most nested folders in the path of a picture."""


@dataclass(frozen=True)
class MeshSource(FromFile):
    """The mesh of a file, or the built-in shape of that name."""

    texture: str | None = None
    crease: float = DEFAULT_CREASE
    point_size: float = DEFAULT_POINT_SIZE
    time: float | None = None
    clip: int | str | None = None
    scale: float = 1.0
    limits: tuple[tuple[str, int | str | None], ...] = ()
    """What the file may have and name, as for `load`."""

    def __call__(self) -> Mesh | Points:
        """Read it."""
        mesh = self._mesh()
        if isinstance(mesh, Points):
            return replace(mesh, size=self.point_size)
        if self.texture is None:
            return mesh
        if mesh.uv is None:
            raise MeshError(f"--texture needs texture coordinates, and {self.path!r} has none")
        return replace(mesh, materials=(Material(texture=read_texture(self.texture)),), material_of_triangle=None)

    def _mesh(self) -> Mesh | Points:
        if self.path in SHAPES:
            if self.time is not None:
                raise UsageError(f"--time needs a file with animations, got the built-in shape {self.path!r}")
            vertices, triangles = shape(self.path)
            return Mesh(vertices * self.scale, triangles, crease=self.crease)
        if not Path(self.path).exists() and Path(self.path).name == self.path and "." not in self.path:
            raise UsageError(f"there is no file and no built-in shape {self.path!r}; shapes: {', '.join(SHAPES)}")
        limits: dict[str, Any] = dict(self.limits)
        return load(self.path, crease=self.crease, time=self.time, clip=self.clip, scale=self.scale, **limits)


def read_texture(path: str) -> Texture:
    """The picture of a file; errors as of `read_picture`."""
    return Texture(read_picture(path))


def read_environment(text: str) -> Environment:
    """The light from all around of a colour, two colours, or the picture of a file."""
    from PIL import ImageColor

    try:
        colors = [ImageColor.getcolor(name.strip(), "RGB") for name in text.split(",")]
    except ValueError:
        if not Path(text).suffix:
            raise UsageError(f"--environment must be one or two colours or a picture, got {text!r}") from None
        return Environment(image=read_picture(text)[..., :3])
    if len(colors) > 2:
        raise UsageError(f"--environment must be one or two colours, got {len(colors)}")
    return Environment(colors[0], colors[1] if len(colors) == 2 else None)  # type: ignore[arg-type]


@dataclass(frozen=True)
class EnvironmentOfFile:
    """The light from all around of an environment; unless `up` is given the axis of the mesh is above."""

    environment: Environment
    up: str | None

    def __call__(self, mesh: Mesh | Points) -> Environment:
        """Return it."""
        up = mesh.up if self.up is None and isinstance(mesh, Mesh) else self.up
        return self.upright if up == "z" else self.environment

    @cached_property
    def upright(self) -> Environment:
        """The environment with z up."""
        return replace(self.environment, up=(0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Orbit:
    """The camera of `Camera.framing` for any mesh; `fits`: the mesh fills the frame."""

    azimuth_deg: float
    elevation_deg: float
    fov_y_deg: float
    up: Any
    ortho: bool
    fits: bool = True

    def __call__(self, mesh: Mesh | Points | Array, size: tuple[int, int]) -> Camera:
        """Return it; of an array the camera of these points (N, 3)."""
        return Camera.framing(
            mesh,
            azimuth_deg=self.azimuth_deg,
            elevation_deg=self.elevation_deg,
            fov_y_deg=self.fov_y_deg,
            up=self.up,
            ortho=self.ortho,
            aspect=size[0] / size[1],
            fit="silhouette" if self.fits else "sphere",
        )


MOMENTS_TO_FRAME = 5
"""Moments of a clip that its camera frames, from the first to the last: a full turn has four sides."""


@dataclass(frozen=True)
class ClipOrbit:
    """The camera of all frames of a clip; it shows `meshes`, the mesh at some moments of the clip."""

    orbit: Orbit
    meshes: tuple[MeshSource, ...]

    def __call__(self, mesh: Mesh | Points, size: tuple[int, int]) -> Camera:  # noqa: ARG002
        """Return it."""
        return self.orbit(self._points, size)

    @cached_property
    def _points(self) -> Array:
        """The vertices in use of all meshes, (N, 3)."""
        meshes = [mesh() for mesh in self.meshes]
        return np.concatenate(
            [
                mesh.positions if isinstance(mesh, Points) else mesh.vertices[np.unique(mesh.triangles)]
                for mesh in meshes
            ]
        )


WHITE, BACKDROP = (255, 255, 255, 255), (196, 212, 232, 255)
"""Backgrounds of a mesh, and of a white mesh: not grey, because white faces are grey under white light."""

NEARLY_WHITE = 240


@dataclass(frozen=True)
class Backdrop:
    """The default background of a mesh: white, unless the mesh is white and would fade into it."""

    def __call__(self, mesh: Mesh | Points) -> tuple[int, int, int, int]:
        """Return it."""
        return BACKDROP if min(mean_color(mesh)) >= NEARLY_WHITE else WHITE


def mean_color(mesh: Mesh | Points) -> tuple[float, float, float]:
    """The mean sRGB of a mesh: materials weighted by their triangles, textures, colours of vertices."""
    given = DEFAULT_COLOR if mesh.colors is None else mesh.colors[:, :3].mean(axis=0)
    if isinstance(mesh, Points) or not mesh.materials:
        red, green, blue = np.asarray(given, np.float64).tolist()
        return red, green, blue
    rows = mesh.material_of_triangle
    n = len(mesh.materials)
    shares = np.eye(n)[0] if rows is None else np.bincount(rows, minlength=n) / max(1, len(rows))
    total = np.zeros(3)
    for share, one in zip(shares.tolist(), mesh.materials, strict=True):
        own = np.full(3, 255.0) if one.color is None else np.array(one.color[:3], np.float64)
        if share and one.texture is not None and mesh.uv is not None:
            own *= one.texture.image[..., :3].mean(axis=(0, 1)) / 255
        elif one.color is None and mesh.colors is None:
            own = np.array(DEFAULT_COLOR, np.float64)
        total += share * own * (1.0 if mesh.colors is None else np.asarray(given) / 255)
    red, green, blue = total.tolist()
    return red, green, blue


@dataclass(frozen=True)
class FileCamera(FromFile):
    """A camera of the file of the mesh."""

    index: int
    time: float | None = None
    clip: int | str | None = None
    scale: float = 1.0
    limits: tuple[tuple[str, Any], ...] = ()

    def __call__(self, mesh: Mesh, size: tuple[int, int]) -> Camera:  # noqa: ARG002
        """Read it."""
        how: dict[str, Any] = {"time": self.time, "clip": self.clip, "scale": self.scale, **dict(self.limits)}
        cameras = [] if self.path in SHAPES else load_cameras(self.path, **how)
        if self.index >= len(cameras):
            raise MeshError(f"--camera {self.index}: {self.path!r} has {len(cameras)} cameras")
        return cameras[self.index]


@dataclass(frozen=True)
class MeshJobs:
    """A mesh and its jobs, one for each view."""

    source: str
    name: str
    jobs: tuple[Job, ...]


def plan_jobs(options: argparse.Namespace, start: int = 0) -> list[MeshJobs]:
    """Return the jobs of each mesh of the arguments; `start` is the index of the first mesh."""
    if options.camera is not None and options.views > 1:
        raise UsageError("--camera does not go with --views: a camera of a file stands still")
    is_played = bool(options.animation) and options.time is None and options.views == 1
    if options.clip is not None and options.time is None and not is_played:
        raise UsageError("--clip needs --time: which second of it, or --animation without --views")
    drawing = _render_options(options)
    limits = tuple((name, getattr(options, name)) for name in (*LIMITS, "root"))
    moments = [
        _moments(source, options, dict(limits)) if is_played else (options.time,) * options.views
        for source in options.meshes
    ]
    pattern = _pattern(options.out, options, has_views=any(len(times) > 1 for times in moments))
    groups = []
    names = names_of(options.meshes, with_numbers="{index}" not in pattern, with_folders="{folder}" in pattern)
    folders = folders_of(options.meshes)
    for i_mesh, source in enumerate(options.meshes, start):
        name = names[i_mesh - start]
        times = moments[i_mesh - start]
        meshes = [
            MeshSource(
                source, options.texture, options.crease, options.point_size, time, options.clip, options.scale, limits
            )
            for time in times
        ]
        steps = [i * (len(meshes) - 1) // (MOMENTS_TO_FRAME - 1) for i in range(MOMENTS_TO_FRAME)]
        of_clip = ClipOrbit(_orbit(options, 0), tuple(meshes[i] for i in dict.fromkeys(steps)))
        jobs = []
        for i_view, (time, mesh) in enumerate(zip(times, meshes, strict=True)):
            # Not str.format: a folder may have other braces in its name.
            filled = pattern.replace("{view}", f"{i_view:03d}").replace("{index}", f"{i_mesh:03d}")
            filled = filled.replace("{folder}", folders[i_mesh - start])
            camera: Orbit | ClipOrbit | FileCamera = of_clip if len(times) > options.views else _orbit(options, i_view)
            if options.camera is not None:
                camera = FileCamera(source, options.camera, time, options.clip, options.scale, limits)
            path = filled.replace("{name}", name)
            layers = _layers(path, options)
            jobs.append(Job(mesh, camera, options.size, drawing, path, layers, depth_scale=options.depth_scale))
        groups.append(MeshJobs(source, name, tuple(jobs)))
    return groups


def _orbit(options: argparse.Namespace, i_view: int) -> Orbit:
    """The camera of a view."""
    azimuth_deg, has_one_view = options.azimuth + 360 * i_view / options.views, options.views == 1
    return Orbit(azimuth_deg, options.elevation, options.fov, options.up, options.ortho, fits=has_one_view)


def _moments(source: str, options: argparse.Namespace, limits: Mapping[str, Any]) -> tuple[float | None, ...]:
    """The times of the frames of a mesh, seconds: None alone for one without animations, which is at rest."""
    seconds: float | None
    try:
        seconds = None if source in SHAPES else clip_length(source, options.clip, **limits)
    except TOLD:
        seconds = 0.0  # its job meets the error again, and tells it
    if seconds is None:
        return (None,) if options.clip is None else (0.0,)
    n_frames = int(seconds * options.fps + 1e-6) + 1  # keys are float32: 0.1 s is 0.10000000149
    if n_frames > MAX_VIEWS:
        raise UsageError(f"--animation of {source!r} has {n_frames:,} frames, more than {MAX_VIEWS:,}: lower --fps")
    return tuple(i / options.fps for i in range(n_frames))


def names_of(sources: Sequence[str], *, with_numbers: bool = True, with_folders: bool = False) -> list[str]:
    """The {name} of each mesh: the file without its suffix, or with it where another file differs in nothing else.

    Further files of one name get numbers, unless other words of OUT tell them apart.
    """
    stems = [source if source in SHAPES else Path(source).stem for source in sources]
    suffixes = [Path(source).suffix.casefold().removeprefix(".") for source in sources]
    suffixes_of: dict[str, set[str]] = {}
    for stem, suffix in zip(stems, suffixes, strict=True):
        suffixes_of.setdefault(stem.casefold(), set()).add(suffix)
    names = [
        f"{stem}-{suffix}" if suffix and len(suffixes_of[stem.casefold()]) > 1 else stem
        for stem, suffix in zip(stems, suffixes, strict=True)
    ]
    if not with_numbers:
        return names
    folders = folders_of(sources) if with_folders else [""] * len(names)
    keys = [(folder.casefold(), name.casefold()) for folder, name in zip(folders, names, strict=True)]
    taken, seen = set(keys), set[tuple[str, str]]()
    for i, (folder, key) in enumerate(keys):
        if (folder, key) in seen:
            n = next(n for n in itertools.count(2) if (folder, f"{key}-{n}") not in taken)
            names[i] = f"{names[i]}-{n}"
            taken.add((folder, f"{key}-{n}"))
        seen.add((folder, key))
    return names


def folders_of(sources: Sequence[str]) -> list[str]:
    """The {folder} of each mesh: its folder below the folder that all lie in; "." there, and for shapes."""
    folders = [None if source in SHAPES else Path(source).absolute().parent for source in sources]
    there = [folder for folder in folders if folder is not None]
    home = os.path.commonpath(there) if there else ""
    return ["." if folder is None else os.path.relpath(folder, home) for folder in folders]


def default_sampling(options: argparse.Namespace) -> str:
    """Several samples where light is shown, one where pixels are numbers, ids or distances."""
    is_light = options.shading not in ("ids", "depth") and options.opacity is None
    is_picture = not options.layers and Path(options.out).suffix.lower() != ".npz"
    return str(Sampling.MSAA4 if is_light and is_picture else Sampling.CENTER)


def sheet_background(options: argparse.Namespace) -> tuple[int, int, int, int] | None:
    """The background that is given, or that of all cells of a sheet of several meshes; None: each mesh has its own."""
    return options.background or (BACKDROP if options.sheet and len(options.meshes) > 1 else None)


def _render_options(options: argparse.Namespace) -> dict[str, Any]:
    if (options.shading == "matcap") != (options.matcap is not None):
        raise UsageError("--shading matcap and --matcap FILE go together")
    drawing = {
        "shading": options.shading,
        "color": options.color,
        "background": sheet_background(options) or Backdrop(),
        "cull": options.cull,
        "subpixel_bits": options.subpixel_bits,
        "tolerance": options.tolerance,
        "threads": options.threads,
    }
    if options.matcap is not None:
        drawing["matcap"] = read_texture(options.matcap)
    if options.environment is not None:
        drawing["environment"] = EnvironmentOfFile(read_environment(options.environment), options.up)
    if options.opacity is None:
        return drawing | {"edges": options.wireframe, "sampling": options.sampling or default_sampling(options)}
    if options.wireframe or options.sampling not in (None, Sampling.CENTER):
        raise UsageError("--opacity goes with neither --wireframe nor --sampling")
    return drawing | {"opacity": options.opacity}


def _layers(path: str, options: argparse.Namespace) -> tuple[str, ...]:
    suffix = Path(path).suffix.lower()
    if not options.layers and suffix == ".npz":
        return ("color", "triangle", "depth")
    if not options.layers and suffix == ".npy" and options.shading in SHADINGS_WITH_NUMBERS:
        return (SHADINGS_WITH_NUMBERS[options.shading],)
    return tuple(options.layers)


def _pattern(out: str, options: argparse.Namespace, *, has_views: bool) -> str:
    """OUT as a file name with {name}, {view}, {index} and {layer} where several pictures need them."""
    path = location_of(out)
    check_words("OUT", path, ("name", "folder", "view", "index", "layer"))
    is_folder = out.endswith(("/", "\\")) or not path.suffix or (isinstance(path, Path) and path.is_dir())
    if out == "-":
        raise UsageError("OUT must be a file or a folder, got '-': no picture is written to standard output")
    if path.name.lower() in SUFFIXES:
        raise UsageError(f"OUT must have a name before {path.name}, got {out!r}")
    if not out or (path.suffix.lower() not in SUFFIXES and not is_folder):
        raise UsageError(f"OUT must end in one of {' '.join(SUFFIXES)}, or in / for a folder, got {out!r}")
    several_layers = len(options.layers) > 1 and path.suffix.lower() != ".npz"
    if is_folder:
        words = ["{name}"] + ["{view}"] * has_views + ["{layer}"] * several_layers
        return str(path / ("-".join(words) + ".png"))
    if len(options.meshes) > 1 and "{name}" not in out and "{index}" not in out:
        raise UsageError(f"several meshes need a folder or {{name}} in OUT, got {out!r}")
    stem = path.stem
    if has_views and "{view}" not in out:
        stem += "-{view}"
    if several_layers and "{layer}" not in out:
        stem += "-{layer}"
    return str(path.with_name(stem + path.suffix))


def check_words(what: str, path: Location, known: Sequence[str]) -> None:
    """Raise a `UsageError` for a word in braces that stands for nothing, unless a folder is called so."""
    folder = Path()
    for part in path.parts if isinstance(path, Path) else (str(path),):
        folder /= part
        for word in re.findall(r"\{(\w*)\}", part):
            if word not in known and (isinstance(path, RemotePath) or not folder.exists()):
                words = ", ".join(f"{{{each}}}" for each in known)
                raise UsageError(f"{what} may have {words}, got {{{word}}} in {str(path)!r}{meant(word, known)}")


def check_targets(groups: Sequence[MeshJobs], others: Iterable[Path] = ()) -> None:
    """Raise an error before any work if a file cannot be written, as far as that shows beforehand.

    `others` are further files: sheets and animations.
    """
    owner_of: dict[str, str] = {}
    targets: list[tuple[Location, str]] = [
        (file, group.source) for group in groups for job in group.jobs for file in job.files
    ]
    targets += [(path, str(path)) for path in others]
    for target, source in targets:
        # on some disks Bunny.png is bunny.png
        key = str(target.absolute()).casefold() if isinstance(target, Path) else str(target)
        if key in owner_of:
            raise UsageError(
                f"{owner_of[key]!r} and {source!r} would both be written to {str(target)!r}; "
                "put {index} or {folder} into OUT"
            )
        owner_of[key] = source
    files = (Path(group.source) for group in groups if group.source not in SHAPES)
    meshes = {(status.st_dev, status.st_ino) for status in (file.stat() for file in files if file.exists())}
    paths = [target for target, _ in targets if isinstance(target, Path)]
    for target in paths:
        if target.exists() and (target.stat().st_dev, target.stat().st_ino) in meshes:
            raise UsageError(f"OUT would overwrite the mesh {str(target)!r}")
    for folder in dict.fromkeys(path.parent for path in paths):
        _check_writable(folder)
    for url in dict.fromkeys(target.parent for target, _ in targets if isinstance(target, RemotePath)):
        _check_reached(url)
    remove_stale_parts(paths)


def _check_writable(folder: Path) -> None:
    """Raise an error before any work if pictures cannot be put into a folder, made or yet to be made."""
    if len(folder.parts) > MAX_FOLDERS:
        raise UsageError(f"OUT must lie in at most {MAX_FOLDERS} folders, got {len(folder.parts)}")
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir():
        raise UsageError(f"cannot write to the folder {str(folder)!r}: {str(existing)!r} is a file")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise UsageError(f"cannot write to the folder {str(folder)!r}: permission denied")


def _check_reached(folder: RemotePath) -> None:
    """Raise an error before any work if fsspec does not reach a URL."""
    try:
        folder.exists()
    except MissingPackageError:
        raise
    except Exception as error:  # any type: packages behind fsspec raise different errors
        raise UsageError(f"cannot write to {folder}: {' '.join(str(error).split()) or type(error).__name__}") from None
