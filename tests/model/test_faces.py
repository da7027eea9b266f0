"""Faces: normals against exact arithmetic, and the same bits on each instruction set with any number of threads."""

from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, THREADS, on

import topleft as tl
from topleft._meshes.model import normals as faces
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.normals import turn_of_normals
from topleft._meshes.picture.look import ShadingMesh

PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494")


def exact(number):
    """A fraction as a decimal."""
    return Decimal(number.numerator) / Decimal(number.denominator)


def arctangent(x):
    """Of a decimal: halved four times, then the series."""
    for _ in range(4):
        x = x / (1 + (1 + x * x).sqrt())
    return 16 * sum((-1) ** k * x ** (2 * k + 1) / (2 * k + 1) for k in range(30))


def angle_and_normal(corners):
    """Angle at the first of three corners and unit normal, to some fifty digits; floats are taken as they are."""
    a, b, c = ([Fraction(float(x)) for x in corner] for corner in corners)
    u, v = ([q - p for p, q in zip(a, other, strict=True)] for other in (b, c))
    normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    area = exact(sum(x * x for x in normal)).sqrt()
    dot = exact(sum(x * y for x, y in zip(u, v, strict=True)))
    half = area / (dot + (area * area + dot * dot).sqrt()) if dot > 0 or area else Decimal(0)
    return 2 * arctangent(half), [exact(x) / area for x in normal]


def needles(rng, n):
    """Corners of triangles that are float32 with few bits, so their sides are exact, of all shapes and sizes."""
    thin = rng.choice([1.0, 2.0**-4, 2.0**-9], (n, 1, 1))
    corners = np.round(rng.uniform(-1, 1, (n, 3, 3)) * 2.0**11)
    corners[:, 2] = np.round(corners[:, 0] + (corners[:, 2] - corners[:, 0]) * thin[:, 0])
    flat = rng.integers(0, 2, n) == 0
    along = np.round(corners[:, 0] + (corners[:, 1] - corners[:, 0]) * rng.uniform(0, 1, (n, 1)))
    corners[flat, 2] = along[flat] + rng.integers(-1, 2, (int(flat.sum()), 3))
    keep = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).any(axis=1)
    return corners[keep] * rng.choice([1.0, 2.0**-90, 2.0**100], (int(keep.sum()), 1, 1))


