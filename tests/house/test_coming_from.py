"""docs/guide/coming_from.md, tensors.md and words.md: every line of topleft runs, what they say of others is so."""

import functools
import re
from pathlib import Path

import numpy as np
import pytest

import topleft as tl

GUIDE = Path(__file__).parents[2] / "docs" / "guide"
PAGE = GUIDE.joinpath("coming_from.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"```python[ \w]*\n(.*?)```", re.DOTALL)
SECTIONS = dict(re.findall(r"^## (\S+)\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL))
LIBRARIES = ["nvdiffrast", "pytorch3d", "pyrender", "trimesh", "OpenCV", "scikit-image", "rasterio", "pycocotools",
             "datashader"]  # fmt: skip


def rows(text):
    """The three cells of each row of a table, its head left out."""
    return [re.split(r" *\| *", line.strip())[1:-1] for line in re.findall(r"^\|.*\|$", text, re.MULTILINE)][2:]


@pytest.fixture
def names(tmp_path, monkeypatch):
    """What the first block of the page defines, in a folder with a mesh."""
    monkeypatch.chdir(tmp_path)
    found = {}
    exec(BLOCK.search(PAGE).group(1), found)
    lines = [f"v {x} {y} {z}" for x, y, z in found["vertices"]] + [f"f {a} {b} {c}" for a, b, c in found["faces"] + 1]
    tmp_path.joinpath("mesh.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return found


def test_page_has_a_table_for_each_library_of_its_title():
    assert list(SECTIONS) == [*LIBRARIES, "tripcolor"]
    assert PAGE.splitlines()[0] == f"# Coming from {', '.join(SECTIONS)}"
    assert all(len(row) == 3 for text in SECTIONS.values() for row in rows(text))
    assert all(len(rows(text)) >= 5 for text in SECTIONS.values())


@pytest.mark.parametrize("library", SECTIONS)
def test_lines_of_the_page_run(library, names):
    text = SECTIONS[library]
    if library == "nvdiffrast":
        pytest.importorskip("torch")
    if "tl.load" in text:
        pytest.importorskip("trimesh")
    if "tl.simplify" in text:
        pytest.importorskip("fast_simplification")
    for block in BLOCK.findall(text):
        exec(block, names)
    for _, here, _ in rows(text):
        (code,) = re.fullmatch(r"`(.*)`", here).groups()
        exec(code, names)


def test_program_of_the_tensors_page_runs():
    pytest.importorskip("torch")
    found = {}
    exec(BLOCK.search(GUIDE.joinpath("tensors.md").read_text(encoding="utf-8")).group(1), found)
    assert found["color"].shape == (1, 256, 256, 3)
    assert found["pos"].grad.abs().sum() > 0


# What the page says of others


def test_opencv_projects_where_the_camera_does(names):
    cv2 = pytest.importorskip("cv2")
    pose, k, vertices, size = (names[name] for name in ("camera_from_world", "K", "vertices", "size"))
    expected, _ = cv2.projectPoints(vertices, cv2.Rodrigues(pose[:3, :3])[0], pose[:3, 3], k, None)
    camera = tl.Camera.from_intrinsics(k, pose, size, near=0.1, far=100)
    np.testing.assert_allclose(camera.project(vertices, size)[:, :2] - 0.5, expected[:, 0], atol=1e-9)


def test_opencv_fills_the_border_too(names):
    cv2 = pytest.importorskip("cv2")
    theirs = cv2.fillPoly(np.zeros((48, 64), np.uint8), [np.int32([[3, 2], [50, 8], [40, 41]])], 255) > 0
    ours = tl.polygons(np.array([[3.5, 2.5], [50.5, 8.5], [40.5, 41.5]]), names["size"])
    assert theirs[ours].all()
    assert theirs.sum() > ours.sum()


@pytest.mark.parametrize("row", [row for row in rows(SECTIONS["OpenCV"]) if "cv2.fill" in row[0] and "255" in row[0]])
def test_fills_of_opencv_have_the_dtype_and_the_range_here(row, names):
    cv2 = pytest.importorskip("cv2")
    ring = np.int32([[3, 2], [30, 5], [50, 8], [55, 30], [40, 41]])
    mask = np.zeros((48, 64), np.uint8)
    there, here, what = row
    exec(there.strip("`"), names | {"cv2": cv2, "mask": mask, "ring": ring})
    ours = eval(here.strip("`"), names | {"ring": ring})
    if "LINE_AA" in there:
        assert "float32 of 0 to 1" in what
        assert ours.dtype == np.float32
        ours = np.where(ours == 1, np.uint8(255), np.uint8(0))
    assert (ours.dtype, np.unique(ours).tolist()) == (mask.dtype, [0, 255])
    assert mask[ours > 0].all()
    assert (mask > 0).sum() < (ours > 0).sum() + 300


def test_skimage_has_rows_first_and_centres_on_whole_numbers(names):
    draw = pytest.importorskip("skimage.draw")
    ring = names["ring"]
    assert np.array_equal(draw.polygon2mask((48, 64), ring[:, ::-1]), tl.polygons(ring + 0.5, names["size"]))
    rows, columns = draw.line(1, 2, 20, 40)
    assert np.array_equal(tl.bresenham_line(2, 1, 40, 20), np.stack([columns, rows], 1))


def test_rasterio_draws_the_same_values(names):
    features = pytest.importorskip("rasterio.features")
    transform = pytest.importorskip("rasterio.transform").from_bounds(0, 0, 64, 48, 64, 48)
    shapes = [{"type": "Polygon", "coordinates": [[*one.tolist(), one[0].tolist()]]} for one in
              (names["ring"], names["ring2"])]  # fmt: skip
    pairs = list(zip(shapes, (7, 9), strict=True))
    theirs = features.rasterize(pairs, out_shape=(48, 64), transform=transform, fill=0)
    grid = tl.Grid((64, 48), (0, 64, 0, 48))
    ours = tl.polygons([[names["ring"]], [names["ring2"]]], grid, values=[7, 9], background=0)
    assert np.array_equal(theirs, ours)
    mask = features.geometry_mask(shapes[:1], out_shape=(48, 64), transform=transform)
    assert np.array_equal(mask, ~tl.polygons(names["ring"], grid))


def test_pycocotools_writes_the_same_text_and_other_borders(names):
    coco = pytest.importorskip("pycocotools.mask")
    mask = names["frags"].mask
    assert coco.encode(np.asfortranarray(mask.astype(np.uint8)))["counts"].decode() == tl.to_rle(mask)["counts"]
    theirs = coco.decode(coco.frPyObjects([names["ring"].ravel().tolist()], 48, 64))[..., 0] > 0
    ours = tl.polygons(names["ring"], (64, 48))
    assert 0 < (theirs != ours).sum() < 0.2 * ours.sum()


def test_matplotlib_interpolates_the_same_numbers(names):
    tri = pytest.importorskip("matplotlib.tri")
    triangulation = tri.Triangulation(*names["points"].T, names["triangles"])
    grid = tl.Grid.around(tl.as_mesh(triangulation), size=names["size"])
    x, y = np.meshgrid(grid.x_centers, grid.y_centers)
    theirs = tri.LinearTriInterpolator(triangulation, names["values"])(x, y).filled(np.nan)
    np.testing.assert_allclose(tl.field(triangulation, names["values"], grid), theirs, atol=1e-9)
    ours = tl.rasterize(grid.to_pixels(names["points"]), names["triangles"], names["size"]).triangle
    assert np.array_equal(triangulation.get_trifinder()(x, y), ours)


def test_window_depth_is_half_of_z_over_w_and_a_half(names):
    frags = tl.rasterize(names["clip"], names["faces"], names["size"])
    z_w = frags.interpolate(names["clip"][:, 2:])
    z, w = z_w[frags.mask].T
    np.testing.assert_allclose((2 * frags.depth - 1)[frags.mask], z / w, atol=1e-5)


# words.md


WORDS = GUIDE / "words.md"
WORDS_TEXT = WORDS.read_text(encoding="utf-8")
ROWS = re.findall(r"^\| (.+?) \| (.+?) \| \[[^\]]*\]\((.+?)\) \|$", WORDS_TEXT, re.MULTILINE)
CALLS = re.compile(r"`(tl|frags|topleft)[.]([\w.]+)")
OPTIONS = re.compile(r"`(\w+)=")


def test_page_of_words_has_its_rows():
    assert len(ROWS) == len([line for line in WORDS_TEXT.splitlines() if line.startswith("| ")]) - WORDS_TEXT.count(
        "| your word |"
    )
    assert len(ROWS) > 40


def test_each_word_stands_in_one_row():
    words = [word.strip("` ").lower() for row in ROWS for word in row[0].split(", ")]
    assert sorted(words) == sorted(set(words))


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0].split(",")[0].strip("`"))
def test_call_exists_and_its_page_names_it(row):
    _, here, page = row
    text = (WORDS.parent / page).read_text(encoding="utf-8")
    names = []
    for owner, path in CALLS.findall(here):
        names.append(path.rpartition(".")[2])
        if owner != "topleft":
            functools.reduce(getattr, path.split("."), tl if owner == "tl" else tl.Fragments)
    names += [f"{option}=" for option in OPTIONS.findall(here)]
    assert not names or any(name in text for name in names), f"{page} names none of {', '.join(names)}"
