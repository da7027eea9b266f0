"""The calls of pyrender, drawn by topleft: ``from topleft.compat import pyrender``.

`OffscreenRenderer(w, h).render(scene, flags)` returns colours and depth as pyrender does, without OpenGL, a display or
a GPU, and where pyrender is not installed. Depth, ids, culling, blending, textures, metallic-rough materials, points
and lines are drawn; shadows, wireframes, normals as lines and text are not, and the viewer is missing.
"""

from topleft.compat.pyrender.graph import Node, Scene
from topleft.compat.pyrender.meshes import Mesh, Primitive
from topleft.compat.pyrender.renderer import OffscreenRenderer
from topleft.compat.pyrender.values import (
    GLTF,
    Camera,
    DirectionalLight,
    IntrinsicsCamera,
    Light,
    Material,
    MetallicRoughnessMaterial,
    OrthographicCamera,
    PerspectiveCamera,
    PointLight,
    RenderFlags,
    Sampler,
    SpotLight,
    Texture,
)

__all__ = [
    "GLTF",
    "Camera",
    "DirectionalLight",
    "IntrinsicsCamera",
    "Light",
    "Material",
    "Mesh",
    "MetallicRoughnessMaterial",
    "Node",
    "OffscreenRenderer",
    "OrthographicCamera",
    "PerspectiveCamera",
    "PointLight",
    "Primitive",
    "RenderFlags",
    "Sampler",
    "Scene",
    "SpotLight",
    "Texture",
]
