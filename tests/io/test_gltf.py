"""glTF: each feature in the smallest file that has it."""

import base64
import json
import warnings

import numpy as np
import pytest
from engine_cases import one_by_one
from gltf_files import QUAD, TRIANGLE, GltfFile, glb_of

import topleft as tl
from topleft._meshes.io.gltf.draco import DracoBytes, declared_by_draco
from topleft.errors import MeshError, MeshWarning

QUAD_STRIP = [0, 1, 3, 2]


@pytest.fixture
def load(tmp_path):
    def read(file, name="a.glb"):
        path = tmp_path / name
        path.write_bytes(file.glb() if name.endswith(".glb") else file.gltf())
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return tl.load(path)

    return read


def corners(mesh):
    return mesh.vertices[mesh.triangles].tolist()


def material_of(load, **row):
    file = GltfFile(materials=[row]).shown(material=0)
    return load(file).materials[0]


@pytest.mark.parametrize("name", ["a.gltf", "a.glb"])
def test_gltf_triangle_without_indices_is_read(load, name):
    mesh = load(GltfFile().shown(), name)
    assert corners(mesh) == [TRIANGLE.tolist()]
    assert mesh.normals.tolist() == [[0, 0, 1]] * 3


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [
        (4, [0, 1, 2, 0, 2, 3], [[0, 1, 2], [0, 2, 3]]),
        (5, QUAD_STRIP, [[0, 1, 3], [3, 1, 2]]),
        (6, [0, 1, 2, 3], [[0, 1, 2], [0, 2, 3]]),
        (5, [0, 1, 3, 3, 2, 1], [[0, 1, 3], [1, 2, 3]]),
    ],
)
def test_gltf_lists_strips_and_fans_turn_one_way(load, mode, indices, expected):
    mesh = load(GltfFile().shown(QUAD, indices, mode=mode))
    found = mesh.vertices[mesh.triangles]
    area = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])[:, 2] / 2
    assert (area > 0).all()
    assert area.sum() == 0.5 * len(expected)
    assert [sorted(row) for row in found.tolist()] == [sorted(QUAD[row].tolist()) for row in expected]


@pytest.mark.parametrize(("mode", "kind"), [(0, "points"), (1, "lines"), (2, "lines"), (3, "lines")])
def test_gltf_points_and_lines_are_told(tmp_path, mode, kind):
    file = GltfFile()
    file.node(mesh=file.mesh(file.primitive(mode=mode), file.primitive()))
    (tmp_path / "a.glb").write_bytes(file.glb())
    with pytest.warns(MeshWarning, match=f"a.glb': {kind} not drawn"):
        assert len(tl.load(tmp_path / "a.glb").triangles) == 1
    if mode == 0:
        return
    (tmp_path / "b.glb").write_bytes(GltfFile().shown(mode=mode).glb())
    with pytest.raises(MeshError, match=f"b.glb' has no triangles, but {kind}"):
        tl.load(tmp_path / "b.glb")


def test_gltf_of_points_alone_becomes_points(load):
    file = GltfFile(materials=[{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}])
    own = file.primitive(mode=0, COLOR_0=np.array([[0, 0.5, 1]] * 3, np.float32))
    file.node(mesh=file.mesh(own, file.primitive(mode=0, material=0)), translation=[0, 0, 2])
    cloud = load(file)
    assert isinstance(cloud, tl.Points)
    assert cloud.positions.tolist() == 2 * (TRIANGLE + [0, 0, 2]).tolist()
    assert cloud.colors[[0, 3]].tolist() == [[0, 188, 255, 255], [255, 0, 0, 255]]


def test_gltf_nodes_place_by_matrix_and_by_trs(load):
    file = GltfFile()
    mesh = file.mesh(file.primitive(TRIANGLE + [0, 0, 1]))
    child = file.node(mesh=mesh, rotation=[0.5, 0.5, 0.5, 0.5], scale=[2, 1, 1], translation=[0, 0, 1])  # x to y to z
    file.node(children=[child], matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 0, 0, 1])
    found = load(file)
    assert found.vertices == pytest.approx(np.array([[11, 0, 1], [11, 2, 1], [11, 0, 2]]), abs=1e-6)


def test_gltf_mirrored_node_keeps_the_outside(load):
    file = GltfFile()
    file.node(mesh=file.mesh(file.primitive(NORMAL=[[0, 0, 1]] * 3)), scale=[-1, 1, 1])
    found = load(file)
    a, b, c = found.vertices[found.triangles[0]]
    assert np.cross(b - a, c - a)[2] > 0
    assert found.normals[:, 2].tolist() == [1, 1, 1]


def test_gltf_shows_the_scene_that_it_names_and_tells_of_others(tmp_path):
    file = GltfFile(scenes=[{"nodes": [0]}, {"nodes": [1]}], scene=1)
    mesh = file.mesh(file.primitive())
    file.node(mesh=mesh, name="old")
    file.node(mesh=mesh, translation=[5, 0, 0])
    (tmp_path / "a.glb").write_bytes(file.glb())
    with pytest.warns(MeshWarning, match="nodes outside of its scene not drawn: 'old'"):
        assert tl.load(tmp_path / "a.glb").bounds[:, 0].tolist() == [5, 6]


