"""Reads formats without a reader here by trimesh: 3MF, STEP and others.

Input: a file, unchecked. Output: `Mesh` parts, placed.
"""

from __future__ import annotations

import contextlib
import io
import re
import zipfile
import zlib
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from topleft._meshes.io.limits.archives import check_zip
from topleft._meshes.io.limits.budget import Budget
from topleft._meshes.io.limits.walks import walks
from topleft._meshes.io.references import Cloud, InputFile
from topleft._meshes.model.from_trimesh import Textures, placed
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.normals import moved
from topleft.errors import MeshError, MissingPackageError

NO_TRIANGLES = {
    ".svg": "it holds curves in a plane",
    ".dxf": "it is a drawing: only its curves could be read",
    ".binvox": "it holds voxels: make a mesh of them, by trimesh's VoxelGrid.marching_cubes say",
}
"""Objects of trimesh that are no mesh."""

UNBOUNDED = {
    **dict.fromkeys((".xdmf", ".xmf"), "it names files wherever they lie"),
    **dict.fromkeys((".cgns", ".e", ".ex2", ".exo", ".h5m", ".hmf", ".med"), "HDF5 unpacks to whatever it says"),
}
"""Formats without a budget: whoever trusts the file reads it by meshio, and gives its points and triangles."""

PACKAGES = {
    ".3mf": "lxml networkx", ".xaml": "lxml networkx",
    ".step": "cascadio", ".stp": "cascadio", ".ctm": "openctm",
}  # fmt: skip
"""Formats that trimesh reads by further packages."""

CONVERTERS = {
    **dict.fromkeys(
        (".3ds", ".amf", ".blend", ".fbx", ".lwo", ".x", ".x3d"),
        "Blender and assimp convert it: assimp export {name}{suffix} {name}.glb",
    ),
    **dict.fromkeys(
        (".abc", ".usd", ".usda", ".usdc", ".usdz", ".wrl"), "Blender converts it: import it, and export glTF"
    ),
    ".pvd": "it names a file for each time step: give one of these files",
    ".ifc": "ifcopenshell converts it: IfcConvert {name}.ifc {name}.glb",
    **dict.fromkeys((".brep", ".iges", ".igs"), "FreeCAD converts it: import it, and export STEP or OBJ"),
    **dict.fromkeys((".c4d", ".ma", ".max", ".mb", ".skp"), "the program that wrote it exports glTF"),
}
"""Formats without a reader, and the way to files that have one, by programs that make glTF for most."""
BINARY_DXF = b"AutoCAD Binary DXF"

COLORS_3MF = {"pid", "p1", "paint_color", "mmu_segmentation"}
"""Attributes of objects and triangles that give colours, of the standard and of slicers: trimesh does not read them."""

NODES_OF_TRIMESH = 4
"""Nodes of glTF that take as long as a node that trimesh reads: 0.2 ms."""


def read_by_trimesh(source: InputFile) -> list[Mesh]:
    """The meshes of a file, in its order."""
    suffix = source.path.suffix.lower()
    try:
        import trimesh
    except ImportError:
        raise MissingPackageError(_needs(source, "trimesh")) from None
    _refuse_unreadable(source, suffix)
    try:
        with quiet(source):
            source.content()  # which is counted
            parts = list(_parts(trimesh.load_scene(str(source.path), process=False), source))
    except NotImplementedError:
        if suffix in CONVERTERS:
            told = CONVERTERS[suffix].format(name=source.path.stem, suffix=source.path.suffix)
            raise MeshError(f"cannot read {str(source.path)!r}: there is no reader of {suffix}; {told}") from None
        readable = " ".join(sorted(trimesh.available_formats() | {"dae", "obj", "ply", "stl", "gltf", "glb"}))
        raise MeshError(
            f"cannot read {str(source.path)!r}: format {source.path.suffix!r} is none of {readable}"
        ) from None
    except ImportError as error:
        # trimesh asks for these to guess the encoding of bytes that are not UTF-8: here, of a file that is no text.
        if getattr(error, "name", None) in ("charset_normalizer", "chardet"):
            raise MeshError("it is not text") from error
        raise MissingPackageError(_needs(source, PACKAGES.get(suffix, error.name or str(error)))) from error
    return parts


def _needs(source: InputFile, package: str) -> str:
    return f"reading {str(source.path)!r} needs another package: pip install {package}"


def _refuse_unreadable(source: InputFile, suffix: str) -> None:
    """Raise an error with the reason for files on which trimesh fails without one."""
    with source.path.open("rb") as file:
        head = file.read(64)
    if head.startswith(BINARY_DXF):
        raise MeshError(f"cannot read {str(source.path)!r}: it is a binary DXF: save it as text")
    if suffix in (".svg", ".dxf", ".binvox"):
        raise MeshError(f"cannot draw {str(source.path)!r}: {NO_TRIANGLES[suffix]}")
    if suffix in UNBOUNDED:
        raise MeshError(
            f"cannot read {str(source.path)!r}: {UNBOUNDED[suffix]}; if you trust it, read it by meshio and draw its "
            "points and triangles"
        )
    archive = check_zip(source.path, source.budget)
    if archive is not None:
        with archive, broken_archives():
            _check_models(archive, source)
            if suffix == ".3dxml":
                _check_3dxml(archive, source.budget)


@contextmanager
def broken_archives() -> Iterator[None]:
    """Raise a `MeshError` for members that do not unpack."""
    try:
        yield
    except (zipfile.BadZipFile, RuntimeError, zlib.error, EOFError, OSError) as error:
        raise MeshError(f"its archive is broken ({error})") from error


