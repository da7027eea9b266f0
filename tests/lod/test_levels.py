"""Levels of detail: what `simplify` promises, what is kept, and where."""

import pickle
import sys
from itertools import pairwise

import numpy as np
import pytest
from surface_samples import corners_of, sampled_distance

import topleft as tl
from topleft._meshes.lod.collapse import border_points, collapse, gather, wanted_of
from topleft._meshes.lod.levels import kept_levels
from topleft._meshes.lod.simplify import levels_of


def torus(**attributes):
    return tl.Mesh(*tl.scenes.torus(segments=48, sections=24), **attributes)


def grid(n, height=None):
    """A square of 2 n * n triangles, and the texture coordinates of its vertices."""
    y, x = np.mgrid[0 : n + 1, 0 : n + 1] / n
    z = 0 * x if height is None else height(x, y)
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    triangles = np.concatenate([first[:, None] + [0, 1, n + 2], first[:, None] + [0, n + 2, n + 1]])
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), triangles


def two_boxes():
    """A grid of two materials whose halves have other texture coordinates where they meet."""
    points, triangles = grid(16, lambda x, y: 0.05 * np.sin(7 * x) * np.cos(5 * y))
    middle = points[triangles, 0].mean(axis=1)
    is_right = middle > 0.5
    n = len(points)
    triangles = np.where(is_right[:, None], triangles + n, triangles)
    both = np.vstack([points, points])
    uv = both[:, :2] * 0.5
    uv[n:, 0] += 0.5
    materials = (tl.Material((200, 0, 0)), tl.Material((0, 0, 200)))
    return tl.Mesh(both, triangles, uv=uv, materials=materials, material_of_triangle=is_right.astype(int))


@pytest.mark.parametrize("mesh", [torus(), tl.Mesh(*tl.scenes.blob(1500)), two_boxes()], ids=["torus", "blob", "seam"])
def test_simplify_bound_is_never_below_the_distance(mesh):
    levels = tl.simplify(mesh, smallest=40)
    assert len(levels) > 1
    for finer, level in pairwise(levels):
        assert len(level.mesh.triangles) < len(finer.mesh.triangles)
        assert sampled_distance(corners_of(mesh), corners_of(level.mesh), 3) <= level.bound
        assert level.known <= level.bound


def test_simplify_flat_grid_stays_where_it_is():
    mesh = tl.Mesh(*grid(24))
    level = tl.simplify(mesh)[1]
    assert len(level.mesh.triangles) < len(mesh.triangles) / 2
    assert level.bound <= 2.0**-18 + 2.0**-40  # what is not worth looking at, and rounding
    assert np.array_equal(level.mesh.bounds, mesh.bounds)


def test_simplify_bound_is_that_of_float32_vertices():
    vertices, triangles = tl.scenes.torus(segments=48, sections=24)
    mesh = tl.Mesh(vertices.astype(np.float32) + 1000, triangles)
    level = tl.simplify(mesh)[1]
    assert level.mesh.vertices.dtype == np.float32
    assert sampled_distance(corners_of(mesh), corners_of(level.mesh), 2) <= level.bound


def test_simplify_small_mesh_has_no_coarser_level():
    assert len(tl.simplify(tl.Mesh(*tl.scenes.shape("cube")))) == 1


def test_simplify_empty_mesh_has_no_coarser_level():
    levels = tl.simplify(tl.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)))
    assert [len(level.mesh.triangles) for level in levels] == [0]


def test_simplify_vertices_doubled_or_unused_do_not_matter():
    mesh = torus()
    apart = mesh.vertices[mesh.triangles].reshape(-1, 3)
    apart = np.vstack([apart, [[100.0, 100, 100]]])
    soup = tl.Mesh(apart, np.arange(len(mesh.triangles) * 3).reshape(-1, 3))
    sizes = [len(level.mesh.triangles) for level in tl.simplify(mesh)]
    assert [len(level.mesh.triangles) for level in tl.simplify(soup)] == sizes
    assert tl.simplify(soup)[1].mesh.bounds.max() < 2