@pytest.mark.parametrize("nodes", [[[1], [0]], [[0]], [[1, 1], []]])
def test_gltf_node_below_itself_is_refused(tmp_path, nodes):
    file = GltfFile(scenes=[{"nodes": [0]}], scene=0)
    for children in nodes:
        file.node(children=children)
    (tmp_path / "a.gltf").write_bytes(file.gltf())
    with pytest.raises(MeshError, match=r"is below itself|has two parents"):
        tl.load(tmp_path / "a.gltf")


def test_gltf_chain_of_50_000_nodes_is_read(load):
    file = GltfFile(scenes=[{"nodes": [0]}])
    n = 50_000
    mesh = file.mesh(file.primitive())
    file.tree["nodes"] = [{"children": [i + 1], "translation": [1, 0, 0]} for i in range(n)] + [{"mesh": mesh}]
    assert load(file).bounds[0, 0] == n


def test_gltf_sparse_accessor_sets_rows(load):
    file = GltfFile()
    at, values = file.view(np.array([1], np.uint16).tobytes()), file.view(np.array([7, 8, 9], np.float32).tobytes())
    sparse = {"count": 1, "indices": {"bufferView": at, "componentType": 5123}, "values": {"bufferView": values}}
    dense = file.accessor(TRIANGLE, sparse=sparse)
    empty = file.add("accessors", {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse})
    file.node(mesh=file.mesh({"attributes": {"POSITION": dense}}, {"attributes": {"POSITION": empty}}))
    assert corners(load(file)) == [[[0, 0, 0], [7, 8, 9], [0, 1, 0]], [[0, 0, 0], [7, 8, 9], [0, 0, 0]]]


@pytest.mark.parametrize(("of_color", "of_emission"), [(2, 0), (0, 3), (2, 3), (3, 1), (2, 2)])
def test_gltf_any_two_sets_of_texture_coordinates_are_read(load, of_color, of_emission):
    file = GltfFile()
    file.texture([[[9, 9, 9]]])
    color, emission = ({"index": 0, "texCoord": number} for number in (of_color, of_emission))
    row = {
        "pbrMetallicRoughness": {"baseColorTexture": color},
        "emissiveTexture": emission,
        "emissiveFactor": [1, 1, 1],
    }
    file.add("materials", row)
    uv = {f"TEXCOORD_{k}": np.full((3, 2), k / 8, np.float32) for k in range(4)}
    mesh = load(file.shown(material=0, **uv))
    sets, own = (mesh.uv, mesh.uv1), mesh.materials[0]
    assert sets[own.texture.uv_set][0, 0] == of_color / 8
    assert sets[own.emission_texture.uv_set][0, 0] == of_emission / 8


def test_gltf_third_set_of_texture_coordinates_of_a_material_is_told(tmp_path):
    file = GltfFile()
    file.texture([[[9, 9, 9]]])
    normal, emission, color = ({"index": 0, "texCoord": number} for number in (1, 3, 2))
    file.add("materials", {
        "name": "wood", "pbrMetallicRoughness": {"baseColorTexture": color}, "emissiveTexture": emission,
        "normalTexture": normal,
    })  # fmt: skip
    uv = {f"TEXCOORD_{k}": np.full((3, 2), k / 8, np.float32) for k in range(4)}
    (tmp_path / "a.glb").write_bytes(file.shown(material=0, **uv).glb())
    told = "textures on a third set of texture coordinates of one material not read: 'TEXCOORD_3 of wood'"
    with pytest.warns(MeshWarning, match=told):
        mesh = tl.load(tmp_path / "a.glb")
    assert (mesh.uv[0, 0], mesh.uv1[0, 0]) == (1 / 8, 2 / 8)
    assert mesh.materials[0].emission_texture is None


def test_gltf_tells_the_meshes_that_it_does_not_place(tmp_path):
    file = GltfFile().shown()
    file.tree["nodes"].append({"mesh": 0, "name": "spare"})
    file.tree["scenes"] = [{"nodes": [0]}]
    file.tree["meshes"][0]["primitives"].append({"attributes": {}})
    file.tree["meshes"].append({"primitives": []})
    (tmp_path / "a.glb").write_bytes(file.glb())
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert len(tl.load(tmp_path / "a.glb").triangles) == 1
    assert [str(one.message).split(": ", 1)[1] for one in told] == [
        "nodes outside of its scene not drawn: 'spare'",
        "meshes that no node places not drawn: 'meshes[1]'",
        "triangles without positions not drawn",
    ]


UNREAD = [
    "EXT_meshopt_compression", "KHR_meshopt_compression", "KHR_texture_basisu", "KHR_materials_clearcoat",
    "KHR_lights_punctual", "KHR_node_visibility", "KHR_animation_pointer", "KHR_xmp_json_ld", "KHR_materials_variants",
    "EXT_mesh_features", "EXT_new", "ext_texture_webp",
]  # fmt: skip


@pytest.mark.parametrize("read", [tl.load, tl.load_cameras])
@one_by_one("name", UNREAD)
def test_gltf_extension_that_is_required_and_not_read_is_refused_by_name(tmp_path, name, read):
    file = GltfFile(extensionsUsed=[name], extensionsRequired=["KHR_mesh_quantization", name]).shown()
    (tmp_path / "a.glb").write_bytes(file.glb())
    with pytest.raises(MeshError, match=f"it needs the extension {name}, which is not read"):
        read(tmp_path / "a.glb")


