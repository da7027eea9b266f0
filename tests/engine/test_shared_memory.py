"""Memory that is given twice, or that changes: `out` over inputs, meshes whose arrays their owner changes, threads."""

import copy
import dataclasses
import pickle
import threading
import time

import numpy as np
import pytest
from comparing import assert_same

import topleft as tl
from topleft import scenes
from topleft._apps.tiles.dask_array import WindowJob

SIZE = (128, 128)
VERTICES = np.array([[-10.0, -10], [300, -10], [-10, 300]])


def test_fill_into_memory_of_triangles_is_that_of_separate_memory():
    out = np.zeros((128, 128, 4), np.uint8)
    triangles = out.reshape(-1)[:192].view(np.int32).reshape(16, 3)
    triangles[...] = [0, 1, 2]
    colors = np.full((16, 4), 0x70, np.uint8)
    before = out.copy()
    expected = tl.fill(VERTICES, triangles.copy(), colors, SIZE, per="triangle", blend="over", out=before)
    assert_same(tl.fill(VERTICES, triangles, colors, SIZE, per="triangle", blend="over", out=out), expected)


def test_fill_into_memory_of_colors_is_that_of_separate_memory():
    out = np.zeros((128, 128, 4), np.uint8)
    colors = out.reshape(-1, 4)[:2]
    colors[...] = [[200, 10, 20, 255], [1, 2, 3, 255]]
    expected = tl.fill(VERTICES, [[0, 1, 2]] * 2, colors.copy(), SIZE, per="triangle", out=out.copy())
    assert_same(tl.fill(VERTICES, [[0, 1, 2]] * 2, colors, SIZE, per="triangle", out=out), expected)


@pytest.mark.parametrize("method", ["auto", "edge", "float_barycentric"])
def test_overdraw_into_memory_of_triangles_is_that_of_separate_memory(method):
    out = np.zeros((128, 128), np.int32)
    triangles = out.reshape(-1)[: 3 * 1000].reshape(1000, 3)
    triangles[...] = [0, 1, 2]
    expected = tl.overdraw(VERTICES, triangles.copy(), SIZE, method=method)
    assert_same(tl.overdraw(VERTICES, triangles, SIZE, method=method, out=out), expected)


def test_overdraw_into_memory_of_vertices_is_that_of_separate_memory():
    out = np.zeros((128, 128), np.int32)
    vertices = out.reshape(-1)[:12].view(np.float64).reshape(3, 2)
    vertices[...] = VERTICES
    assert_same(tl.overdraw(vertices, [[0, 1, 2]], SIZE, out=out), tl.overdraw(VERTICES, [[0, 1, 2]], SIZE))


def test_wireframe_into_memory_of_its_depth_is_that_of_separate_memory():
    depth = np.full((128, 128), np.inf, np.float32)
    scene = np.column_stack([VERTICES / 3, [0, 0, 0]]), [[0, 1, 2]]
    expected = tl.wireframe(*scene, SIZE, depth=depth.copy(), antialias=True)
    assert_same(tl.wireframe(*scene, SIZE, depth=depth, antialias=True, out=depth), expected)


def test_wireframe_of_a_depth_at_an_odd_address_is_that_of_an_aligned_one():
    odd = np.zeros(4 * 128 * 128 + 1, np.uint8)[1:].view(np.float32).reshape(128, 128)
    scene = np.column_stack([VERTICES / 3, [1, 1, 1]]), [[0, 1, 2]]
    assert_same(tl.wireframe(*scene, SIZE, depth=odd), tl.wireframe(*scene, SIZE, depth=odd.copy()))


def shared_mesh():
    vertices, triangles = scenes.blob(20_000)
    triangles = triangles.astype(np.int32)
    return tl.Mesh(vertices, triangles), triangles


