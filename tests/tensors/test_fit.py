"""The programs of docs/guide/fit.md find what they look for."""

import re
from pathlib import Path

import numpy as np
import pytest

PROGRAMS = re.findall(
    r"```python\n(.*?)```",
    Path(__file__).parents[2].joinpath("docs/guide/fit.md").read_text(encoding="utf-8"),
    re.DOTALL,
)


def test_a_sphere_becomes_what_eight_silhouettes_show(tmp_path, monkeypatch):
    pytest.importorskip("torch")
    monkeypatch.chdir(tmp_path)
    smaller = PROGRAMS[0]
    for asked, given in (("= 192, 8,", "= 64, 8,"), ("range(200)", "range(60)"), ("icosphere(4)", "icosphere(3)")):
        assert smaller.count(asked) == 1
        smaller = smaller.replace(asked, given)
    found = {}
    exec(smaller, found)
    assert (found["both"] / found["either"]).item() >= 0.97


def test_scipy_finds_a_quad_by_its_areas():
    pytest.importorskip("scipy")
    found = {}
    exec(PROGRAMS[1], found)
    expected = [[6, 5], [25, 9], [27, 24], [8, 26]]
    np.testing.assert_allclose(found["found"].x.reshape(4, 2), expected, atol=0.01)
