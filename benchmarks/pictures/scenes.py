"""Scenes that are drawn by topleft and by OpenGL: shapes of `topleft.scenes` with colours, textures and lights.

Everything is made by formulas: the same arrays on every machine, no files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import topleft as tl

SIZE = (320, 256)


@dataclass(frozen=True, eq=False)
class PictureScene:
    """A scene to draw.

    Parameters
    ----------
    what : str
        For the reader of the table.
    mesh : Mesh
        In the world, with at most one material, for OpenGL.
    camera : Camera
    options : dict
        Further options of `tl.render`.
    placed : Scene, optional
        For topleft instead: the same triangles as instances.
    own_level : bool
        Whether the shader computes the level of detail, instead of OpenGL.
    """

    what: str
    mesh: tl.Mesh
    camera: tl.Camera
    options: dict[str, Any] = field(default_factory=dict)
    placed: tl.Scene | None = None
    own_level: bool = False

    @property
    def material(self) -> tl.Material:
        """The material of all triangles."""
        return self.mesh.materials[0] if self.mesh.materials else tl.Material()


def draw(scene: PictureScene) -> tuple[np.ndarray, np.ndarray]:
    """Return the picture (H, W, 3) uint8 on white and the ids (H, W) int32 of topleft."""
    subject = scene.placed or scene.mesh
    picture = tl.render(subject, scene.camera, SIZE, background=(255, 255, 255), **scene.options)
    return picture[..., :3], tl.rasterize_mesh(subject, scene.camera, SIZE).id


def tiles(side: int = 64) -> np.ndarray:
    """A texture (side, side, 3) uint8: a checkerboard of two ramps with a dark joint, unlike its mirror images."""
    row, column = np.mgrid[:side, :side] / side
    is_odd = (np.floor(4 * row) + np.floor(4 * column)) % 2 == 1
    joint = (np.minimum(row * 4 % 1, column * 4 % 1) < 1 / 16)[..., None]
    warm = [240 - 90 * row, 150 - 60 * column, 60 + 20 * row]
    cool = [70 + 80 * column, 150 + 30 * row, 230 - 70 * column]
    color = np.where(is_odd[..., None], np.stack(warm, -1), np.stack(cool, -1))
    return np.rint(np.where(joint, 40, color)).astype(np.uint8)


def lit_sphere(side: int = 128) -> np.ndarray:
    """A matcap (side, side, 3) uint8: a sphere with a warm light from the left, a cool one below, and a rim."""
    y, x = 1 - 2 * (np.mgrid[:side, :side] + 0.5) / side
    x = -x
    z = np.sqrt(np.maximum(0, 1 - x * x - y * y))
    warm, cool = np.maximum(0, -0.5 * x + 0.6 * y + 0.62 * z), np.maximum(0, 0.6 * x - 0.7 * y + 0.3 * z)
    rim = (1 - z) ** 3
    light = [0.1 + 0.8 * warm + 0.1 * cool + 0.3 * rim, 0.08 + 0.55 * warm + 0.25 * cool + 0.3 * rim]
    light.append(0.1 + 0.3 * warm + 0.7 * cool + 0.35 * rim)
    return np.rint(255 * np.clip(np.stack(light, -1), 0, 1)).astype(np.uint8)


def uv_of_cube(vertices: np.ndarray, turns: float) -> np.ndarray:
    """The texture `turns` times along each side, by the face: four vertices each."""
    faces = vertices.reshape(-1, 4, 3)
    across, up = faces[:, 1] - faces[:, 0], faces[:, 3] - faces[:, 0]
    at = faces - faces[:, :1]
    return turns / 4 * np.stack([(at * side[:, None]).sum(-1) for side in (across, up)], -1).reshape(-1, 2)


def cube_camera() -> tl.Camera:
    """From close by, so that perspective is strong."""
    return tl.Camera.look_at((2.1, 1.7, 2.4), (0, -0.15, 0), fov_y_deg=58)


def aspect() -> float:
    """Of all pictures."""
    return SIZE[0] / SIZE[1]


def headlight() -> PictureScene:
    """Smooth normals under the headlight."""
    mesh = tl.Mesh(*tl.scenes.shape("torus-knot"))
    return PictureScene("torus knot, smooth, headlight", mesh, tl.Camera.framing(mesh, aspect=aspect()))


def flat() -> PictureScene:
    """Normals of the faces, no perspective."""
    mesh = tl.Mesh(*tl.scenes.shape("icosphere", subdivisions=2))
    camera = tl.Camera.framing(mesh, aspect=aspect(), ortho=True)
    return PictureScene("icosphere, flat, orthographic", mesh, camera, {"shading": "flat", "color": (120, 190, 160)})


def vertex_colors() -> PictureScene:
    """Colours of the vertices, interpolated."""
    vertices, triangles = tl.scenes.shape("blob", n_triangles=3000)
    colors = np.rint(127.5 + 127.5 * np.sin(4 * vertices + [0, 2, 4])).astype(np.uint8)
    mesh = tl.Mesh(vertices, triangles, colors=colors)
    return PictureScene("blob, colours of the vertices", mesh, tl.Camera.framing(mesh, aspect=aspect()))


def lights() -> PictureScene:
    """A directional light, two points and highlights, and the depth cue."""
    material = tl.Material((200, 170, 150), specular=0.6, shininess=40)
    mesh = tl.Mesh(*tl.scenes.shape("torus"), materials=[material])
    camera = tl.Camera.framing(mesh, aspect=aspect(), elevation_deg=38)
    three = [
        tl.Light((1, 2, 1), intensity=0.5),
        tl.Light((-0.4, 0.9, 0.2), "point", (90, 150, 255), 1.5, falloff=0.8),
        tl.Light((1.5, 0.6, -0.5), "point", (255, 120, 60), 0.9, space="eye"),
    ]
    fog = tl.Fog(2.6, 7, (235, 240, 250))
    options = {"lights": three, "ambient": 0.05, "fog": fog}
    return PictureScene("torus, three lights, Blinn-Phong, fog", mesh, camera, options)


def back_faces() -> PictureScene:
    """Half a ring: the back of its triangles has a colour of its own, and normals turned to the viewer."""
    vertices, triangles = tl.scenes.shape("torus")
    is_behind = vertices[triangles][..., 2].max(axis=1) < 1e-9
    material = tl.Material((90, 130, 200), specular=0.4, shininess=60, back_color=(230, 140, 70))
    mesh = tl.Mesh(vertices, triangles[is_behind], materials=[material])
    camera = tl.Camera.look_at((0.9, 1.0, 3.4), (0, 0, -0.4), fov_y_deg=36)
    sun = [tl.Light((1, 2, 1.5), intensity=0.9)]
    return PictureScene("half a torus, both sides, Blinn-Phong", mesh, camera, {"lights": sun, "ambient": 0.1})


def near_plane() -> PictureScene:
    """Cut by the near plane, through which the inside shows."""
    material = tl.Material((170, 190, 110), specular=0.3, shininess=30, back_color=(190, 90, 90))
    mesh = tl.Mesh(*tl.scenes.shape("torus-knot", segments=96, sections=16), materials=[material])
    camera = tl.Camera.look_at((0.8, 0.9, 2.6), fov_y_deg=66, near=2.45, far=10)
    sun = [tl.Light((1, 2, 1.5), intensity=0.8), tl.Light((-2, 0, 2), "point", intensity=0.6, falloff=0.1)]
    return PictureScene("torus knot, cut by the near plane", mesh, camera, {"lights": sun, "ambient": 0.1})


def instances() -> PictureScene:
    """A scene: one mesh turned and made smaller, mirrored, and stretched, under lights that stand in the world."""
    material = tl.Material((210, 180, 120), specular=0.5, shininess=30, back_color=(60, 200, 90))
    mesh = tl.Mesh(*tl.scenes.shape("torus-knot", segments=256, sections=24), materials=[material])
    turned = place((0.6, 0.6, 0.6), (-1.2, 0.55, 0), turn_deg=70)
    mirrored = place((-0.6, 0.6, 0.6), (1.1, 0.5, 0), turn_deg=20)
    stretched = place((1.0, 0.35, 0.5), (0, -0.75, 0.3), turn_deg=-25)
    placed = tl.Scene([(mesh, matrix) for matrix in (turned, mirrored, stretched)])
    camera = tl.Camera.look_at((0.4, 0.9, 5.2), (0, -0.05, 0), fov_y_deg=38)
    lights = [tl.Light((1, 2, 1.5), intensity=0.5), tl.Light((0, 0.9, 1.2), "point", (255, 190, 120), 2.0, falloff=0.7)]
    options = {"lights": lights, "ambient": 0.08}
    return PictureScene("three torus knots, instances", joined(placed), camera, options, placed=placed)


def place(scale: tuple[float, float, float], at: tuple[float, float, float], *, turn_deg: float) -> np.ndarray:
    """World from object (4, 4): scaled, turned about y, moved."""
    turn, matrix = np.radians(turn_deg), np.eye(4)
    matrix[:3, :3] = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]) * scale
    matrix[:3, 3] = at
    return matrix


def joined(scene: tl.Scene) -> tl.Mesh:
    """The instances of a scene as one mesh in the world, its triangles in that order, of the first one's materials."""
    vertices, normals, triangles = [], [], []
    for instance in scene:
        linear, mesh = instance.transform[:3, :3], instance.mesh
        n_before = sum(map(len, vertices))
        order = slice(None, None, -1) if np.linalg.det(linear) < 0 else slice(None)  # the outside stays outside
        triangles.append(mesh.triangles[:, order] + n_before)
        vertices.append(mesh.vertices @ linear.T + instance.transform[:3, 3])
        own = mesh.vertex_normals() @ np.linalg.inv(linear)
        normals.append(own / np.linalg.norm(own, axis=1, keepdims=True))
    arrays = map(np.concatenate, (vertices, triangles, normals))
    return tl.Mesh(*arrays, materials=scene[0].mesh.materials)


