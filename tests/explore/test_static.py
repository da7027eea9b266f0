"""The page that needs no Python: each of its answers is the one that Python gives, to the bit."""

import base64
import json
import shutil
import struct
import subprocess
from importlib.resources import files
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from topleft._apps.explore.content import SCENES, scene
from topleft._apps.explore.handlers import answer
from topleft._apps.explore.messages import split
from topleft._apps.explore.session import Content, Session
from topleft._apps.explore.static import LAYERS, N_SEEDS, SETS, write_static
from topleft._apps.explore.trace import TRACED
from topleft.methods import CLASSICS
from topleft.scene_families import FAMILIES
from topleft.typing import SamplingOption

NODE = shutil.which("node")
PAGE = files("topleft._apps.explore").joinpath("page")
HAS_KERNELS = all(PAGE.joinpath(f"topleft-{name}.wasm").is_file() for name in SETS)
pytestmark = [
    pytest.mark.skipif(not HAS_KERNELS, reason="no kernels for WebAssembly: python packaging/wasm.py"),
    pytest.mark.skipif(NODE is None, reason="node is not installed"),
]

#: Two triangles that share an edge through pixel centres, with a depth and without one.
SQUARE = {
    "vertices": [[1.5, 1.5], [9.5, 1.5], [1.5, 9.5], [9.5, 9.5]],
    "triangles": [[0, 1, 2], [1, 3, 2]],
    "size": [11, 12],
}
DEEP = SQUARE | {
    "vertices": [[1, 1, 0.5], [9, 1, 0.5], [1, 9, 0.5], [9, 9, 0.0], [0, 9, 0.9]],
    "triangles": [[0, 3, 2], [1, 3, 4]],
}
FAR = SQUARE | {"vertices": [[-3e9, 2.0], [7.1, 1e10], [11.9, -5.5], [9.5, 9.5]]}
SAMPLINGS = get_args(SamplingOption)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("static")
    write_static(made, Content())
    return made


def asker(folder, name):
    """What asks the page with the kernels of one set."""

    def asked(questions):
        command = [NODE, str(Path(__file__).with_name("ask_static.mjs")), str(folder), name]
        done = subprocess.run(command, input=json.dumps(questions), capture_output=True, text=True, check=True)
        return json.loads(done.stdout)

    return asked


@pytest.fixture(params=SETS)
def ask(request, folder):
    return asker(folder, request.param)


@pytest.fixture
def ask_one(folder):
    """For what no instruction set changes: one of them."""
    return asker(folder, SETS[0])


def random_states():
    """States of all samplings, bits, sides and orders; triangles are small, large, cut by the window, and far."""
    rng, found = np.random.default_rng(3), []
    for i, sampling in enumerate(SAMPLINGS * 6):
        n, extent, columns = int(rng.integers(1, 30)), (3, 30, 3e4)[i % 3], 2 + i % 2
        vertices = rng.uniform(-extent, 40 + extent, (3 * n, columns))
        if i % 4 == 0:
            vertices[:, :2] = np.round(vertices[:, :2] * 2) / 2  # edges and vertices on centres
        found.append({
            "vertices": vertices.tolist(), "triangles": rng.integers(0, 3 * n, (n, 3)).tolist(),
            "size": [int(rng.integers(1, 70)), int(rng.integers(1, 50))], "origin": rng.integers(-9, 9, 2).tolist(),
            "sampling": sampling, "subpixel_bits": (0, 2, 4, 8, 12, 16, "exact")[i % 7],
            "cull": ("none", "back", "front")[i % 3], "depth_test": ("less", "greater")[i % 2],
            "method": ("auto", "edge", "scanline")[i % 3],
            "winding": ("as given", "clockwise", "counter-clockwise")[i % 3],
            "other": (*CLASSICS, "")[i % (len(CLASSICS) + 1)],
            "look": ("owners", "overdraw", "owners", "wireframe")[i % 4], "exact": i % 3 == 0,
        })  # fmt: skip
    return found


