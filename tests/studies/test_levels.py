"""The benchmark of levels of detail: it runs, its page says what was measured. Nothing is timed."""

import pytest
from benchmarks import cli
from benchmarks.harness.machine import PAGES
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


def test_levels_commands_write_record_page_and_chart(tmp_path, monkeypatch, mesh_record, capsys):
    out, page = tmp_path / "levels.json", tmp_path / "page.md"
    monkeypatch.setattr(levels, "subjects", lambda _: [("torus", tl.Mesh(*tl.scenes.torus()))])
    monkeypatch.setattr(levels, "measure_mesh", lambda *_: mesh_record)
    assert cli.main(["levels", "-o", str(out)]) == 0
    assert "1000 px high" in capsys.readouterr().out
    page.write_text((PAGES / "levels.md").read_text())
    assert cli.main(["document", str(out), str(page)]) == 0
    assert "\n| torus, 2,304 | 1000 px high |" in page.read_text()
    assert cli.main(["charts", str(out), "-o", str(tmp_path)]) == 0
    assert (tmp_path / "levels.png").read_bytes().startswith(b"\x89PNG")
