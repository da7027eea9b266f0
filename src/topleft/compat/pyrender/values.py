"""What stands in a scene of pyrender besides meshes: cameras, lights, materials, textures, and its constants.

Input: what programs for pyrender write. Output: values with pyrender's names, which are checked when they are set.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.compat._arrays import F64

DEFAULT_Z_NEAR = 0.05
DEFAULT_Z_FAR = 100.0


class RenderFlags:
    """How a scene is drawn; joined by `|`. Those of shadows, wireframes and normals are read and not drawn."""

    NONE = 0
    DEPTH_ONLY = 1
    OFFSCREEN = 2
    FLIP_WIREFRAME = 4
    ALL_WIREFRAME = 8
    ALL_SOLID = 16
    SHADOWS_DIRECTIONAL = 32
    SHADOWS_POINT = 64
    SHADOWS_SPOT = 128
    SHADOWS_ALL = 32 | 64 | 128
    VERTEX_NORMALS = 256
    FACE_NORMALS = 512
    SKIP_CULL_FACES = 1024
    RGBA = 2048
    FLAT = 4096
    SEG = 8192


class GLTF:
    """The numbers of OpenGL that glTF has for filters, wraps and modes of primitives."""

    NEAREST = 9728
    LINEAR = 9729
    NEAREST_MIPMAP_NEAREST = 9984
    LINEAR_MIPMAP_NEAREST = 9985
    NEAREST_MIPMAP_LINEAR = 9986
    LINEAR_MIPMAP_LINEAR = 9987
    CLAMP_TO_EDGE = 33071
    MIRRORED_REPEAT = 33648
    REPEAT = 10497
    POINTS = 0
    LINES = 1
    LINE_LOOP = 2
    LINE_STRIP = 3
    TRIANGLES = 4
    TRIANGLE_STRIP = 5
    TRIANGLE_FAN = 6


class Checked:
    """A value of an object that a subclass checks when it is set."""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        return self if instance is None else vars(instance)[self.name]


class Number(Checked):
    """A number of an object: ``name = Number(above=0)``."""

    def __init__(
        self, *, above: float = -math.inf, least: float = -math.inf, below: float = math.inf, optional: bool = False
    ) -> None:
        self.above, self.least, self.below, self.optional = above, least, below, optional

    def __set__(self, instance: Any, value: Any) -> None:
        if value is None and self.optional:
            vars(instance)[self.name] = None
            return
        number = float(value)  # TypeError where it is none
        if not (number > self.above and number >= self.least and number < self.below):
            low = f"> {self.above:g}" if self.above > -math.inf else f">= {self.least:g}"
            raise ValueError(f"{self.name} must be a number {low} and < {self.below:g}, got {value!r}")
        vars(instance)[self.name] = number


def as_vector(name: str, value: Any, n: int) -> F64:
    """The numbers (n,) as float64."""
    array = np.asarray(value, np.float64) if value is not None else np.empty(0)
    if array.shape != (n,):
        raise ValueError(f"{name} must have shape ({n},), got {array.shape}")
    return array


def as_rgb(name: str, value: Any, n: int) -> F64:
    """A colour of n floats, as pyrender reads it: integers are divided by 255, missing numbers are 1."""
    given = np.asarray([] if value is None else value)
    array = np.squeeze(given).astype(np.float64) / (255.0 if given.dtype.kind in "iu" else 1.0)
    if given.ndim == 0:
        array = np.repeat(array, n)
    elif array.ndim == 1 and len(array):
        array = np.append(array, np.ones(n))[:n]
    return as_vector(name, array if array.ndim else given, n)


class Color(Checked):
    """A colour of n floats of an object, (n,) float64; `default` in place of None."""

    def __init__(self, n: int, default: float | None = None) -> None:
        self.n, self.default = n, default

    def __set__(self, instance: Any, value: Any) -> None:
        given = np.full(self.n, self.default) if value is None and self.default is not None else value
        vars(instance)[self.name] = as_rgb(self.name, given, self.n)


class Camera:
    """What all cameras have: planes and a name; x to the right, y up, the view along -z.

    Parameters
    ----------
    znear, zfar : float
        Distances of the planes; `zfar` None: there is no far one.
    name : str, optional
    """

    znear = Number(least=0)

    def __init__(self, znear: float = DEFAULT_Z_NEAR, zfar: float | None = DEFAULT_Z_FAR, name: Any = None) -> None:
        self.name = name
        self.znear = znear
        self.zfar = zfar

    @property
    def zfar(self) -> float | None:
        """Distance of the far plane."""
        return self._zfar

    @zfar.setter
    def zfar(self, value: float | None) -> None:
        if value is not None and not (float(value) > 0 and float(value) > self.znear):
            raise ValueError(f"zfar must be larger than znear = {self.znear:g}, got {value!r}")
        self._zfar = None if value is None else float(value)

    def get_projection_matrix(self, width: float | None = None, height: float | None = None) -> F64:
        """Clip from eye (4, 4), OpenGL's."""
        raise NotImplementedError

    def _depth_rows(self) -> tuple[float, float]:
        """The third row of a perspective matrix: what z and 1 are multiplied by."""
        near, far = self.znear, self.zfar
        if far is None:
            return -1.0, -2.0 * near
        return (far + near) / (near - far), 2 * far * near / (near - far)