def without_times(header):
    """A header without what differs from call to call, and from page to page."""
    text = json.loads(json.dumps(header))
    for panel in text.get("panels", ()):
        panel["facts"] = [fact for fact in panel["facts"] if fact[2] != "of the call that draws it"]
    return text


def check(ask, questions):
    """Ask both sides, and compare headers and bytes."""
    replies = ask(questions)
    for question, reply in zip(questions, replies, strict=True):
        header, parts = split(answer(Session(Content()), {"id": 1, "parts": [], **question}))
        bytes_drawn = [base64.b64decode(part) for part in reply.pop("bytes")]
        reply.pop("memory")
        reply = {"arrays": {}, **reply}
        assert without_times(reply) == without_times(header), question
        assert bytes_drawn == [bytes(part) for part in parts], question
    assert len(replies) == len(questions)


def test_pixels_of_random_states_are_those_of_python(ask):
    questions = [{"do": "pixels.draw", "state": state} for state in random_states()]
    check(ask, questions)


def small_states():
    """States of areas and squares whose exact picture is not refused: corners on pixels' corners, and in pixels."""
    rng = np.random.default_rng(8)
    for i in range(18):
        vertices = rng.uniform(-3, 13, (6, 2))
        vertices = np.round(vertices) if i % 2 else vertices
        yield {
            "vertices": vertices.tolist(), "triangles": rng.integers(0, 6, (1 + i % 4, 3)).tolist(), "size": [10, 8],
            "origin": [i % 3 - 1, 0], "exact": True, "sampling": SAMPLINGS[5 + i % 3],
            "subpixel_bits": (8, "exact", 0, 4)[i % 4], "cull": ("none", "none", "back", "front", "none")[i % 5],
        }  # fmt: skip


def test_exact_areas_and_squares_are_those_of_python(ask_one):
    check(
        ask_one,
        [
            {"do": "pixels.draw", "state": state}
            for state in [*small_states(), *(FAR | {"sampling": s, "exact": True} for s in SAMPLINGS[5:])]
        ],
    )


def test_pixels_of_each_scene_are_those_of_python(ask):
    states = [scene(name) for name in SCENES]
    check(ask, [{"do": "pixels.draw", "state": state} for state in states])
    check(ask, [{"do": "pixels.scene", "name": "single-point"}, {"do": "pixels.draw", "state": FAR}])


def test_reasons_of_pixels_are_those_of_python(ask):
    rng, questions = np.random.default_rng(5), []
    for state in [SQUARE, DEEP, FAR, *random_states()]:
        if state.get("look") == "wireframe":
            continue
        n = int(state["sampling"][4:]) if state.get("sampling", "").startswith("msaa") else 1
        for _ in range(4):
            pixel = [int(rng.integers(0, side)) for side in state["size"]]
            question = {"do": "pixels.probe", "state": state, "pixel": pixel, "sample": int(rng.integers(0, n))}
            questions += [question, question | {"method": "exact"}]
    check(ask, questions)


def steps_of(state, method, bits=8):
    """The question of how a method draws a state."""
    taken = {name: state[name] for name in ("vertices", "triangles", "size", "origin") if name in state}
    return {"do": "steps.trace", **taken, "method": method, "subpixel_bits": bits}


def test_steps_of_each_method_are_those_of_python(ask_one):
    states = [one for one in random_states() if len(one["triangles"]) < 12][:1]
    states = [DEEP, *(one | {"size": [min(n, 24) for n in one["size"]]} for one in states)]
    check(ask_one, [steps_of(one, method, (8, 0, 4)[i % 3]) for method in TRACED for i, one in enumerate(states)])


def test_steps_of_far_vertices_and_windows_are_those_of_python(ask_one):
    scenes = [name for name in SCENES if name.startswith(("far", "large"))][:6]
    check(
        ask_one, [steps_of(scene(name), method) for name in scenes for method in ("edge", "scanline", "row_crossing")]
    )


