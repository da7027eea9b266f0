"""Layers of a view, each against a formula of its own in float64: rays and planes, projections, weighted sums."""

import numpy as np
import pytest
from comparing import assert_same
from layer_views import CAMERAS, CUBE, FLOAT32, ON_EACH_CAMERA, SIZE, SNAP_PX, SPHERE, look, pixels, scene

import topleft as tl
from topleft._core.base.options import LAYER_NAMES
from topleft._meshes.camera.camera import Camera
from topleft._meshes.picture.layers import MeshLayers
from topleft._meshes.picture.shot import Shot
from topleft._meshes.picture.view_layers import render_layers


def corners_world(subject, found):
    """The corners (P, 3, 3) of the triangle that each visible pixel shows, in the world."""
    corners = []
    for i, t in zip(found["instance"].ravel(), found["triangle"].ravel(), strict=True):
        if i >= 0:
            instance = subject[i]
            points = instance.mesh.vertices[instance.mesh.triangles[t]].astype(float)
            corners.append(points @ instance.transform[:3, :3].T + instance.transform[:3, 3])
    return np.array(corners)


def plane_distance_along_view(camera, corners, x_px, y_px):
    """How far along the view the ray through (x_px, y_px) meets the plane of each triangle."""
    width, height = SIZE
    ndc = np.stack([2 * x_px / width - 1, 1 - 2 * y_px / height], -1)
    world_from_clip = np.linalg.inv(camera.clip_from_world(SIZE))
    ends = []
    for z in (-1.0, 1.0):
        clip = np.column_stack([ndc, np.full(len(ndc), z), np.ones(len(ndc))]) @ world_from_clip.T
        ends.append(clip[:, :3] / clip[:, 3:])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = np.einsum("ij,ij->i", normal, corners[:, 0] - ends[0]) / np.einsum("ij,ij->i", normal, ends[1] - ends[0])
    point = ends[0] + along[:, None] * (ends[1] - ends[0])
    return -(point @ camera.view[:3, :3].T + camera.view[:3, 3])[:, 2]


def screen(camera, points):
    clip = np.column_stack([points, np.ones(len(points))]) @ camera.clip_from_world(SIZE).T
    xy = clip[:, :2] / clip[:, 3:]
    return np.stack([(xy[:, 0] + 1) * SIZE[0] / 2, (1 - xy[:, 1]) * SIZE[1] / 2], -1)


@ON_EACH_CAMERA
def test_world_position_lies_on_its_triangle_and_in_its_pixel(camera):
    subject = scene()
    found = look(camera, "world_position", "instance", "triangle")
    seen = found["instance"] >= 0
    assert np.unique(found["instance"]).tolist() == [-1, 0, 1, 2]
    points, corners = found["world_position"][seen].astype(float), corners_world(subject, found)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    off_plane = np.einsum("ij,ij->i", points - corners[:, 0], normal)
    assert np.abs(off_plane).max() <= 4 * FLOAT32  # coordinates are below 4
    off_centre = screen(camera, points) - np.stack(pixels(seen), -1)
    assert np.abs(off_centre).max() <= SNAP_PX + 1e-4  # 1e-4: float32 of a point, some 30 pixels a unit, at a slant
    assert np.isnan(found["world_position"][~seen]).all()


@ON_EACH_CAMERA
def test_distance_is_where_the_ray_meets_the_plane(camera):
    found = look(camera, "distance", "instance", "triangle")
    seen = found["instance"] >= 0
    corners = corners_world(scene(), found)
    x, y = pixels(seen)
    off = [(-SNAP_PX, -SNAP_PX), (SNAP_PX, -SNAP_PX), (-SNAP_PX, SNAP_PX), (SNAP_PX, SNAP_PX)]
    around = [plane_distance_along_view(camera, corners, x + dx, y + dy) for dx, dy in off]
    got = found["distance"][seen]
    assert (got >= np.min(around, 0) * (1 - 2 * FLOAT32)).all()
    assert (got <= np.max(around, 0) * (1 + 2 * FLOAT32)).all()
    assert (found["distance"][~seen] == np.inf).all()


