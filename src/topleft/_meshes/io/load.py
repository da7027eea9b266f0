"""Reads a mesh from a file of any format.

Input: a path. Output: one `Mesh`, and warnings of what could not be read.
"""

from __future__ import annotations

import operator
import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from topleft._core.base.arrays import as_crease, as_path, as_scale, as_seconds, shown
from topleft._core.base.defaults import DEFAULT_CREASE
from topleft._core.base.notes import tell, tell_files
from topleft._meshes.io.limits.budget import Budget, OverLimitError
from topleft._meshes.io.references import InputFile, Moment
from topleft._meshes.model.cells import Polygons
from topleft._meshes.model.joined import joined
from topleft._meshes.model.material import TEXTURES
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.normals import face_normals
from topleft._meshes.model.points import Points
from topleft.errors import MeshError, MissingPackageError

Made = TypeVar("Made")

GLTF_SUFFIXES = (".gltf", ".glb", ".vrm")
READERS = {
    **dict.fromkeys(GLTF_SUFFIXES, "gltf.reader.read_gltf"), ".dae": "collada.read_collada", ".obj": "obj.read_obj",
    ".off": "stl_off.read_off", ".ply": "ply.read_ply", ".stl": "stl_off.read_stl", ".stl_ascii": "stl_off.read_stl",
    ".xyz": "xyz.read_xyz",
}  # fmt: skip
"""The reader of each suffix, by module and name: it is imported when a file needs it. trimesh reads all others."""

ARCHIVE_SUFFIXES = (".zip", ".zae", ".tgz", ".gz", ".bz2")
MESHIO_READERS: dict[str, tuple[str, ...]] = {
    ".bdf": ("nastran",), ".f3grid": ("flac3d",), ".inp": ("abaqus",), ".mdpa": ("mdpa",), ".mesh": ("medit",),
    ".meshb": ("medit",), ".msh": ("ansys", "gmsh"), ".nas": ("nastran",), ".su2": ("su2",), ".ugrid": ("ugrid",),
    ".vtk": ("vtk",), ".vtu": ("vtu",),
}  # fmt: skip
"""The modules of meshio that read each suffix, in the order in which they are tried."""

TRIANGLES_AT_ONCE = 1 << 14
"""Triangles whose areas are looked at together."""


