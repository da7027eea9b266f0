"""Arrays of other libraries are read where they lie, and refused with a sentence where the CPU cannot."""

import re

import numpy as np
import pytest

import topleft as tl

SQUARE = np.array([[0.0, 0], [4, 0], [4, 4], [0, 4]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


class Tensor:
    """Speaks DLPack alone, of memory on a device."""

    def __init__(self, array, device=1):
        self.array, self.device = array, device

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.device, 0


class Legacy:
    """Says what it is by `__array__` alone."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None, copy=None):
        return self.array


@pytest.mark.parametrize("kind", [Tensor, Legacy])
def test_verbs_take_what_speaks_dlpack_or_has_an_array(kind):
    colors = np.array([[9], [7]], np.uint8)
    vertices, triangles = kind(SQUARE), kind(HALVES)
    assert tl.coverage(vertices, triangles, (4, 4)).all()
    assert np.array_equal(tl.fill(vertices, triangles, kind(colors), (4, 4)), tl.fill(SQUARE, HALVES, colors, (4, 4)))
    frags = tl.rasterize(vertices, triangles, (4, 4))
    assert np.array_equal(frags.interpolate(kind(SQUARE)), frags.interpolate(SQUARE))
    mesh = tl.Mesh(kind(np.column_stack([SQUARE, SQUARE[:, 0]])), triangles, uv=kind(SQUARE / 4))
    assert np.array_equal(mesh.uv, SQUARE / 4)


@pytest.mark.parametrize("kind", [Tensor, Legacy])
def test_bad_index_of_a_tensor_names_the_row(kind):
    with pytest.raises(IndexError, match=re.escape("row 1 is [0, 2, 9]")):
        tl.coverage(SQUARE, kind(np.array([[0, 1, 2], [0, 2, 9]])), (4, 4))


@pytest.mark.parametrize(
    ("device", "where"),
    [(2, "CUDA device 0"), (8, "Metal device 0"), (10, "ROCm device 0"), (99, "DLPack device type 99 0")],
)
def test_tensor_elsewhere_is_refused_by_device(device, where):
    with pytest.raises(TypeError) as raised:
        tl.coverage(Tensor(SQUARE, device), HALVES, (4, 4))
    wish = "vertices must lie in the memory of the CPU"
    assert re.fullmatch(f"{wish}, got a [\\w.]*Tensor on {where}: copy it to the CPU", str(raised.value))


def test_array_that_refuses_to_become_one_is_a_type_error():
    class Strange(Legacy):
        def __array__(self, dtype=None, copy=None):
            raise RuntimeError("no such dtype")

    with pytest.raises(TypeError, match=r"vertices must be an array that NumPy can read, got a .*\(no such dtype\)"):
        tl.coverage(Strange(SQUARE), HALVES, (4, 4))


def test_tensors_of_torch_are_read_in_place():
    torch = pytest.importorskip("torch")
    from topleft._core.base.arrays import as_array

    tensor = torch.tensor(SQUARE)
    assert np.shares_memory(as_array("vertices", tensor), tensor.numpy())
    assert tl.coverage(tensor, torch.tensor(HALVES), (4, 4)).all()


def test_tensors_of_torch_are_refused_with_what_to_do():
    torch = pytest.importorskip("torch")
    for tensor, message in (
        (torch.tensor(SQUARE, requires_grad=True), "got a torch.Tensor that requires grad: pass vertices.detach()"),
        (torch.tensor(SQUARE, device="meta"), "must lie in the memory of the CPU, got a torch.Tensor elsewhere"),
        (torch.tensor(SQUARE).bfloat16(), "must be an array that NumPy can read, got a torch.Tensor"),
        (torch.tensor(SQUARE).to_sparse(), "must be an array that NumPy can read, got a torch.Tensor"),
    ):
        with pytest.raises(TypeError, match=re.escape(message)):
            tl.coverage(tensor, HALVES, (4, 4))


@pytest.mark.parametrize("module", ["jax.numpy", "array_api_strict"])
def test_arrays_of_the_array_api_are_taken(module):
    xp = pytest.importorskip(module)
    assert tl.coverage(xp.asarray(SQUARE), xp.asarray(HALVES), (4, 4)).all()


@pytest.mark.parametrize("kind", [Tensor, Legacy])
def test_rings_may_be_tensors(kind):
    hole = SQUARE / 2 + 1
    for given, expected in (
        (kind(SQUARE), SQUARE),
        ([kind(SQUARE), kind(hole)], [SQUARE, hole]),
        ([[kind(SQUARE)], [kind(hole)]], [[SQUARE], [hole]]),
        ((kind(np.concatenate([SQUARE, hole])), kind(np.array([0, 4, 8]))), [SQUARE, hole]),
    ):
        assert np.array_equal(tl.polygons(given, (4, 4)), tl.polygons(expected, (4, 4)))
    table = tl.overlap([kind(SQUARE)], (4, 4))
    assert table.sums(kind(np.ones((4, 4)))).tolist() == [16]
    assert table.spread(kind(np.array([2.0]))).sum() == 32
    values, background = kind(np.array([7], np.uint8)), kind(np.array(3))
    assert tl.polygons([kind(hole)], (4, 4), values=values, background=background)[0].tolist() == [3] * 4


@pytest.mark.parametrize("wrap", [lambda one: one, lambda one: [one], lambda one: [[one]]], ids=["it", "list", "lists"])
def test_rings_elsewhere_are_refused_by_device(wrap):
    with pytest.raises(TypeError, match=r"rings must lie in the memory of the CPU, got a \S*Tensor on CUDA device 0"):
        tl.polygons(wrap(Tensor(SQUARE, 2)), (4, 4))


def test_list_of_tensors_elsewhere_is_refused_by_device():
    class Cupy(Tensor):
        def __array__(self, dtype=None, copy=None):
            raise TypeError("Implicit conversion to a NumPy array is not allowed")

    with pytest.raises(TypeError, match=r"vertices must lie in the memory of the CPU, got a \S*Cupy on CUDA device 0"):
        tl.coverage([Cupy(SQUARE, 2)], HALVES, (4, 4))


def masked(array, *where):
    given = np.ma.array(array)
    given[where] = np.ma.masked
    return given


def test_masked_values_of_a_field_leave_their_triangles_out():
    assert np.array_equal(
        tl.field((SQUARE, HALVES), masked([1.0, 2, 3, 1e20], 3), (4, 4)),
        tl.field((SQUARE, HALVES), [1, 2, 3, np.nan], (4, 4)),
        equal_nan=True,
    )


def test_masked_vertices_count_where_triangles_use_them():
    assert tl.coverage(masked(SQUARE, 3), HALVES[:1], (4, 4)).sum() == 10
    with pytest.raises(ValueError, match=r"must be finite where a triangle uses them, got \[nan, nan\] in row 3"):
        tl.coverage(masked(SQUARE, 3), HALVES, (4, 4))


def test_masked_integers_are_refused():
    with pytest.raises(ValueError, match="triangles must not be masked, having no NaN, got int64 with 3 masked"):
        tl.coverage(SQUARE, masked(HALVES, 1), (4, 4))


def test_masked_array_without_masked_entries_is_an_array():
    assert np.array_equal(
        tl.coverage(SQUARE, np.ma.array(HALVES, mask=np.zeros((2, 3))), (4, 4)), tl.coverage(SQUARE, HALVES, (4, 4))
    )
