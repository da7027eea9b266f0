"""Attributes of a visibility buffer: derivatives, distances, textures."""

import numpy as np
import pytest

import topleft as tl
from topleft._core.base.texels import halve

SIZE = (40, 30)
MESH = tl.Mesh(*tl.scenes.shape("torus-knot"))
CAMERA = tl.Camera.framing(MESH, aspect=SIZE[0] / SIZE[1])
LENS = tl.Camera.from_intrinsics(
    [[40, 0, 19.5], [0, 40, 14.5], [0, 0, 1]], np.diag([1, -1, -1, 1]) @ CAMERA.view, SIZE, near=0.1, far=100,
    distortion=(-0.2, 0.05, 0, 0),
)  # fmt: skip
ASIDE = np.array([[0.5, 0, 0, 1], [0, 0.7, 0.1, 0], [0, 0, 0.6, 0], [0, 0, 0, 1.0]])
SCENE = tl.Scene([MESH, (MESH, ASIDE)])


def expected_slopes(frags, mesh, camera, values, place=None):
    """Derivatives (H, W, K, 2) by central differences of the exact planes, float64."""
    matrix = camera.clip_from_world(SIZE) @ (np.eye(4) if place is None else place)
    clip = mesh.vertices @ matrix[:, :3].T + matrix[:, 3]
    (width, height), step = SIZE, 1e-4
    homogeneous = np.stack(
        [(clip[:, 3] + clip[:, 0]) * width / 2, (clip[:, 3] - clip[:, 1]) * height / 2, clip[:, 3]], 1
    )
    out = np.zeros((*frags.id.shape, values.shape[1], 2))
    for row, column in np.argwhere(frags.triangle >= 0):
        corners = mesh.triangles[frags.triangle[row, column]]

        def at(x, y, corners=corners):
            weights = np.linalg.solve(homogeneous[corners].T, [x, y, 1])
            return weights / weights.sum() @ values[corners]

        x, y = column + 0.5, row + 0.5
        out[row, column, :, 0] = (at(x + step, y) - at(x - step, y)) / (2 * step)
        out[row, column, :, 1] = (at(x, y + step) - at(x, y - step)) / (2 * step)
    return out


def test_derivatives_are_those_of_the_planes():
    values = np.random.default_rng(0).normal(size=(len(MESH.vertices), 3))
    frags = tl.rasterize_mesh(MESH, CAMERA, SIZE)
    found, slopes = frags.interpolate(values, derivatives=True)
    assert np.array_equal(found, frags.interpolate(values))
    assert (slopes.shape, slopes.dtype) == ((30, 40, 3, 2), np.float32)
    # The weights are those of the snapped triangle, up to 1/512 pixel aside: small triangles feel it.
    np.testing.assert_allclose(slopes, expected_slopes(frags, MESH, CAMERA, values), rtol=0.05, atol=0.05)
    assert not slopes[~frags.mask].any()


def test_derivatives_of_pixels_are_constant():
    frags = tl.rasterize([[0, 0], [8, 0], [0, 8]], [[0, 1, 2]], (4, 4))
    found, slopes = frags.interpolate([0.0, 8.0, 16.0], derivatives=True)
    assert slopes[frags.mask].tolist() == [[1, 2]] * int(frags.mask.sum())
    assert found.shape == slopes.shape[:2]
    _, of_corners = frags.interpolate([[[0.0], [8.0], [16.0]]], derivatives=True)
    assert np.array_equal(of_corners[..., 0, :], slopes)


def test_derivatives_of_a_scene_are_those_of_its_instances():
    values = np.asarray(MESH.vertices, np.float64)
    frags = tl.rasterize_mesh(SCENE, CAMERA, SIZE)
    _, slopes = frags.interpolate([values, values], derivatives=True)
    for i, place in enumerate((None, ASIDE)):
        seen = frags.instance == i
        expected = expected_slopes(frags, MESH, CAMERA, values, place)
        np.testing.assert_allclose(slopes[seen], expected[seen], rtol=0.05, atol=0.05)


