"""The benchmark suite: it runs, says what it left out, and tells a wrong picture from a right one. Nothing is timed."""

import json
import re

import numpy as np
import pytest
from benchmarks import cli
from benchmarks.harness.errors import compare, draw_exact
from benchmarks.harness.machine import RECORDS
from benchmarks.harness.rounds import RunOptions, run_cases
from benchmarks.peers import PEERS, load_peer, why_not
from benchmarks.report.tables import number
from benchmarks.run import scene_tables, smooth_tables, tables
from benchmarks.scenes.cases import CASES, TASKS, Scene, orbit_camera
from benchmarks.small import others, pairs

import topleft as tl

ISA = tl.build_info()["isa"]


@pytest.fixture(scope="module")
def record():
    """One short run: topleft and a contestant that draws nothing."""
    return run_cases(RunOptions(["tiny"], ["broken"], [ISA], repeats=2, seconds=0.001))


def test_run_record_is_json_and_says_where_it_was_made(record):
    assert json.loads(json.dumps(record)) == record
    assert {"date", "machine", "commit", "versions", "options", "scenes"} <= set(record)
    assert record["machine"]["cpu"]


def test_run_contestants_took_turns(record):
    (scene,) = record["scenes"]
    assert [entry["name"] for entry in scene["runs"]] == [f"topleft {ISA}", "broken"]
    for entry in scene["runs"]:
        assert len(entry["turn_medians_ms"]) == 2
        assert 0 < entry["min_ms"] <= entry["median_ms"]
        assert entry["q1_ms"] <= entry["median_ms"] <= entry["q3_ms"]
    assert scene["runs"][0]["isa"] == ISA
    assert scene["runs"][0]["ratio"] == 1


def test_run_wrong_pixels_none_of_ours_all_of_the_broken_one(record):
    ours, broken = (entry["error"] for entry in record["scenes"][0]["runs"])
    assert ours["wrong_px"] == 0
    assert ours["max_depth_error"] < 2**-24
    assert broken["wrong_px"] > 1000


def test_scene_tables_show_a_mesh_and_leave_out_what_was_not_measured():
    record = run_cases(RunOptions(["blob-10k", "large-4k"], [], [ISA], repeats=1, seconds=0))
    mesh, fills = scene_tables.meshes_text(record), scene_tables.PARTS["other-scenes"](record)
    median = record["scenes"][0]["runs"][0]["median_ms"]
    assert f"| 10,000    | {number(median)}" in mesh.replace("!", "")
    assert fills.splitlines()[2].startswith("| large-4k | 1 ")
    assert "not those of the exact picture: 0." in scene_tables.facts_text(record)
    assert scene_tables.headline_text(record) is None
    assert smooth_tables.PARTS["smooth-times"](record) is None


def test_scene_tables_begin_with_the_first_set_that_was_measured():
    record = json.loads((RECORDS / "scenes.json").read_text())
    for scene in record["scenes"]:
        scene["runs"] = [run for run in scene["runs"] if run.get("isa") != "avx512"]
    first = scene_tables.headline_text(record).replace("\n", " ")
    assert re.match(
        r"A mesh of 100,000 triangles takes [\d.]+ ms with AVX2, [\d.]+ ms with scalar code, for ids", first
    )
    assert "two threads (avx2)" in scene_tables.meshes_text(record)


def test_report_names_contestants_and_errors(record):
    text = "\n".join(tables.lines(record))
    assert f"| topleft {ISA} " in text
    assert "## tiny" in text


def test_run_command_writes_the_record(tmp_path, capsys):
    target = tmp_path / "record.json"
    arguments = ["run", "--scene", "tiny-fill", "--peer", "--isa", ISA, "--repeats", "1", "--seconds", "0"]
    assert cli.main([*arguments, "-o", str(target)]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["record.json"]
    printed = capsys.readouterr().out
    assert cli.main(["report", str(target)]) == 0
    assert capsys.readouterr().out == printed


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (["run", "--scene", "nothing"], "nothing"),
        (["run", "--peer", "nobody"], "nobody"),
        (["run", "--isa", "mmx"], "mmx"),
        (["accuracy", "--method", "nothing"], "method must be one of"),
        (["accuracy", "--part", "nothing"], "parts must be some of small, "),
        (["atlas", "--family", "nothing"], "--family must be some of far"),
        (["atlas", "--method", "nothing"], "--method must be some of auto"),
        (["batch", "--peer", "cube"], "--peer must be some of llvmpipe, riley, deodr, vtk, got cube"),
        (["pictures", "--scene", "nothing"], "--scene must be some of headlight"),
        (["static", "--scene", "cube", "--scale", "0.02"], "no scene begins with cube"),
    ],
)
def test_command_with_an_unknown_name_is_refused(command, said, capsys):
    assert cli.main(command) == 2
    assert said in capsys.readouterr().err


