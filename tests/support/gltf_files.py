"""Small glTF files, written from arrays."""

import base64
import json
import struct

import numpy as np

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
QUAD = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)


class GltfFile:
    """A file that grows: each method returns the index of what it adds."""

    def __init__(self, **tree):
        self.tree = {"asset": {"version": "2.0"}, **tree}
        self.blob = b""

    def add(self, kind, row):
        self.tree.setdefault(kind, []).append(row)
        return len(self.tree[kind]) - 1

    def view(self, content, **more):
        self.blob += b"\0" * (-len(self.blob) % 4)
        row = {"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(content), **more}
        self.blob += content
        return self.add("bufferViews", row)

    def accessor(self, values, **more):
        values = np.asarray(values)
        if values.dtype == np.int64:
            values = values.astype(np.uint16)
        if values.dtype == np.float64:
            values = values.astype(np.float32)
        n_columns = 1 if values.ndim == 1 else values[0].size
        row = {"componentType": COMPONENTS[values.dtype.str[1:]], "count": len(values), "type": TYPES[n_columns]}
        return self.add("accessors", {"bufferView": self.view(values.tobytes()), **row, **more})

    def image(self, pixels):
        import io

        from PIL import Image

        stream = io.BytesIO()
        Image.fromarray(np.asarray(pixels, np.uint8)).save(stream, format="PNG")
        return self.add("images", {"bufferView": self.view(stream.getvalue()), "mimeType": "image/png"})

    def texture(self, pixels, **sampler):
        row = {"source": self.image(pixels)}
        if sampler:
            row["sampler"] = self.add("samplers", sampler)
        return self.add("textures", row)

    def primitive(self, positions=TRIANGLE, indices=None, **more):
        attributes = {"POSITION": self.accessor(positions)}
        for name in [name for name in more if name.isupper()]:
            value = more.pop(name)
            attributes[name] = value if isinstance(value, int) else self.accessor(value)
        row = {"attributes": attributes, **more}
        if indices is not None:
            row["indices"] = self.accessor(indices)
        return row

    def mesh(self, *primitives, **more):
        return self.add("meshes", {"primitives": list(primitives), **more})

    def node(self, **row):
        return self.add("nodes", row)

    def shown(self, *args, **more):
        """One primitive in one node."""
        self.node(mesh=self.mesh(self.primitive(*args, **more)))
        return self

    def gltf(self):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.blob).decode()
        tree = dict(self.tree)
        if self.blob:
            tree["buffers"] = [{"byteLength": len(self.blob), "uri": uri}]
        return json.dumps(tree).encode()

    def glb(self):
        tree = {**self.tree, "buffers": [{"byteLength": len(self.blob)}]}
        text = json.dumps(tree).encode()
        return glb_of(text, self.blob)


def glb_of(text, blob):
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body
