"""OBJ and MTL: what the file says, and nothing that it does not say."""

import warnings

import numpy as np
import pytest
from PIL import Image

import topleft as tl
from topleft.errors import MeshError, MeshWarning

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


@pytest.fixture
def load(tmp_path):
    def read(text, mtl=None, **options):
        if mtl is not None:
            (tmp_path / "a.mtl").write_text(mtl)
            text = "mtllib a.mtl\n" + text
        (tmp_path / "a.obj").write_bytes(text if isinstance(text, bytes) else text.encode())
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return tl.load(tmp_path / "a.obj", **options)

    return read


def material_of(load, mtl):
    return load(SQUARE + "usemtl m\nf 1/1 2/2 3/3\n", "newmtl m\n" + mtl).materials[0]


def picture(tmp_path, name, pixels):
    Image.fromarray(np.asarray(pixels, np.uint8)).save(tmp_path / name)


def area(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)[:, 2] / 2


def test_obj_concave_polygon_covers_itself_alone(load):
    arrow = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n"
    mesh = load(arrow)
    assert area(mesh).sum() == 10
    assert (area(mesh) > 0).all()


def test_obj_words_of_all_kinds_in_one_file(load):
    text = "vn 0 0 1\n" + SQUARE + "f 1 2 3\nf 1/1 3/3 4/4\nf 1//1 2//1 3//1\nf 1/1/1 3/3/1 4/4/1\nf -4/ -3/ -2/\n"
    mesh = load(text)
    assert len(mesh.triangles) == 5
    assert sorted(area(mesh).tolist()) == [0.5] * 5


def test_obj_blanks_comments_and_lines_that_go_on(load):
    text = "#c\n  v 0 0 0 # first\r\nv\t1 0 0\nv 0 1 \\\n 0\n\n  f 1 \\\r\n2 3\n#f 1 1 1"
    assert load(text).vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_obj_in_utf_16_is_read(load):
    assert len(load((SQUARE + "f 1 2 3\n").encode("utf-16")).triangles) == 1


def test_obj_vertex_colors_with_opacity_are_kept(load):
    text = "v 0 0 0 1 0 0 0.5\nv 1 0 0 0 1 0 1\nv 0 1 0 0 0 1 0\nf 1 2 3\n"
    assert load(text).colors.tolist() == [[255, 0, 0, 128], [0, 255, 0, 255], [0, 0, 255, 0]]


def test_obj_faces_keep_their_order_whatever_their_material(load):
    text = SQUARE + "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nusemtl a\nf 2 3 4\n"
    mesh = load(text, "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n")
    assert mesh.material_of_triangle.tolist() == [0, 1, 0]
    assert [material.color for material in mesh.materials] == [(255, 0, 0), (0, 255, 0)]


def test_obj_400_materials_take_no_longer_than_one(load):
    import time

    rows = np.random.default_rng(1).random((5000, 3))
    vertices = "".join(f"v {x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in rows)
    faces = [f"f {i + 1} {i + 2} {i + 3}\n" for i in range(4000)]
    mtl = "".join(f"newmtl m{i}\nKd 0 {i // 200} {i % 200 / 255}\n" for i in range(400))
    took = []
    for n in (1, 400):
        parts = [f"usemtl m{i * n // 4000}\n" + face for i, face in enumerate(faces)]
        start = time.process_time()
        mesh = load(vertices + "".join(parts), mtl)
        took.append(time.process_time() - start)
        assert len(mesh.materials) == n
    assert took[1] < 4 * took[0] + 0.1  # once it was a hundred times


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SQUARE + "f 1 2 9\n", "a face names v 9 of 4"),
        (SQUARE + "f 0 1 2\n", "a face names v 0: they count from 1"),
        (SQUARE + "f -9 1 2\n", "a face names a v line before the first"),
        (SQUARE + "f 1 2 3.5\n", "a number in it is none"),
        (SQUARE + "f 1/2/3/4 2 3\n", "a face of it is no list of indices"),
        ("v 1\nf 1 1 1\n", "its vertex 1 has 1 of 3 numbers"),
    ],
)
def test_obj_broken_is_refused(load, text, message):
    with pytest.raises(MeshError, match=message):
        load(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("l 1 2\n", "lines not drawn"),
        ("p 1\n", "points not drawn"),
        ("usemtl red\n", "materials without a library: 'red'"),
        ("mtllib gone.mtl\nusemtl m\n", "material libraries not found: 'gone.mtl'"),
        ("mtllib a.obj\nusemtl m\n", "materials not in its libraries: 'm'"),
        ("mtllib ../a.mtl\nusemtl m\n", "material libraries outside of its folder not read: '../a.mtl'"),
        ("f 1/9 2/9 3/9\n", "texture coordinates that faces name and that are not there"),
    ],
)
def test_obj_what_is_missing_is_told(tmp_path, text, message):
    (tmp_path / "a.obj").write_text(SQUARE + text + "f 1 2 3\n")
    with pytest.warns(MeshWarning, match=message):
        tl.load(tmp_path / "a.obj")