def test_simplify_seam_and_border_keep_place_and_attributes():
    mesh = two_boxes()
    level = tl.simplify(mesh, smallest=40)[1].mesh
    x, y = level.vertices[:, 0], level.vertices[:, 1]
    rows = level.material_of_triangle
    for side in (0, 1):
        used = np.unique(level.triangles[rows == side])
        on_seam = used[x[used] == 0.5]
        assert len(on_seam) == 17  # all there were
        assert np.array_equal(np.sort(y[on_seam]), np.arange(17) / 16)
        assert np.array_equal(level.uv[on_seam, 0], np.full(17, 0.25 + 0.5 * side, np.float32))
    assert (x[level.triangles[rows == 0]] <= 0.5).all()
    assert (x[level.triangles[rows == 1]] >= 0.5).all()
    assert level.materials == mesh.materials


def test_simplify_attributes_are_those_of_the_nearest_point():
    points, triangles = grid(24)
    colors = np.rint(points * 255 + [0, 0, 99]).astype(np.uint8)
    mesh = tl.Mesh(points, triangles, np.tile([0, 0, 2.0], (len(points), 1)), colors, points[:, :2])
    level = tl.simplify(mesh)[1].mesh
    assert np.abs(level.uv - level.vertices[:, :2]).max() <= 2.0**-20  # float32, and feet to 2**-18 of the size
    assert np.abs(level.colors - (level.vertices * 255 + [0, 0, 99])).max() <= 1  # rounded twice
    assert np.allclose(level.normals, [0, 0, 1], atol=1e-12)  # unit vectors, rounded


def test_simplify_mixes_colours_as_light_where_the_mesh_does():
    points, triangles = grid(24)
    srgb = np.where(points <= 0.0031308, 12.92 * points, 1.055 * points.clip(1e-9) ** (1 / 2.4) - 0.055)
    mesh = tl.Mesh(points, triangles, colors=np.rint(255 * srgb).astype(np.uint8), color_interpolation="linear")
    level = tl.simplify(mesh)[-1].mesh
    x = level.vertices.astype(np.float64)
    expected = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x.clip(1e-9) ** (1 / 2.4) - 0.055)
    assert np.abs(level.colors[:, :2] - 255 * expected[:, :2])[x[:, :2].min(axis=1) > 0.1].max() <= 1.5
    as_numbers = tl.simplify(tl.Mesh(points, triangles, colors=mesh.colors))[-1].mesh
    assert not np.array_equal(level.colors, as_numbers.colors)


def test_simplify_keeps_no_normals_where_there_are_none():
    assert tl.simplify(torus())[1].mesh.normals is None


def test_simplify_is_kept_with_the_mesh_and_made_once():
    mesh = torus()
    assert kept_levels(mesh) is None
    levels = levels_of(mesh)
    assert levels_of(mesh) is levels
    assert tl.simplify(mesh, ratio=0.5) is levels_of(mesh)
    assert levels_of(mesh) is not levels


def test_simplify_levels_go_with_the_mesh():
    from weakref import ref

    mesh = torus()
    levels = ref(tl.simplify(mesh))
    del mesh
    assert levels() is None


def test_mesh_with_levels_can_be_pickled():
    mesh = torus()
    tl.simplify(mesh)
    assert np.array_equal(pickle.loads(pickle.dumps(mesh)).vertices, mesh.vertices)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"ratio": 0.0}, r"ratio must lie in 0.05 to 0.75, got 0.0"),
        ({"ratio": 0.9}, r"ratio must lie in 0.05 to 0.75, got 0.9"),
        ({"smallest": 3}, r"smallest must be at least 4, got 3"),
    ],
)
def test_simplify_wrong_option_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        tl.simplify(torus(), **options)


