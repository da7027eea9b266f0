"""The benchmark of static scenes at a tiny size: both ways draw the same bits, clusters are counted."""

import json

import numpy as np
import pytest
from benchmarks import cli
from benchmarks.harness.records import forget
from benchmarks.static import scenes as static_scenes
from benchmarks.static import study as static
from benchmarks.static import tables as static_tables

from topleft._core.raster import choices

SCALE = 0.02
SOME = ["blob 10M", "blob 100k, whole", "cube, whole", "hills 100k", "soup, large",
        "blob 70k, 200 in rows, cull none, rasterize, "]  # fmt: skip
"""Beginnings of the labels of those that are drawn: every kind, every view of the blob, both verbs."""
CUBE = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n" + "".join(
    f"f {' '.join(map(str, face))}\n"
    for face in ((4, 3, 2, 1), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8))
)


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """Some scenes of every kind and a cube, at a hundredth of the size."""
    path = tmp_path_factory.mktemp("static") / "cube.obj"
    path.write_text(CUBE)
    options = static.StaticOptions(SOME, [path], rounds=1, seconds=0.0, most_seconds=0.0, scale=SCALE / 2)
    return static.run(options, forget)


def scene_named(label, scale=SCALE):
    """The first scene with a label that begins so, at a fiftieth of the size."""
    return next(scene for scene in static_scenes.scenes(scale) if scene.label.startswith(label))


def test_every_kind_of_scene_has_rows(record):
    assert {row["kind"] for row in record["rows"]} == {"blob", "file", "hills", "soup", "instances"}
    assert len({static.key_of(row) for row in record["rows"]}) == len(record["rows"]) > 25
    assert all(row["faster"][1] > 0 for row in record["rows"])


def test_scenes_are_told_apart_by_what_their_rows_say():
    found = [
        (scene.model, scene.view, scene.cull, scene.sampling, scene.verb, *scene.size)
        for scene in static_scenes.scenes(SCALE)
    ]
    assert len(set(found)) == len(found) > 120


def test_clusters_end_in_one_way_each(record):
    for row in record["rows"]:
        shares = row["shares"]
        assert abs(sum(shares.values()) - 1) < 1e-3
        assert min(shares.values()) >= 0
        assert ("clusters_faster" in row) != row["is_clustered"]


def test_share_of_the_frustum_is_the_one_asked_for():
    for name, share in static_scenes.ZOOMS:
        scene = scene_named(f"blob 10M, {name}", SCALE / 8)
        found = static_scenes.share_in_view(*scene.arrays, scene.camera.clip_from_world(scene.size))
        assert abs(found - share) < 0.02


def test_share_in_view_counts_triangles_that_no_plane_leaves_out():
    points = np.array([[0, 0, 0], [0.5, 0, 0], [0, 0.5, 0], [2, 0, 0], [3, 0, 0], [2, 0.5, 0]])
    triangles = np.array([[0, 1, 2], [3, 4, 5], [0, 1, 4], [3, 5, 4]])
    assert static_scenes.share_in_view(points, triangles, np.eye(4)) == 0.5


def shifted(draw, by):
    """What draws the same with so much more in each pixel."""
    return lambda: tuple(array + by for array in draw())


def test_other_bits_are_an_error(monkeypatch):
    scene = scene_named("blob 1M, whole")
    drawing, others = static.drawing, iter((0, 1, 0))
    monkeypatch.setattr(static, "drawing", lambda scene: shifted(drawing(scene), next(others)))
    with pytest.raises(AssertionError, match="'whole' draws other bits than 'planner'"):
        static.measure_scene(scene, static.StaticOptions(rounds=1, seconds=0.0))


def test_ways_draw_as_they_say(force):
    scene = scene_named("blob 10M, inside, cull none")  # 200,000 triangles
    asked = []
    kept = choices.pays_to_draw_clusters
    force(pays_to_draw_clusters=lambda *a: asked.append(kept(*a)) or asked[-1])
    row = static.measure_scene(scene, static.StaticOptions(rounds=1, seconds=0.0))
    assert row["is_clustered"]
    assert row["shares"]["outside"] > 0.5
    assert asked
    assert all(asked)


def test_rows_replace_those_of_the_same_scene(record):
    row = record["rows"][3] | {"rounds": 7}
    again = static.with_rows(record, [row], [])
    assert len(again["rows"]) == len(record["rows"])
    assert again["rows"][3]["rounds"] == 7
    assert again["models"] == record["models"]


def test_tables_hold_what_was_measured(record):
    text = "\n".join(static_tables.lines(record))
    blobs = [row for row in record["rows"] if row["kind"] == "blob" and row["size"][0] != 512]
    groups = {(row["cull"], row["n_triangles"]) for row in blobs}
    assert static_tables.blobs_text(record).count("\n") == 1 + len(groups)
    assert static_tables.blobs_text(record) in text
    assert static_tables.models_text(record).count("\n") == 1 + len(record["models"])


def test_chart_has_a_row_for_each_other_scene(record, tmp_path):
    from benchmarks.static.charts import chart_static, draw_charts, is_shown

    first, second, others = chart_static(record).axes
    assert len(others.get_yticklabels()) == sum(map(is_shown, record["rows"])) > 5
    assert [text.get_text() for text in first.get_legend().get_texts()] == list(static_scenes.VIEWS)
    assert "culled" in second.get_title("left")
    assert [path.name for path in draw_charts(record, tmp_path)] == ["static.svg"]


def test_command_measures_and_adds_to_its_file(tmp_path, capsys):
    out = tmp_path / "static.json"
    for name in ("hills 1M, above", "soup, large"):
        assert cli.main(["static", "--scene", name, "--repeats", "1", "--scale", "0.02", "-o", str(out)]) == 0
    found = json.loads(out.read_text())
    assert {row["model"] for row in found["rows"]} == {"hills 1M", "soup, large, 30k"}
    assert {model["model"] for model in found["models"]} == {"hills 1M", "soup, large, 30k"}
    assert "| hills 1M " in capsys.readouterr().out
