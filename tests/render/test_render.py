"""Rendering: what is seen has the right colour, and no picture depends on which way a face is turned."""

import numpy as np
import pytest

from topleft import scenes
from topleft._core.base.color import id_colors
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.picture.edges import EDGE_COLOR, depth_behind
from topleft._meshes.picture.render import rasterize_mesh, render
from topleft._meshes.picture.shade import GREY_OF_FARTHEST, GREY_OF_NEAREST

SIZE = (64, 48)
MODES = ["smooth", "flat", "ids", "depth", "normals"]
SPHERE = Mesh(*scenes.shape("sphere"))
CUBE = Mesh(*scenes.shape("cube"))
CLEAR = (0, 0, 0, 0)


def square(z=0.0, **attributes):
    corners = [[-1, -1, z], [1, -1, z], [1, 1, z], [-1, 1, z]]
    return Mesh(corners, [[0, 1, 2], [0, 2, 3]], **attributes)


def facing(ortho_height=None):
    return Camera.look_at((0, 0, 5), ortho_height=ortho_height)


@pytest.mark.parametrize("shading", MODES)
def test_render_alpha_is_where_the_mesh_is(shading):
    picture = render(CUBE, size=SIZE, shading=shading, background=CLEAR)
    assert picture.shape == (48, 64, 4)
    assert picture.dtype == np.uint8
    mask = rasterize_mesh(CUBE, size=SIZE).mask
    assert mask.any()
    assert np.array_equal(picture[..., 3] == 255, mask)
    assert (picture[~mask] == 0).all()


def test_render_background_is_white_unless_given():
    assert render(CUBE, size=SIZE)[0, 0].tolist() == [255, 255, 255, 255]
    assert render(CUBE, size=SIZE, background=(1, 2, 3))[0, 0].tolist() == [1, 2, 3, 255]


@pytest.mark.parametrize("shading", ["smooth", "flat", "depth", "normals"])
@pytest.mark.parametrize("ortho_height", [None, 3])
def test_render_inverted_faces_look_the_same(shading, ortho_height):
    turned = Mesh(SPHERE.vertices, SPHERE.triangles[:, ::-1])
    camera = Camera.look_at((1, 2, 3), ortho_height=ortho_height)
    difference = np.subtract(
        render(turned, camera, SIZE, shading=shading), render(SPHERE, camera, SIZE, shading=shading), dtype=int
    )
    assert np.abs(difference).max() <= 1  # corners are visited in another order


def test_render_normals_of_the_file_may_point_inward():
    inward = Mesh(SPHERE.vertices, SPHERE.triangles, -SPHERE.vertices)
    outward = Mesh(SPHERE.vertices, SPHERE.triangles, SPHERE.vertices)
    assert np.array_equal(render(inward, size=SIZE), render(outward, size=SIZE))


def test_render_light_comes_from_the_upper_left():
    picture = render(SPHERE, Camera.look_at((0, 0, 4)), (65, 65)).astype(int)
    assert picture[16, 24, 0] > picture[48, 40, 0]
    assert picture[16, 32, 0] > picture[48, 32, 0]
    assert picture[32, 16, 0] > picture[32, 48, 0]


def test_render_facing_surface_in_full_light_has_its_colour():
    toward = np.tile([-0.35, 0.45, 1.0], (4, 1))
    picture = render(square(normals=toward), facing(2), (8, 8), color=(200, 100, 50))
    assert picture[4, 4].tolist() == [200, 100, 50, 255]


def test_render_ids_have_a_colour_each():
    picture = render(square(), facing(2), (8, 8), shading="ids")
    expected = id_colors(np.arange(2))
    assert picture[7, 7, :3].tolist() == expected[0].tolist()
    assert picture[0, 0, :3].tolist() == expected[1].tolist()


def test_id_colors_of_many_ids_differ():
    colors = id_colors(np.arange(5000))
    assert len(np.unique(colors, axis=0)) > 4900
    assert np.abs(np.diff(colors.astype(int), axis=0)).max(axis=1).min() > 20


@pytest.mark.parametrize("ortho_height", [None, 4])
def test_distance_of_inverts_the_depth(ortho_height):
    camera = Camera.look_at((0, 0, 5), ortho_height=ortho_height, near=1, far=20)
    for z in (3.0, 0.0, -10.0):
        depth = rasterize_mesh(square(z), camera, (5, 5)).depth[2:3, 2]
        assert camera.distance_of(depth) == pytest.approx([5 - z], rel=1e-4)  # float32 depth


