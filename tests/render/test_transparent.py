"""Transparent meshes and scenes: the layers of all instances, shaded and composited."""

import tracemalloc

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on
from scene_cases import CAMERA, CUBE, SIZE, SPHERE, joined, many, told_apart

import topleft as tl
from topleft._meshes.picture import placed, transparent


@ON_EACH_ISA
@pytest.mark.parametrize(
    "options", [{}, {"depth_test": "greater"}, {"cull": "back"}, {"origin": (11, 5), "viewport": SIZE}]
)
def test_layers_of_a_scene_are_those_of_the_mesh_of_all(isa, options):
    scene = many(2)
    with on(isa):
        expected = tl.peel(*joined(scene), SIZE, layers=5, **options)
        assert expected.count.max() >= 4
        for threads in (1, 3):
            got = tl.visible_layers(scene, CAMERA, SIZE, layers=5, threads=threads, **options)
            assert_same(got.id, expected.triangle)
            assert_same(got.depth, expected.depth)
            assert_same(got.count, expected.count)
            instance, triangle = told_apart(scene, expected.triangle)
            assert_same(got.instance, instance)
            assert_same(got.triangle, triangle)
            assert_same(got.layer(2).barycentric(), expected.layer(2).barycentric())


@pytest.mark.parametrize("n_vertices", [1, 100])
def test_layers_of_a_scene_of_a_few_instances_at_a_time_are_the_same(monkeypatch, n_vertices):
    scene = many(3)
    expected = tl.visible_layers(scene, CAMERA, SIZE, layers=5)
    monkeypatch.setattr(placed, "VERTICES_AT_ONCE", n_vertices)
    got = tl.visible_layers(scene, CAMERA, SIZE, layers=5)
    assert_same(got.id, expected.id)
    assert_same(got.depth, expected.depth)


def test_layers_of_a_scene_take_the_memory_of_a_few_instances(monkeypatch):
    monkeypatch.setattr(placed, "VERTICES_AT_ONCE", 1)
    sphere = tl.Mesh(*tl.scenes.icosphere(5))

    def peak(n):
        scene = tl.Scene([tl.Instance(sphere)] * n)
        tl.visible_layers(scene, CAMERA, (8, 6), threads=1)
        tracemalloc.start()
        tl.visible_layers(scene, CAMERA, (8, 6), threads=1)
        peaked = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peaked

    assert peak(40) < 2 * peak(4)


def test_layers_of_a_scene_are_composited_by_triangle_and_pixel():
    scene = many(3)
    got, expected = tl.visible_layers(scene, CAMERA, SIZE), tl.peel(*joined(scene), SIZE)
    rng = np.random.default_rng(1)
    for shape in ((scene.n_triangles,), (*SIZE[::-1], 4)):
        colors = rng.integers(0, 256, (*shape, 4), np.uint8)
        assert_same(tl.composite(got, colors), tl.composite(expected, colors))
    with pytest.raises(ValueError, match=r"colors must have rows of shape .*\(70, 90, 4\) for pixels, got \(3,\)"):
        tl.composite(got, np.zeros((3, 4)), per="auto")
    with pytest.raises(ValueError, match="colors must have rows of shape"):
        tl.composite(got, np.zeros((3, 4)), per="vertex")
    assert repr(got) == f"SceneDepthLayers(90x70, 4 layers, {scene.n_triangles} triangles)"


@pytest.mark.parametrize("bits", [0, "exact"])
def test_transparent_picture_has_the_grid_that_is_asked_for(bits):
    layers = tl.visible_layers(CUBE, CAMERA, SIZE, layers=8, subpixel_bits=bits)
    pictures = [tl.shade(layers.layer(k), CUBE, CAMERA, background=transparent.CLEAR)[..., :3] for k in range(8)]
    expected = tl.composite(layers, np.stack(pictures, axis=2), opacity=0.5, background=(255, 255, 255, 255))
    got = tl.render_transparent(CUBE, CAMERA, SIZE, subpixel_bits=bits)
    assert_same(got, expected)
    assert (got != tl.render_transparent(CUBE, CAMERA, SIZE)).any() or bits == "exact"


def test_transparent_picture_is_over_of_shaded_layers():
    camera = tl.Camera.look_at((3, 2, 4))
    got = tl.render_transparent(CUBE, camera, SIZE, opacity=0.25, shading="flat", background=(10, 20, 30))
    front = tl.render(CUBE, camera, SIZE, shading="flat", cull="back")
    layers = tl.visible_layers(CUBE, camera, SIZE, cull="front", layers=1)
    behind = tl.shade(layers.layer(0), CUBE, camera, shading="flat")
    seen = layers.layer(0).mask & tl.silhouette(CUBE, camera, SIZE, cull="back")
    alpha = 64 / 255
    ground = np.array([10, 20, 30.0])
    expected = alpha * front[seen][:, :3] + (1 - alpha) * (alpha * behind[seen][:, :3] + (1 - alpha) * ground)
    assert seen.sum() > 300
    assert np.abs(got[seen][:, :3] - expected).max() <= 0.5 + 1e-9
    assert (got[..., 3] == 255).all()


def test_transparent_opaque_picture_is_that_of_render():
    for subject in (SPHERE, many(4)):
        assert_same(tl.render_transparent(subject, CAMERA, SIZE, opacity=1, layers=2), tl.render(subject, CAMERA, SIZE))
    assert_same(tl.render_transparent(CUBE, size=SIZE, opacity=1), tl.render(CUBE, size=SIZE))


def test_transparent_bad_options_are_refused():
    with pytest.raises(ValueError, match="opacity must lie in 0 to 1, got 2"):
        tl.render_transparent(CUBE, size=(4, 4), opacity=2)
    for subject in (CUBE, many()):
        with pytest.raises(ValueError, match="layers must lie in 1 to 16, got 99"):
            tl.visible_layers(subject, CAMERA, (4, 4), layers=99)
        with pytest.raises(ValueError, match="sampling 'msaa4' gives no sorted layers"):
            tl.visible_layers(subject, CAMERA, (4, 4), sampling="msaa4")
