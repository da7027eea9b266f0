"""The examples run as a user runs them, and the pictures of docs/guide/examples.md are theirs; the notebooks run."""

import ast
import json
import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted(path.stem for path in ROOT.joinpath("examples").glob("*.py") if path.stem != "picture")
NOTEBOOKS = sorted(ROOT.joinpath("examples").glob("*.ipynb"))
PAGE = ROOT.joinpath("docs", "guide", "examples.md").read_text(encoding="utf-8")


@pytest.fixture
def run(monkeypatch, capsys):
    """Run an example as `python` runs a file; what it prints."""

    def run_file(name, output, *options):
        path = ROOT / "examples" / f"{name}.py"
        monkeypatch.syspath_prepend(path.parent)
        monkeypatch.setattr(sys, "argv", [str(path), "-o", str(output), *options])
        runpy.run_path(str(path), run_name="__main__")
        return capsys.readouterr().out

    return run_file


@pytest.mark.parametrize("name", EXAMPLES)
def test_example_makes_the_picture_of_the_page(name, run, tmp_path):
    if name == "thumbnails":
        pytest.importorskip("trimesh")
    if name == "parcels":
        pytest.importorskip("shapely")
    run(name, tmp_path / "out.png")
    on_page = ROOT / "docs" / "images" / f"example-{name}.png"
    with Image.open(tmp_path / "out.png") as made, Image.open(on_page) as shown:
        assert made.size == shown.size
        difference = np.abs(np.asarray(made.convert("RGB"), int) - np.asarray(shown.convert("RGB"), int))
    # Sines and powers of other machines may differ in the last bit, which moves an edge here and there.
    assert (difference.max(axis=-1) > 3).mean() < 0.01


def test_examples_are_thirteen_and_all_on_the_page():
    assert len(EXAMPLES) == 13
    assert sorted(re.findall(r"images/example-(\w+)\.png", PAGE)) == EXAMPLES
    assert sorted(re.findall(r"\(../../examples/(\w+)\.py\)", PAGE)) == EXAMPLES


def test_pictures_of_the_page_are_small():
    for name in EXAMPLES:
        assert ROOT.joinpath("docs", "images", f"example-{name}.png").stat().st_size < 100_000


def test_thumbnails_of_a_folder(run, tmp_path):
    pytest.importorskip("trimesh")
    folder = tmp_path / "meshes"
    folder.mkdir()
    folder.joinpath("one.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert run("thumbnails", tmp_path / "sheet.png", "--folder", str(folder)) == "one.obj: 1 triangles\n"
    with Image.open(tmp_path / "sheet.png") as sheet:
        assert sheet.size == (4 * 128, 128)


def test_area_resampling_loses_nothing(run, tmp_path):
    before, after = re.findall(r"[\d.]+\d", run("area_resampling", tmp_path / "out.png"))
    assert float(before) == pytest.approx(float(after), rel=1e-5)


def test_segmentation_masks_have_boxes(run, tmp_path):
    lines = run("segmentation_mask", tmp_path / "out.png").splitlines()
    assert len(lines) == 4
    assert all(int(line.split()[-2]) > 1000 for line in lines)


def code_cells(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_and_what_it_claims_is_so(path):
    """Cells are run as a notebook runs them; where the last line is a comparison, it is a claim."""
    names = {}
    n_claims = 0
    for cell in code_cells(path):
        body = ast.parse("".join(cell["source"])).body
        last = body.pop() if isinstance(body[-1], ast.Expr) else None
        exec(compile(ast.Module(body, []), path.name, "exec"), names)
        if last is not None:
            shown = eval(compile(ast.Expression(last.value), path.name, "eval"), names)
            if isinstance(last.value, ast.Compare) or ast.unparse(last).startswith("np.allclose"):
                assert shown, ast.unparse(last)
                n_claims += 1
    assert n_claims >= 1


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_keeps_no_output(path):
    assert [cell for cell in code_cells(path) if cell["outputs"] or cell["execution_count"]] == []


def test_notebooks_are_two():
    assert len(NOTEBOOKS) == 2
