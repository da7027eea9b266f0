"""What the examples share: where the picture goes, numbers as colours, pictures side by side."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

RAMP = np.array([[13, 8, 65], [84, 16, 130], [178, 40, 110], [240, 105, 60], [252, 190, 90], [252, 250, 200]])
"""Dark violet to light yellow, each step lighter than the one before."""


def output_path(doc: str) -> Path:
    """The path after `-o`."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="the picture to write, PNG")
    return parser.parse_args().output


def ramp(values: np.ndarray, low: float | None = None, high: float | None = None, empty=(255, 255, 255)) -> np.ndarray:
    """Numbers (H, W) as colours (H, W, 3) uint8; NaN and infinity are `empty`."""
    values = np.asarray(values, np.float64)
    there = np.isfinite(values)
    low = values[there].min() if low is None else low
    high = values[there].max() if high is None else high
    share = (np.where(there, values, low) - low) / max(high - low, 1e-300)
    steps = np.linspace(0, 1, len(RAMP))
    rgb = np.stack([np.interp(share, steps, channel) for channel in RAMP.T], axis=-1)
    return np.where(there[..., None], np.rint(rgb), empty).astype(np.uint8)


def beside(*pictures: np.ndarray, gap: int = 8) -> np.ndarray:
    """Pictures (H, W, 3 or more) in a row, white between them."""
    height = pictures[0].shape[0]
    white = np.full((height, gap, 3), 255, np.uint8)
    row = [part for picture in pictures for part in (picture[..., :3], white)]
    return np.hstack(row[:-1])
