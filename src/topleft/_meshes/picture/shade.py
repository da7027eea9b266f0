"""Shades the visible pixels of instances, all samples of them; colours by ids and distances; gives normals.

Input: samples, the instances that show, and a camera. Output: a picture (H, W, 4) uint8, sRGB with alpha.

Light is added up in linear light: colours are decoded from sRGB, lit, and encoded again, so that a surface that gets
half the light is half as bright on a screen. The kernel is csrc/shade/shade.c.

Based on: Phong, B. T., "Illumination for Computer Generated Pictures", Communications of the ACM 18(6), 1975 (normals
interpolated, light computed in the pixel); Blinn, J. F., "Models of Light Reflection for Computer Synthesized
Pictures", SIGGRAPH 1977 (highlights).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, TypedDict

import numpy as np

from topleft._core import engine
from topleft._core.base.array_types import F32, F64, I32, U8
from topleft._core.base.arrays import INT32_MAX
from topleft._core.base.color import DEFAULT_COLOR, WHITE, Color, ColorLike, as_color, id_colors, srgb_tables
from topleft._core.base.memory import empty
from topleft._core.base.options import parse
from topleft._core.base.threads import count_threads, parse_threads, run_parts, threads_for
from topleft._core.raster.fragments import Fragments, SampleBuffers
from topleft._core.raster.sampling import sample_positions
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.environment import Environment
from topleft._meshes.model.light import AMBIENT, Fog, Light, as_lights, as_not_negative
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.texture import Texture
from topleft._meshes.picture.look import ShadingInputs, Surface, light_rows
from topleft.typing import ShadingOption

MIN_PX_PER_THREAD = 1 << 14
"""Pixels whose light is worth a thread: a tenth of a millisecond. A scene is shaded instance by instance."""


SHOW_CODES = {"normals": 1, "matcap": 2}  # tl_show in csrc/pixels/shading.h; light: 0
NUMBERS = frozenset({"ids", "depth"})
"""Modes that colour numbers of the buffer, without light."""

PLAIN = Surface((Material(),), is_by_triangle=False)
"""Fills the place of the materials in pictures of normals, which read none."""

GREY_OF_NEAREST, GREY_OF_FARTHEST = 224, 32
"""Greys of the depth picture: neither black nor white, so that it shows on both."""


class LookOptions(TypedDict, total=False):
    """The options of `shade` that `render` passes on."""

    lights: Light | Sequence[Light] | None
    ambient: float | None
    material: Material | None
    matcap: Texture | None
    fog: Fog | None
    environment: Environment | None


@dataclass(frozen=True, eq=False)
class ShadingOptions:
    """The options of `topleft.shade`, checked."""

    mode: ShadingOption
    color: Color
    background: Color
    depth_range: tuple[float, float] | None
    lights: Sequence[Light] | None
    ambient: float
    material: Material | None
    matcap: Texture | None
    fog: Fog | None
    environment: Environment | None
    threads: int | None
    shows_opacity: bool = False
    """Whether the picture's alpha is the opacity of the surface."""

    @classmethod
    def parse(
        cls,
        shading: ShadingOption = "smooth",
        color: ColorLike = DEFAULT_COLOR,
        background: ColorLike = WHITE,
        depth_range: tuple[float, float] | None = None,
        lights: Light | Sequence[Light] | None = None,
        ambient: float | None = None,
        material: Material | None = None,
        matcap: Texture | None = None,
        fog: Fog | None = None,
        environment: Environment | None = None,
        threads: int | None = None,
    ) -> ShadingOptions:
        """Check the options of a call."""
        mode = parse(ShadingOption, "shading", shading)
        lights = None if lights is None else as_lights(lights)
        kinds = {"material": Material, "matcap": Texture, "fog": Fog, "environment": Environment}
        for (name, kind), value in zip(kinds.items(), (material, matcap, fog, environment), strict=True):
            if value is not None and not isinstance(value, kind):
                article = "an" if kind is Environment else "a"
                raise TypeError(f"{name} must be {article} {kind.__name__}, got {type(value).__name__}")
        if mode == "matcap" and matcap is None:
            raise ValueError("matcap must be a Texture for shading 'matcap', got None")
        if environment is not None:  # which lights by itself
            lights, ambient = lights or (), ambient or 0.0
        return cls(
            mode,
            as_color("color", color, 3),
            as_color("background", background, 4),
            depth_range,
            lights,
            AMBIENT if ambient is None else as_not_negative("ambient", ambient),
            material,
            matcap,
            fog,
            environment,
            parse_threads(threads),
        )


@lru_cache(maxsize=64)
def plain_material(color: Color | None) -> Material:
    """The material of a mesh that has none; the check of a material takes a hundredth of a small picture."""
    return Material(color)


class ShownInstance(NamedTuple):
    """An instance as it is shaded."""

    snapped: engine.SnappedMesh
    mesh: Mesh
    """The mesh as it was drawn, which kernels read triangle by triangle: of a lens its parts."""
    place: F64
    """World from object, (4, 4)."""
    first_id: int = 0
    """The id of its triangle 0."""
    material: Material | None = None
    """Goes before the materials of the mesh."""
    i: int = 0
    """Its number in the scene."""


