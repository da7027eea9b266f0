"""Reads by trimesh what has no reader here: OFF, 3MF, COLLADA and what else it knows.

Input: a file, unchecked. Output: `Mesh` parts, placed.
"""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import unquote

import numpy as np

from topleft._io.references import Cloud, InputFile
from topleft._model.from_trimesh import placed
from topleft._model.mesh import Mesh
from topleft.errors import MeshError, MissingPackageError

NO_TRIANGLES = {
    ".svg": "it holds curves in a plane",
    ".dxf": "only its curves are read",
    ".binvox": "it holds voxels: make a mesh of them, by trimesh's VoxelGrid.marching_cubes say",
}
"""What trimesh may read that is no mesh."""

FORMATS_OF_EXTRA = (".3mf", ".dae", ".zae", ".xaml", ".amf")
BINARY_DXF = b"AutoCAD Binary DXF"
MAX_UNPACKED_BYTES = 1 << 29
"""Of all files of an archive."""


def read_by_trimesh(source: InputFile) -> list[Mesh]:
    """The meshes of a file, in its order.

    Raises
    ------
    MeshError
        If it is of an unsupported format, holds no mesh, or is an archive of too much.
    MissingPackageError
        If trimesh, or a package that it needs for this format, is not installed.
    """
    suffix = source.path.suffix.lower()
    try:
        import trimesh
    except ImportError:
        raise MissingPackageError("reading a mesh needs trimesh: pip install 'topleft[render]'") from None
    _check_what_it_is(source, suffix)
    try:
        with quiet():
            scene = trimesh.load_scene(str(source.path), process=False)
            parts = list(_parts(scene, source))
    except NotImplementedError:
        readable = " ".join(sorted(trimesh.available_formats() | {"obj", "ply", "stl", "gltf", "glb"}))
        raise MeshError(
            f"cannot read {str(source.path)!r}: format {source.path.suffix!r} is none of {readable}"
        ) from None
    except ImportError as error:
        # trimesh asks for these to guess the encoding of what is not UTF-8: here, of a file that is no text.
        if getattr(error, "name", None) in ("charset_normalizer", "chardet"):
            raise MeshError("it is not text") from error
        extra = "pip install 'topleft[formats]'" if suffix in FORMATS_OF_EXTRA else f"another package: {error}"
        raise MissingPackageError(f"reading {source.path.suffix!r} needs {extra}") from error
    if suffix == ".dae":
        _note_missing_pictures(source)
    if not parts and not source.clouds and suffix in NO_TRIANGLES:
        raise MeshError(f"cannot draw {str(source.path)!r}: {NO_TRIANGLES[suffix]}")
    return parts


def _check_what_it_is(source: InputFile, suffix: str) -> None:
    """Raise an error for what trimesh would fail on in words that do not say why."""
    with source.path.open("rb") as file:
        head = file.read(64)
    if head.startswith(BINARY_DXF):
        raise MeshError(f"cannot read {str(source.path)!r}: it is a binary DXF: save it as text")
    if suffix in (".svg", ".binvox"):
        raise MeshError(f"cannot draw {str(source.path)!r}: {NO_TRIANGLES[suffix]}")
    if head.startswith(b"PK\3\4"):
        import zipfile

        try:
            with zipfile.ZipFile(source.path) as archive:
                n_bytes = sum(row.file_size for row in archive.infolist())
        except (zipfile.BadZipFile, NotImplementedError) as error:
            raise MeshError(f"its archive is broken ({error})") from error
        if n_bytes > MAX_UNPACKED_BYTES:
            raise MeshError(f"its archive holds {n_bytes} bytes, more than {MAX_UNPACKED_BYTES}")


def _note_missing_pictures(source: InputFile) -> None:
    """Note the textures of a COLLADA file that are not where it says, which trimesh leaves out without a word."""
    names = re.findall(rb"<init_from>\s*(?:<ref>)?\s*([^<\s][^<]*\.[A-Za-z]{3,4})\s*<", source.path.read_bytes())
    for name in names:
        source.find(unquote(name.decode("utf-8", errors="replace")).removeprefix("file://"), "textures")


def _parts(scene: Any, source: InputFile) -> Iterator[Mesh]:
    """The meshes of a trimesh scene, in its order, placed."""
    n_vertices = 0
    for transform, name in (scene.graph[node] for node in scene.graph.nodes_geometry):
        geometry = scene.geometry[name]
        if len(getattr(geometry, "faces", ())):
            n_vertices += len(geometry.vertices)
            source.check_n_vertices(n_vertices)
            yield placed(geometry, transform)
        elif hasattr(geometry, "colors") and len(getattr(geometry, "vertices", ())):
            source.notes.add("points not drawn")
            points = np.asarray(geometry.vertices) @ transform[:3, :3].T + transform[:3, 3]
            source.check_n_vertices(len(points))
            colors = np.asarray(geometry.colors)
            source.clouds.append(Cloud(points, colors if colors.shape == (len(points), 4) else None))
        elif hasattr(geometry, "entities"):
            source.notes.add("lines not drawn")


@contextmanager
def quiet() -> Iterator[None]:
    """Keep what trimesh and meshio print off the terminal; errors say what is wrong."""
    import logging

    logger = logging.getLogger("trimesh")
    handler = logging.NullHandler()
    logger.addHandler(handler)  # a logger without a handler prints its warnings
    nowhere = io.StringIO()
    try:
        with contextlib.redirect_stderr(nowhere), contextlib.redirect_stdout(nowhere), np.errstate(all="ignore"):
            yield
    finally:
        logger.removeHandler(handler)
