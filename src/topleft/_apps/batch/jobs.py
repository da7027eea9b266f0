"""Draws jobs, one after the other: each a mesh or scene, a camera and where the picture goes.

Input: `Job`. Output: arrays, or files that are whole or not there.
"""

from __future__ import annotations

import math
import os
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, NamedTuple

from topleft import Camera, Mesh, Points, Rasterizer, Scene, as_mesh, load, render, render_transparent
from topleft._apps.batch.made import Contents, FromFile
from topleft._core.base.array_types import Array, MeshLike
from topleft._core.base.arrays import as_number, as_scale, as_size, shown
from topleft._core.base.cached import cached_property
from topleft._core.base.defaults import DEFAULT_SIZE
from topleft._core.base.notes import Heard, listening, tell, tell_files
from topleft._core.base.options import check_layers
from topleft._core.base.remote import Location, as_location, location_of
from topleft.annex.files import layer_paths, read_record, save_layers, write_image
from topleft.annex.pictures import layers_of
from topleft.typing import LayerOption

CameraMaker = Callable[[Any, tuple[int, int]], Camera]


class Checked(NamedTuple):
    """The arguments of a job that are checked before any work."""

    layers: tuple[str, ...]
    files: tuple[Location, ...]
    size: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Job:
    """A picture to be drawn.

    Parameters
    ----------
    scene : Mesh, Scene, Points, whatever `as_mesh` takes, path, or function without arguments that returns one of them
        A file is read where it is drawn, once for jobs that follow each other. Equal functions are likewise called
        once; for worker processes a function must be picklable. A mesh of another library is converted once, and must
        not change between its jobs.
    camera : Camera, or function of the mesh (or scene) and the size that returns one, optional
        As for `render`.
    size : (width, height), pixels
    options : mapping
        Other options of `render`, by name; "background" and "environment" may be functions of the scene; with "opacity"
        those of `render_transparent`; for the layer "flow" also "camera_to" and "transforms_to" of `render_layers`.
    destination : path or URL, optional
        The file to be written; its folder is made. A URL is whatever fsspec can write to where the job is drawn.
        `{layer}` in the name stands for the name of a layer. None: the picture is returned.
    layers : sequence of str
        Names that `render_layers` knows, made instead of the picture; "color" is the picture. Empty: the picture alone.
    scale : float
        Factor of the coordinates if the scene is a path; 0.001 makes metres of millimetres.
    depth_scale : float
        Units of a step of distances in PNG, as BOP has it: 1 for millimetres of a scene in millimetres; unless given
        0.001, for millimetres of one in metres.

    Examples
    --------
    >>> import topleft as tl
    >>> ball = tl.Mesh(*tl.scenes.icosphere(2))
    >>> job = tl.Job(ball, size=(32, 24), options={"color": "gold"})
    >>> [result.picture.shape for result in tl.render_batch([job])]
    [(24, 32, 4)]
    """

    scene: Any
    camera: Camera | CameraMaker | None = None
    size: int | tuple[int, int] = DEFAULT_SIZE
    options: Mapping[str, Any] = field(default_factory=dict)
    destination: str | os.PathLike[str] | None = None
    layers: Sequence[LayerOption | str] = ()
    scale: float = field(default=1.0, kw_only=True)
    depth_scale: float = field(default=0.001, kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.options, Mapping) or not all(isinstance(name, str) for name in self.options):
            raise TypeError(f"options must map names of options of render to values, got {shown(self.options)}")
        if isinstance(self.camera, type):
            raise TypeError(f"camera must be a Camera, a function of the mesh and the size or None, got {self.camera}")
        if self.destination is not None:
            as_location("destination", self.destination)
        if as_scale(self.scale) != 1 and not isinstance(self.scene, str | os.PathLike):
            raise TypeError(f"scale is of a scene that is a path, got {shown(self.scene)}: load(path, scale=) has one")
        if not 0 < as_number("depth_scale", self.depth_scale) < math.inf:
            raise ValueError(f"depth_scale must be positive and finite, got {self.depth_scale}")

    def __repr__(self) -> str:
        """One line: the scene, the size and the destination."""
        scene = os.fspath(self.scene) if isinstance(self.scene, str | os.PathLike) else type(self.scene).__name__
        words = [str(scene), f"size={self.size}"]
        words += [f"layers={tuple(self.layers)}"] if self.layers else []
        words += [f"options={', '.join(self.options)}"] if self.options else []
        words += [f"destination={os.fspath(self.destination)!r}"] if self.destination is not None else []
        return f"Job({', '.join(words)})"

    @property
    def files(self) -> tuple[Location, ...]:
        """The files that the job writes.

        Raises
        ------
        ImageError
            If the format is unknown, or several layers would have one file that can hold one.
        ValueError
            If there is no such layer.
        """
        return self.checked.files

    @cached_property
    def checked(self) -> Checked:
        """The layers, files and size, checked at the first use; a pickle takes them along. Raises as `files` does."""
        layers = check_layers(self.layers)
        files: tuple[Location, ...] = ()
        if self.destination is not None:
            files = tuple(dict.fromkeys(layer_paths(location_of(self.destination), layers or ("color",)).values()))
        return Checked(layers, files, as_size(self.size))

    @property
    def name(self) -> str:
        """A word for it in messages."""
        scene = os.fspath(self.scene) if isinstance(self.scene, (str, os.PathLike)) else type(self.scene).__name__
        return str(scene) if self.destination is None else f"{scene} -> {os.fspath(self.destination)}"


