"""Pictures of several samples a pixel: each triangle is shaded once in a pixel, and colours are averaged as light.

Input: `Fragments` of several samples, and what shades one sample. Output: a picture (H, W, 4) uint8, sRGB with alpha.

Based on: K. Akeley, RealityEngine Graphics, 1993 (a triangle gets one colour a pixel, samples tell its share).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from topleft._base.color import LINEAR_ONE, srgb_tables
from topleft._raster.fragments import Fragments

__all__ = ["shade_samples"]

U8 = NDArray[np.uint8]


def shade_samples(frags: Fragments, shade_one: Callable[[Fragments], U8], background: tuple[int, ...]) -> U8:
    """Return the mean colour of the samples, (H, W, 4) uint8: light is averaged, alpha as it is.

    `shade_one` gives the picture of one sample; pixels whose triangle an earlier sample has shown are left out of it.
    """
    ids = [frags.sample(k).id for k in range(frags.samples_depth.shape[-1])]
    picture = shade_one(frags.sample(0))  # of the first sample; right wherever one triangle has all samples
    is_split = np.zeros(ids[0].shape, np.bool_)
    for other in ids[1:]:
        is_split |= other != ids[0]
    at = np.nonzero(is_split)
    split = np.stack([own[at] for own in ids])  # (S, P)
    decode, encode = srgb_tables()
    light, alpha = np.zeros((split.shape[1], 3), np.int64), np.zeros(split.shape[1], np.int64)

    def add(colors: U8, share: NDArray[np.int64]) -> None:
        weight = share * colors[:, 3]
        light[...] += weight[:, None] * decode[colors[:, :3]]
        alpha[...] += weight

    ground = np.broadcast_to(np.array(background, np.uint8), (split.shape[1], 4))
    add(ground, (split < 0).sum(0))
    for k, own in enumerate(split):
        is_new = (own >= 0) & (split[:k] != own).all(0)
        share = (split == own).sum(0) * is_new
        if k == 0:
            add(picture[at], share)
        elif is_new.any():
            add(shade_one(frags.sample(k).only(at[0][is_new], at[1][is_new]))[at], share)
    steps = (2 * light + alpha[:, None]) // np.maximum(2 * alpha, 1)[:, None]  # to nearest, of at most LINEAR_ONE
    mean = np.empty((split.shape[1], 4), np.uint8)
    mean[:, :3] = encode[np.minimum(steps, LINEAR_ONE)]
    mean[:, 3] = np.rint(alpha / len(ids))  # exact sixteenths
    picture[at] = mean
    return picture