@pytest.mark.parametrize("n_before", [0, 1, 2, 3])
def test_a_mesh_does_not_see_what_becomes_of_the_triangles_it_was_made_of(n_before):
    mesh, triangles = shared_mesh()
    camera = tl.Camera.framing(mesh)
    expected = tl.rasterize_mesh(mesh, camera, (64, 48)).barycentric()
    for k in range(4):
        if k == n_before:
            triangles[:] = 10**8
        assert_same(tl.rasterize_mesh(mesh, camera, (64, 48)).barycentric(), expected)
    assert len(mesh.clusters.of_triangles()) == len(triangles)
    assert_same(mesh.vertex_normals(), tl.Mesh(*scenes.blob(20_000)).vertex_normals())


def test_a_mesh_shares_triangles_that_nobody_can_write_to():
    vertices, triangles = scenes.shape("cube")
    triangles = triangles.astype(np.int32)
    view = triangles.view()
    view.flags.writeable = False
    assert not np.shares_memory(tl.Mesh(vertices, view).triangles, triangles)  # the owner can
    triangles.flags.writeable = False
    mesh = tl.Mesh(vertices, view)
    assert np.shares_memory(mesh.triangles, triangles)
    assert np.shares_memory(dataclasses.replace(mesh, crease=30.0).triangles, triangles)


def test_a_mesh_does_not_see_what_becomes_of_the_rows_of_its_materials():
    vertices, triangles = scenes.shape("cube")
    rows = np.zeros(len(triangles), np.int32)
    mesh = tl.Mesh(vertices, triangles, materials=[tl.Material()], material_of_triangle=rows)
    rows[:] = 10**8
    assert not mesh.material_of_triangle.any()


@pytest.mark.parametrize("through", [copy.deepcopy, lambda mesh: pickle.loads(pickle.dumps(mesh))])
def test_a_copy_of_a_mesh_is_read_only_as_the_mesh(through):
    mesh = tl.Mesh(*scenes.shape("cube"))
    again = through(mesh)
    assert_same(again.vertices, mesh.vertices)
    assert not (again.vertices.flags.writeable)
    assert not (again.triangles.flags.writeable)


HOLDERS = {
    "texture": tl.Texture(np.zeros((2, 2, 4), np.uint8)),
    "camera": tl.Camera.framing(tl.Mesh(*scenes.shape("cube"))),
    "instance": tl.Instance(tl.Mesh(*scenes.shape("cube")), np.eye(4)),
    "points": tl.Points([[0.0, 0, 0]], colors=np.uint8([[1, 2, 3]]), size=[2.0]),
    "environment": tl.Environment(image=np.zeros((4, 8, 3), np.uint8)),
}


@pytest.mark.parametrize("through", [copy.copy, copy.deepcopy, lambda holder: pickle.loads(pickle.dumps(holder))])
@pytest.mark.parametrize("name", HOLDERS)
def test_a_copy_of_what_holds_arrays_is_read_only_as_it_was(name, through):
    arrays = [value for value in vars(through(HOLDERS[name])).values() if isinstance(value, np.ndarray)]
    assert arrays
    assert not any(array.flags.writeable for array in arrays)


@pytest.mark.parametrize("through", [copy.deepcopy, lambda frags: pickle.loads(pickle.dumps(frags))])
def test_a_copy_of_scene_fragments_whose_parts_were_asked_for_shows_the_same(through):
    mesh = tl.Mesh(*scenes.shape("cube"))
    scene = tl.Scene([mesh, tl.Instance(mesh, np.diag([0.5, 2, 0.5, 1]))])
    frags = tl.rasterize_mesh(scene, tl.Camera.framing(mesh), SIZE)
    weights = frags.barycentric()
    again = through(frags)
    assert_same(again.triangle, frags.triangle)
    assert_same(again.barycentric(), weights)


