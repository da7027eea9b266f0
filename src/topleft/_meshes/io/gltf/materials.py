"""The materials of a glTF file, with their textures.

Input: the JSON, unchecked. Output: `Material`, made once for each row of the file.

Based on: Khronos Group, "glTF 2.0 Specification", 2021, 3.8 and 3.9, and the extensions KHR_texture_transform,
KHR_materials_unlit, KHR_materials_emissive_strength, KHR_materials_pbrSpecularGlossiness, EXT_texture_webp.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, U8
from topleft._core.base.color import LIGHT_OF_SRGB, encode_srgb
from topleft._meshes.io.gltf.accessors import Accessors, Tree, entry, uri_content, whole
from topleft._meshes.io.references import InputFile
from topleft._meshes.model.material import Material
from topleft._meshes.model.texture import Texture
from topleft.errors import MeshError
from topleft.typing import EncodingOption, FilterOption, WrapOption

NEAREST, LINEAR = 9728, 9729
WRAPS: dict[int, WrapOption] = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
DIELECTRIC = 0.04
"""The share of light that a surface without metal reflects when seen along its normal."""

N_ROWS_AT_ONCE = 64
"""Rows of a picture whose light is computed together."""

UP = np.array([[1.0, 0, 0], [0, -1, 1]])
"""From v downwards, as in the file, to v upwards and back."""


class Materials:
    """The materials of a file by their index; pictures lie inside the file or beside it."""

    def __init__(self, tree: Tree, accessors: Accessors, source: InputFile) -> None:
        self._tree = tree
        self._accessors = accessors
        self._source = source
        self._materials: dict[int, Material] = {}
        self._uv_sets: dict[int, tuple[int, int]] = {}
        self._sets = (0, 1)  # of the material that is being made
        self._textures: dict[tuple[Any, ...], Texture | None] = {}
        self._pictures: dict[int, npt.NDArray[np.uint8] | None] = {}

    def material(self, index: Any) -> Material:
        """A material of the file; a `MeshError` if there is none."""
        row = entry(self._tree, "materials", index)
        if index not in self._materials:
            self._source.budget.spend("max_nodes", 1)
            self._uv_sets[index] = self._sets = uv_sets_of(row)
            self._name = str(row.get("name") or f"materials[{index}]")
            self._materials[index] = self._made(row)
        return self._materials[index]

    def uv_sets(self, index: Any) -> tuple[int, int]:
        """The sets of texture coordinates of the file that the textures of a material have as their sets 0 and 1."""
        self.material(index)
        return self._uv_sets[index]

    def _made(self, row: Tree) -> Material:
        extensions = row.get("extensions", {})
        own: dict[str, Any] = {"double_sided": row.get("doubleSided") is True}
        gloss = extensions.get("KHR_materials_pbrSpecularGlossiness")
        rough = row.get("pbrMetallicRoughness", {})
        is_unlit = "KHR_materials_unlit" in extensions
        if gloss is not None and not (is_unlit and rough):
            own |= self._glossy(gloss)
        else:
            factor = _numbers(rough, "baseColorFactor", (1, 1, 1, 1))
            own |= {
                "color": srgb_of_light(factor[:3]),
                "opacity": _share(factor[3]),
                "texture": self._texture(rough.get("baseColorTexture"), "srgb"),
                "metallic": _share(_number(rough, "metallicFactor", 1)),
                "roughness": _share(_number(rough, "roughnessFactor", 1)),
                "metallic_roughness_texture": self._texture(rough.get("metallicRoughnessTexture"), "linear"),
            }
        mode = row.get("alphaMode", "OPAQUE")
        own["alpha_mode"] = {"MASK": "mask", "BLEND": "blend"}.get(mode, "opaque")
        if mode == "MASK":
            own |= cutoff_of(_number(row, "alphaCutoff", 0.5))
        if is_unlit:
            for name in ("metallic", "roughness", "metallic_roughness_texture"):
                own.pop(name, None)
            return Material(unlit=True, **own)
        strength = _number(extensions.get("KHR_materials_emissive_strength", {}), "emissiveStrength", 1)
        emission = tuple(max(0.0, strength * value) for value in _numbers(row, "emissiveFactor", (0, 0, 0)))
        own |= {"emission": emission, "emission_texture": self._texture(row.get("emissiveTexture"), "srgb")}
        occlusion, normal = row.get("occlusionTexture"), row.get("normalTexture")
        if occlusion is not None:
            own["occlusion_texture"] = self._texture(occlusion, "linear")
            own["occlusion_strength"] = _share(_number(occlusion, "strength", 1))
        if normal is not None:
            own["normal_texture"] = self._texture(normal, "linear")
            own["normal_scale"] = max(0.0, _number(normal, "scale", 1))
        return Material(**own)

    def _glossy(self, row: Tree) -> dict[str, Any]:
        """Diffuse and specular colour with a glossiness, as a metallic-rough surface that looks nearly the same."""
        self._source.notes.add("materials of KHR_materials_pbrSpecularGlossiness made metallic-rough")
        diffuse_factor = np.array(_numbers(row, "diffuseFactor", (1, 1, 1, 1)))
        specular_factor = np.array(_numbers(row, "specularFactor", (1, 1, 1)))
        gloss = _share(_number(row, "glossinessFactor", 1))
        diffuse = self._texture(row.get("diffuseTexture"), "srgb")
        specular = self._texture(row.get("specularGlossinessTexture"), "srgb")
        own: dict[str, Any] = {"opacity": _share(diffuse_factor[3])}
        there = [each for each in (diffuse, specular) if each is not None]
        size = max((each.image.shape[:2] for each in there), key=math.prod, default=(0, 0))
        if not self._source.may_have(2 * math.prod(size), "of KHR_materials_pbrSpecularGlossiness"):
            there = []
        if not there:
            base, metallic = metallic_of_specular(diffuse_factor[:3], specular_factor)
            return {**own, "color": srgb_of_light(base), "metallic": float(metallic), "roughness": 1 - gloss}
        laid = there[0]
        colors = _resized(None if diffuse is None else diffuse.image, size)
        strengths = _resized(None if specular is None else specular.image, size)
        bases, roughs = colors.copy(), np.zeros((*size, 3), np.uint8)
        for i in range(0, size[0], N_ROWS_AT_ONCE):
            rows = slice(i, i + N_ROWS_AT_ONCE)
            light = LIGHT_OF_SRGB[colors[rows, :, :3]] * diffuse_factor[:3]
            base, metallic = metallic_of_specular(light, LIGHT_OF_SRGB[strengths[rows, :, :3]] * specular_factor)
            bases[rows, :, :3] = np.rint(255 * encode_srgb(base))
            roughs[rows, :, 1] = np.rint(255 - gloss * strengths[rows, :, 3])
            roughs[rows, :, 2] = np.rint(255 * metallic)
        rough = replace(there[-1], image=roughs, encoding="linear")
        return {
            **own,
            "color": (255, 255, 255),
            "texture": replace(laid, image=bases),
            "metallic": 1.0,
            "roughness": 1.0,
            "metallic_roughness_texture": rough,
        }

    def _texture(self, info: Any, encoding: EncodingOption) -> Texture | None:
        """The texture that a material names, laid on as it says."""
        if info is None:
            return None
        row = entry(self._tree, "textures", info.get("index"))
        transform = info.get("extensions", {}).get("KHR_texture_transform", {})
        set_of_file = whole(transform, "texCoord", whole(info, "texCoord", 0))
        if set_of_file not in self._sets:
            name = f"TEXCOORD_{set_of_file} of {self._name}"
            self._source.notes.add("textures on a third set of texture coordinates of one material not read", name)
            return None
        uv_set = self._sets.index(set_of_file)
        matrix = None if not transform else transform_of(transform)
        sampler = {} if "sampler" not in row else entry(self._tree, "samplers", row["sampler"])
        key = (info["index"], encoding, uv_set, None if matrix is None else matrix.tobytes())
        if key not in self._textures:
            self._source.budget.spend("max_nodes", 1)
            picture = self._picture(row)
            may = picture is not None and self._source.may_lay(picture, f"textures[{info['index']}]")
            self._textures[key] = None if picture is None or not may else Texture(
                picture, filter=_filter_of(sampler), wrap=_wrap_of(sampler), encoding=encoding, uv_set=uv_set,
                transform=matrix,
            )  # fmt: skip
        return self._textures[key]

    def _picture(self, texture: Tree) -> npt.NDArray[np.uint8] | None:
        extensions = texture.get("extensions", {})
        named = [extensions[name] for name in ("EXT_texture_webp", "EXT_texture_avif") if name in extensions]
        for row in [*named, texture]:
            if "source" in row:
                index = row["source"]
                image = entry(self._tree, "images", index)
                if index not in self._pictures:
                    self._pictures[index] = self._decoded(image, index)
                if self._pictures[index] is not None or row is texture:
                    return self._pictures[index]
        kinds = " ".join(extensions)
        self._source.notes.add(f"textures {f'of {kinds}' if kinds else 'without a picture'} not read")
        return None

    def _decoded(self, image: Tree, index: int) -> npt.NDArray[np.uint8] | None:
        uri = image.get("uri")
        name = str(image.get("name") or f"images[{index}]")
        if "bufferView" in image:
            view = image["bufferView"]
            return self._source.decoded(("view", view), name, lambda: self._accessors.view(view).tobytes())
        if uri is None:
            raise MeshError(f"images[{index}] has neither a uri nor a bufferView")
        if not str(uri).startswith("data:"):
            return self._source.picture(unquote(str(uri)))
        return self._source.decoded(("uri", uri), name, lambda: uri_content(uri, self._source, "textures"))


def uv_sets_of(row: Tree) -> tuple[int, int]:
    """The two sets of texture coordinates that a material is drawn with: 0 and 1, unless it names others."""
    named: set[int] = set()
    rows: list[Any] = [row]
    while rows:
        own = rows.pop()
        if isinstance(own, dict):
            if "index" in own:
                transform = own.get("extensions", {}).get("KHR_texture_transform", {})
                named.add(whole(transform, "texCoord", whole(own, "texCoord", 0)))
            rows += [value for name, value in own.items() if name not in ("extras", "KHR_texture_transform")]
    if named <= {0, 1}:
        return 0, 1
    first, second = [*sorted(named), *({0, 1} - named)][:2]
    return first, second


def cutoff_of(cutoff: float) -> dict[str, float]:
    """The options of a material with a cutoff; a cutoff above 1 hides opaque surfaces, too."""
    return {"alpha_cutoff": _share(cutoff)} if cutoff <= 1 else {"alpha_cutoff": 1.0, "opacity": 0.0}


def metallic_of_specular(diffuse: F64, specular: F64) -> tuple[F64, F64]:
    """Base colour (..., 3) and metallic (...) of linear diffuse and specular colours, both (..., 3), 0 to 1.

    A surface with that base colour reflects 0.04 (1 - metallic) + base metallic, and scatters base (1 - metallic).

    Based on: KhronosGroup/glTF, extensions/2.0/Archived/KHR_materials_pbrSpecularGlossiness/examples.
    """
    brightness = np.array([0.299, 0.587, 0.114])
    d, s = (np.sqrt((colors**2 * brightness).sum(axis=-1)) for colors in (diffuse, specular))
    left = 1 - specular.max(axis=-1)
    b = d * left / (1 - DIELECTRIC) + s - 2 * DIELECTRIC
    root = np.sqrt(np.maximum(b**2 - 4 * DIELECTRIC * (DIELECTRIC - s), 0))
    metallic = np.where(s < DIELECTRIC, 0, (root - b) / (2 * DIELECTRIC)).clip(0, 1)
    share = metallic[..., None]
    of_diffuse = diffuse * left[..., None] / (1 - DIELECTRIC) / np.maximum(1 - share, 1e-6)
    of_specular = (specular - DIELECTRIC * (1 - share)) / np.maximum(share, 1e-6)
    return (of_diffuse + (of_specular - of_diffuse) * share**2).clip(0, 1), metallic


def _resized(picture: npt.NDArray[np.uint8] | None, size: tuple[int, ...]) -> npt.NDArray[np.uint8]:
    """The picture in another size; white where there is none."""
    if picture is None:
        return np.full((*size, 4), 255, np.uint8)
    if picture.shape[:2] == size:
        return picture
    from PIL import Image

    return np.asarray(Image.fromarray(picture).resize((size[1], size[0]), Image.Resampling.BILINEAR))


def _filter_of(sampler: Tree) -> FilterOption:
    """The filter that is nearest to the filters of OpenGL; trilinear unless the file says otherwise."""
    has_halves = sampler.get("minFilter") not in (NEAREST, LINEAR)
    if sampler.get("magFilter") == NEAREST:
        return "nearest" if sampler.get("minFilter") == NEAREST else "pixelated"
    return "trilinear" if has_halves else "bilinear"


def _wrap_of(sampler: Tree) -> tuple[WrapOption, WrapOption]:
    first, second = (WRAPS.get(sampler.get(name, 10497), "repeat") for name in ("wrapS", "wrapT"))
    return first, second


def transform_of(row: Tree) -> npt.NDArray[np.float64]:
    """The matrix (2, 3) of KHR_texture_transform, for v upwards; a `MeshError` if it holds no numbers."""
    angle = _number(row, "rotation", 0)
    (du, dv), (su, sv) = _numbers(row, "offset", (0, 0)), _numbers(row, "scale", (1, 1))
    cos, sin = engine.cosine_and_sine(math.degrees(angle))
    downwards = np.array([[su * cos, sv * sin, du], [-su * sin, sv * cos, dv], [0, 0, 1]])
    return engine.product(engine.product(UP, downwards), np.vstack([UP, [0, 0, 1]]))


def srgb_of_light(light: Any) -> U8:
    """The sRGB bytes of linear red, green and blue."""
    return np.rint(255 * encode_srgb(np.asarray(light, np.float64).clip(0, 1))).astype(np.uint8)


def _number(row: Tree, name: str, default: float) -> float:
    value = row.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise MeshError(f"{name} must be a number, got {value!r}"[:120])
    return float(value)


def _numbers(row: Tree, name: str, default: tuple[float, ...]) -> list[float]:
    values = row.get(name, default)
    if not isinstance(values, list | tuple) or len(values) != len(default):
        raise MeshError(f"{name} must be {len(default)} numbers, got {values!r}"[:120])
    return [_number({name: value}, name, 0) for value in values]


def _share(value: float) -> float:
    return min(max(value, 0.0), 1.0)