@one_by_one("name", UNREAD)
def test_gltf_extension_that_is_used_and_not_required_is_drawn_without_it(tmp_path, name):
    (tmp_path / "a.glb").write_bytes(GltfFile(extensionsUsed=[name]).shown().glb())
    with warnings.catch_warnings(record=True):
        warnings.simplefilter("always")
        assert len(tl.load(tmp_path / "a.glb").triangles) == 1


def compressed(file, fallback):
    """The JSON of a file whose views name a fallback beside the bytes of EXT_meshopt_compression."""
    tree = json.loads(file.gltf())
    for view in tree["bufferViews"]:
        view |= {"buffer": 1, "extensions": {"EXT_meshopt_compression": {"buffer": 0}}}
    junk = "data:application/octet-stream;base64," + base64.b64encode(bytes(range(200))).decode()
    tree["buffers"] = [{"byteLength": 200, "uri": junk}, {**tree["buffers"][0], **fallback}]
    return tree


def test_gltf_buffers_compressed_by_meshopt_are_read_where_the_file_has_them_plainly(tmp_path):
    tree = compressed(GltfFile(extensionsUsed=["EXT_meshopt_compression"]).shown(), {})
    (tmp_path / "a.gltf").write_text(json.dumps(tree))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert tl.load(tmp_path / "a.gltf").vertices.tolist() == TRIANGLE.tolist()


@pytest.mark.parametrize("suffix", ["gltf", "glb"])
@pytest.mark.parametrize("extensions", [{"EXT_meshopt_compression": {"fallback": True}}, {}])
def test_gltf_second_buffer_without_a_uri_is_not_the_binary_chunk(tmp_path, suffix, extensions):
    tree = compressed(GltfFile(extensionsUsed=["EXT_meshopt_compression"]).shown(), {"extensions": extensions})
    del tree["buffers"][0]["uri"], tree["buffers"][1]["uri"]
    text = json.dumps(tree).encode()
    (tmp_path / f"a.{suffix}").write_bytes(text if suffix == "gltf" else glb_of(text, bytes(range(200))))
    only = ", but by EXT_meshopt_compression, which is not read" if extensions else ""
    with pytest.raises(MeshError, match=rf"its buffer 'buffers\[1\]' is not there{only}$"):
        tl.load(tmp_path / f"a.{suffix}")


def test_gltf_with_textures_of_basis_universal_is_drawn_with_the_pictures_beside_them(tmp_path):
    file = GltfFile(extensionsUsed=["KHR_texture_basisu"])
    file.add("textures", {"source": file.image([[[1, 2, 3]]]), "extensions": {"KHR_texture_basisu": {"source": 9}}})
    file.add("textures", {"extensions": {"KHR_texture_basisu": {"source": 9}}})
    maps = {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}}
    file.add("materials", {"pbrMetallicRoughness": maps})
    uv = np.zeros((3, 2), np.float32)
    (tmp_path / "a.glb").write_bytes(file.shown(material=0, TEXCOORD_0=uv).glb())
    with pytest.warns(MeshWarning) as told:
        (material,) = tl.load(tmp_path / "a.glb").materials
    assert material.texture.image[0, 0].tolist() == [1, 2, 3, 255]
    assert material.metallic_roughness_texture is None
    assert [str(one.message).partition("': ")[2] for one in told] == [
        "extensions not read: 'KHR_texture_basisu'", "textures of KHR_texture_basisu not read",
    ]  # fmt: skip


def test_gltf_texture_coordinates_that_are_whole_numbers_do_not_wrap(load):
    file = GltfFile(extensionsRequired=["KHR_mesh_quantization"])
    uv = np.array([[0, 0], [4095, 0], [0, 65535]], np.uint16)
    assert load(file.shown(TEXCOORD_0=uv)).uv.tolist() == [[0, 1], [4095, 1], [0, -65534]]


def test_gltf_interleaved_and_quantized_attributes_are_read(load):
    rows = np.zeros(3, [("position", "<i2", 3), ("pad", "<i2"), ("normal", "i1", 3), ("pad1", "i1")])
    rows["position"], rows["normal"] = 32767 * TRIANGLE, [0, 0, 127]
    file = GltfFile(extensionsRequired=["KHR_mesh_quantization"])
    view = file.view(rows.tobytes(), byteStride=12)
    common = {"bufferView": view, "count": 3, "type": "VEC3", "normalized": True}
    position = file.add("accessors", {**common, "componentType": 5122})
    normal = file.add("accessors", {**common, "componentType": 5120, "byteOffset": 8})
    file.node(mesh=file.mesh({"attributes": {"POSITION": position, "NORMAL": normal}}), scale=[2, 2, 2])
    mesh = load(file)
    assert corners(mesh) == [(2 * TRIANGLE).tolist()]
    assert (mesh.normals[:, 2] > 0).all()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_gltf_vertex_colors_are_light_beside_a_material(load, dtype):
    light = np.array([[0, 0.5, 1, 0.25]] * 3)
    colors = light.astype(np.float32) if dtype == np.float32 else np.rint(light * np.iinfo(dtype).max).astype(dtype)
    file = GltfFile(materials=[{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}])
    row = file.accessor(colors, normalized=dtype != np.float32)
    mesh = load(file.shown(COLOR_0=row, material=0))
    assert mesh.colors[0].tolist() == [0, 188, 255, 64]
    assert mesh.materials[0].color == (255, 0, 0)