def test_render_depth_is_brighter_the_nearer():
    vertices = np.concatenate([square(1.0).vertices * [0.3, 0.3, 1], square(-1.0).vertices])
    steps = Mesh(vertices, np.concatenate([square().triangles, square().triangles + 4]))
    picture = render(steps, facing(2.5), (50, 50), shading="depth")
    assert picture[25, 25, 0] == GREY_OF_NEAREST
    assert picture[8, 8, 0] == GREY_OF_FARTHEST


def test_render_depth_of_one_distance_is_the_nearest_grey():
    assert render(square(), facing(2), (8, 8), shading="depth")[4, 4, 0] == GREY_OF_NEAREST


def test_render_normal_toward_the_viewer_is_light_blue():
    assert render(square(), facing(2), (8, 8), shading="normals")[4, 4].tolist() == [128, 128, 255, 255]


def test_render_normals_are_in_eye_space():
    picture = render(CUBE, Camera.look_at((5, 0, 0)), (9, 9), shading="normals")
    assert picture[4, 4, :3].tolist() == [128, 128, 255]


def test_render_vertex_without_normal_takes_that_of_the_face():
    picture = render(square(normals=np.zeros((4, 3))), facing(2), (8, 8), shading="normals")
    assert picture[4, 4].tolist() == [128, 128, 255, 255]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"shading": "toon"}, "shading must be one of 'smooth', .*'matcap', 'ids', 'depth', 'normals', got 'toon'"),
        ({"background": (1, 2, 256)}, r"background must be 4 numbers of 0 to 255, got \(1, 2, 256\)"),
        ({"cull": "side"}, "cull must be one of 'none', 'back', 'front', got 'side'"),
    ],
)
def test_render_unknown_option_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        render(CUBE, size=SIZE, **options)


def test_render_nothing_to_frame_is_refused():
    with pytest.raises(ValueError, match="nothing to frame: the mesh has no triangles"):
        render(Mesh(np.empty((0, 3)), []))


def test_render_nothing_with_a_camera_is_the_background():
    assert (render(Mesh(np.empty((0, 3)), []), facing(), SIZE) == 255).all()


# Edges


def test_edges_are_dark_lines_over_the_picture():
    plain = render(square(), facing(2.5), (80, 80), background=CLEAR)
    picture = render(square(), facing(2.5), (80, 80), background=CLEAR, edges=True)
    assert picture[39, 40].tolist() == [*EDGE_COLOR, 255]  # the diagonal runs through the centre
    assert picture[40, 7].tolist() == [*EDGE_COLOR, 128]  # the side x = 8: half a pixel is outside
    assert abs(picture[40, 8] - (0.5 * plain[40, 8] + 0.5 * np.array([*EDGE_COLOR, 255]))).max() <= 1
    assert np.array_equal(picture[60:70, 60:70], plain[60:70, 60:70])
    assert (picture[..., 3] >= plain[..., 3]).all()


def test_edges_behind_the_surface_are_hidden():
    front, back = square(z=0.5), square(z=-0.5)
    both = Mesh(np.vstack([front.vertices, 0.5 * back.vertices]), np.vstack([front.triangles, back.triangles + 4]))
    pictures = [render(mesh, facing(2.5), (80, 80), edges=True) for mesh in (both, front)]
    assert np.array_equal(*pictures)


def test_edges_of_a_closed_shape_show_only_in_front():
    ball = Mesh(*scenes.shape("icosphere"))
    pictures = [render(ball, size=(200, 150), edges=True, cull=cull) for cull in ("none", "back")]
    differ = (pictures[0] != pictures[1]).any(-1)
    assert differ.sum() < 0.01 * rasterize_mesh(ball, size=(200, 150)).mask.sum()  # at the silhouette, within a pixel


def test_depth_behind_falls_with_the_surface_and_not_over_its_border():
    depth = np.array([[1, 2, 4, np.inf], [1, 2, 4, 9]], np.float32)
    assert depth_behind(depth).tolist() == [[2, 3, 6, np.inf], [2, 3, 6, 14]]