@ON_EACH_CAMERA
def test_ray_distance_is_that_of_the_point(camera):
    found = look(camera, "ray_distance", "distance", "world_position")
    seen = np.isfinite(found["distance"])
    eye = found["world_position"][seen].astype(float) @ camera.view[:3, :3].T + camera.view[:3, 3]
    expected = -eye[:, 2] if camera is CAMERAS["orthographic"] else np.linalg.norm(eye, axis=1)
    assert np.abs(found["ray_distance"][seen] - expected).max() <= 16 * FLOAT32  # distances are below 8
    assert (found["ray_distance"][~seen] == np.inf).all()


@ON_EACH_CAMERA
def test_normals_are_the_weighted_sums_of_those_of_the_vertices(camera):
    subject = scene()
    found = look(camera, "world_normal", "camera_normal", "barycentric", "instance", "triangle")
    for i, instance in enumerate(subject):
        seen = found["instance"] == i
        at_corners = instance.mesh.vertex_normals()[instance.mesh.triangles[found["triangle"][seen]]]
        summed = np.einsum("ij,ijk->ik", found["barycentric"][seen].astype(float), at_corners)
        world = summed @ np.linalg.inv(instance.transform[:3, :3])
        world /= np.linalg.norm(world, axis=1)[:, None]
        # interpolated as float32 after the transform, which scales lengths: some 2**-23 of components up to 1
        close = {"rtol": 0, "atol": 2e-6}
        if i != 0:  # rigid: the sum of unit normals is the same before and after
            assert np.allclose(found["world_normal"][seen], world, **close)
            assert np.allclose(found["camera_normal"][seen], world @ camera.view[:3, :3].T, **close)
        lengths = np.linalg.norm(found["world_normal"][seen].astype(float), axis=1)
        assert np.abs(lengths - 1).max() < 1e-6
    assert (found["world_normal"][found["instance"] < 0] == 0).all()


def test_normals_of_a_stretched_plane_are_its_own():
    tilted = tl.Mesh([[-1, 0, 1], [1, 0, 1], [1, 0.5, -1], [-1, 0.5, -1]], [[0, 1, 2], [0, 2, 3]])
    matrix = np.diag([1.0, 3.0, 0.5, 1])
    found = look(Camera.look_at((0, 6, 0.1)), "world_normal", "silhouette", subject=tl.Scene([(tilted, matrix)]))
    expected = np.array([0, 1.0, 1.5])  # falls 1.5 over 1 in z
    assert found["silhouette"].sum() > 100
    assert np.abs(found["world_normal"][found["silhouette"]] - expected / np.linalg.norm(expected)).max() <= 2 * FLOAT32


@ON_EACH_CAMERA
def test_flow_is_the_difference_of_projections(camera):
    subject, end = scene(), Camera.look_at((2.5, 2.5, 4), (0.1, 0, 0), near=0.5, far=50)
    rng = np.random.default_rng(3)
    transforms = np.stack([i.transform for i in subject])
    transforms[:, :3, 3] += rng.uniform(-0.2, 0.2, (3, 3))
    found = look(camera, "flow", "instance", "triangle", "barycentric", camera_to=end, transforms_to=transforms)
    for i, instance in enumerate(subject):
        seen = found["instance"] == i
        corners = instance.mesh.vertices[instance.mesh.triangles[found["triangle"][seen]]].astype(float)
        weights = found["barycentric"][seen].astype(float)
        point = np.einsum("ij,ijk->ik", weights / weights.sum(1, keepdims=True), corners)
        here, there = (point @ m[:3, :3].T + m[:3, 3] for m in (instance.transform, transforms[i]))
        expected = screen(end, there) - screen(camera, here)
        assert np.abs(expected).max() > 1
        assert np.abs(found["flow"][seen] - expected).max() <= 1e-4  # float32 of weights and of pixels up to 80
    assert np.isnan(found["flow"][found["instance"] < 0]).all()


