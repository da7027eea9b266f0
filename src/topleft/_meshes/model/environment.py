"""Environments: light that comes from all around, as values; a picture of it is blurred once for every roughness.

Input: colours, or a picture of all directions. Output: the kernels' inputs.

A picture is turned from its equirectangular form into an octahedron unfolded to a square. Level k is for surfaces of
roughness k / 8: light averaged over the facets of GGX seen from straight above (normal, view and mirrored
direction are one). The two of the least roughness are means of 64 directions, from halvings as large as the part that a
direction stands for; the others are sums over all texels of a halving.

Based on: Engelhardt, T. and C. Dachsbacher, "Octahedron Environment Maps", 2008; Karis, B., "Real Shading in Unreal
Engine 4", SIGGRAPH 2013 courses (levels by roughness); Colbert, M. and J. Krivanek, "GPU-Based Importance Sampling",
GPU Gems 3, 2007 (halvings by the density of the directions).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F32, F64, I32
from topleft._core.base.arrays import as_array, as_number, as_vector, set_read_only
from topleft._core.base.cached import cached_property
from topleft._core.base.color import LIGHT_OF_SRGB, Color, ColorLike, as_color, light_of
from topleft._core.base.options import parse
from topleft._meshes.model.light import TO_HEADLIGHT, as_not_negative
from topleft.typing import SpaceOption

N_ROUGH = 8
"""Levels beyond that of a mirror; roughness lies between them linearly."""

SIZES_OF_ROUGH = (128, 128, 64, 32, 32, 32, 32, 32)
"""Sides of these levels: texels are smaller than half of what the facets blur; those of the first are as large."""

LARGEST_MIRROR = 512
N_DIRECTIONS = 64
SIZE_OF_MATT = 32

LEAST_SUMMED, SIZE_OF_SUMS = 0.3, 64
"""The least roughness that sums all texels of a halving, and its side: 3 degrees, where facets blur by 10."""


@dataclass(frozen=True, eq=False)
class Environment:
    """Light from all around: a colour, a sky over a ground, or a picture of all directions.

    Matt surfaces gather it from their side, metallic-rough ones mirror it too, blurred by their roughness.

    Parameters
    ----------
    sky : (3,) of 0 to 255
        sRGB above the horizon; all around unless there is a ground.
    ground : (3,) of 0 to 255, optional
        sRGB below the horizon.
    image : (H, W, 3) array_like, optional
        Instead of these: uint8 as sRGB, or float as linear light, 0 up. Longitude runs along the rows, the middle
        column is +x, and a quarter to its left -z; row 0 is the top.
    intensity : float
        Not negative; 1: a white matt surface in a white environment is white.
    up : (3,) of float
        Where the top is, in `space`.
    turn : float
        Degrees by which all is turned about `up`, counter-clockwise from above.
    space : {"world", "eye"}
        "eye": it moves with the camera.

    Raises
    ------
    ValueError
        If a number is outside its range or not finite, or the picture has another shape or is empty.
    TypeError
        If the picture holds neither uint8 nor float.

    Examples
    --------
    >>> Environment((120, 160, 255), ground=(60, 50, 40)).intensity
    1.0
    """

    sky: Color = (255, 255, 255)
    ground: Color | None = None
    image: npt.NDArray[Any] | None = None
    intensity: float = 1.0
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    turn: float = 0.0
    space: str = "world"

    if TYPE_CHECKING:  # anything that NumPy reads may be given; the types above are kept

        def __init__(
            self,
            sky: ColorLike = (255, 255, 255),
            ground: ColorLike | None = None,
            image: npt.ArrayLike | None = None,
            intensity: float = 1.0,
            up: npt.ArrayLike = (0.0, 1.0, 0.0),
            turn: float = 0.0,
            space: SpaceOption = "world",
        ) -> None: ...

    def __post_init__(self) -> None:
        keep = object.__setattr__  # the dataclass is frozen, and its values are coerced
        keep(self, "sky", as_color("sky", self.sky, 3))
        if self.ground is not None:
            keep(self, "ground", as_color("ground", self.ground, 3))
        if self.image is not None:
            keep(self, "image", _as_light(self.image))
        keep(self, "intensity", as_not_negative("intensity", self.intensity))
        keep(self, "up", tuple(as_vector("up", self.up).tolist()))
        if not any(self.up):
            raise ValueError(f"up must be a direction, got {self.up}")
        keep(self, "turn", as_number("turn", self.turn))
        if not np.isfinite(self.turn):
            raise ValueError(f"turn must be finite, got {self.turn!r}")
        keep(self, "space", parse(SpaceOption, "space", self.space))

    @property
    def colors(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Light of the sky and of the ground."""
        sky = tuple(self.intensity * c for c in light_of(self.sky)[:3])
        return sky, sky if self.ground is None else tuple(self.intensity * c for c in light_of(self.ground)[:3])

    @property
    def axes(self) -> F64:
        """The rotation (3, 3) that takes directions of `space` to where y is up."""
        up = np.array(self.up) / engine.length(self.up)
        cosine = up[1]
        if cosine < -1 + 1e-12:
            upright = np.diag([1.0, -1.0, -1.0])
        else:  # the shortest way from `up` to y
            cross = np.array([[0, -up[0], 0], [up[0], 0, up[2]], [0, -up[2], 0]])
            upright = np.eye(3) + cross + engine.product(cross, cross) / (1 + cosine)
        c, s = engine.cosine_and_sine(self.turn)
        return engine.product(np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]), upright)

    @cached_property
    def levels(self) -> tuple[F32, I32] | None:
        """Texels (N, 4) and rows (offset, size) of the levels of a picture, made when first needed, or None."""
        if self.image is None:
            return None
        halvings = mirrored_levels(self.image)
        mirror = halvings[0]
        sides = [min(size, len(mirror)) for size in SIZES_OF_ROUGH]
        rough = [blurred(halvings, side, (k + 1) / N_ROUGH) for k, side in enumerate(sides)]
        levels = [mirror, *rough, gathered(halvings, min(SIZE_OF_MATT, len(mirror)), lambda cosine: cosine)]
        padded = [bordered(level) for level in levels]
        ends = np.cumsum([0] + [side * side for side in map(len, padded)])
        rows = [(end, len(level)) for end, level in zip(ends[:-1], levels, strict=True)]
        texels = np.zeros((ends[-1], 4), np.float32)
        texels[:, :3] = np.concatenate([level.reshape(-1, 3) for level in padded]) * self.intensity
        return texels, np.array(rows, np.int32)

    def __getstate__(self) -> dict[str, Any]:
        """The state for another process, which makes the levels itself."""
        return {field.name: self.__dict__[field.name] for field in fields(self)}

    __setstate__ = set_read_only


