"""The shading kernels against float64 NumPy, and the same bits on every instruction set, thread count and window."""

import gc
import weakref
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import shading_reference as reference
from comparing import assert_same
from engine_cases import assert_same_everywhere

import topleft as tl
from topleft._core.base.color import srgb_tables
from topleft._meshes.picture.render import shade

SIZE = (150, 110)
RNG = np.random.default_rng(6)
NOISE = np.kron(RNG.integers(0, 256, (24, 40, 3)), np.ones((4, 4, 1))).astype(np.uint8)
LIGHTS = (
    tl.Light((1, 2, 3), color=(255, 240, 200)),
    tl.Light((-2, 1, 0.5), kind="point", color=(120, 160, 255), intensity=1.5, falloff=0.3),
    tl.Light(
        (0.5, 1, 3), "spot", (255, 120, 90), 2.0, falloff=0.1, direction=(-0.2, -0.3, -1), inner_deg=8, outer_deg=24
    ),
)


def textured(name, n_repeats=3):
    """A shape with a texture laid on along z, and colours."""
    mesh = tl.Mesh(*tl.scenes.shape(name))
    uv = n_repeats * (mesh.vertices[:, :2] @ [[0.9, -0.2], [0.3, 0.8]]) + 0.3 * mesh.vertices[:, 2:]
    return tl.Mesh(mesh.vertices, mesh.triangles, uv=uv)


KNOT = textured("torus-knot")
COLORED = replace(KNOT, colors=RNG.integers(0, 256, (len(KNOT.vertices), 3)).astype(np.uint8))
CAMERAS = {
    "perspective": tl.Camera.framing(KNOT, aspect=150 / 110),
    "ortho": tl.Camera.framing(KNOT, aspect=150 / 110, ortho=True),
}
ON_EACH_CAMERA = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)


def check(mesh, camera, material=None, *, is_flat=False, **options):
    """The picture is that of the reference, rounded: at most one level off, and only next to the middle of two."""
    material = material or tl.Material(color=(224, 222, 217))
    frags = tl.rasterize_mesh(mesh, camera, SIZE)
    got = shade(frags, mesh, camera, shading="flat" if is_flat else "smooth", material=material, **options)
    expected = reference.picture(frags, mesh, camera, SIZE, material, is_flat=is_flat, **options)
    seen = frags.mask
    assert seen.sum() > 2000
    assert np.abs(got[seen, :3] - expected[seen]).max() < SLACK


SLACK = 0.5 + 0.1
"""Levels: half a level of rounding, and a tenth: 2**-17 of light is 0.03 levels in the dark, texels are 0.03 more,
and float32 in weights, normals and coordinates makes up the rest."""


@ON_EACH_CAMERA
@pytest.mark.parametrize("is_flat", [False, True])
def test_shade_headlight_is_that_of_the_reference(camera, is_flat):
    check(KNOT, camera, is_flat=is_flat)


@pytest.mark.parametrize("intensity", [0.3, 1.0, 8.0, 61.0, 70.0])
@pytest.mark.parametrize("color", [(0, 3, 250), (255, 1, 90), (12, 20, 40)])
def test_shade_one_color_in_white_light_is_that_of_the_reference(color, intensity):
    lights = tl.Light((1, 2, 3), intensity=intensity), tl.Light((-1, 0, 1), intensity=0.5)
    check(KNOT, CAMERAS["perspective"], tl.Material(color=color), lights=lights, ambient=0.01)


@ON_EACH_CAMERA
@pytest.mark.parametrize("specular", [0.0, 0.6])
@pytest.mark.parametrize("shininess", [3.0, 80.0])
def test_shade_lights_are_those_of_the_reference(camera, specular, shininess):
    material = tl.Material(color=(90, 200, 130), specular=specular, shininess=shininess, back_color=(200, 40, 40))
    check(KNOT, camera, material, lights=LIGHTS, ambient=0.05, fog=tl.Fog(2, 9, color=(20, 30, 60)))


@ON_EACH_CAMERA
def test_shade_vertex_colors_are_those_of_the_reference(camera):
    check(COLORED, camera, tl.Material())
    check(replace(COLORED, color_interpolation="linear"), camera, tl.Material())