def as_job(item: object, index: int) -> Job:
    """Return a job as it is, or that of a tuple of its fields; a `TypeError` if it is neither."""
    if isinstance(item, Job):
        return item
    names = [entry.name for entry in fields(Job) if not entry.kw_only]
    if isinstance(item, tuple) and 1 <= len(item) <= len(names):
        return Job(*item)
    raise TypeError(f"jobs[{index}] must be a Job or a tuple ({', '.join(names)}), got {type(item).__name__}")


@dataclass(frozen=True, eq=False)
class Outcome:
    """The result of one job: the picture, unless it went to a file, or the error."""

    index: int
    picture: Array | dict[str, Array] | None = None
    error: Exception | None = None
    warnings: tuple[str, ...] = ()
    """Warnings of its mesh file."""
    seconds: float = 0.0


class Held:
    """A function that returns a scene which another process has put somewhere; it counts as that scene."""


@dataclass(frozen=True)
class MeshFile(FromFile):
    """A mesh that is in a file."""

    scale: float = 1.0

    def __call__(self) -> Mesh | Points:
        """Read it."""
        return load(self.path, scale=self.scale)


class ForeignMesh:
    """A mesh of another library, to be converted; equal if it is the same object."""

    def __init__(self, subject: MeshLike) -> None:
        self.subject = subject

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ForeignMesh) and self.subject is other.subject

    def __hash__(self) -> int:
        return id(self.subject)

    def __call__(self) -> Mesh:
        """Make it."""
        return as_mesh(self.subject)


