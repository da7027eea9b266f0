"""VTK and formats of solvers: what meshio reads of them is drawn, or told."""

import warnings

import numpy as np
import pytest

import topleft as tl
from topleft.errors import MeshError, MeshWarning

meshio = pytest.importorskip("meshio")

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0], [0, 0, 1.0]])
TRIANGLES = ("triangle", np.array([[0, 1, 2], [0, 2, 3]]))
QUADS = ("quad", np.array([[1, 4, 5, 2]]))
TETRAHEDRA = ("tetra", np.array([[0, 1, 2, 6], [0, 2, 3, 6]]))


@pytest.mark.parametrize("suffix", ["vtu", "vtk", "msh", "inp", "nas", "mesh", "bdf", "su2"])
@pytest.mark.parametrize("cells", [[TRIANGLES, QUADS], [QUADS]])
def test_load_of_surface_cells_is_as_mesh_of_them(tmp_path, suffix, cells):
    path = tmp_path / f"a.{suffix}"
    points = POINTS[:, :2] if suffix == "su2" else POINTS
    meshio.Mesh(points, cells).write(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        loaded = tl.load(path)
    ours = tl.as_mesh(meshio.Mesh(POINTS, cells))
    corners = [np.sort(mesh.vertices[mesh.triangles].round(9).reshape(-1, 9), axis=0) for mesh in (loaded, ours)]
    assert np.array_equal(*corners)


@pytest.mark.parametrize("suffix", ["vtu", "vtk", "msh", "inp", "nas", "mesh"])
def test_load_of_solid_cells_has_their_skin(tmp_path, suffix):
    meshio.Mesh(POINTS, [TETRAHEDRA]).write(tmp_path / f"a.{suffix}")
    assert len(tl.load(tmp_path / f"a.{suffix}").triangles) == 6


def test_load_warns_of_cells_that_are_not_drawn(tmp_path):
    meshio.Mesh(POINTS, [TRIANGLES, TETRAHEDRA, ("line", np.array([[0, 1]]))]).write(tmp_path / "a.vtu")
    with pytest.warns(MeshWarning, match=r"a.vtu': cells not drawn: 'tetra', 'line'"):
        assert len(tl.load(tmp_path / "a.vtu").triangles) == 2


def test_load_of_lines_alone_names_them(tmp_path):
    meshio.Mesh(POINTS, [("line", np.array([[0, 1]]))]).write(tmp_path / "a.vtk")
    with pytest.raises(MeshError, match=r"a.vtk': mesh has no triangles: its cells are line"):
        tl.load(tmp_path / "a.vtk")


def test_load_of_vertices_alone_is_points(tmp_path):
    meshio.Mesh(POINTS, [("vertex", np.arange(7)[:, None])]).write(tmp_path / "a.vtu")
    assert np.array_equal(tl.load(tmp_path / "a.vtu").positions, POINTS)


def test_load_of_a_broken_file_says_what_each_reader_found(tmp_path):
    (tmp_path / "a.vtk").write_text("# vtk DataFile Version 3.0\na\nASCII\nDATASET NOTHING\n")
    with pytest.raises(MeshError, match=r"a.vtk.*NOTHING"):
        tl.load(tmp_path / "a.vtk")