class PerspectiveCamera(Camera):
    """A pinhole camera.

    Parameters
    ----------
    yfov : float
        Field of view from the bottom to the top of the picture, radians.
    znear, zfar : float
    aspectRatio : float, optional
        Width / height; that of the picture unless given.
    name : str, optional
    """

    yfov = Number(above=0)
    aspectRatio = Number(above=0, optional=True)

    def __init__(
        self,
        yfov: float,
        znear: float = DEFAULT_Z_NEAR,
        zfar: float | None = None,
        aspectRatio: float | None = None,
        name: Any = None,
    ) -> None:
        super().__init__(znear, zfar, name)
        self.yfov, self.aspectRatio = yfov, aspectRatio

    def get_projection_matrix(self, width: float | None = None, height: float | None = None) -> F64:
        """Clip from eye (4, 4), of a picture of this size where the camera has no aspect ratio."""
        aspect = self.aspectRatio
        if aspect is None:
            if width is None or height is None:
                raise ValueError("aspectRatio is not set: width and height must be given")
            aspect = float(width) / float(height)
        tangent = math.tan(self.yfov / 2)
        a, b = self._depth_rows()
        return np.array([[1 / (aspect * tangent), 0, 0, 0], [0, 1 / tangent, 0, 0], [0, 0, a, b], [0, 0, -1, 0]])


class IntrinsicsCamera(Camera):
    """A pinhole camera of a calibrated photograph.

    Parameters
    ----------
    fx, fy, cx, cy : float
        Focal lengths and principal point, pixels from the top left corner of the picture.
    znear, zfar : float
    name : str, optional
    """

    fx, fy, cx, cy = Number(), Number(), Number(), Number()

    def __init__(
        self,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        znear: float = DEFAULT_Z_NEAR,
        zfar: float | None = DEFAULT_Z_FAR,
        name: Any = None,
    ) -> None:
        super().__init__(znear, zfar, name)
        self.fx, self.fy, self.cx, self.cy = fx, fy, cx, cy

    def get_projection_matrix(self, width: float | None = None, height: float | None = None) -> F64:
        """Clip from eye (4, 4) of a picture of this size."""
        if not width or not height:
            raise ValueError("an IntrinsicsCamera needs width and height")
        w, h = float(width), float(height)
        a, b = self._depth_rows()
        return np.array([
            [2 * self.fx / w, 0, 1 - 2 * self.cx / w, 0],
            [0, 2 * self.fy / h, 2 * self.cy / h - 1, 0],
            [0, 0, a, b],
            [0, 0, -1, 0],
        ])  # fmt: skip


class OrthographicCamera(Camera):
    """A camera without perspective.

    Parameters
    ----------
    xmag, ymag : float
        Half of what it sees across and up, world units.
    znear, zfar : float
    name : str, optional
    """

    xmag, ymag = Number(above=0), Number(above=0)

    def __init__(
        self, xmag: float, ymag: float, znear: float = DEFAULT_Z_NEAR, zfar: float = DEFAULT_Z_FAR, name: Any = None
    ) -> None:
        self.znear = znear
        if not self.znear > 0:
            raise ValueError(f"znear must be positive, got {znear!r}")
        super().__init__(znear, zfar, name)
        self.xmag, self.ymag = xmag, ymag

    znear = Number(above=0)

    def get_projection_matrix(self, width: float | None = None, height: float | None = None) -> F64:
        """Clip from eye (4, 4); a picture of another shape sees more across."""
        x = self.xmag
        if width is not None and height is not None:
            x = width / height * self.ymag
        near, far = self.znear, self.zfar if self.zfar is not None else DEFAULT_Z_FAR
        return np.array([
            [1 / x, 0, 0, 0],
            [0, 1 / self.ymag, 0, 0],
            [0, 0, 2 / (near - far), (far + near) / (near - far)],
            [0, 0, 0, 1],
        ])  # fmt: skip


