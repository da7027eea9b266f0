"""Meshes of pyrender: primitives of triangles or points with one material, and what topleft draws of them.

Input: arrays, `trimesh.Trimesh`, told by its attributes. Output: `Primitive`, `Mesh`, `tl.Mesh`, `tl.Material`.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

import topleft as tl
from topleft.compat._arrays import F64, moved, srgb_bytes
from topleft.compat.pyrender.values import GLTF, MetallicRoughnessMaterial, Texture

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
        One of `GLTF`; lines are a pixel wide.
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

    def segments(self) -> F64:
        """The lines (N, 2, 6) of a primitive of lines: ends, and their colours, 0 to 1."""
        colors = np.broadcast_to(self.material.baseColorFactor[:3], self.positions.shape)
        ends = np.concatenate([self.positions, colors if self.color_0 is None else self.color_0[:, :3]], axis=1)
        flat = np.arange(len(ends)) if self.indices is None else self.indices.reshape(-1)
        if self.mode == GLTF.LINES:
            return ends[flat[: len(flat) // 2 * 2].reshape(-1, 2)]
        following = np.roll(flat, -1) if self.mode == GLTF.LINE_LOOP else flat[1:]
        return ends[np.stack([flat[: len(following)], following], axis=1)]


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
    """The material of a material of trimesh, PBRMaterial or SimpleMaterial."""
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
