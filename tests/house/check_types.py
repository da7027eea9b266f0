"""The programs of the README and the guide pass mypy --strict and pyright as they stand there."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import topleft

ROOT = Path(__file__).parents[2]
SOURCE = Path(topleft.__file__).parents[1]
BLOCK = re.compile(r"```python[ \w]*\n(.*?)```", re.DOTALL)

#: Calls from habit: what is given may be anything that NumPy reads.
HABITS = """
import numpy as np
import topleft as tl
from topleft.typing import CullOption

mesh = tl.Mesh(*tl.scenes.shape("cube"))
picture = tl.render("bunny.obj", size=640, color="red", background=(0.0, 0.0, 0.0), lights=tl.Light((0, 1, 1)))
scene = tl.Scene([mesh, (mesh, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "name")])
made = tl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], colors=[[255, 0, 0]] * 3)
camera = tl.Camera([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], picture[0, :4])
frags = tl.rasterize_mesh(made, camera, 64, sampling="msaa4", depth_test="greater")
values, slopes = frags.interpolate([0.0, 1.0, 2.0], derivatives=True)
light = frags.sample(picture, [[0, 0], [1, 0], [0, 1]]) + frags.distance(camera)[..., None]
sky = tl.Environment("skyblue", ground=[60, 50, 40], image=[[[0.5, 0.5, 0.5]]], up=[0, 0, 1], space="eye")
fog, lit = tl.Fog(1, 9, "#fff"), tl.render(scene, camera, environment=sky, shading="flat")
cloud = tl.Points([[0, 0, 0], [1, 2, 0]], colors=[[255, 0, 0]] * 2, size=[1.0, 2.0], unit="world", shape="square")
checks = tl.Texture([[0, 255], [255, 0]], filter="nearest", wrap=("clamp", "repeat"))
views = tl.turntable(made, 8, up="z", fit="silhouette")
placed = tl.Instance(made, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
grid = tl.Grid((4, 3), [0, 4, 0, 3])
names = ["color", "depth"]
found = tl.render_layers(made, camera, layers=names, edges=True, sampling="msaa2")


def draw(cull: CullOption = "back", **more: float) -> None:
    tl.coverage([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], (4, 4), cull=cull, sampling="area", near_clip=False)
    tl.fill([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], [[9, 9, 9]], (4, 4), blend="over", resolve="linear", per="triangle")
    tl.polygons([[0, 0], [1, 0], [0, 1]], (4, 4), rule="nonzero", values="index")
    tl.silhouette(made, camera, 8, sampling="area", origin=(1, 2))


for result in tl.render_batch([tl.Job(made, layers=names), tl.Job(made)], on_error="collect", order="completed"):
    if result.picture is not None:
        print(result.picture.shape, sorted(result.layers))
"""

#: Each line has a word that is misspelt, which a checker finds.
MISSPELT = """
tl.coverage(square, halves, (4, 4), sampling="centre")
tl.coverage(square, halves, (4, 4), cull="backs")
tl.coverage(square, halves, (4, 4), method="scan")
tl.coverage(square, halves, (4, 4), clip_depth="opengl")
tl.fill(square, halves, [[9]], (4, 4), blend="add it")
tl.fill(square, halves, [[9]], (4, 4), alpha="none")
tl.fill(square, halves, [[9]], (4, 4), resolve="srgb")
tl.fill(square, halves, [[9]], (4, 4), per="face")
tl.rasterize(square, halves, (4, 4), depth_test="lequal")
tl.polygons(square, (4, 4), rule="even-odd")
tl.render("bunny.obj", shading="phong")
tl.render("bunny.obj", sampling="area")
tl.rasterize_mesh("bunny.obj", sampling="4x")
tl.silhouette("bunny.obj", cull="all")
tl.points(square, (4, 4), shape="circle")
tl.field(square, [1.0], per="face")
tl.height_map(square, 1.0, surface="top")
tl.turntable(square, 8, up="x")
tl.Camera.framing(square, fit="tight")
tl.Grid((4, 4), (0, 1, 0, 1), y="north")
tl.Light((0, 1, 0), "area")
tl.Light((0, 1, 0), space="camera")
tl.Environment(space="camera")
tl.Points(square, unit="pixel")
tl.Points(square, shape="sphere")
tl.Texture(square, filter="linear")
tl.Texture(square, wrap="repeated")
tl.Texture(square, encoding="gamma")
tl.Material(alpha_mode="cutout")
tl.render_batch([], on_error="skip")
tl.render_batch([], order="any")
"""


def misspelt():
    lines = MISSPELT.strip().splitlines()
    head = ["import topleft as tl", "square = [[0, 0], [1, 0], [0, 1]]", "halves = [[0, 1, 2]]"]
    return "\n".join(head + lines) + "\n", range(len(head) + 1, len(head) + len(lines) + 1)


def programs():
    """The programs of the pages by the name of their file."""
    found = {"habits": HABITS}
    guide = [path for name in ("start.md", "guide/*.md", "tasks/*.md") for path in sorted(ROOT.glob(f"docs/{name}"))]
    for page in [ROOT / "README.md", *guide]:
        text = page.read_text(encoding="utf-8")
        if page.stem == "coming_from":
            found |= programs_of_tables(text)
        else:
            found |= {f"{page.stem.lower()}_{i}": one for i, one in enumerate(programs_of_blocks(BLOCK.findall(text)))}
    return found


def programs_of_blocks(blocks):
    """Blocks that import topleft, each with those behind it that go on with its names."""
    whole = []
    for block in blocks:
        if "import topleft" in block or not whole:
            whole.append(block)
        else:
            whole[-1] += block
    return whole


def programs_of_tables(text):
    """Of each section its block, and the middle column of its table."""
    start = BLOCK.search(text).group(1)
    found = {}
    for library, section in re.findall(r"^## (\S+)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL):
        rows = re.findall(r"^\|[^|]*\| `(.*?)` \|", section, re.MULTILINE)
        found[f"from_{library.lower().replace('-', '_')}"] = "\n".join([start, *BLOCK.findall(section), *rows, ""])
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("types")
    for name, program in programs().items():
        made.joinpath(f"{name}.py").write_text(program, encoding="utf-8")
    made.joinpath("misspelt.py").write_text(misspelt()[0], encoding="utf-8")
    made.joinpath("mypy.ini").write_text(  # PyTorch itself takes a minute to check
        "[mypy]\nstrict = true\n[mypy-torch.*]\nfollow_imports = skip\nignore_missing_imports = true\n"
        "[mypy-trimesh.*,PIL.*,scipy.*,gymnasium.*,dm_control.*]\nignore_missing_imports = true\n", encoding="utf-8"
    )  # fmt: skip
    made.joinpath("pyrightconfig.json").write_text(
        json.dumps(
            {
                "include": ["*.py"],
                "extraPaths": [str(SOURCE)],
                "typeCheckingMode": "standard",
                "reportMissingImports": False,  # of packages that are not installed here
            }
        ),
        encoding="utf-8",
    )
    return made


@pytest.fixture(scope="module")
def errors_of_mypy(folder):
    """Each error as (file, line, text)."""
    pytest.importorskip("mypy")
    where = {} if SOURCE.name == "site-packages" else {"MYPYPATH": str(SOURCE)}  # which mypy reads by itself
    found = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", "mypy.ini", "--cache-dir", folder / "cache", "."],
        capture_output=True, text=True, cwd=folder, env={**os.environ, **where},
    )  # fmt: skip
    assert found.stdout, found.stderr
    pattern = re.compile(r"^(\w+)\.py:(\d+): error: (.*)$", re.MULTILINE)  # our own files: by our own settings
    return [(name, int(line), text) for name, line, text in pattern.findall(found.stdout)]


@pytest.fixture(scope="module")
def errors_of_pyright(folder):
    """Each error as (file, line, text)."""
    pytest.importorskip("pyright", reason="pyright of the dev extra is not installed")
    command = [sys.executable, "-m", "pyright"]
    if shutil.which("node") is None or subprocess.run([*command, "--version"], capture_output=True).returncode:
        pytest.skip("pyright needs Node.js, and fetches itself at its first start")
    found = subprocess.run(
        [*command, "--outputjson", "--pythonpath", sys.executable, "-p", "."],
        capture_output=True, text=True, cwd=folder,
    )  # fmt: skip
    told = json.loads(found.stdout)["generalDiagnostics"]
    return [
        (Path(one["file"]).stem, one["range"]["start"]["line"] + 1, one["message"])
        for one in told
        if one["severity"] == "error"
    ]


@pytest.mark.parametrize("checker", ["mypy", "pyright"])
def test_programs_of_the_pages_have_types_and_misspelt_words_are_found(checker, request):
    errors = request.getfixturevalue(f"errors_of_{checker}")
    assert [error for error in errors if error[0] != "misspelt"] == []
    assert sorted({line for name, line, _ in errors if name == "misspelt"}) == list(misspelt()[1])
