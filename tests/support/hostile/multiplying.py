"""Small files that multiply two of their parts: `python tests/support/hostile/multiplying.py`.

Each format is a function of how often it has each of its parts; each pair of parts is made as large as 5 MB allow, or
`--bytes`. `glb obj:faces obj:faces:pixels` tries a format, a part and a pair.
Every file is read by a process of its own. Prints the CPU seconds and the memory of each, and ends with status 1 if one
takes more than 5 s or 1 GB, or ends otherwise than in a mesh, in words or in a missing package.
"""

import argparse
import bz2
import functools
import gzip
import io
import itertools
import os
import resource
import signal
import sys
import tarfile
import tempfile
import time
import warnings
import zipfile
import zlib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from gltf_files import QUAD, GltfFile

import topleft as tl
from topleft.errors import MeshWarning, MissingPackageError, TopleftError

MOST_BYTES = 5_000_000
MOST_UNPACKED = 64_000_000  # which is more than any of them may have
MOST_SECONDS = 5
MOST_MEMORY = 1 << 30
MADE, REFUSED, WITHOUT = 0, 3, 4

Files = dict[str, bytes]
Sizes = dict[str, int]


@functools.lru_cache(64)
def png(n_pixels: int) -> bytes:
    """A plain PNG of about so many pixels, without the memory for them."""
    side = max(1, int(n_pixels**0.5))
    packer = zlib.compressobj(9)
    row = b"\0" + bytes(side)
    rows = b"".join(packer.compress(row * min(64, side - top)) for top in range(0, side, 64)) + packer.flush()

    def chunk(kind: bytes, body: bytes) -> bytes:
        return len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")

    header = side.to_bytes(4, "big") * 2 + bytes([8, 0, 0, 0, 0])
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


GLTF = {
    "nodes": 300_000, "primitives": 100_000, "instances": 200_000_000, "stored_instances": 1_000_000,
    "targets": 200_000, "joints": 300_000, "influences": 50_000, "vertices": 200_000_000, "stored_vertices": 1_600_000,
    "indices": 600_000_000, "stored_indices": 4_000_000, "materials": 60_000, "textures": 60_000, "images": 60_000,
    "views": 60_000, "pixels": 1 << 26, "skins": 60_000, "overlapping": 4_900_000, "colors": 1_600_000,
    "degenerate": 4_900_000, "lines": 200_000, "cameras": 300_000, "sparse": 60_000, "set_rows": 400_000,
    "animations": 60_000, "channels": 60_000, "keys": 200_000_000, "stored_keys": 1_600_000,
}  # fmt: skip
"""The most of each part that is tried; those that are not stored cost no bytes."""


