"""Files that nobody meant: mutated, truncated, pointing elsewhere. Each ends in a mesh or in one line of MeshError."""

import bz2
import contextlib
import gzip
import io
import json
import os
import re
import socket
import tarfile
import threading
import time
import warnings
import zipfile

import numpy as np
import pytest
from gltf_files import QUAD, GltfFile, glb_of
from mutations import N_MUTATIONS, mutated_bytes, mutated_tree
from PIL import Image

import topleft as tl
from topleft.errors import MeshError, MeshWarning, MissingPackageError

MOST_SECONDS = 10  # of the CPU


def rich_gltf():
    """A file with one of everything."""
    file = GltfFile(extensionsUsed=["KHR_texture_transform", "EXT_mesh_gpu_instancing"], scenes=[{"nodes": [0, 3, 4]}])
    info = {"index": file.texture(np.full((4, 4, 3), 9), wrapS=33071), "extensions": {"KHR_texture_transform": {}}}
    file.tree["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": info}, "normalTexture": info, "alphaMode": "MASK"},
        {"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": info}}},
    ]
    sparse_at, sparse_values = file.view(bytes([1, 0])), file.view(np.array([7, 8, 9], np.float32).tobytes())
    sparse = {
        "count": 1,
        "indices": {"bufferView": sparse_at, "componentType": 5123},
        "values": {"bufferView": sparse_values},
    }
    skinned = file.primitive(
        QUAD, [0, 1, 2, 0, 2, 3], TEXCOORD_0=QUAD[:, :2], COLOR_0=np.ones((4, 4), np.float32), material=0,
        JOINTS_0=np.zeros((4, 4), np.uint8), WEIGHTS_0=np.tile(np.float32([1, 0, 0, 0]), (4, 1)),
    )  # fmt: skip
    strip = file.primitive(QUAD, mode=5, material=1, targets=[{"POSITION": file.accessor(QUAD)}])
    strip["attributes"]["POSITION"] = file.accessor(QUAD, sparse=sparse)
    skin = file.add("skins", {"joints": [2], "inverseBindMatrices": file.accessor(np.eye(4).reshape(1, 16))})
    file.node(children=[1], rotation=[0, 0, 0, 1])
    file.node(mesh=file.mesh(skinned), skin=skin, children=[2])
    file.node(translation=[1, 2, 3])
    instances = {"attributes": {"TRANSLATION": file.accessor([[1.0, 0, 0], [2, 0, 0]])}}
    file.node(mesh=file.mesh(strip, weights=[0.5]), extensions={"EXT_mesh_gpu_instancing": instances})
    file.node(camera=file.add("cameras", {"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}))
    return file


def glb_variant(rng):
    file = rich_gltf()
    if rng.random() < 0.4:
        return mutated_bytes(rng, file.glb())
    tree = {**file.tree, "buffers": [{"byteLength": len(file.blob)}]}
    return glb_of(json.dumps(mutated_tree(rng, tree)).encode(), file.blob)


def gltf_variant(rng):
    content = rich_gltf().gltf()
    if rng.random() < 0.3:
        return mutated_bytes(rng, content)
    return json.dumps(mutated_tree(rng, json.loads(content))).encode()


OBJ = (
    b"mtllib a.mtl\nv 0 0 0\nv 1 0 0 \nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nusemtl m\n"
    b"f 1/1/1 2/2/1 3/3/1 4/1/1\ns 1\nf -1 -2 -3\nusemtl n\nf 1//1 2//1 3//1\nf 1 2 3 4\nl 1 2\n"
)
MTL = (
    b"newmtl m\nKd 1 0 0\nKs .5 .5 .5\nNs 20\nd 0.5\nmap_Kd -s 2 2 2 -o 1 a.png\nmap_d a.png\nmap_Bump -bm 2 a.png\n"
    b"newmtl n\nKe 1 1 1\nmap_Ke a.png\nPr 0.5\nmap_Pm a.png\nillum 2\nTr 0.5\n"
)
PLY_HEADER = (
    b"ply\nformat %s 1.0\ncomment TextureFile a.png\nelement vertex 4\nproperty float x\nproperty float y\n"
    b"property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\n"
    b"property list uchar int vertex_indices\nproperty list uchar float texcoord\nelement tristrips 1\n"
    b"property list int int vertex_indices\nend_header\n"
)


def ply_text(rng):
    body = b"0 0 0 1 2 3\n1 0 0 1 2 3\n1 1 0 1 2 3\n0 1 0 1 2 3\n"
    return mutated_bytes(rng, PLY_HEADER % b"ascii" + body + b"3 0 1 2 6 0 0 1 0 1 1\n4 0 1 2 3 0\n4 0 1 2 3\n")


def ply_binary(rng):
    body = b"".join(np.float32(row).tobytes() + b"\1\2\3" for row in QUAD)
    body += bytes([3]) + np.int32([0, 1, 2]).tobytes() + bytes([6]) + np.zeros(6, np.float32).tobytes()
    body += bytes([4]) + np.int32([0, 1, 2, 3]).tobytes() + bytes([0]) + np.int32([4, 0, 1, 2, 3]).tobytes()
    return mutated_bytes(rng, PLY_HEADER % b"binary_little_endian" + body)


def stl_binary(rng):
    return mutated_bytes(rng, bytes(80) + np.uint32(3).tobytes() + bytes(150))


def stl_text(rng):
    facet = b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    return mutated_bytes(rng, b"solid a\n" + 2 * facet + b"endsolid a\n")


def off(rng):
    return mutated_bytes(rng, b"OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n4 0 1 2 3\n")


COLLADA = (
    b"<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><asset/><library_geometries>"
    b"<geometry id='g'><mesh><source id='s'><float_array id='a' count='12'>0 0 0 1 0 0 1 1 0 0 1 0</float_array>"
    b"<technique_common><accessor source='#a' count='4' stride='3'><param name='X' type='float'/>"
    b"<param name='Y' type='float'/><param name='Z' type='float'/></accessor></technique_common></source>"
    b"<vertices id='v'><input semantic='POSITION' source='#s'/></vertices>"
    b"<polylist count='1'><input semantic='VERTEX' source='#v' offset='0'/><vcount>4</vcount>"
    b"<p>0 1 2 3</p></polylist>"
    b"</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id='w'><node id='n'>"
    b"<instance_geometry url='#g'/></node></visual_scene></library_visual_scenes>"
    b"<scene><instance_visual_scene url='#w'/></scene></COLLADA>"
)


def collada(rng):
    """Broken as XML, or only in its numbers."""
    if rng.integers(2):
        return mutated_bytes(rng, COLLADA)
    numbers = [found.span() for found in re.finditer(rb"(?<=[> '])\d+(?=[< '])", COLLADA)]
    start, end = numbers[int(rng.integers(len(numbers)))]
    return COLLADA[:start] + str(int(rng.integers(-3, 8)) ** int(rng.integers(1, 13))).encode() + COLLADA[end:]


FORMATS = {
    "glb": ("a.glb", glb_variant),
    "gltf": ("a.gltf", gltf_variant),
    "obj": ("a.obj", lambda rng: mutated_bytes(rng, OBJ)),
    "mtl": ("a.mtl", lambda rng: mutated_bytes(rng, MTL)),
    "ply_text": ("a.ply", ply_text),
    "ply_binary": ("a.ply", ply_binary),
    "stl_text": ("a.stl", stl_text),
    "stl_binary": ("a.stl", stl_binary),
    "off": ("a.off", off),
    "collada": ("a.dae", collada),
    "png": ("a.png", None),
}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "a.obj").write_bytes(OBJ)
    (tmp_path / "a.mtl").write_bytes(MTL)
    Image.fromarray(np.full((4, 4, 4), 100, np.uint8)).save(tmp_path / "a.png")
    return tmp_path


@pytest.mark.parametrize("kind", FORMATS)
def test_load_of_mutated_files_ends_in_a_mesh_or_one_line(folder, kind):
    name, variant = FORMATS[kind]
    picture = (folder / "a.png").read_bytes()
    path = folder / ("a.obj" if kind in ("mtl", "png") else name)
    resource = pytest.importorskip("resource", reason="POSIX tells how much memory was in use")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    n_read = 0
    lines = set()
    for seed in range(N_MUTATIONS):
        rng = np.random.default_rng(seed)
        (folder / name).write_bytes(mutated_bytes(rng, picture) if variant is None else variant(rng))
        start = time.process_time()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", MeshWarning)
            try:
                mesh = tl.load(path)
                n_read += 1
                assert np.isfinite(mesh.bounds).all(), seed
                if kind in ("glb", "gltf"):
                    tl.load_cameras(path)
            except (MeshError, MissingPackageError) as error:
                lines.add(str(error))
        assert time.process_time() - start < MOST_SECONDS, seed
    assert n_read > 0
    assert [line for line in lines if "\n" in line or len(line) > 600] == []
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 600_000  # KiB


# What lies elsewhere


@pytest.mark.parametrize("name", ["../secret.png", "{outside}/secret.png", "link.png", "link/secret.png"])
def test_load_opens_nothing_outside_of_the_folder(tmp_path, name):
    outside, inside = tmp_path, tmp_path / "mesh"
    inside.mkdir()
    Image.new("RGB", (1, 1), (1, 2, 3)).save(outside / "secret.png")
    (inside / "link.png").symlink_to(outside / "secret.png")
    (inside / "link").symlink_to(outside)
    (inside / "a.mtl").write_text("newmtl m\nmap_Kd " + name.format(outside=outside) + "\n")
    (inside / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n")
    with pytest.warns(MeshWarning, match="textures outside of its folder not read"):
        assert tl.load(inside / "a.obj").materials[0].texture is None


@pytest.mark.parametrize(
    "uri", ["../a.bin", "%2e%2e/a.bin", "/etc/hostname", "file:///etc/hostname", "http://a.example/b"]
)
def test_load_gltf_buffers_stay_in_the_folder(tmp_path, uri):
    (tmp_path / "mesh").mkdir()
    (tmp_path / "a.bin").write_bytes(bytes(36))
    tree = GltfFile().shown().tree
    (tmp_path / "mesh" / "a.gltf").write_text(json.dumps({**tree, "buffers": [{"uri": uri, "byteLength": 36}]}))
    with pytest.raises(MeshError, match=r"its buffer .* is not there"):
        tl.load(tmp_path / "mesh" / "a.gltf")


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".gltf", ".off"])
def test_load_of_pipes_devices_and_sockets_is_refused(tmp_path, suffix):
    os.mkfifo(tmp_path / f"pipe{suffix}")
    (tmp_path / f"device{suffix}").symlink_to("/dev/zero")
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(tmp_path / f"s{suffix}"))
        for name in ("pipe", "device", "s"):
            with pytest.raises(MeshError, match="is a pipe or a device, not a file"):
                tl.load(tmp_path / f"{name}{suffix}")


