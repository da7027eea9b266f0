"""The scenes that methods fail on: the failure is what it is said to be, and the production methods are right."""

import numpy as np
import pytest

import topleft as tl
from topleft.failure_scenes import FAILURE_SCENES, picture
from topleft.methods import CLASSICS, METHODS, reference

EVERY_SCENE = pytest.mark.parametrize("scene", FAILURE_SCENES.values(), ids=str)
FAILURES = [pytest.param(scene, got, id=f"{scene.name}-{got.method}-{got.subpixel_bits}")
            for scene in FAILURE_SCENES.values() for got in scene.got]  # fmt: skip


def turned(scene, method):
    """The triangles with the winding that the method draws, told from whole pixels as it does."""
    winding = {**METHODS, **CLASSICS}[method].claims.winding
    if winding == "either":
        return scene.triangles
    points = [(int(x), int(y)) for x, y in scene.points]
    is_clockwise = [reference.edge_function(*(points[i] for i in triangle)) > 0 for triangle in scene.triangles]
    return [t if is_so == (winding == "clockwise") else t[::-1]
            for t, is_so in zip(scene.triangles, is_clockwise, strict=True)]  # fmt: skip


def drawn(scene, method, subpixel_bits):
    """Counts, or for scenes that show a wrong triangle, ids in painter's order."""
    triangles = turned(scene, method)
    options = {"method": method, "subpixel_bits": subpixel_bits, "origin": scene.origin}
    if scene.kind != "wrong":
        return tl.overdraw(scene.points, triangles, scene.size, **options)
    ids = np.arange(len(triangles), dtype=np.float32)
    return tl.fill(scene.points, triangles, ids, scene.size, per="triangle", background=-1, **options)


def faults(scene, got):
    """What the kind of the scene says is wrong with the picture."""
    expected = picture(scene.expected)
    return {"gap": got < expected, "overdraw": got > expected, "wrong": got != expected}[scene.kind]


@pytest.mark.parametrize(("scene", "got"), FAILURES)
def test_failure_scene_method_fails_as_it_is_said_to(scene, got):
    assert drawn(scene, got.method, got.subpixel_bits).tolist() == picture(got.rows).tolist()
    assert faults(scene, picture(got.rows)).any()


@EVERY_SCENE
@pytest.mark.parametrize("method", METHODS)
def test_failure_scene_production_method_is_right(scene, method):
    assert drawn(scene, method, scene.subpixel_bits).tolist() == picture(scene.expected).tolist()


@EVERY_SCENE
def test_failure_scene_expected_picture_is_that_of_the_reference_and_the_snap_moves_nothing(scene):
    vertices, triangles = scene.shape()
    bits, view = scene.subpixel_bits, {"origin": scene.origin, "subpixel_bits": scene.subpixel_bits}
    if scene.kind == "wrong":
        expected = reference.ids(vertices, triangles, scene.size, **view)
    else:
        expected = reference.overdraw(vertices, triangles, scene.size, **view)
    assert expected.tolist() == picture(scene.expected).tolist()
    assert (vertices * 2.0**bits == np.rint(vertices * 2.0**bits)).all()


def test_failure_scenes_each_fallible_method_is_there():
    found = {got.method for scene in FAILURE_SCENES.values() for got in scene.got}
    fills = [name for name in CLASSICS if not name.endswith("/wireframe")]
    assert found >= {*fills, *METHODS}  # production: at 8 bits or less, where more bits are right
