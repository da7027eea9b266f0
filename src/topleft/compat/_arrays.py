"""Products of poses and colours of floats, the same bits on every processor; tensors as arrays.

Input: matrices (4, 4), colours as other libraries have them, tensors of PyTorch. Output: matrices, sRGB bytes, arrays.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
U8 = npt.NDArray[np.uint8]


def product(a: npt.ArrayLike, b: npt.ArrayLike) -> F64:
    """The product of two matrices, or of stacks of them, added up in order: NumPy's own depends on the processor."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    total = a[..., :, :1] * b[..., :1, :]
    for k in range(1, a.shape[-1]):
        total = total + a[..., :, k : k + 1] * b[..., k : k + 1, :]
    return total


def moved(points: npt.ArrayLike, pose: F64) -> F64:
    """Points (N, 3) where a pose (4, 4) takes them."""
    points = np.asarray(points, np.float64)
    x, y, z = points[:, 0:1], points[:, 1:2], points[:, 2:3]
    columns = pose[:3].T
    moved: F64 = ((x * columns[0] + y * columns[1]) + z * columns[2]) + columns[3]
    return moved


def view_of(pose: npt.ArrayLike) -> F64:
    """Eye from world (4, 4) of a camera's pose; a scale of the pose is left out."""
    pose = np.asarray(pose, np.float64)
    view = np.eye(4)
    view[:3, :3] = (pose[:3, :3] / np.sqrt((pose[:3, :3] ** 2).sum(axis=0))).T
    view[:3, 3] = -product(view[:3, :3], pose[:3, 3:])[:, 0]
    return view


def dots_along(segments: F64, clip_from_world: F64, size: tuple[int, int]) -> tuple[F64, npt.NDArray[np.intp]]:
    """Points on segments (N, 2, 3), at most half a pixel apart in a picture, and the segment of each.

    What lies outside the picture has none. Segments may have more numbers than x, y and z, which points get, too.
    """
    ends = product(np.concatenate([segments[..., :3], np.ones((len(segments), 2, 1))], axis=2), clip_from_world.T)
    first, last = np.zeros(len(segments)), np.ones(len(segments))
    for axis in range(3):
        for side in (-1, 1):  # Liang and Barsky, 1984
            inside = ends[..., 3] + side * ends[..., axis]
            with np.errstate(divide="ignore", invalid="ignore"):
                crossing = inside[:, 0] / (inside[:, 0] - inside[:, 1])
            first = np.where(inside[:, 0] < 0, np.fmax(first, crossing), first)
            last = np.where(inside[:, 1] < 0, np.fmin(last, crossing), last)
            last = np.where((inside < 0).all(axis=1), -1, last)
    kept = np.flatnonzero(first < last)
    shares = np.stack([first[kept], last[kept]], axis=1)[..., None]
    ends = ends[kept, :1] * (1 - shares) + ends[kept, 1:] * shares
    w = ends[..., 3]
    px = ends[..., :2] / w[..., None] * (np.array(size) / 2)
    n = np.ceil(2 * np.sqrt(((px[:, 1] - px[:, 0]) ** 2).sum(axis=1))).astype(np.intp) + 1
    row = np.repeat(np.arange(len(kept)), n)
    across = (np.arange(n.sum()) - np.repeat(np.cumsum(n) - n, n)) / np.maximum(n - 1, 1)[row]
    part = across * w[row, 0] / (w[row, 1] + across * (w[row, 0] - w[row, 1]))  # steps are even in the picture
    t = (shares[row, 0, 0] + part * (shares[row, 1, 0] - shares[row, 0, 0]))[:, None]
    own = segments[kept[row]]
    return own[:, 0] * (1 - t) + own[:, 1] * t, kept[row]


def srgb_bytes(light: Any) -> npt.NDArray[np.uint8]:
    """The sRGB bytes of linear light of 0 to 1."""
    light = np.clip(np.asarray(light, np.float64), 0, 1)
    srgb = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.rint(255 * srgb).astype(np.uint8)


def over(picture: U8, table: bytes, background: Any) -> U8:
    """A picture (H, W, 4) with other numbers for its colours, laid over a background as they stand.

    The alpha of the picture (H, W, 4) is the share that is covered; `table` has the new number of each of 256; the
    alpha of the background, (4,) or (H, W, 4), counts as that of a colour: what is drawn is laid over it.
    """
    alpha = picture[..., 3]
    found = np.frombuffer(bytearray(np.ascontiguousarray(picture)).translate(table), np.uint8).reshape(picture.shape)
    found[..., 3] = 255
    behind = np.broadcast_to(np.asarray(background, np.uint8), picture.shape)
    np.copyto(found.view(np.uint32), np.ascontiguousarray(behind).view(np.uint32), where=(alpha == 0)[..., None])
    rows, columns = np.nonzero((alpha > 0) & (alpha < 255))
    if len(rows):
        share = alpha[rows, columns, None].astype(np.uint16)
        mixed = found[rows, columns] * share + behind[rows, columns] * (255 - share)
        found[rows, columns] = ((mixed + 127) // 255).astype(np.uint8)
    return found


def light_of_bytes() -> F64:
    """The linear light, 0 to 1, of each sRGB byte: (256,)."""
    srgb = np.arange(256) / 255
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


SHOWN_AS_LIGHT = np.rint(255 * light_of_bytes()).astype(np.uint8).tobytes()
"""The light of each sRGB byte: of libraries that add light up in the numbers of the picture, which are light here."""


def library_of(values: Any) -> Any:
    """PyTorch for a tensor, NumPy for anything else: what is used of them has equal names in both."""
    return sys.modules["torch"] if type(values).__module__.startswith("torch") else np


def detached(values: Any) -> npt.NDArray[Any]:
    """The numbers of a tensor, or of anything that NumPy reads."""
    return np.asarray(values.detach() if hasattr(values, "detach") else values)


def interpolated(values: Any, corners: npt.NDArray[Any], weights: Any, seen: npt.NDArray[np.intp]) -> Any:
    """Values of vertices at the pixels that show a face, 0 at others; of tensors with gradients.

    `values`: (V, C); `corners`: (N, 3), the vertices of what each pixel shows that shows something; `weights`: (P, 3)
    of all pixels; `seen`: (N,), which of them show something. Returns (P, C).
    """
    of = library_of(weights)
    rows, names = of.asarray(seen), of.asarray(corners.astype(np.int64))
    own = weights[rows]
    a, b, c = (values[names[:, k]] * own[:, k : k + 1] for k in range(3))
    found = a + b + c
    picture = of.zeros((len(weights), found.shape[1]), dtype=found.dtype)
    picture[rows] = found
    return picture
