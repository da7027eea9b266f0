"""Draws the objects of a scene one by one and together: the full mask of each, and its visible part.

Input: `Scene`, `Camera`. Output: `ObjectMasks`: masks, run lengths, boxes, visible shares.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass, replace
from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import F64, I32, I64, MeshLike
from topleft._core.base.arrays import as_array, as_count, as_number, shown
from topleft._core.base.cached import cached_property
from topleft._core.base.defaults import DEFAULT_SIZE
from topleft._core.base.memory import FRESH, check_fits
from topleft._core.base.options import check_choice
from topleft._core.raster.rle import RunTable, annotation_of, encode_ids
from topleft._meshes.camera.camera import CameraLike
from topleft._meshes.camera.matrices import box_corners
from topleft._meshes.model.normals import moved
from topleft._meshes.picture.fragments import SceneFragments
from topleft._meshes.picture.holes import cuts_of, draw_solid
from topleft._meshes.picture.placed import Placed
from topleft._meshes.picture.shot import Shot
from topleft._meshes.scene.scene import Instance, Scene
from topleft.typing import CullOption

Window = tuple[int, int, int, int]
"""Left, top, right and bottom, pixels of the picture, which may reach beyond it."""

NO_BOX = (0, 0, 0, 0)
MOST_BEYOND_PX = 2**30


@dataclass(frozen=True, eq=False)
class ObjectMasks:
    """The masks of the objects of a scene: the result of `object_masks`.

    Attributes
    ----------
    size : (width, height), pixels
    instance : ndarray of int32, shape (H, W)
        Index of the object that shows, -1 where there is none.
    n_visible, n_full : ndarray of int64, shape (N,)
        Pixels that show, and pixels of the object alone, beyond the picture too.
    visible_share : ndarray of float64, shape (N,)
        The first by the second; 0 of an object without pixels.
    boxes_visible, boxes_full : ndarray of int32, shape (N, 4)
        Left, top, right, bottom of these pixels, right and bottom the first that are not in it; zeros without any.

    Examples
    --------
    >>> import numpy as np
    >>> import topleft as tl
    >>> near = tl.Mesh([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], [(0, 1, 2), (0, 2, 3)])
    >>> behind = tl.Mesh([(0, -1, 0), (2, -1, 0), (2, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)])
    >>> camera = tl.Camera.look_at((0, 0, 5), ortho_height=4)
    >>> found = tl.object_masks(tl.Scene([near, behind]), camera, (8, 8))
    >>> found.n_visible.tolist(), found.n_full.tolist(), found.visible_share.tolist()
    ([16, 8], [16, 16], [1.0, 0.5])
    >>> found.full(1)[3].astype(int).tolist(), found.visible(1)[3].astype(int).tolist()
    ([0, 0, 0, 0, 1, 1, 1, 1], [0, 0, 0, 0, 0, 0, 1, 1])
    """

    size: tuple[int, int]
    instance: I32
    n_visible: I64
    n_full: I64
    boxes_visible: I32
    boxes_full: I32
    _windows: tuple[tuple[tuple[int, int], npt.NDArray[np.bool_]], ...]  # a corner and the mask from there on

    def __len__(self) -> int:
        return len(self.n_full)

    def __repr__(self) -> str:
        width, height = self.size
        return f"ObjectMasks({len(self)} objects, {int((self.n_visible > 0).sum())} of them show, {width}x{height})"

    @cached_property
    def visible_share(self) -> F64:
        """The visible share of each object's full mask."""
        return self.n_visible / np.maximum(self.n_full, 1)

    def visible(self, i: int) -> npt.NDArray[np.bool_]:
        """The pixels (H, W) in which object i shows."""
        return self.instance == self._checked(i)

    def full(self, i: int) -> npt.NDArray[np.bool_]:
        """The pixels (H, W) that object i covers, whatever stands before it."""
        mask = np.zeros(self.size[::-1], np.bool_)
        ((x, y), window) = self._windows[self._checked(i)]
        left, top, right, bottom = self._inside((x, y), window)
        mask[y + top : y + bottom, x + left : x + right] = window[top:bottom, left:right]
        return mask

    def rle(self, which: Literal["visible", "full"] = "visible", *, compressed: bool = True) -> list[dict[str, Any]]:
        """Run lengths of the visible or the full mask of each object within the picture, as `to_rle` returns them.

        Raises
        ------
        ValueError
            If it is neither.
        """
        check_choice("which", which, ("visible", "full"))
        if which == "visible":
            return encode_ids(self.instance, np.arange(len(self)), compressed=compressed)
        table = RunTable(self.size)
        for i, (corner, mask) in enumerate(self._windows):
            table.add(mask.view(np.uint8)[None], box=self._inside(corner, mask), at=corner, key=i)
        return table.encode(table.keys.astype(np.int32), len(self), compressed=compressed)

    def scene_gt_info(self, depth: npt.ArrayLike | None = None) -> list[dict[str, Any]]:
        """The fields of BOP's scene_gt_info.json for each object of an image.

        Parameters
        ----------
        depth : (H, W) array_like, optional
            A measured depth: `px_count_valid` is the number of pixels of the object that have one, finite and not 0.
            Unless given every pixel has.

        Returns
        -------
        list of dict
            `px_count_all`, `px_count_valid`, `px_count_visib`, `visib_fract`, `bbox_obj` and `bbox_visib`. Boxes are
            left, top, and how far the last column and row are from the first, as BOP's tools write them: one less than
            the number of columns and rows; all -1 of an object that does not show.

        Raises
        ------
        ValueError
            If the depth has another shape.
        """
        measured = np.ones(self.size[::-1], np.bool_)
        if depth is not None:
            given = as_array("depth", depth)
            if given.shape != measured.shape:
                raise ValueError(f"depth must have shape {measured.shape}, got {given.shape}")
            measured = np.isfinite(given) & (given != 0)
        found = []
        for i, ((x, y), mask) in enumerate(self._windows):
            left, top, right, bottom = self._inside((x, y), mask)
            window = measured[y + top : y + bottom, x + left : x + right]
            n_valid = int(np.count_nonzero(window & mask[top:bottom, left:right]))
            boxes = [
                [int(box[0]), int(box[1]), int(box[2] - box[0]) - 1, int(box[3] - box[1]) - 1]
                if self.n_visible[i]
                else [-1, -1, -1, -1]
                for box in (self.boxes_full[i], self.boxes_visible[i])
            ]
            found.append({
                "px_count_all": int(self.n_full[i]), "px_count_valid": n_valid,
                "px_count_visib": int(self.n_visible[i]), "visib_fract": float(self.visible_share[i]),
                "bbox_obj": boxes[0], "bbox_visib": boxes[1],
            })  # fmt: skip
        return found

    def annotations(
        self,
        image_id: int = 0,
        category_ids: npt.ArrayLike | None = None,
        *,
        first_id: int = 1,
        which: Literal["visible", "full"] = "visible",
    ) -> list[dict[str, Any]]:
        """Annotations of COCO of the objects that show, with run lengths; `json` writes them.

        Parameters
        ----------
        image_id : int
        category_ids : array_like (N,) of int, optional
            Of each object of the scene; 1 unless given.
        first_id : int
            The id of the first annotation; those of others follow.
        which : {"visible", "full"}
            The masks, areas and boxes: within the picture.

        Raises
        ------
        ValueError
            If there are not as many categories as objects, or `which` is neither.
        """
        categories = np.ones(len(self), np.int64) if category_ids is None else as_array("category_ids", category_ids)
        if categories.shape != (len(self),) or (categories.dtype.kind not in "iu" and categories.size):
            got = f"shape {categories.shape} and dtype {categories.dtype}"
            raise ValueError(f"category_ids must be {len(self)} integers, one of each object, got {got}")
        image_id, first_id = as_count("image_id", image_id, 0), as_count("first_id", first_id, 0)
        found: list[dict[str, Any]] = []
        for i, rle in enumerate(self.rle(which)):
            if self.n_visible[i]:
                found.append(annotation_of(rle, first_id + len(found), image_id, int(categories[i])))
        return found

    def _checked(self, i: int) -> int:
        try:
            return range(len(self))[operator.index(i)]
        except TypeError:
            raise TypeError(f"i must be the index of an object, got {shown(i)}") from None
        except IndexError:
            raise IndexError(f"there are {len(self)} objects, got {i}") from None

    def _inside(self, corner: tuple[int, int], mask: npt.NDArray[np.bool_]) -> Window:
        """The part of a window inside of the picture, from the corner of the window on."""
        (x, y), (height, width) = corner, mask.shape
        left, top = min(max(-x, 0), width), min(max(-y, 0), height)
        right, bottom = min(width, self.size[0] - x), min(height, self.size[1] - y)
        return left, top, max(left, right), max(top, bottom)


