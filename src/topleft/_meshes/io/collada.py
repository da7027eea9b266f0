"""Reads COLLADA by one walk over its XML, from the scene down to lists of triangles.

Input: a file, unchecked. Output: `Mesh` parts, placed; skins and morphs at rest.

Based on: Khronos Group, "COLLADA 1.4.1 Specification", 2008; skew: Pixar, "The RenderMan Interface", 2000.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from urllib.parse import unquote
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from topleft._core import engine
from topleft._core.base.array_types import F64, I64, U8
from topleft._core.base.color import decode_srgb
from topleft._meshes.io.limits.walks import walks
from topleft._meshes.io.obj import distinct
from topleft._meshes.io.references import InputFile, numbers_of_text
from topleft._meshes.model.joined import placed_arrays
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.normals import unit_or_zero
from topleft._meshes.model.polygons import triangulate
from topleft._meshes.model.pose import rotation_of_vector
from topleft._meshes.model.texture import Texture
from topleft.errors import MeshError
from topleft.typing import UpOption, WrapOption

SHADERS = ("phong", "lambert", "blinn", "constant")
FACES = ("triangles", "polylist", "polygons", "trifans", "tristrips")
NUMBERS_OF = {"matrix": 16, "translate": 3, "rotate": 4, "scale": 3, "lookat": 9, "skew": 7}
"""How many numbers each transform of a node has."""

WRAPS: dict[str, WrapOption] = {"MIRROR": "mirror", "CLAMP": "clamp", "BORDER": "clamp", "NONE": "clamp"}

X_UP = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
"""From axes with x up and -y to the right to those with y up and x to the right."""

NODES_OF_LIST = 4
"""Nodes of glTF that take as long as a list of triangles."""

MAX_CONTROLLERS = 4
"""Controllers between a node and a geometry: a skin may move the result of a morph."""

LUMINANCE = np.array([0.212671, 0.715160, 0.072169])
"""Shares of red, green and blue in the opacity of a colour, of the specification."""


def read_collada(source: InputFile) -> list[Mesh]:
    """The meshes of a COLLADA file, in the order of its scene."""
    content = source.content()
    source.budget.spend("max_lines", content.count(b"<") - content.count(b"</"))
    try:
        root = ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise MeshError(f"it is no XML: {error}") from error
    for row in root.iter():
        row.tag = row.tag.rpartition("}")[2]
    return list(_Collada(root, source).parts())


class _Collada:
    """A file, with the geometries and materials that it shares."""

    def __init__(self, root: Element, source: InputFile) -> None:
        self._root, self._source, self._notes = root, source, source.notes
        self._named = {(row.tag, row.get("id")): row for row in root.iter() if row.get("id")}
        self._arrays: dict[str, F64] = {}
        self._lists: dict[Element, list[tuple[str | None, Mesh]]] = {}
        self._materials: dict[Element, Material] = {}
        self._textures: dict[tuple[int, WrapOption, WrapOption], Texture | None] = {}
        self._sets = {row.get("texcoord") for row in root.iter("texture")}
        axis = (root.findtext("asset/up_axis") or "Y_UP").strip()
        self._up: UpOption = "z" if axis == "Z_UP" else "y"
        self._upright = X_UP if axis == "X_UP" else np.eye(4)
        if axis not in ("X_UP", "Y_UP", "Z_UP"):
            self._notes.add("up axis not followed", axis)

    def _at(self, tag: str, url: str | None) -> Element | None:
        """The element of a kind that a URL of the file names."""
        return self._named.get((tag, url[1:])) if url and url.startswith("#") else None

    def parts(self) -> Iterator[Mesh]:
        """The lists of triangles of all geometries, where the scene places them."""
        if self._root.find("library_animations/animation") is not None:
            self._notes.add("animations not played: everything is at rest")
        named = self._root.find("scene/instance_visual_scene")
        scene = None if named is None else self._at("visual_scene", named.get("url"))
        if scene is None and (scene := self._root.find("library_visual_scenes/visual_scene")) is not None:
            self._notes.add("no scene chosen: the first one is drawn")
        if scene is not None:
            yield from self._parts_of_scene(scene)
        for geometry in self._root.iterfind("library_geometries/geometry"):
            if geometry not in self._lists:
                self._notes.add("geometries that no scene places not drawn", geometry.get("id", ""))

    def _parts_of_scene(self, scene: Element) -> Iterator[Mesh]:
        below = {node: list(self._nodes_below(node)) for node in self._root.iter() if node.tag == "node"}
        below[scene] = list(self._nodes_below(scene))
        self._source.budget.spend("max_nodes", sum(n for n, _ in walks(below, [scene]).values()))
        stack = [(scene, self._upright)]
        while stack:
            node, above = stack.pop()
            place = engine.product(above, _transform(node))
            stack += [(child, place) for child in reversed(below[node])]
            for row in node:
                if row.tag in ("instance_geometry", "instance_controller"):
                    yield from self._placed(row, place)

    def _nodes_below(self, node: Element) -> Iterator[Element]:
        for row in node:
            child = self._at("node", row.get("url")) if row.tag == "instance_node" else row
            if child is None:
                self._notes.add("nodes that are not there", row.get("url", ""))
            elif child.tag == "node":
                yield child

    def _placed(self, instance: Element, place: F64) -> Iterator[Mesh]:
        """The geometry of an instance, in its materials."""
        geometry, place = self._geometry_of(instance, place)
        if geometry is None:
            self._notes.add("geometries that are not there", instance.get("url", ""))
            return
        first = geometry.find(".//input[@semantic='TEXCOORD']")
        for material in instance.iter("instance_material"):
            for row in material.iter("bind_vertex_input"):
                number, semantic = row.get("input_set", "0"), row.get("semantic")
                if first is not None and semantic in self._sets and number != first.get("set", "0"):
                    name = f"set {number} of {material.get('symbol')}"
                    self._notes.add("textures laid by the first of several texture coordinates", name)
        targets = {row.get("symbol"): row.get("target") for row in instance.iter("instance_material")}
        budget = self._source.budget
        budget.spend("max_nodes", len(targets))
        for symbol, mesh in self._lists_of(geometry):
            budget.spend("max_nodes", NODES_OF_LIST)
            budget.spend("max_vertices", len(mesh.vertices))
            budget.spend("max_triangles", len(mesh.triangles))
            materials = () if symbol is None else self._material(targets.get(symbol, f"#{symbol}"))
            arrays = placed_arrays(mesh.vertices, mesh.triangles, mesh.normals, place)
            yield Mesh(*arrays, mesh.colors, mesh.uv, materials, up=self._up)

    def _geometry_of(self, instance: Element, place: F64) -> tuple[Element | None, F64]:
        """The geometry of an instance, below its controllers, and its place."""
        url, shape = instance.get("url"), None
        for _ in range(MAX_CONTROLLERS if instance.tag == "instance_controller" else 0):
            controller = self._at("controller", url)
            kinds = [] if controller is None else [row for row in controller if row.tag in ("skin", "morph")]
            if not kinds:
                break
            self._notes.add("skins and morph targets drawn as they were modelled")
            found = kinds[0].find("bind_shape_matrix")
            url, shape = kinds[0].get("source"), shape if found is None else found
        if shape is not None:
            place = engine.product(place, _of_length(shape, 16).reshape(4, 4))
        return self._at("geometry", url), place

    def _lists_of(self, geometry: Element) -> list[tuple[str | None, Mesh]]:
        """The lists of triangles of a geometry and the symbols of their materials; read once."""
        if geometry not in self._lists:
            rows, found = geometry.findall("mesh/*"), self._lists.setdefault(geometry, [])
            self._source.budget.check("max_nodes", NODES_OF_LIST * sum(row.tag in FACES for row in rows))
            for row in rows:
                if row.tag in FACES:
                    mesh = self._mesh(row)
                    if mesh is not None:
                        found.append((row.get("material"), mesh))
                elif row.tag in ("lines", "linestrips"):
                    self._notes.add("lines not drawn")
            if geometry.find("mesh") is None:
                self._notes.add("geometries that are no meshes not drawn", geometry.get("id", ""))
        return self._lists[geometry]

    def _mesh(self, row: Element) -> Mesh | None:
        """A list of triangles, fans, strips or polygons; None without vertices."""
        inputs: dict[str, tuple[int, str]] = {}
        stride = 1
        for one in row.findall("input"):
            offset = int(one.get("offset", 0))
            stride = max(stride, 1 + offset)
            vertices = self._at("vertices", one.get("source"))
            for own in [one] if vertices is None else vertices.findall("input"):
                inputs.setdefault(own.get("semantic", ""), (offset, own.get("source", "")))
        if row.find("ph") is not None:
            self._notes.add("polygons with holes not read")
        if "POSITION" not in inputs:
            raise MeshError("faces name positions that are not there")
        corner, url = inputs["POSITION"]
        positions = self._columns(url, 3)
        corners, triangles = self._triangles(row, stride, positions, corner)
        if not len(triangles):
            return None
        used = corners[triangles.ravel()]
        first, at = distinct([used[:, offset] for offset in sorted({offset for offset, _ in inputs.values()})])
        used = used[first]
        if not 0 <= used.min() <= used[:, corner].max() < len(positions):
            raise MeshError(f"faces name vertices {used.min()} to {used[:, corner].max()} of {len(positions)}")
        found: dict[str, F64] = {}
        for semantic, n in (("NORMAL", 3), ("COLOR", 4), ("TEXCOORD", 2)):
            offset, url = inputs.get(semantic, (0, ""))
            values = self._columns(url, n) if self._at("source", url) is not None else np.zeros((0, n))
            if semantic in inputs and used[:, offset].max() < len(values):
                found[semantic] = values[used[:, offset]]
            elif semantic in inputs:
                self._notes.add(f"{semantic} of faces that is not there", url)
        colors = None if "COLOR" not in found else np.rint(255 * found["COLOR"].clip(0, 1)).astype(np.uint8)
        faces = at.astype(np.int32).reshape(-1, 3)
        return Mesh(positions[used[:, corner]], faces, found.get("NORMAL"), colors, found.get("TEXCOORD"))

    def _triangles(self, row: Element, stride: int, positions: F64, corner: int) -> tuple[I64, I64]:
        """The corners (C, stride) of faces, rows of arrays, and triangles (T, 3) as rows of them."""
        lists = [one.text or "" for one in row.findall("p")]
        corners = numbers_of_text(" ".join(lists).encode(), np.int64)
        if row.tag == "polylist":
            n_corners = numbers_of_text((row.findtext("vcount") or "").encode(), np.int64)
        elif row.tag == "triangles":
            n_corners = np.full(len(corners) // (3 * stride), 3)
        else:
            n_corners = np.array([len(one.split()) // stride for one in lists], np.int64)
        if (n_corners < 0).any() or int(n_corners.sum()) * stride != len(corners):
            raise MeshError(f"a list of {row.tag} has {len(corners)} numbers for {int(n_corners.sum())} corners")
        n_triangles = np.maximum(n_corners - 2, 0)
        self._source.budget.check("max_triangles", int(n_triangles.sum()))
        corners = corners.reshape(-1, stride)
        if row.tag not in ("trifans", "tristrips"):
            return corners, triangulate(positions, corners[:, corner], n_corners)[0]
        start = np.repeat(np.cumsum(n_corners) - n_corners, n_triangles)
        k = np.arange(len(start)) - np.repeat(np.cumsum(n_triangles) - n_triangles, n_triangles)
        if row.tag == "trifans":
            return corners, np.stack([start, start + k + 1, start + k + 2], axis=1)
        return corners, np.stack([start + k, start + k + 1 + k % 2, start + k + 2 - k % 2], axis=1)

    def _columns(self, url: str, n: int) -> F64:
        """The first n numbers (N, n) of each row of a source; 1 where it has fewer, of positions and normals 0."""
        if url not in self._arrays:
            source = self._at("source", url)
            if source is None:
                raise MeshError("faces name positions that are not there")
            accessor = source.find("technique_common/accessor")
            said = {} if accessor is None else accessor.attrib
            array = self._at("float_array", said.get("source"))
            numbers = _numbers(source.find("float_array") if array is None else array)[int(said.get("offset", 0)) :]
            stride = int(said.get("stride", 1 if said else 3))
            if not 1 <= stride <= 64:
                raise MeshError(f"a source has rows of {stride} numbers")
            self._arrays[url] = numbers[: len(numbers) // stride * stride].reshape(-1, stride)
        found = self._arrays[url][:, :n]
        return np.pad(found, ((0, 0), (0, n - found.shape[1])), constant_values=float(n == 4))

    def _material(self, target: str | None) -> tuple[Material, ...]:
        """The material that a URL names; none, and a note, where there is none."""
        material = self._at("material", target)
        instance = None if material is None else material.find("instance_effect")
        effect = None if instance is None else self._at("effect", instance.get("url"))
        if effect is None:
            self._notes.add("materials that are not there", (target or "").removeprefix("#"))
            return ()
        if effect not in self._materials:
            self._source.budget.spend("max_nodes", 1)
            self._materials[effect] = self._material_of(effect)
        return (self._materials[effect],)

    def _material_of(self, effect: Element) -> Material:
        shader = next((row for row in effect.iter() if row.tag in SHADERS), None)
        if shader is None:
            self._notes.add("effects that are not read", effect.get("id", ""))
            return Material()
        params = {row.get("sid"): row for row in effect.iter("newparam")}
        if effect.find(".//bump") is not None:
            self._notes.add("bump maps not drawn")
        is_flat = shader.tag == "constant"
        base = "emission" if is_flat else "diffuse"
        color, picture = self._slot(shader, base, params)
        light, glow = (None, None) if is_flat else self._slot(shader, "emission", params)
        (specular, _), (shininess, _) = (self._slot(shader, name, params) for name in ("specular", "shininess"))
        if specular is None or shininess is None or shininess[0] <= 0:
            specular, shininess = np.zeros(1), np.zeros(1)
        opacity, mask = self._opacity(shader, params)
        if mask is not None and mask is not picture:
            self._notes.add("opacity of textures that are not those of the colour not drawn")
        is_clear = opacity < 1 or (mask is not None and mask is picture and mask[..., 3].min() < 255)
        emission = np.zeros(3) if light is None else decode_srgb(np.maximum(_rgba(light)[:3], 0))
        return Material(
            None if color is None or picture is not None else _color(color),
            self._texture(picture, *_wraps(shader, base, params)),
            specular=float(np.mean(specular[:3]).clip(0, 1)),
            shininess=float(shininess[0]),
            unlit=is_flat,
            opacity=opacity,
            alpha_mode="blend" if is_clear else "opaque",
            double_sided=next((row.text or "" for row in effect.iter("double_sided")), "").strip() != "0",
            emission=tuple((np.ones(3) if glow is not None else emission).tolist()),
            emission_texture=self._texture(glow, *_wraps(shader, "emission", params)),
        )

    def _opacity(self, shader: Element, params: dict[str | None, Element]) -> tuple[float, U8 | None]:
        """The opacity of an effect, and a picture of it; 1, and a note, for 0: files say it of opaque materials."""
        row = shader.find("transparent")
        (color, picture), (factor, _) = (self._slot(shader, name, params) for name in ("transparent", "transparency"))
        if color is None and factor is None:
            return 1.0, picture
        mode = "A_ONE" if row is None else row.get("opaque", "A_ONE")
        rgba = np.ones(4) if color is None else _rgba(color)
        share = float(rgba[3] if mode.startswith("A") else engine.product(LUMINANCE[None], rgba[:3])[0])
        share *= 1.0 if factor is None else float(factor[0])
        opacity = min(max(share if mode.endswith("ONE") else 1 - share, 0.0), 1.0)
        if opacity == 0:
            self._notes.add("materials that are wholly transparent, drawn opaque")
        return opacity or 1.0, picture

    def _slot(self, shader: Element, name: str, params: dict[str | None, Element]) -> tuple[F64 | None, U8 | None]:
        """The numbers of a property of a shader, and its picture."""
        numbers = picture = None
        for row in shader.findall(f"{name}/*"):
            if row.tag == "texture":
                picture = self._picture(row.get("texture", ""), params)
            elif row.tag == "param":
                given = params.get(row.get("ref"))
                found = None if given is None else next((one for one in given if one.tag.startswith("float")), None)
                numbers = None if found is None else _numbers(found)
            elif row.tag in ("color", "float"):
                numbers = _numbers(row)
        return None if numbers is None or not len(numbers) else numbers, picture

    def _picture(self, name: str, params: dict[str | None, Element]) -> U8 | None:
        """The picture that a texture names: by a sampler and its surface, or at once."""
        for _ in ("sampler", "surface"):
            for row in params.get(name, Element("")).iter():
                if row.tag in ("source", "init_from") and (row.text or "").strip():
                    name = (row.text or "").strip()
                elif row.tag == "instance_image":
                    name = row.get("url", "").removeprefix("#")
        image = self._at("image", f"#{name}")
        path = name if image is None else image.findtext("init_from/ref") or image.findtext("init_from") or ""
        if not path.strip():
            self._notes.add("images without a file", name)
            return None
        path = path.strip()
        return self._source.picture(path if path[:5].lower() == "file:" else unquote(path))

    def _texture(self, picture: U8 | None, wrap_u: WrapOption, wrap_v: WrapOption) -> Texture | None:
        if picture is None:
            return None
        key = id(picture), wrap_u, wrap_v
        if key not in self._textures:
            may = self._source.may_lay(picture, "")
            self._textures[key] = Texture(picture, wrap=(wrap_u, wrap_v)) if may else None
        return self._textures[key]


def _wraps(shader: Element, name: str, params: dict[str | None, Element]) -> tuple[WrapOption, WrapOption]:
    """The continuation along u and v of the texture of a property of a shader, as its sampler says."""
    row = shader.find(f"{name}/texture")
    sampler = params.get(None if row is None else row.get("texture"))
    along_u, along_v = ((None if sampler is None else sampler.findtext(f".//wrap_{axis}")) or "" for axis in "st")
    return WRAPS.get(along_u.strip(), "repeat"), WRAPS.get(along_v.strip(), "repeat")


def _numbers(row: Element | None) -> F64:
    """The numbers of an element; some programs write decimal commas."""
    return numbers_of_text(((None if row is None else row.text) or "").replace(",", ".").encode())


def _of_length(row: Element, n: int) -> F64:
    values = _numbers(row)
    if len(values) != n:
        raise MeshError(f"a {row.tag} has {len(values)} numbers, not {n}")
    return values


def _rgba(values: F64) -> F64:
    """Red, green, blue and opacity: 1 where they are not said."""
    return np.append(values, np.ones(4))[:4]


def _color(values: F64) -> U8:
    return np.rint(255 * _rgba(values)[:3].clip(0, 1)).astype(np.uint8)


def _transform(node: Element) -> F64:
    """The matrix (4, 4) of the transforms of a node, in their order."""
    place = np.eye(4)
    for row in node:
        if row.tag not in NUMBERS_OF:
            continue
        values, own = _of_length(row, NUMBERS_OF[row.tag]), np.eye(4)
        match row.tag:
            case "matrix":
                own = values.reshape(4, 4)
            case "translate":
                own[:3, 3] = values
            case "scale":
                own[:3, :3] = np.diag(values)
            case "rotate":
                radians = math.radians(values[3]) / (engine.length(values[:3]) or 1.0)
                own[:3, :3] = rotation_of_vector(values[:3] * radians)
            case "lookat":
                eye, target, up = values.reshape(3, 3)
                back, right = eye - target, np.cross(up, eye - target)
                own[:3, :3] = unit_or_zero(np.stack([right, np.cross(back, right), back])).T
                own[:3, 3] = eye
            case "skew":
                own[:3, :3] += _skew(values)
        place = engine.product(place, own)
    return place


def _skew(values: F64) -> F64:
    """What a skew adds to the identity (3, 3): it turns the first axis by an angle towards the second."""
    turned, along = values[1:4], unit_or_zero(values[None, 4:])[0]
    (x,) = engine.product(turned[None], along)
    across = turned - x * along
    y = engine.length(across)
    if y == 0:
        raise MeshError("a skew has two axes of one direction")
    cosine, sine = engine.cosine_and_sine(values[0])
    share = (x * cosine + y * sine) / (y * cosine - x * sine) - x / y
    return share * along[:, None] * across / y