def test_peer_that_is_not_installed_gives_its_name(monkeypatch):
    peer = load_peer("cairo")
    monkeypatch.setattr(peer, "MODULE", "no_such_module")
    assert why_not(peer, "fill", 1) == "pycairo is not installed"
    assert why_not(peer, "visibility", 1) == "does not do visibility"
    assert why_not(peer, "fill", 2) == "runs on one thread"


@pytest.mark.parametrize("name", ["topleft", "broken", *PEERS])
def test_peer_file_has_its_parts_without_the_peer(name):
    peer = load_peer(name)
    assert set(peer.TASKS) <= set(TASKS)
    assert callable(peer.prepare)


def test_contestant_that_fails_is_skipped_with_the_reason():
    record = run_cases(RunOptions(["tiny"], ["broken"], ["mmx"], repeats=1, seconds=0))
    (skipped,) = record["scenes"][0]["skipped"]
    assert skipped["name"] == "topleft mmx"
    assert "TOPLEFT_ISA" in skipped["reason"]


def test_exact_square_of_two_triangles_by_hand():
    vertices = np.array([[0.5, 0.5], [2.5, 0.5], [2.5, 2.5], [0.5, 2.5]])
    picture = draw_exact(Scene("labels", (4, 4), vertices, np.array([[0, 1, 2], [0, 2, 3]])))
    assert picture["triangle"].tolist() == [[0, 0, -1, -1], [1, 0, -1, -1], [-1] * 4, [-1] * 4]


def test_compare_counts_each_kind_of_wrong_pixel():
    exact = draw_exact(CASES["tiny"].make())
    ids, depth = exact["triangle"].copy(), exact["depth"].copy()
    row, column = np.argwhere(ids >= 0)[0]
    assert compare({"triangle": ids, "depth": depth}, exact).as_dict() == {"wrong_px": 0, "max_depth_error": 0}
    depth[row, column] += 0.25
    assert compare({"depth": depth}, exact).as_dict() == {"wrong_px": 1, "max_depth_error": 0.25}
    ids[row, column] += 1
    assert compare({"triangle": ids, "depth": depth}, exact).as_dict() == {"wrong_px": 1, "max_depth_error": 0}
    assert compare({"mask": exact["mask"] ^ True}, exact).wrong_px == exact["mask"].size


def test_orbit_camera_sees_the_origin_in_the_middle():
    x, y, _, w = orbit_camera((64, 48)) @ [0, 0, 0, 1]
    assert (abs(x) < 1e-12, abs(y) < 1e-12, round(w, 9)) == (True, True, 3)


@pytest.mark.parametrize("kind", pairs.PAIRS)
def test_pairs_draw_the_same_work_and_are_printed(monkeypatch, kind):
    needed = {"rle": "pycocotools", "gradients": "torch"}
    pytest.importorskip(needed.get(kind, "topleft"))
    monkeypatch.setattr(pairs, "TERRAINS", (3_000,))
    for module, name in ((pairs, "UHD"), (pairs, "HD"), (others, "HD")):
        monkeypatch.setattr(module, name, (64, 48))
    planar_mesh = tl.scenes.planar_mesh
    monkeypatch.setattr(tl.scenes, "planar_mesh", lambda n, *size: planar_mesh(min(n, 300), *size))
    scene, calls = next(iter(pairs.PAIRS[kind].scenes()))
    assert len(calls) > 1
    rows = [{"scene": scene, "call": name, "ms": [1.0 + k, 2.0]} for k, name in enumerate(calls)]
    head, _, first, *more = pairs.lines({"rows": rows})
    assert head.split()[-2:] == ["ratio", "|"]
    assert (first.split()[-2], len(more)) == ("1.00", len(calls) - 1)
