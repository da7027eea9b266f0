"""Scenes of pyrender: meshes, lights and cameras in nodes, nodes in a tree with poses.

Input: meshes, poses. Output: `Scene`, which the renderer walks.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from topleft.compat._arrays import F64, moved, product
from topleft.compat.pyrender.meshes import Box, Mesh, Primitive, box_of
from topleft.compat.pyrender.values import Camera, Checked, Color, DirectionalLight, Light, PointLight, SpotLight


class Part(Checked):
    """The rotation, the scale or the translation of a node, n numbers."""

    def __init__(self, n: int) -> None:
        self.n = n

    def __set__(self, instance: Node, value: Any) -> None:
        array = np.array(value, np.float64)
        if array.shape != (self.n,):
            raise ValueError(f"{self.name} must have shape ({self.n},), got {array.shape}")
        if self.n == 4 and abs((array**2).sum() - 1) > 2e-3:
            raise ValueError(f"rotation must be a quaternion of length 1, got {value!r}")
        vars(instance).update({self.name: array, "_matrix": None})


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

    rotation, scale, translation = Part(4), Part(3), Part(3)

    def __init__(
        self, name: Any = None, camera: Any = None, children: Any = None, skin: Any = None, matrix: Any = None,
        mesh: Any = None, rotation: Any = None, scale: Any = None, translation: Any = None, weights: Any = None,
        light: Any = None,
    ) -> None:  # fmt: skip
        self.name, self.skin, self.weights = name, skin, weights
        self.children: list[Node] = [] if children is None else children
        self.camera, self.mesh, self.light = camera, mesh, light
        self._matrix: F64 | None = None
        if matrix is not None:
            self.matrix = matrix
            return
        self.rotation = (0, 0, 0, 1) if rotation is None else rotation
        self.scale = (1, 1, 1) if scale is None else scale
        self.translation = (0, 0, 0) if translation is None else translation

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
            self._matrix[:3, :3] = rotation_of(self.rotation) * self.scale
            self._matrix[:3, 3] = self.translation
        return self._matrix.copy()

    @matrix.setter
    def matrix(self, value: Any) -> None:
        matrix = np.asarray(value, np.float64)
        if matrix.shape != (4, 4) or not np.allclose(matrix[3], [0, 0, 0, 1]):
            raise ValueError(f"matrix must have shape (4, 4) and the last row [0, 0, 0, 1], got {value!r}")
        scale = np.sqrt((matrix[:3, :3] ** 2).sum(axis=0))
        rotation = quaternion_of(matrix[:3, :3] / np.where(scale > 0, scale, 1))
        vars(self).update(_matrix=matrix.copy(), scale=scale, rotation=rotation, translation=matrix[:3, 3].copy())


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

    bg_color, ambient_light = Color(4, 1), Color(3, 0)

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
