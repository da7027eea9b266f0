"""Shading in float64 NumPy, as docs/design/shading.md tells it: what the kernels are compared with.

Shares no code with them but the snap and the halvings of textures. All vertices must lie in front of the camera.
"""

import numpy as np

from topleft._model.normals import face_normals, unit_or_zero
from topleft._model.texture import halved, light_of_image

TO_HEADLIGHT = np.array([-0.35, 0.45, 1.0]) / np.linalg.norm([-0.35, 0.45, 1.0])


def decode(srgb):
    value = np.asarray(srgb, np.float64) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def encode(light):
    light = np.clip(light, 0, 1)
    return 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


class Weights:
    """Perspective-correct weights (P, 3) of the corners at the visible pixels, and how they change with the pixel."""

    def __init__(self, frags, mesh, camera, size, origin=(0, 0)):
        width, height = size
        self.rows, self.cols = np.nonzero(frags.triangle >= 0)
        self.ids = frags.triangle[self.rows, self.cols]
        clip = np.c_[mesh.vertices, np.ones(len(mesh.vertices))] @ camera.clip_from_world(size).T
        ndc = clip[:, :3] / clip[:, 3:]
        snapped = np.rint(np.c_[(ndc[:, 0] + 1) * width / 2, (1 - ndc[:, 1]) * height / 2] * 256) / 256
        xy, q = snapped[mesh.triangles[self.ids]], 1 / clip[:, 3][mesh.triangles[self.ids]]
        at = np.c_[self.cols + 0.5 + origin[0], self.rows + 0.5 + origin[1]]
        edge, along = np.empty((len(at), 3)), np.empty((2, len(at), 3))
        for k in range(3):
            a, b = xy[:, (k + 1) % 3], xy[:, (k + 2) % 3]
            d = b - a
            edge[:, k] = (d[:, 1] * (at - a)[:, 0] - d[:, 0] * (at - a)[:, 1]) * q[:, k]  # positive: the front
            along[0, :, k], along[1, :, k] = d[:, 1] * q[:, k], -d[:, 0] * q[:, k]
        total = edge.sum(axis=1)
        self.is_front = total > 0
        self.weights = edge / total[:, None]
        self.gradients = [(step - self.weights * step.sum(axis=1)[:, None]) / total[:, None] for step in along]
        self.corners = mesh.triangles[self.ids]

    def of(self, values):
        return np.einsum("pk,pkc->pc", self.weights, np.asarray(values, np.float64)[self.corners])

    def slopes_of(self, values):
        return [np.einsum("pk,pkc->pc", step, np.asarray(values, np.float64)[self.corners]) for step in self.gradients]


def normals(w, mesh, *, is_flat):
    faces = face_normals(mesh.vertices, mesh.triangles)[w.ids] * np.where(w.is_front, 1, -1)[:, None]
    if is_flat:
        return faces
    own = unit_or_zero(np.asarray(mesh.vertex_normals(), np.float64))
    turned = np.where((own[w.corners].sum(axis=1) * faces).sum(axis=1) < 0, -1, 1)[:, None]
    mixed = w.of(own) * turned
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    return np.where(length > 1e-6, mixed / np.maximum(length, 1e-6), faces)


def folded(a, wrap):
    if wrap == "repeat":
        return a - np.floor(a)
    return np.clip(a, 0, 1) if wrap == "clamp" else 1 - np.abs(a - 2 * np.floor(a / 2) - 1)


def sample_level(level, uv, wrap):
    height, width = level.shape[:2]
    texels = []
    for k, n in enumerate((width, height)):
        x = uv[:, k] * n - 0.5
        below = np.floor(x).astype(int)
        pair = [(below + step) % n if wrap[k] == "repeat" else np.clip(below + step, 0, n - 1) for step in (0, 1)]
        texels.append((pair, (x - below)[:, None]))
    (columns, fx), (rows, fy) = texels
    lower, upper = ((1 - fx) * level[row, columns[0]] + fx * level[row, columns[1]] for row in rows)
    return (1 - fy) * lower + fy * upper