def object_masks(
    scene: MeshLike | Scene,
    camera: CameraLike | None = None,
    size: int | tuple[int, int] = DEFAULT_SIZE,
    *,
    beyond: float = 1.0,
    cull: CullOption | None = None,
    subpixel_bits: int | Literal["exact"] = 8,
    threads: int | None = None,
) -> ObjectMasks:
    """Return the full mask of each object of a scene, its visible part, and the share of that.

    Parameters
    ----------
    scene : Scene, Mesh, or whatever `as_mesh` takes
        Each instance is an object.
    camera, size
        As for `render`.
    beyond : float
        How far beyond the picture objects count, in widths to the left and right and heights above and below. 1: as the
        tools of BOP do it; 0: not at all.
    cull, subpixel_bits, threads
        As for `render`.

    Returns
    -------
    ObjectMasks

    Raises
    ------
    ValueError
        If there are no triangles and no camera is given, an option is unknown, or `beyond` is negative, not finite, or
        reaches more than ``2**30`` pixels.
    MemoryError
        If the mask of an object does not fit.

    Notes
    -----
    Pixels count where their centre is covered, without the holes of materials. The visible part of an object is part of
    its full mask, to the bit: it is the same draw, of the object alone and of all.

    References
    ----------
    T. Hodan and others, BOP: Benchmark for 6D Object Pose Estimation, 2018.

    Examples
    --------
    >>> import numpy as np
    >>> import topleft as tl
    >>> ball, far = tl.Mesh(*tl.scenes.icosphere(2)), np.eye(4)
    >>> far[:3, 3] = 1, 0, -2
    >>> found = tl.object_masks(tl.Scene([ball, (ball, far)]), tl.Camera.look_at((0, 0, 5)), (64, 48))
    >>> found
    ObjectMasks(2 objects, 2 of them show, 64x48)
    >>> found.scene_gt_info()[1]["bbox_obj"]
    [32, 15, 18, 17]
    """
    if not 0 <= as_number("beyond", beyond) < np.inf:
        raise ValueError(f"beyond must be a number of pictures, 0 or more, got {beyond}")
    shot = Shot.of_meshes(scene, camera, size)
    if beyond * max(shot.size) > MOST_BEYOND_PX:
        raise ValueError(f"beyond must reach at most {MOST_BEYOND_PX} pixels, got {beyond} pictures of {shot.size}")
    whole, (width, height) = shot.scene, shot.size
    options: dict[str, Any] = {"cull": cull, "subpixel_bits": subpixel_bits, "threads": threads}
    placed = Placed.parse(replace(shot, is_mesh=False), options)
    instance, boxes = seen_in(placed)
    n_visible = np.bincount(instance.reshape(-1) + 1, minlength=len(whole) + 1)[1:].astype(np.int64)
    more_x, more_y = (int(np.ceil(beyond * side)) for side in shot.size)
    canvas = -more_x, -more_y, width + more_x, height + more_y
    windows = []
    for i, drawn in enumerate(placed.scene):
        left, top, right, bottom = window_of(drawn, placed.clip_from_world, shot.size, canvas)
        shape = max(0, bottom - top), max(0, right - left)
        check_fits(shape, np.bool_)
        mask = np.zeros(shape, np.bool_)
        if mask.size:
            mask = seen_in(placed.alone(i, (right - left, bottom - top), (left, top)))[0] >= 0
        windows.append(((left, top), mask))
    boxes_full = [
        np.where(mask.any(), np.add(box_of(mask), corner * 2), 0) if mask.size else np.array(NO_BOX)
        for corner, mask in windows
    ]
    n_full = np.array([np.count_nonzero(mask) for _, mask in windows], np.int64)
    boxes[n_visible == 0] = 0
    return ObjectMasks(
        shot.size, instance, n_visible, n_full, boxes, np.array(boxes_full, np.int32).reshape(-1, 4), tuple(windows)
    )


