"""The light of topleft in GLSL, by docs/design/shading.md, drawn by OpenGL on Mesa's llvmpipe.

In: a scene of `scenes.py`. Out: its picture and its ids. Shares no code with the kernels or with
`ShadingInputs`.
Needs moderngl and Mesa's EGL library. The vertex shader turns y over, so that row 0 is on top.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

import topleft as tl
from benchmarks.peers import llvmpipe_context
from benchmarks.pictures.scenes import SIZE, PictureScene
from topleft._core.base.color import DEFAULT_COLOR
from topleft._meshes.model.environment import DEFAULT_ENVIRONMENT

ENVIRONMENT = {"LIBGL_ALWAYS_SOFTWARE": "1", "GALLIUM_DRIVER": "llvmpipe", "LP_NUM_THREADS": "0"}

MAX_LIGHTS = 8
"""That the shader has room for."""

VERTEX_SHADER = """
#version 330
uniform mat4 clip_from_world;
in vec3 position, normal, color;
in vec2 uv;
out vec3 position_world, normal_world, color_srgb;
out vec2 at;
void main() {
    position_world = position;
    normal_world = normal;
    color_srgb = color;
    at = uv;
    gl_Position = clip_from_world * vec4(position, 1);
}
"""

# Integer targets are cleared to 0: ids go in one higher.
FRAGMENT_SHADER = """
#version 330
const int HEADLIGHT = 0, LIGHTS = 1, MATCAP = 2, MAX_LIGHTS = 8;
uniform int kind, n_lights;
uniform bool own_level;
uniform bool mirror_u, mirror_v; // moderngl knows repeat and clamp alone
uniform bool has_texture, has_colors, has_back;
uniform vec3 front_color, back_color, ambient, to_headlight, eye, fog_color;
uniform vec2 fog;                // near, far
uniform bool has_fog, has_perspective;
uniform float specular, shininess;
uniform mat4 eye_from_world;
uniform sampler2D image;
uniform bool is_metallic, has_metallic_map, has_occlusion_map, has_normal_map, has_emission_map;
uniform sampler2D metallic_map, occlusion_map, normal_map, emission_map;
uniform float metallic, roughness, occlusion_strength, normal_scale, diffuse_of_around;
uniform vec3 emission, sky, ground;
uniform mat4 around_from_world;  // up is y
uniform vec4 light_at[MAX_LIGHTS];        // a direction if w = 0
uniform vec4 light_color[MAX_LIGHTS];     // linear, and the falloff
in vec3 position_world, normal_world, color_srgb;
in vec2 at;
layout(location = 0) out vec4 color;
layout(location = 1) out int id;

