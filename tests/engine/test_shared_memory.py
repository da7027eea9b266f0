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


CORNERS = [[0, 1, 2]]
COLORS = np.array([[200, 10, 20, 255], [1, 2, 3, 255]], np.uint8)
DEEP = np.column_stack([VERTICES / 3, [0, 0, 0]])
RING = np.array([[3, 3], [60, 5], [50, 60], [7, 40]], np.float32)
SIX = np.random.default_rng(0).uniform(0, 64, (6, 2))
STRIP = np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 5]], np.int32)
#: What `out` is, an input that lies at its beginning, and what is drawn of it.
INTO_INPUTS = {
    "fill, triangles": (np.zeros((128, 128, 4), np.uint8), np.tile(np.int32(CORNERS), (16, 1)), lambda triangles, out:
                        tl.fill(VERTICES, triangles, np.full((16, 4), 112, "u1"), SIZE, per="triangle", blend="over",
                                out=out)),
    "fill, colors": (np.zeros((128, 128, 4), np.uint8), COLORS, lambda colors, out:
                     tl.fill(VERTICES, CORNERS * 2, colors, SIZE, per="triangle", out=out)),
    **{f"overdraw by {method}": (np.zeros((128, 128), np.int32), np.tile(np.int32(CORNERS), (1000, 1)),
                                 lambda triangles, out, method=method:
                                 tl.overdraw(VERTICES, triangles, SIZE, method=method, out=out))
       for method in ("auto", "edge", "float_barycentric")},
    "overdraw, vertices": (np.zeros((128, 128), np.int32), VERTICES, lambda vertices, out:
                           tl.overdraw(vertices, CORNERS, SIZE, out=out)),
    "wireframe, depth": (np.zeros((128, 128), np.float32), np.full((128, 128), np.inf, np.float32), lambda depth, out:
                         tl.wireframe(DEEP, CORNERS, SIZE, depth=depth, antialias=True, out=out)),
    "polygons, points": (np.zeros((64, 64), np.float32), RING, lambda points, out:
                         tl.polygons(points, (64, 64), sampling="area", out=out)),
    "polygons, offsets": (np.zeros((64, 64), np.int32), np.array([0, 4]), lambda offsets, out:
                          tl.polygons((RING, offsets), (64, 64), values="index", out=out)),
    "field, triangles": (np.zeros((64, 64)), STRIP, lambda triangles, out:
                         tl.field((SIX, triangles), np.arange(6.0), (64, 64), out=out)),
    "field, values": (np.zeros((64, 64)), np.arange(6.0), lambda values, out:
                      tl.field((SIX, STRIP), values, (64, 64), out=out)),
}  # fmt: skip


@pytest.mark.parametrize("name", INTO_INPUTS)
def test_picture_into_memory_of_an_input_is_that_of_separate_memory(name):
    out, given, draw = INTO_INPUTS[name]
    inside = out.reshape(-1).view(np.uint8)[: given.nbytes].view(given.dtype).reshape(given.shape)
    inside[...] = given
    expected = draw(given, out.copy())
    assert np.array_equal(draw(inside, out), expected, equal_nan=expected.dtype.kind == "f")


def test_wireframe_of_a_depth_at_an_odd_address_is_that_of_an_aligned_one():
    odd = np.zeros(4 * 128 * 128 + 1, np.uint8)[1:].view(np.float32).reshape(128, 128)
    scene = DEEP + [0, 0, 1], CORNERS
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


def test_polygons_of_offsets_at_an_odd_address_are_those_of_aligned_ones():
    odd = np.zeros(17, np.uint8)[1:].view(np.int64)
    odd[...] = [0, 4]
    assert_same(tl.polygons((RING, odd), (64, 64)), tl.polygons(RING, (64, 64)))


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
