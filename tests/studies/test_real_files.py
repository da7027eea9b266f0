"""Files of others, drawn: what comes of each; all from files made here."""

import json
import os
import time

import pytest
from benchmarks import cli
from benchmarks.real_files import drawing, tables
from benchmarks.real_files.study import Painter, files_of

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def folder(tmp_path):
    files = tmp_path / "files"
    (files / "deeper").mkdir(parents=True)
    (files / "plain.obj").write_text(TRIANGLE)
    (files / "warned.obj").write_text("mtllib none.mtl\nusemtl red\n" + TRIANGLE)
    (files / "deeper" / "broken.PLY").write_text("ply\n")
    (files / "notes.txt").write_text("no mesh")
    return files


def test_files_of_a_folder_are_those_of_known_suffixes(folder):
    assert [path.name for path in files_of(folder)] == ["broken.PLY", "plain.obj", "warned.obj"]
    assert [path.name for path in files_of(folder, (".txt",))] == ["notes.txt"]


@pytest.mark.filterwarnings("ignore::topleft.MeshWarning")
def test_drawing_says_what_came_of_a_file(folder, tmp_path):
    rows = {path.name: drawing.draw(path, tmp_path / "a.png") for path in files_of(folder)}
    assert {name: row["outcome"] for name, row in rows.items()} == {
        "plain.obj": "drawn", "warned.obj": "drawn", "broken.PLY": "refused",
    }  # fmt: skip
    assert rows["warned.obj"]["line"] == "material libraries not found: 'none.mtl'"
    assert "header does not end" in rows["broken.PLY"]["line"]
    assert str(folder) not in rows["broken.PLY"]["line"]
    assert (rows["plain.obj"]["n_triangles"], rows["plain.obj"]["line"]) == (1, "")
    assert 0.1 < rows["plain.obj"]["covered"] < 0.9


def test_drawing_that_raises_is_a_crash(folder, tmp_path, monkeypatch):
    def fall(_):
        raise KeyError("x")

    monkeypatch.setattr("topleft._apps.cli.main", fall)
    assert drawing.draw(folder / "plain.obj", tmp_path / "a.png") == {"outcome": "crashed", "line": "KeyError: 'x'"}


def _fall(pipe, picture, up):
    """In place of the process that draws: ends, or sleeps, by the name of the file."""
    pipe.send({"ready": True})
    while (path := pipe.recv()) is not None:
        if path.name == "ends":
            os._exit(3)
        if path.name == "sleeps":
            time.sleep(60)
        pipe.send({"outcome": "drawn", "line": ""})


def test_painter_goes_on_after_a_file_that_ends_or_stops_its_process(monkeypatch, tmp_path):
    monkeypatch.setattr(
        "benchmarks.real_files.study.get_context", lambda _: __import__("multiprocessing").get_context("fork")
    )
    monkeypatch.setattr(drawing, "serve", _fall)
    with Painter(0.2) as painter:
        lines = [painter.draw(tmp_path / name)["line"] for name in ("ends", "plain", "sleeps", "plain")]
    assert lines == ["the process ended with status 3", "", "not done after 0.2 seconds", ""]


def test_command_writes_a_record_and_prints_lines(folder, tmp_path, capsys):
    out = tmp_path / "out.json"
    assert cli.main(["real-files", f"mine={folder}", "-o", str(out)]) == 0
    record = json.loads(out.read_text())
    assert [(row["folder"], row["file"], row["outcome"]) for row in record["files"]] == [
        ("mine", "deeper/broken.PLY", "refused"), ("mine", "plain.obj", "drawn"), ("mine", "warned.obj", "drawn"),
    ]  # fmt: skip
    said = capsys.readouterr().out
    assert "`material libraries not found`" in said
    assert "| mine   | 3     |     2 |              1 |       1 |" in said


def test_command_without_files_is_refused(tmp_path, capsys):
    assert cli.main(["real-files", str(tmp_path)]) == 2
    assert "must be a folder with files that end in" in capsys.readouterr().err


def test_tables_count_lines_by_kind():
    rows = [
        {
            "folder": "a",
            "file": "x/a.glb",
            "outcome": "drawn",
            "line": "textures not found: 'b.png'; animations not played: x",
        },
        {"folder": "a", "file": "c.glb", "outcome": "drawn", "line": "textures not found: 'd.png'"},
        {"folder": "a", "file": "e.glb", "outcome": "refused", "line": "cannot read 'e.glb': it has 3 of 4 bytes"},
    ]
    warned = tables.lines_of({"files": rows}, "drawn").splitlines()
    assert [line.split("|")[1:3] for line in warned[2:]] == [
        [" `textures not found`    ", " 2     "], [" `animations not played` ", " 1     "],
    ]  # fmt: skip
    assert "| `it has N of N bytes` | 1 " in tables.lines_of({"files": rows}, "refused")
