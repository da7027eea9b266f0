"""Materials of files: what trimesh reads of MTL and glTF, as `Material`, and OBJ text cut by material.

A metallic-rough surface of glTF is approximated: its base colour by Lambert's cosine, its roughness by a Blinn
highlight of the same width with the reflectance of a dielectric. Metals keep their diffuse colour, since there is no
surrounding that they could mirror; normal, occlusion and emission maps are not read.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from topleft._base.color import Color
from topleft._model.material import Material
from topleft._model.texture import Texture

DIELECTRIC = 0.04
"""The share of light that glass, paint and skin reflect when seen along their normal."""


def material_of(source: Any) -> Material | None:
    """The material of a trimesh visual: `SimpleMaterial` (MTL) or `PBRMaterial` (glTF); None for anything else."""
    if hasattr(source, "baseColorFactor"):
        return _metallic_rough(source)
    if hasattr(source, "diffuse"):
        shininess = float(source.glossiness or 0)
        specular = 0.0 if source.specular is None else float(np.mean(np.asarray(source.specular)[:3])) / 255
        texture = _texture(source.image)
        color = None if texture else _rgb(source.diffuse)
        return Material(color, texture, specular=min(specular, 1.0) if shininess else 0.0, shininess=shininess)
    return None


def obj_by_material(text: str, path: Path) -> Iterator[tuple[str, Material | None]]:
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


def _metallic_rough(source: Any) -> Material:
    factor = source.baseColorFactor
    texture = _texture(source.baseColorTexture)
    linear = np.ones(4) if factor is None else np.asarray(factor, dtype=np.float64)
    if factor is not None and np.asarray(factor).dtype.kind in "iu":
        linear = linear / 255
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    roughness = 1.0 if source.roughnessFactor is None else float(source.roughnessFactor)
    alpha = max(roughness, 0.05) ** 2
    shininess = max(2 / alpha**2 - 2, 0.0)
    specular = min(DIELECTRIC * (shininess + 8) / 8, 1.0) if roughness < 1 else 0.0
    cutoff = None
    if source.alphaMode == "MASK":
        cutoff = 0.5 if source.alphaCutoff is None else float(source.alphaCutoff)
    color = None if factor is None else _rgb(np.rint(255 * encoded.clip(0, 1)))
    return Material(color, texture, specular=specular, shininess=shininess, alpha_cutoff=cutoff)


def _texture(image: Any) -> Texture | None:
    if image is None:
        return None
    return Texture(np.asarray(image.convert("RGBA")))


def _rgb(values: Any) -> Color:
    red, green, blue = (int(value) for value in np.asarray(values)[:3])
    return red, green, blue
