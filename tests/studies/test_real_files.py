"""Files of others, drawn: what comes of each, the contact sheets and the page; all from files made here."""

from __future__ import annotations

import json
import os
import time

import pytest
from benchmarks import cli
from benchmarks.real_files import drawing, sheets, tables
from benchmarks.real_files.study import Painter, files_of, mark_of
from PIL import Image

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
    assert [mark_of(row) for row in rows.values()] == ["R", "", "W"]


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


def test_sheets_hold_all_pictures(tmp_path, folder):
    picture = drawing.draw(folder / "plain.obj", tmp_path / "a.png")["picture"]
    n = sheets.N_COLUMNS * sheets.N_ROWS + 1
    names = sheets.write_sheets(tmp_path, "s", [picture, None] + [picture] * (n - 2), ["é" * 99] * n, [""] * n)
    assert names == ["s-0.png"] * (n - 1) + ["s-1.png"]
    with Image.open(tmp_path / "s-0.png") as sheet:
        pixels = sheet.convert("RGB")
        middle = sheets.GAP + drawing.THUMBNAIL // 2
        assert pixels.getpixel((middle, middle)) != sheets.BOARD
        assert pixels.getpixel((middle + drawing.THUMBNAIL + sheets.GAP, middle)) == sheets.BOARD


def test_command_writes_record_page_and_sheets(folder, tmp_path, capsys):
    out = tmp_path / "out.json"
    assert cli.main(["real-files", f"mine={folder}", "--page", str(tmp_path / "page"), "-o", str(out)]) == 0
    record = json.loads(out.read_text())
    assert [(row["file"], row["outcome"]) for row in record["files"]] == [
        ("deeper/broken.PLY", "refused"), ("plain.obj", "drawn"), ("warned.obj", "drawn"),
    ]  # fmt: skip
    page = (tmp_path / "page" / "index.md").read_text()
    assert "![sheet-0-0.png](sheet-0-0.png)" in page
    assert "`material libraries not found`" in page
    assert (tmp_path / "page" / "sheet-0-0.png").is_file()
    assert "| mine   | 3     |     2 |              1 |       1 |" in capsys.readouterr().out


def test_command_without_files_is_refused(tmp_path, capsys):
    assert cli.main(["real-files", str(tmp_path), "--page", str(tmp_path / "page")]) == 2
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
    warned = tables.PARTS["warned"]({"files": rows}).splitlines()
    assert [line.split("|")[1:3] for line in warned[2:]] == [
        [" `textures not found`    ", " 2     "], [" `animations not played` ", " 1     "],
    ]  # fmt: skip
    assert "| `it has N of N bytes` | 1 " in tables.PARTS["refused"]({"files": rows})