def test_derivatives_through_a_lens_are_differences_of_neighbours():
    plane = tl.Mesh([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], [[0, 1, 2], [0, 2, 3]])
    frags = tl.rasterize_mesh(plane, LENS, SIZE)
    found, slopes = frags.interpolate(plane.vertices, derivatives=True)
    inner = slice(1, -1)
    steps = (found[inner, 2:, :2] - found[inner, :-2, :2]) / 2
    np.testing.assert_allclose(slopes[inner, inner, :2, 0], steps, rtol=0.05, atol=0.02)


def test_derivatives_of_each_sample_are_its_own():
    frags = tl.rasterize_mesh(MESH, CAMERA, SIZE, sampling="msaa2")
    assert frags.sample(1).interpolate(MESH.vertices, derivatives=True)[1].any()


def test_derivatives_of_layers_are_refused():
    layers = tl.peel(MESH.vertices, MESH.triangles, SIZE, transform=CAMERA.clip_from_world(SIZE))
    with pytest.raises(ValueError, match="derivatives are those of rasterize and rasterize_mesh"):
        layers.layer(0).interpolate(MESH.vertices, derivatives=True)


@pytest.mark.parametrize("subject", [MESH, SCENE], ids=["mesh", "scene"])
@pytest.mark.parametrize("camera", [CAMERA, LENS], ids=["straight", "lens"])
def test_distance_is_the_layer(subject, camera):
    found = tl.rasterize_mesh(subject, camera, SIZE).distance(camera)
    expected = tl.render_layers(subject, camera, SIZE, layers="distance")["distance"]
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, expected, rtol=1e-6)  # float32 at the corners, and once more


@pytest.mark.parametrize("vertices", [[[0, 0], [4, 0], [0, 4]], [[0, 0, 0, 1], [4, 0, 0, 1], [0, 4, 0, 1]]])
def test_distance_without_the_world_is_refused(vertices):
    with pytest.raises(ValueError, match=r"distance needs vertices \(V, 3\) in the world"):
        tl.rasterize(vertices, [[0, 1, 2]], (4, 4)).distance(CAMERA)


def square(scale=1.0, size=(8, 8)):
    """A square that is all of the picture, with uv from 0 to `scale`."""
    width, height = size
    corners = [[0, 0], [width, 0], [width, height], [0, height]]
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]]) * scale
    return tl.rasterize(corners, [[0, 1, 2], [0, 2, 3]], size), uv


@pytest.mark.parametrize("n_channels", [1, 2, 5])
@pytest.mark.parametrize("how", ["nearest", "bilinear", "trilinear"])
def test_texture_of_the_size_of_the_picture_is_the_picture(how, n_channels):
    texture = np.random.default_rng(1).normal(size=(8, 8, n_channels)).astype(np.float32)
    frags, uv = square()
    np.testing.assert_allclose(frags.sample(texture, uv, filter=how), texture, atol=2e-6)  # weights are float32
    np.testing.assert_allclose(frags.sample(texture[..., 0], uv, filter=how), texture[..., 0], atol=2e-6)


@pytest.mark.parametrize(("width", "height"), [(16, 16), (15, 16), (17, 32)])
def test_texture_of_smaller_texels_is_its_halving(width, height):
    texture = np.random.default_rng(2).normal(size=(height, width, 3)).astype(np.float32)
    frags, uv = square()
    found = frags.sample(texture, uv, wrap="clamp")
    level = texture
    lod = np.log2(max(width, height) / 8)
    for _ in range(int(lod)):
        level = halve(level)
    if level.shape[:2] == (8, 8) and lod == int(lod):
        np.testing.assert_allclose(found, level, atol=2e-6)
    else:  # between two levels: never outside of the texels
        assert texture.min() <= found.min() <= found.max() <= texture.max()