def test_load_does_not_wait_for_a_pipe_that_a_file_names(tmp_path):
    os.mkfifo(tmp_path / "a.mtl")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    found = []

    def read():
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            tl.load(tmp_path / "a.obj")
        found.extend(str(each.message) for each in told)

    thread = threading.Thread(target=read, daemon=True)
    thread.start()
    thread.join(10)
    assert not thread.is_alive()
    assert "material libraries not found: 'a.mtl'" in found[0]


@pytest.mark.filterwarnings("ignore:.*lines not drawn")
def test_load_leaves_out_pictures_with_too_many_pixels(folder):
    Image.new("L", (20_000, 10_000)).save(folder / "a.png")  # 200 million, which Pillow calls a bomb
    with pytest.warns(MeshWarning, match="textures of more pixels than Pillow opens not read: 'a.png'"):
        tl.load(folder / "a.obj")
    Image.new("L", (10_000, 10_000)).save(folder / "a.png")
    with pytest.warns(MeshWarning, match="textures beyond the 67108864 pixels of max_texture_pixels not read: 'a.png'"):
        tl.load(folder / "a.obj")
    Image.new("L", (9, 9)).save(folder / "a.png")
    with pytest.warns(MeshWarning, match="textures beyond the 80 pixels of max_texture_pixels not read"):
        tl.load(folder / "a.obj", max_texture_pixels=80)


