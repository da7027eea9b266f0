"""Materials, textures, lights and the sky of a MuJoCo scene, as topleft has them.

Input: an `MjModel`, the geoms and lights of an `MjvScene`. Output: `Material`, `Light`. MuJoCo adds light up in the
numbers of the picture: those are light here, and the renderer turns them back.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import topleft as tl
from topleft.compat._arrays import srgb_bytes
from topleft.compat.mujoco import shapes

TEXTURE_2D, TEXTURE_CUBE, TEXTURE_SKYBOX = range(3)
"""Of mjtTexture."""

LIGHT_SPOT, LIGHT_DIRECTIONAL = range(2)
"""Of mjtLightType; others are not drawn by the renderer of MuJoCo either."""

SRGB = 2
"""Of mjtColorSpace: texels that are decoded before light meets them."""

TEXTURE_ROLE_RGB = 1
"""Of mjtTextureRole."""

AMBIENT = 0.3
"""Light from all sides of a scene without lights."""

LIKE_A_POWER = 2.57
"""A square that falls from 1 on the axis to 0 at cosine 1 - 2.57 / n stands for the cosine to the power n of a spot:
within 0.06 of it for n = 10, the default."""

MOST_LOOKS = 4096


class Looks:
    """The materials of a model, made when a scene first shows them."""

    def __init__(self, model: Any) -> None:
        self.model = model
        self.made: dict[tuple[Any, ...], tl.Material] = {}
        self.textures: dict[int, tl.Texture] = {}
        self.plain = tl.Material(double_sided=False), tl.Material()
        found = [k for k in range(model.ntex) if model.tex_type[k] == TEXTURE_SKYBOX]
        self.sky = skybox(self, found[0]) if found else None

    def of(self, geom: Any, opacity: float, gloss: float, *, is_double: bool) -> tl.Material:
        """The material of a geom, with or without a back that shows; opacity and highlights are times a number."""
        rgba = (*geom.rgba[:3].tolist(), float(geom.rgba[3]) * opacity)
        key = (rgba, geom.emission, geom.specular * gloss, geom.shininess, self.texture_of(geom), is_double)
        if key not in self.made:
            if len(self.made) >= MOST_LOOKS:
                self.made.clear()
            self.made[key] = self.make(*key)
        return self.made[key]

    def make(
        self, rgba: Any, emission: float, specular: float, shininess: float, texture: int, is_double: bool
    ) -> tl.Material:
        """The material of these numbers; emission is that of the colour.

        Highlights are white, and a texture darkens them by its mean: MuJoCo's own multiplies them by each texel.
        """
        laid = None if texture < 0 else self.texture(texture)
        specular = specular if laid is None else specular * float(laid.image[..., :3].mean()) / 255
        color = np.clip(rgba[:3], 0, 1)
        glow = tuple((max(emission, 0.0) * color).tolist())
        return tl.Material(
            color=srgb_bytes(color),
            texture=laid,
            specular=float(np.clip(specular, 0, 1)),
            shininess=max(128.0 * shininess, 1.0),
            opacity=float(np.clip(rgba[3], 0, 1)),
            alpha_mode="blend" if rgba[3] < 1 else "opaque",
            emission=glow,
            double_sided=is_double,
        )

    def texture_of(self, geom: Any) -> int:
        """The texture of a geom, -1 where it has none."""
        if geom.texid >= 0 or geom.matid < 0:
            return int(geom.texid)
        return int(self.model.mat_texid[geom.matid, TEXTURE_ROLE_RGB])

    def cube_of(self, geom: Any) -> int | None:
        """The texture of a geom that is looked up by direction from its middle."""
        texture = self.texture_of(geom)
        return texture if texture >= 0 and self.model.tex_type[texture] != TEXTURE_2D else None

    def laying_of(self, geom: Any) -> tuple[float, float, float] | None:
        """How often a flat texture repeats along u and v of a geom, and how far it is shifted; None of others."""
        texture, repeat, is_uniform = self.texture_of(geom), geom.texrepeat.tolist(), geom.texuniform
        if texture < 0 or self.model.tex_type[texture] != TEXTURE_2D:
            return None
        sizes = geom.size.tolist()
        if geom.texid < 0:
            repeat, is_uniform = self.model.mat_texrepeat[geom.matid].tolist(), self.model.mat_texuniform[geom.matid]
        across, down = [
            (times if times > 0 else 1.0) * (size if is_uniform and size > 0 else 1.0)
            for times, size in zip(repeat, sizes[:2], strict=True)
        ]
        is_endless = geom.type == shapes.PLANE and min(sizes[:2]) <= 0
        return across, down, -0.5 if is_endless else 0.0

    def texture(self, k: int) -> tl.Texture:
        """A texture of the model; textures of cubes end at the rims of their squares."""
        if k not in self.textures:
            model, encoding = self.model, "srgb" if self.model.tex_colorspace[k] == SRGB else "linear"
            n = int(model.tex_nchannel[k])
            shape = int(model.tex_height[k]), int(model.tex_width[k]), n
            first = int(model.tex_adr[k])
            image = np.asarray(model.tex_data[first : first + shape[0] * shape[1] * n]).reshape(shape)
            image = image[..., :3] if n >= 3 else np.repeat(image[..., :1], 3, axis=2)
            is_flat = model.tex_type[k] == TEXTURE_2D
            look: dict[str, Any] = {} if is_flat else {"filter": "bilinear", "wrap": "clamp"}
            self.textures[k] = tl.Texture(image, encoding=encoding, **look)  # type: ignore[arg-type]
        return self.textures[k]

    def laid_on_cube(self, mesh: tl.Mesh, geom: Any, k: int) -> tl.Mesh:
        """The mesh with coordinates in the squares of a cube texture; directions are taken from the unit shape."""
        scale = np.ones(3)
        if geom.type in shapes.TAKES_SIZE and not self.model.mat_texuniform[geom.matid]:
            scale = 1 / np.maximum(geom.size.astype(np.float64), 1e-9)
        return shapes.on_cube(mesh, scale, *self.squares_of(k))

    def squares_of(self, k: int) -> tuple[int, int]:
        """How many squares a cube texture has, 6 or 1 for all sides, and their texels a side."""
        width, height = int(self.model.tex_width[k]), int(self.model.tex_height[k])
        return (1 if width == height else 6), width


def skybox(looks: Looks, k: int) -> tl.Mesh:
    """The cube of a sky seen from its middle, in the world: unlit, its y axis up there is z here."""
    box = shapes.primitive(shapes.BOX, (1.0, 1.0, 1.0), (4, 4))
    cube = shapes.on_cube(box, (1, 1, 1), *looks.squares_of(k))
    points = cube.vertices[:, [0, 2, 1]] * [1, -1, 1]  # x of the texture is x, z is its y, and -y its z
    return tl.Mesh(points, cube.triangles, uv=cube.uv, materials=[tl.Material(texture=looks.texture(k), unlit=True)])


def lights_of(scene: Any, center: Any) -> tuple[list[tl.Light], float, float]:
    """The lights of a scene, the light from all sides, and how strong highlights are beside what matt surfaces send.

    Light that falls off with the distance itself falls off with its square as much at `center`, (3,).
    """
    lights, ambient, n = [], 0.0, 0
    shine, matt = 0.0, 0.0
    for own in scene.lights[: scene.nlight]:
        if own.type not in (LIGHT_SPOT, LIGHT_DIRECTIONAL):
            continue
        n += 1
        ambient += float(own.ambient.mean())
        shine, matt = shine + float(own.specular.mean()), matt + float(own.diffuse.mean())
        strongest = float(own.diffuse.max())
        if strongest <= 0:
            continue
        color = srgb_bytes(own.diffuse / strongest)
        if own.type == LIGHT_DIRECTIONAL:
            lights.append(tl.Light(-own.dir.astype(np.float64), color=color, intensity=strongest))
            continue
        place = own.pos.astype(np.float64)
        constant, linear, square = own.attenuation.tolist()
        away = math.sqrt(((place - center) ** 2).sum())
        constant, square = max(constant + linear * away / 2, 1e-6), square + linear / (2 * max(away, 1e-6))
        cone: dict[str, Any] = {}
        if own.cutoff <= 90:
            inner, outer = max(own.cutoff - 0.5, 0.0), max(float(own.cutoff), 0.01)
            if own.exponent > 0:
                inner, outer = 0.0, min(outer, math.degrees(math.acos(max(1 - LIKE_A_POWER / own.exponent, 0.0))))
            cone = {"direction": own.dir.astype(np.float64), "inner_deg": inner, "outer_deg": outer}
        kind: Any = "spot" if cone else "point"
        lights.append(tl.Light(place, kind, color, strongest / constant, falloff=max(square, 0.0) / constant, **cone))
    return lights, ambient if n else AMBIENT, shine / matt if matt > 0 else 0.0