def test_sentences_of_steps_that_are_refused_are_those_of_python(ask_one):
    whole = SQUARE | {"vertices": [[0, 0], [900, 0], [0, 900], [900, 900]], "size": [900, 900]}
    far = SQUARE | {"vertices": [[1.5, 2**52], [9.5, 1.5], [1.5, 9.5], [9.5, 9.5]]}
    questions = [steps_of(SQUARE, "auto"), steps_of(SQUARE, "best"), steps_of(SQUARE | {"size": [2000, 3]}, "edge")]
    questions += [steps_of(whole, "edge"), steps_of(whole, "point_in_triangle"), steps_of(far, "edge", 16)]
    check(ask_one, [*questions, steps_of(far, "edge"), steps_of(far, "lerp_scanline")])


def race_of(family, share, i):
    """The question of a race of a family, from its mildest value, 0, to its harshest, 1."""
    positions = [round(share * (len(axis.values) - 1)) for axis in FAMILIES[family].axes]
    return {"do": ("race.draw", "race.column")[i % 2], "family": family, "positions": positions, "seed": i % N_SEEDS}


def test_races_are_those_of_python(ask_one):
    harsh = ["far", "far", "far-sliver", "sliver", "edge", "edge"]
    races = [race_of(name, share, i + k) for i, name in enumerate(FAMILIES) for k, share in enumerate((0, 0.5))]
    check(ask_one, [*races, *(race_of(name, 1, i) for i, name in enumerate(harsh))])


def test_sentences_of_races_that_are_refused_are_those_of_python(ask_one):
    bad = [{"family": "none", "positions": [1]}, {"family": "fan", "positions": [1, 2]}]
    check(ask_one, [{"do": "race.draw", **one} for one in bad])


def test_window_far_away_is_that_of_python(ask):
    far = 2**50
    state = SQUARE | {"vertices": [[x + far, y - far] for x, y in SQUARE["vertices"]], "origin": [far, -far]}
    check(ask, [{"do": "pixels.draw", "state": state | more} for more in ({"exact": True}, {"subpixel_bits": "exact"})])


BAD_STATES = [
    {"size": [300, 2]}, {"size": [1.5, 2]}, {"size": 3}, {"origin": [2**60, 0]},
    {"vertices": [[1, 2], [3, 4, 5], [0, 0]]},
    {"vertices": [[1, 2], [3, 1e300], [0, 0], [1, 1]]}, {"vertices": 7}, {"vertices": [["a", 1]] * 4},
    {"subpixel_bits": 17}, {"subpixel_bits": "all"}, {"sampling": "msaa3"}, {"cull": "both"}, {"depth_test": "equal"},
    {"winding": "left"}, {"look": "nice"}, {"triangles": [[0, 1, 4]]}, {"triangles": [[0, 1, 2]] * 1001},
    {"vertices": [[0, 0]] * 3001}, {"method": "best"}, {"color": 3}, {"exact": 1},
    {"subpixel_bits": 16, "vertices": [[2**51 + 0.5, 0], [3, 1], [0, 0], [1, 1]]},
]  # fmt: skip


@pytest.mark.parametrize("i", range(0, len(BAD_STATES), 6))
def test_sentences_of_bad_states_are_those_of_python(ask, i):
    questions = [{"do": "pixels.draw", "state": SQUARE | bad} for bad in BAD_STATES[i : i + 6]]
    check(ask, [*questions, {"do": "pixels.draw", "state": {"size": [1, 1]}}, {"do": "pixels.draw", "state": []}])


def test_memory_stays_as_it_is_however_often_a_scene_is_drawn(ask):
    replies = ask([{"do": "pixels.draw", "state": random_states()[4]}] * 40)
    assert replies[-1]["memory"] == replies[1]["memory"]