def test_gltf_light_is_linear_between_vertices(load):
    """Half red and half green light in the middle: sRGB 188, and not the 128 between the numbers."""
    file = GltfFile(materials=[{"extensions": {"KHR_materials_unlit": {}}}])
    colors = np.array([[1, 0, 0], [0, 1, 0], [0, 1, 0], [1, 0, 0]], np.float32)
    mesh = load(file.shown(QUAD, [0, 1, 2, 0, 2, 3], COLOR_0=colors, material=0))
    assert mesh.color_interpolation == "linear"
    low, high = mesh.bounds
    camera = tl.Camera.look_at(((low + high) / 2 + [0, 0, 5]).tolist(), ((low + high) / 2).tolist(), ortho_height=1.0)
    picture = tl.render(mesh, camera, (8, 8)).astype(int)
    assert np.abs(picture[4, 3:5, :2].mean(axis=0) - 188).max() <= 2


@pytest.mark.parametrize(
    ("filters", "expected"),
    [
        ({}, "trilinear"),
        ({"magFilter": 9728}, "pixelated"),
        ({"magFilter": 9728, "minFilter": 9987}, "pixelated"),
        ({"magFilter": 9728, "minFilter": 9728}, "nearest"),
        ({"magFilter": 9729, "minFilter": 9729}, "bilinear"),
    ],
)
def test_gltf_filters_are_told_apart(load, filters, expected):
    file = GltfFile()
    index = file.texture(np.zeros((2, 2, 3), np.uint8), **filters)
    file.tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}}]
    mesh = load(file.shown(TEXCOORD_0=[[0, 0], [1, 0], [0, 1]], material=0))
    assert mesh.materials[0].texture.filter == expected


def test_gltf_material_says_what_the_file_says(load):
    material = material_of(
        load,
        doubleSided=True,
        alphaMode="MASK",
        alphaCutoff=0.25,
        emissiveFactor=[0.5, 0, 1],
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 4}},
        pbrMetallicRoughness={"baseColorFactor": [0.5, 0, 1, 0.75], "metallicFactor": 0.25, "roughnessFactor": 0.5},
    )
    assert material.color == (188, 0, 255)
    assert (material.opacity, material.alpha_mode, material.alpha_cutoff) == (0.75, "mask", 0.25)
    assert (material.metallic, material.roughness) == (0.25, 0.5)
    assert material.emission == (2, 0, 4)
    assert material.double_sided


def test_gltf_material_defaults_are_those_of_the_standard(load):
    material = material_of(load)
    assert (material.color, material.metallic, material.roughness) == ((255, 255, 255), 1, 1)
    assert (material.double_sided, material.alpha_mode, material.unlit) == (False, "opaque", False)


@pytest.mark.parametrize(("cutoff", "n_shown"), [(0, 1), (1, 1), (1.1, 0), (-1, 1)])
def test_gltf_alpha_cutoff_above_one_hides_what_is_opaque(load, cutoff, n_shown):
    file = GltfFile(materials=[{"alphaMode": "MASK", "alphaCutoff": cutoff}]).shown(material=0)
    mesh = load(file)
    camera = tl.Camera.look_at((0.25, 0.25, 1), (0.25, 0.25, 0))
    picture = tl.render(mesh, camera, (8, 8), background=(0, 0, 0, 0))
    assert int(picture[4, 4, 3]) == 255 * n_shown


def test_gltf_unlit_material_is_unlit(load):
    material = material_of(load, extensions={"KHR_materials_unlit": {}}, alphaMode="BLEND")
    assert (material.unlit, material.is_metallic_rough, material.alpha_mode) == (True, False, "blend")


def test_gltf_textures_have_their_places(load):
    file = GltfFile()
    grey = np.full((2, 2, 3), 100, np.uint8)
    one, two = file.texture(grey), file.texture(grey, wrapS=33071, wrapT=33648, magFilter=9728)
    file.tree["materials"] = [
        {
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": one},
                "metallicRoughnessTexture": {"index": two, "texCoord": 1},
            },
            "occlusionTexture": {"index": two, "texCoord": 1, "strength": 0.5},
            "normalTexture": {"index": one, "scale": 2},
            "emissiveTexture": {"index": one},
        }
    ]
    uv = [[0, 0], [1, 0], [0, 0.25]]
    mesh = load(file.shown(TEXCOORD_0=uv, TEXCOORD_1=uv, material=0))
    (material,) = mesh.materials
    assert mesh.uv.tolist() == [[0, 1], [1, 1], [0, 0.75]]
    assert mesh.uv1.tolist() == mesh.uv.tolist()
    rough = material.metallic_roughness_texture
    assert (rough.encoding, rough.uv_set, rough.wrap, rough.filter) == ("linear", 1, ("clamp", "mirror"), "pixelated")
    assert material.occlusion_texture is rough
    assert (material.texture.encoding, material.texture.filter) == ("srgb", "trilinear")
    assert material.emission_texture is material.texture
    assert (material.normal_texture.encoding, material.normal_scale) == ("linear", 2)
    assert material.occlusion_strength == 0.5