def test_obj_vertices_without_a_colour_beside_others_are_white(load):
    mesh = load("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 0 1 0.2\nv 0 2 0 1\nf 1 2 3\nf 1 2 4\n")
    colors = {tuple(at): tuple(color) for at, color in zip(mesh.vertices[:, :2], mesh.colors, strict=True)}
    white = (255, 255, 255, 255)
    assert colors == {(0, 0): (255, 0, 0, 255), (1, 0): white, (0, 1): (0, 0, 255, 51), (0, 2): white}


# MTL


def test_mtl_without_highlights_has_none(load):
    material = material_of(load, "Kd 0 1 0\n")
    assert (material.color, material.specular) == ((0, 255, 0), 0)
    mesh = load(SQUARE + "usemtl m\nf 1 2 3 4\n", "newmtl m\nKd 0 1 0\n")
    shot = tl.render(mesh, tl.Camera.framing(mesh, azimuth_deg=0, elevation_deg=0), (32, 32))
    assert shot[16, 16, 0] == shot[16, 16, 2] == 0  # no white haze


@pytest.mark.parametrize("mtl", ["Ks .5 .5 .5\n", "Ns 20\n", "Ks .5 .5 .5\nNs 0\n", "Ks .5 .5 .5\nNs 20\nillum 1\n"])
def test_mtl_with_half_a_highlight_has_none(load, mtl):
    assert material_of(load, mtl).specular == 0


def test_mtl_highlights_are_those_of_the_file(load):
    material = material_of(load, "Ks .5 .25 .75\nNs 20\nillum 2\n")
    assert (material.specular, material.shininess) == (0.5, 20)


@pytest.mark.parametrize(
    ("mtl", "opacity", "mode"),
    [
        ("d 0.25\n", 0.25, "blend"),
        ("d -halo 0.25\n", 0.25, "blend"),
        ("Tr 0.75\n", 0.25, "blend"),
        ("d 0.5\nTr 0.5\n", 0.5, "blend"),
        ("Tr 1\n", 1, "opaque"),
        ("d 1\n", 1, "opaque"),
    ],
)
def test_mtl_opacity_blends(load, mtl, opacity, mode):
    material = material_of(load, mtl)
    assert (material.opacity, material.alpha_mode) == (opacity, mode)


def test_mtl_map_options_place_the_texture(load, tmp_path):
    picture(tmp_path, "my picture.png", np.zeros((2, 2, 3)))
    material = material_of(load, "map_Kd -s 2 3 1 -o 0.5 -clamp on -mm 0 1 my picture.png\n")
    assert material.texture.transform.tolist() == [[2, 0, 0.5], [0, 3, 0]]
    assert material.texture.wrap == ("clamp", "clamp")
    assert material.color is None


