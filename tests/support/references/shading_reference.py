"""Shading in float64 NumPy, as docs/design/shading.md tells it: what the kernels are compared with.

Shares no code with them but the snap. All vertices must lie in front of the camera.
"""

import numpy as np

from topleft._meshes.model.environment import DEFAULT_ENVIRONMENT
from topleft._meshes.model.normals import face_normals, unit_or_zero
from topleft._meshes.model.texture import LIGHT_OF_BYTE

TO_HEADLIGHT = np.array([-0.35, 0.45, 1.0]) / np.linalg.norm([-0.35, 0.45, 1.0])


def light_of_image(rgba, encoding="srgb"):
    """Linear light and opacity (H, W, 4) float64, 0 to 1, of a picture."""
    light = np.empty(rgba.shape)
    light[..., :3] = LIGHT_OF_BYTE[encoding][rgba[..., :3]]
    light[..., 3] = rgba[..., 3] / 255
    return light


def halved(level):
    """The next halving (max(1, H // 2), max(1, W // 2), 4): each texel the mean over its area."""
    return halved_along(halved_along(level, 0), 1)


def halved_along(level, axis):
    """Each value is the mean over its area along an axis: over two values, or, of 2 m + 1, over 2 + 1 / m."""
    level = np.moveaxis(level, axis, 0)
    m = len(level) // 2
    if len(level) % 2 and m:
        i, share = np.arange(m).reshape(-1, *[1] * (level.ndim - 1)), m / len(level)
        level = level[:-2:2] * (share * ((m - i) / m)) + level[1::2] * share + level[2::2] * (share * ((i + 1) / m))
    elif m:
        level = (level[::2] + level[1::2]) / 2
    return np.moveaxis(level, 0, axis)


def decode(srgb):
    value = np.asarray(srgb, np.float64) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def encode(light):
    light = np.clip(light, 0, 1)
    return 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


class Weights:
    """Perspective-correct weights (P, 3) of the corners at the visible pixels, and how they change with the pixel."""

    def __init__(self, frags, mesh, camera, size, origin=(0, 0), *, is_snapped=True):
        width, height = size
        self.rows, self.cols = np.nonzero(frags.triangle >= 0)
        self.ids = frags.triangle[self.rows, self.cols]
        clip = np.c_[mesh.vertices, np.ones(len(mesh.vertices))] @ camera.clip_from_world(size).T
        ndc = clip[:, :3] / clip[:, 3:]
        points = np.c_[(ndc[:, 0] + 1) * width / 2, (1 - ndc[:, 1]) * height / 2]
        points = np.rint(points * 256) / 256 if is_snapped else points
        xy, q = points[mesh.triangles[self.ids]], 1 / clip[:, 3][mesh.triangles[self.ids]]
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
    """Unit normals (P, 3) on the side that is seen, and 1, or -1 where that is not the side of the mesh's own."""
    faces, side = face_normals(mesh.vertices, mesh.triangles)[w.ids], np.where(w.is_front, 1, -1)[:, None]
    if is_flat:
        return faces * side, side
    own = unit_or_zero(np.asarray(mesh.vertex_normals(), np.float64))
    turned = np.where((own[w.corners].sum(axis=1) * faces * side).sum(axis=1) < 0, -1, 1)[:, None]
    mixed = w.of(own) * turned
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    return np.where(length > 1e-6, mixed / np.maximum(length, 1e-6), faces * side), turned


def uv_of(texture, mesh):
    """The coordinates of the vertices as the texture is laid on."""
    uv = np.asarray((mesh.uv, mesh.uv1)[texture.uv_set], np.float64)
    return uv if texture.transform is None else np.c_[uv, np.ones(len(uv))] @ texture.transform.T


def look_up(texture, w, mesh):
    uv = uv_of(texture, mesh)
    return sample(texture, w.of(uv), w.slopes_of(uv))


def bent(n, side, w, mesh, material):
    """Normals as the normal map bends them: tangent along u, bitangent towards v, at right angles to the normal."""
    texture, own = material.normal_texture, side * n  # as the mesh has it
    corners, uv = mesh.vertices[w.corners].astype(np.float64), uv_of(texture, mesh)[w.corners]
    edges, steps = corners[:, 1:] - corners[:, :1], uv[:, 1:] - uv[:, :1]
    gradient = np.linalg.inv(steps) @ edges  # rows: along u, along v
    along_u, along_v = gradient[:, 0], gradient[:, 1]
    tangent = unit_or_zero(along_u - (own * along_u).sum(axis=1, keepdims=True) * own)
    bitangent = np.cross(own, tangent)
    faces = np.cross(edges[:, 0], edges[:, 1])
    hand = np.sign((np.cross(along_u, along_v) * faces).sum(axis=1))
    own_side = np.where((w.is_front == (side[:, 0] > 0)), 1, -1)  # normals of a mesh that point into it
    x, y, z = 2 * look_up(texture, w, mesh)[:, :3].T - 1
    x, y = material.normal_scale * x, material.normal_scale * y
    turned = x[:, None] * tangent + (y * hand * own_side)[:, None] * bitangent + z[:, None] * own
    return side * unit_or_zero(turned)


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
    levels = [light_of_image(texture.image, texture.encoding)[::-1]]
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


