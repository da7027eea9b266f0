"""Files: small meshes written here and read back, broken ones refused."""

import sys
import zipfile

import numpy as np
import pytest

import topleft as tl
from topleft import scenes
from topleft._meshes.io import load as files
from topleft._meshes.model.mesh import Mesh
from topleft.errors import MeshError, MeshWarning, MissingPackageError

trimesh = pytest.importorskip("trimesh")

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
GLTF_WITHOUT_ITS_BUFFER = """{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
"bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": "gone.bin", "byteLength": 36}]}"""


@pytest.fixture
def write(tmp_path):
    def write_file(name, content):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write_file


def exported(kind, mesh=None):
    vertices, triangles = scenes.shape("icosphere", subdivisions=1)
    return (mesh or trimesh.Trimesh(vertices, triangles, process=False)).export(file_type=kind)


# Meshes in


def test_load_obj_groups_are_one_mesh_in_the_order_of_the_file(write):
    groups = "g one\nusemtl red\nf 1 2 3\ns off\ng two\nusemtl blue\nf 1 3 4\nf 4 2 1\n"
    text = "mtllib no.mtl\no thing\n" + SQUARE + groups
    with pytest.warns(MeshWarning, match="material libraries not found: 'no.mtl'"):
        mesh = files.load(write("a.obj", text))
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [3, 1, 0]]