def test_gltf_texture_transform_turns_about_the_upper_left_corner(load):
    file = GltfFile(extensionsUsed=["KHR_texture_transform"])
    transform = {"offset": [0.5, 0.25], "rotation": np.pi / 2, "scale": [2, 3], "texCoord": 1}
    info = {"index": file.texture(np.zeros((1, 1, 3))), "extensions": {"KHR_texture_transform": transform}}
    file.tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": info}}]
    uv = [[0, 0], [1, 0], [0, 1]]
    mesh = load(file.shown(TEXCOORD_0=uv, TEXCOORD_1=uv, material=0))
    texture = mesh.materials[0].texture
    assert texture.uv_set == 1
    found = np.column_stack([mesh.uv1, np.ones(3)]) @ texture.transform.T
    down = np.column_stack([found[:, 0], 1 - found[:, 1]])
    # of (u, v) downwards: (2 u, 3 v), turned counter-clockwise as one sees it, then moved
    assert down == pytest.approx(np.array([[0.5, 0.25], [0.5, 0.25 - 2], [3.5, 0.25]]), abs=1e-6)


def test_gltf_webp_texture_is_read(load):
    import io

    from PIL import Image

    stream = io.BytesIO()
    Image.new("RGB", (2, 1), (10, 200, 30)).save(stream, format="WEBP", lossless=True)
    file = GltfFile(extensionsRequired=["EXT_texture_webp"])
    image = file.add("images", {"bufferView": file.view(stream.getvalue()), "mimeType": "image/webp"})
    file.add("textures", {"extensions": {"EXT_texture_webp": {"source": image}}})
    file.tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    mesh = load(file.shown(TEXCOORD_0=[[0, 0]] * 3, material=0))
    assert mesh.materials[0].texture.image[0, 0].tolist() == [10, 200, 30, 255]


def test_gltf_morph_weights_at_rest_move_vertices(load):
    file = GltfFile()
    targets = [{"POSITION": file.accessor([[0, 0, z]] * 3)} for z in (1.0, 10.0)]
    primitive = file.primitive(targets=targets)
    mesh = file.mesh(primitive, weights=[0.5, 0])
    file.node(mesh=mesh)
    file.node(mesh=mesh, weights=[0, 0.25])
    assert sorted({z for row in corners(load(file)) for _, _, z in row}) == [0.5, 2.5]


def test_gltf_skin_at_rest_stands_where_its_joints_are(load):
    file = GltfFile()
    bind = np.tile(np.eye(4), (2, 1, 1))
    bind[1, 3, :3] = [0, -1, 0]  # columns are rows in the file
    primitive = file.primitive(
        JOINTS_0=np.array([[0, 1, 0, 0]] * 3, np.uint8),
        WEIGHTS_0=np.array([[1, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]], np.float32),
    )
    skin = file.add("skins", {"joints": [1, 2], "inverseBindMatrices": file.accessor(bind.reshape(2, 16))})
    file.node(mesh=file.mesh(primitive), skin=skin, translation=[100, 0, 0])
    file.node(translation=[0, 0, 1])
    file.node(translation=[3, 1, 0])
    assert corners(load(file)) == [[[0, 0, 1], [1, 0, 1], [3, 1, 0]]]


def test_gltf_instances_are_all_there(load):
    file = GltfFile(extensionsRequired=["EXT_mesh_gpu_instancing"])
    places = {"attributes": {"TRANSLATION": file.accessor([[1.0, 0, 0], [5, 0, 0]])}}
    file.node(mesh=file.mesh(file.primitive()), extensions={"EXT_mesh_gpu_instancing": places})
    assert load(file).vertices[:, 0].tolist() == [1, 2, 1, 5, 6, 5]


@pytest.mark.parametrize(
    ("diffuse", "specular", "expected", "metallic"),
    [
        ([1, 0, 0, 0.5], [0.04] * 3, (255, 0, 0), 0),
        ([0, 0, 0, 0.5], [1, 0.5, 0], (255, 188, 0), 1),
        ([0.24 / 0.73] * 3 + [0.5], [0.27] * 3, (188, 188, 188), 0.5),  # of 0.5, half of it metal
    ],
)
def test_gltf_spec_gloss_material_is_made_metallic_rough_and_told(tmp_path, diffuse, specular, expected, metallic):
    gloss = {"diffuseFactor": diffuse, "specularFactor": specular, "glossinessFactor": 0.75}
    file = GltfFile(materials=[{"extensions": {"KHR_materials_pbrSpecularGlossiness": gloss}}]).shown(material=0)
    (tmp_path / "a.glb").write_bytes(file.glb())
    with pytest.warns(MeshWarning, match="made metallic-rough"):
        (material,) = tl.load(tmp_path / "a.glb").materials
    assert material.color == pytest.approx(expected, abs=1)
    assert (material.metallic, material.roughness) == (pytest.approx(metallic, abs=1e-3), 0.25)
    assert material.opacity == 0.5


def test_gltf_spec_gloss_wins_over_the_metallic_rough_material_beside_it(tmp_path):
    gloss = {"diffuseFactor": [1, 0, 0, 1], "specularFactor": [0.04] * 3, "glossinessFactor": 0.75}
    fallback = {"baseColorFactor": [0, 1, 0, 1], "roughnessFactor": 0.5}
    row = {"pbrMetallicRoughness": fallback, "extensions": {"KHR_materials_pbrSpecularGlossiness": gloss}}
    unlit = {**row, "extensions": {**row["extensions"], "KHR_materials_unlit": {}}}
    file = GltfFile(materials=[row, unlit])
    file.node(mesh=file.mesh(file.primitive(material=0), file.primitive(material=1)))
    (tmp_path / "a.glb").write_bytes(file.glb())
    with pytest.warns(MeshWarning, match="made metallic-rough"):
        glossy, plain = tl.load(tmp_path / "a.glb").materials
    assert (glossy.color, glossy.roughness) == ((255, 0, 0), 0.25)
    assert (plain.color, plain.unlit) == ((0, 255, 0), True)  # which has the base colour, and nothing else


