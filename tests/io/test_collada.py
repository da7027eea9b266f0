"""COLLADA: triangles of all kinds of lists, the transforms of nodes, materials, and what is left out and told."""

import warnings
import zipfile

import numpy as np
import pytest
from PIL import Image

import topleft as tl
from topleft.errors import MeshError, MeshWarning

CHEVRON = "0 0 0 4 0 0 4 4 0 2 1 0 0 4 0"
"""A face with a corner that points inwards, of area 10."""

INPUTS = "<input semantic='VERTEX' source='#v' offset='0'/>"
POLYLIST = f"<polylist material='a' count='1'>{INPUTS}<vcount>5</vcount><p>0 1 2 3 4</p></polylist>"
POLYGONS = f"<polygons count='1'>{INPUTS}<p>0 1 2 3 4</p></polygons>"
TRIANGLES = f"<triangles count='3'>{INPUTS}<p>0 1 3 1 2 3 3 4 0</p></triangles>"
FANS = f"<trifans count='2'>{INPUTS}<p>3 4 0 1</p><p>3 1 2</p></trifans>"
STRIPS = f"<tristrips count='2'>{INPUTS}<p>4 0 3 1 2</p><p>0 1</p></tristrips>"
CONTROLLER = "<library_controllers><controller id='c'><skin source='#g'>{}</skin></controller></library_controllers>"
GEOMETRY = "<instance_geometry url='#g'/>"


def source(name, numbers, stride, offset=0):
    return (
        f"<source id='{name}'><float_array id='{name}a'>{numbers}</float_array><technique_common>"
        f"<accessor source='#{name}a' stride='{stride}' offset='{offset}'/></technique_common></source>"
    )


def collada(primitives=POLYLIST, positions=CHEVRON, node=GEOMETRY, more="", asset="<asset/>", scene="#w", stride=3):
    chosen = f"<scene><instance_visual_scene url='{scene}'/></scene>" if scene else ""
    return (
        f"<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>{asset}{more}"
        f"<library_geometries><geometry id='g'><mesh>{source('s', positions, stride)}"
        f"<vertices id='v'><input semantic='POSITION' source='#s'/></vertices>{primitives}</mesh></geometry>"
        "</library_geometries><library_visual_scenes><visual_scene id='w'>"
        f"<node id='n'>{node}</node></visual_scene></library_visual_scenes>{chosen}</COLLADA>"
    ).encode()


@pytest.fixture
def read(tmp_path):
    def read_content(content):
        """The mesh, and the lines that are told."""
        path = tmp_path / "a.dae"
        path.write_bytes(content)
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always", MeshWarning)
            mesh = tl.load(path)
        return mesh, [str(one.message).partition(": ")[2] for one in told]

    return read_content