vec3 light_of(vec3 srgb) {
    return mix(pow((srgb + 0.055) / 1.055, vec3(2.4)), srgb / 12.92, lessThanEqual(srgb, vec3(0.04045)));
}
vec3 srgb_of(vec3 light) {
    light = clamp(light, 0, 1);
    return mix(1.055 * pow(light, vec3(1 / 2.4)) - 0.055, 12.92 * light, lessThanEqual(light, vec3(0.0031308)));
}
vec3 bent(vec3 own) {   // the normal that the mesh has, the frame from derivatives across pixels
    vec3 px = dFdx(position_world), py = dFdy(position_world);
    vec2 ux = dFdx(at), uy = dFdy(at);
    float det = ux.x * uy.y - uy.x * ux.y;
    vec3 along_u = (uy.y * px - ux.y * py) / det, along_v = (ux.x * py - uy.x * px) / det;
    vec3 t = normalize(along_u - dot(along_u, own) * own);
    vec3 b = cross(own, t) * sign(dot(cross(own, along_u), along_v));
    vec3 m = 2 * texture(normal_map, at).rgb - 1;
    return normalize(normal_scale * m.x * t + normal_scale * m.y * b + m.z * own);
}
vec3 mirrored_light(float height, float alpha) {
    float spread = 4 * alpha * alpha / (1 + 1.6 * alpha + 1.4 * alpha * alpha);
    return mix(ground, sky, 0.5 + 0.5 * height / sqrt(height * height + spread * (1 - height * height)));
}
vec3 metallic_rough(vec3 base, vec3 n, vec3 viewer, float m, float r, float occlusion) { // glTF 2.0, appendix B
    const float PI = 3.14159265358979;
    r = clamp(r, 0.045, 1);
    float a2 = r * r * r * r, nv = abs(dot(n, viewer));
    vec3 f0 = mix(vec3(0.04), base, m), matt = base * (1 - m);
    float offset = 0.0425 - 0.0275 * r, slope = min((1 - r) * (1 - r), exp2(-9.28 * nv)) * (1 - r) + offset;
    vec3 mirrors = max(f0 * (1.04 - 0.572 * r - 1.04 * slope) + 1.04 * slope + 0.022 * r - 0.04, 0);
    vec3 d = mat3(around_from_world) * reflect(-viewer, n), up = mat3(around_from_world) * n;
    vec3 gathered = ambient + diffuse_of_around * mix(ground, sky, 0.5 + 0.5 * up.y);
    vec3 light = occlusion * (mirrors * (ambient + mirrored_light(d.y, r * r)) + matt * (1 - mirrors) * gathered);
    for (int k = 0; k < n_lights || (kind == HEADLIGHT && k == 0); k++) {
        vec3 way = light_at[k].xyz - light_at[k].w * position_world;
        vec3 l = kind == HEADLIGHT ? transpose(mat3(eye_from_world)) * to_headlight : normalize(way);
        vec3 strength = light_color[k].rgb / (1 + light_at[k].w * light_color[k].a * dot(way, way));
        if (kind == HEADLIGHT) strength = 1 - ambient;
        vec3 h = normalize(l + viewer);
        float nl = dot(n, l), nh = dot(n, h), share = kind == HEADLIGHT ? pow((1 + nl) / 2, 3) : max(0, nl);
        vec3 f = f0 + (1 - f0) * pow(1 - dot(viewer, h), 5);
        float shine = 0;
        if (nl > 0 && nh > 0) {
            float ggx = a2 / (PI * pow(nh * nh * (a2 - 1) + 1, 2));
            shine = ggx * 0.5 / (nl * sqrt(nv * nv * (1 - a2) + a2) + nv * sqrt(nl * nl * (1 - a2) + a2)) * nl;
        }
        light += PI * strength * ((1 - f) * matt / PI * share + f * shine);
    }
    return light;
}
void main() {
    vec3 own = normalize(normal_world), n = own * (gl_FrontFacing ? 1 : -1);
    if (has_normal_map) n = bent(own) * (gl_FrontFacing ? 1 : -1);
    vec3 n_eye = normalize(mat3(eye_from_world) * n);
    vec3 base = light_of(front_color / 255);
    if (has_colors) base *= light_of(floor(color_srgb + 0.5) / 255);
    if (has_texture) {
        vec2 folded = 1 - abs(mod(at, 2) - 1);
        vec2 uv = vec2(mirror_u ? folded.x : at.x, mirror_v ? folded.y : at.y);
        vec2 right = dFdx(at) * textureSize(image, 0), up = dFdy(at) * textureSize(image, 0);
        float level = 0.5 * log2(max(dot(right, right), dot(up, up)));
        base *= (own_level ? textureLod(image, uv, level) : texture(image, uv)).rgb;
    }
    if (has_back && !gl_FrontFacing) base = light_of(back_color / 255);
    vec3 light;
    float m = metallic, r = roughness, occlusion = 1;
    if (has_metallic_map) m *= texture(metallic_map, at).b;
    if (has_metallic_map) r *= texture(metallic_map, at).g;
    if (has_occlusion_map) occlusion = 1 + occlusion_strength * (texture(occlusion_map, at).r - 1);
    if (is_metallic) {
        light = metallic_rough(base, n, has_perspective ? normalize(eye - position_world) : eye, m, r, occlusion);
    } else if (kind == MATCAP) {
        light = texture(image, 0.5 + 0.5 * n_eye.xy).rgb;
    } else if (kind == HEADLIGHT) {
        light = base * (ambient + (1 - ambient) * pow((1 + dot(n_eye, to_headlight)) / 2, 3));
    } else {
        vec3 diffuse = ambient * occlusion, shine = vec3(0);
        vec3 viewer = has_perspective ? normalize(eye - position_world) : eye;
        for (int k = 0; k < n_lights; k++) {
            vec3 way = light_at[k].xyz - light_at[k].w * position_world;
            vec3 l = normalize(way);
            vec3 strength = light_color[k].rgb / (1 + light_at[k].w * light_color[k].a * dot(way, way));
            diffuse += strength * max(0, dot(n, l));
            if (dot(n, l) > 0) shine += strength * specular * pow(max(0, dot(n, normalize(l + viewer))), shininess);
        }
        light = base * diffuse + shine;
    }
    light += emission * (has_emission_map ? texture(emission_map, at).rgb : vec3(1));
    float far_off = -(eye_from_world * vec4(position_world, 1)).z;
    if (has_fog) light = mix(light, light_of(fog_color / 255), clamp((far_off - fog.x) / (fog.y - fog.x), 0, 1));
    color = vec4(srgb_of(light), 1);
    id = gl_PrimitiveID + 1;
}
"""


class OpenGL:
    """A context on llvmpipe that draws scenes.

    Raises
    ------
    ImportError
        If moderngl is not installed.
    RuntimeError
        If OpenGL runs on something else than llvmpipe.
    """

    def __init__(self) -> None:
        import moderngl

        os.environ.update(ENVIRONMENT)
        self.context = llvmpipe_context()
        self.renderer = f"{self.context.info['GL_RENDERER']}, OpenGL {self.context.info['GL_VERSION']}"
        self.program = self.context.program(vertex_shader=VERTEX_SHADER, fragment_shader=FRAGMENT_SHADER)
        targets = [self.context.texture(SIZE, 4), self.context.texture(SIZE, 1, dtype="i4")]
        self.frame = self.context.framebuffer(targets, self.context.depth_texture(SIZE))
        self.context.enable_only(moderngl.DEPTH_TEST)
        self.context.front_face = "cw"  # turned over

    def draw(self, scene: PictureScene) -> tuple[np.ndarray, np.ndarray]:
        """Return the picture (H, W, 3) uint8 on white and the ids (H, W) int32, -1 where nothing shows."""
        for name, value in uniforms(scene).items():
            uniform = self.program[name]
            if np.ndim(value):
                uniform.write(np.ascontiguousarray(value, np.float32).tobytes())
            else:
                uniform.value = value
        texture = texture_of(scene)
        if texture is not None:
            self.upload(texture).use(0)
        for unit, (name, own) in enumerate(maps_of(scene.material).items(), 1):
            self.program[name].value = unit
            if own is not None:
                self.upload(own).use(unit)
        buffer = self.context.buffer(corner_rows(scene).tobytes())
        names = "position", "normal", "color", "uv"
        mesh = self.context.vertex_array(self.program, [(buffer, "3f 3f 3f 2f", *names)])
        self.frame.use()
        self.frame.clear(0, 0, 0, 0, depth=1.0)
        mesh.render()
        width, height = SIZE
        pixels, numbers = self.frame.read(alignment=1), self.frame.read(attachment=1, components=1, dtype="i4")
        picture = np.frombuffer(pixels, np.uint8).reshape(height, width, 3)
        ids = np.frombuffer(numbers, np.int32).reshape(height, width) - 1
        return np.where(ids[..., None] < 0, np.uint8(255), picture), ids

    def upload(self, texture: tl.Texture) -> Any:
        """The texture as linear light in float32, row 0 at v = 0, with OpenGL's own halvings."""
        gl = self.context
        height, width = texture.image.shape[:2]
        values = texture.image[::-1, :, :3]
        light = (decode(values) if texture.encoding == "srgb" else values / 255).astype(np.float32)
        uploaded = gl.texture((width, height), 3, light.tobytes(), dtype="f4", alignment=1)
        if texture.filter == "trilinear":
            uploaded.build_mipmaps()
        uploaded.filter = {
            "nearest": (gl.NEAREST, gl.NEAREST),
            "bilinear": (gl.LINEAR, gl.LINEAR),
            "trilinear": (gl.LINEAR_MIPMAP_LINEAR, gl.LINEAR),
        }[texture.filter]
        uploaded.repeat_x, uploaded.repeat_y = (one == "repeat" for one in texture.wrap)
        return uploaded


