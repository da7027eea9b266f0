"""The level that a view gets: outlines never move by more than the tolerance, or it is the mesh itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from outlines import SIZE, check_outlines

import topleft as tl
from topleft._apps.cli import main
from topleft._meshes.camera.matrices import orbit_view

BLOB = tl.Mesh(*tl.scenes.shape("blob", n_triangles=6000))
KNOT = tl.Mesh(*tl.scenes.shape("torus-knot", segments=128, sections=16))


@settings(deadline=None, max_examples=8)
@given(
    mesh=st.sampled_from([BLOB, KNOT]),
    azimuth=st.floats(0, 360),
    elevation=st.floats(-90, 90),
    distance=st.floats(1.6, 40),
    fov=st.floats(5, 120),
    aside=st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)),
    tolerance=st.sampled_from([0.25, 0.5, 1.0, 3.0, 8.0]),
)
def test_silhouette_never_moves_by_more_than_the_tolerance(mesh, azimuth, elevation, distance, fov, aside, tolerance):
    view = orbit_view((*aside, 0), distance, azimuth, elevation)
    check_outlines(mesh, tl.Camera.perspective(view, near=0.01, far=1000, fov_y_deg=fov), tolerance)


@settings(deadline=None, max_examples=5)
@given(
    azimuth=st.floats(0, 360),
    height=st.floats(0.5, 40),
    stretch=st.floats(0.2, 5),
    tolerance=st.sampled_from([0.5, 1.0, 3.0]),
)
def test_silhouette_orthographic_and_stretched_never_moves_by_more(azimuth, height, stretch, tolerance):
    view = orbit_view((0, 0, 0), 5.0, azimuth, 20)
    camera = tl.Camera.off_center(view, left=-height * stretch, right=height * stretch, bottom=-height, top=height,
                                  near=0.1, far=100, ortho=True)  # fmt: skip
    check_outlines(KNOT, camera, tolerance)


def test_silhouette_at_the_edge_of_a_wide_frame_is_bounded():
    levels = [
        check_outlines(BLOB, tl.Camera.perspective(orbit_view((x, 0, 0), 8.0, 0, 0), near=0.1, far=100,
                                                   fov_y_deg=130), 0.25)
        for x in (0, 6, 12, 16)
    ]  # fmt: skip
    assert levels[0] > 0


def test_farther_views_have_coarser_levels():
    levels = [
        tl.choose_detail(BLOB, tl.Camera.look_at((0, 0, d)), SIZE, tolerance=0.5).level for d in (1.8, 20, 100, 500)
    ]
    assert levels == sorted(levels)
    assert levels[0] < levels[-1] == len(tl.simplify(BLOB)) - 1


def test_choose_detail_takes_the_coarsest_that_is_within():
    camera = tl.Camera.look_at((0, 0, 20))
    levels = tl.simplify(BLOB)
    found = tl.choose_detail(BLOB, camera, SIZE, tolerance=0.12)
    coarser = levels[found.level + 1]
    assert tl.choose_detail(BLOB, camera, SIZE, tolerance=found.bound_px).level == found.level
    assert f"level {found.level + 1}, {len(coarser.mesh.triangles):,} triangles: may be off by" in found.rejected[0]
    assert found.bound == levels[found.level].bound


def test_choose_detail_orthographic_bound_is_that_of_the_scale():
    camera = tl.Camera.look_at((0, 0, 20), ortho_height=16)
    found = tl.choose_detail(BLOB, camera, (64, 64), tolerance=0.5)
    # 64 px for 16 units; the rest is a billionth for rounding.
    assert found.bound_px == pytest.approx(found.bound * 4, rel=1e-8)


def test_choose_detail_bound_does_not_depend_on_the_window():
    camera = tl.Camera.look_at((0, 0, 6))
    whole = tl.choose_detail(BLOB, camera, SIZE, tolerance=0.5)
    window = tl.choose_detail(BLOB, camera, (16, 16), tolerance=0.5, viewport=SIZE, origin=(40, 8))
    assert (window.level, window.bound_px) == (whole.level, whole.bound_px)


def test_rasterize_mesh_window_is_the_crop_of_the_whole():
    camera = tl.Camera.look_at((0, 0, 6))
    whole = tl.rasterize_mesh(BLOB, camera, SIZE, tolerance=0.5)
    window = tl.rasterize_mesh(BLOB, camera, (16, 24), tolerance=0.5, viewport=SIZE, origin=(40, 8))
    assert np.array_equal(window.triangle, whole.triangle[8:32, 40:56])


FAR = tl.Camera.look_at((0, 0, 50))


@pytest.mark.parametrize(
    ("camera", "options", "why"),
    [
        (FAR, {"tolerance": 0}, "tolerance=0: the picture of the mesh itself"),
        (FAR, {"tolerance": 1, "cull": "back"}, "cull='back': which way a triangle is turned has no bound"),
        (tl.Camera.look_at((0, 0, 0.5)), {"tolerance": 9}, "no coarser level is sure to be within 9 px"),
        (tl.Camera.look_at((0, 0, 50), near=49.5, far=99), {"tolerance": 9}, "no coarser level is sure"),
        (tl.Camera.look_at((0, 0, 50), near=1, far=50), {"tolerance": 9}, "no coarser level is sure"),
    ],
)
def test_choose_detail_is_the_mesh_itself_where_nothing_is_sure(camera, options, why):
    found = tl.choose_detail(BLOB, camera, SIZE, **options)
    assert (found.level, found.bound_px) == (0, 0.0)
    assert found.mesh is BLOB
    assert why in found.why


def test_choose_detail_through_a_lens_is_the_mesh_itself():
    lens = tl.Camera.from_intrinsics([[50, 0, 48], [0, 50, 32], [0, 0, 1]], np.diag([1, -1, -1, 1]), SIZE, near=1,
                                     far=99, distortion=[0.1, 0, 0, 0])  # fmt: skip
    assert "the bend of the lens" in tl.choose_detail(BLOB, lens, SIZE, tolerance=1).why


def test_choose_detail_with_cut_outs_is_the_mesh_itself():
    hole = tl.Texture(np.full((2, 2, 4), 100, np.uint8))
    mesh = tl.Mesh(BLOB.vertices, BLOB.triangles, uv=BLOB.vertices[:, :2], materials=[
        tl.Material(texture=hole, alpha_cutoff=0.5)])  # fmt: skip
    assert "a material cuts holes" in tl.choose_detail(mesh, FAR, SIZE, tolerance=1).why


def test_choose_detail_empty_mesh_is_itself():
    empty = tl.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert tl.choose_detail(empty, FAR, SIZE, tolerance=1).why == "it has no triangles"


@pytest.mark.parametrize("tolerance", [-0.5, np.nan, np.inf])
def test_tolerance_that_is_none_is_refused(tolerance):
    with pytest.raises(ValueError, match=r"tolerance must be at least 0 pixels, got"):
        tl.render(BLOB, size=SIZE, tolerance=tolerance)


def test_tolerance_zero_is_the_mesh_to_the_bit():
    assert np.array_equal(tl.render(BLOB, FAR, SIZE), tl.render(BLOB, FAR, SIZE, tolerance=0))


@pytest.mark.parametrize("verb", [tl.render, tl.silhouette, tl.render_transparent])
def test_verbs_draw_the_level(verb):
    level = tl.choose_detail(BLOB, FAR, SIZE, tolerance=0.5)
    assert level.level > 0
    assert np.array_equal(verb(BLOB, FAR, SIZE, tolerance=0.5), verb(level.mesh, FAR, SIZE))


def test_render_layers_draws_the_level():
    level = tl.choose_detail(BLOB, FAR, SIZE, tolerance=0.5).mesh
    found = tl.render_layers(BLOB, FAR, SIZE, layers=("color", "triangle"), tolerance=0.5)
    assert np.array_equal(found["triangle"], tl.rasterize_mesh(level, FAR, SIZE).triangle)
    assert np.array_equal(found["color"], tl.render(level, FAR, SIZE))


def test_render_layers_attributes_and_tolerance_are_refused():
    with pytest.raises(ValueError, match=r"attributes are those of the mesh's own vertices"):
        tl.render_layers(BLOB, FAR, SIZE, layers=("depth",), attributes={"x": BLOB.vertices}, tolerance=0.5)


def test_scene_instances_have_a_level_each():
    far, large = np.eye(4), np.diag([40.0, 40, 40, 1])
    far[:3, 3], large[:3, 3] = [-3, 0, -200], [30, 0, -100]
    scene = tl.Scene([BLOB, (BLOB, far), (BLOB, large)])
    camera = tl.Camera.look_at((0, 0, 4), far=1000)
    meshes = [tl.choose_detail(BLOB, camera, SIZE, tolerance=0.5, transform=one.transform).mesh for one in scene]
    assert len(meshes[1].triangles) < len(meshes[0].triangles)
    assert len(meshes[2].triangles) > len(meshes[1].triangles)
    same = tl.Scene([(mesh, one.transform) for mesh, one in zip(meshes, scene, strict=True)])
    assert np.array_equal(tl.render(scene, camera, SIZE, tolerance=0.5), tl.render(same, camera, SIZE))


def test_batch_picks_a_level_for_each_view():
    cameras = [tl.Camera.look_at((0, 0, d)) for d in (3, 30, 300)]
    jobs = [tl.Job(BLOB, camera, SIZE, {"tolerance": 0.5}) for camera in cameras]
    pictures = [result.picture for result in tl.render_batch(jobs, executor=2)]
    details = [tl.choose_detail(BLOB, camera, SIZE, tolerance=0.5) for camera in cameras]
    assert len({detail.level for detail in details}) > 1
    for picture, detail, camera in zip(pictures, details, cameras, strict=True):
        assert np.array_equal(picture, tl.render(detail.mesh, camera, SIZE))


def test_scene_in_levels_makes_few_instances(monkeypatch):
    ball, places = tl.Mesh(*tl.scenes.icosphere(3)), np.tile(np.eye(4), (300, 1, 1))
    places[:, :3, 3] = np.indices((20, 15, 1)).reshape(3, -1).T * 3
    scene = tl.Scene([(ball, place) for place in places])
    camera = tl.Camera.framing(scene)
    made = []
    monkeypatch.setattr(tl.Scene, "_made", lambda self, i, make=tl.Scene._made: made.append(i) or make(self, i))
    frags = tl.rasterize_mesh(scene, camera, SIZE, tolerance=0.5)
    assert len(np.unique(frags.instance)) > 200
    assert len(made) < 30  # some are surveyed


def test_plan_of_a_mesh_tells_its_level():
    found = tl.plan(BLOB, FAR, SIZE, tolerance=0.5)
    level = tl.choose_detail(BLOB, FAR, SIZE, tolerance=0.5)
    stage = found.stages[0]
    assert stage.name == "detail"
    assert stage.choice == (
        f"level {level.level}: {len(level.mesh.triangles):,} triangles of {len(BLOB.triangles):,}, "
        f"within {level.bound_px:.3g} px"
    )
    assert found.n_triangles == len(level.mesh.triangles)
    assert "not: the mesh itself" in found.explain()


def test_plan_of_a_mesh_without_tolerance_is_of_the_mesh():
    found = tl.plan(BLOB, FAR, SIZE)
    assert found.stages[0].choice == f"the mesh itself, {len(BLOB.triangles):,} triangles"


def test_plan_tolerance_of_arrays_is_refused():
    with pytest.raises(ValueError, match=r"tolerance needs a mesh and a camera"):
        tl.plan(BLOB.vertices, BLOB.triangles, SIZE, tolerance=0.5)


def test_plan_transform_of_a_camera_is_refused():
    with pytest.raises(ValueError, match=r"transform is that of the camera: give either"):
        tl.plan(BLOB, FAR, SIZE, transform=np.eye(4))


def test_cli_renders_and_explains_with_a_tolerance(tmp_path, capsys):
    assert main(["render", "torus", "--size", "48x32", "--tolerance", "1", "-o", str(tmp_path / "a.png")]) == 0
    assert main(["explain", "torus", "--size", "48x32", "--tolerance", "1"]) == 0
    assert "detail      level 2: " in capsys.readouterr().out


def test_cli_tolerance_that_is_none_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["render", "torus", "--tolerance", "-1", "-o", str(tmp_path / "a.png")])
    assert "must be a number of pixels, 0 or more, got '-1'" in capsys.readouterr().err


def test_cli_job_file_takes_a_tolerance(tmp_path):
    (tmp_path / "jobs.toml").write_text(
        f'size = [48, 32]\n[[job]]\nmesh = "torus"\ntolerance = 1\nout = "{tmp_path}/a.png"\n'
    )
    assert main(["render", "--jobs-file", str(tmp_path / "jobs.toml")]) == 0
    assert (tmp_path / "a.png").is_file()