class LoadedMeshes:
    """Results of functions that make meshes, or their errors: the `n` latest, shared by all threads."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._made: OrderedDict[Hashable, tuple[Any, Exception | None, Heard]] = OrderedDict()
        # One at a time: readers are not safe in threads (they change the process's warning filters).
        self._lock = threading.Lock()

    def get(self, make: Callable[[], Any]) -> Any:
        """Return the kept result of an equal function, or call the function."""
        found = self._made.get(make)
        if found is None:
            with self._lock:
                found = self._made.get(make)
                if found is None:
                    found = self._made[make] = self._call(make)
                    if len(self._made) > self._n:
                        self._made.popitem(last=False)
        scene, error, lines = found
        tell(lines, stacklevel=1)
        tell_files(lines.files)
        if error is not None:
            raise error.with_traceback(None)
        return scene

    @staticmethod
    def _call(make: Callable[[], Any]) -> tuple[Any, Exception | None, Heard]:
        with listening() as lines:
            try:
                made = make()
                return made if isinstance(made, Scene | Points) else as_mesh(made), None, lines
            except Exception as error:
                return None, error, lines


class JobRunner:
    """Draws jobs; each thread in memory that it keeps from picture to picture. `n_meshes` are kept for jobs to come."""

    def __init__(self, n_meshes: int = 4) -> None:
        self._cache = LoadedMeshes(n_meshes)
        self._contents = Contents()
        self._threads = threading.local()

    def draw(self, jobs: Sequence[tuple[int, Job]]) -> list[Outcome]:
        """Return the outcome of each job; an error of a job does not stop the next job."""
        outcomes = []
        for index, job in jobs:
            start, picture, failure = time.perf_counter(), None, None
            with listening() as lines:
                try:
                    picture = self._draw_one(job, lines)
                except Exception as error:
                    _clear_frames(error)
                    failure = error
            outcomes.append(Outcome(index, picture, failure, tuple(lines), time.perf_counter() - start))
        return outcomes

    def is_done(self, job: Job) -> bool:
        """Return whether all files of a job hold what it would draw; errors of a job appear when it is drawn."""
        try:
            files = job.files
            records = {read_record(file) for file in files}
            if len(records) != 1 or () in records:
                return False
            (record,) = records
            scene = job.scene if _is_read(job.scene) else self._scene(job.scene, job.scale)
        except Exception:  # of any reader: it appears when the job is drawn
            return False
        folder = Path(_home_of(job)).parent
        return record == self._record(job, scene, [folder / name for name in record[1:]])

    def _record(self, job: Job, scene: Any, files: Sequence[Path]) -> tuple[str, ...]:
        """The record of the files of a job."""
        subject = scene
        if _is_read(job.scene):
            subject = MeshFile(os.fspath(job.scene)) if isinstance(job.scene, str | os.PathLike) else job.scene
        options = {name: value for name, value in job.options.items() if name != "threads"}
        layers, (first, *_), size = job.checked
        parts = first.suffix, layers, size, job.scale, job.depth_scale, options, job.camera, subject
        return self._contents.record_of(parts, _home_of(job), files)

    def _draw_one(self, job: Job, heard: Heard) -> Array | dict[str, Array] | None:
        """Return the picture of a job, arrays by name if it asks for layers, or None when they are in their files."""
        layers, files, size = job.checked  # before any work: raises for an unknown format
        for file in files:
            if isinstance(file, Path) and not file.parent.is_dir():
                file.parent.mkdir(parents=True, exist_ok=True)
        scene = self._scene(job.scene, job.scale)
        camera = job.camera(scene, size) if callable(job.camera) else job.camera
        options = {"threads": 1, **job.options}
        for name in ("background", "environment"):
            if callable(options.get(name)):
                options[name] = options[name](scene)
        rasterizer = self._rasterizer(size)
        if not layers:
            if "opacity" in options:
                picture = render_transparent(scene, camera, size, **options)
            else:
                picture = render(scene, camera, size, rasterizer=rasterizer, **options)
            if job.destination is None:
                return picture
            write_image(files[0], picture, background=_opaque(options), record=self._record(job, scene, heard.files))
            return None
        view = layers_of(scene, camera, size, rasterizer=rasterizer, **options)
        arrays = view.draw(layers)
        if job.destination is None:
            return {name: array.copy() for name, array in arrays.items()}  # out of the memory that is kept
        matrix = None if view.shot.camera.lens is not None else view.shot.camera.clip_from_world(size)
        record, background = self._record(job, scene, heard.files), _opaque(options)
        how: dict[str, Any] = {"depth_scale": job.depth_scale, "matrix": matrix}
        save_layers(job.destination, arrays, background=background, record=record, **how)
        return None

    def _scene(self, scene: Any, scale: float) -> Any:
        if isinstance(scene, (str, os.PathLike)):
            scene = MeshFile(os.fspath(scene), scale)
        elif not isinstance(scene, Mesh | Scene | Points) and not callable(scene):
            scene = ForeignMesh(scene)
        return self._cache.get(scene) if callable(scene) else scene

    def _rasterizer(self, size: tuple[int, int]) -> Rasterizer:
        kept: Rasterizer | None = getattr(self._threads, "rasterizer", None)
        if kept is None or kept.size != size:
            kept = self._threads.rasterizer = Rasterizer(size, threads=1)
        return kept


def _is_read(scene: object) -> bool:
    """Whether a scene is a file or what a function returns, which are not called to compare them."""
    return isinstance(scene, str | os.PathLike) or (callable(scene) and not isinstance(scene, Held))


def _home_of(job: Job) -> str:
    """The file of the scene, if it is of one."""
    scene = job.scene
    return os.fspath(scene) if isinstance(scene, str | os.PathLike) else getattr(scene, "path", "")


def _clear_frames(error: BaseException | None) -> None:
    """Free the local variables in an error's frames, pictures among them: results carry errors for long."""
    import traceback

    while error is not None:
        traceback.clear_frames(error.__traceback__)
        error = error.__cause__ or error.__context__


def _opaque(options: Mapping[str, Any]) -> tuple[int, int, int]:
    """The background of a JPEG: white if it is transparent."""
    color = tuple(options.get("background", (255, 255, 255)))
    return color[:3] if len(color) < 4 or color[3] else (255, 255, 255)