def archive_of(suffix, content):
    stream = io.BytesIO()
    if suffix in (".zip", ".3mf", ".zae"):
        stream.write(b"?")  # it need not begin as an archive does
        with zipfile.ZipFile(stream, "a", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr({".zip": "a.obj", ".3mf": "3D/3dmodel.model", ".zae": "a.dae"}[suffix], content)
    elif suffix in (".tar.gz", ".tar.bz2"):
        with tarfile.open(fileobj=stream, mode="w:" + suffix[5:]) as archive:
            row = tarfile.TarInfo("a.obj")
            row.size = len(content)
            archive.addfile(row, io.BytesIO(content))
    else:
        stream.write({".obj.gz": gzip, ".obj.bz2": bz2, ".bz2": bz2}[suffix].compress(content))
    return stream.getvalue()


@pytest.mark.parametrize("suffix", [".zip", ".3mf", ".zae", ".tar.gz", ".tar.bz2", ".obj.gz", ".obj.bz2", ".bz2"])
def test_load_of_an_archive_that_unpacks_to_too_much_is_refused(tmp_path, suffix):
    if suffix == ".3mf":
        pytest.importorskip("trimesh")
    path = tmp_path / f"a{suffix}"
    path.write_bytes(archive_of(suffix, bytes(1001)))
    with pytest.raises(MeshError, match=r"has \d+ bytes when it is unpacked, more than the 1000 of max_unpacked_bytes"):
        tl.load(path, max_unpacked_bytes=1000)


@pytest.mark.filterwarnings("ignore:.*lines not drawn")
@pytest.mark.parametrize("suffix", [".zip", ".tar.gz", ".tar.bz2", ".obj.gz", ".obj.bz2"])
def test_load_of_an_archive_is_that_of_its_mesh(tmp_path, suffix):
    (tmp_path / f"a{suffix}").write_bytes(archive_of(suffix, OBJ))
    (tmp_path / "a.obj").write_bytes(OBJ)
    with pytest.warns(MeshWarning, match="libraries not found"):
        mesh, one = tl.load(tmp_path / f"a{suffix}"), tl.load(tmp_path / "a.obj")
    assert np.array_equal(mesh.vertices, one.vertices)
    assert np.array_equal(mesh.triangles, one.triangles)


@pytest.mark.parametrize("name", ["../a.obj", "/a.obj", "b/../../a.obj", "C:\\..\\..\\a.obj"])
def test_load_of_an_archive_writes_nothing_outside_of_its_folder(tmp_path, monkeypatch, name):
    inside = tmp_path / "inside"
    inside.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(inside))
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr(name, OBJ)
        archive.writestr("b.obj", OBJ)
    with pytest.warns(MeshWarning):
        tl.load(tmp_path / "a.zip")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.zip", "inside"]
    assert list(inside.iterdir()) == []


TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
BROKEN_OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"


def members(path, suffix, contents):
    """Write an archive of members by name."""
    if suffix == ".zip":
        with zipfile.ZipFile(path, "w") as archive:
            for name, content in contents.items():
                archive.writestr(name, content)
    else:
        with tarfile.open(path, "w:gz") as archive:
            for name, content in contents.items():
                row = tarfile.TarInfo(name)
                row.size = len(content)
                archive.addfile(row, io.BytesIO(content))


@pytest.mark.parametrize("suffix", [".zip", ".tar.gz"])
@pytest.mark.parametrize("junk", ["__MACOSX/._a.obj", "b/._a.obj", "._a.ply", ".DS_Store", "__MACOSX/b/c.stl"])
def test_files_that_macos_adds_to_an_archive_are_passed_over(tmp_path, suffix, junk):
    members(tmp_path / f"a{suffix}", suffix, {junk: b"Mac OS X", "a.obj": TRIANGLE})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(tl.load(tmp_path / f"a{suffix}").triangles) == 1


@pytest.mark.parametrize("suffix", [".zip", ".tar.gz"])
@pytest.mark.parametrize(
    ("name", "content"), [("b.obj", BROKEN_OBJ), ("b.ply", b"ply\n"), ("b.glb", b"glTF"), ("c/b.stl", b"s")]
)
def test_broken_member_of_an_archive_is_left_out_and_named(tmp_path, suffix, name, content):
    members(tmp_path / f"a{suffix}", suffix, {name: content, "a.obj": TRIANGLE})
    with pytest.warns(MeshWarning, match=rf"a{suffix}': members of its archive left out: .*{name}"):
        assert len(tl.load(tmp_path / f"a{suffix}").triangles) == 1
    members(tmp_path / f"b{suffix}", suffix, {name: content})
    with pytest.raises(MeshError, match=rf"b{suffix}"):
        tl.load(tmp_path / f"b{suffix}")