def files_of_meshes():
    """Names and bytes: quads with sharp edges, a concave face, numbers of 32 and of 64 bits, nodes that are placed."""
    rng = np.random.default_rng(2)
    cube = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1.5) for z in (0, 2.25))
    quads = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf -7 -3 -1 -5\n"
    arrow = "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 1 2 3 4\n"
    points = (rng.integers(0, 40, (40, 3)) / 7).astype(np.float32)
    corners = rng.integers(0, 40, (60, 3)).astype("<i4")
    header = "ply\nformat {} 1.0\nelement vertex 40\nproperty {t} x\nproperty {t} y\nproperty {t} z\nelement face 60\n"
    header += "property list uchar int vertex_indices\nend_header\n"
    rows = "".join(" ".join(map(repr, row)) + "\n" for row in points.astype(float).tolist())
    rows += "".join("3 " + " ".join(map(str, row)) + "\n" for row in corners.tolist())
    packed = points.tobytes() + b"".join(b"\3" + row.tobytes() for row in corners)
    triangles = points[corners]
    apart = rng.permuted(np.tile(np.arange(40, dtype="<u2"), (60, 1)), axis=1)[:, :3].copy()  # none has a corner twice
    stl = bytes(80) + np.uint32(60).tobytes() + b"".join(bytes(12) + one.tobytes() + bytes(2) for one in triangles)
    text = "solid a\n" + "".join(
        "facet normal 0 0 1\nouter loop\n"
        + "".join("vertex " + " ".join(map(repr, row)) + "\n" for row in one)
        + "endloop\nendfacet\n"
        for one in triangles.astype(float).tolist()
    )
    return {
        "cube.obj": (cube + quads).encode(), "arrow.obj": arrow.encode(), "text.stl": text.encode(), "binary.stl": stl,
        "text.ply": (header.format("ascii", t="double") + rows).encode(),
        "binary.ply": header.format("binary_little_endian", t="float").encode() + packed,
        "big.ply": header.format("binary_big_endian", t="float").encode() + points.astype(">f4").tobytes()
        + b"".join(b"\3" + row.astype(">i4").tobytes() for row in corners),
        "nodes.glb": glb_of(points, apart, MOVED), "still.glb": glb_of(points, apart, [{"mesh": 0}]),
    }  # fmt: skip


def files_with_colors_and_normals():
    """Names and bytes: vertices that share a place and differ in colour, in bytes, 16 bits and floats; normals."""
    rng = np.random.default_rng(6)
    points = (rng.integers(0, 3, (30, 3)) / 7).astype(np.float32)
    corners, normals = rng.integers(0, 30, (50, 3)).astype("<i4"), rng.normal(size=(30, 3)).astype(np.float32)
    colors = rng.integers(0, 256, (30, 3), np.uint8)
    faces = b"".join(b"\3" + row.tobytes() for row in corners)

    def ply(kind, columns):
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex 30\n{kind}element face 50\n"
        rows = b"".join(b"".join(column[i].tobytes() for column in columns) for i in range(30))
        return (head + "property list uchar int vertex_indices\nend_header\n").encode() + rows + faces

    xyz = "".join(f"property float {axis}\n" for axis in "xyz")
    rgb, wide, real = (
        "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
        for kind in ("uchar", "ushort", "float")
    )
    own = "".join(f"property float n{axis}\n" for axis in "xyz")
    text = "ply\nformat ascii 1.0\nelement vertex 30\n" + xyz + own + rgb + "element face 50\n"
    text += "property list uchar int vertex_indices\nend_header\n"
    text += "".join(" ".join(map(str, (*p, *n, *c))) + "\n" for p, n, c in zip(points, normals, colors, strict=True))
    text += "".join(f"3 {a} {b} {c}\n" for a, b, c in corners)
    line = "".join(
        f"v {x!r} {y!r} {z!r} {r / 255!r} {g / 255!r} {b / 255!r}\n"
        for (x, y, z), (r, g, b) in zip(points.astype(float).tolist(), colors.tolist(), strict=True)
    )
    vn = "".join(f"vn {x!r} {y!r} {z!r}\n" for x, y, z in normals.astype(float).tolist())
    plain = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in corners.tolist())
    same = "".join("f " + " ".join(f"{i + 1}//{i + 1}" for i in row) + "\n" for row in corners.tolist())
    other = "".join(
        "f " + " ".join(f"{i + 1}//{(7 * i + k) % 30 + 1}" for k, i in enumerate(row)) + "\n"
        for row in corners.tolist()
    )
    return {
        "bytes.ply": ply(xyz + rgb, (points, colors)),
        "wide.ply": ply(xyz + wide, (points, colors.astype("<u2") * 251)),
        "floats.ply": ply(xyz + real, (points, (colors / np.float32(255)).astype("<f4"))),
        "normals.ply": ply(xyz + own, (points, normals)), "both.ply": text.encode(),
        "colors.obj": (line + plain).encode(), "same.obj": (line + vn + same).encode(),
        "other.obj": (line + vn + other).encode(),
    }  # fmt: skip