DEFAULT_ENVIRONMENT = Environment((255, 255, 255), ground=(90, 90, 90), up=tuple(TO_HEADLIGHT.tolist()), space="eye")
"""Metallic surfaces mirror it unless one is given: white on the side of the headlight, a tenth of it behind."""


def _as_light(image: npt.ArrayLike) -> F32:
    """The picture as its own read-only linear light (H, W, 3)."""
    array = as_array("image", image)
    if array.ndim != 3 or array.shape[2] != 3 or 0 in array.shape:
        raise ValueError(f"image must have shape (H, W, 3) and pixels, got {array.shape}")
    if array.dtype == np.uint8:
        light = LIGHT_OF_SRGB[array]
    elif array.dtype.kind == "f":
        light = array.astype(np.float32)
        if not (np.isfinite(light).all() and light.min() >= 0):
            raise ValueError("image must hold finite light that is not negative")
    else:
        raise TypeError(f"image must be uint8 or float, got {array.dtype}")
    light.flags.writeable = False
    return light


def octahedral_directions(n: int) -> tuple[F32, F32]:
    """Unit vectors (n, n, 3) at the centres of the texels of an unfolded octahedron, and their solid angles (n, n)."""
    axis = (2 * np.arange(n, dtype=np.float32) + 1) / np.float32(n) - 1
    x, z = np.meshgrid(axis, axis)
    y = 1 - np.abs(x) - np.abs(z)
    below = np.maximum(-y, 0)
    at = np.stack([x - np.copysign(below, x), y, z - np.copysign(below, z)], axis=2)
    length = np.sqrt((at * at).sum(axis=2, keepdims=True))
    angle = 1 / (length * length * length)[..., 0]
    return (at / length).astype(np.float32), angle * np.float32(4 * np.pi / float(angle.sum()))