def mirrored_share(roughness, n_dot_v):
    """Karis's fit of what a surface mirrors of white surroundings: scale and offset of f0."""
    offset = 0.0425 - 0.0275 * roughness
    a = np.minimum((1 - roughness) ** 2, 2 ** (-9.28 * n_dot_v)) * (1 - roughness) + offset
    return 1.04 - 0.572 * roughness - 1.04 * a, 1.04 * a + 0.022 * roughness - 0.04


def blurred_sky(height, roughness):
    """The share of the sky that a rough surface sees round a direction."""
    alpha = roughness**2
    spread = 4 * alpha**2 / (1 + 1.6 * alpha + 1.4 * alpha**2)
    return 0.5 + 0.5 * height / np.sqrt(height**2 + spread * (1 - height**2))


def environment_light(environment, at, roughness):
    """Light (P, 3) from directions in the world: gathered by a matt surface if there is no roughness, else mirrored."""
    at = unit_or_zero(at) @ environment.axes.T
    if environment.image is None:
        share = 0.5 + 0.5 * at[:, 1:2] if roughness is None else blurred_sky(at[:, 1:2], roughness)
        sky, ground = (np.array(color) for color in environment.colors)
        return ground + share * (sky - ground)
    texels, rows = environment.levels
    if roughness is None:
        return octahedral(texels, rows[-1], at)
    level = roughness[:, 0] * (len(rows) - 2)
    stack = np.stack([octahedral(texels, row, at) for row in rows[:-1]])
    low = np.minimum(np.floor(level).astype(int), len(rows) - 3)
    share, every = (level - low)[:, None], np.arange(len(at))
    return (1 - share) * stack[low, every] + share * stack[low + 1, every]


def octahedral(texels, row, at):
    offset, n = row
    level = texels[offset : offset + (n + 2) ** 2, :3].reshape(n + 2, n + 2, 3).astype(np.float64)
    at = at / np.abs(at).sum(axis=1, keepdims=True)
    x, z = at[:, 0], at[:, 2]
    beyond_x, beyond_z = (1 - np.abs(z)) * np.where(x < 0, -1, 1), (1 - np.abs(x)) * np.where(z < 0, -1, 1)
    flat = np.where(at[:, 1:2] < 0, np.c_[beyond_x, beyond_z], np.c_[x, z])
    where = (flat + 1) / 2 * n + 0.5
    first = np.clip(np.floor(where).astype(int), 0, n)
    (fx, fy), (column, line) = (where - first).T[..., None], first.T
    upper, lower = ((1 - fx) * level[line + k, column] + fx * level[line + k, column + 1] for k in (0, 1))
    return (1 - fy) * upper + fy * lower


def lights_at(lights, points, n, camera, ambient):
    """Direction, strength (P, 3), and what a matt surface sends on of each light; the headlight unless given."""
    if lights is None:
        direction = np.broadcast_to(TO_HEADLIGHT @ camera.view[:3, :3], n.shape)
        cosine = (n * direction).sum(axis=1, keepdims=True)
        yield direction, np.full((len(n), 3), 1 - ambient), (0.5 + 0.5 * cosine) ** 3
        return
    for light in lights:
        at, strength = np.array(light.at, np.float64), np.ones((len(n), 1))
        direction = np.broadcast_to(at, n.shape)
        if light.kind in ("point", "spot"):
            strength = 1 / (1 + light.falloff * ((at - points) ** 2).sum(axis=1, keepdims=True))
            if light.kind == "spot":
                cosines = unit_or_zero(points - at) @ unit_or_zero(np.array([light.direction]))[0]
                inner, outer = np.cos(np.radians([light.inner_deg, light.outer_deg]))
                strength = strength * np.clip((cosines - outer) / (inner - outer), 0, 1)[:, None] ** 2
            direction = at - points
        direction = unit_or_zero(direction)
        cosine = (n * direction).sum(axis=1, keepdims=True)
        yield direction, light.intensity * strength * decode(light.color), np.maximum(cosine, 0)