@pytest.mark.parametrize("other", [tl.Scene([torus()]), tl.Points([[0.0, 0, 0]]), None])
def test_simplify_of_what_is_no_mesh_is_refused(other):
    with pytest.raises(TypeError, match=r"mesh must be a Mesh, got"):
        tl.simplify(other)


def test_simplify_without_the_package_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "fast_simplification", None)
    with pytest.raises(ImportError, match=r"pip install fast-simplification"):
        tl.simplify(torus())


def test_levels_tell_what_they_are():
    levels = tl.simplify(torus())
    assert repr(levels).startswith("<Levels of 2: triangles 2,304 (bound 0), 576 (bound 0.0")
    assert levels[:1] == (levels[0],)


def test_levels_saved_and_loaded_are_the_same(tmp_path):
    mesh = two_boxes()
    levels = tl.simplify(mesh, smallest=40)
    levels.save(tmp_path / "boxes.npz")
    assert [path.name for path in tmp_path.iterdir()] == ["boxes.npz"]
    again = two_boxes()
    loaded = tl.Levels.load(tmp_path / "boxes.npz", again)
    assert levels_of(again) is loaded
    assert [(one.bound, one.known) for one in loaded] == [(one.bound, one.known) for one in levels]
    for one, other in zip(loaded, levels, strict=True):
        for name in ("vertices", "triangles", "uv", "material_of_triangle"):
            assert np.array_equal(getattr(one.mesh, name), getattr(other.mesh, name))
        assert one.mesh.normals is None
    assert loaded[1].mesh.materials == again.materials


def test_levels_of_another_mesh_are_refused(tmp_path):
    tl.simplify(torus()).save(tmp_path / "torus.npz")
    moved = tl.Mesh(torus().vertices + 1, torus().triangles)
    with pytest.raises(tl.MeshError, match=r"torus.npz' holds the levels of another mesh"):
        tl.Levels.load(tmp_path / "torus.npz", moved)


def test_levels_broken_file_is_refused(tmp_path):
    (tmp_path / "broken.npz").write_bytes(b"PK not a zip")
    with pytest.raises(tl.MeshError, match=r"cannot read .*broken.npz': broken, or not levels of detail"):
        tl.Levels.load(tmp_path / "broken.npz", torus())
    np.savez(tmp_path / "other.npz", x=1)
    with pytest.raises(tl.MeshError, match=r"cannot read .*other.npz'"):
        tl.Levels.load(tmp_path / "other.npz", torus())
    with open(tmp_path / "array.npz", "wb") as file:
        np.save(file, np.zeros(3))
    with pytest.raises(tl.MeshError, match=r"array.npz': broken, or not levels of detail"):
        tl.Levels.load(tmp_path / "array.npz", torus())


CRAFTED = {
    "bound": [np.zeros(3), np.array(None), np.zeros((1, 1)), np.array([np.nan]), np.array(["x"]), np.array([-1.0])],
    "known": [np.zeros(0), np.array(1.0)],
    "mesh": [np.array(["a", "b"])],
    "triangles_1": [np.array([[0, 1, 10**6]]), np.zeros(4), np.array("x")],
    "vertices_1": [np.zeros((3, 2)), np.full((4, 3), 1j)],
}


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in CRAFTED.items() for value in values])
def test_levels_crafted_file_is_refused(tmp_path, name, value):
    tl.simplify(torus()).save(tmp_path / "torus.npz")
    with np.load(tmp_path / "torus.npz") as file:
        arrays = dict(file) | {name: value}
    np.savez(tmp_path / "torus.npz", **arrays)
    with pytest.raises(tl.MeshError, match=r"torus.npz'"):
        tl.Levels.load(tmp_path / "torus.npz", torus())


