"""Samples approach the area: the more of them, the closer."""

import numpy as np
from strategies import jittered_grid

import topleft as tl

COUNTS = (2, 4, 8, 16)


def rms_of_samples():
    """The error of coverage by samples against the area, RMS over the pixels on outlines, for each count."""
    rng = np.random.default_rng(11)
    squares = dict.fromkeys(COUNTS, 0.0)
    n_edge_px = 0
    for _ in range(60):
        corners = rng.uniform(0, 64, (3, 2))
        view = {"vertices": corners, "triangles": [[0, 1, 2]], "size": (64, 64)}
        area = tl.coverage(**view, sampling="area").astype(float)
        on_edge = (area > 0) & (area < 1)
        n_edge_px += on_edge.sum()
        for n in COUNTS:
            share = tl.coverage(**view, sampling=f"msaa{n}")
            squares[n] += ((share - area)[on_edge] ** 2).sum()
    assert n_edge_px > 4000
    return np.sqrt([squares[n] / n_edge_px for n in COUNTS])


def test_error_of_samples_falls_faster_than_that_of_random_ones():
    """As n**-0.64; random: n**-0.5; the best spread, against half-planes: n**-0.75 (J. Beck, W. Chen, 1987)."""
    rms = rms_of_samples()
    slope = np.polyfit(np.log2(COUNTS), np.log2(rms), 1)[0]
    assert -0.75 < slope < -0.58
    assert (np.diff(rms) < 0).all()


def test_samples_of_whole_pixels_of_a_tiling_are_covered_once():
    scene = jittered_grid(np.random.default_rng(5), 20, 64)
    for n in COUNTS:
        counts = tl.overdraw(*scene.arrays[:2], scene.size, sampling=f"msaa{n}", **scene.view)
        area = tl.overdraw(*scene.arrays[:2], scene.size, sampling="area", **scene.view)
        inside = area == 1
        assert inside.any()
        assert (counts[inside] == 1).all()