def test_flow_of_what_does_not_move_is_zero_to_the_bit():
    camera, subject = CAMERAS["perspective"], scene()
    same = look(camera, "flow", camera_to=camera)["flow"]
    also = look(camera, "flow", transforms_to=[i.transform for i in subject])["flow"]
    seen = np.isfinite(same[..., 0])
    assert seen.any()
    assert (same[seen] == 0).all()
    assert (also[seen] == 0).all()


def test_flow_of_a_mesh_under_two_cameras_and_behind_one():
    behind = Camera.look_at((0, 0, 0.2), (0, 0, 5), near=0.01, far=50)  # inside the cube, looks away from its front
    flow = look(Camera.look_at((0, 0, 5)), "flow", subject=CUBE, camera_to=behind)["flow"]
    assert np.isfinite(flow).any()
    shifted = np.eye(4)
    shifted[0, 3] = 0.25
    ortho = Camera.look_at((0, 0, 5), ortho_height=3)
    flow = look(ortho, "flow", subject=CUBE, transforms_to=shifted)["flow"]
    seen = np.isfinite(flow[..., 0])
    assert np.abs(flow[seen] - [0.25 * 60 / 3, 0]).max() <= 1e-6
    away = np.eye(4)
    away[2, 3] = 20
    assert np.isnan(look(Camera.look_at((0, 0, 5)), "flow", subject=CUBE, transforms_to=away)["flow"]).all()


@pytest.mark.parametrize("layer", ["distance", "ray_distance", "world_position", "flow"])
def test_points_of_instances_that_alternate_along_a_row_are_those_of_each_by_itself(layer):
    """Ten meshes of two dtypes in each span of a row; each alone, where the scene shows it, gives the same bits."""
    rng, camera, size = np.random.default_rng(3), CAMERAS["perspective"], (90, 40)
    instances = []
    for k in range(10):
        vertices, triangles = tl.scenes.icosphere(k % 3)
        place = np.eye(4)
        place[:3, 3] = rng.uniform(-0.6, 0.6, 3)
        mesh = tl.Mesh((0.3 * vertices).astype(np.float32 if k % 2 else np.float64), triangles)
        instances.append(tl.Instance(mesh, place))
    options = {"layers": (layer, "instance"), "camera_to": CAMERAS["off-centre"]}
    found = render_layers(tl.Scene(instances), camera, size, **options, threads=1)
    assert len(np.unique(found["instance"])) > 8
    for k, one in enumerate(instances):
        is_own = found["instance"] == k
        alone = render_layers(tl.Scene([one]), camera, size, **options)
        assert_same(found[layer][is_own], alone[layer][is_own])
    shared = render_layers(tl.Scene(instances), camera, size, **options, threads=3)
    assert_same(np.nan_to_num(shared[layer]), np.nan_to_num(found[layer]))


def test_ids_depth_and_masks_are_those_of_the_visibility_buffer():
    camera = CAMERAS["perspective"]
    found = look(camera, "triangle", "instance", "barycentric", "depth", "silhouette", "alpha")
    frags = tl.rasterize_mesh(scene(), camera, SIZE)
    assert_same(found["triangle"], frags.triangle)
    assert_same(found["instance"], frags.instance)
    assert_same(found["barycentric"], frags.barycentric())
    assert_same(found["depth"], frags.depth)
    assert_same(found["silhouette"], frags.mask)
    assert_same(found["alpha"], frags.mask.astype(np.uint8) * np.uint8(255))
    assert list(found) == ["triangle", "instance", "barycentric", "depth", "silhouette", "alpha"]


def test_color_is_the_picture_of_render():
    options = {"shading": "flat", "background": (0, 0, 0, 0), "sampling": "msaa4", "cull": "back"}
    found = look(CAMERAS["perspective"], "color", "alpha", "silhouette", **options)
    assert_same(found["color"], tl.render(scene(), CAMERAS["perspective"], SIZE, **options))
    assert_same(found["alpha"], np.rint(found["color"][..., 3]).astype(np.uint8))
    assert_same(
        found["silhouette"], tl.silhouette(scene(), CAMERAS["perspective"], SIZE, sampling="msaa4", cull="back")
    )