def area_of(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    return (np.cross(b - a, c - a)[:, 2]).sum() / 2


@pytest.mark.parametrize("primitives", [POLYLIST.replace(" material='a'", ""), POLYGONS, TRIANGLES, FANS, STRIPS])
def test_collada_faces_of_each_kind_cover_the_polygon(read, primitives):
    mesh, told = read(collada(primitives))
    assert (area_of(mesh), told) == (10, [])


def test_collada_decimal_commas_are_read(read):
    mesh, _ = read(collada(TRIANGLES, positions="0,5" + CHEVRON[1:]))
    assert mesh.vertices.min(axis=0).tolist() == [0, 0, 0]
    assert 0.5 in mesh.vertices[:, 0]


def test_collada_positions_of_two_numbers_lie_in_a_plane(read):
    mesh, _ = read(collada(TRIANGLES, positions="0 0 4 0 4 4 2 1 0 4", stride=2))
    assert area_of(mesh) == 10


TWO_ROOTS = "0.7071067811865476"


@pytest.mark.parametrize(
    ("transforms", "image"),
    [
        ("<translate>1 2 3</translate>", [2, 2, 3]),
        ("<scale>2 3 4</scale>", [2, 0, 0]),
        ("<rotate>0 0 1 90</rotate>", [0, 1, 0]),
        ("<rotate>0 0 5 90</rotate><translate>1 0 0</translate>", [0, 2, 0]),
        ("<matrix>0 0 1 7 1 0 0 0 0 1 0 0 0 0 0 1</matrix>", [7, 1, 0]),
        ("<lookat>5 0 0 5 0 -1 0 1 0</lookat>", [6, 0, 0]),
        ("<lookat>5 0 0 6 0 0 0 1 0</lookat>", [5, 0, 1]),
        ("<skew>45 1 0 0 0 1 0</skew>", [1, 1, 0]),
        (f"<skew>45 {TWO_ROOTS} {TWO_ROOTS} 0 0 1 0</skew>", None),
        ("<scale>2 2 2</scale><skew>45 0 1 0 1 0 0</skew><translate>0 1 0</translate>", [4, 2, 0]),
    ],
)
def test_collada_transforms_of_a_node_are_applied_in_their_order(read, transforms, image):
    mesh, _ = read(collada(TRIANGLES, "1 0 0 1 1 0 0 1 0 0 0 0 0 1 1", node=transforms + GEOMETRY))
    if image is None:  # the first axis turns by 45 degrees towards the second: it becomes parallel to it, at no angle
        assert abs(mesh.vertices).max() > 1e9
    else:
        assert abs(mesh.vertices - image).sum(axis=1).min() < 1e-12


def test_collada_nodes_that_are_instanced_are_placed_each_time(read):
    library = f"<library_nodes><node id='k'><scale>1 1 2</scale>{GEOMETRY}</node></library_nodes>"
    node = "<translate>9 0 0</translate><instance_node url='#k'/><node><instance_node url='#k'/></node>"
    mesh, told = read(collada(TRIANGLES, node=node + "<instance_node url='#gone'/>", more=library))
    assert (area_of(mesh), mesh.bounds.tolist()) == (20, [[9, 0, 0], [13, 4, 0]])
    assert told == ["nodes that are not there: '#gone'"]


@pytest.mark.parametrize("scene", ["", "#gone"])
def test_collada_without_a_scene_shows_the_first_one(read, scene):
    mesh, told = read(collada(TRIANGLES, scene=scene))
    assert (area_of(mesh), told) == (10, ["no scene chosen: the first one is drawn"])


def test_collada_geometry_that_no_scene_places_is_told(read):
    other = "<library_geometries><geometry id='h'><mesh/></geometry></library_geometries>"
    assert read(collada(TRIANGLES, more=other))[1] == ["geometries that no scene places not drawn: 'h'"]
    with pytest.raises(MeshError, match=r"no triangles, but geometries that no scene places"):
        read(collada(node=""))
    with pytest.raises(MeshError, match="no triangles"):
        read(b"<COLLADA><asset><up_axis>Z_UP</up_axis></asset></COLLADA>")


@pytest.mark.parametrize(("axis", "up", "lines"), [("Z_UP", "z", []), ("Y_UP", "y", []), ("W_UP", "y", ["W_UP"])])
def test_collada_up_axis_is_that_of_the_views_unless_they_say_another(read, axis, up, lines):
    mesh, told = read(collada(TRIANGLES, asset=f"<asset><up_axis>{axis}</up_axis></asset>"))
    assert told == [f"up axis not followed: '{line}'" for line in lines]
    assert mesh.up == up
    assert area_of(mesh) == 10  # coordinates are those of the file
    assert (tl.Camera.framing(mesh).view == tl.Camera.framing(mesh, up=up).view).all()
    plain = tl.Mesh(mesh.vertices, mesh.triangles)
    assert (tl.render(mesh, size=16) == tl.render(plain, tl.Camera.framing(plain, up=up), 16)).all()
    assert (tl.turntable(mesh, 2)[1].view == tl.turntable(plain, 2, up=up)[1].view).all()
    assert (tl.Camera.framing(mesh, up="y").view == tl.Camera.framing(plain).view).all()


def test_collada_x_up_stands_upright(read):
    plain, _ = read(collada(TRIANGLES))
    mesh, told = read(collada(TRIANGLES, asset="<asset><up_axis>X_UP</up_axis></asset>"))
    assert (mesh.up, told) == ("y", [])
    assert np.array_equal(mesh.vertices, plain.vertices[:, [1, 0, 2]] * [-1, 1, 1])


def test_command_environment_follows_the_axis_of_the_file(tmp_path, run):
    (tmp_path / "a.dae").write_bytes(collada(TRIANGLES, asset="<asset><up_axis>Z_UP</up_axis></asset>"))
    pictures = {}
    for up in ("file", "y", "z"):
        out = tmp_path / f"{up}.png"
        more = [] if up == "file" else ["--up", up]
        how = ["--environment", "white,black", "--azimuth", "0", "--size", "32x32", *more]
        assert run("render", tmp_path / "a.dae", "-o", out, *how)[0] == 0
        pictures[up] = Image.open(out).tobytes()
    assert pictures["file"] == pictures["z"] != pictures["y"]


def test_command_up_wins_over_the_axis_of_the_file(tmp_path, run):
    (tmp_path / "a.dae").write_bytes(collada(TRIANGLES, asset="<asset><up_axis>Z_UP</up_axis></asset>"))
    (tmp_path / "b.dae").write_bytes(collada(TRIANGLES))
    for name, more in (("a", []), ("b", []), ("a", ["--up", "y"]), ("b", ["--up", "z"])):
        out = tmp_path / f"{name}{len(more)}.png"
        assert run("render", tmp_path / f"{name}.dae", "-o", out, "--size", "32x32", *more)[0] == 0
    a, a_up, b, b_up = (Image.open(tmp_path / f"{name}.png").tobytes() for name in ("a0", "a2", "b0", "b2"))
    assert (a, b) == (b_up, a_up)
    assert a != b


def test_collada_skin_becomes_its_geometry_where_it_was_bound(read):
    bind = "<bind_shape_matrix>1 0 0 9 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix>"
    mesh, told = read(collada(TRIANGLES, node="<instance_controller url='#c'/>", more=CONTROLLER.format(bind)))
    assert (mesh.bounds[0].tolist(), told) == ([9, 0, 0], ["skins and morph targets drawn as they were modelled"])


def test_collada_geometry_that_is_not_there_is_told(read):
    loop = "<library_controllers><controller id='c'><skin source='#c'/></controller></library_controllers>"
    node = GEOMETRY + "<instance_geometry url='#gone'/><instance_controller url='#c'/>"
    mesh, told = read(collada(TRIANGLES, node=node, more=loop))
    assert area_of(mesh) == 10
    assert "geometries that are not there: '#gone', '#c'" in told


def test_collada_animations_and_lines_are_told(read):
    lines = TRIANGLES + "<lines count='1'><p>0 1</p></lines>"
    _, told = read(collada(lines, more="<library_animations><animation/></library_animations>"))
    assert told == ["animations not played: everything is at rest", "lines not drawn"]


def effect(name, shader, params="", extra=""):
    return (
        f"<library_effects><effect id='e{name}'><profile_COMMON>{params}<technique sid='c'>{shader}{extra}</technique>"
        f"</profile_COMMON></effect></library_effects><library_materials><material id='{name}'>"
        f"<instance_effect url='#e{name}'/></material></library_materials>"
    )


def phong(inner, kind="phong"):
    return f"<{kind}><diffuse><color>1 0 0 1</color></diffuse>{inner}</{kind}>"


SHARE = "<transparency><float>{}</float></transparency>"
BOUND = (
    "<instance_geometry url='#g'><bind_material><technique_common><instance_material symbol='a' target='#m'/>"
    "</technique_common></bind_material></instance_geometry>"
)
TEXTURE = (
    "<newparam sid='su'><surface type='2D'><init_from>i</init_from></surface></newparam>"
    "<newparam sid='sa'><sampler2D><source>su</source></sampler2D></newparam>"
)


@pytest.mark.parametrize("node", [GEOMETRY, BOUND])
def test_collada_material_that_is_not_there_is_told_and_its_faces_are_drawn(read, node):
    mesh, told = read(collada(node=node))
    assert (area_of(mesh), told) == (10, [f"materials that are not there: '{'m' if node is BOUND else 'a'}'"])


def test_collada_symbol_that_is_not_bound_is_the_material_of_that_name(read):
    mesh, told = read(collada(more=effect("a", phong(""))))
    assert ([one.color for one in mesh.materials], told) == ([(255, 0, 0)], [])


@pytest.mark.parametrize(
    ("inner", "opacity"),
    [
        ("", 1),
        ("<transparent><color>1 1 1 .25</color></transparent>", 0.25),
        ("<transparent opaque='A_ONE'><color>0 0 0 .5</color></transparent>" + SHARE.format(0.5), 0.25),
        ("<transparent opaque='A_ZERO'><color>1 1 1 .75</color></transparent>", 0.25),
        ("<transparent opaque='RGB_ZERO'><color>1 1 1 1</color></transparent>" + SHARE.format(0.75), 0.25),
        ("<transparent opaque='RGB_ONE'><color>.25 .25 .25 1</color></transparent>", 0.25),
        (SHARE.format(0.25), 0.25),
        (SHARE.format(7), 1),
    ],
)
def test_collada_opacity_follows_each_mode(read, inner, opacity):
    mesh, told = read(collada(node=BOUND, more=effect("m", phong(inner))))
    (material,) = mesh.materials
    assert material.opacity == pytest.approx(opacity, abs=1e-6)  # the shares of luminance are rounded to 6 digits
    assert (material.alpha_mode, told) == ("opaque" if opacity == 1 else "blend", [])


@pytest.mark.parametrize(
    "inner", [SHARE.format(0), "<transparent opaque='RGB_ZERO'><color>1 1 1 1</color></transparent>"]
)
def test_collada_that_would_not_show_at_all_is_opaque_and_told(read, inner):
    mesh, told = read(collada(node=BOUND, more=effect("m", phong(inner))))
    assert (mesh.materials[0].opacity, told) == (1, ["materials that are wholly transparent, drawn opaque"])


def test_collada_highlights_emission_and_flat_colours_are_read(read):
    inner = "<emission><color>1 0 0 1</color></emission><specular><color>.5 .5 .5 1</color></specular>"
    shiny = phong(inner + "<shininess><param ref='n'/></shininess>", "blinn")
    (material,) = read(collada(node=BOUND, more=effect("m", shiny, "<newparam sid='n'><float>20</float></newparam>")))[
        0
    ].materials
    assert (material.specular, material.shininess, material.emission) == (0.5, 20, (1, 0, 0))
    (material,) = read(collada(node=BOUND, more=effect("m", phong(inner, "constant"))))[0].materials
    assert (material.color, material.unlit, material.emission) == ((255, 0, 0), True, (0, 0, 0))


@pytest.mark.parametrize(("value", "has_both"), [(None, True), (1, True), (0, False)])
def test_collada_shows_both_sides_unless_the_material_says_one(read, value, has_both):
    extra = f"<extra><technique profile='GOOGLEEARTH'><double_sided>{value}</double_sided></technique></extra>"
    (material,) = read(collada(node=BOUND, more=effect("m", phong(""), extra=extra if value is not None else "")))[
        0
    ].materials
    assert material.double_sided == has_both


@pytest.mark.parametrize(
    ("image", "said"),
    [
        ("<image id='i'/>", "images without a file: 'i'"),
        ("<image id='i'><init_from> </init_from></image>", "images without a file: 'i'"),
        ("", "textures not found: 'i'"),
        ("<image id='i'><init_from>gone.png</init_from></image>", "textures not found: 'gone.png'"),
        ("<image id='i'><init_from><ref>gone.png</ref></init_from></image>", "textures not found: 'gone.png'"),
    ],
)
def test_collada_image_without_a_file_is_told_and_its_faces_are_drawn(read, image, said):
    laid = "<phong><diffuse><texture texture='sa' texcoord='U'/></diffuse></phong>"
    images = f"<library_images>{image}</library_images>"
    mesh, told = read(collada(node=BOUND, more=images + effect("m", laid, TEXTURE)))
    assert (area_of(mesh), told) == (10, [said])


@pytest.mark.parametrize(("name", "params"), [("sa", TEXTURE), ("i", "")])
@pytest.mark.parametrize("alpha", [255, 100])
def test_collada_texture_and_its_alpha_are_laid(read, tmp_path, name, params, alpha):
    picture = np.array([[[200, 0, 0, 255], [0, 200, 0, alpha]]], np.uint8)
    tl.save_image(tmp_path / "a b.png", picture)
    laid = f"<texture texture='{name}' texcoord='U'/>"
    shader = f"<lambert><diffuse>{laid}</diffuse><transparent>{laid}</transparent></lambert>"
    images = "<library_images><image id='i'><init_from>file://./a%20b.png</init_from></image></library_images>"
    uv = source("t", "9 0 0 1 0 1 1 0 1 0 0", 2, offset=1)
    inputs = INPUTS + "<input semantic='TEXCOORD' source='#t' offset='1'/>"
    faces = f"{uv}<triangles material='a' count='1'>{inputs}<p>0 4 1 3 2 2</p></triangles>"
    mesh, told = read(collada(faces, node=BOUND, more=images + effect("m", shader, params)))
    (material,) = mesh.materials
    assert (told, material.alpha_mode) == ([], "opaque" if alpha == 255 else "blend")
    assert (material.texture.image == picture).all()
    assert mesh.uv[mesh.triangles[0]].tolist() == [[0, 0], [0, 1], [1, 1]]


@pytest.mark.parametrize(
    ("wraps", "expected"),
    [
        ("", ("repeat", "repeat")),
        ("<wrap_s>CLAMP</wrap_s><wrap_t> MIRROR </wrap_t>", ("clamp", "mirror")),
        ("<wrap_t>BORDER</wrap_t>", ("repeat", "clamp")),
    ],
)
def test_collada_textures_go_on_as_their_samplers_say(read, tmp_path, wraps, expected):
    tl.save_image(tmp_path / "a.png", np.zeros((1, 1, 3), np.uint8))
    laid = "<phong><diffuse><texture texture='sa' texcoord='U'/></diffuse></phong>"
    images = "<library_images><image id='i'><init_from>a.png</init_from></image></library_images>"
    params = TEXTURE.replace("</sampler2D>", f"{wraps}</sampler2D>")
    assert read(collada(node=BOUND, more=images + effect("m", laid, params)))[0].materials[0].texture.wrap == expected


@pytest.mark.parametrize(("number", "n"), [(0, 0), (1, 1)])
def test_collada_texture_of_further_coordinates_is_told(read, tmp_path, number, n):
    tl.save_image(tmp_path / "a.png", np.zeros((1, 1, 3), np.uint8))
    laid = "<phong><diffuse><texture texture='i' texcoord='U'/></diffuse></phong>"
    images = "<library_images><image id='i'><init_from>a.png</init_from></image></library_images>"
    uv = source("t", "0 0 1 0 1 1", 2) + source("w", "0 0 1 0 1 1", 2)
    inputs = INPUTS + "".join(
        f"<input semantic='TEXCOORD' source='#{a}' offset='1' set='{k}'/>" for k, a in enumerate("tw")
    )
    faces = f"{uv}<triangles material='a' count='1'>{inputs}<p>0 0 1 1 2 2</p></triangles>"
    bound = f"<bind_vertex_input semantic='U' input_semantic='TEXCOORD' input_set='{number}'/></instance_material>"
    node = BOUND.replace(
        "<instance_material symbol='a' target='#m'/>", f"<instance_material symbol='a' target='#m'>{bound}"
    )
    assert node != BOUND
    _, told = read(collada(faces, node=node, more=images + effect("m", laid)))
    assert told == ["textures laid by the first of several texture coordinates: 'set 1 of a'"] * n


def test_collada_normals_and_colours_of_corners_are_read(read):
    own = source("n", "0 0 1 0 1 0", 3) + source("k", "1 0 0 0 .5 1", 3)
    inputs = (
        INPUTS + "<input semantic='NORMAL' source='#n' offset='1'/><input semantic='COLOR' source='#k' offset='2'/>"
    )
    faces = f"{own}<triangles count='1'>{inputs}<p>0 0 0 1 1 1 2 0 1</p></triangles>"
    mesh, told = read(collada(faces))
    (corners,) = mesh.triangles
    assert (told, mesh.normals[corners].tolist()) == ([], [[0, 0, 1], [0, 1, 0], [0, 0, 1]])
    assert mesh.colors[corners].tolist() == [[255, 0, 0, 255], [0, 128, 255, 255], [0, 128, 255, 255]]
    _, told = read(collada(faces.replace("1 1 1 2", "1 9 1 2").replace("#k", "#gone")))
    assert told == ["NORMAL of faces that is not there: '#n'", "COLOR of faces that is not there: '#gone'"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"hello", "it is no XML"),
        (collada(POLYLIST.replace("5<", "6<")), "a list of polylist has 5 numbers for 6 corners"),
        (collada(POLYLIST.replace("5<", "-5<")), "a list of polylist has 5 numbers for -5 corners"),
        (collada(POLYLIST.replace("3 4", "3 x")), "a number in it is none"),
        (collada().replace(b"#s'/></vertices>", b"#t'/></vertices>"), "name positions that are not there"),
        (collada(TRIANGLES.replace("3 3 4", "3 3 5")), "faces name vertices 0 to 5 of 5"),
        (collada(TRIANGLES.replace("3 3 4", "3 3 -1")), "faces name vertices -1 to 3 of 5"),
        (collada(TRIANGLES, node="<translate>1 2</translate>" + GEOMETRY), "a translate has 2 numbers, not 3"),
        (collada(TRIANGLES, node="<instance_node url='#n'/>"), "a node of it is below itself"),
        (collada(TRIANGLES, stride=0), "rows of 0 numbers"),
    ],
)
def test_collada_that_is_broken_is_told(read, content, message):
    with pytest.raises(MeshError, match=message):
        read(content)


def test_collada_of_an_archive_becomes_a_mesh(tmp_path):
    path = tmp_path / "a.zae"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("b.dae", collada(TRIANGLES, asset="<asset><up_axis>Z_UP</up_axis></asset>"))
    mesh = tl.load(path)
    assert (area_of(mesh), mesh.up) == (10, "z")