def metallic_rough(base, n, viewer, lights, around, metallic, roughness):
    """glTF 2.0, appendix B, height-correlated visibility; `around` gives gathered and mirrored light, occlusion."""
    roughness = np.clip(roughness, 0.045, 1)
    alpha2, f0, matt = roughness**4, 0.04 + metallic * (base - 0.04), (1 - metallic) * base
    n_dot_v = np.minimum(np.abs((n * viewer).sum(axis=1, keepdims=True)), 1)
    scale, offset = mirrored_share(roughness, n_dot_v)
    mirrors = np.maximum(f0 * scale + offset, 0)
    gathered, mirrored, occlusion = around(2 * (n * viewer).sum(axis=1, keepdims=True) * n - viewer, roughness)
    light = occlusion * (mirrors * mirrored + matt * (1 - mirrors) * gathered)
    for direction, color, share in lights:
        half = unit_or_zero(direction + viewer)
        n_dot_l, n_dot_h, v_dot_h = (
            (a * b).sum(axis=1, keepdims=True) for a, b in ((n, direction), (n, half), (viewer, half))
        )
        fresnel = f0 + (1 - f0) * (1 - v_dot_h) ** 5
        d = alpha2 / (n_dot_h**2 * (alpha2 - 1) + 1) ** 2  # times pi
        from_light, from_eye = (np.sqrt(c**2 * (1 - alpha2) + alpha2) for c in (n_dot_l, n_dot_v))
        v = 0.5 / np.maximum(n_dot_l * from_eye + n_dot_v * from_light, 1e-30)
        shine = np.where((n_dot_l > 0) & (n_dot_h > 0), d * v * n_dot_l, 0)
        light = light + color * ((1 - fresnel) * matt * share + fresnel * shine)
    return light


def picture(
    frags, mesh, camera, size, material, lights=None, ambient=None, *,
    is_flat=False, fog=None, origin=(0, 0), environment=None,
):  # fmt: skip
    """sRGB (H, W, 3) float64, not rounded; NaN where nothing shows."""
    w = Weights(frags, mesh, camera, size, origin)
    (n, side), points = normals(w, mesh, is_flat=is_flat), w.of(mesh.vertices)
    has_texture = material.texture is not None and mesh.uv is not None
    base = decode(material.color or (255, 255, 255)) * np.ones((len(n), 3))
    if mesh.colors is not None:
        is_light = mesh.color_interpolation == "linear"
        base = base * (w.of(decode(mesh.colors[:, :3])) if is_light else decode(np.rint(w.of(mesh.colors[:, :3]))))
    if has_texture:
        base = base * look_up(material.texture, w, mesh)[:, :3]
    if material.back_color is not None:
        base = np.where(w.is_front[:, None], base, decode(material.back_color))
    if material.normal_texture is not None:
        n = bent(n, side, w, mesh, material)
    if ambient is None:
        ambient = 0.03 if environment is None else 0.0
    if environment is not None and lights is None:
        lights = ()
    viewer, occlusion = to_eye(camera, points), 1.0
    if material.occlusion_texture is not None:
        occlusion = 1 + material.occlusion_strength * (look_up(material.occlusion_texture, w, mesh)[:, :1] - 1)

    def around(mirrored_at, roughness):
        gathered = mirrored = np.full((len(n), 3), ambient)
        if environment is not None:
            gathered = gathered + environment_light(environment, n, None)
            mirrored = mirrored + environment_light(environment, mirrored_at, roughness)
        elif material.is_metallic_rough:
            turned = mirrored_at @ camera.view[:3, :3].T
            mirrored = mirrored + environment_light(DEFAULT_ENVIRONMENT, turned, roughness)
        return gathered, mirrored, occlusion

    found = list(lights_at(lights, points, n, camera, ambient))
    if material.unlit:
        light = base
    elif material.is_metallic_rough:
        metallic, roughness = (
            np.full((len(n), 1), 1.0 if a is None else a) for a in (material.metallic, material.roughness)
        )
        if material.metallic_roughness_texture is not None:
            texels = look_up(material.metallic_roughness_texture, w, mesh)
            roughness, metallic = roughness * texels[:, 1:2], metallic * texels[:, 2:3]
        light = metallic_rough(base, n, viewer, found, around, metallic, roughness)
    else:
        light = base * occlusion * around(n, np.ones((len(n), 1)))[0]
        for direction, color, share in found:
            light = light + base * color * share
            half = (n * unit_or_zero(direction + viewer)).sum(axis=1, keepdims=True)
            is_lit = (n * direction).sum(axis=1, keepdims=True) > 0
            shine = np.where(is_lit, np.maximum(half, 0) ** material.shininess, 0)
            light = light + shine * color * material.specular
    if any(material.emission) and not material.unlit:
        shining = np.array(material.emission)
        has_map = material.emission_texture is not None
        light = light + shining * (look_up(material.emission_texture, w, mesh)[:, :3] if has_map else 1)
    if fog is not None:
        distance = -(points @ camera.view[2, :3] + camera.view[2, 3])
        share = np.clip((distance - fog.near) / (fog.far - fog.near), 0, 1)[:, None]
        light = light + share * (decode(fog.color) - light)
    result = np.full((*frags.triangle.shape, 3), np.nan)
    result[w.rows, w.cols] = encode(light)
    return result