@ON_EACH_CAMERA
@pytest.mark.parametrize("kind", ["bilinear", "trilinear"])
@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror", ("mirror", "repeat")])
def test_shade_textures_are_those_of_the_reference(camera, kind, wrap):
    texture = tl.Texture(NOISE, filter=kind, wrap=wrap)
    check(KNOT, camera, tl.Material(texture=texture), lights=LIGHTS[:1])


@pytest.mark.parametrize("size", [(1, 1), (3, 5), (31, 17), (64, 1)])
def test_shade_textures_of_odd_sizes_are_those_of_the_reference(size):
    texture = tl.Texture(RNG.integers(0, 256, (*size, 3)).astype(np.uint8))
    check(textured("sphere", 5), CAMERAS["perspective"], tl.Material(texture=texture))


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
def test_shade_nearest_texel_is_that_of_the_reference(wrap):
    material = tl.Material(texture=tl.Texture(NOISE, filter="nearest", wrap=wrap), unlit=True)
    camera = CAMERAS["perspective"]
    frags = tl.rasterize_mesh(KNOT, camera, SIZE)
    got = shade(frags, KNOT, camera, material=material)
    w = reference.Weights(frags, KNOT, camera, SIZE)
    expected = reference.encode(reference.sample(material.texture, w.of(KNOT.uv), None))[:, :3]
    # A coordinate that float32 rounds over the border between two texels: a few in ten thousand.
    assert (np.abs(got[frags.mask, :3] - expected) > 0.51).any(axis=1).mean() < 1e-3


KINDS = ("pixelated", "nearest", "trilinear")


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
@pytest.mark.parametrize("n_repeats", [0.2, 9])
def test_shade_pixelated_texture_is_nearest_where_texels_are_large_and_trilinear_elsewhere(n_repeats, wrap):
    """Each pixel is that of one or the other to the bit; the rim of a sphere is always far in its halvings."""
    mesh = textured("sphere", n_repeats)
    found, nearest, trilinear = (
        tl.render(mesh, size=SIZE, material=tl.Material(texture=tl.Texture(NOISE, kind, wrap), unlit=True))
        for kind in KINDS
    )
    is_nearest, is_trilinear = (found == nearest).all(axis=-1), (found == trilinear).all(axis=-1)
    assert (is_nearest | is_trilinear).all()
    assert is_trilinear.all() == (n_repeats == 9)
    if n_repeats < 1:
        assert (is_nearest & ~is_trilinear).sum() > 1000
        assert (is_trilinear & ~is_nearest).sum() > 1000


@pytest.mark.parametrize("n_repeats", [0.2, 9])
def test_samples_of_a_pixelated_texture_are_nearest_where_texels_are_large(n_repeats):
    mesh = tl.Mesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    uv = n_repeats * mesh.vertices[:, :2]
    frags = tl.rasterize_mesh(mesh, tl.Camera.look_at((0, 0, 3)), SIZE)
    found, nearest, trilinear = (frags.sample(tl.Texture(NOISE, kind), uv) for kind in KINDS)
    assert np.array_equal(found, nearest if n_repeats < 1 else trilinear)
    assert not np.array_equal(nearest, trilinear)


def test_shade_seam_shows_no_line():
    # u runs from 0.8 over 1 to 1.2 on one side and continues at 0.2 on the other: the same picture as without a seam.
    square = [[-1, -1, 0], [0, -1, 0], [0, 1, 0], [-1, 1, 0], [0, -1, 0], [1, -1, 0], [1, 1, 0], [0, 1, 0]]
    uv = np.array([[0.8, 0], [1.2, 0], [1.2, 1], [0.8, 1], [0.2, 0], [0.6, 0], [0.6, 1], [0.2, 1]])
    triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    material = tl.Material(texture=tl.Texture(NOISE), unlit=True)
    camera = tl.Camera.look_at((0.3, 0.2, 3))
    seamed, whole = (
        tl.render(tl.Mesh(square, triangles, uv=own), camera, SIZE, material=material).astype(int)
        for own in (uv, np.where(np.arange(8)[:, None] < 4, uv, uv + [1, 0]))
    )
    assert np.abs(seamed - whole).max() <= 1  # u - floor(u) of float32