def load(
    path: str | os.PathLike[str],
    *,
    crease: float = DEFAULT_CREASE,
    max_vertices: int | None = None,
    max_texture_pixels: int | None = None,
    time: float | None = None,
    clip: int | str | None = None,
    max_triangles: int | None = None,
    max_nodes: int | None = None,
    max_lines: int | None = None,
    max_bytes: int | None = None,
    max_unpacked_bytes: int | None = None,
    scale: float = 1.0,
    root: str | os.PathLike[str] | None = None,
) -> Mesh | Points:
    r"""A mesh read from a file: OBJ, PLY, STL, OFF, COLLADA, glTF and GLB; by trimesh and meshio others.

    Parameters
    ----------
    path : path
        The end of its name tells the format.
    crease : float
        Degrees, 0 to 180: edges at which triangles bend by more are sharp, where the file has no normals; see `Mesh`.
        180: none is, 0: all are.
    max_vertices, max_triangles, max_nodes : int, optional
        A file with more, or one that says so, is refused: nodes with a mesh and instances count each time, and so do
        their vertices and triangles. Unless given 4,194,304 vertices, 4,194,304 triangles and 32,768 nodes, or as many
        as the file has bytes, and one node for 100 bytes.
    max_texture_pixels : int, optional
        Of all pictures together, and of textures that are made of them: those beyond are left out. Unless given
        67,108,864 (8192 x 8192), or 16 for each byte.
    max_lines : int, optional
        Of lines of text, rows of PLY and elements of XML: a file with more is refused. Unless given 524,288, or one for
        4 bytes.
    max_bytes : int, optional
        Of the file and all that it names: more are refused. Unless given 8 GiB.
    max_unpacked_bytes : int, optional
        Of the contents of an archive, or of compressed data in the file: more are refused. Unless given 33,554,432, or
        8 for each byte.
    time : float, optional
        Seconds, 0 or more: nodes, skins and morph targets of glTF are where an animation has them then; behind its end,
        where it ends. Unless given everything is at rest.
    clip : int or str, optional
        The index or the name of the animation; "all" plays all of them, and where two move the same the first has it.
        Unless given the first one plays, and `MeshWarning` tells of others.
    scale : float
        Positive. Multiplies the coordinates: 0.001 makes metres of a file in millimetres.
    root : path, optional
        A folder whose files the mesh may name, too, as ../textures/a.png, say; of an archive it has no effect.

    Returns
    -------
    Mesh, or Points
        `Points` of a file that holds points and no triangles. Of a mesh polygons are cut into triangles, groups and
        objects are one mesh, in the order of the file; the nodes of a scene are placed by their transforms, skins and
        morph targets are at rest, or at the `time`. Normals are those of the file. A file without normals gets its
        vertices merged where they are equal, so that shading has no seams where a format (STL) or a texture had to
        double them; triangles of glTF without normals are flat, as its standard says. Colours are those of the vertices
        or the faces, if there are any; `uv` those of the file. Materials are those of MTL and glTF.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeshError
        If the file is broken, has no triangles, or is of an unsupported format, or has no such animation.
    ValueError
        If `time` is negative, infinite or NaN, `scale` is not positive and finite, or `root` is no folder.
    MissingPackageError
        If trimesh, meshio, or a package that one needs for this format, is not installed.

    Warns
    -----
    MeshWarning
        Once for each kind of contents that could not be read: missing textures, say.

    Notes
    -----
    Files that a mesh names are read from its folder, the folders in it, and `root`; nothing else is opened.
    docs/guide/files.md lists the contents of each format that are read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import topleft as tl
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "one.obj")
    ...     _ = path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    ...     mesh = tl.load(path)
    >>> mesh.triangles.tolist()
    [[0, 1, 2]]
    """
    crease, scale = as_crease(crease), as_scale(scale)
    source = input_file(
        path, root, max_vertices=max_vertices, max_texture_pixels=max_texture_pixels, max_triangles=max_triangles,
        max_nodes=max_nodes, max_lines=max_lines, max_bytes=max_bytes, max_unpacked_bytes=max_unpacked_bytes,
    )  # fmt: skip
    source.moment = as_moment(time, clip)
    mesh = reading(source, lambda: _mesh(source, crease))
    tell_files(source.files())
    tell(source.notes.lines, stacklevel=2)
    return mesh if scale == 1 else scaled(mesh, scale)


def load_cells(path: str | os.PathLike[str]) -> tuple[Any, Polygons]:
    """The mesh of meshio of a file that it reads, and the triangles of its cells. Errors and warnings are of `load`."""
    from topleft._meshes.io.solvers import note_lost_views, read_cells

    source = input_file(path, None)
    theirs, polygons = reading(source, lambda: read_cells(source, MESHIO_READERS[source.path.suffix.lower()]))
    if polygons is None:
        raise MeshError(f"{str(path)!r} has no triangles")
    if source.path.suffix.lower() == ".msh":
        note_lost_views(source)
    tell_files(source.files())
    tell(source.notes.lines, stacklevel=2)
    return theirs, polygons


def clip_length(
    path: str | os.PathLike[str],
    clip: int | str | None = None,
    *,
    root: str | os.PathLike[str] | None = None,
    **limits: int | None,
) -> float | None:
    """The seconds of an animation of a file, as `load` chooses it; None of a file without animations.

    Errors are those of `load`.
    """
    source = input_file(path, root, **limits)
    if source.path.suffix.lower() not in GLTF_SUFFIXES:
        return None
    from topleft._meshes.io.gltf.reader import read_length  # as late as in `_parts`

    return reading(source, lambda: read_length(source, clip))


