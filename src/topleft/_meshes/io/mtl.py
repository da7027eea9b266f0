"""Reads material libraries of OBJ files (MTL).

Input: text. Output: `Material` by name; what a file does not set is off.

Based on: Wavefront Technologies, "Advanced Visualizer Manual", appendix B1, 1995; `Pr`, `Pm`, `map_Pr`, `map_Pm` and
`norm` as Exocortex proposed them in 2014.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from topleft._core.base.array_types import U8
from topleft._core.base.color import decode_srgb
from topleft._meshes.io.references import ROWS_AT_ONCE, InputFile
from topleft._meshes.model.material import Material
from topleft._meshes.model.texture import Texture
from topleft.errors import MeshError
from topleft.typing import EncodingOption

OPTION_LENGTHS = {
    "-s": 3, "-o": 3, "-t": 3, "-mm": 2, "-bm": 1, "-clamp": 1, "-blendu": 1, "-blendv": 1, "-imfchan": 1, "-boost": 1,
    "-texres": 1, "-cc": 1, "-type": 1, "-colorspace": 1,
}  # fmt: skip
"""The most words that an option of a map has."""

UNREAD_MAPS = ("disp", "decal", "refl")
NEARLY_OPAQUE, NEARLY_CLEAR = 250, 5
"""A map of opacity whose values all lie above or below is a cutout."""


@dataclass
class _Map:
    """A picture and how it is laid on."""

    name: str
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    is_clamped: bool = False
    bump: float = 1.0
    channel: str = ""

    @property
    def placement(self) -> dict[str, Any]:
        """The options of its `Texture`."""
        (su, sv), (du, dv) = self.scale, self.offset
        is_moved = (su, sv, du, dv) != (1, 1, 0, 0)
        matrix = np.array([[su, 0, du], [0, sv, dv]]) if is_moved else None
        return {"wrap": "clamp" if self.is_clamped else "repeat", "transform": matrix}


@dataclass
class _Entry:
    """A material as its library has it."""

    numbers: dict[str, list[float]] = field(default_factory=dict)
    maps: dict[str, _Map] = field(default_factory=dict)
    has_ambient_map: bool = False


def read_mtl(text: str, folder: Path, source: InputFile) -> dict[str, Callable[[], Material]]:
    """The materials of a library: functions, so that unused pictures are not read; `source` gets the notes."""
    entries: dict[str, _Entry] = {}
    own = _Entry()
    lines = text.replace("\\\n", " ").splitlines()
    source.budget.spend("max_lines", len(lines))
    for line in lines:
        words = line.split(maxsplit=1)
        if not words or words[0].startswith("#"):
            continue
        key, rest = words[0], words[1].strip() if len(words) > 1 else ""
        if key == "newmtl":
            if rest in entries:
                source.notes.add("materials defined again, of which the last is drawn", rest)
            own = entries[rest] = _Entry()
        elif key.lower() == "map_ka":
            own.has_ambient_map = True
        elif key.lower() in MAPS:
            own.maps[MAPS[key.lower()]] = _map_of(rest, source)
        elif key.lower().startswith("map_") or key in UNREAD_MAPS:
            source.notes.add(f"{key} of its materials not read")
        elif key in ("Kd", "Ks", "Ke", "Ns", "d", "Tr", "illum", "Pr", "Pm"):
            own.numbers[key] = _numbers(rest, key)
    if any(entry.has_ambient_map and "color" not in entry.maps for entry in entries.values()):
        source.notes.add("map_Ka of its materials not read")  # beside map_Kd exporters repeat its picture
    makers = _Makers(folder, source)
    return {name: partial(makers.material, entry) for name, entry in entries.items()}


MAPS = {
    "map_kd": "color", "map_d": "opacity", "map_tr": "transparency", "map_ke": "emission", "map_bump": "bump",
    "bump": "bump", "norm": "normal", "map_norm": "normal", "map_kn": "normal", "map_pr": "roughness",
    "map_pm": "metallic",
}  # fmt: skip


def _numbers(rest: str, key: str) -> list[float]:
    words = rest.split()
    if words and words[0] in ("spectral", "xyz"):
        return []
    words = [word for word in words if word != "-halo"]
    values = []
    for word in words[: 3 if key in ("Kd", "Ks", "Ke") else 1]:
        try:
            value = float(word)
        except ValueError:
            break
        if not math.isfinite(value):
            raise MeshError(f"{key} of its material library is {word!r}")
        values.append(value)
    return values


def _map_of(rest: str, source: InputFile) -> _Map:
    """A picture with its options, which stand before its name, or behind the suffix of it."""
    own, words, name = _Map(""), rest.split(" "), list[str]()
    i = 0
    while i < len(words):
        option = words[i]
        i += 1
        if option not in OPTION_LENGTHS or (name and "." not in "".join(name)):
            name += [option] if option or name else []
            continue
        values: list[str] = []
        while i < len(words) and len(values) < OPTION_LENGTHS[option] and (not values or _is_number(words[i])):
            if words[i]:
                values.append(words[i])
            i += 1
        _set_option(own, option, values, source)
    own.name = " ".join(name).strip().strip('"')
    return own


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word)) if word else True
    except ValueError:
        return False


def _set_option(own: _Map, option: str, values: list[str], source: InputFile) -> None:
    numbers = [float(value) for value in values if value and _is_number(value)]
    match option:
        case "-s" if numbers:
            own.scale = numbers[0], numbers[1] if len(numbers) > 1 else 1.0
        case "-o" if numbers:
            own.offset = numbers[0], numbers[1] if len(numbers) > 1 else 0.0
        case "-clamp":
            own.is_clamped = values == ["on"]
        case "-bm" if numbers:
            own.bump = numbers[0]
        case "-imfchan" if values:
            own.channel = values[0]
        case "-t" | "-mm" | "-cc" if values == ["on"] or (any(numbers) and numbers != [0, 1]):
            source.notes.add("options of maps not read", option)


class _Makers:
    """Materials with the pictures that they share."""

    def __init__(self, folder: Path, source: InputFile) -> None:
        self._folder = folder
        self._source = source
        self._textures: dict[tuple[Any, ...], Texture | None] = {}
        self._greys: dict[int, bool] = {}  # by the picture, which the source keeps

    def material(self, entry: _Entry) -> Material:
        """The material of an entry."""
        numbers, maps = entry.numbers, entry.maps
        own = self._colors(numbers, maps) | self._highlights(numbers) | self._opacity(numbers, maps)
        own |= self._emission(numbers, maps) | self._relief(maps)
        if {"roughness", "metallic"} & maps.keys() or {"Pr", "Pm"} & numbers.keys():
            own |= self._metallic_rough(numbers, maps)
        return Material(**own)

    def _colors(self, numbers: dict[str, list[float]], maps: dict[str, _Map]) -> dict[str, Any]:
        """Colour, or its map, which replaces it: exporters write arbitrary Kd there."""
        if "color" in maps:
            picture = self._picture(maps["color"])
            if picture is not None:
                kind = _opacity_kind(maps)
                if kind is not None and self._picture(maps[kind]) is not None:
                    return {}  # `_opacity` makes its texture
                return {"texture": self._texture(maps["color"], picture, "srgb")}
        return {"color": _rgb(numbers["Kd"]) if numbers.get("Kd") else None}

    def _highlights(self, numbers: dict[str, list[float]]) -> dict[str, Any]:
        """Highlights where the file has both their strength and their exponent, and its model of light has them."""
        strength, exponent = numbers.get("Ks"), numbers.get("Ns")
        illumination = numbers.get("illum") or [2.0]
        if not strength or not exponent or exponent[0] <= 0 or illumination[0] < 2:
            return {"specular": 0.0, "shininess": 0.0}
        return {"specular": _share(float(np.mean(strength))), "shininess": exponent[0]}

    def _opacity(self, numbers: dict[str, list[float]], maps: dict[str, _Map]) -> dict[str, Any]:
        """Opacity: of `d`, else 1 - `Tr`; times the map of it, which becomes the alpha of the texture."""
        opacity = 1.0
        if numbers.get("d"):
            opacity = _share(numbers["d"][0])
        elif numbers.get("Tr") and numbers["Tr"][0] < 1:  # MeshLab writes 1 for opaque
            opacity = 1 - _share(numbers["Tr"][0])
        if opacity == 0:
            self._source.notes.add("materials that are wholly transparent")
        own: dict[str, Any] = {"opacity": opacity}
        if opacity < 1:
            own["alpha_mode"] = "blend"
        kind = _opacity_kind(maps)
        picture = None if kind is None else self._picture(maps[kind])
        if kind is None or picture is None:
            return own
        color = self._picture(maps["color"]) if "color" in maps else None
        laid = maps[kind] if color is None else maps["color"]

        def base() -> U8:
            alpha = _scalar_of(picture, maps[kind].channel, "a" if (picture[..., 3] < 255).any() else "l")
            if kind == "transparency":
                alpha = 255 - alpha
            own = np.full((*alpha.shape, 4), 255, np.uint8)
            if color is not None:
                own, alpha = _same_size(color, alpha)
            return np.dstack([own[..., :3], alpha])

        key = kind, maps[kind].name, maps[kind].channel, None if color is None else laid.name
        own["texture"] = texture = self._made(key, laid, _largest(picture, color), base, "srgb")
        if own.get("alpha_mode") is None:
            alpha = np.zeros((1, 1), np.uint8) if texture is None else texture.image[..., 3]
            between = (alpha > NEARLY_CLEAR) & (alpha < NEARLY_OPAQUE)
            own["alpha_mode"] = "blend" if between.mean() > 0.05 else "mask"
        return own

    def _emission(self, numbers: dict[str, list[float]], maps: dict[str, _Map]) -> dict[str, Any]:
        light = _light(numbers.get("Ke", []))
        picture = self._picture(maps["emission"]) if "emission" in maps else None
        if picture is None:
            return {"emission": light}
        texture = self._texture(maps["emission"], picture, "srgb")
        return {"emission": light if any(light) else (1.0, 1.0, 1.0), "emission_texture": texture}

    def _relief(self, maps: dict[str, _Map]) -> dict[str, Any]:
        """The normal map: `norm`, or `bump`, which is a map of heights if it is grey."""
        laid = maps.get("normal", maps.get("bump"))
        picture = None if laid is None else self._picture(laid)
        if laid is None or picture is None:
            return {}
        if id(picture) not in self._greys:
            self._greys[id(picture)] = _is_grey(picture)
        if self._greys[id(picture)] and "normal" not in maps:
            key = "heights", laid.name, laid.channel, laid.bump
            return {
                "normal_texture": self._made(
                    key, laid, picture,
                    lambda: normals_of_heights(_scalar_of(picture, laid.channel, "l"), laid.bump), "linear",
                )
            }  # fmt: skip
        texture = self._texture(laid, picture, "linear")
        return {"normal_texture": texture, "normal_scale": max(laid.bump, 0.0)}

    def _metallic_rough(self, numbers: dict[str, list[float]], maps: dict[str, _Map]) -> dict[str, Any]:
        """A metallic-rough surface; its two maps become green and blue of one texture."""
        own: dict[str, Any] = {
            "roughness": _share((numbers.get("Pr") or [1.0])[0]),
            "metallic": _share((numbers.get("Pm") or [1.0 if "metallic" in maps else 0.0])[0]),
        }
        found = {kind: self._picture(maps[kind]) for kind in ("roughness", "metallic") if kind in maps}
        pictures = {kind: picture for kind, picture in found.items() if picture is not None}
        for kind, name in (("roughness", "Pr"), ("metallic", "Pm")):
            if kind in pictures and not numbers.get(name):
                own[kind] = 1.0

        def packed() -> U8:
            values = {kind: _scalar_of(picture, "", "l") for kind, picture in pictures.items()}
            own = np.full((*next(iter(values.values())).shape, 3), 255, np.uint8)
            for kind, channel in (("roughness", 1), ("metallic", 2)):
                if kind in values:
                    own, alpha = _same_size(own, values[kind])
                    own = own.copy()
                    own[..., channel] = alpha
            return own

        if pictures:
            key = tuple((kind, maps[kind].name) for kind in pictures)
            laid = maps[next(iter(pictures))]
            own["metallic_roughness_texture"] = self._made(key, laid, _largest(*pictures.values()), packed, "linear")
        return own

    def _picture(self, laid: _Map) -> U8 | None:
        return self._source.picture(laid.name, self._folder) if laid.name else None

    def _texture(self, laid: _Map, picture: U8, encoding: EncodingOption) -> Texture | None:
        """The texture of a picture as it is. Its alpha is not opacity: map_d is."""
        return self._made((laid.name,), laid, picture, lambda: _opaque(picture), encoding)

    def _made(
        self, key: tuple[Any, ...], laid: _Map, largest: U8, pixels: Callable[[], U8], encoding: EncodingOption
    ) -> Texture | None:
        """A texture, shared by all materials that name it; None if it is beyond the budget."""
        key = (*key, laid.scale, laid.offset, laid.is_clamped, encoding)
        if key not in self._textures:
            self._source.budget.spend("max_nodes", 1)
            may = self._source.may_lay(largest, laid.name)
            self._textures[key] = Texture(pixels(), encoding=encoding, **laid.placement) if may else None
        return self._textures[key]


def _opacity_kind(maps: dict[str, _Map]) -> str | None:
    return next((kind for kind in ("opacity", "transparency") if kind in maps), None)


def _largest(*pictures: U8 | None) -> U8:
    return max((picture for picture in pictures if picture is not None), key=lambda picture: picture.size)


def _scalar_of(picture: U8, channel: str, default: str) -> U8:
    """One number a pixel: red, green, blue, the "matte" alpha, or luminance."""
    match channel or default:
        case "r" | "g" | "b" as one:
            return picture[..., "rgb".index(one)]
        case "m" | "a":
            return picture[..., 3]
        case _:
            made = np.empty(picture.shape[:2], np.uint8)
            for rows in _blocks(len(picture)):
                made[rows] = np.rint((picture[rows, :, :3] * [0.2126, 0.7152, 0.0722]).sum(axis=-1))
            return made


def _opaque(picture: U8) -> U8:
    """The colours; all of a picture that is opaque, which is copied faster."""
    return picture if int(picture[..., 3].min()) == 255 else picture[..., :3]


def _is_grey(picture: U8) -> bool:
    red, green, blue = (picture[..., channel] for channel in range(3))
    largest = np.maximum(red, green)
    smallest = np.minimum(red, green)
    np.maximum(largest, blue, out=largest)
    np.minimum(smallest, blue, out=smallest)
    return int((largest - smallest).max()) <= 2


def _blocks(n_rows: int) -> list[slice]:
    """Rows that are computed together, so that nothing but the result is as large as a picture."""
    return [slice(top, min(top + ROWS_AT_ONCE, n_rows)) for top in range(0, n_rows, ROWS_AT_ONCE)]


def _same_size(color: U8, alpha: U8) -> tuple[U8, U8]:
    """Both in the larger of their two sizes."""
    if color.shape[:2] == alpha.shape:
        return color, alpha
    from PIL import Image

    if color.shape[0] * color.shape[1] >= alpha.size:
        size = color.shape[1], color.shape[0]
        return color, np.asarray(Image.fromarray(alpha).resize(size, Image.Resampling.BILINEAR))
    size = alpha.shape[1], alpha.shape[0]
    return np.asarray(Image.fromarray(np.ascontiguousarray(color)).resize(size, Image.Resampling.BILINEAR)), alpha


def normals_of_heights(heights: U8, scale: float) -> U8:
    """A normal map (H, W, 3) of a map of heights (H, W), 0 to 255 for 0 to `scale` texels times two."""
    made = np.empty((*heights.shape, 3), np.uint8)
    for rows in _blocks(len(heights)):
        at = np.arange(rows.start - 1, rows.stop + 1)
        values = heights.take(at, axis=0, mode="wrap").astype(np.float64) * (scale / 255)
        slope_u = np.roll(values, -1, axis=1) - np.roll(values, 1, axis=1)
        slope_v = values[:-2] - values[2:]
        normals = np.dstack([-slope_u[1:-1], -slope_v, np.ones_like(slope_v)])
        normals /= np.sqrt((normals * normals).sum(axis=2, keepdims=True))
        made[rows] = np.rint(127.5 * (normals + 1))
    return made


def _rgb(values: list[float]) -> U8:
    return np.array([round(255 * _share(value)) for value in _three(values)], np.uint8)


def _light(values: list[float]) -> tuple[float, float, float]:
    if not values:
        return 0.0, 0.0, 0.0
    red, green, blue = (float(value) for value in decode_srgb(np.maximum(np.array(_three(values)), 0)))
    return red, green, blue


def _three(values: list[float]) -> list[float]:
    """Red, green and blue: one number stands for all."""
    return values if len(values) == 3 else [values[0]] * 3


def _share(value: float) -> float:
    return min(max(value, 0.0), 1.0)