def test_shade_material_of_each_triangle():
    colors = [tl.Material(color=(k, 255 - k, 9), unlit=True) for k in range(5)]
    rows = RNG.integers(0, 5, len(KNOT.triangles))
    mesh = replace(KNOT, materials=colors, material_of_triangle=rows)
    frags = tl.rasterize_mesh(mesh, CAMERAS["ortho"], SIZE)
    got = shade(frags, mesh, CAMERAS["ortho"])[frags.mask]
    assert_same(got[:, 0], rows[frags.triangle[frags.mask]].astype(np.uint8))


def test_fog_of_numbers_of_few_bits_is_that_of_floats():
    def picture(fog):
        knot = tl.Mesh(KNOT.vertices, KNOT.triangles)  # its own: equal looks are kept with a mesh
        return tl.render(knot, tl.Camera.framing(knot), SIZE, fog=fog)

    assert np.array_equal(picture(tl.Fog(np.int8(-100), np.int8(100))), picture(tl.Fog(-100.0, 100.0)))


def test_shade_triangles_across_the_near_plane_and_huge_ones_keep_their_attributes():
    # A floor from behind the eye to far away: one triangle is cut, and is larger than int32 edge functions allow.
    floor = tl.Mesh([[-50, 0, 9], [50, 0, 9], [0, 0, -200]], [[0, 1, 2]], uv=[[-50, 9], [50, 9], [0, -200]])
    camera = tl.Camera.look_at((0, 1, 5), (0, 0.2, 0), near=0.1, far=1000)
    frags = tl.rasterize_mesh(floor, camera, SIZE)
    rows, cols = np.nonzero(frags.mask)
    white = tl.Material((255, 255, 255), unlit=True)
    got = tl.render(floor, camera, SIZE, fog=tl.Fog(0, 40, color=(0, 0, 0)), material=white)
    rays = np.linalg.inv(camera.clip_from_world(SIZE))
    ndc = np.c_[2 * (cols + 0.5) / SIZE[0] - 1, 1 - 2 * (rows + 0.5) / SIZE[1]]
    near, far = (np.c_[ndc, np.full(len(ndc), z), np.ones(len(ndc))] @ rays.T for z in (-1, 1))
    near, far = near[:, :3] / near[:, 3:], far[:, :3] / far[:, 3:]
    points = near + (far - near) * (near[:, 1] / (near[:, 1] - far[:, 1]))[:, None]
    distance = -(points @ camera.view[2, :3] + camera.view[2, 3])
    expected = reference.encode(1 - np.clip(distance / 40, 0, 1))
    # Where the floor ends at the horizon a row is a pixel of the snap away from the next: leave the last ones out.
    is_near = distance < 39
    assert is_near.sum() > 4000
    assert np.abs(got[rows, cols, 0] - expected)[is_near].max() <= 1


def test_shade_small_triangles_look_alike_beside_huge_ones_in_their_rows():
    ball = tl.Mesh(*tl.scenes.icosphere(3))
    floor = np.array([[-50, -1, 9], [50, -1, 9], [0, -1, -200]])  # of float64 edge functions
    both = tl.Mesh(
        np.concatenate([ball.vertices, floor]), np.concatenate([ball.triangles, [np.arange(3) + len(ball.vertices)]])
    )
    camera = tl.Camera.look_at((0, 0.5, 4), (0, 0, 0), near=0.1, far=1000)
    frags = tl.rasterize_mesh(both, camera, (300, 200))
    is_ball = frags.mask & (frags.triangle < len(ball.triangles))
    assert (is_ball & ((frags.triangle == len(ball.triangles)).any(axis=1))[:, None]).sum() > 4000
    for shading in ("smooth", "normals"):
        alone, beside = (tl.render(mesh, camera, (300, 200), shading=shading) for mesh in (ball, both))
        assert np.array_equal(alone[is_ball], beside[is_ball])


def test_shade_normals_that_cancel_leave_that_of_the_face():
    normals = [[0, 0, 1], [0, 0, -1], [0, 0, 0]]
    mesh = tl.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], normals=normals)
    camera = tl.Camera.look_at((0, 0, 3))
    flat, smooth = (tl.render(mesh, camera, (33, 33), shading=shading) for shading in ("flat", "normals"))
    assert flat[16, 16].tolist() == tl.render(mesh, camera, (33, 33), shading="flat")[20, 16].tolist()
    assert smooth[32 - 8, 16].tolist() == [128, 128, 255, 255]  # in the middle between the two


