"""Files: meshes in. `load` reads what trimesh reads and returns one `Mesh`."""

from __future__ import annotations

import io
import os
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.errors import MeshError, MissingPackageError
from topleft.faces import angle_weighted_normals
from topleft.imported import material_of, obj_by_material
from topleft.material import Material
from topleft.mesh import Mesh, coincident


def load(path: str | os.PathLike[str]) -> Mesh:
    """A mesh read from a file, by trimesh: OBJ, PLY, STL, glTF and GLB, OFF, and what else it has readers for.

    Parameters
    ----------
    path : path
        The end of its name tells the format.

    Returns
    -------
    Mesh
        Polygons are cut into triangles, groups and objects are one mesh, in the order of the file; the nodes of a scene
        are placed by their transforms. Normals are those of the file. A file without normals gets its vertices merged
        where they are equal, so that shading has no seams where a format (STL) or a texture had to double them.
        Colours are those of the vertices or the faces, if there are any; `uv` those of the file. Materials are those of
        MTL (colour, its map, highlights) and glTF (base colour; metallic-rough surfaces are approximated, see
        `topleft.imported`); the triangles of an OBJ file stand together by material.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeshError
        If the file is broken, has no triangles, or is of an unsupported format.
    MissingPackageError
        If trimesh, or a package that it needs for this format, is not installed.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"there is no file {str(path)!r}")
    if path.is_dir():
        raise MeshError(f"{str(path)!r} is a folder, not a mesh")
    try:
        import trimesh
    except ImportError:
        raise MissingPackageError("reading a mesh needs trimesh: pip install 'topleft[render]'") from None
    try:
        with _strict_parsing():
            if path.suffix.lower() == ".obj":
                parts = [
                    replace(part, materials=() if material is None else (material,))
                    for text, material in _obj_texts(path)
                    for part in _parts(trimesh.load_scene(io.BytesIO(text), file_type="obj", process=False))
                ]
            else:
                parts = _parts(trimesh.load_scene(str(path), process=False))
        if not parts:
            raise MeshError(f"{str(path)!r} has no triangles")
        return joined(parts)
    except FileNotFoundError as error:  # the mesh is there: glTF and others name more files
        raise MeshError(f"cannot read {str(path)!r}: broken, or without a file that it names ({error})") from error
    except (MeshError, OSError, MemoryError):
        raise
    except NotImplementedError:
        readable = " ".join(sorted(trimesh.available_formats()))
        raise MeshError(f"cannot read {str(path)!r}: format {path.suffix!r} is none of {readable}") from None
    except ImportError as error:
        # trimesh asks for these to guess the encoding of what is not UTF-8: here, of a file that is no text.
        if getattr(error, "name", None) not in ("charset_normalizer", "chardet"):
            raise MissingPackageError(f"reading {path.suffix!r} needs another package: {error}") from error
        raise MeshError(f"cannot read {str(path)!r}: broken, or not a {path.suffix!r} file") from error
    except Exception as error:  # a reader meets broken bytes in its own way: KeyError, struct.error, ...
        reason = " ".join(str(error).split()) or type(error).__name__
        raise MeshError(f"cannot read {str(path)!r}: broken, or not a {path.suffix!r} file ({reason})") from error


@contextmanager
def _strict_parsing() -> Iterator[None]:
    """Make NumPy's text reader fail where it stops in a broken file (old ones only warn); keep trimesh off stderr."""
    import logging

    logger = logging.getLogger("trimesh")
    quiet = logging.NullHandler()
    logger.addHandler(quiet)  # a logger without a handler prints its warnings
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("error", message="string or file could not be read")
            yield
    finally:
        logger.removeHandler(quiet)


def _parts(scene: Any) -> list[Mesh]:
    """The meshes of a trimesh scene, in its order, placed."""
    return [
        placed(scene.geometry[geometry], transform)
        for transform, geometry in (scene.graph[node] for node in scene.graph.nodes_geometry)
        if len(getattr(scene.geometry[geometry], "faces", ()))
    ]


def _obj_texts(path: Path) -> Iterator[tuple[bytes, Material | None]]:
    """The text of an OBJ file by material, as trimesh reads it rightly: UTF-8, one group, no relative indices.

    trimesh takes groups from the last to the first, doubles the vertices between them, and counts a negative index
    from the end of the file; the format counts it from the vertices above the line.
    """
    text = path.read_bytes().decode("utf-8", errors="replace").replace("\r\n", "\n").replace("\\\n", " ")
    if "\0" in text:
        raise MeshError(f"cannot read {str(path)!r}: broken, or not a '.obj' file (it is not text)")
    text = re.sub(r"^[ \t]*[ogs]\b.*$", "", text, flags=re.MULTILINE)
    if re.search(r"^[ \t]*f\b.*-\d", text, flags=re.MULTILINE):
        text = "\n".join(_absolute_indices(text.split("\n")))
    for own, material in obj_by_material(text, path):
        yield re.sub(r"^[ \t]*(usemtl|mtllib)\b.*$", "", own, flags=re.MULTILINE).encode(), material


