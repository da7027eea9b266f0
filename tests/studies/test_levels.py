"""The benchmark of levels of detail: it runs, its page says what was measured. Nothing is timed."""

import json

import pytest
from benchmarks import cli
from benchmarks.levels import page as levels_page
from benchmarks.levels import study as levels

import topleft as tl


@pytest.fixture(scope="module")
def mesh_record():
    mesh = tl.Mesh(*tl.scenes.torus(segments=48, sections=24))
    kept = tl.simplify(mesh)
    return levels.measure_mesh("torus", mesh, kept, levels.draw_times(mesh, kept, 1)) | {"made_s": 0.5}


def test_levels_measured_error_is_within_the_bound(mesh_record):
    for view in mesh_record["views"]:
        for row in view["levels"]:
            # Masks know the outline to the diagonal of a sample on either side.
            assert row["error_px"] <= row["bound_px"] + 2 * 2**0.5 * view["resolution_px"]
        assert view["levels"][view["level"]]["bound_px"] <= levels.TOLERANCE


def test_levels_are_kept_from_run_to_run(tmp_path):
    mesh = tl.Mesh(*tl.scenes.torus(segments=48, sections=24))
    first, made_s = levels.find_levels("torus", mesh, tmp_path / "kept")
    again, made_s_again = levels.find_levels("torus", mesh, tmp_path / "kept")
    assert 0 < made_s == made_s_again
    assert [one.bound for one in first] == [one.bound for one in again]


def test_levels_command_writes_page_chart_and_record(tmp_path, monkeypatch, mesh_record, capsys):
    monkeypatch.setattr(levels, "subjects", lambda _: [("torus", tl.Mesh(*tl.scenes.torus()))])
    monkeypatch.setattr(levels, "measure_mesh", lambda *_: mesh_record)
    assert cli.main(["levels", "--json", str(tmp_path / "levels.json"), "-o", str(tmp_path)]) == 0
    record = json.loads((tmp_path / "levels.json").read_text())
    page = (tmp_path / "measured" / "levels.md").read_text()
    assert page == levels_page.page(record)
    assert "## torus, 2,304 triangles" in page
    assert "1000 px high" in capsys.readouterr().out
    assert (tmp_path / "images" / "levels.png").read_bytes().startswith(b"\x89PNG")