@pytest.mark.parametrize("back_color", [None, (0, 0, 0)], ids=["grey", "channels"])
def test_encode_gives_the_nearest_value_of_each_step_of_light(back_color):
    # A triangle a step: unlit, of vertex colours through a matcap would round; so by intensity of a light.
    steps = np.linspace(0, 1, 401)
    quad = tl.Mesh([[-9, -9, 0], [9, -9, 0], [0, 9, 0]], [[0, 1, 2]])
    camera = tl.Camera.look_at((0, 0, 1))
    white = tl.Material(color=(255, 255, 255), back_color=back_color)  # two colours: each channel by itself
    frags = tl.rasterize_mesh(quad, camera, (1, 1))
    got = [int(shade(frags, quad, camera, material=white, lights=[], ambient=float(a))[0, 0, 0]) for a in steps]
    table = srgb_tables()[1]
    assert got == table[np.rint(steps.astype(np.float32) * 65536).astype(int)].tolist()


def test_matcap_shows_what_it_has_for_the_normal():
    ramp = np.zeros((64, 64, 3), np.uint8)
    ramp[..., 0] = np.arange(64) * 4
    sphere = tl.Mesh(*tl.scenes.shape("sphere"))
    camera = tl.Camera.look_at((0, 0, 4), ortho_height=2.2)
    red = tl.render(sphere, camera, (65, 65), shading="matcap", matcap=tl.Texture(ramp))[32, :, 0].astype(int)
    inside = red[4:-4]
    assert (np.diff(inside) >= 0).all()
    assert inside[0] < 40
    assert inside[-1] > 200


# ---- the same bits ------------------------------------------------------------------------------------------


def everything(size, sampling, threads=None, **view):
    """Pictures with all that the kernels do."""
    material = tl.Material(texture=tl.Texture(NOISE), specular=0.5, shininess=30, back_color=(9, 99, 199))
    options = {"lights": LIGHTS, "material": material, "fog": tl.Fog(3, 9), "threads": threads}
    near = tl.Camera.look_at((0.2, 0.1, 1.0), near=0.5, far=9)
    for camera, bits in product((*CAMERAS.values(), near), (8, "exact")):
        frags = tl.rasterize_mesh(COLORED, camera, size, sampling=sampling, subpixel_bits=bits, **view)
        for shading in ("smooth", "flat", "normals", "unlit"):
            yield shade(frags, COLORED, camera, shading=shading, **options)


@pytest.mark.usefixtures("shared_rows")
@pytest.mark.parametrize("sampling", ["center", "msaa4", "msaa8"])
def test_shade_has_the_same_bits_everywhere(sampling):
    windows = [((37, 21), (83, 64))]
    assert_same_everywhere(lambda size, **view: everything(size, sampling, **view), SIZE, windows, (1, 3))


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("changes", [{}, {"crease": 6}], ids=["smooth", "creased"])
def test_shade_windows_of_fewer_pixels_than_vertices_are_crops(changes, dtype, sampling):
    """The whole has 1/w of all vertices, the windows of those that show."""
    mesh = replace(COLORED, vertices=COLORED.vertices.astype(dtype), **changes)
    size, camera = (200, 160), CAMERAS["perspective"]
    material = tl.Material(texture=tl.Texture(NOISE), specular=0.5, shininess=30)
    assert 100 * 90 < len(mesh.vertices) <= 200 * 160
    assert (mesh.corner_normals() is None) == (not changes)

    def pictures(size, origin=(0, 0)):
        frags = tl.rasterize_mesh(mesh, camera, size, origin=origin, viewport=(200, 160), sampling=sampling)
        for shading in ("smooth", "flat", "unlit"):
            yield shade(frags, mesh, camera, shading=shading, lights=LIGHTS, material=material, fog=tl.Fog(3, 9))

    for part, picture in zip(pictures((100, 90), (50, 40)), pictures(size), strict=True):
        assert_same(part, picture[40:130, 50:150])


