"""Reads glTF 2.0 and GLB: nodes, meshes, materials, skins, morph targets, cameras; at rest or at a time.

Input: a file, unchecked. Output: `Mesh` parts in the order of the nodes, placed in the world; poses of cameras.

The format is JSON and arrays, so `json`, NumPy and Pillow read it: pygltflib would give the same JSON as classes,
and trimesh leaves out most fields of a material.

Based on: Khronos Group, "glTF 2.0 Specification", 2021.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, Array
from topleft._core.base.color import encode_srgb
from topleft._meshes.io.gltf.accessors import Accessors, Tree, entry, normalized
from topleft._meshes.io.gltf.animations import chosen, length_of, n_targets_of, posed
from topleft._meshes.io.gltf.draco import DracoSize, declared_by_draco
from topleft._meshes.io.gltf.materials import Materials
from topleft._meshes.io.references import Cloud, InputFile
from topleft._meshes.model.joined import placed_arrays
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.normals import moved
from topleft.errors import MeshError, MissingPackageError

JSON_CHUNK, BIN_CHUNK = 0x4E4F534A, 0x004E4942
POINTS, TRIANGLES, STRIP, FAN = 0, 4, 5, 6
N_FLAT_AT_ONCE = 1 << 16
"""Triangles whose normals are computed together: 10 MB."""

NEXT, LAST = [1, 2, 0], [2, 0, 1]
DRACO_VERTEX_BYTES = 64
"""Attributes of Draco that have more than so many bytes a vertex count as further vertices: 0.5 GB at most, in 2 s."""

READ_EXTENSIONS = frozenset({
    "EXT_mesh_gpu_instancing", "EXT_texture_avif", "EXT_texture_webp", "KHR_draco_mesh_compression",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness", "KHR_materials_unlit", "KHR_mesh_quantization", "KHR_texture_transform",
})  # fmt: skip

WITHOUT_LOOK = (
    "KHR_xmp", "FB_ngon_", "EXT_structural_", "EXT_mesh_features", "EXT_instance_features", "KHR_physics_",
    "OMI_physics_", "KHR_materials_variants", "EXT_meshopt_compression", "KHR_meshopt_compression",
)  # fmt: skip
"""Beginnings of the names of extensions that files may use without a note, as the look without them is right."""


@dataclass(frozen=True)
class CameraOfFile:
    """A camera of a glTF file."""

    world_from_eye: F64
    """(4, 4): the eye axes are the axes of OpenGL."""

    kind: str
    """"perspective" or "orthographic"."""

    numbers: dict[str, float]
    """`yfov` (radians) or `xmag` and `ymag`; `znear` and, unless it is infinite, `zfar`."""


def read_gltf(source: InputFile) -> list[Mesh]:
    """The parts of a glTF or GLB file, as its nodes place them.

    A `MeshError` if the file is broken or needs an extension that is not read.
    """
    tree, blob = _tree_and_blob(source)
    for name in tree.get("extensionsUsed", []):
        if name not in READ_EXTENSIONS and not str(name).startswith(WITHOUT_LOOK):
            source.notes.add("extensions not read", str(name))
    accessors = Accessors(tree, blob, source)
    if source.moment is not None:
        tree = posed(tree, accessors, source.moment, source)
    elif tree.get("animations"):
        source.notes.add("animations not played: everything is at rest")
    return list(_Reader(tree, accessors, Materials(tree, accessors, source), source).parts())


def read_length(source: InputFile, clip: int | str | None) -> float | None:
    """The seconds of an animation of a glTF or GLB file; None of a file without animations."""
    tree, blob = _tree_and_blob(source)
    if not tree.get("animations"):
        return None
    return length_of(chosen(tree, tree["animations"], clip, source), Accessors(tree, blob, source), source)


def read_cameras(source: InputFile) -> list[CameraOfFile]:
    """The cameras of a glTF or GLB file, in the order of the nodes that hold them."""
    tree, blob = _tree_and_blob(source)
    if source.moment is not None:
        tree = posed(tree, Accessors(tree, blob, source), source.moment, source)
    nodes = _Nodes(tree)
    cameras = []
    for index in nodes.shown():
        node = entry(tree, "nodes", index)
        if "camera" in node:
            source.budget.spend("max_nodes", 1)
            row = entry(tree, "cameras", node["camera"])
            kind = row.get("type")
            if kind not in ("perspective", "orthographic"):
                raise MeshError(f"cameras[{node['camera']}] is of type {kind!r}")
            numbers = {name: float(value) for name, value in row[kind].items() if isinstance(value, int | float)}
            cameras.append(CameraOfFile(nodes.matrix(index), kind, numbers))
    return cameras


def _tree_and_blob(source: InputFile) -> tuple[Tree, bytes | None]:
    """The JSON of the file, and the binary chunk of a GLB."""
    import json  # here, as the package is imported by many that read no glTF

    content, blob = source.content(), None
    if content[:4] == b"glTF":
        content, blob = _chunks(content, source)
    try:
        tree = json.loads(content.decode("utf-8-sig"))
    except RecursionError:
        raise MeshError("its JSON is nested too deeply") from None
    if not isinstance(tree, dict):
        raise MeshError("its JSON is no object")
    asset = tree.get("asset")
    asset = asset if isinstance(asset, dict) else {}
    version, needed = str(asset.get("version", "")), str(asset.get("minVersion", "2.0"))
    if version.startswith("1") or (not version and isinstance(tree.get("meshes"), dict)):
        raise _glTF1(source)
    if not version.startswith("2"):
        raise MeshError(f"cannot read {str(source.path)!r}: its version of glTF is {version[:20]!r}, and 2.0 is read")
    if needed not in ("2.0", "2") and not needed.startswith("1."):
        raise MeshError(f"cannot read {str(source.path)!r}: it needs version {needed[:20]!r} of glTF, and 2.0 is read")
    for name in tree.get("extensionsRequired", []):
        if name not in READ_EXTENSIONS:
            raise MeshError(
                f"cannot read {str(source.path)!r}: it needs the extension {str(name)[:80]}, which is not read"
            )
    return tree, blob


def _glTF1(source: InputFile) -> MeshError:  # noqa: N802
    return MeshError(
        f"cannot read {str(source.path)!r}: it is glTF 1.0, and 2.0 is read: convert it, by gltf-pipeline say"
    )


def _chunks(content: bytes, source: InputFile) -> tuple[bytes, bytes | None]:
    if len(content) < 20:
        raise MeshError("it ends within its header")
    _, version, length = struct.unpack_from("<III", content)
    if version == 1:
        raise _glTF1(source)
    if version != 2 or length > len(content):
        raise MeshError(f"it has {len(content)} of {length} bytes, of GLB version {version}")
    text: bytes | None = None
    blob: bytes | None = None
    start = 12
    while start + 8 <= length:
        size, kind = struct.unpack_from("<II", content, start)
        if start + 8 + size > length:
            raise MeshError("a chunk of it ends beyond its end")
        if kind == JSON_CHUNK and text is None:
            text = content[start + 8 : start + 8 + size]
        elif kind == BIN_CHUNK and blob is None:
            blob = content[start + 8 : start + 8 + size]
        start += 8 + size
    if text is None:
        raise MeshError("it has no JSON")
    return text, blob


class _Nodes:
    """The nodes of a file: a forest, in which each has a matrix to the world."""

    def __init__(self, tree: Tree) -> None:
        self._tree = tree
        rows = tree.get("nodes", [])
        n_nodes = len(rows)
        self._children = [list(entry(tree, "nodes", i).get("children", [])) for i in range(n_nodes)]
        self._parent: dict[int, int] = {}
        for i, children in enumerate(self._children):
            for child in children:
                entry(tree, "nodes", child)
                if child in self._parent:
                    raise MeshError(f"nodes[{child}] has two parents")
                self._parent[child] = i
        self._matrices: dict[int, F64] = {}

    def shown(self) -> Iterator[int]:
        """Nodes of the scene that the file shows, parents first, in its order."""
        if self._tree.get("scenes"):
            roots = entry(self._tree, "scenes", self._tree.get("scene", 0)).get("nodes", [])
        else:
            roots = [i for i in range(len(self._children)) if i not in self._parent]
        seen: set[int] = set()
        stack = list(reversed(roots))
        while stack:
            index = stack.pop()
            entry(self._tree, "nodes", index)
            if index in seen:
                raise MeshError(f"nodes[{index}] is below itself, or shown twice")
            seen.add(index)
            yield index
            stack.extend(reversed(self._children[index]))

    def matrix(self, index: int) -> F64:
        """World from the space of a node, (4, 4)."""
        chain = []
        at: int | None = index
        while at is not None and at not in self._matrices:
            chain.append(at)
            if len(chain) > len(self._children):
                raise MeshError(f"nodes[{index}] is below itself")
            at = self._parent.get(at)
        world = np.eye(4) if at is None else self._matrices[at]
        for at in reversed(chain):
            world = self._matrices[at] = engine.product(world, local_matrix(entry(self._tree, "nodes", at)))
        return world


def local_matrix(node: Tree) -> F64:
    """Parent from node, (4, 4)."""
    if "matrix" in node:
        return np.asarray(node["matrix"], np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    if "rotation" in node:
        matrix[:3, :3] = rotations(np.asarray([node["rotation"]], np.float64))[0]
    if "scale" in node:
        matrix[:3, :3] *= np.asarray(node["scale"], np.float64).reshape(3)
    if "translation" in node:
        matrix[:3, 3] = np.asarray(node["translation"], np.float64).reshape(3)
    return matrix


def rotations(quaternions: F64) -> F64:
    """Matrices (N, 3, 3) of quaternions (N, 4), x y z w, of any length."""
    squared = (quaternions**2).sum(axis=1)
    x, y, z, w = (quaternions / np.sqrt(np.where(squared > 0, squared, 1))[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


@dataclass(frozen=True)
class _Shape:
    """The vertices and triangles of a primitive, in the space of its mesh or, moved by a skin, in the world."""

    positions: Array
    triangles: Array
    normals: Array | None
    colors: Array | None
    """(V, 4) float, linear light."""
    uv: Array | None
    uv1: Array | None


class _Reader:
    def __init__(self, tree: Tree, accessors: Accessors, materials: Materials, source: InputFile) -> None:
        self._tree = tree
        self._accessors = accessors
        self._materials = materials
        self._source = source
        self._nodes = _Nodes(tree)
        self._shapes: dict[tuple[int, int], _Shape | None] = {}
        self._skins: dict[int, F64] = {}
        self._count_targets = cache(lambda mesh: n_targets_of(tree, mesh))
        self._meshes_of_draco: dict[int, tuple[DracoSize, Any]] = {}  # by their views

    def parts(self) -> Iterator[Mesh]:
        """The primitives of all nodes, placed."""
        nodes = {i: entry(self._tree, "nodes", i) for i in self._nodes.shown()}
        meshes = [node["mesh"] for node in nodes.values() if "mesh" in node]
        elsewhere = [node for i, node in enumerate(self._tree.get("nodes", ())) if "mesh" in node and i not in nodes]
        for node in elsewhere:
            self._source.notes.add("nodes outside of its scene not drawn", str(node.get("name", "")))
        for i in sorted(set(range(len(self._tree.get("meshes", ())))) - {*meshes, *(one["mesh"] for one in elsewhere)}):
            self._source.notes.add("meshes that no node places not drawn", f"meshes[{i}]")
        sizes = {mesh: len(entry(self._tree, "meshes", mesh)["primitives"]) for mesh in meshes}
        # Reading a primitive takes as long as placing it: too many are refused before the first is read.
        self._source.budget.check("max_nodes", sum(sizes.values()) + sum(sizes[mesh] for mesh in meshes))
        for index, node in nodes.items():
            if "mesh" not in node:
                continue
            mesh = entry(self._tree, "meshes", node["mesh"])
            weights = self._weights(node, mesh)
            places: list[F64] | None = None
            for i, primitive in enumerate(mesh["primitives"]):
                shape = self._shape(node, i, primitive, weights)
                if primitive.get("mode") == POINTS and "POSITION" in primitive["attributes"]:
                    self._add_cloud(primitive, self._nodes.matrix(index))
                if shape is None:
                    self._source.budget.spend("max_nodes", 1)
                    continue
                if places is None:
                    places = self._places(index, node)
                is_skinned = "skin" in node and "JOINTS_0" in primitive["attributes"]
                matrices = [np.eye(4)] if is_skinned else places  # joints place a skin, its node does not
                row = primitive.get("material")
                materials = () if row is None else (self._materials.material(row),)
                for option, count in (
                    ("max_nodes", 1), ("max_vertices", len(shape.positions)), ("max_triangles", len(shape.triangles))
                ):  # fmt: skip
                    self._source.budget.spend(option, len(matrices) * count)
                for matrix in matrices:
                    yield _placed(shape, matrix, materials)

    def _weights(self, node: Tree, mesh: Tree) -> list[float]:
        """The weights of the morph targets of a node; none if all are 0."""
        weights: list[float] = list(node["weights"] if "weights" in node else mesh.get("weights", ()))
        n_targets = self._count_targets(node["mesh"])
        if len(weights) not in (0, n_targets):
            raise MeshError(f"meshes[{node['mesh']}] has {n_targets} morph targets, and {len(weights)} weights")
        self._source.budget.spend("max_vertices", len(weights))
        return weights if any(weights) else []

    def _add_cloud(self, primitive: Tree, matrix: F64) -> None:
        """Keep the points of a primitive, in the colours of its vertices or its material."""
        attributes = primitive["attributes"]
        points = self._accessors.array(attributes["POSITION"])
        if points.shape[1] != 3:
            raise MeshError(f"POSITION has {points.shape[1]} numbers a vertex")
        self._source.budget.spend("max_vertices", len(points))
        colors: npt.NDArray[np.uint8] | None = None
        if "COLOR_0" in attributes:
            light = _light_of_colors(self._accessors.array(attributes["COLOR_0"]))
            colors = _srgb_bytes(light) if len(light) == len(points) else None
        elif "material" in primitive:
            color = self._materials.material(primitive["material"]).color or (255, 255, 255)
            colors = np.tile(np.array([*color, 255], np.uint8), (len(points), 1))
        self._source.clouds.append(Cloud(moved(points, matrix), colors))

    def _places(self, index: int, node: Tree) -> list[F64]:
        """World from mesh: once, or once for each instance."""
        world = self._nodes.matrix(index)
        instancing = node.get("extensions", {}).get("EXT_mesh_gpu_instancing")
        if instancing is None:
            return [world]
        rows = instancing["attributes"]
        given = {
            name: self._accessors.array(rows[name]) for name in ("TRANSLATION", "ROTATION", "SCALE") if name in rows
        }
        n = min(map(len, given.values()), default=0)
        self._source.budget.check("max_nodes", n)
        matrices = np.tile(np.eye(4), (n, 1, 1))
        if "ROTATION" in given:
            matrices[:, :3, :3] = rotations(given["ROTATION"][:n].astype(np.float64))
        if "SCALE" in given:
            matrices[:, :3, :3] *= given["SCALE"][:n, None, :]
        if "TRANSLATION" in given:
            matrices[:, :3, 3] = given["TRANSLATION"][:n]
        return [engine.product(world, matrix) for matrix in matrices]

    def _shape(self, node: Tree, i: int, primitive: Tree, weights: list[float]) -> _Shape | None:
        """The triangles of a primitive, moved by its morph targets and its skin; None if it has none."""
        has_targets = bool(primitive.get("targets") and weights)
        key = (node["mesh"], i)
        skin = node["skin"] if "skin" in node and "JOINTS_0" in primitive["attributes"] else None
        is_shared = not has_targets and skin is None
        if is_shared and key in self._shapes:
            return self._shapes[key]
        self._source.budget.spend("max_nodes", 1)
        attributes = primitive["attributes"]
        mode = primitive.get("mode", TRIANGLES)
        if mode not in (TRIANGLES, STRIP, FAN):
            self._source.notes.add("points not drawn" if mode == POINTS else "lines not drawn")
            return None
        if "POSITION" not in attributes:
            self._source.notes.add("triangles without positions not drawn")
            return None
        uv_sets = (0, 1) if primitive.get("material") is None else self._materials.uv_sets(primitive["material"])
        values, corners = self._arrays(primitive, attributes, uv_sets)
        n = len(values["POSITION"])
        for name, rows in values.items():
            if len(rows) != n:
                raise MeshError(f"{name} has {len(rows)} rows for {n} vertices")
        if has_targets:
            values |= self._morphed(values, primitive["targets"], weights)
        if skin is not None:
            values |= self._skinned(values, attributes, skin)
        triangles = triangles_of(corners, mode)
        if mode == STRIP:  # triangles that are left out take time, too
            self._source.budget.spend("max_triangles", max(0, len(corners) - 2 - len(triangles)))
        shape = _shape_of(values, triangles, uv_sets)
        if is_shared:
            self._shapes[key] = shape
        return shape

    def _morphed(self, values: dict[str, Array], targets: list[Tree], weights: list[float]) -> dict[str, Array]:
        """The attributes that targets move, moved."""
        self._source.budget.spend("max_vertices", len(weights))
        moved: dict[str, Array] = {}
        for weight, target in zip(weights, targets, strict=False):
            if not weight:
                continue
            for name, index in target.items():
                if name in values:
                    self._source.budget.spend("max_nodes", 1)
                    self._source.budget.spend("max_vertices", len(values[name]))
                    delta = self._accessors.array(index)
                    if delta.shape[0] != len(values[name]) or delta.shape[1] > values[name].shape[1]:
                        raise MeshError(f"a morph target of {name} has shape {delta.shape}")
                    sum_ = moved.setdefault(name, values[name].astype(np.float64))
                    sum_[:, : delta.shape[1]] += float(weight) * delta
        return moved

    def _arrays(self, primitive: Tree, attributes: Tree, uv_sets: tuple[int, int]) -> tuple[dict[str, Array], Array]:
        """The attributes of a primitive, and its corners as a list, a strip or a fan."""
        draco = primitive.get("extensions", {}).get("KHR_draco_mesh_compression")
        if draco is not None and "bufferView" not in entry(self._tree, "accessors", attributes["POSITION"]):
            return self._unpacked(draco, attributes)
        used = {*USED_ATTRIBUTES, *(f"TEXCOORD_{number}" for number in uv_sets)}
        values = {name: self._accessors.array(index) for name, index in attributes.items() if name in used}
        if "indices" not in primitive:
            return values, np.arange(len(values["POSITION"]))
        return values, self._accessors.array(primitive["indices"])[:, 0]

    def _unpacked(self, draco: Tree, attributes: Tree) -> tuple[dict[str, Array], Array]:
        """The same of a primitive that Draco has compressed."""
        try:
            import DracoPy
        except ImportError:
            raise MissingPackageError(
                f"{str(self._source.path)!r} is compressed by Draco: reading it needs pip install DracoPy"
            ) from None
        self._source.budget.spend("max_nodes", 1)  # it takes the time of two
        view = draco["bufferView"]
        content = self._accessors.view(view)
        size, mesh = self._meshes_of_draco.get(view) or (declared_by_draco(content.tobytes()), None)
        self._source.budget.check("max_triangles", size.n_triangles)
        n_like = size.n_rows * size.row_bytes // DRACO_VERTEX_BYTES
        self._source.budget.check("max_vertices", max(n_like, size.n_vertices))
        self._source.budget.spend("max_vertices", max(0, n_like - size.n_vertices))
        if mesh is None:
            mesh = DracoPy.decode(content.tobytes())
            self._meshes_of_draco[view] = size, mesh
        self._source.budget.check("max_vertices", len(mesh.points))
        values = {}
        for name, number in draco["attributes"].items():
            if name in attributes:
                rows = np.asarray(mesh.get_attribute_by_unique_id(number)["data"]).reshape(len(mesh.points), -1)
                accessor = entry(self._tree, "accessors", attributes[name])
                if name.startswith("JOINTS"):  # which some files keep as float
                    rows = np.rint(rows).astype(np.int64)
                values[name] = normalized(rows) if accessor.get("normalized") else rows
        return values, np.asarray(mesh.faces).ravel()

    def _joint_matrices(self, skin: Any) -> F64:
        """World from the space of a skinned mesh, for each joint (J, 4, 4); made once for each skin."""
        row = entry(self._tree, "skins", skin)
        if skin in self._skins:
            return self._skins[skin]
        joints = row["joints"]
        self._source.budget.spend("max_nodes", len(joints))
        matrices = np.array([self._nodes.matrix(_checked(self._tree, joint)) for joint in joints])
        if "inverseBindMatrices" in row:
            inverse = self._accessors.array(row["inverseBindMatrices"])
            if inverse.shape[1] != 16 or len(inverse) < len(joints):
                raise MeshError(f"skins[{skin}] has {len(inverse)} inverse bind matrices for {len(joints)} joints")
            bind = inverse[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
            matrices = np.array([engine.product(*pair) for pair in zip(matrices, bind, strict=True)]).reshape(-1, 4, 4)
        self._skins[skin] = matrices
        return matrices

    def _skinned(self, values: dict[str, Array], attributes: Tree, skin: Any) -> dict[str, Array]:
        """Positions and normals moved to where the joints hold them, in the world."""
        matrices = self._joint_matrices(skin)
        n_joints = len(matrices)
        n = len(values["POSITION"])
        blended = np.zeros((n, 3, 4))
        total = np.zeros((n, 1, 1))
        for k in range(len(attributes)):
            if f"JOINTS_{k}" not in attributes or f"WEIGHTS_{k}" not in attributes:
                break
            at, share = (
                values[f"{name}_{k}"] if f"{name}_{k}" in values else self._accessors.array(attributes[f"{name}_{k}"])
                for name in ("JOINTS", "WEIGHTS")
            )
            if at.shape != share.shape or at.dtype.kind not in "iu" or len(at) != n:
                raise MeshError(f"JOINTS_{k} {at.shape} and WEIGHTS_{k} {share.shape} do not go with {n} vertices")
            if at.size and not 0 <= int(at.min()) <= int(at.max()) < n_joints:
                raise MeshError(f"JOINTS_{k} names joint {int(at.max())} of {n_joints}")
            self._source.budget.spend("max_nodes", 1)
            self._source.budget.spend("max_vertices", n)
            for column in range(at.shape[1]):
                weight = share[:, column, None, None].astype(np.float64)
                blended += weight * matrices[at[:, column], :3]
                total += weight
        blended /= np.where(total == 0, 1, total)
        moved = {"POSITION": (blended[:, :, :3] * values["POSITION"][:, None]).sum(axis=2) + blended[:, :, 3]}
        if "NORMAL" in values:
            a, b, c = blended[:, 0, :3], blended[:, 1, :3], blended[:, 2, :3]
            cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
            moved["NORMAL"] = (cofactors * values["NORMAL"][:, None]).sum(axis=2)
        return moved


USED_ATTRIBUTES = ("POSITION", "NORMAL", "COLOR_0")


def _checked(tree: Tree, index: Any) -> int:
    entry(tree, "nodes", index)
    return int(index)


def triangles_of(corners: Array, mode: int) -> Array:
    """The triangles (T, 3) of a list, a strip or a fan of corners; triangles of a strip turn all one way."""
    if mode == TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if len(corners) < 3:
        return np.zeros((0, 3), corners.dtype)
    if mode == FAN:
        return np.stack([np.full(len(corners) - 2, corners[0]), corners[1:-1], corners[2:]], axis=1)
    triangles = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    triangles[1::2] = triangles[1::2, [1, 0, 2]]
    a, b, c = triangles.T
    return triangles[(a != b) & (b != c) & (a != c)]  # triangles that turn a strip round have no area


def _shape_of(values: dict[str, Array], triangles: Array, uv_sets: tuple[int, int]) -> _Shape | None:
    if not len(triangles):
        return None
    uv, uv1 = (f"TEXCOORD_{number}" for number in uv_sets)
    for name, n_columns in (("POSITION", (3,)), ("NORMAL", (3,)), ("COLOR_0", (3, 4)), (uv, (2,)), (uv1, (2,))):
        if name in values and values[name].shape[1] not in n_columns:
            raise MeshError(f"{name} has {values[name].shape[1]} numbers a vertex")
    normals, colors = values.get("NORMAL"), values.get("COLOR_0")
    shape = _Shape(values["POSITION"], triangles, normals, colors, values.get(uv), values.get(uv1))
    shape = _flat(shape) if normals is None else shape  # first, as it leaves out the colours of unused vertices
    return shape if shape.colors is None else replace(shape, colors=_light_of_colors(shape.colors))


def _light_of_colors(colors: Array) -> Array:
    """Linear light and opacity (V, 4) of COLOR_0."""
    if colors.dtype.kind != "f":  # which should say that it is normalized
        colors = colors / np.iinfo(colors.dtype).max
    if colors.shape[1] not in (3, 4):
        raise MeshError(f"COLOR_0 has {colors.shape[1]} numbers a vertex")
    return colors if colors.shape[1] == 4 else np.column_stack([colors, np.ones(len(colors))])


def _flat(shape: _Shape) -> _Shape:
    """Each triangle with three unshared vertices and the normal of its plane, as the standard says."""
    at = shape.triangles.ravel()
    if at.size and int(at.max()) >= len(shape.positions):
        raise MeshError(f"a triangle names vertex {int(at.max())} of {len(shape.positions)}")
    positions = shape.positions[at]
    normals = np.empty((len(at), 3), np.float32)
    for first in range(0, len(at), 3 * N_FLAT_AT_ONCE):
        rows = slice(first, first + 3 * N_FLAT_AT_ONCE)
        a, b, c = (positions[rows][corner::3].astype(np.float64) for corner in range(3))
        u, v = b - a, c - a  # their product is taken here, for np.cross takes a third of the time of a small part
        across = u[:, NEXT] * v[:, LAST] - u[:, LAST] * v[:, NEXT]
        length = np.sqrt((across**2).sum(axis=1, keepdims=True))
        normals[rows] = (across / np.where(length > 0, length, 1)).astype(np.float32).repeat(3, axis=0)
    colors, uv, uv1 = (None if rows is None else rows[at] for rows in (shape.colors, shape.uv, shape.uv1))
    return _Shape(positions, np.arange(len(at), dtype=np.int32).reshape(-1, 3), normals, colors, uv, uv1)


def _placed(shape: _Shape, matrix: F64, materials: tuple[Any, ...]) -> Mesh:
    """A primitive in the world."""
    own = placed_arrays(shape.positions, shape.triangles, shape.normals, matrix)
    colors = None if shape.colors is None else _srgb_bytes(shape.colors)
    uv, uv1 = (None if rows is None else _upwards(rows) for rows in (shape.uv, shape.uv1))
    return Mesh(*own, colors, uv, materials, None, uv1, color_interpolation="linear")


def _upwards(uv: Array) -> Array:
    """Texture coordinates with v from the bottom; also of whole numbers, as quantized files have them."""
    rows = uv if uv.dtype.kind == "f" else uv.astype(np.float32)  # 16 bits are exact in it
    return np.column_stack([rows[:, 0], 1 - rows[:, 1]])


def _srgb_bytes(colors: Array) -> npt.NDArray[np.uint8]:
    """SRGB bytes of linear red, green and blue; opacity stays linear."""
    values = np.nan_to_num(colors.astype(np.float64)).clip(0, 1)
    values[:, :3] = encode_srgb(values[:, :3])
    return np.rint(255 * values).astype(np.uint8)