def _absolute_indices(lines: list[str]) -> Iterator[str]:
    above = {"v": 0, "vt": 0, "vn": 0}
    for line in lines:
        words = line.split()
        if words and words[0] in above:
            above[words[0]] += 1
        elif words and words[0] == "f":
            corners = ("/".join(map(_absolute, word.split("/"), above.values())) for word in words[1:])
            line = " ".join(["f", *corners])
        yield line


def _absolute(index: str, n_above: int) -> str:
    return str(n_above + 1 + int(index)) if index.startswith("-") else index


def placed(geometry: Any, transform: npt.NDArray[np.float64]) -> Mesh:
    """A trimesh geometry as a mesh in the space of its scene; per-face colours get corners of their own."""
    vertices, triangles = np.asarray(geometry.vertices), np.asarray(geometry.faces)
    # trimesh computes normals when asked for them; what a file gave waits in the cache.
    normals = np.asarray(geometry.vertex_normals) if "vertex_normals" in geometry._cache else None
    colors = uv = None
    materials: tuple[Material, ...] = ()
    if geometry.visual.kind == "texture":
        own = geometry.visual.uv
        uv = None if own is None or np.shape(own) != (len(vertices), 2) else np.asarray(own)
        material = material_of(geometry.visual.material)
        materials = () if material is None else (material,)
    elif geometry.visual.kind == "vertex":
        colors = np.asarray(geometry.visual.vertex_colors)
    elif geometry.visual.kind == "face":
        colors = np.asarray(geometry.visual.face_colors).repeat(3, axis=0)
        vertices = vertices[triangles.ravel()]
        normals = None if normals is None else normals[triangles.ravel()]
        triangles = np.arange(triangles.size).reshape(-1, 3)
    if not np.array_equal(transform, np.eye(4)):
        linear = transform[:3, :3]
        vertices = vertices @ linear.T + transform[:3, 3]
        if np.linalg.det(linear) < 0:  # a mirror turns the triangles over
            triangles = triangles[:, ::-1]
        if normals is not None:
            normals = normals @ np.linalg.pinv(linear)
    return Mesh(vertices, triangles, normals, colors, uv, materials)


def joined(parts: list[Mesh]) -> Mesh:
    """One mesh of several; vertices that are equal become one unless the file has normals."""
    starts = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    vertices = np.concatenate([part.vertices for part in parts])
    triangles = np.concatenate([part.triangles + start for part, start in zip(parts, starts, strict=True)])
    colors = uv = None
    if any(part.colors is not None for part in parts):
        colors = np.concatenate([_rgba(part) for part in parts])
    if any(part.uv is not None for part in parts):
        uv = np.concatenate([_uv(part) for part in parts])
    surface = _joined_materials(parts)
    if all(part.normals is not None for part in parts):
        normals = np.concatenate([part.vertex_normals() for part in parts])
        return Mesh(vertices, triangles, normals, colors, uv, *surface)
    own_normals: npt.NDArray[Any] | None = None
    if any(part.normals is not None for part in parts):
        own_normals = np.concatenate([part.vertex_normals() for part in parts])
    elif colors is not None or uv is not None:
        # Vertices of two colours, or on both sides of a seam, stay two, and still share a normal.
        first, group = coincident(vertices)
        own_normals = angle_weighted_normals(vertices[first], group[triangles].astype(np.int32))[group]
    first, group = coincident(*(array for array in (vertices, own_normals, colors, uv) if array is not None))
    own_normals, colors, uv = (None if array is None else array[first] for array in (own_normals, colors, uv))
    return Mesh(vertices[first], group[triangles], own_normals, colors, uv, *surface)


def _joined_materials(parts: list[Mesh]) -> tuple[tuple[Material, ...], npt.NDArray[np.int32] | None]:
    """The materials of all parts, and which of them each triangle has."""
    if not any(part.materials for part in parts):
        return (), None
    materials: dict[Material, int] = {}
    rows = []
    for part in parts:
        own = part.materials[0] if part.materials else Material()
        rows.append(np.full(len(part.triangles), materials.setdefault(own, len(materials)), np.int32))
    return tuple(materials), np.concatenate(rows)


def _uv(part: Mesh) -> npt.NDArray[np.float32]:
    return np.zeros((len(part.vertices), 2), np.float32) if part.uv is None else part.uv


def _rgba(part: Mesh) -> npt.NDArray[np.uint8]:
    if part.colors is None:
        return np.full((len(part.vertices), 4), 255, dtype=np.uint8)
    return part.colors