@pytest.mark.parametrize("crease", [180, 6])
def test_a_mesh_whose_rows_are_asked_for_ahead_looks_like_a_small_one(crease):
    """500,000 triangles that do not show behind those that do, in a shuffled order."""
    small = tl.Mesh(COLORED.vertices, COLORED.triangles, COLORED.vertex_normals(), COLORED.colors, uv=COLORED.uv)
    nothing = np.zeros((500_000, 3), np.int32)  # triangles without area
    order = RNG.permutation(len(small.triangles) + len(nothing))
    large = replace(small, triangles=np.concatenate([small.triangles, nothing])[order])
    if crease < 180:
        small, large = (replace(mesh, normals=None, crease=crease) for mesh in (small, large))
    material = tl.Material(texture=tl.Texture(NOISE), specular=0.5, shininess=30)
    for size in ((120, 90), (200, 160)):  # with 1/w of the vertices that show, and of all
        one, other = (tl.rasterize_mesh(mesh, CAMERAS["perspective"], size) for mesh in (small, large))
        assert np.array_equal(order[other.triangle[other.mask]], one.triangle[one.mask])
        assert_same(other.barycentric(), one.barycentric())
        for shading in ("smooth", "flat", "normals"):
            pictures = [
                shade(frags, mesh, CAMERAS["perspective"], shading=shading, lights=LIGHTS, material=material)
                for frags, mesh in ((one, small), (other, large))
            ]
            assert_same(*pictures)


def test_shade_several_samples_of_one_triangle_are_as_one():
    camera = tl.Camera.look_at((0, 0, 2))
    wall = tl.Mesh([[-9, -9, 0], [9, -9, 0], [0, 9, 0]], [[0, 1, 2]])
    one, eight = (tl.render(wall, camera, (16, 16), shading="flat", sampling=name) for name in ("center", "msaa8"))
    assert_same(eight, one)


# ---- errors -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: tl.Light((0, 0, 0)), ValueError, r"at must be a direction, got \(0.0, 0.0, 0.0\)"),
        (lambda: tl.Light((0, 1)), ValueError, r"at must be three finite numbers, got \(0, 1\)"),
        (lambda: tl.Light((0, 1, 0), kind="area"), ValueError,
         "kind must be one of 'directional', 'point', 'spot', got"),
        (lambda: tl.Light((0, 1, 0), "spot"), ValueError, "direction must be given for a spot, and for no other kind"),
        (lambda: tl.Light((0, 1, 0), direction=(0, 1, 0)), ValueError,
         "direction must be given for a spot, and for no"),
        (lambda: tl.Light((0, 1, 0), "spot", direction=(0, 0, 0)), ValueError, "direction must have a length, got"),
        (lambda: tl.Light((0, 1, 0), inner_deg=45), ValueError, "0 <= inner_deg < outer_deg <= 90 must hold, got 45"),
        (lambda: tl.Light((0, 1, 0), intensity=-1), ValueError, "intensity must be finite and not negative, got -1"),
        (lambda: tl.Fog(2, 1), ValueError, "near and far must be finite and near < far, got 2 and 1"),
        (lambda: tl.Material(specular=2), ValueError, "specular must lie in 0 to 1, got 2"),
        (lambda: tl.Material(texture=NOISE), TypeError, "texture must be a Texture, got ndarray"),
        (lambda: tl.Texture(NOISE / 255), TypeError, "image must be uint8, got float64"),
        (lambda: tl.Texture(NOISE[..., :2]), ValueError, r"image must have shape .*, got \(96, 160, 2\)"),
        (lambda: tl.Texture(NOISE[:0]), ValueError, "image must have 1 to 32768 pixels a side"),
        (lambda: tl.Texture(NOISE, wrap="fold"), ValueError, "wrap must be one of 'repeat', 'clamp', 'mirror', got"),
        (lambda: tl.Texture(NOISE, wrap=("repeat",)), ValueError, "wrap must be one word, or two for u and v"),
        (lambda: replace(KNOT, uv=[[0, 1]]), ValueError, r"uv must have shape \(\d+, 2\), got \(1, 2\)"),
        (lambda: replace(KNOT, materials=[1]), TypeError, "materials must be of Material, got int"),
        (lambda: replace(KNOT, material_of_triangle=[0]), ValueError, "material_of_triangle must have shape"),
        (lambda: replace(KNOT, material_of_triangle=np.ones(len(KNOT.triangles), int), materials=[tl.Material()]),
         IndexError, r"material_of_triangle\[0\] = 1 must name one of 1 materials"),
        (lambda: tl.render(KNOT, shading="matcap"), ValueError, "matcap must be a Texture for shading 'matcap'"),
        (lambda: tl.render(KNOT, lights=[(0, 1, 0)]), TypeError, "lights must be of Light, got tuple"),
        (lambda: tl.render(KNOT, fog=3), TypeError, "fog must be a Fog, got int"),
        (lambda: tl.render(KNOT, ambient=-1), ValueError, "ambient must be finite and not negative, got -1"),
    ],
)  # fmt: skip
def test_wrong_values_are_named(make, error, message):
    with pytest.raises(error, match=message):
        make()


