"""Materials of surfaces, as values."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from topleft._core.base.arrays import as_number, as_vector
from topleft._core.base.cached import cached_property
from topleft._core.base.color import Color, ColorLike, as_color
from topleft._core.base.options import parse
from topleft._meshes.model.light import as_not_negative
from topleft._meshes.model.texture import Texture
from topleft.typing import AlphaModeOption

TEXTURES = ("texture", "emission_texture", "metallic_roughness_texture", "occlusion_texture", "normal_texture")


@dataclass(frozen=True)
class Material:
    """How a surface answers to light.

    Parameters
    ----------
    color : (3,) of 0 to 255, optional
        sRGB; times the texture and the colours of the vertices. Unless given: white where there are those, else a light
        warm grey.
    texture : Texture, optional
        Used where the mesh has `uv`.
    specular : float
        Strength of the highlights, 0 to 1: the white that a mirror turned to the light adds.
    shininess : float
        Blinn's exponent: the larger, the smaller the highlight. 0: none.
    back_color : (3,) of 0 to 255, optional
        sRGB of the back of the triangles, without texture; as the front unless given.
    unlit : bool
        The colour shows as it is, whatever the light.
    alpha_cutoff : float, optional
        0 to 1: texels of less opacity are holes, through which one sees. Unless given everything is
        opaque.
    opacity : float
        0 to 1, times the opacity of the texture and of the colours of the vertices; looked at by "mask" and "blend".
    alpha_mode : {"opaque", "mask", "blend"}, optional
        "opaque": opacity is not looked at. "mask": pixels below `alpha_cutoff` (0.5 unless given) are cut out.
        "blend": surfaces behind show through, in pictures of `render`, up to 16 layers of a pixel. Unless given: "mask"
        with an `alpha_cutoff`, else "opaque".
    double_sided : bool
        Whether the back of the triangles shows, too; if not it is culled, unless `cull` says which side is.
    emission : (3,) of float
        Linear light that the surface sends out by itself, 0 up; 1 is white.
    emission_texture : Texture, optional
        Times `emission`.
    metallic, roughness : float, optional
        0 to 1. Where one of them is given the surface is a metallic-rough one of glTF (the other is 1), lit by GGX
        microfacets, and `specular` and `shininess` are not looked at.
    metallic_roughness_texture : Texture, optional
        Linear: green times `roughness`, blue times `metallic`.
    occlusion_texture : Texture, optional
        Linear: red is the share of the surroundings' light that arrives.
    occlusion_strength : float
        0 to 1: how much of that is taken away.
    normal_texture : Texture, optional
        Linear: the normal in the tangent space of `uv`, -1..1 as 0..255: red along u, green along v, which runs up.
    normal_scale : float
        Times x and y of it.

    Raises
    ------
    ValueError
        If a number is outside its range.

    Examples
    --------
    >>> import topleft as tl
    >>> vertices, triangles = tl.scenes.icosphere(2)
    >>> ball = tl.Mesh(vertices, triangles, materials=[tl.Material(color=(200, 40, 30), specular=0.3)])
    >>> picture = tl.render(ball, tl.Camera.framing(ball), (32, 32))
    >>> bool(picture[16, 16, 0] > picture[16, 16, 2])
    True
    """

    color: Color | None = None
    texture: Texture | None = None
    specular: float = 0.0
    shininess: float = 32.0
    back_color: Color | None = None
    unlit: bool = False
    alpha_cutoff: float | None = None
    opacity: float = 1.0
    alpha_mode: str | None = None
    double_sided: bool = True
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emission_texture: Texture | None = None
    metallic: float | None = None
    roughness: float | None = None
    metallic_roughness_texture: Texture | None = None
    occlusion_texture: Texture | None = None
    occlusion_strength: float = 1.0
    normal_texture: Texture | None = None
    normal_scale: float = 1.0

    if TYPE_CHECKING:  # anything that NumPy reads may be given; the types above are kept

        def __init__(
            self,
            color: ColorLike | None = None,
            texture: Texture | None = None,
            specular: float = 0.0,
            shininess: float = 32.0,
            back_color: ColorLike | None = None,
            unlit: bool = False,
            alpha_cutoff: float | None = None,
            opacity: float = 1.0,
            alpha_mode: AlphaModeOption | None = None,
            double_sided: bool = True,
            emission: tuple[float, float, float] = (0.0, 0.0, 0.0),
            emission_texture: Texture | None = None,
            metallic: float | None = None,
            roughness: float | None = None,
            metallic_roughness_texture: Texture | None = None,
            occlusion_texture: Texture | None = None,
            occlusion_strength: float = 1.0,
            normal_texture: Texture | None = None,
            normal_scale: float = 1.0,
        ) -> None: ...

    def __repr__(self) -> str:
        """One line: the differences from a plain material."""
        own = ((one.name, getattr(self, one.name), one.default) for one in fields(self))
        told = (
            (name, str(value) if isinstance(value, str) else value)
            for name, value, plain in own
            if value not in (plain, "opaque")
        )
        words = (f"{name}={value!r}" for name, value in told)
        return f"Material({', '.join(words)})"

    def __post_init__(self) -> None:
        keep = object.__setattr__  # the dataclass is frozen, and its values are coerced
        for name in ("color", "back_color"):
            if getattr(self, name) is not None:
                keep(self, name, as_color(name, getattr(self, name), 3))
        for name in ("specular", "shininess", "opacity", "occlusion_strength", "normal_scale"):
            keep(self, name, as_not_negative(name, getattr(self, name)))
        for name in ("metallic", "roughness"):
            if getattr(self, name) is not None:
                keep(self, name, as_not_negative(name, getattr(self, name)))
        for name in ("specular", "alpha_cutoff", "opacity", "metallic", "roughness", "occlusion_strength"):
            value = getattr(self, name)
            if value is not None and not 0 <= as_number(name, value) <= 1:
                raise ValueError(f"{name} must lie in 0 to 1, got {value!r}")
        emission = as_vector("emission", self.emission).tolist()
        keep(self, "emission", tuple(as_not_negative("emission", value) for value in emission))
        if self.alpha_mode is None:
            keep(self, "alpha_mode", "opaque" if self.alpha_cutoff is None else "mask")
        keep(self, "alpha_mode", parse(AlphaModeOption, "alpha_mode", self.alpha_mode))
        if self.alpha_mode == "mask" and self.alpha_cutoff is None:
            keep(self, "alpha_cutoff", 0.5)
        for name in TEXTURES:
            value = getattr(self, name)
            if value is not None and not isinstance(value, Texture):
                raise TypeError(f"{name} must be a Texture, got {type(value).__name__}")

    @cached_property
    def is_metallic_rough(self) -> bool:
        """Whether it is lit as a metallic-rough surface of glTF."""
        return self.metallic is not None or self.roughness is not None
