"""The way of a mesh from `render` to the pixel: how many files and functions of the package it passes."""

import os
import sys
from pathlib import Path

import topleft as tl

ROOT = os.path.dirname(tl.__file__) + os.sep
PARTS_OF_FUNCTIONS = ("<genexpr>", "<listcomp>", "<dictcomp>", "<setcomp>", "<lambda>")
MOST_FILES, MOST_FUNCTIONS, MOST_RETURNS = 15, 43, 57


def passed(call):
    """Files and functions of the package that a call enters, and how often one of these returns."""
    files, functions, returns = set(), set(), []

    def note(frame, event, _):
        code = frame.f_code
        if event == "return" and code.co_filename.startswith(ROOT) and code.co_name not in PARTS_OF_FUNCTIONS:
            files.add(code.co_filename.removeprefix(ROOT))
            functions.add(code)
            returns.append(code.co_qualname)

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        call()
    finally:
        sys.setprofile(before)
    return files, functions, returns


def test_mesh_on_its_way_to_the_pixel_passes_no_more_than_it_did():
    ball = tl.Mesh(*tl.scenes.icosphere(3))
    camera = tl.Camera.framing(ball)
    for _ in range(2):  # what is kept with the mesh is made
        tl.render(ball, camera, (64, 64), threads=1)
    files, functions, returns = passed(lambda: tl.render(ball, camera, (64, 64), threads=1))
    assert {"_meshes/picture/render.py", "_meshes/picture/shade.py"} <= files
    assert len(files) <= MOST_FILES, sorted(files)
    assert len(functions) <= MOST_FUNCTIONS
    assert len(returns) <= MOST_RETURNS


def test_scene_of_one_takes_the_way_of_its_mesh():
    ball = tl.Mesh(*tl.scenes.icosphere(2))
    camera, size = tl.Camera.framing(ball), (64, 64)
    found = []
    for subject in (ball, tl.Scene([ball])):
        tl.rasterize_mesh(subject, camera, size, threads=1)  # what is kept is made
        found.append(passed(lambda subject=subject: tl.rasterize_mesh(subject, camera, size, threads=1))[0])
    of_mesh, of_scene = found
    assert of_scene - of_mesh == {"_meshes/picture/fragments.py"}  # `SceneFragments`
    assert of_mesh <= of_scene


def test_samples_of_a_mesh_are_drawn_once_where_they_are_returned():
    ball = tl.Mesh(*tl.scenes.icosphere(2))
    camera, size = tl.Camera.framing(ball), (64, 64)
    calls = passed(lambda: tl.rasterize_mesh(ball, camera, size, sampling="msaa4", threads=1).samples_depth)[2]
    assert calls.count("draw_planes") == 1


def test_pictures_tell_kinds_apart_where_they_come_in_alone():
    lines = [line for path in Path(ROOT, "_meshes/picture").glob("*.py") for line in path.read_text().splitlines()]
    assert sum("isinstance(" in line or "cloud is not None" in line for line in lines) <= 14  # 22 in one class of shot
