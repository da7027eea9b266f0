"""Makes a `Mesh` of a geometry of trimesh: its colours, materials, and the normals that it has already.

Input: `trimesh.Trimesh`, recognized by its attributes, and its place. Output: `Mesh`. trimesh is not imported.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core.base.color import encode_srgb
from topleft._meshes.model.joined import placed_arrays
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.texture import Texture
from topleft.typing import AlphaModeOption, EncodingOption

ALPHA_MODES: dict[str, AlphaModeOption] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}
DEFAULT_OF_TRIMESH = (102, 102, 102, 1.0)
"""Specular colour and glossiness that trimesh gives materials without them."""


Textures = dict[tuple[int, EncodingOption], Texture]
"""Textures made of pictures, by the `id` of the picture and the encoding."""


def placed(geometry: Any, transform: npt.NDArray[np.float64], known: Textures | None = None) -> Mesh:
    """A trimesh geometry as a mesh in the space of its scene; per-face colours get corners of their own.

    `known` keeps the textures of a scene, which its geometries share.
    """
    vertices, triangles = np.asarray(geometry.vertices), np.asarray(geometry.faces)
    # trimesh computes normals when asked for them; those of a file wait in the cache.
    normals = np.asarray(geometry.vertex_normals) if "vertex_normals" in geometry._cache else None
    colors = uv = None
    materials: tuple[Material, ...] = ()
    if geometry.visual.kind == "texture":
        own = geometry.visual.uv
        uv = None if own is None or np.shape(own) != (len(vertices), 2) else np.asarray(own)
        material = material_of(geometry.visual.material, {} if known is None else known)
        materials = () if material is None else (material,)
    elif geometry.visual.kind == "vertex":
        colors = np.asarray(geometry.visual.vertex_colors)
    elif geometry.visual.kind == "face":
        colors = np.asarray(geometry.visual.face_colors).repeat(3, axis=0)
        vertices = vertices[triangles.ravel()]
        normals = None if normals is None else normals[triangles.ravel()]
        triangles = np.arange(triangles.size).reshape(-1, 3)
    return Mesh(*placed_arrays(vertices, triangles, normals, transform), colors, uv, materials)


def material_of(source: Any, known: Textures) -> Material | None:
    """The material of a trimesh visual: `SimpleMaterial` (MTL) or `PBRMaterial` (glTF); None for anything else."""
    if hasattr(source, "baseColorFactor"):
        return _metallic_rough(source, known)
    if hasattr(source, "diffuse"):
        shininess = float(source.glossiness or 0)
        specular = 0.0 if source.specular is None else float(np.mean(np.asarray(source.specular)[:3])) / 255
        if source.specular is not None and (*_rgb(source.specular), shininess) == DEFAULT_OF_TRIMESH:
            specular = 0.0  # the file sets no highlights
        texture = _texture(source.image, known)
        color = None if texture else _rgb(source.diffuse)
        return Material(color, texture, specular=min(specular, 1.0) if shininess else 0.0, shininess=shininess)
    return None


def _metallic_rough(source: Any, known: Textures) -> Material:
    """The material of glTF that trimesh keeps."""
    factor = source.baseColorFactor
    linear = np.ones(4)
    if factor is not None:
        given = np.asarray(factor, np.float64).ravel() / (255 if np.asarray(factor).dtype.kind in "iu" else 1)
        linear[: len(given)] = given[:4]
    emission = np.zeros(3) if source.emissiveFactor is None else np.asarray(source.emissiveFactor, np.float64)
    mode = source.alphaMode if source.alphaMode in ALPHA_MODES else "OPAQUE"
    cutoff = 0.5 if source.alphaCutoff is None else float(source.alphaCutoff)
    is_hidden = mode == "MASK" and cutoff > 1
    return Material(
        None if factor is None else _rgb(np.rint(255 * encode_srgb(linear).clip(0, 1))),
        _texture(source.baseColorTexture, known),
        alpha_cutoff=min(max(cutoff, 0.0), 1.0) if mode == "MASK" else None,
        opacity=0.0 if is_hidden else min(max(float(linear[3]), 0.0), 1.0),
        alpha_mode=ALPHA_MODES[mode],
        double_sided=source.doubleSided is not False,
        emission=tuple(np.maximum(emission, 0).tolist()),
        emission_texture=_texture(source.emissiveTexture, known),
        metallic=1.0 if source.metallicFactor is None else min(max(float(source.metallicFactor), 0.0), 1.0),
        roughness=1.0 if source.roughnessFactor is None else min(max(float(source.roughnessFactor), 0.0), 1.0),
        metallic_roughness_texture=_texture(source.metallicRoughnessTexture, known, "linear"),
        occlusion_texture=_texture(source.occlusionTexture, known, "linear"),
        normal_texture=_texture(source.normalTexture, known, "linear"),
    )


def _texture(image: Any, known: Textures, encoding: EncodingOption = "srgb") -> Texture | None:
    if image is None:
        return None
    key = id(image), encoding
    if key not in known:
        known[key] = Texture(np.asarray(image.convert("RGBA")), encoding=encoding)
    return known[key]


def _rgb(values: Any) -> npt.NDArray[np.int_]:
    return np.asarray(values)[:3].astype(int)
