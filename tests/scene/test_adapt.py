"""Meshes of other libraries and arrays of other kinds, as they are."""

from types import SimpleNamespace

import numpy as np
import pytest

import topleft as tl
from topleft import scenes
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.scene.adapt import as_mesh, as_polygons
from topleft.errors import MeshWarning

SIZE = (64, 48)
VERTICES, TRIANGLES = scenes.shape("icosahedron")
POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]])


def block(kind, rows):
    return SimpleNamespace(type=kind, data=np.array(rows))


def cells(points, *blocks):
    """What `meshio.Mesh` looks like."""
    return SimpleNamespace(points=points, cells=list(blocks))


def poly(points, faces):
    """What `pyvista.PolyData` looks like."""
    return SimpleNamespace(points=points, faces=np.array(faces), n_strips=0)


class Tensor:
    """An array that only speaks DLPack, as a tensor on the CPU does."""

    def __init__(self, values):
        self.array = np.array(values)

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


def test_as_mesh_gives_a_mesh_back():
    mesh = Mesh(VERTICES, TRIANGLES)
    assert as_mesh(mesh) is mesh


def test_as_mesh_of_trimesh_shares_its_vertices():
    trimesh = pytest.importorskip("trimesh")
    theirs = trimesh.Trimesh(VERTICES, TRIANGLES, process=False)
    mesh = as_mesh(theirs)
    assert np.shares_memory(mesh.vertices, np.asarray(theirs.vertices))
    assert np.array_equal(mesh.triangles, TRIANGLES)
    assert mesh.normals is None


def test_as_mesh_of_trimesh_takes_colors_and_known_normals():
    trimesh = pytest.importorskip("trimesh")
    colors = np.random.default_rng(2).integers(0, 256, (len(VERTICES), 4), dtype=np.uint8)
    theirs = trimesh.Trimesh(VERTICES, TRIANGLES, vertex_normals=-VERTICES, vertex_colors=colors, process=False)
    mesh = as_mesh(theirs)
    assert np.array_equal(mesh.colors, colors)
    assert mesh.normals == pytest.approx(-VERTICES / np.linalg.norm(VERTICES, axis=1)[:, None])


def test_as_mesh_of_trimesh_takes_factors_that_are_shares():
    trimesh = pytest.importorskip("trimesh")
    kind = type("Material", (trimesh.visual.material.PBRMaterial,), {"baseColorFactor": None})  # theirs makes bytes
    theirs, material = trimesh.Trimesh(VERTICES, TRIANGLES, process=False), kind(alphaMode="BLEND")
    material.baseColorFactor = [1.0, 0.25, 0.0, 0.5]
    theirs.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(VERTICES), 2)), material=material)
    (found,) = as_mesh(theirs).materials
    assert (found.color, found.opacity) == ((255, 137, 0), 0.5)


def test_render_of_a_trimesh_scene_places_its_parts():
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene()
    move = np.eye(4)
    move[0, 3] = 3
    scene.add_geometry(trimesh.Trimesh(VERTICES, TRIANGLES, process=False))
    scene.add_geometry(trimesh.Trimesh(VERTICES, TRIANGLES, process=False), transform=move)
    both = Mesh(np.vstack([VERTICES, VERTICES + (3, 0, 0)]), np.vstack([TRIANGLES, TRIANGLES + len(VERTICES)]))
    assert np.array_equal(*(tl.render(mesh, size=SIZE, shading="flat") for mesh in (scene, both)))


def test_as_mesh_of_an_empty_scene_is_refused():
    trimesh = pytest.importorskip("trimesh")
    with pytest.raises(ValueError, match="mesh has no triangles: nothing in the scene has faces"):
        as_mesh(trimesh.Scene())


def test_as_mesh_of_meshio_takes_surface_cells():
    meshio = pytest.importorskip("meshio")
    theirs = meshio.Mesh(POINTS, [("line", [[0, 1]]), ("triangle", [[1, 4, 2]]), ("quad", [[0, 1, 2, 3]])])
    with pytest.warns(MeshWarning, match="cells of kind 'line' not drawn"):
        mesh = as_mesh(theirs)
    assert mesh.triangles.tolist() == [[1, 4, 2], [0, 1, 2], [0, 2, 3]]
    assert np.shares_memory(mesh.vertices, theirs.points)


def test_as_surface_of_cells_knows_the_faces():
    quads, triangles = block("quad", [[0, 1, 2, 3]]), block("triangle", [[1, 4, 2]])
    polygons = as_polygons(cells(POINTS, quads, triangles))
    assert polygons.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]
    assert polygons.faces.tolist() == [0, 0, 1]
    assert polygons.n_faces == 2