def messy(rng, n_vertices, n_triangles, dtype):
    """A mesh of triangles that share vertices at random, with degenerate ones and vertices that none uses."""
    vertices = rng.standard_normal((n_vertices, 3)).astype(dtype)
    vertices[::17] = vertices[5]
    triangles = rng.integers(0, n_vertices * 9 // 10, (n_triangles, 3)).astype(np.int32)
    triangles[::13, 1] = triangles[::13, 0]
    return vertices, triangles


def mapped(vertices, triangles, threads):
    """All that the kernels of csrc/mesh/normals.c give of a mesh."""
    normals = faces.angle_weighted_normals(vertices, triangles, threads=threads)
    rows = faces.unit_rows(normals, np.arange(9.0).reshape(3, 3) ** 2)
    return (
        normals,
        rows,
        faces.unit_rows(vertices),
        faces.face_normals(vertices, triangles, threads=threads),
        faces.face_normal_rows(vertices, triangles, threads=threads),
        faces.turned_faces(vertices, triangles, rows, threads=threads),
        faces.box_of_triangles(vertices, triangles, threads=threads),
        faces.moved(vertices, np.arange(16.0).reshape(4, 4) / 7),
    )


@pytest.mark.parametrize("dtype", ["f4", "f8"])
@ON_EACH_ISA
def test_all_arrays_have_the_same_bits_on_each_isa_and_with_any_threads(isa, dtype):
    mesh = messy(np.random.default_rng(1), 1234, 4321, dtype)
    with on("scalar"):
        expected = mapped(*mesh, 1)
    for threads in THREADS:
        with on(isa):
            for got, wanted in zip(mapped(*mesh, threads), expected, strict=True):
                assert_same(got.view(np.uint8), wanted.view(np.uint8))


@pytest.mark.parametrize("n", [0, 1, 7, 63, 64, 65, 130])
@ON_EACH_ISA
def test_every_number_of_triangles_has_the_same_bits(isa, n):
    vertices, triangles = messy(np.random.default_rng(n), 50, 130, "f8")
    with on("scalar"):
        expected = faces.face_normals(vertices, triangles)[:n]
    with on(isa):
        assert_same(faces.face_normals(vertices, triangles[:n]), expected)


@ON_EACH_ISA
def test_normals_and_weights_are_near_the_exact_ones(isa):
    corners = needles(np.random.default_rng(2), 300)
    with localcontext(prec=60):
        for triangle in corners:
            # Beside the first corner a face whose normal is z, with a right angle there: the sum tells the weight.
            side = np.abs(triangle).max()
            wall = triangle[0] + side * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
            vertices = np.vstack([triangle, wall[1:]])
            with on(isa):
                normal = faces.face_normals(triangle, np.array([[0, 1, 2]]))[0]
                both = faces.angle_weighted_normals(vertices, np.array([[0, 1, 2], [0, 3, 4]]))[0]
            angle, exact_normal = angle_and_normal(triangle)
            for got, wanted in zip(normal, exact_normal, strict=True):
                # Products of 13-bit sides are exact; a root of half an ulp more, a quotient: below 2 ulps of 1.
                assert abs(Decimal(float(got)) - wanted) < Decimal(2.0**-52)
            total = [angle * x + PI / 2 * Decimal(z) for x, z in zip(exact_normal, (0, 0, 1), strict=True)]
            length = sum(x * x for x in total).sqrt()
            for got, wanted in zip(both, total, strict=True):
                # Weights to 2**-50, divided by a sum that may be as short as `length`.
                assert abs(Decimal(float(got)) - wanted / length) < Decimal(2.0**-49) * (1 + PI / length)


@ON_EACH_ISA
def test_angles_of_needles_have_a_small_relative_error(isa):
    """Two faces of one corner at right angles to each other: the quotient of their weights is that of two axes."""
    with localcontext(prec=60):
        for k in (*range(1, 60, 7), 300, 500):
            thin = 2.0**-k
            vertices = np.array([[0, 0, 0], [1, 0, 0], [1, thin, 0], [1, 0, thin * 3]])
            with on(isa):
                normal = faces.angle_weighted_normals(vertices, np.array([[0, 1, 2], [0, 3, 1]]))[0]
            wanted = arctangent(Decimal(thin)) / arctangent(Decimal(3 * thin))
            got = Decimal(float(normal[2])) / Decimal(float(normal[1]))
            # two angles to 2**-50, and the roundings of two products and two quotients
            assert abs(got / wanted - 1) < Decimal(2.0**-48.5)


@pytest.mark.parametrize("exponent", [-1073, -1000, -300, 300, 1000, 1023])
@ON_EACH_ISA
def test_scale_changes_no_bit(isa, exponent):
    # Halves up to 1.5: the smallest scale still holds them, and in the largest a side would overflow.
    vertices, triangles = messy(np.random.default_rng(3), 60, 40, "f8")
    vertices = np.clip(np.round(vertices * 4) / 2, -1.5, 1.5)
    scaled = np.ldexp(vertices, exponent)
    with on(isa):
        for work in (faces.angle_weighted_normals, faces.face_normals):
            assert_same(work(scaled, triangles), work(vertices, triangles))


@ON_EACH_ISA
def test_faces_of_both_sides_cancel(isa):
    rng = np.random.default_rng(4)
    vertices = rng.standard_normal((600, 3))
    front = np.arange(600, dtype=np.int32).reshape(-1, 3)
    with on(isa):
        normals = faces.angle_weighted_normals(vertices, np.vstack([front, np.roll(front[:, ::-1], 1, axis=1)]))
    assert not normals.any()


@ON_EACH_ISA
def test_faces_without_area_have_no_weight(isa):
    vertices = np.array([[0.0, 0, 0], [1, 1, 1], [2, 2, 2], [0, 0, 0], [1, 0, 0]])
    with on(isa):
        triangles = np.array([[0, 1, 2], [0, 3, 3], [0, 3, 1], [2, 1, 1]])
        assert not faces.angle_weighted_normals(vertices, triangles).any()
        assert not faces.face_normals(vertices, triangles).any()


@pytest.mark.parametrize("threads", THREADS)
def test_sums_follow_the_order_of_the_faces(threads):
    # Front and back of a wide face, and a face so thin that its weight is lost when the front is added after it.
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 2.0**-60, 0]])
    front, back, thin = [0, 1, 2], [0, 2, 1], [0, 1, 3]
    for triangles, z in (([front, back, thin], 1), ([thin, front, back], 0), ([front, thin, back], 0)):
        normals = faces.angle_weighted_normals(vertices, np.array(triangles), threads=threads)
        assert normals[0].tolist() == [0, 0, z]


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", ["f4", "f8"])
def test_unit_vectors_of_any_length(isa, dtype):
    info = np.finfo(dtype)
    lengths = [info.smallest_subnormal, info.tiny, 1, info.max]
    vectors = np.array([[0, 0, x] for x in lengths] + [[0, -x, 0] for x in lengths] + [[0, 0, 0]], dtype)
    with on(isa):
        assert faces.unit_or_zero(vectors).tolist() == [[0, 0, 1]] * 4 + [[0, -1, 0]] * 4 + [[0, 0, 0]]
        assert (faces.unit_rows(vectors)[:, 3] == 1).all()


