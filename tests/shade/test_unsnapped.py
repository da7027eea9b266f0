"""Light of vertices that are not snapped: edge functions of pixels against fractions."""

from fractions import Fraction

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on

import topleft as tl
from topleft._meshes.picture.render import shade
from topleft._meshes.picture.shade import ShownInstance, shade_normals

SIZE = (150, 70)
CAMERA = tl.Camera.look_at((0, 0, 4), ortho_height=2.0, near=1.0, far=9.0)
PIXELS_A_UNIT = SIZE[1] / 2.0


def in_space(points_px):
    """Points of the picture as points that this camera sees there."""
    x, y = np.asarray(points_px, np.float64).T
    return np.stack([(x - SIZE[0] / 2) / PIXELS_A_UNIT, (SIZE[1] / 2 - y) / PIXELS_A_UNIT, 0 * x], axis=1)


def points_of(camera, vertices):
    """Vertices in pixels as the engine has them: float64, operation by operation."""
    m = camera.clip_from_world(SIZE)
    clip = [((row[0] * vertices[:, 0] + row[1] * vertices[:, 1]) + row[2] * vertices[:, 2]) + row[3] for row in m]
    x, y = clip[0] / clip[3], clip[1] / clip[3]
    return np.stack([(x + 1) * (SIZE[0] / 2), (1 - y) * (SIZE[1] / 2)], axis=1)


def exact_weights(corners_px, x, y):
    """The weights of the centre of a pixel."""
    p = [[Fraction(value) for value in corner] for corner in corners_px.tolist()]
    at = (x + Fraction(1, 2), y + Fraction(1, 2))
    edges = []
    for k in range(3):
        (ax, ay), (bx, by) = p[(k + 1) % 3], p[(k + 2) % 3]
        edges.append((bx - ax) * (at[1] - ay) - (by - ay) * (at[0] - ax))
    return [edge / sum(edges) for edge in edges]


def found_weights(frags, mesh, camera, step=1):
    """Of some pixels (row, column) the weights by which the normals of their corners, three axes, are mixed."""
    shown = [ShownInstance(frags._snapped, mesh, np.eye(4))]
    normals = shade_normals(shown, frags.triangle, camera, np.eye(3))  # the camera looks along -z, x to the right
    for y, x in np.argwhere(frags.mask)[::step].tolist():
        mixed = np.abs(normals[y, x].astype(np.float64))
        yield y, x, (mixed / mixed.sum()).tolist()


def lit_by_weights(triangles_px):
    """A mesh of triangles in pixels whose corners have the three axes as normals."""
    vertices = in_space(np.reshape(triangles_px, (-1, 2)))
    normals = np.tile(np.eye(3), (len(vertices) // 3, 1))
    return tl.Mesh(vertices, np.arange(len(vertices)).reshape(-1, 3), normals=normals)


def some_triangles(kind, rng, n=40):
    """Triangles of some pixels, of parts of one, thin ones, and such that reach far out of the picture."""
    middles = rng.uniform((0, 0), SIZE, (n, 1, 2))
    corners = rng.uniform(-1, 1, (n, 3, 2)) * {"small": 6, "tiny": 0.8, "large": 90, "huge": 2000, "thin": 40}[kind]
    if kind == "thin":
        corners[:, 2] = corners[:, 0] + (corners[:, 1] - corners[:, 0]) * 0.4 + rng.uniform(-1, 1, (n, 2)) * 0.02
    return middles + corners


@ON_EACH_ISA
@pytest.mark.parametrize("kind", ["small", "tiny", "large", "huge", "thin"])
def test_unsnapped_normals_are_mixed_by_the_weights_of_fractions(isa, kind):
    rng = np.random.default_rng(7)
    mesh = lit_by_weights(some_triangles(kind, rng, {"tiny": 4000, "thin": 8000, "small": 100}.get(kind, 40)))
    points = points_of(CAMERA, mesh.vertices)
    with on(isa):
        frags = tl.rasterize_mesh(mesh, CAMERA, SIZE, subpixel_bits="exact")
        found = list(found_weights(frags, mesh, CAMERA, 7))
    assert len(found) > 100
    for y, x, got in found:
        corners = points[mesh.triangles[frags.triangle[y, x]]]
        box = np.prod(np.ptp(corners, axis=0)) / abs(np.linalg.det(np.diff(corners, axis=0)))
        for mine, weight in zip(got, exact_weights(corners, x, y), strict=True):
            # a weight errs by 2**-24 of itself, 2**-43, and at most 2**-48 boxes over areas; normals by 2**-22 of it
            assert abs(mine - weight) <= 2.0**-21 * weight + 2.0**-43 + 2.0**-49 * box


def grid_on(points_px):
    """The triangles of a grid of points (rows, columns, 2) in pixels, with normals and colours."""
    rows, columns, _ = points_px.shape
    vertices = in_space(points_px.reshape(-1, 2))
    corner = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, :-1], corner[1:, 1:]
    rng = np.random.default_rng(3)
    normals = rng.normal(size=(len(vertices), 3)) + (0, 0, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    colors = rng.integers(0, 256, (len(vertices), 3)).astype(np.uint8)
    return tl.Mesh(vertices, np.stack([a, c, b, b, c, d], -1).reshape(-1, 3), normals=normals, colors=colors)


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
@pytest.mark.parametrize("step", [0.7, 5.3, 47.0])
def test_unsnapped_light_of_a_window_is_a_crop(step, sampling):
    y, x = np.mgrid[-2.0:72:step, -2.0:152:step]
    mesh = grid_on(np.stack([x, y], -1) + np.random.default_rng(1).uniform(-0.2, 0.2, (*x.shape, 2)) * step)

    def picture(size, origin=(0, 0)):
        view = {"origin": origin, "viewport": SIZE, "sampling": sampling, "subpixel_bits": "exact"}
        return shade(tl.rasterize_mesh(mesh, CAMERA, size, **view), mesh, CAMERA)

    whole = picture(SIZE)
    assert (whole[..., 3] == 255).mean() > 0.9
    for left, top in [(1, 0), (37, 21), (64, 3), (95, 40)]:
        assert_same(picture((50, 29), (left, top)), whole[top : top + 29, left : left + 50])


@pytest.mark.parametrize("shading", ["smooth", "flat", "unlit", "normals"])
def test_unsnapped_light_is_that_of_8_bits_where_vertices_lie_on_their_grid(shading):
    rng = np.random.default_rng(5)
    points = (np.stack(np.mgrid[0:11, 0:6][::-1], -1) * 14.0 + rng.integers(-900, 900, (11, 6, 2)) / 256)[:, ::-1]
    mesh = grid_on(points)
    options = {"shading": shading, "sampling": "center"}
    exact, snapped = (tl.render(mesh, CAMERA, SIZE, subpixel_bits=bits, **options) for bits in ("exact", 8))
    difference = np.abs(exact.astype(int) - snapped)
    assert difference.max() <= 1
    assert (difference > 0).mean() < 1e-3
