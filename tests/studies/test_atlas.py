"""The atlas: its exact pictures, its scenes, its counts against the record, the page."""

import itertools
import json

import numpy as np
import pytest
from benchmarks import cli
from benchmarks.atlas import measure as atlas
from benchmarks.atlas.depth import DEPTH_FAMILIES, DepthScene, Picture, draw, draw_clip, draw_pieces, judge_depth
from benchmarks.harness.machine import IMAGES, PAGES, RECORDS

from topleft._apps.explore.race import PRODUCTION, Entry, entries
from topleft.failure_scenes import FAILURE_SCENES
from topleft.methods import CLASSICS
from topleft.methods.reference.integers import ExactPicture
from topleft.scene_families import FAMILIES

SIZE = (12, 11)
EVERY_FAMILY = pytest.mark.parametrize("name", [name for name in FAMILIES if name != "dense"])


def random_scene(bits, seed):
    """Triangles on a grid of 2**-bits px, degenerate ones among them."""
    rng = np.random.default_rng(seed)
    vertices = np.rint(rng.uniform(-3, 15, (9, 2)) * 2.0**bits) / 2.0**bits
    return vertices, rng.integers(0, 9, (6, 3)).astype(np.int32)


@pytest.fixture(scope="module")
def record():
    """The record that is kept."""
    return json.loads((RECORDS / "atlas.json").read_text())


# ---- exact pictures -------------------------------------------------------------------------------------------------


def test_exact_clip_of_what_lies_before_the_near_plane_is_that_of_pixels():
    vertices, triangles = random_scene(4, 3)
    ndc = vertices / (np.array(SIZE) / 2) * [1, -1] + [-1, 1]
    w = np.array([0.5, 1, 2, 4, 8, 1, 2, 4, 0.25])[:, None]
    clip = np.concatenate([ndc * w, 0 * w, w], axis=-1)
    vertices = (ndc * [1, -1] + 1) * (np.array(SIZE) / 2)  # rounded as the corners of the picture are
    ids, count = draw_clip(clip, triangles, SIZE)
    exact = ExactPicture(vertices, triangles, SIZE)
    assert (count != exact.count).sum() + (ids != exact.triangle).sum() == 0


def test_exact_clip_near_plane_cuts_a_floor():
    floor = np.array([[-9.0, -1, -5, -4], [9, -1, -5, -4], [0, -1, 7, 9]])  # from behind the eye to w = 9
    ids, count = draw_clip(floor, np.array([[0, 1, 2]]), (8, 8))
    ids_of_pieces, count_of_pieces = draw_pieces(floor, np.array([[0, 1, 2]]), (8, 8), 16)
    assert count.sum() > 0
    assert not count[:4].any()  # below the horizon
    assert count.tolist() == count_of_pieces.tolist()
    assert ids.tolist() == ids_of_pieces.tolist()


def test_judge_depth_sees_a_depth_that_is_off_and_a_triangle_that_hides_a_nearer_one():
    square = np.array([[-9.0, -9], [99, -9], [-9, 99]])
    vertices = np.concatenate([np.c_[square, [0.25, 0.5, 0.5]], np.c_[square, [0.125, 0.25, 0.5]]])
    scene = DepthScene(vertices, np.array([[0, 1, 2], [3, 4, 5]], np.int32), (4, 4))
    drawn = draw(scene, "auto", 8)
    assert judge_depth(scene, drawn, 8)[:4] == (0, 0, 0, 0)
    depth = drawn.depth.copy()
    depth[1, 2] = np.nextafter(depth[1, 2], np.float32(1), dtype=np.float32)
    depth[1, 2] = np.nextafter(depth[1, 2], np.float32(1), dtype=np.float32)
    assert judge_depth(scene, Picture(drawn.ids, depth, drawn.counts), 8)[:4] == (0, 0, 0, 1)
    hidden = Picture(drawn.ids * 0, drawn.depth, drawn.counts)
    assert judge_depth(scene, hidden, 8)[:4] == (16, 0, 0, 16)


# ---- scenes and counts ----------------------------------------------------------------------------------------------


@EVERY_FAMILY
def test_family_first_and_last_scene_cover_the_frame_once(name):
    family = FAMILIES[name]
    for pick in (0, -1):
        scene = family.make(*(list(axis.values.values())[pick] for axis in family.axes), 0)
        exact = ExactPicture(scene.vertices, scene.triangles, scene.size, origin=scene.origin)
        assert (exact.count == 1).all()
        assert exact.is_edge.any()


