"""Mesh: what it accepts, its normals, and vertices that are the same place."""

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, on

from topleft._core import engine
from topleft._meshes.model import mesh as mesh_module
from topleft._meshes.model.joined import joined
from topleft._meshes.model.mesh import Mesh, coincident

TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("given", "kept"),
    [("f4", "f4"), ("f8", "f8"), (">f4", "f4"), (">f8", "f8"), ("f2", "f8"), ("i8", "f8"), ("u1", "f8")],
)
def test_mesh_vertices_keep_float32_and_float64(given, kept):
    mesh = Mesh(np.array(TRIANGLE, dtype=given), [[0, 1, 2]])
    assert mesh.vertices.dtype == np.dtype(kept)
    assert mesh.vertices.dtype.isnative
    assert mesh.vertices.tolist() == TRIANGLE


@pytest.mark.parametrize("dtype", ["u1", "i2", ">i4", "i8", "u8"])
def test_mesh_triangles_of_any_integers_become_int32(dtype):
    mesh = Mesh(TRIANGLE, np.array([[2, 1, 0]], dtype=dtype))
    assert mesh.triangles.dtype == np.int32
    assert mesh.triangles.tolist() == [[2, 1, 0]]


def test_mesh_arrays_are_read_only_and_the_callers_are_not():
    vertices = np.array(TRIANGLE, dtype=float)
    mesh = Mesh(vertices, [[0, 1, 2]])
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 1
    vertices[0, 0] = 1


def test_mesh_without_triangles_is_a_mesh():
    assert Mesh(np.empty((0, 3)), []).triangles.shape == (0, 3)


def test_mesh_unused_vertex_may_be_nan():
    mesh = Mesh([*TRIANGLE, [np.nan, 0, 0]], [[0, 1, 2]])
    assert mesh.bounds.tolist() == [[0, 0, 0], [1, 1, 0]]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (([[0, 0]], [[0, 0, 0]]), ValueError, r"vertices must have shape \(V, 3\), got \(1, 2\)"),
        ((["abc"], [[0, 0, 0]]), TypeError, "vertices must hold real numbers"),
        ((TRIANGLE, [[0, 1]]), ValueError, r"triangles must have shape \(T, 3\), got \(1, 2\)"),
        ((TRIANGLE, [[0.0, 1.0, 2.0]]), TypeError, "triangles must be integers, got dtype float64"),
        ((TRIANGLE, [[0, 1, 2], [0, 1, 3]]), IndexError, r"row 1 is \[0, 1, 3\]"),
        ((TRIANGLE, [[0, -1, 2]]), IndexError, r"row 0 is \[0, -1, 2\]"),
        (([[0, 0, 0], [0, np.inf, 0], [1, 1, 1]], [[2, 1, 0]]), ValueError, r"vertices\[1\] = \[0.0, inf, 0.0\] must"),
        ((TRIANGLE, [[0, 1, 2]], [[0, 0, 1]]), ValueError, r"normals must have shape \(3, 3\), got \(1, 3\)"),
        ((TRIANGLE, [[0, 1, 2]], None, [[0, 0, 0]]), TypeError, "colors must be uint8, got int64"),
        ((TRIANGLE, [[0, 1, 2]], None, np.zeros((2, 3), np.uint8)), ValueError,
         r"colors must have shape \(3, 3\) or \(3, 4\), got \(2, 3\)"),
    ],
)  # fmt: skip
def test_mesh_of_bad_arrays_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        Mesh(*arguments)


def test_bounds_without_triangles_is_refused():
    with pytest.raises(ValueError, match="a mesh without triangles has no bounds"):
        _ = Mesh(TRIANGLE, []).bounds


def test_vertex_normals_of_the_mesh_win():
    normals = [[0.0, 0, 2], [0, 0, 1], [0, 0, 1]]
    assert Mesh(TRIANGLE, [[0, 1, 2]], normals).vertex_normals().tolist() == normals


def test_coincident_groups_equal_rows_in_order_of_first_sight():
    first, group = coincident(np.array([[1.0, 2], [0, 0], [1, 2], [-0.0, 0]]))
    assert first.tolist() == [0, 1]
    assert group.tolist() == [0, 1, 0, 1]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("others", [[], [np.uint8, 4], [np.uint8, 3], [np.float32, 2]])
def test_coincident_by_hash_and_by_value_is_the_same(monkeypatch, dtype, others):
    rng = np.random.default_rng(5)
    rows = [rng.integers(-2, 3, (900, 3)).astype(dtype) * dtype(0.1)]
    if others:
        rows.append(rng.integers(0, 2, (900, others[1])).astype(others[0]))
    by_hash = coincident(*rows)
    monkeypatch.setattr(mesh_module, "_groups_by_hash", lambda _: None)
    by_value = coincident(*rows)
    assert len(by_value[0]) == len(np.unique(np.concatenate(rows, axis=1), axis=0))
    assert all(np.array_equal(one, other) for one, other in zip(by_hash, by_value, strict=True))


def test_coincident_rows_that_are_no_numbers_are_each_a_group():
    rows = np.array([[np.nan, 0], [1, 2], [np.nan, 0], [1, 2]])
    first, group = coincident(rows)
    assert first.tolist() == [0, 1, 2]
    assert group.tolist() == [0, 1, 2, 1]


@ON_EACH_ISA
def test_group_rows_gives_up_where_too_many_hashes_meet(isa):
    with on(isa):
        n = 40_000
        rows = np.arange(n, dtype=np.uint32)[:, None]
        first, group = np.empty((2, n), np.int32)
        table = np.full(1 << 17, -1, np.int32)
        assert engine.group_rows(rows, 17, table, first, group) == n
        assert group.tolist() == list(range(n))
        table = np.full(1 << 17, -1, np.int32)
        table[:] = 0  # as if all places were taken by row 0
        table[-1] = -1
        assert engine.group_rows(rows, 17, table, first, group) == -1


def test_coincident_of_nothing_is_empty():
    assert [len(part) for part in coincident(np.empty((0, 3)))] == [0, 0]


def test_parts_with_and_without_normals_are_joined_with_those_of_their_crease():
    """Two squares at a right angle, of which one says its normals."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float64)
    told = Mesh(square, [(0, 1, 2), (0, 2, 3)], normals=np.tile([1.0, 0, 0], (4, 1)))
    bent = Mesh(np.concatenate([square + 5, square[:, [0, 2, 1]] + 5]), [(0, 1, 2), (0, 2, 3), (4, 6, 5), (4, 7, 6)])
    mesh = joined([told, bent], 30.0)
    found = mesh.normals[mesh.triangles]
    assert found[:2].tolist() == [[[1, 0, 0]] * 3] * 2
    assert found[2:4].tolist() == [[[0, 0, 1]] * 3] * 2
    assert np.abs(found[4:]).tolist() == [[[0, 1, 0]] * 3] * 2
