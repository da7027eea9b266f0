"""Finds which picture goes to which file, before anything is drawn: from arguments to jobs.

Input: parsed arguments. Output: a list of `MeshJobs`.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from topleft._base.options import Sampling
from topleft._batch.jobs import Job
from topleft._camera.camera import Camera
from topleft._io.images import SUFFIXES
from topleft._io.load import load
from topleft._model.material import Material
from topleft._model.mesh import Mesh
from topleft._model.texture import Texture
from topleft._shade.shade import Shading
from topleft.cli.arguments import UsageError
from topleft.errors import ImageError, MeshError
from topleft.scenes import SHAPES, shape

__all__ = ["MeshJobs", "check_targets", "plan_jobs"]

SHADINGS_WITH_NUMBERS: Mapping[str, str] = {"ids": "triangle", "depth": "depth", "normals": "camera_normal"}
"""Shadings that are a layer made visible: .npy holds the layer."""

MAX_FOLDERS = 200
"""Most folders of a path of a picture, one in the other."""


@dataclass(frozen=True)
class MeshSource:
    """The mesh of a file, or the built-in shape of that name."""

    name: str
    texture: str | None = None

    def __call__(self) -> Mesh:
        """Read it."""
        mesh = self._mesh()
        if self.texture is None:
            return mesh
        if mesh.uv is None:
            raise MeshError(f"--texture needs texture coordinates, and {self.name!r} has none")
        return replace(mesh, materials=(Material(texture=read_texture(self.texture)),), material_of_triangle=None)

    def _mesh(self) -> Mesh:
        if self.name in SHAPES:
            return Mesh(*shape(self.name))
        if not Path(self.name).exists() and Path(self.name).name == self.name and "." not in self.name:
            raise UsageError(f"there is no file and no built-in shape {self.name!r}; shapes: {', '.join(SHAPES)}")
        return load(self.name)


def read_texture(path: str) -> Texture:
    """The picture of a file.

    Raises
    ------
    ImageError
        If it is none that Pillow reads.
    OSError
        If it cannot be read.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            return Texture(np.asarray(image.convert("RGBA")))
    except UnidentifiedImageError:
        raise ImageError(f"cannot read {path!r}: it is no picture that Pillow knows") from None


@dataclass(frozen=True)
class Orbit:
    """The camera of `Camera.framing`, for whatever mesh."""

    azimuth_deg: float
    elevation_deg: float
    fov_y_deg: float
    up: Any
    ortho: bool

    def __call__(self, mesh: Mesh, size: tuple[int, int]) -> Camera:
        """Return it."""
        return Camera.framing(
            mesh,
            azimuth_deg=self.azimuth_deg,
            elevation_deg=self.elevation_deg,
            fov_y_deg=self.fov_y_deg,
            up=self.up,
            ortho=self.ortho,
            aspect=size[0] / size[1],
        )


@dataclass(frozen=True)
class MeshJobs:
    """A mesh and its jobs, one for each view."""

    source: str
    name: str
    jobs: tuple[Job, ...]


def plan_jobs(options: argparse.Namespace, start: int = 0) -> list[MeshJobs]:
    """Return the jobs of each mesh of the arguments; `start` is the index of the first mesh.

    Raises
    ------
    UsageError
        If OUT cannot hold the pictures.
    """
    pattern = _pattern(options.out, options)
    drawing = _render_options(options)
    groups = []
    for i_mesh, source in enumerate(options.meshes, start):
        name = source if source in SHAPES else Path(source).stem
        jobs = []
        for i_view in range(options.views):
            # Not str.format: a folder may have other braces in its name.
            filled = pattern.replace("{view}", f"{i_view:03d}").replace("{index}", f"{i_mesh:03d}")
            azimuth_deg = options.azimuth + 360 * i_view / options.views
            orbit = Orbit(azimuth_deg, options.elevation, options.fov, options.up, options.ortho)
            path = filled.replace("{name}", name)
            layers = _layers(path, options)
            jobs.append(Job(MeshSource(source, options.texture), orbit, options.size, drawing, path, layers))
        groups.append(MeshJobs(source, name, tuple(jobs)))
    return groups