def matcap() -> PictureScene:
    """The colour of a lit sphere where its normal is the same."""
    mesh = tl.Mesh(*tl.scenes.shape("torus-knot", p=3, q=4, tube_radius=0.2))
    options = {"shading": "matcap", "matcap": tl.Texture(lit_sphere(), "bilinear", "clamp")}
    return PictureScene("torus knot, matcap", mesh, tl.Camera.framing(mesh, aspect=aspect()), options)


def textured_cube(what: str, texture: tl.Texture, turns: float) -> PictureScene:
    """The texture on all sides of a cube."""
    vertices, triangles = tl.scenes.shape("cube")
    mesh = tl.Mesh(vertices, triangles, uv=uv_of_cube(vertices, turns), materials=[tl.Material(texture=texture)])
    return PictureScene(what, mesh, cube_camera())


def nearest() -> PictureScene:
    """Texels as squares, mirrored."""
    return textured_cube("cube, nearest, mirror", tl.Texture(tiles(16), "nearest", "mirror"), 1.75)


def bilinear() -> PictureScene:
    """Between the texels, repeated and clamped."""
    texture = tl.Texture(tiles(16), "bilinear", ("repeat", "clamp"))
    return textured_cube("cube, bilinear, repeat and clamp", texture, 1.3)


def trilinear(what: str = "torus, trilinear, repeat", *, own_level: bool = False) -> PictureScene:
    """Many texels in a pixel, seen at an angle."""
    vertices, triangles = tl.scenes.shape("torus")
    material = tl.Material(texture=tl.Texture(tiles(64), "trilinear"))
    mesh = tl.Mesh(vertices, triangles, uv=2 * vertices[:, [0, 2]], materials=[material])
    camera = tl.Camera.framing(mesh, aspect=aspect(), elevation_deg=30)
    return PictureScene(what, mesh, camera, own_level=own_level)