def inputs_of(
    shown: Sequence[ShownInstance], surfaces: Sequence[Surface], camera: Camera, size: tuple[int, int]
) -> ShadingInputs:
    """The kernels' inputs of instances, as a camera without a lens sees them."""
    finds_inverse_w = sum(len(one.mesh.vertices) for one in shown) > size[0] * size[1]
    places = np.array([one.place for one in shown])
    given = [(one.snapped, one.mesh, surface) for one, surface in zip(shown, surfaces, strict=True)]
    return ShadingInputs(given, camera, places, size, finds_inverse_w=finds_inverse_w)


class Lit:
    """Instances that are ready to be shaded: at least all visible instances, in the order of their ids."""

    def __init__(
        self, shown: Sequence[ShownInstance], camera: Camera, size: tuple[int, int], options: ShadingOptions
    ) -> None:
        self.options, self.size = options, size
        self.n_triangles = sum(len(one.mesh.triangles) for one in shown)
        if self.n_triangles and all(size):
            self.subpixel_bits = shown[0].snapped.subpixel_bits
            surfaces = [surface_of(one, options) for one in shown]
            inputs = inputs_of(shown, surfaces, camera, size)
            inputs.set_lights(None if options.lights is None else light_rows(options.lights), options.ambient)
            for k, surface in enumerate(surfaces):
                if options.environment is not None or surface.is_metallic:
                    inputs.set_environment(k, options.environment)
            show = SHOW_CODES.get(options.mode, 0), options.matcap, options.background, options.fog
            inputs.set_picture(*show, has_opacity=options.shows_opacity)
            self.scene = scene_of_tables(shown, inputs.tables)

    def picture(self, seen: SampleBuffers, at: I32 | None = None) -> U8:
        """Shade the triangles that show, all samples of them: the picture (H, W, 4) uint8.

        `at`: where the one sample that sees them lies, sub-pixels from the centre, unless the meshes are seen from it.
        """
        width, height = self.size
        picture = empty((height, width, 4), np.uint8)
        if not self.n_triangles or not picture.size:
            picture[...] = self.options.background
            return picture
        positions = None if seen.n_samples == 1 else sample_positions(seen.n_samples, self.subpixel_bits)

        def shade_rows(first: int, end: int) -> None:
            part = picture, first, end - first
            if positions is None:
                self.scene.shade(seen.ids[0], seen.depth[0], *part, at)
            else:
                self.scene.shade_samples(positions, seen.ids, seen.depth, *part)

        n_threads = min(count_threads(self.options.threads, self.n_triangles), width * height // MIN_PX_PER_THREAD)
        run_parts(shade_rows, height, n_threads)
        return picture


def shade_instances(shown: Sequence[ShownInstance], seen: SampleBuffers, camera: Camera, options: ShadingOptions) -> U8:
    """The picture (H, W, 4) uint8 of instances, as `Lit` has it."""
    height, width = seen.ids.shape[1:]
    if seen.ids.dtype == np.int32:
        return Lit(shown, camera, (width, height), options).picture(seen)
    renamed = rename(shown, seen)
    if renamed is not None:
        return Lit(renamed[0], camera, (width, height), options).picture(renamed[1])
    halves = []
    for first, end in ((0, height // 2), (height // 2, height)):
        ids, depth = (np.ascontiguousarray(planes[:, first:end]) for planes in (seen.ids, seen.depth))
        moved = [one._replace(snapped=one.snapped.moved(0, first)) for one in shown]
        halves.append(shade_instances(moved, SampleBuffers.of(ids, depth), camera, options))
    return np.concatenate(halves)


def rename(shown: Sequence[ShownInstance], seen: SampleBuffers) -> tuple[list[ShownInstance], SampleBuffers] | None:
    """Number the triangles of the instances that are seen in int32; None where it does not hold them.

    A row of pixels is not halved.
    """
    first_ids = np.array([one.first_id for one in shown], np.int64)
    place = np.searchsorted(first_ids, seen.ids, side="right") - 1
    own = [shown[i] for i in np.unique(place[place >= 0])]
    ends = np.cumsum([0, *(len(one.mesh.triangles) for one in own)])
    if ends[-1] > INT32_MAX and seen.ids.shape[1] > 1:
        return None
    if ends[-1] > INT32_MAX:
        raise ValueError(f"the instances in a row of pixels must have at most {INT32_MAX} triangles, got {ends[-1]}")
    new = np.searchsorted([one.first_id for one in own], seen.ids, side="right") - 1
    shift = np.array([one.first_id for one in own] + [0], np.int64) - [*ends[:-1], 0]
    ids = (seen.ids - shift[new]).astype(np.int32)
    named = [one._replace(first_id=int(end)) for one, end in zip(own, ends[:-1], strict=True)]
    return named, seen._replace(ids=ids)


def scene_of_tables(shown: Sequence[ShownInstance], tables: Sequence[engine.ShadingTable]) -> engine.ShadedScene:
    """The kernels' inputs of instances."""
    return engine.ShadedScene([one.snapped for one in shown], tables, [one.first_id for one in shown])


def surface_of(shown: ShownInstance, options: ShadingOptions) -> Surface:
    """The surface of an instance, kept with its mesh."""
    mesh = shown.mesh
    material = shown.material if options.material is None else options.material
    is_full = options.environment is not None or options.shows_opacity
    look = options.mode == "flat", options.mode == "unlit", is_full

    def make() -> Surface:
        own = mesh.materials if material is None else (material,)
        plain = own or (plain_material(options.color if mesh.colors is None else None),)
        return Surface(plain, own is mesh.materials and len(own) > 1, *look)

    return mesh.cache.surfaces.find(material, make, *look, options.color)


def shade_numbers(frags: Fragments, camera: Camera, options: ShadingOptions) -> U8:
    """Colour each triangle by its id, or by its distance: the picture (H, W, 4) uint8."""
    seen = frags._buffers()
    if options.mode == "ids":
        return shade_each(seen, options.background, lambda ids, _: id_colors(frags._whole(ids)))
    ends = options.depth_range or distances(seen, camera)
    return shade_each(seen, options.background, lambda _, depth: greys_of(depth, camera, ends))


def shade_each(seen: SampleBuffers, background: Color, colors_of: Callable[[I32, F32], U8]) -> U8:
    """The picture (H, W, 4) uint8 of colours (P, 3) that ids and depths have.

    A triangle has one colour in a pixel, that at the first of the samples that see it. Their light is averaged, alpha
    as it is.
    """
    ids, depth = seen.ids[0], seen.depth[0]
    picture = empty((*ids.shape, 4), np.uint8)
    picture[...] = background
    at = np.nonzero(ids >= 0)
    picture[at] = opaque(colors_of(ids[at], depth[at]))
    if seen.n_samples == 1:
        return picture
    at, split_ids, split_depth = seen.split_pixels()
    colors = np.empty((*split_ids.shape, 4), np.uint8)
    colors[...] = background
    colors[0] = picture[at]
    for k, own in enumerate(split_ids[1:], 1):
        is_new = own >= 0
        for before in range(k):
            is_known = is_new & (own == split_ids[before])
            colors[k, is_known] = colors[before, is_known]
            is_new &= ~is_known
        colors[k, is_new] = opaque(colors_of(own[is_new], split_depth[k, is_new]))
    means = np.empty((1, *colors.shape[1:]), np.uint8)
    engine.mean_colors(colors[:, None], means, 0, 1, 4, engine.Transfer(srgb_tables(), 3, is_straight=True))
    picture[at] = means[0]
    return picture


def opaque(colors: U8) -> U8:
    """Colours (P, 3) with alpha 255."""
    return np.concatenate([colors, np.full((len(colors), 1), 255, np.uint8)], axis=1)


def greys_of(depth: F32, camera: Camera, ends: tuple[float, float]) -> U8:
    """The greys (P, 3) of depths: near ones are bright, the ends of the range are neither black nor white."""
    nearest, farthest = ends
    share = np.clip((camera.distance_of(depth) - nearest) / max(farthest - nearest, np.finfo(np.float64).tiny), 0, 1)
    grey = np.rint(GREY_OF_NEAREST + (GREY_OF_FARTHEST - GREY_OF_NEAREST) * share).astype(np.uint8)
    return np.repeat(grey[:, None], 3, axis=1)


def distances(seen: SampleBuffers, camera: Camera) -> tuple[float, float]:
    """The least and the greatest distance of visible samples along the view."""
    depth = seen.depth[0][seen.ids[0] >= 0]
    if seen.n_samples > 1:
        _, ids, others = seen.split_pixels()
        depth = np.append(depth, others[ids >= 0])
    if not depth.size:
        return 0.0, 0.0
    ends = camera.distance_of(np.array([depth.min(), depth.max()]))
    return float(ends[0]), float(ends[1])


def shade_normals(
    shown: Sequence[ShownInstance], ids: I32, camera: Camera, turn: F64, *, threads: int | None = None
) -> F32:
    """Unit normals (H, W, 3) float32 of the visible pixels, on the side that is seen, 0 where nothing is.

    `shown`: at least the instances that show, in the order of their ids. `turn`: (3, 3), from eye space to the result.

    A triangle seen from behind has its normals turned round as a whole, never pixel by pixel: so a mesh whose faces are
    inverted looks like one whose faces are not, and no edge of light runs through a triangle. Where those of the
    corners cancel, or there are none, it is the normal of the face.
    """
    n_triangles = sum(len(one.mesh.triangles) for one in shown)
    if not n_triangles or 0 in ids.shape:
        return np.zeros((*ids.shape, 3), np.float32)
    out = empty((*ids.shape, 3), np.float32)
    inputs = inputs_of(shown, [PLAIN] * len(shown), camera, (ids.shape[1], ids.shape[0]))
    inputs.set_turn(SHOW_CODES["normals"], turn)
    scene = scene_of_tables(shown, inputs.tables)
    run_parts(lambda first, end: scene.shade_normals(ids, out, first, end - first), len(ids),
              threads_for(threads, n_triangles))  # fmt: skip
    return out
