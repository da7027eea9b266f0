"""Scenes of pyrender: primitives in meshes, meshes, lights and cameras in nodes, nodes in a tree with poses.

Input: arrays, `trimesh.Trimesh`, poses. Output: `Scene`, which the renderer walks.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

import topleft as tl
from topleft.compat._arrays import F64, moved, product, srgb_bytes
from topleft.compat.pyrender.values import (
    GLTF,
    Camera,
    DirectionalLight,
    Light,
    MetallicRoughnessMaterial,
    PointLight,
    SpotLight,
    Texture,
    as_rgb,
)

DEFAULT_MATERIAL: dict[str, Any] = {"alphaMode": "BLEND", "metallicFactor": 0.2, "roughnessFactor": 0.8}
WRAPS = {GLTF.REPEAT: "repeat", GLTF.CLAMP_TO_EDGE: "clamp", GLTF.MIRRORED_REPEAT: "mirror"}
NEAREST = (GLTF.NEAREST, GLTF.NEAREST_MIPMAP_NEAREST)


class Box:
    """The box round something, and what follows from it; `bounds` is (2, 3)."""

    bounds: F64

    @property
    def centroid(self) -> F64:
        """The middle of the box, (3,)."""
        return self.bounds.mean(axis=0)

    @property
    def extents(self) -> F64:
        """The sides of the box, (3,)."""
        return self.bounds[1] - self.bounds[0]

    @property
    def scale(self) -> float:
        """The diagonal of the box."""
        return float(np.sqrt((self.extents**2).sum()))


class Primitive(Box):
    """Triangles or points with one material.

    Parameters
    ----------
    positions : (V, 3) float
    normals : (V, 3) float, optional
    tangents : (V, 4) float, optional
        Kept; not read.
    texcoord_0, texcoord_1 : (V, 2) float, optional
    color_0 : (V, 3) or (V, 4) float, optional
        Linear, 0 to 1.
    joints_0, weights_0, targets : optional
        Kept; not read.
    indices : (T, 3) int, optional
    material : MetallicRoughnessMaterial, optional
    mode : int
        One of `GLTF`; lines are not drawn.
    poses : (N, 4, 4) float, optional
        Where it stands, as often as there are poses.
    """

    def __init__(
        self, positions: Any, normals: Any = None, tangents: Any = None, texcoord_0: Any = None, texcoord_1: Any = None,
        color_0: Any = None, joints_0: Any = None, weights_0: Any = None, indices: Any = None, material: Any = None,
        mode: int | None = None, targets: Any = None, poses: Any = None,
    ) -> None:  # fmt: skip
        self.mode = GLTF.TRIANGLES if mode is None else int(mode)
        if not GLTF.POINTS <= self.mode <= GLTF.TRIANGLE_FAN:
            raise ValueError(f"mode must be one of GLTF, 0 to 6, got {mode!r}")
        self.positions = np.asarray(positions, np.float64).reshape(-1, 3)
        self.normals, self.tangents = normals, tangents
        self.texcoord_0, self.texcoord_1 = texcoord_0, texcoord_1
        self.color_0, self.joints_0, self.weights_0 = color_0, joints_0, weights_0
        self.indices = None if indices is None else np.asarray(indices)
        self.material, self.targets, self.poses = material, targets, poses

    def __setattr__(self, name: str, value: Any) -> None:
        if name in ("normals", "tangents", "texcoord_0", "texcoord_1") and value is not None:
            value = np.asarray(value, np.float64)
            if value.ndim != 2 or len(value) != len(self.positions) or value.shape[1] < 2:
                raise ValueError(
                    f"{name} must have a row for each of {len(self.positions)} positions, got {value.shape}"
                )
        elif name == "color_0" and value is not None:
            value = np.asarray(value)
            value = value / 255.0 if value.dtype.kind in "iu" else value.astype(np.float64)
            if value.ndim != 2 or len(value) != len(self.positions) or value.shape[1] not in (3, 4):
                raise ValueError(f"color_0 must have shape ({len(self.positions)}, 3 or 4), got {value.shape}")
        elif name == "material":
            value = MetallicRoughnessMaterial() if value is None else value
            if not isinstance(value, MetallicRoughnessMaterial):
                raise TypeError(f"material must be a MetallicRoughnessMaterial, got {type(value).__name__}")
        elif name == "poses" and value is not None:
            value = np.asarray(value, np.float64)
            value = value[None] if value.ndim == 2 else value
            if value.ndim != 3 or value.shape[1:] != (4, 4):
                raise ValueError(f"poses must have shape (N, 4, 4), got {value.shape}")
        vars(self).pop("_drawn", None)
        super().__setattr__(name, value)

    @property
    def bounds(self) -> F64:  # type: ignore[override]
        """The box round all of it where it stands, (2, 3)."""
        if not len(self.positions):
            return np.zeros((2, 3))
        corners = np.array(np.meshgrid(*np.stack([self.positions.min(0), self.positions.max(0)], 1))).reshape(3, -1).T
        places = [corners] if self.poses is None else [moved(corners, pose) for pose in self.poses]
        points = np.concatenate(places)
        return np.stack([points.min(axis=0), points.max(axis=0)])

    @property
    def is_transparent(self) -> bool:
        """Whether something may show through."""
        has_alpha = self.color_0 is not None and self.color_0.shape[1] == 4 and bool((self.color_0[:, 3] < 1).any())
        return self.material.is_transparent or has_alpha

    def drawn(self) -> tl.Mesh | tl.Points:
        """What topleft draws of it; made once."""
        own: tl.Mesh | tl.Points
        if "_drawn" not in vars(self):
            colors = None if self.color_0 is None else srgb_bytes(self.color_0)
            if colors is not None and colors.shape[1] == 4:
                colors[:, 3] = np.rint(255 * np.clip(self.color_0[:, 3], 0, 1))
            if self.mode == GLTF.POINTS:
                own = tl.Points(self.positions, None if colors is None else colors[:, :3], shape="square")
            else:
                own = tl.Mesh(
                    self.positions, self.triangles(), self.normals, colors, uv=self.texcoord_0, uv1=self.texcoord_1,
                    color_interpolation="linear",
                )  # fmt: skip
            vars(self)["_drawn"] = own
        own = vars(self)["_drawn"]
        return own

    def triangles(self) -> npt.NDArray[np.integer[Any]]:
        """The corners of its triangles, (T, 3); strips and fans are taken apart."""
        flat = np.arange(len(self.positions)) if self.indices is None else self.indices.reshape(-1)
        if self.mode == GLTF.TRIANGLES:
            return flat[: len(flat) // 3 * 3].reshape(-1, 3)
        k = np.arange(max(len(flat) - 2, 0))
        if self.mode == GLTF.TRIANGLE_FAN:
            return flat[np.stack([0 * k, k + 1, k + 2], axis=1)]
        odd = k % 2
        return flat[np.stack([k, k + 1 + odd, k + 2 - odd], axis=1)]


class Mesh(Box):
    """Primitives that stand together.

    Parameters
    ----------
    primitives : list of Primitive
    name, weights : optional
    is_visible : bool
    """

    def __init__(self, primitives: Any, name: Any = None, weights: Any = None, is_visible: bool = True) -> None:
        self.primitives, self.weights, self.is_visible = primitives, weights, is_visible
        self.name = None if name is None else str(name)

    @property
    def bounds(self) -> F64:  # type: ignore[override]
        """The box round all primitives, (2, 3)."""
        return box_of(own.bounds for own in self.primitives)

    @property
    def is_transparent(self) -> bool:
        """Whether something may show through."""
        return any(own.is_transparent for own in self.primitives)

    @staticmethod
    def from_points(
        points: Any, colors: Any = None, normals: Any = None, is_visible: bool = True, poses: Any = None
    ) -> Mesh:
        """The mesh of a cloud of points (N, 3), with colours (N, 3) of 0 to 1."""
        own = Primitive(points, normals=normals, color_0=colors, mode=GLTF.POINTS, poses=poses)
        return Mesh([own], is_visible=is_visible)

    @staticmethod
    def from_trimesh(
        mesh: Any, material: Any = None, is_visible: bool = True, poses: Any = None, wireframe: bool = False,
        smooth: bool = True,
    ) -> Mesh:  # fmt: skip
        """The mesh of a `trimesh.Trimesh`, or of several.

        Parameters
        ----------
        mesh : trimesh.Trimesh, or a sequence of them
        material : MetallicRoughnessMaterial, optional
            Instead of their own.
        is_visible : bool
        poses : (N, 4, 4), optional
        wireframe : bool
            Kept; not drawn.
        smooth : bool
            Whether normals are those of vertices; otherwise each face has its own.
        """
        meshes = [mesh] if hasattr(mesh, "faces") else list(mesh) if isinstance(mesh, list | tuple | set) else None
        if meshes is None:
            raise TypeError(f"mesh must be a trimesh.Trimesh or a list of them, got {type(mesh).__name__}")
        primitives = []
        for one in meshes:
            colors, uv, own = looks_of(one, material, smooth)
            own = (
                MetallicRoughnessMaterial(**DEFAULT_MATERIAL, baseColorFactor=[0.3, 0.3, 0.3, 1])
                if own is None
                else own
            )
            own.wireframe = wireframe
            if smooth:
                corners, normals, indices = np.asarray(one.vertices), np.asarray(one.vertex_normals), one.faces
            else:
                rows = np.asarray(one.faces).reshape(-1)
                corners, normals = np.asarray(one.vertices)[rows], np.repeat(one.face_normals, 3, axis=0)
                uv, indices = None if uv is None else uv[rows], None
            primitives.append(
                Primitive(corners, normals, texcoord_0=uv, color_0=colors, indices=indices, material=own, poses=poses)
            )
        return Mesh(primitives, is_visible=is_visible)


def looks_of(mesh: Any, material: Any, smooth: bool) -> tuple[Any, Any, Any]:
    """Colours of the vertices, or of all corners of faces, texture coordinates of the vertices, and the material."""
    visual = mesh.visual
    if not visual.defined:
        return None, None, copy.deepcopy(material)
    if material is None and visual.kind in ("vertex", "face"):
        if visual.kind == "face" and smooth:
            raise ValueError("a smooth mesh takes no colours of faces: smooth=False")
        if visual.kind == "face":
            colors = np.repeat(visual.face_colors, 3, axis=0)
        else:
            colors = np.asarray(visual.vertex_colors)
            colors = colors if smooth else colors[np.asarray(mesh.faces).reshape(-1)]
        return colors, None, MetallicRoughnessMaterial(**DEFAULT_MATERIAL)
    if visual.kind != "texture":
        return None, None, copy.deepcopy(material)
    uv = visual.uv if visual.uv is not None and len(visual.uv) else None
    return None, uv, material_of(visual.material) if material is None else copy.deepcopy(material)


def material_of(own: Any) -> MetallicRoughnessMaterial:
    """The material of one of trimesh, PBRMaterial or SimpleMaterial."""
    if isinstance(own, MetallicRoughnessMaterial):
        return own
    if not hasattr(own, "baseColorTexture"):
        shine = own.kwargs.get("Ns", 1.0)
        shine = float(shine[0]) if isinstance(shine, list | tuple | np.ndarray) else float(shine)
        return MetallicRoughnessMaterial(
            alphaMode="BLEND", roughnessFactor=math.sqrt(math.sqrt(2 / (shine + 2))), baseColorFactor=own.diffuse,
            baseColorTexture=own.image,
        )  # fmt: skip
    names = (
        "normalTexture", "occlusionTexture", "emissiveTexture", "emissiveFactor", "baseColorFactor", "baseColorTexture",
        "metallicFactor", "roughnessFactor", "metallicRoughnessTexture", "alphaCutoff",
    )  # fmt: skip
    return MetallicRoughnessMaterial(
        alphaMode="BLEND", doubleSided=bool(own.doubleSided), **{name: getattr(own, name) for name in names}
    )


def material_drawn(own: MetallicRoughnessMaterial, *, flat: bool) -> tl.Material:
    """The material as topleft has it, made anew when something of it has changed; `flat`: numbers are colours."""
    values = [value for name, value in sorted(vars(own).items()) if name != "_drawn"]
    key = (flat, *(tuple(value.tolist()) if isinstance(value, np.ndarray) else value for value in values))
    kept = vars(own).get("_drawn")
    if kept is None or kept[0] != key:
        kept = vars(own)["_drawn"] = key, made_material(own, flat=flat)
    made: tl.Material = kept[1]
    return made


def made_material(own: MetallicRoughnessMaterial, *, flat: bool) -> tl.Material:
    """The material as topleft has it."""
    rgb = own.baseColorFactor[:3]
    color = np.rint(255 * np.clip(rgb, 0, 1)).astype(np.uint8) if flat else srgb_bytes(rgb)
    is_gloss = own.metallicRoughnessTexture is not None
    emission = tuple(own.emissiveFactor.tolist())
    return tl.Material(
        color=color,
        texture=texture_drawn(own.baseColorTexture),
        opacity=float(np.clip(own.baseColorFactor[3], 0, 1)),
        alpha_mode="blend" if own.alphaMode == "BLEND" else "mask" if own.alphaMode == "MASK" else "opaque",
        alpha_cutoff=own.alphaCutoff if own.alphaMode == "MASK" else None,
        double_sided=own.doubleSided,
        emission=emission,
        emission_texture=texture_drawn(own.emissiveTexture),
        metallic=min(own.metallicFactor, 1.0),
        roughness=min(own.roughnessFactor, 1.0),
        metallic_roughness_texture=texture_drawn(own.metallicRoughnessTexture, "linear") if is_gloss else None,
        occlusion_texture=texture_drawn(own.occlusionTexture, "linear"),
        normal_texture=texture_drawn(own.normalTexture, "linear"),
    )


def texture_drawn(own: Texture | None, encoding: Any = "srgb") -> tl.Texture | None:
    """The texture as topleft has it; made once."""
    if own is None or own.source is None:
        return None
    kept = vars(own).setdefault("_drawn", {})
    if encoding not in kept:
        sampler = own.sampler
        wrap: Any = tuple(WRAPS.get(one, "repeat") for one in (sampler.wrapS, sampler.wrapT))
        look: Any = "pixelated" if sampler.magFilter in NEAREST else "trilinear"
        kept[encoding] = tl.Texture(own.source, filter=look, wrap=wrap, encoding=encoding)
    made: tl.Texture = kept[encoding]
    return made


def box_of(boxes: Iterable[F64]) -> F64:
    """The box round boxes (2, 3); of none a point at the origin."""
    all_boxes = np.array(list(boxes)).reshape(-1, 2, 3)
    if not len(all_boxes):
        return np.zeros((2, 3))
    return np.stack([all_boxes[:, 0].min(axis=0), all_boxes[:, 1].max(axis=0)])


class Node:
    """A place in the tree of a scene, with a mesh, a camera or a light.

    Parameters
    ----------
    name : str, optional
    camera, light, mesh : optional
    skin, weights : optional
        Kept; not read.
    children : list of Node, optional
    matrix : (4, 4) float, optional
        Parent from node, with last row [0, 0, 0, 1]; or `rotation`, a quaternion (x, y, z, w) of length 1, `scale`
        (3,) and `translation` (3,).
    """

    def __init__(
        self, name: Any = None, camera: Any = None, children: Any = None, skin: Any = None, matrix: Any = None,
        mesh: Any = None, rotation: Any = None, scale: Any = None, translation: Any = None, weights: Any = None,
        light: Any = None,
    ) -> None:  # fmt: skip
        self.name, self.skin, self.weights = name, skin, weights
        self.children: list[Node] = [] if children is None else children
        self.camera, self.mesh, self.light = camera, mesh, light
        self._matrix: F64 | None = None
        self._rotation, self._scale, self._translation = np.array([0.0, 0, 0, 1]), np.ones(3), np.zeros(3)
        if matrix is not None:
            self.matrix = matrix
            return
        for part, value in (("rotation", rotation), ("scale", scale), ("translation", translation)):
            if value is not None:
                setattr(self, part, value)

    def __setattr__(self, name: str, value: Any) -> None:
        kinds: dict[str, type] = {"camera": Camera, "mesh": Mesh, "light": Light}
        if name in kinds and not (value is None or isinstance(value, kinds[name])):
            raise TypeError(f"{name} must be a {kinds[name].__name__}, got {type(value).__name__}")
        super().__setattr__(name, value)

    @property
    def matrix(self) -> F64:
        """Parent from node, (4, 4): a copy."""
        if self._matrix is None:
            self._matrix = np.eye(4)
            self._matrix[:3, :3] = rotation_of(self._rotation) * self._scale
            self._matrix[:3, 3] = self._translation
        return self._matrix.copy()

    @matrix.setter
    def matrix(self, value: Any) -> None:
        matrix = np.asarray(value, np.float64)
        if matrix.shape != (4, 4) or not np.allclose(matrix[3], [0, 0, 0, 1]):
            raise ValueError(f"matrix must have shape (4, 4) and the last row [0, 0, 0, 1], got {value!r}")
        self._matrix = matrix.copy()
        self._scale = np.sqrt((matrix[:3, :3] ** 2).sum(axis=0))
        self._rotation = quaternion_of(matrix[:3, :3] / np.where(self._scale > 0, self._scale, 1))
        self._translation = matrix[:3, 3].copy()

    def _set(self, name: str, value: Any, n: int) -> None:
        array = np.array(value, np.float64)
        if array.shape != (n,):
            raise ValueError(f"{name} must have shape ({n},), got {array.shape}")
        if n == 4 and abs((array**2).sum() - 1) > 2e-3:
            raise ValueError(f"rotation must be a quaternion of length 1, got {value!r}")
        super().__setattr__(f"_{name}", array)
        self._matrix = None

    @property
    def rotation(self) -> F64:
        """A quaternion (x, y, z, w)."""
        return self._rotation

    @rotation.setter
    def rotation(self, value: Any) -> None:
        self._set("rotation", value, 4)

    @property
    def scale(self) -> F64:
        """(3,): along each axis."""
        return self._scale

    @scale.setter
    def scale(self, value: Any) -> None:
        self._set("scale", value, 3)

    @property
    def translation(self) -> F64:
        """(3,): where it stands in its parent."""
        return self._translation

    @translation.setter
    def translation(self, value: Any) -> None:
        self._set("translation", value, 3)


def rotation_of(quaternion: F64) -> F64:
    """The rotation (3, 3) of a quaternion (x, y, z, w) of length 1."""
    x, y, z, w = quaternion.tolist()
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def quaternion_of(rotation: F64) -> F64:
    """The quaternion (x, y, z, w) of a rotation (3, 3), with w not negative (Shepperd, 1978)."""
    (a, b, c), (d, e, f), (g, h, i) = rotation.tolist()
    squares = [1 + a - e - i, 1 - a + e - i, 1 - a - e + i, 1 + a + e + i]
    k = max(range(4), key=squares.__getitem__)
    rows = ((squares[0], b + d, c + g, h - f), (b + d, squares[1], f + h, c - g), (c + g, f + h, squares[2], d - b))
    found = np.array([*rows, (h - f, c - g, d - b, squares[3])][k]) / (2 * math.sqrt(max(squares[k], 1e-300)))
    return found if found[3] >= 0 else -found


class Scene(Box):
    """Nodes in a tree, a background and light from all sides.

    Parameters
    ----------
    nodes : list of Node, optional
    bg_color : (3,) or (4,) float, optional
        sRGB of 0 to 1, and opacity; white unless given.
    ambient_light : (3,) float, optional
        Linear; none unless given. Its mean is taken.
    name : str, optional
    """

    def __init__(self, nodes: Any = None, bg_color: Any = None, ambient_light: Any = None, name: Any = None) -> None:
        self.bg_color, self.ambient_light, self.name = bg_color, ambient_light, name
        self._parents: dict[Node, Node | None] = {}
        self._main_camera_node: Node | None = None
        if nodes is not None:
            inner = [child for node in nodes for child in node.children]
            roots = [node for node in nodes if all(node is not child for child in inner)]
            if len({id(child) for child in inner}) < len(inner) or (nodes and not roots):
                raise ValueError("nodes must form trees: a node may have one parent, and none is its own")
            for node in roots:
                self.add_node(node)

    @property
    def bg_color(self) -> F64:
        """(4,) float64."""
        return self._bg_color

    @bg_color.setter
    def bg_color(self, value: Any) -> None:
        self._bg_color = np.ones(4) if value is None else as_rgb("bg_color", value, 4)

    @property
    def ambient_light(self) -> F64:
        """(3,) float64."""
        return self._ambient_light

    @ambient_light.setter
    def ambient_light(self, value: Any) -> None:
        self._ambient_light = np.zeros(3) if value is None else as_rgb("ambient_light", value, 3)

    @property
    def nodes(self) -> set[Node]:
        """All nodes."""
        return set(self._parents)

    def _nodes_with(self, name: str, kind: type = object) -> set[Node]:
        return {node for node in self._parents if isinstance(getattr(node, name), kind) and getattr(node, name)}

    mesh_nodes = property(lambda self: self._nodes_with("mesh", Mesh), doc="Nodes that have a mesh.")
    camera_nodes = property(lambda self: self._nodes_with("camera", Camera), doc="Nodes that have a camera.")
    light_nodes = property(lambda self: self._nodes_with("light", Light), doc="Nodes that have a light.")
    spot_light_nodes = property(lambda self: self._nodes_with("light", SpotLight), doc="Nodes with a spot light.")
    directional_light_nodes = property(
        lambda self: self._nodes_with("light", DirectionalLight), doc="Nodes with a directional light."
    )
    point_light_nodes = property(
        lambda self: self._nodes_with("light", PointLight) - self.spot_light_nodes, doc="Nodes with a point light."
    )
    meshes = property(lambda self: {node.mesh for node in self.mesh_nodes}, doc="All meshes.")
    cameras = property(lambda self: {node.camera for node in self.camera_nodes}, doc="All cameras.")
    lights = property(lambda self: {node.light for node in self.light_nodes}, doc="All lights.")
    spot_lights = property(lambda self: {node.light for node in self.spot_light_nodes}, doc="All spot lights.")
    point_lights = property(lambda self: {node.light for node in self.point_light_nodes}, doc="All point lights.")
    directional_lights = property(
        lambda self: {node.light for node in self.directional_light_nodes}, doc="All directional lights."
    )

    @property
    def main_camera_node(self) -> Node | None:
        """The node whose camera looks: the first that was added, unless it is set."""
        return self._main_camera_node

    @main_camera_node.setter
    def main_camera_node(self, node: Node) -> None:
        if node not in self._parents or node.camera is None:
            raise ValueError("main_camera_node must be a node of the scene that has a camera")
        self._main_camera_node = node

    @property
    def bounds(self) -> F64:  # type: ignore[override]
        """The box round all meshes in the world, (2, 3)."""
        boxes = []
        for node in self._parents:
            if node.mesh is not None and node.mesh.primitives:
                corners = np.array(np.meshgrid(*node.mesh.bounds.T)).reshape(3, -1).T
                corners = moved(corners, self.get_pose(node))
                boxes.append(np.stack([corners.min(axis=0), corners.max(axis=0)]))
        return box_of(boxes)

    def add(
        self, obj: Any, name: Any = None, pose: Any = None, parent_node: Node | None = None, parent_name: Any = None
    ) -> Node:
        """Add a mesh, a light or a camera at a pose (4, 4), and return its node."""
        kinds = {"mesh": Mesh, "light": Light, "camera": Camera}
        kind = next((word for word, one in kinds.items() if isinstance(obj, one)), None)
        if kind is None:
            raise TypeError(f"obj must be a Mesh, a Light or a Camera, got {type(obj).__name__}")
        if parent_node is None and parent_name is not None:
            found = self.get_nodes(name=parent_name)
            if len(found) != 1:
                raise ValueError(f"parent_name must be that of one node, {len(found)} are called {parent_name!r}")
            (parent_node,) = found
        node = Node(name=name, matrix=np.eye(4) if pose is None else pose, **{kind: obj})
        self.add_node(node, parent_node)
        return node

    def add_node(self, node: Node, parent_node: Node | None = None) -> None:
        """Add a node with all below it."""
        if node in self._parents:
            raise ValueError("node is in the scene already")
        if parent_node is not None:
            if parent_node not in self._parents:
                raise ValueError("parent_node is not in the scene")
            parent_node.children.append(node)
        self._enter(node, parent_node)

    def _enter(self, node: Node, parent: Node | None) -> None:
        if node in self._parents:
            raise ValueError("a node may have one parent")
        self._parents[node] = parent
        if node.camera is not None and self._main_camera_node is None:
            self._main_camera_node = node
        for child in node.children:
            self._enter(child, node)

    def remove_node(self, node: Node) -> None:
        """Take a node out, with all below it."""
        if node not in self._parents:
            raise ValueError("node is not in the scene")
        parent = self._parents[node]
        if parent is not None:
            parent.children.remove(node)
        self._leave(node)
        if self._main_camera_node not in self._parents:
            self._main_camera_node = next((one for one in self._parents if one.camera is not None), None)

    def _leave(self, node: Node) -> None:
        for child in node.children:
            self._leave(child)
        del self._parents[node]

    def clear(self) -> None:
        """Take all nodes out."""
        self._parents, self._main_camera_node = {}, None

    def has_node(self, node: Node) -> bool:
        """Whether the node is in the scene."""
        return node in self._parents

    def get_nodes(self, node: Any = None, name: Any = None, obj: Any = None, obj_name: Any = None) -> set[Node]:
        """The nodes that are all of: this one, of this name, with this object, with an object of this name."""
        found = set()
        for one in self._parents:
            objects = [own for own in (one.mesh, one.camera, one.light) if own is not None]
            if (
                (node is None or one is node)
                and (name is None or one.name == name)
                and (obj is None or any(own is obj for own in objects))
                and (obj_name is None or any(own.name == obj_name for own in objects))
            ):
                found.add(one)
        return found

    def get_pose(self, node: Node) -> F64:
        """World from node, (4, 4)."""
        if node not in self._parents:
            raise ValueError("node is not in the scene")
        parent = self._parents[node]
        return node.matrix if parent is None else product(self.get_pose(parent), node.matrix)

    def set_pose(self, node: Node, pose: Any) -> None:
        """Set parent from node, (4, 4)."""
        if node not in self._parents:
            raise ValueError("node is not in the scene")
        node.matrix = pose

    @staticmethod
    def from_trimesh_scene(trimesh_scene: Any, bg_color: Any = None, ambient_light: Any = None) -> Scene:
        """The scene of a `trimesh.Scene`."""
        scene = Scene(bg_color=bg_color, ambient_light=ambient_light)
        meshes = {name: Mesh.from_trimesh(own) for name, own in trimesh_scene.geometry.items()}
        for name in trimesh_scene.graph.nodes_geometry:
            pose, own = trimesh_scene.graph[name]
            scene.add(meshes[own], pose=pose)
        return scene

    def placed(self) -> Iterator[tuple[Node, Primitive, F64]]:
        """Each primitive that shows, as often as it stands, with its node and world from primitive."""
        for node in self._parents:
            if node.mesh is None or not node.mesh.is_visible:
                continue
            pose = self.get_pose(node)
            for own in node.mesh.primitives:
                for place in [None] if own.poses is None else own.poses:
                    yield node, own, pose if place is None else product(pose, place)