def test_load_obj_texture_seam_doubles_vertices_but_not_normals(write):
    text = SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 .5\nf 1/1 2/2 3/3\nf 1/4 3/1 4/2\n"
    mesh = files.load(write("a.obj", text))
    assert mesh.uv[mesh.triangles].tolist() == [[[0, 0], [1, 0], [1, 1]], [[0, 0.5], [0, 0], [1, 0]]]
    assert len(mesh.vertices) == 6
    assert (mesh.vertex_normals() == [0, 0, 1]).all()
    whole = files.load(write("b.obj", SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"))
    assert len(whole.vertices) == 4


def test_as_mesh_of_trimesh_with_a_cutoff_above_one_shows_nothing():
    trimesh = pytest.importorskip("trimesh")
    shape = trimesh.creation.box()
    material = trimesh.visual.material.PBRMaterial(alphaMode="MASK", alphaCutoff=1.5)
    shape.visual = trimesh.visual.TextureVisuals(uv=np.zeros((8, 2)), material=material)
    assert not tl.render(shape, size=(16, 12), background="transparent")[..., 3].any()


def test_load_obj_doubled_vertices_become_one(write):
    mesh = files.load(write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 4 5 6\n"))
    assert len(mesh.vertices) == 4


def test_load_obj_normals_of_the_file_are_kept(write):
    text = SQUARE + "vn 0 0.6 0.8\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n"
    mesh = files.load(write("a.obj", text))
    assert mesh.normals[mesh.triangles].tolist() == [[[0, 0.6, 0.8]] * 3, [[0, 0, 1]] * 3]


def test_load_obj_relative_indices_count_from_their_line(write):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 6\n"
    mesh = files.load(write("a.obj", text))
    assert mesh.vertices[mesh.triangles][:, 0].tolist() == [[0, 0, 0], [5, 0, 0]]


def test_load_obj_in_another_encoding_is_read(write):
    content = "# Modell für Köln\n".encode("latin-1") + SQUARE.encode() + b"f 1 2 3\r\n"
    assert len(files.load(write("a.obj", content)).triangles) == 1


def test_load_stl_corners_are_merged(write):
    mesh = files.load(write("a.stl", exported("stl")))
    assert mesh.vertices.shape == (42, 3)
    assert mesh.triangles.shape == (80, 3)
    assert mesh.normals is None


@pytest.mark.parametrize("kind", ["ply", "off", "glb", "stl_ascii"])
def test_load_reads_what_trimesh_writes(write, kind):
    mesh = files.load(write(f"a.{kind}", exported(kind)))
    vertices, triangles = scenes.shape("icosphere", subdivisions=1)
    assert mesh.triangles.shape == (80, 3)
    assert mesh.vertices[mesh.triangles] == pytest.approx(vertices[triangles], abs=1e-6)


def test_load_ply_vertex_normals_are_kept(write):
    normals = np.tile([0.0, 0.6, 0.8], (42, 1))
    vertices, triangles = scenes.shape("icosphere", subdivisions=1)
    source = trimesh.Trimesh(vertices, triangles, vertex_normals=normals, process=False)
    mesh = files.load(write("a.ply", source.export(file_type="ply", vertex_normal=True)))
    assert mesh.normals == pytest.approx(normals)


def test_load_ply_face_colors_stay_sharp_and_shading_smooth(write):
    vertices, triangles = scenes.shape("icosphere", subdivisions=1)
    colors = np.tile([[255, 0, 0, 255], [0, 0, 255, 255]], (40, 1)).astype(np.uint8)
    source = trimesh.Trimesh(vertices, triangles, face_colors=colors, process=False)
    mesh = files.load(write("a.ply", source.export(file_type="ply")))
    assert (mesh.colors[mesh.triangles] == colors[:, None]).all()
    expected = Mesh(vertices, triangles).vertex_normals()[triangles]
    assert mesh.vertex_normals()[mesh.triangles] == pytest.approx(expected, abs=1e-6)


def test_load_scaled_node_normals_stay_at_right_angles(write):
    normals = np.tile([0.6, 0.0, 0.8], (3, 1))
    source = trimesh.Trimesh([[0, 0, 0], [0.8, 0, -0.6], [0, 1, 0]], [[0, 1, 2]], vertex_normals=normals, process=False)
    scene = trimesh.Scene()
    scene.add_geometry(source, transform=np.diag([1.0, 1, 5, 1]))
    mesh = files.load(write("a.glb", scene.export(file_type="glb", include_normals=True)))
    edges = mesh.vertices[1:] - mesh.vertices[:1]
    assert edges @ mesh.vertex_normals()[0] == pytest.approx([0, 0], abs=1e-6)


LFS = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n"


def test_texture_that_is_a_pointer_of_git_lfs_is_told(write, tmp_path):
    write("a.mtl", "newmtl one\nmap_Kd t.png\n")
    write("t.png", LFS)
    with pytest.warns(tl.MeshWarning, match="textures that are Git LFS pointers .git lfs pull.*t.png"):
        mesh = files.load(write("a.obj", "mtllib a.mtl\nusemtl one\n" + SQUARE + "f 1 2 3\n"))
    assert len(mesh.triangles) == 1


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.obj", "", "^'.*a.obj' is empty$"),
        *((f"a.{kind}", LFS, f"a.{kind}' is a Git LFS pointer.*git lfs pull") for kind in ("obj", "glb", "ply", "stl")),
        ("a.obj", "what is this\n", "has no triangles"),
        ("a.obj", SQUARE + "f 1 2 9\n", "cannot read '.*a.obj': broken, or not a '.obj' file"),
        ("a.obj", SQUARE + "f 1 two 3\n", "cannot read '.*a.obj': broken"),
        ("a.obj", "v 0 0 0\nv 1 0 zero\nv 0 1 0\nf 1 2 3\n", "cannot read '.*a.obj': broken"),
        ("a.obj", "v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n", "its vertex 1 has 2 of 3 numbers"),
        ("a.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", r"vertices\[1\] = \[1.0, 0.0, nan\] must be finite"),
        ("a.obj", b"\0\1\2\377", "broken, or not a '.obj' file .it is not text"),
        ("a.stl", b"", "^'.*a.stl' is empty$"),
        ("a.stl", b"\200\0\3\377" * 50, "cannot read '.*a.stl': broken, or not a '.stl' file .it has 2 of"),
        ("a.ply", b"ply\nformat", "cannot read '.*a.ply': broken"),
        ("a.glb", b"glTF\2\0\0\0", "cannot read '.*a.glb': broken"),
        ("a.gltf", "{", "cannot read '.*a.gltf': broken"),
        ("a.gltf", GLTF_WITHOUT_ITS_BUFFER, "its buffer 'gone.bin' is not there"),
        ("a.txt", "v", "cannot read '.*a.txt': format '.txt' is none of .*obj.*ply"),
        ("a", "v", "cannot read '.*a': format '' is none of"),
    ],
)
def test_load_broken_file_is_refused(write, name, content, message):
    with pytest.raises(MeshError, match=message):
        files.load(write(name, content))


@pytest.mark.parametrize("kind", ["stl", "ply", "glb"])
def test_load_half_a_file_is_refused(write, kind):
    whole = exported(kind)
    with pytest.raises(MeshError, match="cannot read"):
        files.load(write(f"a.{kind}", whole[: len(whole) // 2]))


def test_load_missing_file_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"there is no file '.*nope.obj'"):
        files.load(tmp_path / "nope.obj")


def test_load_folder_is_refused(tmp_path):
    with pytest.raises(MeshError, match="is a folder, not a mesh"):
        files.load(tmp_path)


@pytest.mark.parametrize(("end", "n"), [("3 0 0", 1), ("3 1 0", 0)])
def test_load_triangles_without_area_are_told(tmp_path, recwarn, end, n):
    (tmp_path / "a.obj").write_text(f"v 0 0 0\nv 1 0 0\nv {end}\nf 1 1 2\nf 1 2 3\n")
    files.load(tmp_path / "a.obj")
    assert [str(warning.message).partition(": ")[2] for warning in recwarn] == [
        "its triangles have no area: pictures of it are empty"
    ] * n


def test_load_address_is_refused():
    with pytest.raises(FileNotFoundError, match=r"path must be a file of this machine, got the URL 'https://.*obj'"):
        files.load("https://example.com/a.obj")


def test_load_without_trimesh_says_how_to_get_it(write, monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(MissingPackageError, match="pip install trimesh"):
        files.load(write("a.3mf", "PK"))


# By trimesh


def test_as_mesh_of_trimesh_takes_no_highlights_that_nobody_gave():
    material = trimesh.visual.material.SimpleMaterial(diffuse=(0, 255, 0, 255))
    vertices, triangles = scenes.shape("cube")
    visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(vertices), 2)), material=material)
    (made,) = tl.as_mesh(trimesh.Trimesh(vertices, triangles, visual=visual, process=False)).materials
    assert (made.color, made.specular) == ((0, 255, 0), 0)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.dxf", b"AutoCAD Binary DXF\r\n\x1a\0", "it is a binary DXF: save it as text"),
        ("a.dxf", "0\nSECTION\n", "cannot draw .*a.dxf': it is a drawing: only its curves could be read"),
        ("a.svg", "<svg/>", "cannot draw .*a.svg': it holds curves in a plane"),
        ("a.binvox", "#binvox 1", "it holds voxels: make a mesh of them"),
    ],
)
def test_load_of_what_is_no_mesh_is_refused_in_true_words(write, name, content, message):
    with pytest.raises(MeshError, match=message):
        files.load(write(name, content))