def seen_in(placed: Placed) -> tuple[I32, I32]:
    """Which instance shows (H, W), without the holes of materials, and the boxes of pixels round each (N, 4)."""
    return cast(SceneFragments, draw_solid(FRESH, placed, cuts_of(placed.whole, None)))._found


def window_of(instance: Instance, clip_from_world: F64, size: tuple[int, int], canvas: Window) -> Window:
    """The pixels of the canvas that an instance may cover: round its box, or all where that reaches the eye."""
    if not len(instance.mesh.triangles):
        return NO_BOX
    if not instance.mesh.is_finite:
        return canvas
    corners = moved(box_corners(instance.mesh.vertex_box.reshape(2, 3)), instance.transform)
    clip = moved(corners, clip_from_world[[0, 1, 3]])
    if not (clip[:, 2] > 0).all():
        return canvas
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        x = (clip[:, 0] / clip[:, 2] + 1) * (size[0] / 2)
        y = (1 - clip[:, 1] / clip[:, 2]) * (size[1] / 2)
    ends = [x.min() - 1, y.min() - 1, x.max() + 2, y.max() + 2]
    if not np.isfinite(ends).all():
        return canvas
    low, high = np.array(canvas[:2] * 2), np.array(canvas[2:] * 2)
    left, top, right, bottom = np.clip(np.floor(ends), low, high).astype(int).tolist()
    return left, top, right, bottom


def box_of(mask: npt.NDArray[np.bool_]) -> I64:
    """Left, top, right and bottom of the pixels of a mask; zeros without any."""
    columns, rows = (np.flatnonzero(mask.any(axis=axis)) for axis in (0, 1))
    if not len(columns):
        return np.zeros(4, np.int64)
    return np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], np.int64)