def test_as_surface_of_triangle_cells_is_no_copy():
    theirs = cells(POINTS, block("triangle", [[0, 1, 2]]))
    polygons = as_polygons(theirs)
    assert np.shares_memory(polygons.triangles, theirs.cells[0].data)
    assert polygons.faces is None


def test_as_mesh_of_cells_without_surface_is_refused():
    with pytest.raises(ValueError, match="mesh has no triangles: its cells are vertex, line"):
        as_mesh(cells(POINTS, block("vertex", [[0]]), block("line", [[0, 1]])))


def test_as_mesh_of_polydata_of_triangles_shares_its_points():
    theirs = poly(POINTS.astype(np.float32), [3, 0, 1, 2, 3, 0, 2, 3])
    mesh = as_mesh(theirs)
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert np.shares_memory(mesh.vertices, theirs.points)


def test_as_surface_of_polydata_of_mixed_faces():
    polygons = as_polygons(poly(POINTS, [4, 0, 1, 2, 3, 3, 1, 4, 2]))
    assert polygons.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]
    assert polygons.faces.tolist() == [0, 0, 1]


def test_as_mesh_of_strips_is_refused():
    with pytest.raises(ValueError, match=r"mesh has strips of triangles: take its triangulate\(\)"):
        as_mesh(SimpleNamespace(points=POINTS, faces=np.array([3, 0, 1, 2]), n_strips=1))


def test_as_mesh_of_a_triangulation_is_flat_and_masked():
    tri = pytest.importorskip("matplotlib.tri")
    theirs = tri.Triangulation(POINTS[:, 0], POINTS[:, 1], [[0, 1, 2], [0, 2, 3], [1, 4, 2]], mask=[0, 1, 0])
    mesh = as_mesh(theirs)
    assert mesh.triangles.tolist() == [[0, 1, 2], [1, 4, 2]]
    assert mesh.vertices.tolist() == POINTS.tolist()
    assert as_polygons(theirs).faces.tolist() == [0, 2]
    assert as_polygons(theirs).n_faces == 3


@pytest.mark.parametrize("name", ["triangles", "faces"])
def test_as_mesh_of_anything_with_vertices(name):
    theirs = SimpleNamespace(**{"vertices": VERTICES, name: TRIANGLES})
    assert np.array_equal(tl.render(theirs, size=SIZE), tl.render(Mesh(VERTICES, TRIANGLES), size=SIZE))


def test_pair_of_other_arrays_is_framed_as_a_mesh():
    vertices, triangles = np.eye(3), [[0, 1, 2]]
    expected = Camera.framing((vertices, triangles)).view
    assert np.array_equal(Camera.framing((memoryview(vertices), triangles)).view, expected)


def test_pair_without_triangles_is_a_mesh():
    empty = np.eye(3), np.empty((0, 3), int)
    assert tl.Scene([(empty, np.eye(4))]).n_triangles == 0
    with pytest.raises(ValueError, match="the mesh has no triangles"):
        Camera.framing(empty)


def test_rasterize_mesh_takes_a_pair():
    frags = tl.rasterize_mesh((VERTICES, TRIANGLES), size=SIZE)
    assert np.array_equal(frags.triangle, tl.rasterize_mesh(Mesh(VERTICES, TRIANGLES), size=SIZE).triangle)
    assert frags.mask.any()


def test_framing_takes_what_render_takes():
    trimesh = pytest.importorskip("trimesh")
    expected = Camera.framing(Mesh(VERTICES, TRIANGLES)).view
    theirs = trimesh.Trimesh(VERTICES, TRIANGLES, process=False)
    assert np.array_equal(Camera.framing(theirs).view, expected)
    assert np.array_equal(Camera.framing(poly(VERTICES, np.insert(TRIANGLES, 0, 3, axis=1).ravel())).view, expected)


@pytest.mark.parametrize("subject", [None, 3, b"bunny.obj", VERTICES, SimpleNamespace(points=POINTS)])
def test_as_mesh_of_something_else_is_refused(subject):
    with pytest.raises(TypeError, match=r"mesh must be a Mesh, .* got (NoneType|int|bytes|ndarray|SimpleNamespace)"):
        as_mesh(subject)


def test_mesh_of_a_tensor_shares_its_memory():
    tensor = Tensor(VERTICES)
    assert np.shares_memory(as_mesh((tensor, Tensor(TRIANGLES))).vertices, tensor.array)