#: Nodes that show a mesh twice: moved by a chain of nodes, and by a matrix.
MOVED = [
    {"mesh": 0, "matrix": [2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0.5, 0, 4, -3, 1, 1]},
    {"children": [2], "translation": [1, 2, 3], "rotation": [0.5, 0.5, 0.5, 0.5]}, {"mesh": 0, "scale": [1, 2, 1]},
]  # fmt: skip


def glb_of(points, corners, nodes):
    """A GLB of positions and triangles."""
    data = points.tobytes() + corners.tobytes()
    scene = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [*range(min(2, len(nodes)))]}], "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3",
             "min": points.min(0).tolist(), "max": points.max(0).tolist()},
            {"bufferView": 1, "componentType": 5123, "count": corners.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": corners.nbytes},
        ],
        "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    chunks = b"".join(
        struct.pack("<II", len(body), kind) + body for body, kind in ((text, 0x4E4F534A), (data, 0x004E4942))
    )
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


BROKEN = {
    "short.stl": bytes(80) + b"\7\0\0\0" + bytes(60), "numbers.stl": b"solid a\nvertex 1 2 3\nvertex 1 2\n",
    "head.ply": b"plx", "end.ply": b"ply\nformat ascii 1.0\n", "format.ply": b"ply\nelement vertex 1\nend_header\n1",
    "said.ply": b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n",
    "rows.ply": b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face 1\nproperty list uchar int vertex_indices\nend_header\n1 2 3\n",
    "two.obj": b"v 1 2\nf 1 1 1\n", "beyond.obj": b"v 1 2 3\nf 1 2 9\n", "zero.obj": b"v 1 2 3\nf 0 1 1\n",
    "words.obj": b"v 1 2 3\nf a b c\n", "back.obj": b"v 1 2 3\nf -1 -2 -3\n", "nul.obj": b"v 1 2 3\0",
    "points.obj": b"v 1 2 3\nv 2 3 4\n", "none.obj": b"# nothing\n", "nameless": b"",
}  # fmt: skip


def opened_and_drawn(name, path, views):
    """Questions of a file and of views of it."""
    return [{"do": "mesh.open", "name": name, "file": str(path)}, *({"do": "mesh.draw", **view} for view in views)]


def views_of(n, rng):
    """Views from near and far, with and without perspective, of every layer that needs no Python."""
    return [
        {
            "size": [int(rng.integers(20, 200)), int(rng.integers(20, 150))], "azimuth": float(rng.uniform(-200, 400)),
            "elevation": float(rng.choice([-90, 90, rng.uniform(-89, 89)])), "zoom": float(rng.choice([0.4, 1, 3, 40])),
            "pan": rng.uniform(-0.5, 0.5, 2).tolist(), "fov": [40, 0, 70, 20][i % 4], "up": "yz"[i % 2],
            "layer": LAYERS[i % len(LAYERS)], "sampling": ["center", "msaa4", "msaa2"][i % 3],
            "cull": ["none", "back", "front"][i % 3],
        }
        for i in range(n)
    ]  # fmt: skip