def test_gltf_spec_gloss_textures_become_metallic_rough_ones(tmp_path):
    file = GltfFile()
    info = {"index": file.texture(np.full((2, 2, 4), (255, 0, 0, 100), np.uint8))}
    shiny = {"index": file.texture(np.full((1, 1, 4), (56, 56, 56, 55), np.uint8))}
    gloss = {"diffuseTexture": info, "specularGlossinessTexture": shiny}
    file.tree["materials"] = [{"extensions": {"KHR_materials_pbrSpecularGlossiness": gloss}}]
    (tmp_path / "a.glb").write_bytes(file.shown(TEXCOORD_0=[[0, 0]] * 3, material=0).glb())
    with pytest.warns(MeshWarning, match="made metallic-rough"):
        (material,) = tl.load(tmp_path / "a.glb").materials
    assert material.texture.image[1, 1].tolist() == [255, 0, 0, 100]
    _, rough, metal, _ = material.metallic_roughness_texture.image[1, 1].tolist()
    assert rough == 200
    assert metal <= 1


@pytest.mark.parametrize(
    ("tree", "message"),
    [
        ({"extensionsUsed": ["KHR_materials_clearcoat"]}, "extensions not read: 'KHR_materials_clearcoat'"),
        ({"animations": [{}]}, "animations not played: everything is at rest"),
    ],
)
def test_gltf_what_is_not_read_is_told_once(tmp_path, tree, message):
    (tmp_path / "a.glb").write_bytes(GltfFile(**tree).shown().glb())
    with pytest.warns(MeshWarning, match=message) as caught:
        tl.load(tmp_path / "a.glb")
    assert len(caught) == 1
    assert caught[0].filename == __file__


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'{"asset": {"version": "1.0"}}', "it is glTF 1.0, and 2.0 is read"),
        (b'{"meshes": {}}', "it is glTF 1.0, and 2.0 is read"),
        (b"glTF\1\0\0\0" + bytes(12), "it is glTF 1.0, and 2.0 is read"),
        (b'{"asset": {"version": "3.0"}}', "its version of glTF is '3.0'"),
        (b'{"asset": {"version": "2.1", "minVersion": "2.1"}}', "it needs version '2.1' of glTF, and 2.0 is read"),
        (b'{"asset": {"version": "2.0", "minVersion": 3}}', "it needs version '3' of glTF, and 2.0 is read"),
        (b"[1, 2]", "its JSON is no object"),
        (b"[" * 100_000, "nested too deeply|broken"),
        (glb_of(b"{", b""), "broken, or not a '.gltf' file"),
    ],
)
def test_gltf_of_another_kind_is_refused_in_true_words(tmp_path, content, message):
    (tmp_path / "a.gltf").write_bytes(content)
    with pytest.raises(MeshError, match=message) as caught:
        tl.load(tmp_path / "a.gltf")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("asset", [{"version": "2.1"}, {"version": "2.1", "minVersion": "2.0"}])
def test_gltf_of_a_later_version_that_2_0_may_read_is_read(load, asset):
    assert len(load(GltfFile(asset=asset).shown()).triangles) == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda tree: tree["accessors"][0].update(count=4), "ends beyond its 36 bytes"),
        (lambda tree: tree["accessors"][0].update(count=1 << 40), "more than the 4194304 of max_vertices"),
        (lambda tree: tree["accessors"][0].update(byteOffset=4), "ends beyond its 36 bytes"),
        (lambda tree: tree["accessors"][0].update(count=-1), "count must be a whole number, got -1"),
        (lambda tree: tree["bufferViews"][0].update(byteLength=37), "ends at byte 37 of a buffer of 36"),
        (lambda tree: tree["bufferViews"][0].update(byteOffset=-4), "byteOffset must be a whole number"),
        (lambda tree: tree["buffers"][0].update(byteLength=1 << 50), "has 36 of its"),
        (lambda tree: tree["nodes"][0].update(mesh=-1), r"meshes\[-1\] is not one of 1"),
        (lambda tree: tree["nodes"][0].update(mesh=True), r"meshes\[True\] is no entry"),
        (lambda tree: tree["accessors"][0].update(componentType=7), "which is no type"),
        (lambda tree: tree["meshes"][0]["primitives"][0].update(material=9), r"materials\[9\] is not one of 0"),
    ],
)
def test_gltf_numbers_that_lie_are_refused(tmp_path, change, message):
    tree = json.loads(GltfFile().shown().gltf())
    change(tree)
    (tmp_path / "a.gltf").write_text(json.dumps(tree))
    with pytest.raises(MeshError, match=message):
        tl.load(tmp_path / "a.gltf")


def test_gltf_index_beyond_the_vertices_is_refused(tmp_path):
    file = GltfFile().shown(TRIANGLE, [0, 1, 3], NORMAL=[[0, 0, 1]] * 3)
    (tmp_path / "a.glb").write_bytes(file.glb())
    with pytest.raises(MeshError, match=r"indices in \[0, 3\)"):
        tl.load(tmp_path / "a.glb")