def input_file(path: str | os.PathLike[str], root: str | os.PathLike[str] | None, **limits: int | None) -> InputFile:
    """The file of a path, its budget, and the folder whose files it may name, too."""
    checked = as_path("path", path)
    home = None if root is None else as_path("root", root)
    if home is not None and not home.is_dir():
        raise ValueError(f"root must be a folder, got {str(home)!r}")
    return InputFile(checked, Budget(str(checked), **limits), home=home)


def scaled(mesh: Mesh | Points, scale: float) -> Mesh | Points:
    """The mesh or points with coordinates times a scale, rounded once to their type."""
    with np.errstate(over="ignore"):
        if isinstance(mesh, Points):
            positions = mesh.positions
            return replace(mesh, positions=np.multiply(positions, scale, dtype=np.float64).astype(positions.dtype))
        vertices = np.multiply(mesh.vertices, scale, dtype=np.float64).astype(mesh.vertices.dtype)
    return replace(mesh, vertices=vertices)


def as_moment(time: float | None, clip: int | str | None) -> Moment | None:
    """The time and the clip, checked as far as that goes without the file; None: everything is at rest."""
    if time is None:
        if clip is not None:
            raise ValueError(f"clip {shown(clip)} needs a time")
        return None
    seconds = as_seconds(time)
    if clip is not None and not isinstance(clip, str):
        try:
            clip = operator.index(clip)
        except TypeError:
            raise TypeError(f"clip must be an index or a name, got {shown(clip)}") from None
    return Moment(seconds, clip)


def _mesh(source: InputFile, crease: float) -> Mesh | Points:
    """The mesh of the file."""
    parts = _parts(source)
    if not parts and source.clouds:
        return _points(source)
    if not any(len(part.triangles) for part in parts):
        drawn = [
            line.partition(": ")[2].removesuffix(" not drawn") for line in source.notes.lines if "not drawn" in line
        ]
        raise MeshError(f"{str(source.path)!r} has no triangles" + (f", but {' and '.join(drawn)}" if drawn else ""))
    if any(part.uv is None and part.uv1 is None and _has_textures(part) for part in parts):
        source.notes.add("textures not drawn, for want of texture coordinates")
    if not any(map(_has_area, parts)):
        source.notes.add("its triangles have no area: pictures of it are empty")
    return joined(parts, crease)


def _has_area(part: Mesh) -> bool:
    """Whether a triangle has an area; of most meshes one of the first has."""
    firsts = range(0, len(part.triangles), TRIANGLES_AT_ONCE)
    return any(face_normals(part.vertices, part.triangles[i : i + TRIANGLES_AT_ONCE]).any() for i in firsts)


def _has_textures(part: Mesh) -> bool:
    """Whether a triangle has a material with a texture."""
    rows = part.material_of_triangle
    used = part.materials if rows is None else [part.materials[i] for i in np.unique(rows)]
    return any(getattr(material, name) is not None for material in used for name in TEXTURES)


def _parts(source: InputFile) -> list[Mesh]:
    """The meshes of the file."""
    suffix = source.path.suffix.lower()
    if suffix in ARCHIVE_SUFFIXES:
        from topleft._meshes.io.limits.archives import unpacked

        with unpacked(source.path, source.budget, source.notes) as (folder, paths):
            return _parts_of_members(source, folder, paths)
    if suffix in MESHIO_READERS:
        from topleft._meshes.io.solvers import read_by_meshio

        return read_by_meshio(source, MESHIO_READERS[suffix])
    module, _, name = READERS.get(suffix, "foreign.read_by_trimesh").rpartition(".")
    read: Callable[[InputFile], list[Mesh]] = getattr(import_module(f"topleft._meshes.io.{module}"), name)
    return read(source)