def test_entries_every_method_that_fills():
    assert {entry.method for entry in entries()} == {"auto", "edge", "scanline", *CLASSICS} - {
        "bresenham_scanline/wireframe"
    }
    assert {Entry(name, name).snap for name in ("lerp_scanline", "float_barycentric", "zigzag")} == {
        "px", "float32", "8"
    }  # fmt: skip


@pytest.mark.parametrize(("family", "methods"), [("edge", ["auto", "float_barycentric"]), ("eye", [])])
def test_atlas_of_a_family_is_that_of_the_record(record, family, methods):
    again = json.loads(json.dumps(atlas.run_atlas(names=[family], methods=methods)))
    assert again["families"] == [facts for facts in record["families"] if facts["name"] == family]
    rows = {row["entry"]: row for row in record["maps"] if row["family"] == family}
    assert again["maps"] == [rows[row["entry"]] for row in again["maps"]]
    assert len(again["maps"]) == (len(methods) or len(rows))


def test_atlas_record_has_a_map_of_every_entry_and_family(record):
    found = {(row["family"], row["entry"]) for row in record["maps"]}
    names = [entry.name for entry in entries()]
    wished = {*itertools.product(FAMILIES, names), *itertools.product(DEPTH_FAMILIES, PRODUCTION)}
    assert found == wished | {("layers", entry.name) for entry in atlas.SAMPLED}


def test_atlas_production_methods_are_exact_and_leave_no_gap(record):
    rows = [row for row in record["maps"] if row["entry"] in [*PRODUCTION, *(e.name for e in atlas.SAMPLED)]]
    assert sum(n for row in rows for n in row["inexact"] if n) == 0
    assert sum(n for row in rows if row["entry"] != "auto, 0 bits" for n in row["gaps"] if n) == 0


def test_atlas_exact_claims_hold(record):
    exact = [name for name, method in CLASSICS.items()
             if method.claims.exact and not method.claims.overdraws_shared_edges]  # fmt: skip
    counts = [n for row in record["maps"] if row["entry"] in exact for n in row["inexact"] if n is not None]
    assert len(counts) > 100
    assert sum(counts) == 0


# ---- the page -------------------------------------------------------------------------------------------------------


def test_atlas_page_shows_every_chart(record):
    text = (PAGES / "atlas.md").read_text(encoding="utf-8")
    charts = [name for name, family in FAMILIES.items() if len(family.axes) == 1]
    shown = {path.stem for path in IMAGES.glob("atlas-*") if f"images/{path.name}" in text}
    assert shown == {f"atlas-{name}" for name in (*charts, "depth", "scenes-any", "scenes-far", "scenes-shape")}


def test_atlas_command_writes_what_report_prints(tmp_path, capsys):
    target = tmp_path / "tiny.json"
    assert cli.main(["atlas", "--family", "layers", "eye", "--method", "auto", "zigzag", "-o", str(target)]) == 0
    printed = capsys.readouterr().out
    assert "`zigzag`" in printed
    assert cli.main(["report", str(target)]) == 0
    assert capsys.readouterr().out == printed


def test_atlas_charts_have_a_row_a_method_and_a_colour_where_it_fails(record):
    from benchmarks.atlas import charts as atlas_charts
    from matplotlib import pyplot as plt

    (facts,) = (facts for facts in record["families"] if facts["name"] == "layers")
    figure = atlas_charts.chart_family(record, facts)
    rows = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert rows == [row["entry"] for row in record["maps"] if row["family"] == "layers"]
    (colors,) = (image.get_array() for image in figure.axes[1].images)
    n_failed = sum(bool(n) for row in record["maps"] if row["family"] == "layers" for n in row["overdrawn"])
    assert (colors < 1).any(axis=2).sum() == n_failed > 10
    plt.close(figure)


def test_magnified_pictures_show_each_wrong_picture_once():
    from benchmarks.atlas import magnified as atlas_pictures

    families = {family for group in atlas_pictures.SHEETS.values() for family in group}
    assert families >= {scene.family for scene in FAILURE_SCENES.values()}
    for scene in FAILURE_SCENES.values():
        found = list(atlas_pictures.triptychs(scene))
        assert {own.rows for own in found} == {got.rows for got in scene.got}
        assert sum(len(own.methods) for own in found) == len(scene.got)
    inside = list(atlas_pictures.edges_in_window(FAILURE_SCENES["far-1e14-overdraw"]))
    assert len(inside) == 4  # the fifth passes outside
    assert all(-1 <= x <= 8 for segment in inside for point in segment for x in point)