def decode(srgb: np.ndarray) -> np.ndarray:
    """Linear light, 0 to 1, of sRGB values of 0 to 255 (IEC 61966-2-1)."""
    value = np.asarray(srgb, np.float64) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def texture_of(scene: PictureScene) -> tl.Texture | None:
    """The picture that the shader reads: the matcap, or the texture."""
    return scene.options.get("matcap") or scene.material.texture


def maps_of(material: tl.Material) -> dict[str, tl.Texture | None]:
    """The other pictures by the names of their samplers."""
    return {
        "metallic_map": material.metallic_roughness_texture,
        "occlusion_map": material.occlusion_texture,
        "normal_map": material.normal_texture,
        "emission_map": material.emission_texture,
    }


def corner_rows(scene: PictureScene) -> np.ndarray:
    """A row (3 T, 11) float32 for each corner of each triangle: position, normal, colour, uv."""
    mesh = scene.mesh
    corners = mesh.vertices[mesh.triangles]
    if scene.options.get("shading") == "flat":
        faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = np.repeat(faces[:, None], 3, axis=1)
    else:
        normals = mesh.vertex_normals()[mesh.triangles]
    colors = np.zeros_like(corners) if mesh.colors is None else mesh.colors[:, :3][mesh.triangles]
    uv = np.zeros_like(corners[..., :2]) if mesh.uv is None else mesh.uv[mesh.triangles]
    return np.concatenate([corners, normals, colors, uv], axis=-1).reshape(-1, 11).astype(np.float32)