@ON_EACH_ISA
def test_unit_vectors_of_what_is_not_finite_are_zero(isa):
    with on(isa):
        assert not faces.unit_or_zero(np.array([[np.nan, 0, 1], [np.inf, 0, 0], [0, 1, -np.inf]])).any()


@ON_EACH_ISA
def test_turned_faces_are_those_whose_normals_point_away(isa):
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    triangles = np.array([[0, 1, 2], [0, 2, 1], [0, 0, 1]])
    up = np.tile(np.array([0, 0, 1, 1], np.float32), (3, 1))
    with on(isa):
        assert faces.turned_faces(vertices, triangles, up).tolist() == [0, 1, 0]


def test_turned_faces_with_normals_of_other_vertices_are_refused():
    with pytest.raises(ValueError, match=r"normals must have shape \(3, 4\), got \(2, 4\)"):
        faces.turned_faces(np.zeros((3, 3)), np.array([[0, 1, 2]]), np.zeros((2, 4), np.float32))


def test_box_of_triangles_leaves_out_what_none_uses():
    vertices = np.array([[9.0, 9, 9], [0, 1, 2], [3, -1, 2], [1, 1, 5], [np.nan, 0, 0]])
    assert faces.box_of_triangles(vertices, np.array([[1, 2, 3]])).tolist() == [[0, -1, 2], [3, 1, 5]]


@pytest.mark.parametrize(
    "work",
    [
        faces.angle_weighted_normals,
        faces.face_normals,
        faces.face_normal_rows,
        faces.box_of_triangles,
        lambda *mesh: faces.turned_faces(*mesh, np.zeros((2, 4), np.float32)),
    ],
)
@pytest.mark.parametrize(("row", "index"), [(70, -1), (70, 2), (70, 2**31 - 1), (0, 2)])
def test_triangles_that_changed_for_the_worse_are_refused(work, row, index):
    triangles = np.zeros((100, 3), np.int32)
    triangles[row, 2] = index
    with pytest.raises(IndexError, match=rf"row {row} is \[0, 0, {index}\]"):
        work(np.zeros((2, 3)), triangles)


def test_surface_in_eye_space_has_its_normals_at_right_angles():
    mesh = Mesh(*tl.scenes.shape("torus-knot"))
    view = np.array([[1, 2, 0, 3], [0, 1, 0.5, 1], [0, 0, -3, -9], [0, 0, 0, 1.0]])
    surface = ShadingMesh(mesh, view)
    corners = surface.positions[mesh.triangles]
    sides = corners - np.roll(corners, 1, axis=1)
    flat = surface.face_normals[:, None, :3]
    lengths = np.linalg.norm(sides, axis=2)
    # float32 normals
    assert (abs((sides * flat).sum(axis=2)) <= 2.0**-22 * lengths).all()
    expected = faces.unit_or_zero(mesh.vertex_normals() @ np.linalg.inv(view[:3, :3]))
    # rounded to float32, after some float64 operations that come in another order
    assert np.allclose(surface.normals[:, :3], expected, rtol=0, atol=2.0**-24)
    assert np.allclose(surface.positions, mesh.vertices @ view[:3, :3].T + view[:3, 3], rtol=0, atol=2.0**-48)


def test_turn_of_normals_is_the_inverse_but_for_the_scale():
    view = np.array([[0.0, 2, 0, 3], [1, 0, 0, 1], [0, 0, 4, -9], [0, 0, 0, 1]])
    assert turn_of_normals(view).tolist() == (np.linalg.inv(view[:3, :3]) * 8).tolist()


@pytest.mark.parametrize("n_channels", [3, 4])
def test_surface_colors_are_rows_of_four(n_channels):
    colors = np.arange(3 * n_channels, dtype=np.uint8).reshape(3, n_channels)
    surface = ShadingMesh(Mesh(np.eye(3), [[0, 1, 2]], colors=colors))
    opacity = colors[:, 3] / np.float32(255) if n_channels == 4 else np.ones(3)
    assert surface.colors.tolist() == [[*row[:3], alpha] for row, alpha in zip(colors.tolist(), opacity, strict=True)]