def check_meshes(ask, questions):
    """Ask both sides in one session, and compare names, counts, boxes and pixels."""
    session, name = Session(Content()), ""
    for question, reply in zip(questions, ask(questions), strict=True):
        name = question.get("name", name)
        parts = [Path(question["file"]).read_bytes()] if "file" in question else []
        header, own = split(answer(session, {"id": 1, **question, "parts": parts}))
        assert "error" not in reply, reply
        for name in ("name", "n_vertices", "n_triangles", "box", "size"):
            assert reply.get(name) == (list(header[name]) if isinstance(header.get(name), tuple) else header.get(name))
        assert [base64.b64decode(part) for part in reply["bytes"]] == [bytes(part) for part in own], (name, question)


def test_views_of_the_first_mesh_are_those_of_python(ask):
    check_meshes(ask, [{"do": "mesh.draw", **view} for view in views_of(24, np.random.default_rng(1))])


MESH_FILES = files_of_meshes() | files_with_colors_and_normals()


def test_views_of_files_are_those_of_python(ask, tmp_path):
    questions = []
    for name, content in MESH_FILES.items():
        (tmp_path / name).write_bytes(content)
        questions += opened_and_drawn(name, tmp_path / name, views_of(8, np.random.default_rng(4)))
    check_meshes(ask, questions)


def test_sentences_of_broken_files_are_those_of_python(ask_one, tmp_path):
    questions, wanted = [], []
    for name, content in BROKEN.items():
        path = tmp_path / name
        path.write_bytes(content)
        questions.append({"do": "mesh.open", "name": name, "file": str(path)})
        wanted.append(answer(Session(Content()), {"id": 1, **questions[-1], "parts": [content]}).header["error"])
    assert [reply.get("error") for reply in ask_one(questions)] == wanted


def test_memory_is_that_of_the_mesh_however_often_it_is_drawn_or_opened(ask, tmp_path):
    path = tmp_path / "cube.obj"
    path.write_bytes(files_of_meshes()["cube.obj"])
    round_of_questions = opened_and_drawn("cube.obj", path, views_of(4, np.random.default_rng(1)))
    replies = ask(round_of_questions * 6)
    assert replies[-1]["memory"] == replies[len(round_of_questions)]["memory"]


def test_file_that_memory_does_not_hold_leaves_the_mesh_before(ask_one, tmp_path):
    path = tmp_path / "binary.stl"
    path.write_bytes(files_of_meshes()["binary.stl"])
    opened = {"do": "mesh.open", "name": "binary.stl", "file": str(path)}
    view = {"do": "mesh.draw", "size": [64, 48]}
    _, first, full, second, named, moved, last = ask_one(
        [opened, view, opened | {"is_full": True}, view, {"do": "mesh.open"}, view | {"azimuth": 90}, view]
    )
    assert full["error"] == "not enough memory"
    assert named["name"] == "binary.stl"
    assert first["bytes"] == second["bytes"] == last["bytes"] != moved["bytes"]


def test_question_without_memory_is_refused_and_the_next_one_is_answered(ask):
    state, view = {"do": "pixels.draw", "state": SQUARE}, {"do": "mesh.draw", "size": [64, 48]}
    first, full_state, full_view, last_state, last_view = ask(
        [view, state | {"is_full": True}, view | {"is_full": True}, state, view]
    )
    assert full_state["error"] == full_view["error"] == "not enough memory"
    assert "error" not in last_state
    assert last_view["bytes"] == first["bytes"]