def test_load_of_3mf_with_objects_in_further_files_is_refused_in_true_words(tmp_path):
    for package in ("lxml", "networkx"):
        pytest.importorskip(package, reason="3MF needs it, of the extra formats")
    model = '<model xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources/><build/></model>'
    with zipfile.ZipFile(tmp_path / "a.3mf", "w") as archive:
        archive.writestr("3D/3dmodel.model", model)
        archive.writestr("3D/Objects/a.model", model)
    with pytest.raises(MeshError, match=r"a.3mf': its objects are in further files of the archive"):
        files.load(tmp_path / "a.3mf")


@pytest.mark.parametrize(
    ("attribute", "told"),
    [
        ("", []),
        (" pid='5' p1='0'", ["colours and materials not read"]),
        (" paint_color='8'", ["colours and materials not read"]),
    ],
)
def test_load_of_3mf_tells_of_colours(tmp_path, recwarn, attribute, told):
    for package in ("lxml", "networkx"):
        pytest.importorskip(package, reason="3MF needs it, of the extra formats")
    corners = "".join(f"<vertex x='{x}' y='{y}' z='0'/>" for x, y in ((0, 0), (1, 0), (0, 1)))
    with zipfile.ZipFile(tmp_path / "a.3mf", "w") as archive:
        archive.writestr(
            "3D/3dmodel.model",
            "<model xmlns='http://schemas.microsoft.com/3dmanufacturing/core/2015/02'><resources><object id='1'><mesh>"
            f"<vertices>{corners}</vertices><triangles><triangle v1='0' v2='1' v3='2'{attribute}/></triangles></mesh>"
            "</object></resources><build><item objectid='1'/></build></model>",
        )
    assert len(files.load(tmp_path / "a.3mf").triangles) == 1
    assert [str(one.message).partition(": ")[2] for one in recwarn] == told