def mirrored_levels(image: F32) -> list[F32]:
    """The picture on an unfolded octahedron, and its halvings down to one texel."""
    height, width = image.shape[:2]
    n = 8
    while n < min(LARGEST_MIRROR, 0.56 * width):  # then texels have the same solid angle
        n *= 2
    step = max(1, width // (3 * n))
    if step > 1 and height // step:
        rows, columns = height // step, width // step
        blocks = image[: rows * step, : columns * step].reshape(rows, step, columns, step, 3)
        image = blocks.mean(axis=(1, 3), dtype=np.float32)
    fine: F32 = look_up_sphere(image, octahedral_directions(2 * n)[0].reshape(-1, 3)).reshape(2 * n, 2 * n, 3)
    levels: list[F32] = []
    while len(fine) > 1:
        fine = (fine[::2, ::2] + fine[1::2, ::2] + fine[::2, 1::2] + fine[1::2, 1::2]) / np.float32(4)
        levels.append(fine)
    return levels


def look_up_sphere(image: F32, at: F32) -> F32:
    """The light (P, 3) of an equirectangular picture in unit directions, between its four nearest pixels."""
    height, width = image.shape[:2]
    _, away = engine.off_axis(np.stack([at[:, 2], np.zeros(len(at)), at[:, 0]], axis=1))
    _, below = engine.off_axis(at[:, [0, 2, 1]])
    x = (np.copysign(away, at[:, 2]) / (2 * np.pi) + 0.5) * width - 0.5
    y = below / np.pi * height - 0.5
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    share_x, share_y = (x - column)[:, None].astype(np.float32), (y - row)[:, None].astype(np.float32)
    columns = [(column + k) % width for k in (0, 1)]
    rows = [np.clip(row + k, 0, height - 1) for k in (0, 1)]
    upper, lower = ((1 - share_x) * image[own, columns[0]] + share_x * image[own, columns[1]] for own in rows)
    mixed: F32 = (1 - share_y) * upper + share_y * lower
    return mixed


def bordered(level: F32) -> F32:
    """The level (n, n, 3) with a border of one texel, from beyond the edges of the unfolded octahedron."""
    n = len(level)
    whole = np.empty((n + 2, n + 2, 3), np.float32)
    whole[1:-1, 1:-1] = level
    whole[0, 1:-1], whole[-1, 1:-1] = level[0, ::-1], level[-1, ::-1]
    whole[1:-1, 0], whole[1:-1, -1] = level[::-1, 0], level[::-1, -1]
    whole[0, 0], whole[0, -1], whole[-1, 0], whole[-1, -1] = level[-1, -1], level[-1, 0], level[0, -1], level[0, 0]
    return whole


def look_up_octahedron(level: F32, at: F32) -> F32:
    """The light (P, 3) of a bordered level in directions."""
    n = len(level) - 2
    at = at / np.abs(at).sum(axis=1, keepdims=True)
    flat = at[:, ::2]
    folded = np.copysign(1 - np.abs(flat[:, ::-1]), flat)
    where = (0.5 * np.where(at[:, 1:2] < 0, folded, flat) + 0.5) * n + 0.5
    first = np.clip(np.floor(where).astype(np.int32), 0, n)
    share = where - first
    texels = level.reshape(-1, 3)
    start = first[:, 1] * (n + 2) + first[:, 0]
    x, y = share[:, :1], share[:, 1:]
    upper = (1 - x) * texels[start] + x * texels[start + 1]
    lower = (1 - x) * texels[start + n + 2] + x * texels[start + n + 3]
    mixed: F32 = (1 - y) * upper + y * lower
    return mixed


def blurred(halvings: list[F32], size: int, roughness: float) -> F32:
    """The light that a surface of this roughness reflects, by direction, (size, size, 3)."""
    alpha2 = roughness * roughness * roughness * roughness
    if roughness > LEAST_SUMMED:

        def facets(cosine: F32) -> F32:
            spread: F32 = np.float32(0.5 * (alpha2 - 1)) * (1 + cosine) + 1
            return cosine / (spread * spread)

        return gathered(halvings, size, facets)
    normal = octahedral_directions(size)[0].reshape(-1, 3)
    helper = np.where(np.abs(normal[:, 1:2]) < 0.9, [[0, 1, 0]], [[1, 0, 0]]).astype(np.float32)
    tangent = np.cross(helper, normal)
    tangent /= np.sqrt((tangent * tangent).sum(axis=1, keepdims=True))
    bitangent = np.cross(normal, tangent)
    whole = [bordered(level) for level in halvings]
    light, weights = np.zeros((len(normal), 3), np.float32), 0.0
    for k in range(N_DIRECTIONS):  # Hammersley's points on the distribution of the facets
        share, around_deg = (k + 0.5) / N_DIRECTIONS, 360 * int(f"{k:06b}"[::-1], 2) / N_DIRECTIONS
        squared = (1 - share) / (1 + (alpha2 - 1) * share)  # the cosine of the facet
        cosine = 2 * squared - 1  # of the direction that it mirrors
        if cosine <= 0:
            continue
        sine = math.sqrt(1 - cosine * cosine)
        across, along = engine.cosine_and_sine(around_deg)
        spread = squared * (alpha2 - 1) + 1
        density = alpha2 / (np.pi * spread * spread) / 4
        own, texel = 1 / (N_DIRECTIONS * density), 4 * np.pi / halvings[0].shape[0] ** 2
        lod = min(max(0.5 * engine.log2(own / texel) + 0.5, 0.0), len(halvings) - 1.0)
        at = tangent * np.float32(sine * across) + bitangent * np.float32(sine * along)
        at += normal * np.float32(cosine)
        fine = int(lod)
        seen = look_up_octahedron(whole[fine], at)
        if lod > fine:
            seen += np.float32(lod - fine) * (look_up_octahedron(whole[fine + 1], at) - seen)
        light += np.float32(cosine) * seen
        weights += cosine
    return (light / np.float32(weights)).reshape(size, size, 3)


def gathered(halvings: list[F32], size: int, weigh: Callable[[F32], F32]) -> F32:
    """The mean of all light by a weight of the cosine, 0 below the horizon, in each direction, (size, size, 3)."""
    source = next((level for level in halvings if len(level) <= SIZE_OF_SUMS), halvings[-1])
    to, angle = octahedral_directions(len(source))
    light = np.concatenate([source, np.ones_like(angle)[..., None]], axis=2) * angle[..., None]
    x, y, z = to.reshape(-1, 3).T.copy()
    channels = light.reshape(-1, 4).T.copy()
    sums = []
    # Products of matrices would have other last bits on other processors.
    for some in np.array_split(octahedral_directions(size)[0].reshape(-1, 3), max(1, size * size // 32)):
        cosine = some[:, :1] * x + some[:, 1:2] * y + some[:, 2:] * z
        weights = weigh(np.maximum(cosine, 0))
        sums.append(np.stack([(weights * channel).sum(axis=1) for channel in channels], axis=1))
    total = np.concatenate(sums)
    mean = total[:, :3] / total[:, 3:]
    return mean.astype(np.float32).reshape(size, size, 3)