def level() -> PictureScene:
    """The same with the level of detail by the formula of topleft, of differences across two by two pixels."""
    return trilinear("the same, level of detail in the shader", own_level=True)


def waves(side: int = 64) -> np.ndarray:
    """A normal map (side, side, 3) uint8: waves along both axes, unlike its mirror images."""
    row, column = 2 * np.pi * np.mgrid[:side, :side] / side
    x, y = 0.5 * np.cos(2 * column) + 0.2 * np.sin(3 * column), 0.4 * np.sin(3 * row + 1)
    normal = np.stack([x, y, np.ones_like(x)], -1)
    return np.rint(127.5 + 127.5 * normal / np.linalg.norm(normal, axis=-1, keepdims=True)).astype(np.uint8)


def shares(side: int = 32) -> np.ndarray:
    """Occlusion, roughness and metallic as red, green and blue (side, side, 3) uint8."""
    row, column = np.mgrid[:side, :side] / side
    red, green = 0.6 + 0.4 * np.cos(2 * np.pi * row), 0.55 + 0.4 * np.sin(2 * np.pi * column)
    return np.rint(255 * np.stack([red, green, (column + row) % 1 > 0.5], -1)).astype(np.uint8)


def data(image: np.ndarray) -> tl.Texture:
    """Numbers, between which the texture is linear."""
    return tl.Texture(image, "bilinear", encoding="linear")