@pytest.mark.parametrize("n_points", [1, 2])
def test_simplify_of_a_mesh_that_is_a_point_or_a_line_has_levels_of_it(n_points):
    rng = np.random.default_rng(0)
    points = np.ones((300, 3)) * rng.integers(0, n_points, (300, 1))
    mesh = tl.Mesh(points, rng.integers(0, 300, (600, 3)), uv=rng.random((300, 2)))
    levels = tl.simplify(mesh, smallest=10)
    assert len(levels[0].mesh.triangles) == 600
    assert all(level.bound <= 2 for level in levels)


def test_levels_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"there is no file .*none.npz"):
        tl.Levels.load(tmp_path / "none.npz", torus())


def test_levels_other_suffix_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"levels are kept in a file that ends in .npz, got .*levels.zip"):
        tl.simplify(torus()).save(tmp_path / "levels.zip")


def test_levels_that_cannot_be_written_leave_nothing(tmp_path, monkeypatch):
    levels = tl.simplify(torus())
    monkeypatch.setattr(np, "savez", lambda *_, **__: (_ for _ in ()).throw(OSError("full")))
    with pytest.raises(OSError, match="full"):
        levels.save(tmp_path / "torus.npz")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("with_uv", [False, True])
def test_simplify_needles_do_not_end_the_levels(with_uv):
    vertices, triangles = tl.scenes.blob(20_000)  # a hundred and forty needles round each pole
    mesh = tl.Mesh(vertices, triangles, uv=vertices[:, :2] if with_uv else None)
    levels = tl.simplify(mesh)
    assert len(levels[-1].mesh.triangles) < 1000
    level = levels[2]
    if with_uv:  # the point that attributes are taken from is about a cell away at most
        assert np.abs(level.mesh.uv - level.mesh.vertices[:, :2]).max() < 0.1
    assert level.bound < 0.1


def test_gather_joins_points_of_one_cell_alone():
    points, triangles = tl.scenes.blob(20_000)
    found = gather(points, triangles, 2_000)
    a, b, c = points[triangles.T]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    side = np.sqrt(4 / np.sqrt(3) * area / 2_000) / 3
    low, high = (np.full_like(found.points, sign * np.inf) for sign in (1, -1))
    is_left = found.into >= 0
    np.minimum.at(low, found.into[is_left], points[is_left])
    np.maximum.at(high, found.into[is_left], points[is_left])
    assert len(found.points) < 0.8 * len(points)
    assert (high - low).max() <= side * (1 + 1e-9)


def test_gather_leaves_borders_alone():
    points, triangles = grid(12)
    found = gather(points, triangles, 8)
    on_border = border_points(triangles)
    assert len(on_border) == 48
    assert np.array_equal(found.points[found.into[on_border]], points[on_border])
    assert len(found.triangles) < len(triangles)
    assert (found.into >= 0).sum() >= len(found.points)


def test_wanted_of_leaves_borders_out_of_the_ratio():
    _, triangles = grid(20)  # 800 triangles, 80 sides of the border
    assert wanted_of(triangles, 0.25, 180) == 80 + 180
    assert wanted_of(triangles, 0.25, 181) == 0
    assert wanted_of(np.asarray(tl.scenes.torus(segments=20, sections=20)[1], np.int32), 0.25, 200) == 200


def test_simplify_leaves_out_a_level_with_a_spike(monkeypatch):
    mesh = tl.Mesh(*tl.scenes.torus(segments=96, sections=48))
    whole = tl.simplify(mesh)
    assert len(whole) == 3
    module = sys.modules["topleft._meshes.lod.simplify"]
    n_calls = []

    def careless(points, triangles, n_wanted, *, with_pairs):
        found = collapse(points, triangles, n_wanted, with_pairs=with_pairs)
        n_calls.append(n_wanted)
        return found if len(n_calls) == 1 else found._replace(points=found.points + 5 * np.eye(len(found.points), 3))

    monkeypatch.setattr(module, "collapse", careless)
    levels = tl.simplify(mesh)
    assert len(n_calls) == 2
    assert [one.bound for one in levels] == [one.bound for one in whole[:2]]
