"""Creases: normals of corners against the rule written out, and that pictures show sharp edges and nothing else."""

import math
from dataclasses import replace

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, THREADS, on

import topleft as tl
from topleft._meshes.model.mesh import coincident, with_normals
from topleft._meshes.model.normals import EQUAL_ANGLE_DEG, angle_weighted_normals, creased_normals, face_normals

SIZE = (96, 72)


def prism(n_sides, height=1.0):
    """A closed prism round the z axis, its vertices shared by all faces."""
    angle = np.arange(n_sides) * (2 * np.pi / n_sides)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ends = [np.column_stack([ring, np.full(n_sides, z)]) for z in (-height, height)]
    i, j = np.arange(n_sides), np.roll(np.arange(n_sides), -1)
    low, high = np.full(n_sides, 2 * n_sides), np.full(n_sides, 2 * n_sides + 1)
    sides = [(i, j, n_sides + j), (i, n_sides + j, n_sides + i), (j, i, low), (n_sides + i, n_sides + j, high)]
    vertices = np.concatenate([*ends, [[0, 0, -height], [0, 0, height]]])
    return vertices, np.concatenate([np.stack(side, axis=1) for side in sides]).astype(np.int32)


def soup(vertices, triangles):
    """The same triangles, each with vertices of its own."""
    return vertices[triangles].reshape(-1, 3), np.arange(triangles.size, dtype=np.int32).reshape(-1, 3)


def made_on(isa, make):
    """What `make` returns with an instruction set."""
    with on(isa):
        return make()


def groups_by_rule(vertices, triangles, crease_deg):
    """The corners (triangle, corner) that belong together, as sets: the rule of `creased_normals`, word by word."""
    normals = face_normals(vertices, triangles)
    least = math.cos(math.radians(min(crease_deg + EQUAL_ANGLE_DEG, 180)))
    found = []
    for vertex in range(len(vertices)):
        around = [(t, k) for t, row in enumerate(triangles.tolist()) for k in range(3) if row[k] == vertex]
        flat = [corner for corner in around if not normals[corner[0]].any()]
        name = {other: other for other in range(len(vertices))}

        def sides(corner, name=name):
            t, k = corner
            return {name[int(triangles[t, (k + 1) % 3])], name[int(triangles[t, (k + 2) % 3])]}

        for t, k in flat:
            one, other = name[int(triangles[t, (k + 1) % 3])], name[int(triangles[t, (k + 2) % 3])]
            name.update({key: one for key, value in name.items() if value == other})
        sets = [{corner} for corner in around if corner not in flat]
        for a in [corner for corner in around if corner not in flat]:
            for b in [corner for corner in around if corner not in flat]:
                u, v = normals[a[0]], normals[b[0]]
                if a != b and sides(a) & sides(b) and (u[0] * v[0] + u[1] * v[1]) + u[2] * v[2] >= least:
                    own, other = (next(s for s in sets if corner in s) for corner in (a, b))
                    if own is not other:
                        sets.remove(other)
                        own |= other
        found.append({frozenset(own) for own in sets})
    return found


def groups_found(vertices, triangles, crease_deg):
    """What the kernel says: the corners of each vertex by the row they have."""
    _, corners = creased_normals(vertices, triangles, crease_deg)
    rows = triangles if corners is None else corners.of_corner
    normals = face_normals(vertices, triangles)
    found = []
    for vertex in range(len(vertices)):
        own: dict[int, set] = {}
        for t, k in zip(*np.nonzero(triangles == vertex), strict=True):
            if normals[t].any():
                own.setdefault(int(rows[t, k]), set()).add((int(t), int(k)))
        found.append({frozenset(corners) for corners in own.values()})
    return found


def messy(seed, n_vertices=24, n_triangles=60):
    """Triangles at random on a rough grid: sides of many triangles, degenerate ones, all angles."""
    rng = np.random.default_rng(seed)
    vertices = rng.integers(0, 3, (n_vertices, 3)).astype(np.float64)
    return vertices, rng.integers(0, n_vertices, (n_triangles, 3)).astype(np.int32)


@pytest.mark.parametrize("crease", [0.0, 30.0, 89.0, 91.0, 180.0])
@pytest.mark.parametrize("seed", range(4))
@ON_EACH_ISA
def test_corners_of_messy_meshes_belong_together_as_the_rule_says(isa, seed, crease):
    vertices, triangles = messy(seed)

    assert made_on(isa, lambda: groups_found(vertices, triangles, crease)) == groups_by_rule(
        vertices, triangles, crease
    )