def _render_options(options: argparse.Namespace) -> dict[str, Any]:
    if (options.shading == Shading.MATCAP) != (options.matcap is not None):
        raise UsageError("--shading matcap and --matcap FILE go together")
    drawing = {
        "shading": options.shading,
        "color": options.color,
        "background": options.background,
        "cull": options.cull,
        "tolerance": options.tolerance,
        "threads": options.threads,
    }
    if options.matcap is not None:
        drawing["matcap"] = read_texture(options.matcap)
    if options.opacity is None:
        return drawing | {"edges": options.wireframe, "sampling": options.sampling}
    if options.wireframe or options.sampling != Sampling.CENTER:
        raise UsageError("--opacity goes with neither --wireframe nor --sampling")
    return drawing | {"opacity": options.opacity}


def _layers(path: str, options: argparse.Namespace) -> tuple[str, ...]:
    suffix = Path(path).suffix.lower()
    if not options.layers and suffix == ".npz":
        return ("color", "triangle", "depth")
    if not options.layers and suffix == ".npy" and options.shading in SHADINGS_WITH_NUMBERS:
        return (SHADINGS_WITH_NUMBERS[options.shading],)
    return tuple(options.layers)


def _pattern(out: str, options: argparse.Namespace) -> str:
    """OUT as a file name with {name}, {view}, {index} and {layer} where several pictures need them."""
    path = Path(out)
    is_folder = out.endswith(("/", "\\")) or path.is_dir() or not path.suffix
    if not out or (path.suffix.lower() not in SUFFIXES and not is_folder):
        raise UsageError(f"OUT must end in one of {' '.join(SUFFIXES)}, or in / for a folder, got {out!r}")
    several_layers = len(options.layers) > 1 and path.suffix.lower() != ".npz"
    if is_folder:
        words = ["{name}"] + ["{view}"] * (options.views > 1) + ["{layer}"] * several_layers
        return str(path / ("-".join(words) + ".png"))
    if len(options.meshes) > 1 and "{name}" not in out and "{index}" not in out:
        raise UsageError(f"several meshes need a folder or {{name}} in OUT, got {out!r}")
    stem = path.stem
    if options.views > 1 and "{view}" not in out:
        stem += "-{view}"
    if several_layers and "{layer}" not in out:
        stem += "-{layer}"
    return str(path.with_name(stem + path.suffix))


def check_targets(groups: Sequence[MeshJobs], others: Iterable[Path] = ()) -> None:
    """Raise an error if what is to be written cannot be, as far as that shows before anything is.

    `others` are files that are written besides: sheets and animations.

    Raises
    ------
    UsageError
        If two pictures would have the same name, or a picture that of a mesh, or a folder cannot be written to.
    """
    owner_of: dict[str, str] = {}
    targets = [(file, group.source) for group in groups for job in group.jobs for file in job.files]
    targets += [(path, str(path)) for path in others]
    for target, source in targets:
        key = str(target.absolute()).casefold()  # on some disks Bunny.png is bunny.png
        if key in owner_of:
            raise UsageError(
                f"{owner_of[key]!r} and {source!r} would both be written to {str(target)!r}; "
                "put {index} into OUT or give each a folder"
            )
        owner_of[key] = source
    files = (Path(group.source) for group in groups if group.source not in SHAPES)
    meshes = {(status.st_dev, status.st_ino) for status in (file.stat() for file in files if file.exists())}
    for target, _ in targets:
        if target.exists() and (target.stat().st_dev, target.stat().st_ino) in meshes:
            raise UsageError(f"OUT would overwrite the mesh {str(target)!r}")
    for folder in dict.fromkeys(target.parent for target, _ in targets):
        _check_writable(folder)


def _check_writable(folder: Path) -> None:
    """Find out before any work whether pictures can be put into a folder, made or yet to be made."""
    if len(folder.parts) > MAX_FOLDERS:
        raise UsageError(f"OUT must lie in at most {MAX_FOLDERS} folders, got {len(folder.parts)}")
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir():
        raise UsageError(f"cannot write to the folder {str(folder)!r}: {str(existing)!r} is a file")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise UsageError(f"cannot write to the folder {str(folder)!r}: permission denied")
