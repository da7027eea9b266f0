"""The programs of the README, and of the pages that it leads to first, run as they stand there."""

import inspect
import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from topleft import scenes
from topleft.pytest_plugin import StoredPictures

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *(ROOT / f"docs/guide/{name}.md" for name in ("layers", "pictures", "grids"))]
SECTIONS = [
    found
    for page in PAGES
    for found in re.findall(
        r"^## ([^\n]*)\n(.*?)(?=^## |\Z)", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE
    )
]
#: The programs of the pages for newcomers and for tasks, by page and place.
STEPS = {
    f"{path.stem} {i}": code
    for path in [
        *(ROOT / f"docs/{name}.md" for name in ("start", "guide/cameras", "guide/masks")),
        *sorted(ROOT.glob("docs/tasks/*.md")),
    ]
    for i, code in enumerate(re.findall(r"```python\n(.*?)```", path.read_text(encoding="utf-8"), flags=re.DOTALL))
}
#: The program of each section that has one, by its heading.
PROGRAMS = {
    title: code for title, text in SECTIONS for code in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_readme_mask_has_a_hole_of_another_label(folder):
    found = {}
    exec(PROGRAMS["A mask"], found)
    assert [bool(found["inside"][y, 50]) for y in (5, 25, 38, 60)] == [False, True, False, True]
    assert [int(found["labels"][y, 50]) for y in (5, 25, 38)] == [-1, 0, 1]
    assert found["shares"].areas.sum() == pytest.approx(3650 + 150, rel=1e-6)  # of the border's ring and of the hole's
    assert found["square"].sum() == 60 * 60
    with Image.open(folder / "mask.png") as image:
        assert np.array_equal(np.asarray(image) != 0, found["inside"])


def test_readme_mesh_is_drawn(folder):
    found = {}
    exec(PROGRAMS["A mesh"], found)
    assert found["view"]["triangle"].max() >= 0
    with Image.open(folder / "knot.png") as image:
        assert image.size == (640, 480)


def test_readme_is_short_enough_to_be_read_whole():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 100


def test_readme_states_its_size(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "packaging")
    size = import_module("size")
    stated = size.stated((ROOT / "README.md").read_text(encoding="utf-8"))
    for language, lines in size.lines().items():
        assert abs(stated[language] - lines) <= 500, "run `python packaging/size.py`"


def test_size_script_replaces_numbers_alone(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "packaging")
    size = import_module("size")
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    changed = size.rewritten(text, {"C": 1234567, "minutes": 9})
    assert size.stated(changed) == size.stated(text) | {"C": 1234567, "minutes": 9}


def test_readme_layers_agree(folder):
    pytest.importorskip("trimesh")
    vertices, triangles = scenes.shape("icosahedron")
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a} {b} {c}" for a, b, c in triangles + 1]
    folder.joinpath("bunny.obj").write_text("\n".join(lines) + "\n")
    exec(PROGRAMS["Layers of a view"], {})
    with np.load("view.npz") as view:
        assert view["triangle"].shape == (480, 640)
        assert view["triangle"].max() < len(triangles)
        assert np.array_equal(view["triangle"] >= 0, np.isfinite(view["depth"]))
        assert view["triangle"][240, 320] >= 0
    with Image.open("distance.png") as image:
        assert np.array_equal(np.asarray(image) > 0, view_mask(folder))


def view_mask(folder):
    with np.load(folder / "view.npz") as view:
        return view["triangle"] >= 0


def test_readme_pictures_show_the_scene(folder):
    exec(PROGRAMS["Pictures"], {})
    for name in ("scene.png", "glass.png"):
        with Image.open(name) as image:
            assert image.size == (640, 480)
            assert len(np.unique(np.asarray(image).reshape(-1, 4), axis=0)) > 1000


def test_readme_batch_writes_all_views(folder):
    exec(PROGRAMS["Many pictures"], {})
    assert sorted(path.name for path in (folder / "views").iterdir()) == [f"{i:03}.png" for i in range(100)]


def test_readme_heights_and_fields_are_those_of_the_sphere(folder):
    pytest.importorskip("trimesh")
    found = {}
    exec(PROGRAMS["Meshes of other libraries, fields and heights"], found)
    assert found["picture"].shape == (240, 320, 4)
    assert np.nanmax(found["heights"]) == pytest.approx(1, abs=1e-3)  # a polyhedron in the unit sphere
    assert found["grid"].shape == (400, 400)
    assert np.isnan(found["grid"][0, 0])


def test_readme_grid_has_a_crs_and_no_data(folder):
    rasterio = pytest.importorskip("rasterio")
    pytest.importorskip("pyproj")
    found = {}
    exec(PROGRAMS["CRS and no data"], found)
    assert np.unique(found["zones"]).tolist() == [-9999, 7]
    with rasterio.open(folder / "zones.tif") as raster:
        assert (raster.crs.to_epsg(), raster.nodata) == (25832, -9999)


def test_readme_programs_are_all_run():
    source = Path(__file__).read_text(encoding="utf-8")
    assert [title for title in PROGRAMS if f'PROGRAMS["{title}"]' not in source] == []
    assert len(PROGRAMS) == sum(page.read_text(encoding="utf-8").count("```python") for page in PAGES)


def test_readme_has_the_two_commands():
    readme = PAGES[0].read_text(encoding="utf-8")
    commands = re.findall(r"```sh\n(.*?)\n```", readme, flags=re.DOTALL)
    assert commands == [
        "pip install '.[render]' && topleft render torus-knot -o knot.png",
        "pip install '.[test]' && python -m pytest -n auto",
    ]


@pytest.mark.parametrize("name", STEPS)
def test_program_of_a_task_runs(name, folder):
    names = {"__name__": "task"}
    exec(STEPS[name], names)
    for thing in list(names.values()):
        if getattr(thing, "__name__", "").startswith("test_"):
            pictures = StoredPictures(Path("pictures"), is_updating=True)
            thing(*[pictures.check for name in inspect.signature(thing).parameters if name == "assert_picture"])


def test_first_mask_is_the_one_of_the_page(folder, capsys):
    exec(STEPS["start 0"], {})
    page = (ROOT / "docs/start.md").read_text(encoding="utf-8")
    assert f"```text\n{capsys.readouterr().out}```" in page