def test_gltf_many_instances_stop_at_max_vertices(tmp_path):
    file = GltfFile()
    mesh = file.mesh(file.primitive())
    for _ in range(20):
        file.node(mesh=mesh)
    (tmp_path / "a.glb").write_bytes(file.glb())
    with pytest.raises(MeshError, match="has 33 vertices, more than the 30 of max_vertices"):
        tl.load(tmp_path / "a.glb", max_vertices=30)
    assert len(tl.load(tmp_path / "a.glb", max_vertices=60).vertices) == 60


# Cameras


def test_load_cameras_of_gltf_see_what_the_file_means(tmp_path):
    file = GltfFile().shown()
    lens = {"yfov": np.pi / 2, "znear": 0.1}
    file.tree["cameras"] = [
        {"type": "perspective", "perspective": lens},
        {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2, "znear": 1, "zfar": 9}},
    ]
    file.node(camera=0, translation=[0, 0, 5], scale=[2, 2, 2])
    file.node(camera=1, translation=[0, 0, 5])
    (tmp_path / "a.glb").write_bytes(file.glb())
    perspective, ortho = tl.load_cameras(tmp_path / "a.glb")
    clip = perspective.clip_from_world((200, 100)) @ [2.5, 2.5, 0, 1]
    assert clip[:2] / clip[3] == pytest.approx([0.25, 0.5])
    far = perspective.clip_from_world((100, 100)) @ [0, 0, -1e9, 1]
    assert far[2] / far[3] == pytest.approx(1)
    clip = ortho.clip_from_world((200, 100)) @ [2, 1, 4, 1]
    assert clip.tolist() == pytest.approx([0.5, 0.5, -1, 1])
    assert tl.render(tmp_path and tl.load(tmp_path / "a.glb"), perspective, (64, 48)).min() < 255