def uniforms(scene: PictureScene) -> dict[str, Any]:
    """The uniforms of the shaders by name; matrices are turned, for OpenGL has columns first."""
    options, material, view = scene.options, scene.material, scene.camera.view
    texture, mesh = material.texture, scene.mesh
    lights = options.get("lights")
    fog = options.get("fog")
    has_perspective = bool(scene.camera.projection[3, 2])
    eye_axes = np.linalg.inv(view)
    has_colors = texture is not None or mesh.colors is not None
    color = material.color or ((255, 255, 255) if has_colors else options.get("color", DEFAULT_COLOR))
    wraps = texture.wrap if texture else ("repeat", "repeat")
    return {
        "clip_from_world": (np.diag([1.0, -1.0, 1.0, 1.0]) @ scene.camera.clip_from_world(SIZE)).T,
        "eye_from_world": view.T,
        "has_perspective": has_perspective,
        "eye": eye_axes[:3, 3] if has_perspective else eye_axes[:3, 2],
        "kind": kind_of(options),
        "has_texture": texture is not None,
        "own_level": scene.own_level,
        "mirror_u": wraps[0] == "mirror",
        "mirror_v": wraps[1] == "mirror",
        "has_colors": mesh.colors is not None,
        "front_color": color,
        "has_back": material.back_color is not None,
        "back_color": material.back_color or (0, 0, 0),
        "ambient": (options.get("ambient", 0.0 if options.get("environment") else 0.03),) * 3,
        "to_headlight": np.array([-0.35, 0.45, 1.0]) / np.linalg.norm([-0.35, 0.45, 1.0]),
        "specular": material.specular,
        "shininess": material.shininess,
        "has_fog": fog is not None,
        "fog": (fog.near, fog.far) if fog else (0, 1),
        "fog_color": fog.color if fog else (0, 0, 0),
        **light_uniforms(lights or (), eye_axes),
        **full_uniforms(material, options.get("environment"), view),
    }


def full_uniforms(material: tl.Material, environment: tl.Environment | None, view: np.ndarray) -> dict[str, Any]:
    """The inputs of metallic-rough materials, maps, and the environment: a sky over a ground."""
    is_metallic = material.metallic is not None or material.roughness is not None
    around = environment or DEFAULT_ENVIRONMENT
    sky, ground = around.colors
    turned = np.eye(4)
    turned[:3, :3] = around.axes @ (view[:3, :3] if around.space == "eye" else np.eye(3))
    return {
        "is_metallic": is_metallic,
        "metallic": 1.0 if material.metallic is None else material.metallic,
        "roughness": 1.0 if material.roughness is None else material.roughness,
        "occlusion_strength": material.occlusion_strength,
        "normal_scale": material.normal_scale,
        "emission": material.emission,
        "sky": sky,
        "ground": ground,
        "diffuse_of_around": 0.0 if environment is None else 1.0,
        "around_from_world": turned.T,
        **{f"has_{name}": own is not None for name, own in maps_of(material).items()},
    }


def kind_of(options: dict[str, Any]) -> int:
    """The light: the headlight, lights, or a matcap."""
    if options.get("shading") == "matcap":
        return 2
    return 0 if options.get("lights") is None and options.get("environment") is None else 1


def light_uniforms(lights: Sequence[tl.Light], world_from_eye: np.ndarray) -> dict[str, Any]:
    """Lights in the world: rows of `at`, and 1 for a point; linear colours, and the fall-off."""
    at, color = np.zeros((2, MAX_LIGHTS, 4))
    for row, light in enumerate(lights):
        at[row] = (*light.at, light.kind == "point")
        if light.space == "eye":
            at[row] = world_from_eye @ at[row]
        color[row] = (*light.intensity * decode(light.color), light.falloff)
    return {"n_lights": len(lights), "light_at": at, "light_color": color}