def test_rasterizer_in_two_threads_is_refused():
    rasterizer, refused = tl.Rasterizer(SIZE, threads=1), []
    few, many = [[0, 1, 2]], np.tile(np.array([[0, 1, 2]], np.int32), (20_000, 1))
    latest = time.monotonic() + 60

    def draw():
        while not refused and time.monotonic() < latest:  # until both draw at a time
            try:
                rasterizer.overdraw(VERTICES, many)
            except RuntimeError as error:
                refused.append(str(error))

    others = [threading.Thread(target=draw) for _ in range(2)]
    for thread in others:
        thread.start()
    for thread in others:
        thread.join()
    assert refused == ["a Rasterizer draws one picture at a time, and this one draws: give each thread its own"]
    assert rasterizer.overdraw(VERTICES, few).max() == 1


def test_rasterizer_after_an_error_draws_on():
    rasterizer = tl.Rasterizer(SIZE)
    with pytest.raises(IndexError):
        rasterizer.coverage(VERTICES, [[0, 1, 3]])
    assert rasterizer.coverage(VERTICES, [[0, 1, 2]]).any()


@pytest.mark.parametrize("through", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_a_copy_of_a_rasterizer_has_memory_of_its_own(through):
    one = tl.Rasterizer(SIZE, threads=1)
    picture = one.coverage(VERTICES, [[0, 1, 2]])
    other = through(one)
    assert (other.size, other.threads) == (SIZE, 1)
    other.coverage(VERTICES, np.empty((0, 3), np.int32))
    assert picture.any()


@pytest.mark.parametrize("draw", [tl.rasterize, tl.peel])
def test_what_was_drawn_is_not_pickled_and_says_what_to_take(draw):
    drawn = draw(np.column_stack([VERTICES, [1, 1, 1]]), [[0, 1, 2]], SIZE)
    with pytest.raises(TypeError, match=r"refers to memory of this process .* take its arrays, such as .triangle"):
        pickle.dumps(drawn)


def test_polygons_into_memory_of_their_points_are_those_of_separate_memory():
    out = np.zeros((64, 64), np.float32)
    points = out.reshape(-1)[:8].reshape(4, 2)
    points[...] = [[3, 3], [60, 5], [50, 60], [7, 40]]
    expected = tl.polygons(points.copy(), (64, 64), sampling="area")
    assert_same(tl.polygons(points, (64, 64), sampling="area", out=out), expected)


def test_polygons_into_memory_of_their_offsets_are_those_of_separate_memory():
    out = np.zeros((64, 64), np.int32)
    offsets = out.reshape(-1)[:4].view(np.int64)
    offsets[...] = [0, 4]
    points = np.array([[3.0, 3], [60, 5], [50, 60], [7, 40]])
    expected = tl.polygons((points, offsets.copy()), (64, 64), values="index")
    assert_same(tl.polygons((points, offsets), (64, 64), values="index", out=out), expected)


def test_polygons_of_offsets_at_an_odd_address_are_those_of_aligned_ones():
    odd = np.zeros(17, np.uint8)[1:].view(np.int64)
    odd[...] = [0, 4]
    points = np.array([[3.0, 3], [60, 5], [50, 60], [7, 40]])
    assert_same(tl.polygons((points, odd), (64, 64)), tl.polygons(points, (64, 64)))


@pytest.mark.parametrize("name", ["triangles", "values"])
def test_field_into_memory_of_its_inputs_is_that_of_separate_memory(name):
    out = np.zeros((64, 64))
    triangles = out.reshape(-1)[:6].view(np.int32)[:12].reshape(4, 3)
    values = out.reshape(-1)[64:70]
    points = np.random.default_rng(0).uniform(0, 64, (6, 2))
    triangles[...], values[...] = [[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 5]], range(6)
    given = {"triangles": triangles.copy(), "values": values.copy()}
    expected = tl.field((points, given["triangles"]), given["values"], (64, 64))
    given[name] = triangles if name == "triangles" else values
    assert_same_or_nan(tl.field((points, given["triangles"]), given["values"], (64, 64), out=out), expected)


def assert_same_or_nan(got, expected):
    assert np.array_equal(got, expected, equal_nan=True)


@pytest.mark.parametrize("wrong", [1, 10**8])
def test_slopes_of_ids_that_their_owner_has_changed_are_refused(wrong):
    frags = tl.rasterize([[0.0, 0, 0], [8, 0, 1], [0, 8, 0]], [[0, 1, 2]], (8, 8))
    frags.triangle[2, 2] = wrong
    with pytest.raises(IndexError, match=f"triangle must hold ids below 1, got {wrong}"):
        frags.interpolate(np.zeros((3, 2)), derivatives=True)


def moved(value):
    """What another process makes of an object when the bytes of its arrays arrive at odd addresses, as Dask's do."""
    sent = []
    words = pickle.dumps(value, protocol=5, buffer_callback=sent.append)
    parts = []
    for part in sent:
        at = np.zeros(part.raw().nbytes + 1, np.uint8)[1:]
        at[:] = np.frombuffer(part.raw(), np.uint8)
        parts.append(pickle.PickleBuffer(at))
    assert parts
    return pickle.loads(words, buffers=parts)


def arrays_of(value):
    """The arrays that an object holds, also in what it consists of."""
    held, seen = [value], set()
    for each in held:
        if id(each) in seen:
            continue
        seen.add(id(each))
        if isinstance(each, dict):
            held += each.values()
        elif isinstance(each, tuple | list):
            held += each
        elif type(each).__module__.startswith("topleft") and hasattr(each, "__dict__"):
            held += vars(each).values()
    return [each for each in held if isinstance(each, np.ndarray)]


KNOT = tl.Mesh(*scenes.shape("torus-knot"))
SEEN = tl.Camera.framing(KNOT)
SENT = {
    "Mesh": KNOT,
    "Camera": SEEN,
    "Texture": tl.Texture(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)),
    "Environment": tl.Environment(image=np.arange(48.0).reshape(4, 4, 3) / 48),
    "Points": tl.Points(VERTICES.repeat(2, 1)[:, :3]),
    "Scene": tl.Scene([KNOT, (KNOT, np.eye(4))]),
    "SceneFragments": tl.rasterize_mesh(tl.Scene([KNOT, KNOT]), SEEN, (40, 30)),
}


