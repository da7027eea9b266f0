"""`topleft doctor`, and what it checks."""

import pytest

import topleft.cli
from topleft import build_info, testing
from topleft._core.engine import isa_in_use


def test_doctor_tells_version_and_each_instruction_set(capsys):
    assert topleft.cli.main(["doctor"]) == 0
    told = capsys.readouterr().out
    info = build_info()
    assert f"topleft {info['version']}" in told
    assert info["compiler"] in told
    for name in info["isa_available"]:
        assert f"  {name}: right" in told
    assert "all is well" in told
    assert isa_in_use() == info["isa"]


def test_doctor_tells_the_sets_that_the_build_lacks(capsys, monkeypatch):
    info = build_info() | {"isa_missing": ["avx512"]}
    monkeypatch.setattr("topleft._apps.cli.doctor.build_info", lambda: info)
    topleft.cli.main(["doctor"])
    assert "  avx512: not built, though this machine runs it; `TOPLEFT_BUILD_ISA=all" in capsys.readouterr().out


def test_doctor_exits_with_1_when_a_picture_is_wrong(capsys, monkeypatch):
    monkeypatch.setattr(testing, "GOLDEN", testing.GOLDEN.replace("depth:", "depth:0"))
    assert topleft.cli.main(["doctor"]) == 1
    told = capsys.readouterr().out
    assert "scalar: wrong: depth" in told
    assert "PICTURES ARE WRONG" in told


def test_doctor_tells_what_an_extra_lacks(capsys, monkeypatch):
    lines = [
        "numpy>=1.26",
        'none-such-package>=1.4; extra == "formats"',
        'numpy; extra == "formats"',
        'x; extra == "dev"',
        'torch; extra == "torch"',
    ]
    monkeypatch.setattr("topleft._apps.cli.doctor.requires", lambda name: lines)
    monkeypatch.setattr("topleft._apps.cli.doctor.installed", {"numpy": "2.0"}.get)
    topleft.cli.main(["doctor"])
    told = capsys.readouterr().out
    assert "extra formats: none-such-package is not installed, numpy" in told
    assert "(pip install none-such-package)" in told
    assert "extra dev" not in told
    assert "torch is not installed (pip install torch --index-url with the address that pytorch.org" in told


@pytest.mark.parametrize("kind", testing.HARD_SCENES)
def test_hard_scenes_are_the_same_each_time(kind):
    for one, other in zip(testing.hard_scenes(kind), testing.hard_scenes(kind), strict=True):
        assert one[0].tobytes() == other[0].tobytes()
        assert one[1].tobytes() == other[1].tobytes()


def test_hard_scenes_unknown_kind_is_named():
    with pytest.raises(ValueError, match=r"kind must be one of dust, .*, got 'easy'"):
        next(testing.hard_scenes("easy"))