@ON_EACH_ISA
def test_a_group_has_the_angle_weighted_normal_of_its_triangles(isa):
    vertices, triangles = prism(24)
    _, corners = made_on(isa, lambda: creased_normals(vertices, triangles, 30))

    for group in {own for vertex in groups_by_rule(vertices, triangles, 30) for own in vertex}:
        rows = {int(corners.of_corner[corner]) for corner in group}
        alone = angle_weighted_normals(vertices, triangles[sorted(t for t, _ in group)])
        vertex = int(triangles[next(iter(group))])
        assert len(rows) == 1
        assert corners.rows[rows.pop()].tolist() == alone[vertex].tolist()


@pytest.mark.parametrize("threads", THREADS)
@ON_EACH_ISA
def test_creased_normals_have_the_same_bits_on_each_isa_with_any_threads(isa, threads):
    vertices, triangles = messy(5, 500, 3000)
    places = coincident(vertices)
    expected = made_on("scalar", lambda: creased_normals(vertices, triangles, 60, places, threads=1))
    found = made_on(isa, lambda: creased_normals(vertices, triangles, 60, places, threads=threads))

    assert_same(found[0], expected[0])
    for own, other in zip(found[1], expected[1], strict=True):
        assert_same(own, other)


def test_vertices_keep_the_normal_of_all_their_triangles():
    vertices, triangles = prism(12)

    of_vertices, corners = creased_normals(vertices, triangles, 30)

    assert_same(of_vertices, angle_weighted_normals(vertices, triangles))
    assert_same(corners.rows[: len(vertices)], of_vertices)


def test_a_smooth_mesh_has_no_normals_of_corners():
    mesh = tl.Mesh(*tl.scenes.shape("sphere"), crease=30)

    assert mesh.corner_normals() is None
    assert_same(mesh.vertex_normals(), replace(mesh, crease=180).vertex_normals())


def test_a_prism_of_twelve_sides_is_round_and_its_rims_are_sharp():
    """Its sides differ by 30 degrees but for rounding: all edges are alike."""
    vertices, triangles = prism(12)
    for kind in (np.float32, np.float64):
        corners = tl.Mesh(vertices.astype(kind), triangles, crease=30).corner_normals()
        sides = corners.rows[corners.of_corner[:24]]

        assert len(corners.vertex_of_row) == 2 * 24  # a row for the side and one for the end at each rim vertex
        assert np.abs(sides[..., 2]).max() < 1e-6


def test_a_triangle_without_area_between_two_others_does_not_part_them():
    """A T-junction: the long edge 0-2 has a vertex 3 in it, closed by a triangle without area."""
    vertices = np.array([[0, 0, 0], [0, 1, 0], [2, 0, 0], [1, 0, 0], [1, -1, 0]], float)
    triangles = np.array([[0, 2, 1], [0, 3, 2], [0, 4, 3], [3, 4, 2]], np.int32)

    assert creased_normals(vertices, triangles, 30)[1] is None


def test_an_edge_of_both_sides_of_a_sheet_joins_each_side_by_itself():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    front = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    triangles = np.concatenate([front, front[:, ::-1]])

    corners = tl.Mesh(vertices, triangles, crease=30).corner_normals()

    assert corners.rows[corners.of_corner][:, :, 2].tolist() == [[1.0] * 3] * 2 + [[-1.0] * 3] * 2


def test_a_side_that_more_than_32_triangles_share_joins_nothing():
    for n, n_rows in ((32, 0), (33, 2 * 33)):
        apex = np.column_stack([np.linspace(1, 2, n), np.zeros(n), np.zeros(n)])
        vertices = np.concatenate([[[0, 0, 0], [0, 1, 0]], apex])
        triangles = np.array([(0, 2 + k, 1) for k in range(n)], np.int32)
        corners = creased_normals(vertices, triangles, 30)[1]

        assert (0 if corners is None else len(corners.vertex_of_row)) == n_rows


def test_a_fan_of_many_triangles_is_grouped_without_comparing_all_pairs():
    n = 200_000
    angle = np.arange(n) * (2 * np.pi / n)
    vertices = np.concatenate([[[0, 0, 0]], np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n)])])
    triangles = np.column_stack([np.zeros(n), 1 + np.arange(n), 1 + np.roll(np.arange(n), -1)]).astype(np.int32)

    assert creased_normals(vertices, triangles, 30)[1] is None


def test_vertices_at_one_place_count_as_one_with_a_crease_angle():
    shared, apart = (tl.as_mesh(make(*prism(24))) for make in (lambda *both: both, soup))
    camera = tl.Camera.framing(shared)

    assert_same(tl.render(apart, camera, SIZE), tl.render(shared, camera, SIZE))


