"""Reads formats without a reader here by trimesh: 3MF, COLLADA and others.

Input: a file, unchecked. Output: `Mesh` parts, placed. trimesh cuts polygons of COLLADA into fans, which reach
beyond concave ones, and leaves out geometries of controllers and of materials that are missing: so its XML is made
simpler before.

Based on: Khronos Group, "COLLADA 1.4.1 Specification", 2008.
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
from dataclasses import replace
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import Array
from topleft._core.base.notes import Notes
from topleft._meshes.io.limits.archives import check_zip
from topleft._meshes.io.limits.budget import Budget
from topleft._meshes.io.limits.walks import walks
from topleft._meshes.io.references import Cloud, InputFile, numbers_of_text
from topleft._meshes.model.from_trimesh import Textures, placed
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.normals import moved
from topleft._meshes.model.polygons import triangulate
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
    ".3mf": "lxml networkx", ".dae": "pycollada lxml networkx", ".xaml": "lxml networkx",
    ".step": "cascadio", ".stp": "cascadio", ".ctm": "openctm",
}  # fmt: skip
"""Formats that trimesh reads by packages of their own."""

CONVERTERS = {
    **dict.fromkeys(
        (".3ds", ".amf", ".blend", ".fbx", ".lwo", ".x", ".x3d"),
        "Blender and assimp convert it: assimp export {name}{suffix} {name}.glb",
    ),
    **dict.fromkeys(
        (".abc", ".usd", ".usda", ".usdc", ".usdz", ".wrl"), "Blender converts it: import it, and export glTF"
    ),
    ".ifc": "ifcopenshell converts it: IfcConvert {name}.ifc {name}.glb",
    **dict.fromkeys((".brep", ".iges", ".igs"), "FreeCAD converts it: import it, and export STEP or OBJ"),
    **dict.fromkeys((".c4d", ".ma", ".max", ".mb", ".skp"), "the program that wrote it exports glTF"),
}
"""Formats without a reader, and programs that make glTF of them."""
BINARY_DXF = b"AutoCAD Binary DXF"

NODES_OF_TRIMESH = 4
"""Nodes of glTF that take as long as one that trimesh reads: 0.2 ms."""

SKINS = "skins and morph targets drawn as they were modelled"

OF_NUMBERS = frozenset({"float_array", "float", "color", "matrix", "translate", "rotate", "scale", "lookat"})
"""Elements that hold numbers which need not be whole."""


def read_by_trimesh(source: InputFile) -> list[Mesh]:
    """The meshes of a file, in its order."""
    suffix = source.path.suffix.lower()
    try:
        import trimesh
    except ImportError:
        raise MissingPackageError(_needs(source, "trimesh")) from None
    _refuse_unreadable(source, suffix)
    try:
        with quiet():
            scene, double_sided = _scene(trimesh, source, suffix)
            parts = [_sided(part, double_sided) for part in _parts(scene, source)]
    except NotImplementedError:
        if suffix in CONVERTERS:
            told = CONVERTERS[suffix].format(name=source.path.stem, suffix=source.path.suffix)
            raise MeshError(f"cannot read {str(source.path)!r}: there is no reader of {suffix}; {told}") from None
        readable = " ".join(sorted(trimesh.available_formats() | {"obj", "ply", "stl", "gltf", "glb"}))
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
        if kind in self.own:
            self.own[kind][self._object] += 1
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


def _scene(trimesh: Any, source: InputFile, suffix: str) -> tuple[Any, bool | None]:
    """The meshes that trimesh reads of a file, and whether all materials have two sides; None if each says so itself.

    COLLADA is read after its polygons have been cut; trimesh does not read the sides of its materials.
    """
    content = source.content()
    if suffix != ".dae":
        del content  # which is counted
        return trimesh.load_scene(str(source.path), process=False), None

    class Beside(trimesh.resolvers.FilePathResolver):  # type: ignore[misc]
        def get(self, name: str) -> bytes:
            content = source.picture_content(unquote(name))
            if content is None:
                raise FileNotFoundError(name)
            return content

    simple, double_sided = simplified(content, source.notes, source.budget)
    _note_missing_pictures(content, source)
    scene = trimesh.load_scene(io.BytesIO(simple), file_type="dae", resolver=Beside(str(source.path)), process=False)
    return scene, double_sided


def _sided(mesh: Mesh, double_sided: bool | None) -> Mesh:
    """The mesh with materials of two sides, or of one; None: as they are."""
    if double_sided is None:
        return mesh
    return replace(mesh, materials=tuple(replace(one, double_sided=double_sided) for one in mesh.materials))


def _note_missing_pictures(content: bytes, source: InputFile) -> None:
    """Note the textures of a COLLADA file that are not where it says, which trimesh leaves out silently."""
    names = re.findall(rb"<init_from>\s*(?:<ref>)?\s*([^<\s][^<]*\.[A-Za-z]{3,4})\s*<", content)
    for name in names:
        source.find(unquote(name.decode("utf-8", errors="replace")).removeprefix("file://"), "textures")


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
def quiet() -> Iterator[None]:
    """Keep the messages of trimesh off the terminal; errors give the reason."""
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


def simplified(content: bytes, notes: Notes, budget: Budget) -> tuple[bytes, bool]:
    """The file with triangles alone, and whether its materials have two sides: unless all say that they have one."""
    budget.spend("max_lines", content.count(b"<") - content.count(b"</"))
    try:
        root = ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise MeshError(f"it is no XML: {error}") from error
    space = root.tag.partition("}")[0] + "}" if root.tag.startswith("{") else ""
    named = {row.get("id"): row for row in root.iter() if row.get("id")}
    for row in root.iter():
        if row.text and "," in row.text and row.tag[len(space) :] in OF_NUMBERS:  # some programs write decimal commas
            row.text = row.text.replace(",", ".")
    positions: dict[Element, Array] = {}
    for mesh in root.iter(f"{space}mesh"):
        for kind in ("polylist", "polygons"):
            for row in mesh.findall(f"{space}{kind}"):
                _cut(row, space, named, positions, notes)
        if mesh.find(f"{space}lines") is not None or mesh.find(f"{space}linestrips") is not None:
            notes.add("lines not drawn")
    for node in list(root.iter(f"{space}node")):
        for row in node.findall(f"{space}instance_controller"):
            _uncontrol(row, space, named, notes)
    for bound in list(root.iter(f"{space}technique_common")):
        kept = []  # `remove` would search all rows for each
        for row in bound:
            if row.tag != f"{space}instance_material" or _is_material(row.get("target", ""), space, named):
                kept.append(row)
            else:
                notes.add("materials that are not there", row.get("target", "")[1:])
        bound[:] = kept
    if root.find(f"{space}library_animations/{space}animation") is not None:
        notes.add("animations not played: everything is at rest")
    _check_walks(root, space, named, budget)
    return ElementTree.tostring(root), _has_two_sides(root, space, notes)


def _has_two_sides(root: Element, space: str, notes: Notes) -> bool:
    """Whether materials are drawn from both sides: unless all effects say 0."""
    effects = list(root.iter(f"{space}effect"))
    n_single = sum(row.findtext(f".//{space}double_sided", "").strip() == "0" for row in effects)
    if 0 < n_single < len(effects):
        notes.add("materials of one side among others drawn from both sides")
    return n_single == 0 or n_single < len(effects)


def _check_walks(root: Element, space: str, named: dict[str | None, Element], budget: Budget) -> None:
    """Count nodes and triangles that the scene places, and put nodes before those that name them, for pycollada."""
    nodes: dict[str | None, list[Element]] = defaultdict(list)
    for node in root.iter(f"{space}node"):
        nodes[node.get("id")].append(node)
    below: dict[Element, list[Element]] = {}
    for parent in [*root.iter(f"{space}visual_scene"), *root.iter(f"{space}node")]:
        below[parent] = [
            child
            for row in parent
            for child in (nodes.get(row.get("url", "")[1:], []) if row.tag == f"{space}instance_node" else [row])
            if row.tag in (f"{space}instance_node", f"{space}node")
        ]
    scene = root.find(f"{space}scene/{space}instance_visual_scene")
    shown = None if scene is None else named.get(scene.get("url", "")[1:])
    found = walks(below, [] if shown is None else [shown])
    own: dict[Element, tuple[int, int]] = {}
    n_nodes = n_triangles = 0
    for node, (n, _) in found.items():
        n_nodes += n
        for row in node.findall(f"{space}instance_geometry"):
            geometry = named.get(row.get("url", "")[1:])
            if geometry is not None:
                own[geometry] = own[geometry] if geometry in own else _counts(geometry, space)
                n_nodes += n * (own[geometry][0] + sum(1 for _ in row.iter(f"{space}instance_material")))
                n_triangles += n * own[geometry][1]
    budget.spend("max_nodes", NODES_OF_TRIMESH * n_nodes)
    budget.check("max_triangles", n_triangles)
    places = {node: i for i, node in enumerate(found)}
    for library in root.findall(f"{space}library_nodes"):
        library[:] = sorted((node for node in library if node in places), key=lambda node: -places[node])


def _counts(geometry: Element, space: str) -> tuple[int, int]:
    """How many lists of triangles a geometry has, and how many triangles; no fewer than pycollada makes."""
    n_lists = n_triangles = 0
    for kind in ("triangles", "trifans", "tristrips"):
        for row in geometry.iter(f"{space}{kind}"):
            n_lists += 1
            stride = 1 + max((int(one.get("offset", 0)) for one in row.findall(f"{space}input")), default=0)
            n_corners = sum(len((one.text or "").split()) for one in row.findall(f"{space}p")) // stride
            n_triangles += n_corners // 3 if kind == "triangles" else n_corners
    return n_lists, n_triangles


def _is_material(target: str, space: str, named: dict[str | None, Element]) -> bool:
    """Whether there is a material with an effect; one of another file may be there."""
    if not target.startswith("#"):
        return True
    material = named.get(target[1:])
    effect = None if material is None else material.find(f"{space}instance_effect")
    return effect is not None and effect.get("url", "")[1:] in named


def _cut(row: Element, space: str, named: dict[str | None, Element], known: dict[Element, Array], notes: Notes) -> None:
    """Make triangles of polygons, in place."""
    inputs = row.findall(f"{space}input")
    stride = 1 + max((int(one.get("offset", 0)) for one in inputs), default=0)
    vertex = next((one for one in inputs if one.get("semantic") == "VERTEX"), None)
    if vertex is None or row.find(f"{space}ph") is not None:
        notes.add("polygons with holes not read" if vertex is not None else "polygons without vertices not read")
        row[:] = [one for one in row if one.tag != f"{space}ph"]
        if vertex is None:
            return
    lists = [one.text or "" for one in row.findall(f"{space}p")]
    corners = _whole(" ".join(lists))
    if row.tag == f"{space}polylist":
        n_corners = _whole(row.findtext(f"{space}vcount"))
    else:
        n_corners = np.array([len(one.split()) // stride for one in lists], np.int64)
    if (n_corners < 0).any() or int(n_corners.sum()) * stride != len(corners):
        raise MeshError(f"a list of polygons has {len(corners)} numbers for {int(n_corners.sum())} corners")
    corners = corners.reshape(-1, stride)
    positions = _positions(vertex, space, named, known)
    triangles, _ = triangulate(positions, corners[:, int(vertex.get("offset", 0))], n_corners)
    row[:] = [one for one in row if one.tag not in (f"{space}p", f"{space}vcount")]
    row.tag = f"{space}triangles"
    row.set("count", str(len(triangles)))
    ElementTree.SubElement(row, f"{space}p").text = " ".join(map(str, corners[triangles.ravel()].ravel().tolist()))


def _positions(vertex: Element, space: str, named: dict[str | None, Element], known: dict[Element, Array]) -> Array:
    """The positions (V, 3) that an input of vertices names; each source is read once."""
    vertices = named.get(vertex.get("source", "")[1:])
    rows = [] if vertices is None else vertices.findall(f"{space}input")
    source = next((named.get(one.get("source", "")[1:]) for one in rows if one.get("semantic") == "POSITION"), None)
    if source is None:
        raise MeshError("polygons name positions that are not there")
    if source in known:
        return known[source]
    accessor = source.find(f"{space}technique_common/{space}accessor")
    stride = 3 if accessor is None else int(accessor.get("stride", 1))
    start = 0 if accessor is None else int(accessor.get("offset", 0))
    numbers = numbers_of_text((source.findtext(f"{space}float_array") or "").encode())[start:]
    if not 2 <= stride <= 64:
        raise MeshError(f"positions have {stride} numbers")
    known[source] = numbers[: len(numbers) // stride * stride].reshape(-1, stride)[:, :3]
    return known[source]


def _whole(text: str | None) -> npt.NDArray[np.int64]:
    return numbers_of_text((text or "").encode(), np.int64)


def _uncontrol(row: Element, space: str, named: dict[str | None, Element], notes: Notes) -> None:
    """Put the geometry of a controller where the controller is, in place."""
    notes.add(SKINS)
    matrix: str | None = None
    url = row.get("url", "")
    for _ in range(len(named)):  # a skin may move the result of a morph
        controller = named.get(url[1:])
        if controller is None or controller.tag != f"{space}controller":
            break
        kind = next((each for each in controller if each.tag in (f"{space}skin", f"{space}morph")), None)
        if kind is None:
            return
        matrix = kind.findtext(f"{space}bind_shape_matrix") or matrix
        url = kind.get("source", "")
    row.tag = f"{space}instance_geometry"
    row.set("url", url)
    row[:] = [one for one in row if one.tag != f"{space}skeleton"]
    if matrix:  # the row becomes a node, with itself in it
        inner = Element(row.tag, row.attrib)
        inner[:] = row[:]
        row.clear()
        row.tag = f"{space}node"
        ElementTree.SubElement(row, f"{space}matrix").text = matrix
        row.append(inner)
