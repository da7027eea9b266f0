"""COLLADA: what is made of a file before trimesh reads it, and, where pycollada is installed, the mesh."""

from __future__ import annotations

import warnings
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest

import topleft as tl
from topleft._core.base.notes import Notes
from topleft._meshes.io.foreign import simplified
from topleft._meshes.io.limits.budget import Budget
from topleft.errors import MeshError, MeshWarning

CHEVRON = "0 0 0 4 0 0 4 4 0 2 1 0 0 4 0"
"""A face with a corner that points inwards, of area 10."""

POLYLIST = "<polylist count='1'>{inputs}<vcount>5</vcount><p>0 1 2 3 4</p></polylist>"
POLYGONS = "<polygons count='1'>{inputs}<p>0 1 2 3 4</p></polygons>"
INPUTS = "<input semantic='VERTEX' source='#v' offset='0'/>"
CONTROLLER = "<library_controllers><controller id='c'><skin source='#g'/></controller></library_controllers>"


def collada(primitives=POLYLIST, positions=CHEVRON, node="<instance_geometry url='#g'/>", more=""):
    mesh = (
        f"<source id='s'><float_array id='a' count='15'>{positions}</float_array><technique_common>"
        "<accessor source='#a' count='5' stride='3'><param name='X' type='float'/><param name='Y' type='float'/>"
        "<param name='Z' type='float'/></accessor></technique_common></source>"
        "<vertices id='v'><input semantic='POSITION' source='#s'/></vertices>" + primitives.format(inputs=INPUTS)
    )
    return (
        "<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><asset/>"
        f"<library_geometries><geometry id='g'><mesh>{mesh}</mesh></geometry></library_geometries>{more}"
        f"<library_visual_scenes><visual_scene id='w'><node id='n'>{node}</node></visual_scene></library_visual_scenes>"
        "<scene><instance_visual_scene url='#w'/></scene></COLLADA>"
    ).encode()


def simple(content):
    notes = Notes("a.dae")
    content = simplified(content, notes, Budget("a.dae"))[0]
    return ElementTree.fromstring(content), [line.partition(": ")[2] for line in notes.lines]


def area_of(root):
    space = "{http://www.collada.org/2005/11/COLLADASchema}"
    (row,) = root.iter(f"{space}triangles")
    points = np.array(CHEVRON.split(), float).reshape(-1, 3)
    corners = np.array(row.findtext(f"{space}p").split(), int).reshape(-1, 3)
    assert len(corners) == int(row.get("count"))
    a, b, c = np.moveaxis(points[corners], 1, 0)
    return np.abs(np.cross(b - a, c - a)[:, 2]).sum() / 2


@pytest.mark.parametrize("primitives", [POLYLIST, POLYGONS])
def test_collada_concave_polygon_is_cut_into_what_it_covers(primitives):
    root, notes = simple(collada(primitives))
    assert area_of(root) == 10
    assert notes == []


def test_collada_decimal_commas_are_read():
    root, _ = simple(collada(positions="0,5 0 0 4 0 0 4 4 0 2 1 0 0 4 0"))
    assert root.find(".//{*}float_array").text.startswith("0.5 0")


def test_collada_skin_becomes_its_geometry_and_is_told():
    root, notes = simple(collada(node="<instance_controller url='#c'/>", more=CONTROLLER))
    assert [row.get("url") for row in root.findall(".//{*}instance_geometry")] == ["#g"]
    assert notes == ["skins and morph targets drawn as they were modelled"]


def test_collada_material_that_is_not_there_is_left_out_and_told():
    bound = "<technique_common><instance_material symbol='a' target='#m'/></technique_common>"
    node = f"<instance_geometry url='#g'><bind_material>{bound}</bind_material></instance_geometry>"
    root, notes = simple(collada(node=node))
    assert root.findall(".//{*}instance_material") == []
    assert notes == ["materials that are not there: 'm'"]


def test_collada_animations_and_lines_are_told():
    lines = POLYLIST + "<lines count='1'><p>0 1</p></lines>"
    _, notes = simple(collada(lines, more="<library_animations><animation/></library_animations>"))
    assert notes == ["lines not drawn", "animations not played: everything is at rest"]


def sided(*values):
    """A face in the colour of the first effect; effects say whether they have two sides, or None: nothing."""
    extra = "<extra><technique profile='GOOGLEEARTH'><double_sided>{}</double_sided></technique></extra>"
    look = "<technique sid='c'><phong><diffuse><color>1 0 0 1</color></diffuse></phong></technique>"
    profiles = [look if value is None else look + extra.format(value) for value in values]
    effects = [f"<effect id='e{i}'><profile_COMMON>{own}</profile_COMMON></effect>" for i, own in enumerate(profiles)]
    materials = [f"<material id='m{i}'><instance_effect url='#e{i}'/></material>" for i in range(len(values))]
    bound = "<technique_common><instance_material symbol='a' target='#m0'/></technique_common>"
    return collada(
        POLYLIST.replace("count='1'", "count='1' material='a'"),
        node=f"<instance_geometry url='#g'><bind_material>{bound}</bind_material></instance_geometry>",
        more=f"<library_effects>{''.join(effects)}</library_effects>"
        f"<library_materials>{''.join(materials)}</library_materials>",
    )


@pytest.mark.parametrize(
    ("values", "has_both"), [([None], True), ([1], True), ([0], False), ([0, 0], False), ([None, 0], True)]
)
def test_collada_shows_both_sides_unless_the_file_says_one(tmp_path, values, has_both):
    pytest.importorskip("collada", reason="needs pycollada, of the extra formats")
    path = tmp_path / "a.dae"
    path.write_bytes(sided(*values))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MeshWarning)
        (material,) = tl.load(path).materials
    assert material.color == (255, 0, 0)
    assert material.double_sided == has_both


def test_collada_of_some_materials_of_one_side_is_told():
    assert simple(sided(0, 1))[1] == ["materials of one side among others drawn from both sides"]
    assert simple(sided(0, 0))[1] == simple(sided(None, 1))[1] == []


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"hello", "it is no XML"),
        (collada(POLYLIST.replace("5<", "6<")), "a list of polygons has 5 numbers for 6 corners"),
        (collada(POLYLIST.replace("5<", "-5<")), "a list of polygons has 5 numbers for -5 corners"),
        (collada(POLYLIST.replace("3 4", "3 x")), "a number in it is none"),
        (collada().replace(b"#s'/></vertices>", b"#t'/></vertices>"), "name positions that are not there"),
    ],
)
def test_collada_that_is_broken_is_told(content, message):
    with pytest.raises(MeshError, match=message):
        simplified(content, Notes("a.dae"), Budget("a.dae"))


@pytest.mark.parametrize("suffix", [".dae", ".zae"])
def test_collada_file_becomes_a_mesh(tmp_path, suffix):
    pytest.importorskip("collada", reason="needs pycollada, of the extra formats")
    path = tmp_path / f"a{suffix}"
    if suffix == ".zae":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("b.dae", collada(node="<instance_controller url='#c'/>", more=CONTROLLER))
    else:
        path.write_bytes(collada(node="<instance_controller url='#c'/>", more=CONTROLLER))
    with pytest.warns(MeshWarning, match="as they were modelled"):
        mesh = tl.load(path)
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    assert np.abs(np.cross(b - a, c - a)[:, 2]).sum() / 2 == 10