def test_load_reads_files_of_its_root(tmp_path):
    for folder in ("meshes", "textures"):
        (tmp_path / folder).mkdir()
    tl.save_image(tmp_path / "textures/a.png", np.zeros((1, 1, 3), np.uint8))
    (tmp_path / "meshes/a.mtl").write_text("newmtl m\nmap_Kd ../textures/a.png\n")
    path = tmp_path / "meshes/a.obj"
    path.write_text("mtllib a.mtl\n" + SQUARE + "vt 0 0\nusemtl m\nf 1/1 2/1 3/1\n")
    for root in (None, tmp_path / "meshes"):
        with pytest.warns(MeshWarning, match=r"textures outside of its folder not read: '../textures/a.png'"):
            assert files.load(path, root=root).materials[0].texture is None
    for root in (tmp_path, tmp_path / "textures"):  # which need not hold the mesh
        assert files.load(path, root=root).materials[0].texture is not None
    with pytest.raises(ValueError, match="root must be a folder, got"):
        files.load(path, root=path)


def test_load_by_meshio_prints_nothing(write, capfd):
    meshio = pytest.importorskip("meshio")
    path = write("a.msh", b"")
    meshio.Mesh(np.eye(3), [("triangle", [[0, 1, 2]])]).write(path, file_format="gmsh")
    assert len(files.load(path).triangles) == 1
    with pytest.raises(MeshError):
        files.load(write("b.msh", b"$MeshFormat\n9 0 8\n"))
    assert capfd.readouterr() == ("", "")


CORNERS = "0 0 0\n1 0 0\n0 1 0\n"
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{}"
    "element face {}\nproperty list uchar int vertex_indices\nend_header\n{}"
)
SMALL_FACES = "faces of fewer than three corners not drawn"


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nf 1 2 3\n", SMALL_FACES),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\ncall b.obj\n", "files that it calls not read"),
        ("a.off", f"OFF\n3 2 0\n{CORNERS}3 0 1 2\n2 0 1\n", SMALL_FACES),
        ("a.ply", PLY.format("", 2, f"{CORNERS}3 0 1 2\n2 0 1\n"), SMALL_FACES),
        ("a.ply", PLY.format("", 1, f"{CORNERS}3 0 1 2\n3 0 1 2\n"), "content after the last row that its header"),
        ("a.ply", PLY.format("property uchar red\n", 1, CORNERS.replace("\n", " 7\n") + "3 0 1 2\n"),
         "properties of vertex not read: 'red'"),
        ("a.ply", PLY.format("".join(f"property float {one}\n" for one in ("s", "t", "u", "v")), 1,
                             CORNERS.replace("\n", " 0 0 0 0\n") + "3 0 1 2\n"),
         "properties of vertex not read: 's', 't'"),
        ("a.stl", bytes(80) + (1).to_bytes(4, "little") + bytes(50) * 2, "bytes after the last triangle"),
    ],
)  # fmt: skip
def test_load_tells_what_it_leaves_out(tmp_path, name, content, told):
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.warns(MeshWarning, match=told):
        tl.load(tmp_path / name)