@pytest.mark.parametrize("name", ["a.png", "a b.png", "a -s 2.png"])
@pytest.mark.parametrize(
    ("behind", "at"), [("-s 2 3 -o 0 0.25 -clamp on", 0.25), ("-clamp on  -s 2 3 1 -mm 0.0 1.0 -cc off", 0)]
)
def test_mtl_map_options_may_stand_behind_the_name(load, tmp_path, name, behind, at):
    picture(tmp_path, name, np.zeros((2, 2, 3)))
    texture = material_of(load, f"map_Kd {name} {behind}\n").texture
    assert (texture.transform.tolist(), texture.wrap) == ([[2, 0, 0], [0, 3, at]], ("clamp", "clamp"))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_mtl_is_read_in_every_encoding(tmp_path, encoding):
    mark = "\ufeff" if encoding[-3:] in ("-le", "-be") else ""
    (tmp_path / "a.mtl").write_text(mark + "newmtl grün\nKd 1 0 0\n", encoding=encoding)
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + SQUARE + "usemtl grün\nf 1 2 3\n", encoding="utf-8")
    assert tl.load(tmp_path / "a.obj").materials[0].color == (255, 0, 0)


def test_mtl_alpha_of_a_colour_map_is_not_opacity_but_map_d_is(load, tmp_path):
    picture(tmp_path, "a.png", np.full((2, 2, 4), (10, 20, 30, 0)))
    picture(tmp_path, "d.png", [[0, 255], [255, 255]])
    assert material_of(load, "map_Kd a.png\n").texture.image[0, 0].tolist() == [10, 20, 30, 255]
    material = material_of(load, "map_Kd a.png\nmap_d d.png\n")
    assert material.texture.image.tolist() == [
        [[10, 20, 30, 0], [10, 20, 30, 255]],
        [[10, 20, 30, 255], [10, 20, 30, 255]],
    ]
    assert material.alpha_mode == "mask"
    picture(tmp_path, "e.png", np.full((1, 1), 100))
    assert material_of(load, "Kd 1 0 0\nmap_d e.png\n").alpha_mode == "blend"


def test_mtl_emission_is_light(load, tmp_path):
    picture(tmp_path, "a.png", np.full((1, 1, 3), 9))
    assert material_of(load, "Ke 1 0 0.5\n").emission == pytest.approx((1, 0, 0.21404), abs=1e-5)
    material = material_of(load, "map_Ke a.png\n")
    assert (material.emission, material.emission_texture.encoding) == ((1, 1, 1), "srgb")


def test_mtl_bump_is_a_normal_map_or_heights(load, tmp_path):
    picture(tmp_path, "n.png", np.full((2, 2, 3), (128, 128, 255)))
    picture(tmp_path, "h.png", [[0, 51, 102, 153], [0, 51, 102, 153]])
    normals = material_of(load, "map_Bump -bm 0.5 n.png\n")
    assert (normals.normal_scale, normals.normal_texture.encoding) == (0.5, "linear")
    assert material_of(load, "norm n.png\n").normal_texture.image[0, 0].tolist() == [128, 128, 255, 255]
    heights = material_of(load, "bump -bm 2.5 h.png\n").normal_texture.image
    assert heights[0, 1, :3].tolist() == [37, 128, 218]  # up by 1 in 1: (-1, 0, 1) / sqrt 2


def test_mtl_metallic_rough_maps_become_one(load, tmp_path):
    picture(tmp_path, "r.png", np.full((2, 2), 60))
    picture(tmp_path, "m.png", np.full((1, 1), 200))
    material = material_of(load, "map_Pr r.png\nmap_Pm m.png\n")
    assert (material.roughness, material.metallic) == (1, 1)
    assert material.metallic_roughness_texture.image[0, 0, 1:3].tolist() == [60, 200]
    assert material_of(load, "Pr 0.3\n").metallic == 0