def test_halve_keeps_the_mean():
    texture = np.random.default_rng(3).normal(size=(7, 5, 2)).astype(np.float32)
    assert halve(texture).shape == (3, 2, 2)
    np.testing.assert_allclose(halve(texture).mean(axis=(0, 1)), texture.mean(axis=(0, 1)), atol=1e-6)


@pytest.mark.parametrize(("wrap", "row"), [("repeat", [0, 1, 0, 1]), ("clamp", [0, 1, 1, 1]), ("mirror", [0, 1, 1, 0])])
def test_texture_beyond_its_sides(wrap, row):
    frags, uv = square(2.0, (4, 4))
    found = frags.sample([[0.0, 1.0]], uv, filter="nearest", wrap=(wrap, "clamp"))
    assert found[0].tolist() == row


def test_texture_in_srgb_is_light():
    frags, uv = square()
    assert frags.sample(np.full((1, 1, 4), 188, np.uint8), uv)[0, 0] == pytest.approx([188 / 255] * 4)
    light = ((188 / 255 + 0.055) / 1.055) ** 2.4
    found = frags.sample(np.full((1, 1, 4), 188, np.uint8), uv, encoding="srgb")
    assert found[0, 0] == pytest.approx([light] * 3 + [188 / 255], rel=1e-6)


@pytest.mark.parametrize("how", ["nearest", "bilinear", "trilinear"])
def test_texture_is_that_of_render(how):
    image = np.random.default_rng(4).integers(0, 256, (32, 16, 3), np.uint8)
    texture = tl.Texture(image, filter=how, wrap="mirror")
    uv = np.random.default_rng(5).uniform(-1, 2, (len(MESH.vertices), 2))
    mesh = tl.Mesh(MESH.vertices, MESH.triangles, uv=uv, materials=[tl.Material(texture=texture)])
    frags = tl.rasterize_mesh(mesh, CAMERA, SIZE)
    light = frags.sample(texture, uv)[..., :3]
    picture = tl.render(mesh, CAMERA, SIZE, shading="unlit")[..., :3][frags.mask]
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)[frags.mask]
    off = np.abs(255 * encoded - picture).max(axis=1)
    # The kernel takes derivatives of snapped triangles and texels in 65535ths: rarely another texel, seldom more.
    assert np.mean(off > 2) < 0.02


def test_texture_of_a_scene_takes_uv_of_each_instance():
    uv = np.random.default_rng(6).uniform(0, 1, (len(MESH.vertices), 2))
    found = tl.rasterize_mesh(SCENE, CAMERA, SIZE).sample(np.eye(4), [uv, uv], background=-1)
    assert found.shape == (30, 40)
    assert np.unique(found).size > 9


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((np.zeros((2, 2, 2, 2)), [[0, 0]] * 3), {}, r"texture must have shape \(H, W\) or \(H, W, C\)"),
        ((np.zeros((0, 2)), [[0, 0]] * 3), {}, "texture must have shape"),
        ((np.array([["a"]]), [[0, 0]] * 3), {}, "texture must be a Texture or real numbers"),
        ((np.eye(2), [0, 0, 0]), {}, r"uv must have two columns, \(V, 2\) or \(T, 3, 2\), got one"),
        ((np.eye(2), [[0, 0]] * 3), {"filter": "cubic"}, "filter must be"),
        ((np.eye(2), [[0, 0]] * 3), {"wrap": ("clamp",) * 3}, "wrap must be one word, or two"),
        ((np.eye(2), [[0, 0]] * 3), {"encoding": "xyz"}, "encoding must be one of 'srgb', 'linear'"),
        ((np.eye(2),), {}, "sample takes the number of a sample, or a texture and uv, got ndarray"),
    ],
)
def test_texture_that_does_not_fit_is_refused(arguments, options, message):
    frags = tl.rasterize([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 4))
    with pytest.raises((TypeError, ValueError), match=message):
        frags.sample(*arguments, **options)