def test_arrays_given_to_mesh_are_smooth_unless_an_angle_is_given():
    vertices, triangles = prism(8)

    assert tl.Mesh(vertices, triangles).crease == 180
    assert tl.Mesh(vertices, triangles).corner_normals() is None
    assert tl.as_mesh((vertices, triangles)).crease == 30


def test_a_crease_angle_of_zero_is_flat_shading():
    mesh = tl.Mesh(*prism(12), crease=0)
    camera = tl.Camera.framing(mesh)
    flat = tl.render(replace(mesh, crease=180), camera, SIZE, shading="flat")

    assert_same(tl.render(mesh, camera, SIZE), flat)


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
@pytest.mark.parametrize("shading", ["smooth", "normals", "matcap"])
@ON_EACH_ISA
def test_a_creased_mesh_looks_like_one_with_normals_split_by_hand(isa, shading, sampling):
    mesh = tl.Mesh(*prism(12), crease=30)
    options = {"size": SIZE, "shading": shading, "sampling": sampling}
    if shading == "matcap":
        options["matcap"] = tl.Texture(np.random.default_rng(1).integers(0, 256, (16, 16, 3), dtype=np.uint8))
    for camera in (tl.Camera.framing(mesh), tl.Camera.look_at((0.2, 0.3, 1.1), (1, 0, 0), near=0.05)):
        found = made_on(isa, lambda camera=camera: tl.render(mesh, camera, **options))

        assert_same(found, tl.render(with_normals(mesh), camera, **options))


def test_creases_show_through_clusters_instances_and_layers():
    vertices, triangles = prism(300)
    mesh = tl.Mesh(vertices, np.concatenate([triangles] * 40), crease=30)
    split = with_normals(mesh)
    camera = tl.Camera.framing(mesh)
    expected = tl.render(split, camera, SIZE)
    mesh.clusters  # noqa: B018 (made here)
    for _ in range(3):
        assert_same(tl.render(mesh, camera, SIZE), expected)
    turn = np.eye(4)
    turn[:3, :3] = [[0, 0, 2], [0, 2, 0], [2, 0, 0]]
    scenes = [tl.Scene([own, (own, turn)]) for own in (mesh, split)]
    assert_same(*(tl.render(scene, camera, SIZE) for scene in scenes))
    for layer in ("world_normal", "camera_normal"):
        assert_same(*(tl.render_layers(scene, camera, SIZE, layers=layer)[layer] for scene in scenes))


def test_creases_show_through_a_lens():
    mesh = tl.Mesh(*prism(12), crease=30)
    intrinsics, pose = [[60, 0, 48], [0, 60, 36], [0, 0, 1]], np.diag([1.0, -1, -1, 1])
    pose[2, 3] = 4
    camera = tl.Camera.from_intrinsics(intrinsics, pose, SIZE, near=0.1, far=10, distortion=[0.1, 0.01, 0, 0])
    split = with_normals(mesh)
    picture, expected = (tl.render(own, camera, SIZE).astype(int) for own in (mesh, split))

    assert_same(picture, expected)
    assert len(np.unique(picture.reshape(-1, 4), axis=0)) < len(
        np.unique(tl.render(replace(mesh, crease=180), camera, SIZE).reshape(-1, 4), axis=0)
    )


def test_levels_of_detail_crease_at_the_angle_of_their_mesh(tmp_path):
    mesh = tl.Mesh(*tl.scenes.torus(), crease=40)
    levels = tl.simplify(mesh)
    levels.save(tmp_path / "levels.npz")

    assert {level.mesh.crease for level in levels} == {40.0}
    assert {level.mesh.crease for level in tl.Levels.load(tmp_path / "levels.npz", mesh)} == {40.0}


@pytest.mark.parametrize("value", [-1, 180.5, float("nan")])
def test_a_crease_angle_out_of_range_is_refused(value):
    with pytest.raises(ValueError, match="crease must lie in 0 to 180 degrees"):
        tl.Mesh(*prism(3), crease=value)


def test_a_crease_that_is_no_number_is_refused():
    with pytest.raises(TypeError, match="crease must be an angle in degrees"):
        tl.Mesh(*prism(3), crease="sharp")


def test_normals_of_the_caller_do_not_crease():
    vertices, triangles = prism(4)
    mesh = tl.Mesh(vertices, triangles, normals=vertices, crease=30)

    assert mesh.corner_normals() is None
    assert_same(mesh.vertex_normals(), vertices)