def glb(n: Sizes) -> Files:
    file = GltfFile()
    n_vertices = max(3, n["vertices"], n["stored_vertices"])
    if n["overlapping"] > 1:  # rows of four bytes, each a byte behind the one before
        n_vertices = n["overlapping"]
        view = file.view(bytes(n_vertices + 3), byteStride=1)
        own = {"bufferView": view, "componentType": 5121, "count": n_vertices}
        position = file.add("accessors", {**own, "type": "VEC3"})
    elif n["vertices"] > 1:
        position = file.add("accessors", {"componentType": 5126, "count": n["vertices"], "type": "VEC3"})
    else:
        stored = np.zeros((n_vertices, 3), np.uint8)
        stored[1, 0] = stored[2, 1] = 1
        position = file.accessor(stored)
    row = {"attributes": {"POSITION": position}, "mode": 5}
    if n["indices"] > 1:
        row["indices"] = file.add("accessors", {"componentType": 5125, "count": n["indices"], "type": "SCALAR"})
    else:
        row["indices"] = file.accessor(np.resize(np.uint8([0, 1, 2]), max(3, n["stored_indices"])))
    if n["degenerate"] > 1:
        row["indices"] = file.accessor(np.zeros(n["degenerate"], np.uint8))
    if n["colors"] > 1:
        stored = np.zeros((n["colors"], 3), np.uint8)
        row["attributes"] = {"POSITION": file.accessor(stored), "COLOR_0": file.accessor(stored)}
    if n["targets"] > 1:
        row["targets"] = [{"POSITION": position}] * n["targets"]
    if n["sparse"] > 1 or n["set_rows"] > 1:
        at, new = file.accessor(np.zeros(n["set_rows"], np.uint8)), file.accessor(np.zeros((n["set_rows"], 3), "f4"))
        places = {"bufferView": file.tree["accessors"][at]["bufferView"], "componentType": 5121}
        values = {"bufferView": file.tree["accessors"][new]["bufferView"]}
        sparse = {"count": n["set_rows"], "indices": places, "values": values}
        accessor = {"componentType": 5126, "count": n_vertices, "type": "VEC3", "sparse": sparse}
        row["targets"] = [{"POSITION": file.add("accessors", accessor)} for _ in range(n["sparse"])]
    node = {"mesh": 0}
    if n["joints"] > 1 or n["skins"] > 1 or n["influences"] > 1:
        own = own if n["overlapping"] > 1 else {"componentType": 5121, "count": n_vertices}
        at = file.add("accessors", {**own, "type": "VEC4"})
        share = file.add("accessors", {**own, "type": "VEC4", "normalized": n["overlapping"] == 1})
        for k in range(n["influences"]):
            row["attributes"] |= {f"JOINTS_{k}": at, f"WEIGHTS_{k}": share}
        file.tree["skins"] = [{"joints": [0] * n["joints"]}] * n["skins"]
        node["skin"] = 0
    if n["instances"] > 1 or n["stored_instances"] > 1:
        rows = {"componentType": 5126, "count": n["instances"], "type": "VEC3"}
        own = file.add("accessors", rows) if n["instances"] > 1 else None
        own = file.accessor(np.zeros((n["stored_instances"], 3), np.uint8)) if own is None else own
        node["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": own}}}
    looks = ("materials", "textures", "images", "views", "pixels")
    if any(n[name] > 1 for name in looks):
        content = png(n["pixels"])
        first = file.view(content)
        view = file.tree["bufferViews"][first]
        file.tree["bufferViews"] += [view] * (n["views"] - 1)
        file.tree["images"] = [{"bufferView": first + i % n["views"]} for i in range(max(n["images"], n["views"]))]
        n_textures = max(n["textures"], n["images"], n["views"])
        file.tree["textures"] = [{"source": i % len(file.tree["images"])} for i in range(n_textures)]
        n_materials = max(n["materials"], n_textures)
        made = {"KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": {"index": 0}}}
        file.tree["materials"] = [
            {"normalTexture": {"index": i % n_textures}} if n_textures > 1 else {"extensions": made}
            for i in range(n_materials)
        ]
        n["primitives"] = max(n["primitives"], n_materials)
    primitives = [row] * n["primitives"]
    if "materials" in file.tree:
        primitives = [{**row, "material": i % len(file.tree["materials"])} for i in range(n["primitives"])]
    primitives += [{"attributes": {"POSITION": position}, "mode": 1}] * (n["lines"] - 1)
    n_targets = len(row.get("targets", ()))
    file.tree["meshes"] = [{"primitives": primitives, "weights": [1] * n_targets}]
    file.tree["nodes"] = [{**node, "skin": i % n["skins"]} if "skin" in node else node for i in range(n["nodes"])]
    if n["cameras"] > 1:
        file.tree["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}]
        file.tree["nodes"] += [{"camera": 0}] * n["cameras"]
    if n["animations"] > 1 or n["channels"] > 1 or n["keys"] > 1 or n["stored_keys"] > 1:
        n_keys = max(n["keys"], n["stored_keys"])
        rows = {"componentType": 5121, "count": n_keys, "type": "SCALAR"}
        keys = file.add("accessors", rows) if n["keys"] > 1 else file.accessor(np.zeros(n_keys, np.uint8))
        path = "weights" if n_targets else "translation"
        values = {**rows, "count": n_keys * (n_targets or 3)}
        sampler = {"input": keys, "output": file.add("accessors", values)}
        file.tree["nodes"] += [{"mesh": 0} if n_targets else {}] * n["channels"]
        clip = {
            "samplers": [sampler],
            "channels": [{"sampler": 0, "target": {"node": i, "path": path}} for i in range(n["channels"])],
        }
        file.tree["animations"] = [clip] * n["animations"]
    return {"a.glb": file.glb()}


DRACO = {"triangles": 2_000_000, "primitives": 60_000, "nodes": 60_000, "attributes": 60_000}


@functools.lru_cache(2)
def drawn_by_draco(n_triangles: int) -> bytes:
    """A flat grid of about so many triangles; two million are 5 KB."""
    import DracoPy

    n = max(1, int((n_triangles / 2) ** 0.5))
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    triangles = np.concatenate([first[:, None] + [0, 1, n + 2], first[:, None] + [0, n + 2, n + 1]])
    y, x = np.mgrid[0 : n + 1, 0 : n + 1].reshape(2, -1)
    return DracoPy.encode(np.stack([x, y, 0 * x], axis=1).astype(np.float32), triangles.astype(np.uint32))


def draco(n: Sizes) -> Files:
    file, name = GltfFile(), "KHR_draco_mesh_compression"
    view = file.view(drawn_by_draco(n["triangles"]))
    position = file.add("accessors", {"componentType": 5126, "count": 3, "type": "VEC3"})
    names = ["POSITION", *(f"TEXCOORD_{i}" for i in range(n["attributes"] - 1))]
    packed = {name: {"bufferView": view, "attributes": dict.fromkeys(names, 0)}}
    row = {"attributes": dict.fromkeys(names, position), "extensions": packed}
    file.tree["meshes"] = [{"primitives": [row] * n["primitives"]}]
    file.tree["nodes"] = [{"mesh": 0}] * n["nodes"]
    return {"a.glb": file.glb()}


OBJ = {
    "vertices": 600_000, "faces": 600_000, "corners": 300_000, "sizes": 2_000, "groups": 200_000, "uses": 300_000,
    "materials": 300_000, "libraries": 400_000, "spellings": 60_000, "names": 200_000,
    "pixels": 1 << 26, "lines": 4_900_000,
}  # fmt: skip


def obj(n: Sizes) -> Files:
    lines = ["mtllib a.mtl"] * n["libraries"] + [f"mtllib {'./' * (i % 40 + 1)}{i}.mtl" for i in range(n["spellings"])]
    n_rows = max(3, n["vertices"])
    lines += ["v 0 0 0", "v 1 0 0", "v 0 1 0"] + ["v 0 0 0"] * (n_rows - 3)
    n_used = max(n["uses"], n["materials"], n["names"])
    faces = ["f 1 2 3"] * n["faces"]
    if n["corners"] > 1:  # a star of zeros and ones, which turns both ways
        faces.append("f " + "1 2 3 " * (n["corners"] // 3))
    faces += ["f " + "1 2 3 " * (k + 1) for k in range(n["sizes"] - 1)]
    for i in range(max(n_used, n["groups"])):
        lines += [f"g {i}"] * (n["groups"] > 1) + [f"usemtl {i}"] * (n_used > 1) + faces[i % len(faces) :][:1]
    lines += [] if n_used > 1 or n["groups"] > 1 else ["usemtl 0"]
    lines += faces
    library: list[str] = []
    for i in range(max(n["materials"], n["names"])):
        library += [f"newmtl {i}", f"map_Kd {'./' * (i % 50 if n['names'] > 1 else 0)}t.png", f"bump -bm {i} t.png"]
    content = "\n".join(lines) + "\n" * n["lines"]
    return {"a.obj": content.encode(), "a.mtl": "\n".join(library).encode(), "t.png": png(n["pixels"])}


PLY = {
    "vertices": 1_600_000, "faces": 1_200_000, "corners": 2_000_000, "sizes": 250, "strip": 4_900_000,
    "strips": 1_000_000, "empty": 4_900_000, "elements": 200_000, "properties": 200_000, "pixels": 1 << 26,
}  # fmt: skip


def ply(n: Sizes) -> Files:
    kinds = "property uchar x\nproperty uchar y\nproperty uchar z\nproperty uchar s\nproperty uchar t\n"
    vertices = np.zeros((max(3, n["vertices"]), 5), np.uint8)
    vertices[1, 0] = vertices[2, 1] = 1
    rows = [bytes([3, 0, 1, 2])] * n["faces"] + [
        bytes([k % 253 + 3, *([0, 1, 2] * 85)[: k % 253 + 3]]) for k in range(n["sizes"])
    ]
    rows += [b"\0"] * (n["empty"] - 1)
    if n["corners"] > 1:
        rows = [np.uint32(n["corners"]).tobytes() + bytes([0, 1, 2]) * (n["corners"] // 3) + bytes(n["corners"] % 3)]
    count = "uint" if n["corners"] > 1 else "uchar"
    extra = "property uchar red\nproperty uchar green\nproperty uchar blue\n" if n["vertices"] == 1 else ""
    faces = f"element face {len(rows)}\nproperty list {count} uchar vertex_indices\n"
    if n["strip"] > 1 or n["strips"] > 1:
        rows = [np.uint32(n["strip"]).tobytes() + np.resize(np.uint8([0, 1, 2]), n["strip"]).tobytes()] * n["strips"]
        faces = f"element tristrips {len(rows)}\nproperty list uint uchar vertex_indices\n"
    more = "element e 0\n" * (n["elements"] - 1) + "element f 0\n" + "property uchar q\n" * (n["properties"] - 1)
    head = f"ply\nformat binary_little_endian 1.0\ncomment TextureFile t.png\nelement vertex {len(vertices)}\n{kinds}"
    del extra
    return {
        "a.ply": (head + faces + more + "end_header\n").encode() + vertices.tobytes() + b"".join(rows),
        "t.png": png(n["pixels"]),
    }


TEXT_PLY = {"vertices": 400_000, "faces": 600_000, "sizes": 2_000, "blanks": 4_900_000}


def text_ply(n: Sizes) -> Files:
    faces = ["3 0 1 2"] * n["faces"] + [f"{3 * k} " + "0 1 2 " * k for k in range(2, n["sizes"] + 1)]
    head = f"ply\nformat ascii 1.0\nelement vertex {n['vertices'] + 2}\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    head += f"element face {len(faces)}\nproperty list int int vertex_indices\nend_header\n"
    return {
        "a.ply": (head + "0 1 0\n1 0 0\n" + "0 0 0\n" * n["vertices"] + "\n".join(faces) + "\n" * n["blanks"]).encode()
    }


OFF = {"vertices": 400_000, "faces": 600_000, "sizes": 2_000, "colors": 300_000, "blanks": 4_900_000}


def off(n: Sizes) -> Files:
    faces = ["3 0 1 2"] * n["faces"] + [f"{3 * k} " + "0 1 2 " * k for k in range(2, n["sizes"] + 1)]
    faces = faces if n["colors"] == 1 else ["3 0 1 2 1 1 1"] * n["colors"]
    head = f"OFF\n{n['vertices'] + 2} {len(faces)} 0\n0 1 0\n1 0 0\n"
    return {"a.off": (head + "0 0 0\n" * n["vertices"] + "\n".join(faces) + "\n" * n["blanks"]).encode()}


STL = {"triangles": 100_000, "solids": 600_000}


def stl(n: Sizes) -> Files:
    if n["solids"] == 1:
        return {"a.stl": bytes(80) + np.uint32(n["triangles"]).tobytes() + bytes(50 * n["triangles"])}
    facet = b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    return {"a.stl": b"solid a\n" * n["solids"] + facet * min(n["triangles"], 20_000)}


COLLADA = {
    "nodes": 100_000, "doubled": 60, "shared": 60_000, "lists": 50_000, "corners": 2_000_000, "numbers": 2_000_000,
    "materials": 20_000, "bound": 50_000, "names": 20_000, "pixels": 1 << 26,
    "elements": 1_200_000, "polygons": 400_000,
}  # fmt: skip


def collada(n: Sizes) -> Files:
    materials = max(n["materials"], n["names"])
    images = "".join(
        f"<image id='i{i}'><init_from>{'./' * (i % 40)}t.png</init_from></image>" for i in range(n["names"])
    )
    effects = "".join(
        f"<effect id='e{i}'><profile_COMMON><newparam sid='s'><surface type='2D'>"
        f"<init_from>i{i % n['names']}</init_from></surface></newparam>"
        "<newparam sid='t'><sampler2D><source>s</source></sampler2D></newparam><technique sid='c'>"
        "<phong><diffuse><texture texture='t' texcoord='u'/></diffuse></phong></technique></profile_COMMON></effect>"
        for i in range(materials)
    )
    rows = "".join(f"<material id='m{i}'><instance_effect url='#e{i}'/></material>" for i in range(materials))
    bound = "".join(f"<instance_material symbol='y{i}' target='#m{i % materials}'/>" for i in range(n["bound"]))
    placed = (
        f"<instance_geometry url='#g'><bind_material><technique_common>{bound}</technique_common></bind_material>"
        "</instance_geometry>"
    )
    vertex = "<input semantic='VERTEX' source='#v' offset='0'/>"
    triangles = (
        f"<triangles material='y0' count='{n['corners']}'>{vertex}<p>{'0 1 2 ' * n['corners']}</p></triangles>"
        * n["lists"]
    )
    polygons = f"<polygons count='{n['polygons']}'>{vertex}{'<p>0 1 2</p>' * n['polygons']}</polygons>"
    z = "<instance_node url='#z'/>"
    doubled = "<library_nodes><node id='d0'><instance_node url='#z'/></node>" + "".join(
        f"<node id='d{k + 1}'>{f'<instance_node url={chr(39)}#d{k}{chr(39)}/>' * 2}</node>"
        for k in reversed(range(n["doubled"]))
    )
    return {
        "a.dae": (
            "<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><asset/>"
            f"<library_images>{images}</library_images><library_effects>{effects}</library_effects>"
            f"<library_materials>{rows}</library_materials><library_geometries><geometry id='g'><mesh><source id='s'>"
            f"<float_array id='a' count='{9 * n['numbers']}'>{'0 0 0 1 0 0 0 1 0 ' * n['numbers']}</float_array>"
            f"<technique_common><accessor source='#a' count='{3 * n['numbers']}' stride='3'>"
            "<param name='X' type='float'/><param name='Y' type='float'/><param name='Z' type='float'/></accessor>"
            "</technique_common></source><vertices id='v'><input semantic='POSITION' source='#s'/></vertices>"
            f"{triangles}{polygons}</mesh></geometry></library_geometries>{doubled}<node id='z'>{placed}</node>"
            "</library_nodes><library_visual_scenes><visual_scene id='w'><node id='n'>"
            f"<instance_node url='#d{n['doubled']}'/>{placed * (n['nodes'] - 1)}{z * n['shared']}"
            f"{'<extra/>' * (n['elements'] - 1)}</node></visual_scene></library_visual_scenes>"
            "<scene><instance_visual_scene url='#w'/></scene></COLLADA>"
        ).encode(),
        "t.png": png(n["pixels"]),
    }  # fmt: skip


THREEMF = {
    "triangles": 600_000, "vertices": 600_000, "objects": 300_000, "items": 600_000, "components": 600_000,
    "doubled": 60, "deep": 100_000, "elsewhere": 300_000,
}  # fmt: skip


def threemf(n: Sizes) -> Files:
    space = "xmlns='http://schemas.microsoft.com/3dmanufacturing/core/2015/02'"
    mesh = (
        "<mesh><vertices><vertex x='0' y='0' z='0'/><vertex x='1' y='0' z='0'/><vertex x='0' y='1' z='0'/>"
        + "<vertex x='0' y='1' z='0'/>" * (n["vertices"] - 1)
        + f"</vertices><triangles>{'<triangle v1=' + repr('0') + ' v2=' + repr('1') + ' v3=' + repr('2') + '/>'}"
        + "<triangle v1='0' v2='1' v3='2'/>" * (n["triangles"] - 1) + "</triangles></mesh>"
    )  # fmt: skip
    objects = "".join(f"<object id='{i}'>{mesh if i == 0 else mesh[:0]}</object>" for i in range(n["objects"]))
    more = "<component objectid='0'/>" * n["components"]
    more += "<component objectid='0' path='/3D/b.model'/>" * (n["elsewhere"] - 1)
    objects += f"<object id='d0'><components>{more}</components></object>"
    for k in range(n["doubled"] + n["deep"]):
        twice = f"<component objectid='d{k}'/>" * (2 if k < n["doubled"] else 1)
        objects += f"<object id='d{k + 1}'><components>{twice}</components></object>"
    last = n["doubled"] + n["deep"]
    items = f"<item objectid='d{last}'/>" * n["items"]
    model = f"<model {space}><resources>{objects}</resources><build>{items}</build></model>"
    other = f"<model {space}><resources><object id='0'>{mesh}</object></resources><build/></model>"
    stream = io.BytesIO()
    if len(model) > MOST_UNPACKED:
        return {"a.3mf": bytes(MOST_BYTES)}
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("3D/3dmodel.model", model)
        archive.writestr("3D/b.model", other if n["elsewhere"] > 1 else "")
    return {"a.3mf": stream.getvalue()}


ARCHIVES = {"bytes": 40_000_000, "members": 40_000, "lines": 40_000_000, "shift": 1000, "deep": 2_000}


def zipped(n: Sizes) -> Files:
    """An archive that does not begin with its first member."""
    stream = io.BytesIO(b"x" * n["shift"])
    stream.seek(0, 2)
    with zipfile.ZipFile(stream, "a", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for i in range(n["members"]):
            archive.writestr(f"{'a/' * (n['deep'] - 1)}{i}.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        if n["bytes"] > 1 or n["lines"] > 1:
            archive.writestr("b.obj", b"v 0 0 0\n" * (n["bytes"] // 8) + b"\n" * n["lines"])
    return {"a.zip": stream.getvalue()}


def tarred(n: Sizes) -> Files:
    stream = io.BytesIO()
    with gzip.open(stream, "wb", compresslevel=1) as packed, tarfile.open(fileobj=packed, mode="w") as archive:
        for i in range(n["members"]):
            content = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
            row = tarfile.TarInfo(f"{'a/' * min(n['deep'] - 1, 40)}{i}.obj")
            row.size = len(content)
            archive.addfile(row, io.BytesIO(content))
        content = b"v 0 0 0\n" * (n["bytes"] // 8) + b"\n" * n["lines"]
        row = tarfile.TarInfo("b.obj")
        row.size = len(content)
        archive.addfile(row, io.BytesIO(content))
    return {"a.tar.gz": stream.getvalue()}


def gzipped(n: Sizes) -> Files:
    return {"a.obj.gz": gzip.compress(b"v 0 0 0\n" * (n["bytes"] // 8) + b"\n" * n["lines"], 1)}


def bzipped(n: Sizes) -> Files:
    return {"a.obj.bz2": bz2.compress(b"v 0 0 0\n" * (n["bytes"] // 8) + b"\n" * n["lines"])}


def packed_ply(n: Sizes) -> Files:
    stream, files = io.BytesIO(), ply(n | {"strips": max(1, min(n["strips"], MOST_UNPACKED // n["strip"]))})
    if len(files["a.ply"]) > MOST_UNPACKED:
        return {"a.zip": bytes(MOST_BYTES)}
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return {"a.zip": stream.getvalue()}


LEVELS = {"levels": 3_000, "bytes": 80_000_000, "other": 200_000_000}


def levels(n: Sizes) -> Files:
    """Levels of the mesh of `read`."""
    mesh = tl.Mesh(QUAD, [(0, 1, 2)])
    own = {f"vertices_{i}": np.zeros((n["bytes"] // 12 // n["levels"] + 3, 3), np.float32) for i in range(n["levels"])}
    stream = io.BytesIO()
    from topleft._meshes.lod.levels import digest_of

    bounds = np.zeros(n["levels"])
    np.savez_compressed(
        stream, mesh=np.array(digest_of(mesh)), bound=bounds, known=bounds, z=np.zeros(n["other"], np.uint8), **own
    )
    return {"a.npz": stream.getvalue()}


FORMATS = {
    "draco": (DRACO, draco),
    "glb": (GLTF, glb), "obj": (OBJ, obj), "ply": (PLY, ply), "text_ply": (TEXT_PLY, text_ply), "off": (OFF, off),
    "stl": (STL, stl), "collada": (COLLADA, collada), "3mf": (THREEMF, threemf), "zip": (ARCHIVES, zipped),
    "tar": (ARCHIVES, tarred), "gz": ({k: ARCHIVES[k] for k in ("bytes", "lines")}, gzipped),
    "bz2": ({k: ARCHIVES[k] for k in ("bytes", "lines")}, bzipped), "packed_ply": (PLY, packed_ply),
    "levels": (LEVELS, levels),
}  # fmt: skip


@functools.lru_cache(None)
def costs_bytes(kind: str, name: str) -> bool:
    """Whether a part makes a file larger; one that does not is always as large as it may be."""
    most, make = FORMATS[kind]
    few = min(most[name], 1 << 16)
    return sum(map(len, make({**dict.fromkeys(most, 1), name: few}).values())) > 0.5 * few


def files_of(kind: str, pair: tuple[str, ...], most_bytes: int = MOST_BYTES) -> Files:
    """A file whose two parts are as many as its bytes allow."""
    most, make = FORMATS[kind]
    growing = [name for name in pair if costs_bytes(kind, name)]
    sizes = dict.fromkeys(most, 1) | {name: most[name] for name in pair}
    sizes |= dict.fromkeys(growing, 1)
    files = make(dict(sizes))
    while any(sizes[name] < most[name] for name in growing):
        n_before = sum(map(len, files.values()))
        sizes |= {name: min(most[name], 2 * sizes[name]) for name in growing}
        larger = make(dict(sizes))
        if sum(map(len, larger.values())) >= most_bytes:
            break
        files = larger
        if n_before > most_bytes // 2:
            break
    return files


def read(path: Path) -> int:
    """Read a file in this process, which ends if it takes too much."""
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    used = resource.getrusage(resource.RUSAGE_SELF)
    resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime + used.ru_stime) + 3 * MOST_SECONDS, hard))
    resource.setrlimit(resource.RLIMIT_DATA, (2 * MOST_MEMORY, 2 * MOST_MEMORY))
    warnings.simplefilter("ignore", MeshWarning)
    try:
        if path.suffix == ".npz":
            from topleft._meshes.lod.levels import Levels

            Levels.load(path, tl.Mesh(QUAD, [(0, 1, 2)]))
        else:
            tl.load(path)
            if b'"cameras"' in path.read_bytes():
                tl.load_cameras(path)
            if b'"animations"' in path.read_bytes():
                tl.load(path, time=0, clip="all")
    except MissingPackageError as error:
        print("  ", str(error)[:150], flush=True)
        return WITHOUT
    except TopleftError as error:
        print("  ", str(error)[:250].replace(str(path.parent), ""), flush=True)
        return REFUSED
    return MADE


def run(kind: str, pair: tuple[str, ...], most_bytes: int) -> bool:
    """Whether a file is read or refused within the time and the memory."""
    with tempfile.TemporaryDirectory() as name:
        files = files_of(kind, pair, most_bytes)
        for each, content in files.items():
            Path(name, each).write_bytes(content)
        n_bytes = sum(map(len, files.values()))
        path = Path(name, next(iter(files)))
        del files
        sys.stdout.flush()
        child = os.fork()
        if child == 0:
            status = 1
            try:
                status = read(path)
            except BaseException as error:
                print("  ", type(error).__name__, str(error)[:200], flush=True)
            os._exit(status)
        _, status, used = os.wait4(child, 0)
    seconds, memory = used.ru_utime + used.ru_stime, used.ru_maxrss * 1024
    code = os.waitstatus_to_exitcode(status)
    how = {MADE: "made", REFUSED: "refused", WITHOUT: "without its package", -signal.SIGXCPU: "too slow"}.get(
        code, str(code)
    )
    is_right = code in (MADE, REFUSED, WITHOUT) and seconds <= MOST_SECONDS and memory <= MOST_MEMORY
    mark = "" if is_right else "  <-- must not be"
    print(
        f"{kind:11} {' x '.join(pair):30} {n_bytes / 1e6:5.2f} MB {seconds:6.2f} s {memory / 1e6:6.0f} MB {how}{mark}",
        flush=True,
    )
    return is_right


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("asked", nargs="*", metavar="FORMAT[:PART[:PART]]", default=list(FORMATS))
    parser.add_argument("--bytes", type=int, default=MOST_BYTES, help="of a file, before it is read")
    options = parser.parse_args()
    for module in ("trimesh", "lxml.etree", "networkx", "PIL.Image"):
        try:
            __import__(module)
        except ImportError:
            print(f"{module} is not installed")
    start, n, wrong = time.monotonic(), 0, []
    for asked in options.asked:
        kind, *pair = asked.split(":")
        parts = FORMATS[kind][0]
        for each in [tuple(pair)] if pair else [*((one,) for one in parts), *itertools.combinations(parts, 2)]:
            n += 1
            if not run(kind, each, options.bytes):
                wrong.append((kind, *each))
    print(f"{n} files, {len(wrong)} that must not be: {wrong} ({time.monotonic() - start:.0f} s)")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
