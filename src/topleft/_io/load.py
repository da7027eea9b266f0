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

from topleft._base.arrays import as_path
from topleft._model.adapt import FILE_READERS, joined, material_of, placed
from topleft._model.material import Material
from topleft._model.mesh import Mesh
from topleft.errors import MeshError, MissingPackageError


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
        MTL (colour, its map, highlights) and glTF (base colour; metallic-rough surfaces are
        approximated); the triangles of an OBJ file stand together by material.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeshError
        If the file is broken, has no triangles, or is of an unsupported format.
    MissingPackageError
        If trimesh, or a package that it needs for this format, is not installed.

    Notes
    -----
    Of a metallic-rough surface the base colour is shaded by Lambert's cosine, the roughness by a Blinn highlight of the
    same width with the reflectance of a dielectric. Metals keep their diffuse colour, since there is no surrounding
    that they could mirror; normal, occlusion and emission maps are not read.
    """
    path = as_path("path", path)
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


FILE_READERS.append(load)


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
    for own, material in _by_material(text, path):
        yield re.sub(r"^[ \t]*(usemtl|mtllib)\b.*$", "", own, flags=re.MULTILINE).encode(), material


def _by_material(text: str, path: Path) -> Iterator[tuple[str, Material | None]]:
    """The OBJ text of each material, in the order of their first use: all vertices, and the faces that use it.

    The whole text when the library has none of the materials.
    """
    if "usemtl" not in text or "mtllib" not in text:
        yield text, None
        return
    import trimesh

    used: dict[str, list[str]] = {}
    vertices, name = [], ""
    known: dict[str, Any] = {}
    parse_mtl: Any = trimesh.exchange.obj.parse_mtl
    for line in text.split("\n"):
        words = line.split(maxsplit=1)
        match words[0] if words else "":
            case "usemtl":
                name = words[1].strip() if len(words) > 1 else ""
            case "mtllib" if len(words) > 1:
                library = path.parent / words[1].strip()
                if library.is_file():
                    resolver = trimesh.resolvers.FilePathResolver(str(library.parent))
                    known |= parse_mtl(library.read_bytes(), resolver=resolver)
            case "f":
                used.setdefault(name, []).append(line)
            case "v" | "vt" | "vn":
                vertices.append(line)
    if not known.keys() & used.keys():
        yield text, None
        return
    for name, faces in used.items():
        own = known.get(name)
        make: Any = trimesh.visual.material.SimpleMaterial
        source = None if own is None else make(**own)
        yield "\n".join([*vertices, *faces]), None if source is None else material_of(source)


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