class Light:
    """What all lights have.

    Parameters
    ----------
    color : (3,) float
        Linear, 0 to 1; white unless given.
    intensity : float
    name : str, optional
    """

    color, intensity = Color(3), Number()

    def __init__(self, color: Any = None, intensity: float | None = 1.0, name: Any = None) -> None:
        self.name = name
        self.color = np.ones(3) if color is None else color
        self.intensity = 1.0 if intensity is None else intensity


class DirectionalLight(Light):
    """Light from far away, along -z of its node."""


class PointLight(Light):
    """Light from a point: divided by the square of the distance.

    Parameters
    ----------
    color, intensity, name
        As for `Light`.
    range : float, optional
        Kept; not looked at.
    """

    range = Number(above=0, optional=True)

    def __init__(self, color: Any = None, intensity: float | None = 1.0, range: Any = None, name: Any = None) -> None:  # noqa: A002
        super().__init__(color, intensity, name)
        self.range = range


class SpotLight(PointLight):
    """Light from a point within a cone round -z of its node.

    Parameters
    ----------
    color, intensity, range, name
        As for `PointLight`.
    innerConeAngle, outerConeAngle : float
        Radians from the axis: where it begins to fall off, and where nothing is left.
    """

    def __init__(
        self,
        color: Any = None,
        intensity: float | None = 1.0,
        range: Any = None,  # noqa: A002
        innerConeAngle: float = 0.0,
        outerConeAngle: float = math.pi / 4,
        name: Any = None,
    ) -> None:
        super().__init__(color, intensity, range, name)
        self.outerConeAngle = outerConeAngle
        self.innerConeAngle = innerConeAngle

    @property
    def innerConeAngle(self) -> float:
        """Radians."""
        return self._inner

    @innerConeAngle.setter
    def innerConeAngle(self, value: float) -> None:
        if not 0 <= value <= self.outerConeAngle:
            raise ValueError(f"innerConeAngle must lie in 0 to outerConeAngle = {self.outerConeAngle:g}, got {value!r}")
        self._inner = float(value)

    @property
    def outerConeAngle(self) -> float:
        """Radians."""
        return self._outer

    @outerConeAngle.setter
    def outerConeAngle(self, value: float) -> None:
        if not 0 <= value <= math.pi / 2 + 1e-9:
            raise ValueError(f"outerConeAngle must lie in 0 to pi / 2, got {value!r}")
        self._outer = float(value)


class Sampler:
    """How a texture is looked up."""

    def __init__(
        self, name: Any = None, magFilter: Any = None, minFilter: Any = None,
        wrapS: int = GLTF.REPEAT, wrapT: int = GLTF.REPEAT,
    ) -> None:  # fmt: skip
        self.name, self.magFilter, self.minFilter, self.wrapS, self.wrapT = name, magFilter, minFilter, wrapS, wrapT


class Texture:
    """A picture for a material.

    Parameters
    ----------
    name : str, optional
    sampler : Sampler, optional
    source : (H, W), (H, W, 3) or (H, W, 4) array_like, or PIL.Image
        uint8, or floats of 0 to 1; row 0 is the top.
    source_channels, width, height, tex_type, data_format
        As pyrender has them; width and height are those of the source.
    """

    def __init__(
        self, name: Any = None, sampler: Sampler | None = None, source: Any = None, source_channels: Any = None,
        width: Any = None, height: Any = None, tex_type: int = 3553, data_format: int = 5121,
    ) -> None:  # fmt: skip
        if source is None and (width is None or height is None):
            raise ValueError("a texture needs a source, or width and height")
        self.name, self.sampler, self.source_channels = name, sampler or Sampler(), source_channels
        self.source = None if source is None else as_pixels(source)
        shape = (height, width) if self.source is None else self.source.shape[:2]
        self.height, self.width = int(shape[0]), int(shape[1])
        self.tex_type, self.data_format = tex_type, data_format


