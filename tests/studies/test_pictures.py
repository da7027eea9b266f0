"""Pictures beside OpenGL: what is counted, the record and its page, and topleft against the pictures that are kept."""

import json
import sys

import numpy as np
import pytest
from benchmarks import cli
from benchmarks.harness.machine import IMAGES, RECORDS
from benchmarks.pictures import study as pictures
from benchmarks.pictures.scenes import SCENES, SIZE, PictureScene, draw
from benchmarks.pictures.study import SNAP_PX, Drawn, compare, distance_to_edges, inside, outline_px, read_sheet

import topleft as tl

GOAL = 1.0
"""Grey levels, the mean inside."""

SQUARE = np.array([(0.5, 0.5), (4.5, 0.5), (4.5, 4.5), (0.5, 4.5)])


@pytest.fixture(scope="module")
def record():
    """The record that is kept."""
    return json.loads((RECORDS / "pictures.json").read_text())


# ---- what is counted ------------------------------------------------------------------------------------------------


def test_inside_is_where_both_show_the_same_and_no_background_is_near():
    ours = np.zeros((5, 6), int)
    theirs = ours.copy()
    ours[2, 4], theirs[1, 1] = -1, 7
    assert inside(ours, ours).astype(int).tolist() == [
        [0, 0, 0, 0, 0, 0], [0, 1, 1, 0, 0, 0], [0, 1, 1, 0, 0, 0], [0, 1, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0],
    ]  # fmt: skip
    assert inside(ours, theirs)[1].tolist() == [False, False, True, False, False, False]


@pytest.mark.parametrize(
    ("point", "expected"), [((2.5, 1.5), 1), ((4.5, 3), 0), ((7.5, 8.5), 5), ((-1.5, 2), 2), ((0.5, 0.5), 0)]
)
def test_distance_is_to_the_nearest_edge_of_the_polygon(point, expected):
    assert distance_to_edges(np.array(point), SQUARE) == expected


def drawn(ids, grey):
    return Drawn(np.repeat(np.uint8(grey)[..., None], 3, axis=-1), np.array(ids))


def test_comparison_counts_what_differs_and_what_the_snap_explains():
    ids, grey = np.zeros((5, 5), int), np.full((5, 5), 100)
    other_ids, other_grey = ids.copy(), grey.copy()
    other_grey[2, 2] = 104
    other_grey[0, 0] = 0  # at the border of the picture: not inside
    got = compare(drawn(ids, grey), drawn(other_ids, other_grey), lambda _: SQUARE)
    assert (got["n_inside"], got["mean"], got["max"], got["n_other"]) == (9, round(4 / 9, 4), 4, 1)
    assert (got["n_coverage"], got["n_triangle"], got["max_distance_px"], got["n_unexplained"]) == (0, 0, 0, 0)


@pytest.mark.parametrize(("shift", "n_unexplained"), [(SNAP_PX / 2, 0), (SNAP_PX * 2, 1)])
def test_comparison_pixel_beyond_the_snap_is_unexplained(shift, n_unexplained):
    ids, grey = np.zeros((5, 5), int), np.full((5, 5), 100)
    other_ids = ids.copy()
    other_ids[4, 2], other_ids[0, 2] = -1, 1  # centres on the lower and the upper edge
    outlines = {0: SQUARE + [0, shift], 1: SQUARE + 100}
    got = compare(drawn(ids, grey), drawn(other_ids, grey), outlines.__getitem__)
    assert (got["n_coverage"], got["n_triangle"]) == (1, 1)
    assert got["max_distance_px"] == round(shift, 6)
    assert got["n_unexplained"] == 2 * n_unexplained


def test_outline_of_a_triangle_ends_at_the_near_plane():
    mesh = tl.Mesh([(0, 0, -2), (1, 0, -2), (0, 0, 2)], [(0, 1, 2)])
    camera = tl.Camera.off_center(np.eye(4), left=-1, right=1, bottom=-1, top=1, near=1, far=9)
    corners = outline_px(PictureScene("", mesh, camera), 0)
    x, y = SIZE[0] / 2, SIZE[1] / 2
    # The edge from (1, 0, -2) to (0, 0, 2) is cut after a quarter of its way, at x = 0.75 and z = -1.
    assert np.allclose(corners, [(x, y), (1.5 * x, y), (1.75 * x, y), (x, y)], rtol=1e-12)


# ---- the record, its page and its pictures --------------------------------------------------------------------------


def test_record_holds_the_goal_in_every_scene(record):
    assert [row["scene"] for row in record["scenes"]] == list(SCENES)
    for row in [*record["scenes"], record["outlines"]]:
        assert row["mean"] < GOAL
        assert row["n_unexplained"] == 0
        assert row["max_distance_px"] <= SNAP_PX
    assert all(row["n_inside"] > 10_000 for row in record["scenes"])


@pytest.mark.parametrize("name", SCENES)
def test_kept_picture_of_opengl_is_what_topleft_draws(name):
    kept, theirs = read_sheet(pictures.sheet_path(IMAGES, name))
    ours, ids = draw(SCENES[name]())
    assert np.abs(ours.astype(int) - kept).max() <= 1  # a kernel may round the other way than the one of the record
    difference = np.abs(ours.astype(int) - theirs)[inside(ids)]
    assert difference.mean() < GOAL
    assert (difference.max(axis=-1) > 8).mean() < 0.001  # these show another triangle


def test_sheets_are_small():
    assert max(pictures.sheet_path(IMAGES, name).stat().st_size for name in SCENES) < 150_000


def test_sheet_is_read_back(tmp_path):
    ours, theirs = np.random.default_rng(1).integers(0, 256, (2, 4, 9, 3), np.uint8)
    pictures.write_sheet(tmp_path / "a/sheet.png", ours, theirs)
    got = read_sheet(tmp_path / "a/sheet.png")
    assert np.array_equal(got, (ours, theirs))


# ---- the command ----------------------------------------------------------------------------------------------------


def test_pictures_command_without_moderngl_is_refused(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "moderngl", None)
    assert cli.main(["pictures", "--scene", "flat"]) == 2
    assert "moderngl" in capsys.readouterr().err


def test_pictures_command_draws_compares_and_writes(tmp_path, monkeypatch):
    pytest.importorskip("moderngl")
    monkeypatch.setattr(pictures, "N_VIEWS", 3)
    out = tmp_path / "pictures.json"
    assert cli.main(["pictures", "--scene", "flat", "--sheets", str(tmp_path), "-o", str(out)]) == 0
    (row,) = json.loads(out.read_text())["scenes"]
    assert row["scene"] == "flat"
    assert row["mean"] < GOAL
    assert row["n_unexplained"] == 0
    assert read_sheet(tmp_path / "pictures-flat.png")[0].shape == (*SIZE[::-1], 3)
