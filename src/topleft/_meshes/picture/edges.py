"""Draws the edges of triangles over a picture, where its visibility buffer does not hide them.

Input: a picture (H, W, 4) uint8, its `Fragments`, and the `Placed` that they were drawn from.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import F64
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.verbs import wireframe
from topleft._meshes.camera.camera import Camera
from topleft._meshes.picture.placed import Mask, Placed
from topleft._meshes.picture.shade import ShadingOptions
from topleft._meshes.scene.scene import Instance
from topleft.typing import CullOption

EDGE_COLOR = (24, 28, 40)
EDGE_BIAS = 2.0**-10  # of depth: edges that lie behind by less show
TURNED: Mapping[str, CullOption] = {"back": "front", "front": "back"}


def draw_all_edges(
    picture: npt.NDArray[np.uint8],
    frags: Fragments,
    placed: Placed,
    options: ShadingOptions,
    *,
    cull: CullOption | None,
) -> None:
    """Draw the edges of every instance that the visibility buffer does not hide."""
    behind, camera = depth_behind(frags.depth), placed.camera
    if not camera.has_planes:  # depth has no unit that the bias of lines could be given in
        behind += EDGE_BIAS * np.abs(frags.depth)
    for i, instance in enumerate(placed.whole):
        mesh = instance.mesh
        is_single = None if cull is not None else mesh.single_sided(options.material or instance.material)
        sides: list[tuple[Mask | None, CullOption]] = [(None, cull_of(cull or "none", instance, camera))]
        if is_single is not None:  # single-sided triangles have edges on their fronts alone
            sides = [(is_single == 0, "none"), (is_single == 1, cull_of("back", instance, camera))]
        for mask, side in sides:
            vertices, transform = mesh.vertices, placed.clip_from_objects[i]
            triangles: npt.NDArray[Any] = mesh.triangles if mask is None else mesh.triangles[mask]
            if placed.bent is not None:
                vertices, transform = placed.bent[i].points_eye, placed.clip_from_world
                triangles, side = placed.bent[i].outline(transform, side, mask), "none"
            draw_edges(picture, behind, vertices, triangles, transform, side, camera, threads=options.threads)


def cull_of(cull: CullOption, instance: Instance, camera: Camera) -> CullOption:
    """The option `cull` for an instance, turned over where it shows in a mirror."""
    return TURNED.get(cull, cull) if instance.is_mirrored != camera.is_mirrored else cull


def draw_edges(
    picture: npt.NDArray[np.uint8],
    depth: npt.NDArray[np.float32],
    vertices: npt.NDArray[Any],
    triangles: npt.NDArray[Any],
    transform: F64,
    cull: CullOption,
    camera: Camera,
    *,
    threads: int | None,
) -> None:
    """Draw the edges of triangles over the picture (H, W, 4), where they are not behind a depth (H, W)."""
    size = depth.shape[::-1]
    lines = wireframe(
        vertices, triangles, size, transform=transform, depth=depth, antialias=True, cull=cull, threads=threads,
        depth_bias=EDGE_BIAS if camera.has_planes else 0.0, **camera.depth_options,
    )  # fmt: skip
    on = lines > 0
    share = lines[on][:, None]
    under = picture[on].astype(np.float32)
    alpha = share + (1 - share) * (under[:, 3:] / 255)  # "over", T. Porter, T. Duff, Compositing Digital Images, 1984
    rgb = share * np.array(EDGE_COLOR, np.float32) + (1 - share) * (under[:, 3:] / 255) * under[:, :3]
    picture[on] = np.rint(np.hstack([rgb / alpha, 255 * alpha])).astype(np.uint8)


def depth_behind(depth: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """The depth that edges may have and still show: farther by the slope of the surface within a pixel.

    The slope along each axis is the smaller slope to the two neighbours: the other may jump to another surface.
    """
    behind = depth.copy()
    for axis in range(2):
        with np.errstate(invalid="ignore"):
            step = np.abs(np.diff(depth, axis=axis, prepend=np.inf, append=np.inf))
        before, after = np.delete(step, -1, axis), np.delete(step, 0, axis)
        slope = np.fmin(before, after)  # NaN: nothing on either side
        behind += np.where(np.isfinite(slope), slope, 0)
    return behind
