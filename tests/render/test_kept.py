"""Pictures of a mesh whose options are kept, and drawn by one call of the engine: as its stages make them."""

import weakref
from dataclasses import replace

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, on

import topleft as tl
from topleft._core.raster import choices
from topleft._core.raster.view import View

SIZE = (70, 66)
BALL = tl.scenes.icosphere(3)


def by_stages(mesh, camera, size=SIZE, **options):
    frags = tl.rasterize_mesh(mesh, camera, size, cull=options.pop("cull", None), threads=1)
    return tl.shade(frags, mesh, camera, **options)


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("ortho_height", [None, 3.0])
def test_picture_at_once_equals_its_stages(isa, dtype, ortho_height):
    mesh = tl.Mesh(BALL[0].astype(dtype), BALL[1])
    with on(isa), choices.forced(draws_at_once=True):
        for x in (0.3, 1.4):
            camera = tl.Camera.look_at((x, 1, 2), ortho_height=ortho_height)
            for options in ({}, {"shading": "flat", "cull": "back"}, {"shading": "normals", "color": "red"}):
                picture = tl.render(mesh, camera, SIZE, threads=1, **options)
                assert np.array_equal(picture, by_stages(mesh, camera, **options))


def test_picture_of_many_vertices_finds_those_that_show():
    mesh, camera = tl.Mesh(*BALL), tl.Camera.look_at((0.3, 1, 2))
    picture = tl.render(mesh, camera, (20, 21), threads=1)
    assert len(mesh.vertices) > 20 * 21
    assert np.array_equal(picture, by_stages(mesh, camera, (20, 21)))


@pytest.mark.parametrize("eye", [(0.2, 0.1, 0), (0, 0, 1.0002)])
def test_picture_with_clipped_vertices_equals_its_stages(eye):
    mesh, camera = tl.Mesh(*BALL), tl.Camera.look_at(eye, (5, 1, 0.3), near=0.01, far=1.5)
    picture = tl.render(mesh, camera, SIZE, threads=1)
    assert np.array_equal(picture, by_stages(mesh, camera))
    assert (picture != 255).any()


def test_picture_at_once_is_asked_for_where_nothing_else_is_to_be_chosen(monkeypatch):
    monkeypatch.setattr(choices, "available_threads", lambda: 4)

    def at_once(n_triangles, size, **options):
        return choices.draws_at_once(View.parse(size, options), n_triangles)

    assert at_once(70_000, (512, 512), threads=1)
    assert at_once(1000, (64, 64))
    assert not at_once(70_000, (512, 512))
    assert not at_once(70_000, (512, 512), threads=2)
    assert not at_once(70_000, (1920, 1080), threads=1)  # in bands, maybe
    assert not at_once(1000, (512, 512), threads=1)  # with bounds, maybe
    assert not at_once(70_000, (512, 512), threads=1, sampling="msaa4")
    assert not at_once(70_000, (512, 512), threads=1, subpixel_bits="exact")
    assert not at_once(70_000, (0, 512), threads=1)


@pytest.mark.parametrize("least", [0, 20_481])
def test_mesh_drawn_at_once_makes_clusters_where_they_may_pay(least):
    mesh, camera = tl.Mesh(*tl.scenes.icosphere(5)), tl.Camera.look_at((0, 0, 4))
    with choices.forced(cluster_shaded=least):
        first, second = (tl.render(mesh, camera, SIZE, threads=1) for _ in range(2))
    assert mesh.has_clusters == (least == 0)
    assert np.array_equal(first, second)


def test_equal_numbers_of_other_types_are_other_colors():
    mesh, camera = tl.Mesh(*BALL), tl.Camera.look_at((0.3, 1, 2))
    with pytest.warns(UserWarning, match="nearly black"):
        dark = tl.render(mesh, camera, SIZE, shading="unlit", color=(1, 0, 0))[33, 35]
    red = tl.render(mesh, camera, SIZE, shading="unlit", color=(1.0, 0, 0))[33, 35]
    assert dark.tolist() == [1, 0, 0, 255]
    assert red.tolist() == [255, 0, 0, 255]
    with pytest.raises(TypeError, match="threads must be an integer"):
        _ = [tl.render(mesh, camera, SIZE, threads=n) for n in (1, 1.0)]


def test_list_of_lights_that_changes_changes_the_picture():
    mesh, camera = tl.Mesh(*BALL), tl.Camera.look_at((0, 0, 4))
    lights = [tl.Light((0, 0, 1))]
    before = tl.render(mesh, camera, SIZE, lights=lights)
    lights[0] = tl.Light((0, 0, -1))
    assert before[33, 35, 0] > tl.render(mesh, camera, SIZE, lights=lights)[33, 35, 0]


def test_mesh_dies_with_what_its_pictures_keep():
    mesh = tl.Mesh(*BALL)
    tl.render(mesh, tl.Camera.look_at((0, 0, 4)), SIZE, threads=1)
    gone = weakref.ref(mesh)
    del mesh
    assert gone() is None


def test_options_that_are_kept_hold_for_cameras_with_and_without_a_lens():
    sides = [tl.Material((200, 0, 0)), tl.Material((0, 0, 200), double_sided=False)]
    rows = np.arange(len(BALL[1]), dtype=np.int32) % 2
    straight = tl.Camera.look_at((0.3, 0.1, 0.2), (5, 1, 0.3), near=0.01)  # the lens cuts triangles about the eye
    cameras = replace(straight, lens=tl.FisheyeLens()), straight

    kept = tl.Mesh(*BALL, materials=sides, material_of_triangle=rows)
    for camera in (*cameras, *cameras):
        fresh = tl.Mesh(*BALL, materials=sides, material_of_triangle=rows)
        assert np.array_equal(tl.render(kept, camera, SIZE), tl.render(fresh, camera, SIZE))