def as_pixels(source: Any) -> npt.NDArray[np.uint8]:
    """The pixels of a picture, (H, W, 3) or (H, W, 4) uint8."""
    if hasattr(source, "convert"):  # an image of Pillow
        source = source.convert("RGBA" if source.mode in ("RGBA", "LA", "PA") else "RGB")
    pixels = np.asarray(source)
    if pixels.dtype.kind == "f":
        pixels = np.rint(255 * np.clip(pixels, 0, 1))
    pixels = pixels.astype(np.uint8)
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    return pixels if pixels.shape[2] >= 3 else np.concatenate([pixels[..., :1]] * 3 + [pixels[..., 1:]], axis=2)


class Material:
    """What all materials have; textures may be arrays, pictures of Pillow or `Texture`."""

    alphaCutoff = Number(least=0, optional=True)

    def __init__(
        self, name: Any = None, normalTexture: Any = None, occlusionTexture: Any = None, emissiveTexture: Any = None,
        emissiveFactor: Any = None, alphaMode: Any = None, alphaCutoff: Any = None, doubleSided: bool = False,
        smooth: bool = True, wireframe: bool = False,
    ) -> None:  # fmt: skip
        self.name = name
        self.alphaMode = "OPAQUE" if alphaMode is None else alphaMode
        if self.alphaMode not in ("OPAQUE", "MASK", "BLEND"):
            raise ValueError(f"alphaMode must be 'OPAQUE', 'MASK' or 'BLEND', got {alphaMode!r}")
        self.alphaCutoff = 0.5 if alphaCutoff is None else alphaCutoff
        self.emissiveFactor = np.zeros(3) if emissiveFactor is None else as_rgb("emissiveFactor", emissiveFactor, 3)
        self.normalTexture, self.occlusionTexture = as_texture(normalTexture), as_texture(occlusionTexture)
        self.emissiveTexture = as_texture(emissiveTexture)
        self.doubleSided, self.smooth, self.wireframe = bool(doubleSided), bool(smooth), bool(wireframe)


class MetallicRoughnessMaterial(Material):
    """The metallic-rough material of glTF.

    Parameters
    ----------
    name, normalTexture, occlusionTexture, emissiveTexture, emissiveFactor, alphaMode, alphaCutoff, doubleSided
        As for `Material`.
    baseColorFactor : (3,) or (4,) float, optional
        Linear red, green and blue of 0 to 1, and opacity.
    baseColorTexture, metallicRoughnessTexture : optional
    metallicFactor, roughnessFactor : float
    """

    baseColorFactor, metallicFactor, roughnessFactor = Color(4), Number(least=0), Number(least=0)

    def __init__(
        self, name: Any = None, normalTexture: Any = None, occlusionTexture: Any = None, emissiveTexture: Any = None,
        emissiveFactor: Any = None, alphaMode: Any = None, alphaCutoff: Any = None, doubleSided: bool = False,
        smooth: bool = True, wireframe: bool = False, baseColorFactor: Any = None, baseColorTexture: Any = None,
        metallicFactor: float | None = 1.0, roughnessFactor: float | None = 1.0, metallicRoughnessTexture: Any = None,
    ) -> None:  # fmt: skip
        super().__init__(
            name, normalTexture, occlusionTexture, emissiveTexture, emissiveFactor, alphaMode, alphaCutoff, doubleSided,
            smooth, wireframe,
        )  # fmt: skip
        self.baseColorFactor = np.ones(4) if baseColorFactor is None else baseColorFactor
        self.baseColorTexture = as_texture(baseColorTexture)
        self.metallicRoughnessTexture = as_texture(metallicRoughnessTexture)
        self.metallicFactor = 1.0 if metallicFactor is None else metallicFactor
        self.roughnessFactor = 1.0 if roughnessFactor is None else roughnessFactor

    @property
    def is_transparent(self) -> bool:
        """Whether something may show through."""
        if self.alphaMode == "OPAQUE":
            return False
        own = None if self.baseColorTexture is None else self.baseColorTexture.source
        return bool(self.baseColorFactor[3] < 1 or (own is not None and own.shape[2] == 4 and own[..., 3].min() < 255))


def as_texture(value: Any) -> Texture | None:
    """A texture of whatever a material takes as a texture."""
    return value if value is None or isinstance(value, Texture) else Texture(source=value)