def sample(texture, uv, slopes):
    levels = [light_of_image(texture.image)[::-1]]
    height, width = levels[0].shape[:2]
    uv = np.stack([folded(uv[:, k], texture.wrap[k]) for k in range(2)], axis=1)
    if texture.filter == "nearest":
        column, row = (np.minimum(np.floor(uv[:, k] * n).astype(int), n - 1) for k, n in enumerate((width, height)))
        return levels[0][row, column]
    if texture.filter == "bilinear":
        return sample_level(levels[0], uv, texture.wrap)
    while max(levels[-1].shape[:2]) > 1:
        levels.append(halved(levels[-1]))
    longest = np.max([((slope * (width, height)) ** 2).sum(axis=1) for slope in slopes], axis=0)
    lod = np.clip(0.5 * np.log2(np.maximum(longest, 1e-30)), 0, len(levels) - 1)
    stack = np.stack([sample_level(level, uv, texture.wrap) for level in levels])
    low = np.floor(lod).astype(int)
    high, share = np.minimum(low + 1, len(levels) - 1), (lod - low)[:, None]
    return (1 - share) * stack[low, np.arange(len(uv))] + share * stack[high, np.arange(len(uv))]


def to_eye(camera, points):
    linear = camera.view[:3, :3]
    if camera.projection[3, 2] == 0:
        return np.broadcast_to(linear[2] / np.linalg.norm(linear[2]), points.shape)
    return unit_or_zero(-np.linalg.inv(linear) @ camera.view[:3, 3] - points)


def light_up(n, points, viewer, lights, ambient, material):
    """Diffuse light and highlights (P, 3) of lights in the world."""
    diffuse, shine = np.full((len(n), 3), ambient), np.zeros((len(n), 3))
    for light in lights:
        at, strength = np.array(light.at, np.float64), np.ones((len(n), 1))
        if light.kind == "point":
            way = at - points
            strength = 1 / (1 + light.falloff * (way**2).sum(axis=1, keepdims=True))
            direction = unit_or_zero(way)
        else:
            direction = np.broadcast_to(at / np.linalg.norm(at), n.shape)
        cosine = (n * direction).sum(axis=1, keepdims=True)
        color = light.intensity * strength * decode(light.color)
        diffuse += np.maximum(cosine, 0) * color
        half = (n * unit_or_zero(direction + viewer)).sum(axis=1, keepdims=True)
        shine += np.where(cosine > 0, np.maximum(half, 0) ** material.shininess, 0) * color * material.specular
    return diffuse, shine


def picture(frags, mesh, camera, size, material, lights=None, ambient=0.03, *, is_flat=False, fog=None, origin=(0, 0)):
    """sRGB (H, W, 3) float64, not rounded; NaN where nothing shows."""
    w = Weights(frags, mesh, camera, size, origin)
    n, points = normals(w, mesh, is_flat=is_flat), w.of(mesh.vertices)
    has_texture = material.texture is not None and mesh.uv is not None
    light = decode(material.color or (255, 255, 255)) * np.ones((len(n), 3))
    if mesh.colors is not None:
        light = light * decode(np.rint(w.of(mesh.colors[:, :3])))
    if has_texture:
        light = light * sample(material.texture, w.of(mesh.uv), w.slopes_of(mesh.uv))[:, :3]
    if material.back_color is not None:
        light = np.where(w.is_front[:, None], light, decode(material.back_color))
    if lights is None:
        cosine = (n @ camera.view[:3, :3].T @ TO_HEADLIGHT)[:, None]
        light = light * (ambient + (1 - ambient) * (0.5 + 0.5 * cosine) ** 3)
    else:
        diffuse, shine = light_up(n, points, to_eye(camera, points), lights, ambient, material)
        light = light * diffuse + shine
    if fog is not None:
        distance = -(points @ camera.view[2, :3] + camera.view[2, 3])
        share = np.clip((distance - fog.near) / (fog.far - fog.near), 0, 1)[:, None]
        light = light + share * (decode(fog.color) - light)
    result = np.full((*frags.triangle.shape, 3), np.nan)
    result[w.rows, w.cols] = encode(light)
    return result