@pytest.mark.parametrize("name", SENT)
def test_what_is_received_at_odd_addresses_is_aligned(name):
    arrays = arrays_of(moved(SENT[name]))
    assert arrays
    assert all(array.flags.aligned for array in arrays)


def test_a_mesh_that_is_received_at_odd_addresses_is_drawn_alike():
    assert_same(tl.render(moved(KNOT), SEEN, (80, 60)), tl.render(KNOT, SEEN, (80, 60)))


FLAT = np.random.default_rng(5).random((60, 2)) * 50, np.random.default_rng(6).integers(0, 60, (90, 3))


@pytest.mark.parametrize("is_mapped", [False, True])
@pytest.mark.parametrize("kind", ["coverage", "overdraw", "field", "fill"])
def test_a_window_that_is_received_at_odd_addresses_is_drawn_alike(kind, is_mapped, tmp_path):
    values = {"field": np.arange(60.0), "fill": np.arange(360, dtype=np.uint8).reshape(90, 4)}.get(kind)
    mesh = FLAT
    if is_mapped:
        for name, array in zip(("v.npy", "t.npy"), FLAT, strict=True):
            np.save(tmp_path / name, array)
        mesh = tmp_path / "v.npy", tmp_path / "t.npy"
    options = {"per": "triangle"} if kind == "fill" else {"extent": (0, 50, 0, 50)} if kind == "field" else {}
    raster = tl.tiles(mesh, (50, 50), values=values, kind=kind, window=32, **options)
    job = moved(WindowJob(raster, 1, 0))
    assert_same(np.nan_to_num(job(), nan=-1), np.nan_to_num(raster[32:, :32], nan=-1))
    held = arrays_of(job.payload if hasattr(job, "payload") else job.triangles)
    assert all(array.flags.aligned for array in held)