def test_uv_and_attributes_are_interpolated():
    rng = np.random.default_rng(2)
    mesh = tl.Mesh(CUBE.vertices, CUBE.triangles)
    object.__setattr__(mesh, "uv", rng.random((24, 2), np.float32))
    camera, per_corner = CAMERAS["perspective"], rng.random((12, 3, 4))
    found = look(camera, "uv", subject=mesh, attributes={"heat": np.arange(24.0), "wide": per_corner})
    frags = tl.rasterize_mesh(mesh, camera, SIZE)
    assert list(found) == ["uv", "heat", "wide"]
    for name, values in (("uv", mesh.uv), ("heat", np.arange(24.0)), ("wide", per_corner)):
        assert_same(np.nan_to_num(found[name], nan=9), frags.interpolate(values, background=9))
        assert np.isnan(found[name][~frags.mask]).all()
    both = tl.Scene([mesh, (SPHERE, np.diag([0.5, 2, 0.5, 1]))])
    values = [np.zeros(24), np.ones(len(SPHERE.vertices))]
    found = look(camera, "uv", "instance", subject=both, attributes={"kind": values})
    assert_same(np.isfinite(found["uv"][..., 0]), found["instance"] == 0)
    assert_same(np.nan_to_num(found["kind"], nan=-1), found["instance"].astype(np.float32))


def test_only_what_is_asked_for_is_computed():
    layers = MeshLayers(Shot.of_meshes(CUBE, CAMERAS["perspective"], SIZE))
    assert "frags" not in vars(layers)
    layers.draw(("color", "alpha", "silhouette", "depth", "triangle", "instance", "barycentric"))
    assert "parts" not in vars(layers)
    layers.draw(("camera_normal", "world_normal"))
    assert "points" not in vars(layers.parts[0])


@pytest.mark.parametrize("size", [(0, 3), (3, 0)])
def test_empty_picture_has_its_shapes(size):
    camera, names = CAMERAS["perspective"], [name for name in LAYER_NAMES if name != "uv"]
    for subject in (CUBE, scene()):
        found = [*render_layers(subject, camera, size, layers=names, camera_to=camera).values()]
        found += [draw(subject, camera, size) for draw in (tl.render, tl.render_transparent, tl.silhouette)]
        found.append(tl.rasterize_mesh(subject, camera, size).instance)
        assert {one.shape[:2] for one in found} == {size[::-1]}


def test_layers_are_a_mapping_with_a_short_repr():
    found = render_layers(CUBE, size=(4, 3), layers="alpha")
    assert (len(found), list(found), repr(found)) == (1, ["alpha"], "ViewLayers(alpha (3, 4) uint8)")
    assert list(render_layers(CUBE, size=(4, 3))) == ["color", "depth"]


# ---- errors ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("layers", "options", "message"),
    [
        ("colour", {}, r"layers must be some of color, alpha, .* flow, got 'colour'"),
        ("flow", {}, "layer 'flow' needs camera_to or transforms_to"),
        ("uv", {}, "layer 'uv' needs a mesh that has texture coordinates"),
        ("depth", {"attributes": {"depth": np.zeros(8)}}, "attributes must not have the name of a layer, got 'depth'"),
        ("flow", {"transforms_to": np.zeros((3, 4, 4))}, r"transforms_to must have shape \(1, 4, 4\), got \(3, 4, 4\)"),
        ("flow", {"transforms_to": np.full((4, 4), np.inf)}, "transforms_to must hold finite numbers"),
        ("flow", {"transforms_to": np.ones((4, 4))}, r"the last row of each of transforms_to must be \[0, 0, 0, 1\]"),
    ],
)
def test_layers_that_cannot_be_drawn_are_refused(layers, options, message):
    with pytest.raises(ValueError, match=message):
        render_layers(CUBE, size=(4, 3), layers=layers, **options)


def test_unknown_option_is_refused():
    with pytest.raises(TypeError, match="there is no option 'colour' of a picture"):
        render_layers(CUBE, colour=1)
    with pytest.raises(TypeError, match="option 'shading' is for layer 'color', which is not among depth"):
        render_layers(CUBE, layers="depth", shading="flat", sampling="center")