def _parts_of_members(source: InputFile, folder: Path, paths: list[Path]) -> list[Mesh]:
    """The meshes of the members of an archive; one that is broken is told, unless all are."""
    parts: list[Mesh] = []
    errors = []
    for path in paths:
        member = InputFile(path, source.budget, archive=source, home=folder)
        try:
            parts += reading(member, partial(_parts, member))
        except OverLimitError:
            raise
        except (MeshError, FileNotFoundError) as error:
            errors.append(error)
            name = path.relative_to(folder).as_posix()
            source.notes.add("members of its archive left out", f"{name} ({str(error).replace(str(folder) + '/', '')})")
    if errors and len(errors) == len(paths):
        raise errors[0]
    return parts


def _points(source: InputFile) -> Points:
    """The points of a file without triangles; points that are not finite are left out."""
    source.notes.remove("points not drawn")
    clouds = source.clouds
    positions = np.concatenate([cloud.positions for cloud in clouds])
    colors = normals = None
    if any(cloud.colors is not None for cloud in clouds):
        white = [np.full((len(cloud.positions), 4), 255, np.uint8) for cloud in clouds]
        pairs = zip(clouds, white, strict=True)
        colors = np.concatenate([blank if cloud.colors is None else cloud.colors for cloud, blank in pairs])
    if all(cloud.normals is not None for cloud in clouds):
        normals = np.concatenate([cloud.normals for cloud in clouds if cloud.normals is not None])
    is_somewhere = np.isfinite(positions).all(axis=1)
    if not is_somewhere.all():
        source.notes.add("points that are not finite left out")
        positions = positions[is_somewhere]
        colors, normals = (None if rows is None else rows[is_somewhere] for rows in (colors, normals))
    if not len(positions):
        raise MeshError(f"{str(source.path)!r} has no points that are finite")
    return Points(positions, colors, normals)


def reading(source: InputFile, read: Callable[[], Made]) -> Made:
    """The result of a reader; its errors become one line."""
    path = source.path
    if not path.exists():
        raise FileNotFoundError(f"there is no file {str(path)!r}")
    if path.is_dir():
        raise MeshError(f"{str(path)!r} is a folder, not a mesh")
    if not path.is_file():
        raise MeshError(f"{str(path)!r} is a pipe or a device, not a file")
    if not path.stat().st_size:
        raise MeshError(f"{str(path)!r} is empty")
    if source.moment is not None and path.suffix.lower() not in GLTF_SUFFIXES:
        time = source.moment.time
        raise MeshError(f"{str(path)!r} has no time={time:g}: animations are read of glTF and GLB alone")
    try:
        with _strict_parsing(), np.errstate(all="ignore"):
            return read()
    except FileNotFoundError as error:  # the mesh is there: some formats name more files
        raise MeshError(f"cannot read {str(path)!r}: broken, or without a file that it names ({error})") from error
    except MissingPackageError:
        raise
    except MeshError as error:
        if repr(str(path)) in str(error) or isinstance(error, OverLimitError):
            raise
        raise MeshError(f"cannot read {str(path)!r}: broken, or not a {path.suffix!r} file ({error})") from error
    except MemoryError as error:
        raise MemoryError(f"not enough memory to read {str(path)!r} ({error})") from error
    except OSError as error:
        if error.filename is not None:
            raise
        raise MeshError(f"cannot read {str(path)!r}: broken, or not a {path.suffix!r} file ({error})") from error
    except Exception as error:  # a reader meets broken bytes in its own way: KeyError, struct.error, ...
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        if path.suffix.lower() in GLTF_SUFFIXES and isinstance(error, AttributeError | KeyError | TypeError):
            reason = f"its JSON is not that of glTF: {reason}"
        raise MeshError(f"cannot read {str(path)!r}: broken, or not a {path.suffix!r} file ({reason})") from error


@contextmanager
def _strict_parsing() -> Iterator[None]:
    """Make NumPy's text reader fail where it stops in a broken file (old ones only warn); keep others quiet."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        warnings.simplefilter("ignore", RuntimeWarning)
        warnings.filterwarnings("error", message="string or file could not be read")
        yield
