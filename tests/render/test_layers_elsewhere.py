"""Layers through a lens, in memory that is kept, of other libraries' meshes, and of glass."""

from dataclasses import replace

import numpy as np
import pytest
from comparing import assert_same
from layer_views import CAMERAS, CUBE, FLOAT32, FRONT, LENSES, SIZE, SNAP_PX, SPHERE, look, pierced, pixels, scene

import topleft as tl
from topleft._core.base.options import LAYER_NAMES
from topleft._meshes.camera.camera import Camera

# Lenses


ON_EACH_LENS = pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)


@ON_EACH_LENS
def test_points_through_a_lens_project_to_their_pixels(lens):
    camera = replace(CAMERAS["off-centre"], lens=lens)
    found = look(camera, "world_position", "distance", "ray_distance", "silhouette", subject=SPHERE)
    seen = found["silhouette"]
    assert seen.sum() > 500
    points = found["world_position"][seen].astype(float)
    off_centre = camera.project(points, SIZE)[:, :2] - np.stack(pixels(seen), -1)
    assert np.abs(off_centre).max() <= lens.tolerance_px + SNAP_PX + 1e-4  # 1e-4: float32 of a point
    eye = points @ camera.view[:3, :3].T + camera.view[:3, 3]
    assert np.abs(found["distance"][seen] + eye[:, 2]).max() <= 8 * FLOAT32  # coordinates are below 8
    assert np.abs(found["ray_distance"][seen] - np.linalg.norm(eye, axis=1)).max() <= 16 * FLOAT32


@ON_EACH_LENS
def test_flow_through_a_lens_is_the_difference_of_projections(lens):
    begin, end = (replace(CAMERAS[name], lens=lens) for name in ("off-centre", "perspective"))
    moved = np.eye(4)
    moved[:3, 3] = 0.1, 0.2, -0.1
    found = look(begin, "flow", "world_position", subject=SPHERE, camera_to=end, transforms_to=moved)
    seen = np.isfinite(found["flow"][..., 0])
    points = found["world_position"][seen].astype(float)
    expected = (end.project(points + moved[:3, 3], SIZE) - begin.project(points, SIZE))[:, :2]
    assert np.abs(expected).max() > 1
    assert np.abs(found["flow"][seen] - expected).max() <= 1e-4  # float32 of points, some 30 pixels a unit
    still = look(begin, "flow", subject=SPHERE, camera_to=begin)["flow"]
    assert (still[seen] == 0).all()


def test_flow_through_a_lens_to_behind_it_is_nan():
    lens = LENSES["barrel"]
    begin, end = Camera.look_at((0, 0, 5)), Camera.look_at((0, 0, -5), (0, 0, -9))
    found = look(replace(begin, lens=lens), "flow", "silhouette", subject=CUBE, camera_to=replace(end, lens=lens))
    assert found["silhouette"].any()
    assert np.isnan(found["flow"]).all()


def test_layers_through_a_lens_that_bends_nothing_are_those_without():
    names = ("camera_normal", "world_normal", "triangle", "silhouette")
    straight = CAMERAS["perspective"]
    a, b = (look(camera, *names, subject=CUBE) for camera in (straight, replace(straight, lens=tl.OpenCVLens())))
    same = a["triangle"] == b["triangle"]
    assert same.mean() > 0.995  # vertices between the corners are snapped, too
    for name in ("camera_normal", "world_normal"):
        assert np.abs(a[name] - b[name])[same].max() <= 1e-3  # normals where the snap moved the corners


def test_glass_through_a_lens_is_refused():
    camera = replace(CAMERAS["perspective"], lens=LENSES["barrel"])
    for subject in (scene(), CUBE):
        with pytest.raises(ValueError, match="layers are not peeled through a lens, but camera has one"):
            tl.render_transparent(subject, camera, SIZE)


# Memory that is kept, meshes of others, glass


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_layers_in_kept_memory_are_those_without(sampling):
    names = [name for name in LAYER_NAMES if name not in ("uv", "flow")]
    alone = look(CAMERAS["perspective"], *names, subject=SPHERE, sampling=sampling)
    kept = tl.Rasterizer(SIZE)
    for order in (names, names[::-1]):
        found = look(CAMERAS["perspective"], *order, subject=SPHERE, sampling=sampling, rasterizer=kept)
        assert list(found) == order
        for name in names:
            assert np.array_equal(found[name], alone[name], equal_nan=name != "color")
    assert np.shares_memory(found["depth"], kept.rasterize(np.zeros((3, 3)), [[0, 1, 2]]).depth)


def test_color_with_an_opacity_is_that_of_glass():
    found = look(CAMERAS["perspective"], "color", "depth", opacity=0.3, shading="flat")
    expected = tl.render_transparent(scene(), CAMERAS["perspective"], SIZE, opacity=0.3, shading="flat")
    assert_same(found["color"], expected)


# Cut-outs


@pytest.mark.parametrize("lens", [None, LENSES["barrel"]])
def test_layers_show_what_is_behind_a_hole(lens):
    found = look(replace(FRONT, lens=lens), "triangle", "distance", subject=pierced())
    assert found["triangle"][30, 40] in (2, 3)
    assert found["distance"][30, 40] == pytest.approx(6, abs=1e-5)  # float32 of an interpolated point
    assert found["triangle"][30, 29] in (0, 1)
    assert found["distance"][30, 29] == pytest.approx(5, abs=1e-5)


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_alpha_of_a_hole_is_that_of_the_picture(sampling):
    mesh = pierced()
    alone = tl.Mesh(mesh.vertices[:4], mesh.triangles[:2], uv=mesh.uv[:4], materials=mesh.materials[:1])
    options = {"sampling": sampling, "background": (0, 0, 0, 0)}
    found = look(FRONT, "color", "alpha", "silhouette", subject=alone, **options)
    assert found["alpha"][30, 40] == 0
    assert_same(found["alpha"], found["color"][..., 3])
    assert found["silhouette"].dtype == (np.bool_ if sampling == "center" else np.float32)
