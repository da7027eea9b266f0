"""Meshes of any size: files that are mapped, blocks, the index of windows."""

import pickle
import struct

import numpy as np
import pytest

import topleft as tl
from topleft._meshes.windows import blocks as blocks_file
from topleft._meshes.windows.blocks import open_triangles

RNG = np.random.default_rng(5)
POINTS = RNG.uniform(0, 100, (300, 3)).astype(np.float32)
TRIANGLES = RNG.integers(0, 300, (500, 3)).astype(np.int32)
WHOLE = tl.rasterize(POINTS, TRIANGLES, 100).triangle


@pytest.fixture
def small_blocks(monkeypatch):
    """Blocks of 50 triangles instead of 131,072."""
    monkeypatch.setattr(blocks_file, "BLOCK", 50)
    monkeypatch.setattr("topleft._meshes.windows.spans.BLOCK", 50)
    monkeypatch.setattr("topleft._meshes.windows.raster.BLOCK", 50)


def write_stl(path, corners, n=None, header=b"made by a test"):
    rows = np.zeros(len(corners), np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("rest", "<u2")]))
    rows["corners"] = corners.reshape(-1, 9)
    n = len(corners) if n is None else n
    path.write_bytes(header.ljust(80, b" ") + struct.pack("<I", n) + rows.tobytes())


def write_ply(path, order="<", kind="float", count="uchar", extra=False, faces=TRIANGLES):
    name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    more = "property uchar red\n" if extra else ""
    header = (
        f"ply\nformat {name} 1.0\nelement vertex {len(POINTS)}\nproperty {kind} x\nproperty {kind} y\n"
        f"{more}property {kind} z\nelement face {len(faces)}\nproperty list {count} int vertex_indices\n"
        f"{more}end_header\n"
    )
    number = {"float": "f4", "double": "f8"}[kind]
    fields = [("x", order + number), ("y", order + number), *([("red", "u1")] if extra else []), ("z", order + number)]
    vertices = np.zeros(len(POINTS), np.dtype(fields))
    vertices["x"], vertices["y"], vertices["z"] = POINTS.T
    kinds = {"uchar": "u1", "int": order + "i4"}[count]
    rows = np.zeros(len(faces), np.dtype([("n", kinds), ("v", order + "i4", 3), *([("red", "u1")] if extra else [])]))
    rows["n"], rows["v"] = 3, faces
    path.write_bytes(header.encode() + vertices.tobytes() + rows.tobytes())


def test_npy_pairs_are_mapped(tmp_path, small_blocks):
    paths = tmp_path / "v.npy", tmp_path / "t.npy"
    np.save(paths[0], POINTS)
    np.save(paths[1], TRIANGLES.astype(np.int64))
    raster = tl.tiles(paths, (100, 100), window=32)
    assert np.array_equal(raster[:], WHOLE)
    assert raster.is_mapped
    again = pickle.loads(pickle.dumps(raster.triangles))
    assert len(pickle.dumps(raster.triangles)) < 2000
    assert np.array_equal(again.corners(slice(7, 11)), POINTS[TRIANGLES[7:11]])


@pytest.mark.parametrize("axis", [0, 1])
def test_blocks_that_reach_a_few_windows_are_the_whole(small_blocks, axis):
    """Triangles that are sorted by place: most blocks have none in most rows of windows."""
    corners = np.random.default_rng(2).uniform(0, 1000, (500, 1, 2)) + RNG.uniform(-9, 9, (500, 3, 2))
    corners = corners[np.argsort(corners[:, 0, axis])].reshape(-1, 2)
    triangles = np.arange(1500).reshape(500, 3)
    assert np.array_equal(tl.tiles((corners, triangles), 1000, window=64)[:], tl.rasterize(corners, triangles, 1000).id)


@pytest.mark.parametrize("options", [{}, {"order": ">"}, {"kind": "double"}, {"count": "int"}, {"extra": True}])
def test_binary_ply_is_mapped(tmp_path, options):
    path = tmp_path / "mesh.ply"
    write_ply(path, **options)
    raster = tl.tiles(path, (100, 100), window=32)
    assert raster.is_mapped
    assert np.array_equal(raster[:], WHOLE)
    again = pickle.loads(pickle.dumps(raster.triangles))
    assert np.array_equal(again.corners(slice(7, 11)), POINTS[TRIANGLES[7:11]])