@pytest.mark.parametrize(
    ("mtl", "message"),
    [
        ("map_Kd gone.png\n", "textures not found: 'gone.png'"),
        ("map_Kd /etc/passwd\n", "textures outside of its folder not read: '/etc/passwd'"),
        ("map_Kd ../../etc/passwd\n", "textures outside of its folder not read"),
        ("map_Kd http://a.example/b.png\n", "textures outside of its folder not read"),
        ("map_Kd a.mtl\n", "textures that cannot be read: 'a.mtl'"),
        ("map_Ks a.png\n", "map_Ks of its materials not read"),
        ("map_Ka a.png\n", "map_Ka of its materials not read"),
        ("map_rma a.png\n", "map_rma of its materials not read"),
        ("map_Kd -mm 0.1 2\n", "options of maps not read: '-mm'"),
        ("Kd 1 0 0\nnewmtl m\nKd 0 1 0\n", "materials defined again, of which the last is drawn: 'm'"),
        ("d 0\n", "materials that are wholly transparent"),
    ],
)
def test_mtl_what_is_missing_is_told(tmp_path, mtl, message):
    (tmp_path / "a.mtl").write_text("newmtl m\n" + mtl)
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + SQUARE + "usemtl m\nf 1/1 2/2 3/3\n")
    with pytest.warns(MeshWarning, match=message) as caught:
        tl.load(tmp_path / "a.obj")
    assert len(caught) == 1


@pytest.mark.filterwarnings("error::topleft.MeshWarning")
@pytest.mark.parametrize("mtl", ["map_Ka a.png\nmap_Kd a.png\n", "map_Kd a.png\nmap_Ka a.png\n"])
def test_mtl_ambient_map_beside_that_of_colour_is_not_missed(load, tmp_path, mtl):
    picture(tmp_path, "a.png", np.zeros((1, 1, 3)))
    assert material_of(load, mtl).texture is not None


@pytest.mark.parametrize(("faces", "n"), [("f 1 2 3", 1), ("f 1/1 2/2 3/3", 0), ("usemtl plain\nf 1 2 3", 0)])
def test_mtl_texture_of_a_mesh_without_coordinates_is_told(tmp_path, recwarn, faces, n):
    picture(tmp_path, "a.png", np.zeros((1, 1, 3)))
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd a.png\nnewmtl plain\nKd 1 0 0\n")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + SQUARE + f"usemtl m\n{faces}\n")
    tl.load(tmp_path / "a.obj")
    path = str(tmp_path / "a.obj")
    wanted = f"{path!r}: textures not drawn, for want of texture coordinates"
    assert [str(one.message) for one in recwarn] == [wanted] * n


@pytest.mark.parametrize(("faces", "n"), [("f 1/1 2/2 3/3", 0), ("f 1 2 3", 1), ("usemtl plain\nf 1 2 3", 0)])
def test_mtl_texture_of_faces_without_coordinates_beside_others_is_told(tmp_path, recwarn, faces, n):
    picture(tmp_path, "a.png", np.zeros((1, 1, 3)))
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd a.png\nnewmtl plain\nKd 1 0 0\n")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + SQUARE + f"usemtl m\nf 1/1 2/2 3/3\n{faces}\n")
    tl.load(tmp_path / "a.obj")
    wanted = f"{str(tmp_path / 'a.obj')!r}: textures not spread on faces without texture coordinates"
    assert [str(one.message) for one in recwarn] == [wanted] * n


def test_mtl_paths_of_other_machines_are_found_by_name(load, tmp_path):
    picture(tmp_path, "a.png", np.zeros((1, 1, 3)))
    urls = "file:///C:/x/a.png", "FILE://localhost/x/%61.png", "file:a.png", "https://a.example/x/a.png"
    for name in (r"C:\users\me\a.png", "/home/me/a.png", "../x/A.PNG", "./a.png", *urls):
        assert material_of(load, f"map_Kd {name}\n").texture is not None


def test_obj_of_points_alone_becomes_points(load):
    cloud = load("v 0 0 0 1 0 0\nv 1 2 3 0 1 0\n")
    assert isinstance(cloud, tl.Points)
    assert cloud.colors.tolist() == [[255, 0, 0, 255], [0, 255, 0, 255]]