def test_member_of_a_zip_with_a_wrong_checksum_is_left_out_and_named(tmp_path):
    members(tmp_path / "a.zip", ".zip", {"a.obj": TRIANGLE, "b.obj": TRIANGLE + b"# second\n"})
    content = (tmp_path / "a.zip").read_bytes()
    (tmp_path / "a.zip").write_bytes(content.replace(b"# second", b"# sEcond", 1))
    with pytest.warns(MeshWarning, match=r"members of its archive left out: .*b\.obj \(Bad CRC-32"):
        assert len(tl.load(tmp_path / "a.zip").triangles) == 1


def test_limits_of_an_archive_are_those_of_all_its_members(tmp_path):
    members(tmp_path / "a.zip", ".zip", {"a.obj": TRIANGLE, "b.obj": TRIANGLE})
    with pytest.raises(MeshError, match="of max_vertices"):
        tl.load(tmp_path / "a.zip", max_vertices=5)


def test_load_of_an_archive_without_a_mesh_or_broken_is_told(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("a.txt", "hello")
    with pytest.raises(MeshError, match=r"its archive holds no \.gltf"):
        tl.load(tmp_path / "a.zip")
    (tmp_path / "a.obj.gz").write_bytes(gzip.compress(OBJ)[:-9])
    with pytest.raises(MeshError, match="its archive is broken"):
        tl.load(tmp_path / "a.obj.gz")
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("b/a.obj", "v 0 0\nf 1 1 1\n")
    with pytest.raises(MeshError, match=r"a.zip/b/a.obj'|vertex 1 has 2 of 3 numbers"):
        tl.load(tmp_path / "a.zip")


def lines_and_triangle(file):
    line = {**file.primitive(), "mode": 1}
    file.node(mesh=file.mesh(line, file.primitive(), line))


def two_nodes_of_a_mesh(file):
    mesh = file.mesh(file.primitive(), file.primitive())
    file.node(mesh=mesh), file.node(mesh=mesh)


def sparse_target(file, n_set=1):
    at, new = file.view(bytes(n_set)), file.view(bytes(12 * n_set))
    sparse = {"count": n_set, "indices": {"bufferView": at, "componentType": 5121}, "values": {"bufferView": new}}
    row = file.add("accessors", {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse})
    file.node(mesh=file.mesh(file.primitive(targets=[{"POSITION": row}]), weights=[1]))


@pytest.mark.parametrize(
    ("write", "option", "n"),
    [
        (two_nodes_of_a_mesh, "max_nodes", 2 + 4),  # primitives read, and placed
        (lines_and_triangle, "max_nodes", 3 + 3),
        (sparse_target, "max_nodes", 1 + 1 + 1 + 1),  # primitive read, target, sparse accessor, primitive placed
        (sparse_target, "max_unpacked_bytes", 36 + 36 + 12),  # zeros, their copy, what is set in it
        (lambda file: sparse_target(file, 100), "max_unpacked_bytes", 36 + 36 + 1200),
        (lambda file: file.shown(QUAD, [0, 1, 2, 2, 2, 2, 3], mode=5), "max_triangles", 5),
        (lambda file: file.shown(QUAD, [0] * 9, mode=5), "max_triangles", 7),
    ],
)
def test_gltf_parts_spend_the_budget_as_often_as_they_are_read(tmp_path, write, option, n):
    file = GltfFile()
    write(file)
    (tmp_path / "a.glb").write_bytes(file.glb())
    with pytest.raises(MeshError, match=f"has {n} .* more than the {n - 1} of {option}"):
        tl.load(tmp_path / "a.glb", **{option: n - 1})
    with warnings.catch_warnings(), contextlib.suppress(MeshError):  # a file of no triangles
        warnings.simplefilter("ignore")
        tl.load(tmp_path / "a.glb", **{option: n})


def test_gltf_cameras_spend_the_budget(tmp_path):
    file = GltfFile(cameras=[{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}])
    file.tree["nodes"] = [{"camera": 0}] * 32_769
    (tmp_path / "a.glb").write_bytes(file.shown().glb())
    with pytest.raises(MeshError, match="has 32769 parts"):
        tl.load_cameras(tmp_path / "a.glb")


def test_gltf_of_too_many_primitives_is_refused_before_the_first_is_read(tmp_path):
    file = GltfFile()
    file.node(mesh=file.mesh(*[{"attributes": {"POSITION": 7}}] * 20_000))  # there is no accessor of that index
    (tmp_path / "a.glb").write_bytes(file.glb())
    with pytest.raises(MeshError, match="has 40000 parts"):
        tl.load(tmp_path / "a.glb")


LIMITED = {
    "max_vertices": ("a.obj", 3, "has 4 vertices, more than the 3 of max_vertices"),
    "max_triangles": ("a.obj", 1, "triangles, more than the 1 of max_triangles"),
    "max_lines": ("a.obj", 2, "lines and elements, more than the 2 of max_lines"),
    "max_bytes": ("a.obj", 10, "bytes with the files that it names, more than the 10 of max_bytes"),
    "max_nodes": ("a.glb", 4, r"has 10 parts .*, more than the 4 of max_nodes"),
}


@pytest.mark.parametrize("option", LIMITED)
def test_load_stops_at_each_limit_of_its_options(folder, option):
    name, limit, message = LIMITED[option]
    file = GltfFile()
    for _ in range(5):
        file.shown()
    (folder / "a.glb").write_bytes(file.glb())
    with pytest.raises(MeshError, match=message):
        tl.load(folder / name, **{option: limit})
    for wrong, error in ((-1, ValueError), (1.5, TypeError), ("9", TypeError), (True, TypeError)):
        with pytest.raises(error, match=option):
            tl.load(folder / name, **{option: wrong})


# ---- formats that trimesh and meshio read ---------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".xdmf", ".xmf", ".h5m", ".cgns", ".exo"])
def test_load_of_formats_that_no_budget_holds_for_is_refused(tmp_path, suffix):
    (tmp_path / f"a{suffix}").write_bytes(b"<Xdmf/>")
    with pytest.raises(MeshError, match=f"cannot read .*a{suffix}': .*; if you trust it, read it by meshio"):
        tl.load(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("compression", ["zlib", "lzma", None])
def test_load_vtu_unpacks_on_its_budget(tmp_path, compression):
    meshio = pytest.importorskip("meshio")
    points = np.zeros((200_000, 3))
    points[1, 0] = points[2, 1] = 1
    made = meshio.Mesh(points, [("triangle", np.array([[0, 1, 2]]))])
    meshio.vtu.write(tmp_path / "a.vtu", made, compression=compression)
    assert tl.load(tmp_path / "a.vtu").triangles.tolist() == [[0, 1, 2]]
    if compression is not None:
        with pytest.raises(MeshError, match="more than the 1000000 of max_unpacked_bytes"):
            tl.load(tmp_path / "a.vtu", max_unpacked_bytes=1_000_000)
    assert len(meshio.read(tmp_path / "a.vtu").points) == 200_000  # who calls it otherwise has no budget


def write_3dxml(path, part, n_parts, textures=0, side=1):
    """As much of the format as names parts and pictures."""
    rows = "".join(f'<ReferenceRep id="{i}" associatedFile="urn:3DXML:p.3DRep" format="T"/>' for i in range(n_parts))
    stream = io.BytesIO()
    Image.new("L", (side, side)).save(stream, format="PNG")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("Manifest.xml", "<Manifest><Root>a.xml</Root></Manifest>")
        archive.writestr("a.xml", f'<M><ProductStructure root="0">{rows}</ProductStructure></M>')
        archive.writestr("p.3DRep", part)
        archive.writestr("m.xml", "<M>" + '<Attr Name="TextureImage"/>' * textures + "</M>")
        archive.writestr("t.png", stream.getvalue())


@pytest.mark.parametrize(
    ("how", "option"),
    [
        ({"part": "<Rep>" + " " * 100_000 + "</Rep>", "n_parts": 1000}, "max_unpacked_bytes"),
        ({"part": "<Rep>" + "<a/>" * 600_000 + "</Rep>", "n_parts": 1}, "max_lines"),
        ({"part": "<Rep/>", "n_parts": 1, "textures": 100, "side": 1000}, "max_texture_pixels"),
    ],
)
def test_load_3dxml_that_multiplies_its_parts_is_refused(tmp_path, how, option):
    pytest.importorskip("lxml", reason="needs lxml, of the extra formats")
    write_3dxml(tmp_path / "a.3dxml", **how)
    with pytest.raises(MeshError, match=f"of {option}$"):
        tl.load(tmp_path / "a.3dxml")