def test_load_cameras_of_other_formats_are_none(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\n")
    assert tl.load_cameras(tmp_path / "a.obj") == []
    with pytest.raises(FileNotFoundError, match="there is no file"):
        tl.load_cameras(tmp_path / "b.glb")


# ---- Draco ----------------------------------------------------------------------------------------------------------

DRACO = "KHR_draco_mesh_compression"


def draco_file(content, n_vertices, n_corners, position_id=0):
    file = GltfFile(extensionsRequired=[DRACO])
    position = file.add("accessors", {"componentType": 5126, "count": n_vertices, "type": "VEC3"})
    indices = file.add("accessors", {"componentType": 5125, "count": n_corners, "type": "SCALAR"})
    packed = {DRACO: {"bufferView": file.view(content), "attributes": {"POSITION": position_id}}}
    file.node(mesh=file.mesh({"attributes": {"POSITION": position}, "indices": indices, "extensions": packed}))
    return file


def grid_of_draco(n, **options):
    """n * n squares, flat."""
    draco = pytest.importorskip("DracoPy", reason="needs DracoPy, of the extra formats")
    y, x = np.mgrid[0 : n + 1, 0 : n + 1].reshape(2, -1)
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    triangles = np.concatenate([first[:, None] + [0, 1, n + 2], first[:, None] + [0, n + 2, n + 1]])
    positions = np.stack([x, y, 0 * x], axis=1).astype(np.float32)
    return draco.encode(positions, triangles.astype(np.uint32), **options), len(positions), triangles.size


@pytest.mark.parametrize("level", [0, 1, 7, 10])
@pytest.mark.parametrize("n", [1, 200])
def test_gltf_of_draco_is_read(load, level, n):
    mesh = load(draco_file(*grid_of_draco(n, compression_level=level, quantization_bits=14)))
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    assert len(mesh.triangles) == 2 * n * n
    assert np.cross(b - a, c - a)[:, 2].sum() / 2 == pytest.approx(n * n, rel=1e-3)


@pytest.mark.parametrize("level", [0, 7])
def test_gltf_of_draco_that_declares_too_much_is_refused_before_it_is_unpacked(tmp_path, monkeypatch, level):
    content, *n = grid_of_draco(200, compression_level=level)
    monkeypatch.setattr("DracoPy.decode", lambda content: pytest.fail("it was unpacked"))
    tmp_path.joinpath("a.glb").write_bytes(draco_file(content, *n).glb())
    with pytest.raises(MeshError, match="has 80000 triangles, more than the 79999 of max_triangles"):
        tl.load(tmp_path / "a.glb", max_triangles=79_999)
    with pytest.raises(MeshError, match="has 40401 vertices, more than the 40400 of max_vertices"):
        tl.load(tmp_path / "a.glb", max_vertices=40_400)


@pytest.mark.parametrize("level", [0, 1, 7, 10])
@pytest.mark.parametrize("n", [1, 3, 260])
def test_draco_attributes_are_found_behind_the_connectivity(level, n):
    n_vertices = (n + 1) ** 2
    uv = np.random.default_rng(n).uniform(0, 1, (n_vertices, 2))
    own = {1: np.zeros((n_vertices, 5), np.uint8), 2: np.zeros((n_vertices, 3))}
    content, *_ = grid_of_draco(n, compression_level=level, tex_coord=uv, generic_attributes=own)
    size = declared_by_draco(content)
    assert (size.n_triangles, size.n_vertices) == (2 * n * n, n_vertices)
    assert size.row_bytes == 12 + 8 + 4 * 5 + 4 * 3
    assert size.n_rows in (n_vertices, 6 * n * n)


@pytest.mark.parametrize("level", [0, 7])
def test_gltf_of_draco_with_more_attributes_than_its_vertices_allow_is_refused(tmp_path, monkeypatch, level):
    """As a file of 58 kB of 201**2 vertices, which took 1 GB."""
    own = {k: np.zeros((101**2, 120), np.uint32) for k in range(4)}
    content, *n = grid_of_draco(100, compression_level=level, generic_attributes=own)
    monkeypatch.setattr("DracoPy.decode", lambda content: pytest.fail("it was unpacked"))
    tmp_path.joinpath("a.glb").write_bytes(draco_file(content, *n).glb())
    with pytest.raises(MeshError, match=r"has (307942|1811250) vertices, more than the 250000 of max_vertices"):
        tl.load(tmp_path / "a.glb", max_vertices=250_000)


def test_gltf_of_draco_counts_the_attributes_of_all_parts(tmp_path):
    own = {0: np.zeros((201**2, 100), np.uint32)}
    content, n_vertices, n_corners = grid_of_draco(200, compression_level=7, generic_attributes=own)
    file = draco_file(content, n_vertices, n_corners, position_id=1)
    n_like = n_corners * 412 // 64  # there may be seams
    path = tmp_path / "a.glb"
    path.write_bytes(file.glb())
    assert len(tl.load(path, max_vertices=2 * n_like).triangles) == n_corners / 3
    file.tree["meshes"][0]["primitives"] *= 3
    path.write_bytes(file.glb())
    with pytest.raises(MeshError, match=f"vertices, more than the {2 * n_like} of max_vertices"):
        tl.load(path, max_vertices=2 * n_like)


def packed_tags(tags, chances):
    """The states of an asymmetric numeral system, from the last tag to the first, as Draco writes them."""
    before, state, packed = np.cumsum([0, *chances]).tolist(), 1 << 14, bytearray()
    for tag in reversed(tags):
        while state >= chances[tag] << 10:
            packed.append(state & 255)
            state >>= 8
        high, low = divmod(state, chances[tag])
        state = (high << 12) + low + before[tag]
    last = state - (1 << 14)
    n = next(n for n in range(1, 5) if last < 1 << 8 * n - 2)
    return bytes(packed) + (last | n - 1 << 8 * n - 2).to_bytes(n, "little")


@pytest.mark.parametrize("n", [1, 2, 7, 300])
def test_draco_symbols_with_tags_are_skipped_with_their_bits(n):
    chances = [0, 3000, 1000, 0, 0, 90, 6]
    table = bytes([7, 3]) + b"".join((c << 2 | 1).to_bytes(2, "little") for c in chances[1:3])
    table += bytes([1 << 2 | 3]) + b"".join((c << 2 | 1).to_bytes(2, "little") for c in chances[5:])
    tags = np.random.default_rng(n).choice(7, n, p=np.array(chances) / 4096).tolist()
    packed = packed_tags(tags, chances)
    size = (
        len(packed).to_bytes(1, "little") if len(packed) < 128 else bytes([len(packed) & 127 | 128, len(packed) >> 7])
    )
    values = b"\xff" * ((sum(tags) + 7) // 8)
    rest = DracoBytes(b"\0" + table + size + packed + values + b"\x4d", 0)
    rest.skip_symbols(n)
    assert rest.byte() == 0x4D


def test_draco_more_symbols_with_tags_than_are_read_are_refused_with_the_number():
    content = b"DRACO\2\2\1\1\0\0" + b"\2\4\4\1\0\0\0" + b"\0\0" * 2 + b"\x81\x80\x40\0"
    with pytest.raises(MeshError, match="has 1048577 symbols with tags, more than 1048576"):
        declared_by_draco(content)


def test_draco_metadata_is_skipped():
    content, _, _ = grid_of_draco(3)
    entry = b"\x01a\x02xy"
    own = b"\x01" + entry + b"\x00"  # one entry, nothing below
    nested = b"\x00\x01\x01b" + own
    packed = content[:9] + b"\x00\x80" + b"\x02\x00" + own + b"\x01" + nested + own + content[11:]
    assert declared_by_draco(packed) == declared_by_draco(content) == (18, 16, 16, 12)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "no mesh of Draco 2.2"),
        (b"DRACO\2\1\1\1\0\0", "no mesh of Draco 2.2"),
        (b"DRACO\2\2\0\1\0\0", "no mesh of Draco 2.2"),
        (b"DRACO\2\2\1\1\0\0\0\x80", "is cut off"),
        (b"DRACO\2\2\1\1\0\0\0" + b"\x80" * 1000, "has no end"),
        (b"DRACO\2\2\1\1\0\x80\0" + b"\0\1\0" * 100, "nested too deep"),
        (b"DRACO\2\2\1\1\0\0\0\4\2", "cannot read"),
    ],
)
def test_gltf_of_draco_that_is_broken_is_told(load, content, message):
    pytest.importorskip("DracoPy", reason="needs DracoPy, of the extra formats")
    with pytest.raises(MeshError, match=message):
        load(draco_file(content, 4, 6))
