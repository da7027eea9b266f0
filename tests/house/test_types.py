"""The programs of the README pass mypy --strict as they stand there."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import topleft

ROOT = Path(__file__).parents[2]
PROGRAMS = re.findall(r"```python\n(.*?)```", ROOT.joinpath("README.md").read_text(encoding="utf-8"), flags=re.DOTALL)

#: Continues the program before it, whose mesh, camera and size it takes.
PREAMBLE = 'import topleft as tl\nmesh = tl.Mesh(*tl.scenes.shape("cube"))\n'


def test_programs_of_the_readme_have_types(tmp_path):
    pytest.importorskip("mypy")
    for i, program in enumerate(PROGRAMS):
        (tmp_path / f"program_{i}.py").write_text(program)
    (tmp_path / "habits.py").write_text(
        PREAMBLE
        + """
picture = tl.render("bunny.obj", size=640, color="red", background=(0.0, 0.0, 0.0), lights=tl.Light((0, 1, 1)))
scene = tl.Scene([mesh, (mesh, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "name")])
made = tl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], colors=[[255, 0, 0]] * 3)
camera = tl.Camera([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], picture[0, :4])
frags = tl.rasterize_mesh(made, camera, 64)
values, slopes = frags.interpolate([0.0, 1.0, 2.0], derivatives=True)
light = frags.sample(picture, [[0, 0], [1, 0], [0, 1]]) + frags.distance(camera)[..., None]
for result in tl.render_batch([tl.Job(made)]):
    if result.picture is not None:
        print(result.picture.shape, sorted(result.layers))
"""
    )
    found = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports",
         "--cache-dir", tmp_path / "cache", tmp_path],
        capture_output=True, text=True, cwd=tmp_path,
        env={**os.environ, "MYPYPATH": str(Path(topleft.__file__).parents[1])},
    )  # fmt: skip
    # Our own files are checked by our own settings.
    lines = [line for line in found.stdout.splitlines() if line.startswith(("program_", "habits"))]
    assert found.stdout, found.stderr
    assert not lines, "\n".join(lines)