@pytest.mark.parametrize("shading", ["smooth", "flat", "ids", "depth"])
def test_shade_with_another_mesh_is_refused(shading):
    cube = tl.Mesh(*tl.scenes.shape("cube"))
    frags = tl.rasterize_mesh(KNOT, CAMERAS["ortho"], SIZE)
    drawn, given = (f"{len(m.vertices)} vertices and {len(m.triangles)} triangles" for m in (KNOT, cube))
    message = f"mesh must be the one that was drawn, with {drawn}, got {given.split()[0]} and {given.split()[3]}"
    with pytest.raises(ValueError, match=message):
        tl.shade(frags, cube, CAMERAS["ortho"], shading=shading)


def test_shade_of_what_is_no_mesh_is_refused():
    frags = tl.rasterize_mesh(KNOT, CAMERAS["ortho"], SIZE)
    with pytest.raises(TypeError, match="mesh must be a Mesh, got int"):
        tl.shade(frags, 3, CAMERAS["ortho"])
    with pytest.raises(TypeError, match="frags must be Fragments, got NoneType"):
        tl.shade(None, KNOT, CAMERAS["ortho"])


def test_shade_through_a_lens_is_the_picture_of_render():
    intrinsics = [[90, 0, 75], [0, 90, 55], [0, 0, 1]]
    camera = tl.Camera.from_intrinsics(intrinsics, np.eye(4), SIZE, near=0.1, far=50, distortion=[-0.3, 0.1, 0, 0])
    mesh = replace(KNOT, vertices=KNOT.vertices + [0, 0, 4])
    assert_same(tl.shade(tl.rasterize_mesh(mesh, camera, SIZE), mesh, camera), tl.render(mesh, camera, SIZE))


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
@pytest.mark.parametrize("shading", ["smooth", "ids", "depth"])
def test_shade_of_a_scene_is_the_picture_of_render(shading, sampling):
    scene, camera = tl.Scene([KNOT, (KNOT, np.diag([-0.5, 1, 1, 1]))]), CAMERAS["ortho"]
    frags = tl.rasterize_mesh(scene, camera, SIZE, sampling=sampling)
    expected = tl.render(scene, camera, SIZE, sampling=sampling, shading=shading)
    assert_same(tl.shade(frags, scene, camera, shading=shading), expected)


def test_shade_with_another_scene_is_refused():
    cube, camera = tl.Mesh(*tl.scenes.shape("cube")), CAMERAS["ortho"]
    frags = tl.rasterize_mesh(tl.Scene([KNOT, cube]), camera, SIZE)
    with pytest.raises(TypeError, match="mesh must be a Scene, got Mesh"):
        tl.shade(frags, KNOT, camera)
    with pytest.raises(ValueError, match="mesh must be the scene that was drawn, of 2 instances, got one of 1"):
        tl.shade(frags, tl.Scene([KNOT]), camera)
    with pytest.raises(ValueError, match=r"mesh\[1\] must be the one that was drawn, with 24 vertices"):
        tl.shade(frags, tl.Scene([KNOT, KNOT]), camera)


@pytest.mark.parametrize("draw", [tl.render, tl.render_transparent, lambda mesh: tl.render(tl.Scene([mesh]))])
def test_shade_does_not_keep_a_mesh(draw):
    mesh = replace(KNOT)
    draw(mesh)
    kept = weakref.ref(mesh)
    del mesh
    gc.collect()
    assert kept() is None