SKY = tl.Environment((170, 205, 255), ground=(95, 75, 50), up=(0.2, 1, 0.1))
LAMPS = [tl.Light((1, 2, 1.5), intensity=0.8), tl.Light((-1.5, 0.6, 1.2), "point", (255, 150, 90), 1.2, falloff=0.3)]


def metal() -> PictureScene:
    """A metallic-rough surface without textures, as it looks when nothing is said of lights."""
    mesh = tl.Mesh(*tl.scenes.shape("torus-knot"), materials=[tl.Material((255, 200, 110), metallic=1, roughness=0.35)])
    return PictureScene("torus knot, metal, headlight", mesh, tl.Camera.framing(mesh, aspect=aspect()))


def metallic() -> PictureScene:
    """Metal and non-metal side by side, smooth and rough, with occlusion and emission, under lights and a sky."""
    vertices, triangles = tl.scenes.shape("torus")
    material = tl.Material(
        texture=tl.Texture(tiles(16), "bilinear"),
        metallic=0.9,
        roughness=0.8,
        metallic_roughness_texture=data(shares()),
        occlusion_texture=data(shares()),
        occlusion_strength=0.8,
        emission=(0.05, 0.0, 0.1),
        emission_texture=tl.Texture(tiles(16)[::-1], "bilinear"),
    )
    mesh = tl.Mesh(vertices, triangles, uv=vertices[:, [0, 2]], materials=[material])
    camera = tl.Camera.framing(mesh, aspect=aspect(), elevation_deg=30)
    options = {"lights": LAMPS, "environment": SKY}
    return PictureScene("torus, metallic-roughness textures, lights, sky", mesh, camera, options)


def normal_map() -> PictureScene:
    """Waves by a normal map, mirrored on one half, under Blinn-Phong lights."""
    vertices, triangles = tl.scenes.shape("torus")
    material = tl.Material((210, 190, 170), specular=0.4, shininess=25, normal_texture=data(waves()), normal_scale=0.8)
    mesh = tl.Mesh(vertices, triangles, uv=1.5 * vertices[:, [0, 2]], materials=[material])
    camera = tl.Camera.framing(mesh, aspect=aspect(), elevation_deg=30)
    return PictureScene("torus, normal map, Blinn-Phong", mesh, camera, {"lights": LAMPS, "ambient": 0.05})


def metallic_waves() -> PictureScene:
    """Both together, seen from outside and from inside."""
    vertices, triangles = tl.scenes.shape("torus")
    is_behind = vertices[triangles][..., 2].max(axis=1) < 1e-9
    material = tl.Material((240, 215, 170), metallic=0.7, roughness=0.4, normal_texture=data(waves()))
    mesh = tl.Mesh(vertices, triangles[is_behind], uv=1.5 * vertices[:, :2], materials=[material])
    camera = tl.Camera.look_at((0.9, 1.0, 3.4), (0, 0, -0.4), fov_y_deg=36)
    options = {"lights": LAMPS, "environment": SKY}
    return PictureScene("half a torus, both sides, metallic, normal map", mesh, camera, options)


SCENES: Mapping[str, Callable[[], PictureScene]] = {
    "headlight": headlight,
    "flat": flat,
    "vertex-colors": vertex_colors,
    "lights": lights,
    "back-faces": back_faces,
    "near-plane": near_plane,
    "instances": instances,
    "matcap": matcap,
    "nearest": nearest,
    "bilinear": bilinear,
    "trilinear": trilinear,
    "level": level,
    "metal": metal,
    "metallic": metallic,
    "normal-map": normal_map,
    "metallic-waves": metallic_waves,
}