def test_numbers_side_by_side_are_rows_of_the_file(tmp_path):
    for order, extra, n_columns in (("<", False, 1), ("<", True, 3)):
        write_ply(tmp_path / "mesh.ply", order=order, extra=extra)
        triangles = open_triangles(tmp_path / "mesh.ply", None)
        assert len(triangles.columns) == n_columns
        assert np.array_equal(triangles.corners(np.array([499, 0], np.int32)), POINTS[TRIANGLES[[499, 0]]])


@pytest.mark.parametrize("dtype", [np.uint16, np.int32, np.uint32, np.int64, ">i4"])
@pytest.mark.parametrize("kind", [np.float32, np.float64, np.int64, np.float16, ">f8"])
@pytest.mark.parametrize("is_reversed", [False, True])
def test_corners_are_those_of_numpy(dtype, kind, is_reversed):
    points, triangles = (50 * POINTS).astype(kind), TRIANGLES.astype(dtype)
    if is_reversed:
        points, triangles = points[::-1, :2], np.asfortranarray(triangles[::-2])
    mesh = open_triangles((points, triangles), None)
    which = np.array([3, 1, 249], np.int32)
    assert np.array_equal(mesh.corners(which), points[triangles[which]])
    assert np.array_equal(mesh.corners(slice(17, 91)), points[triangles[17:91]])
    assert mesh.corners(slice(5, 5)).shape == (0, 3, points.shape[1])


def test_binary_stl_is_mapped(tmp_path):
    path = tmp_path / "mesh.stl"
    write_stl(path, POINTS[TRIANGLES], header=b"solid in name alone")
    raster = tl.tiles(path, (100, 100), window=32)
    assert raster.is_mapped
    assert np.array_equal(raster[:], WHOLE)
    again = pickle.loads(pickle.dumps(raster.triangles))
    assert np.array_equal(again.corners(np.array([3, 5], np.int32)), POINTS[TRIANGLES[[3, 5]]])
    assert np.array_equal(again.indices(slice(1, 3)), [[3, 4, 5], [6, 7, 8]])


def test_broken_files_are_told(tmp_path):
    path = tmp_path / "mesh.stl"
    write_stl(path, POINTS[TRIANGLES], n=501)
    with pytest.raises(tl.MeshError, match=r"cannot read .*mesh\.stl: it has 500 of 501 triangles"):
        tl.tiles(path, 100)
    ply = tmp_path / "mesh.ply"
    write_ply(ply)
    ply.write_bytes(ply.read_bytes()[:1000])
    with pytest.raises(tl.MeshError, match="it ends within its 300 rows of vertex"):
        tl.tiles(ply, 100)
    (tmp_path / "v.npy").write_bytes(b"nothing")
    with pytest.raises(tl.MeshError, match="cannot read"):
        tl.tiles((tmp_path / "v.npy", tmp_path / "v.npy"), 100)


def test_files_that_cannot_be_mapped_are_loaded(tmp_path):
    path = tmp_path / "mesh.obj"
    rows = [f"v {x} {y} {z}" for x, y, z in POINTS.tolist()] + [
        f"f {a} {b} {c}" for a, b, c in (TRIANGLES + 1).tolist()
    ]
    path.write_text("\n".join(rows))
    assert np.array_equal(tl.tiles(path, (100, 100), window=64)[:] >= 0, WHOLE >= 0)


def test_blocks_of_an_iterator_are_one_mesh(tmp_path):
    def blocks():
        for first in range(0, 500, 70):
            yield POINTS, TRIANGLES[first : first + 70]

    raster = tl.tiles(blocks(), (100, 100), window=32, folder=tmp_path)
    assert np.array_equal(raster[:], WHOLE)
    assert len(list(tmp_path.iterdir())) == 1
    del raster
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("second", "error", "message"),
    [
        ((POINTS[:3], [[0, 1, 3]]), IndexError, "block 1: triangles must hold indices in"),
        ((POINTS[:3].astype(np.float64), [[0, 1, 2]]), ValueError, r"block 1: vertices must be float32 \(V, 3\)"),
        (POINTS[:3], TypeError, r"blocks must be pairs \(vertices, triangles\), got"),
        ((POINTS[:3], [[0.5, 1, 2]]), TypeError, "block 1: triangles must be integers"),
    ],
)
def test_wrong_blocks_are_told(tmp_path, second, error, message):
    with pytest.raises(error, match=message):
        tl.tiles(iter([(POINTS, TRIANGLES), second]), 100, folder=tmp_path)