def _check_3dxml(archive: zipfile.ZipFile, budget: Budget) -> None:
    """Count the parts and pictures of a 3DXML file as often as they are named: trimesh reads them again each time."""
    from PIL import Image

    sizes = {row.filename: row.file_size for row in archive.infolist()}
    n_pixels, n_textures = 0, 1
    for name in sizes:
        content = archive.read(name)
        if content.lstrip()[:1] in (b"<", b"\xef"):
            budget.spend("max_lines", content.count(b"<") - content.count(b"</"))
            n_textures += content.count(b"TextureImage")
            for named in re.findall(rb"""associatedFile\s*=\s*["'](?:[^"']*:)?([^"':]+)["']""", content):
                budget.spend("max_unpacked_bytes", sizes.get(named.decode("utf-8", errors="replace"), 0))
        else:
            with (
                contextlib.suppress(OSError, ValueError, Image.DecompressionBombError),
                Image.open(io.BytesIO(content)) as image,
            ):
                n_pixels = max(n_pixels, image.width * image.height)
    budget.spend("max_texture_pixels", n_textures * n_pixels)


def _check_models(archive: zipfile.ZipFile, source: InputFile) -> None:
    """Count the objects that the models of a 3MF file place, and refuse models with objects in other files."""
    models = [row for row in archive.infolist() if row.filename.lower().endswith(".model")]
    main = next((row for row in models if "3d/3dmodel.model" in row.filename.lower()), None)
    if main is None:
        return
    counts = {row.filename: Model3MF(archive.read(row), source.budget) for row in models}
    for kind in sorted(set().union(*(model.unread for model in counts.values()))):
        source.notes.add(kind)
    first = counts[main.filename]
    if len(models) > 1 and not first.has_objects:
        raise MeshError(f"cannot read {str(source.path)!r}: its objects are in further files of the archive")
    for object_, path in first.elsewhere:  # trimesh reads all of that file again for each component that names it
        other = counts.get(path.strip("/"))
        if other is not None:
            source.budget.spend("max_lines", other.n_elements)
            for kind in ("vertex", "triangle"):
                first.own[kind][object_] += sum(other.own[kind].values())
    found = walks(first.below, first.items)
    source.budget.spend("max_nodes", NODES_OF_TRIMESH * sum(n_steps for _, n_steps in found.values()))
    for kind, option in (("vertex", "max_vertices"), ("triangle", "max_triangles")):
        source.budget.check(option, sum(found[name][0] * n for name, n in first.own[kind].items() if name in found))


class Model3MF:
    """Counts the elements of a model of a 3MF file, and keeps none."""

    def __init__(self, content: bytes, budget: Budget) -> None:
        from xml.parsers import expat

        self.n_elements = content.count(b"<") - content.count(b"</")
        budget.spend("max_lines", self.n_elements)
        self.has_objects = False
        self.unread: set[str] = set()
        self.own: dict[str, dict[str, int]] = {"vertex": defaultdict(int), "triangle": defaultdict(int)}
        self.below: dict[str, list[str]] = defaultdict(list)
        self.items: list[str] = []
        self.elsewhere: list[tuple[str, str]] = []
        self._object = ""
        parser = expat.ParserCreate(namespace_separator="}")
        parser.StartElementHandler = self._start
        try:
            parser.Parse(content, True)
        except expat.ExpatError as error:
            raise MeshError(f"it is no XML: {error}") from error

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        kind = tag.rpartition("}")[2]
        if any(name.rpartition("}")[2] in COLORS_3MF for name in attributes):
            self.unread.add("colours and materials not read")
        if kind in self.own:
            self.own[kind][self._object] += 1
        elif kind == "beam":
            self.unread.add("beams not drawn")
        elif kind == "object":
            self.has_objects, self._object = True, attributes.get("id", "")
        elif kind == "item":
            self.items.append(attributes.get("objectid", ""))
        elif kind == "component":
            name = attributes.get("objectid", "")
            self.below[self._object].append(name)
            path = next((value for key, value in attributes.items() if key.endswith("path")), None)
            if path is not None:
                self.elsewhere.append((name, path))


def _parts(scene: Any, source: InputFile) -> Iterator[Mesh]:
    """The meshes of a trimesh scene, in its order, placed."""
    textures: Textures = {}
    for transform, name in (scene.graph[node] for node in scene.graph.nodes_geometry):
        geometry = scene.geometry[name]
        if len(getattr(geometry, "faces", ())):
            source.budget.spend("max_vertices", len(geometry.vertices))
            source.budget.spend("max_triangles", len(geometry.faces))
            yield placed(geometry, transform, textures)
        elif hasattr(geometry, "colors") and len(getattr(geometry, "vertices", ())):
            source.notes.add("points not drawn")
            points = moved(np.asarray(geometry.vertices), transform)
            source.budget.spend("max_vertices", len(points))
            colors = np.asarray(geometry.colors)
            source.clouds.append(Cloud(points, colors if colors.shape == (len(points), 4) else None))
        elif hasattr(geometry, "entities"):
            source.notes.add("lines not drawn")


@contextmanager
def quiet(source: InputFile) -> Iterator[None]:
    """Keep the messages of trimesh off the terminal; its warnings are notes, errors give the reason."""
    import logging.handlers

    logger = logging.getLogger("trimesh")
    handler = logging.handlers.BufferingHandler(capacity=1 << 16)
    handler.setLevel(logging.WARNING)
    logger.addHandler(handler)  # a logger without a handler prints its warnings
    nowhere = io.StringIO()
    try:
        with contextlib.redirect_stderr(nowhere), contextlib.redirect_stdout(nowhere), np.errstate(all="ignore"):
            yield
        for record in handler.buffer:
            source.notes.add("read with a warning of trimesh", " ".join(record.getMessage().split()))
    finally:
        logger.removeHandler(handler)