@pytest.mark.parametrize("memory", [1, 2000, 1 << 20])
@pytest.mark.parametrize("window", [5, (100, 3), (3, 100)])
def test_index_is_the_same_in_a_file(memory, window, small_blocks):
    raster = tl.tiles((POINTS, TRIANGLES), (100, 100), window=window, memory=memory)
    assert np.array_equal(raster[20:60, 30:90], WHOLE[20:60, 30:90])
    assert raster.index.is_on_disk is (memory < 1 << 20)


def test_index_lists_long_triangles_along_their_way():
    """A sliver across 100 x 100 windows touches a few windows of each row of them."""
    points = np.array([[0.0, 0.0], [1000, 999], [1000, 1000]])
    raster = tl.tiles((points, [[0, 1, 2]]), (1000, 1000), window=10)
    assert raster.index.n_spans == 100
    assert 190 <= raster.index.counts.sum() <= 400
    assert np.array_equal(raster[:], tl.rasterize(points, [[0, 1, 2]], 1000).triangle)


def test_index_lists_what_touches_a_window_in_order():
    raster = tl.tiles((POINTS, TRIANGLES), (100, 100), window=25)
    for row in range(4):
        for column in range(4):
            found = raster.index.of_window(row, column)
            assert (np.diff(found) > 0).all()
            assert len(found) == raster.index.counts[row, column]
            own = np.unique(WHOLE[25 * row : 25 * row + 25, 25 * column : 25 * column + 25])
            assert set(own[own >= 0]) <= set(found.tolist())


@pytest.mark.parametrize("kind", ["labels", "coverage", "height_map"])
def test_vertex_that_is_no_number_is_told_with_its_block(kind, small_blocks):
    points = POINTS.copy()
    points[TRIANGLES[413, 1]] = np.nan
    first = int(np.argmax((TRIANGLES == TRIANGLES[413, 1]).any(axis=1)))
    raster = tl.tiles((points, TRIANGLES), pixel_size=1.0, extent=(0, 100, 0, 100), kind=kind, window=32)
    with pytest.raises(
        ValueError, match=f"vertices must be finite where a triangle uses them, got .* in triangle {first}, block"
    ):
        raster[:]


def test_vertex_too_far_away_is_told_with_its_block():
    points = [[0.0, 0.0], [1e30, 0], [0, 10]]
    with pytest.raises(ValueError, match=r"vertices must lie within 2\*\*54 pixels .* in triangle 0, block 1 of 1"):
        tl.tiles((points, [[0, 1, 2]]), 100)[:]


def test_index_outside_the_vertices_is_told_with_its_row(small_blocks):
    triangles = TRIANGLES.copy()
    triangles[321, 2] = 300
    with pytest.raises(IndexError, match=r"triangles must hold indices in \[0, 300\).*row 321 is"):
        tl.tiles((POINTS, triangles), 100)[:]


def test_fingerprint_tells_meshes_options_and_values_apart():
    def of(points=POINTS, triangles=TRIANGLES, size=100, **options):
        return tl.tiles((points, triangles), size, **options).fingerprint

    moved, turned = POINTS.copy(), TRIANGLES.copy()
    moved[17, 1] += np.float32(1e-5)
    turned[3] = turned[3, ::-1]
    values = np.arange(500)
    fields = [of(kind="field", values=v, pixel_size=1.0, size=None) for v in (values, values + 1)]
    others = [of(points=moved), of(triangles=turned), of(size=101), of(window=10), of(depth_test="greater"), *fields]
    assert len({of(), *others}) == 1 + len(others)
    assert of() == of(points=POINTS.copy(), threads=2, memory=5)
