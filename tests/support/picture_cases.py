"""Random pictures for tests: meshes with materials of every kind, cameras with and without lens, options of a view."""

from typing import get_args

import numpy as np

import topleft as tl
from topleft.typing import SamplesOption

SIZE = (61, 47)
SAMPLINGS = get_args(SamplesOption)
SHAPES = ("torus-knot", "cube", "sphere", "torus")
SHADINGS = ("smooth", "smooth", "smooth", "flat", "unlit", "matcap", "normals", "ids", "depth")
MODES = ("opaque", "opaque", "mask", "blend")


def random_texture(rng, **options):
    """A small texture; a third of its opacity lies below what is cut out."""
    return tl.Texture(rng.integers(0, 256, (8, 8, 4)).astype(np.uint8), **options)


def random_material(rng):
    """Any of a texture, a highlight, a metallic-rough surface, holes, glass, backs that are culled."""
    options = {"color": tuple(rng.integers(30, 256, 3).tolist()), "alpha_mode": str(rng.choice(MODES))}
    if rng.uniform() < 0.5:
        options["texture"] = random_texture(rng, filter=str(rng.choice(["trilinear", "nearest"])))
    if rng.uniform() < 0.4:
        options |= {"specular": float(rng.uniform(0.5, 1)), "shininess": 8.0}
    elif rng.uniform() < 0.5:
        options |= {"metallic": float(rng.uniform()), "roughness": float(rng.uniform(0.1, 1))}
    if rng.uniform() < 0.3:
        options |= {"normal_texture": random_texture(rng, encoding="linear"), "emission": (0.2, 0.9, 1.4)}
    if rng.uniform() < 0.3:
        options["double_sided"] = False
    return tl.Material(**options, opacity=float(rng.uniform(0.3, 1)))


def random_mesh(rng):
    """A shape with some materials, uv, colours, in float32 or float64."""
    vertices, triangles = tl.scenes.shape(str(rng.choice(SHAPES)))
    materials = [random_material(rng) for _ in range(rng.integers(0, 4))]
    options = {"uv": 3 * vertices[:, :2], "crease": float(rng.choice([30, 180]))}
    if rng.uniform() < 0.3:
        options["colors"] = rng.integers(0, 256, (len(vertices), rng.integers(3, 5))).astype(np.uint8)
    if materials:
        rows = rng.integers(0, len(materials), len(triangles))
        options |= {"materials": materials, "material_of_triangle": rows}
    dtype = rng.choice([np.float32, np.float64])
    return tl.Mesh(vertices.astype(dtype), triangles.astype(np.int32), **options)


def random_camera(rng, *, lens=0.25):
    """One that sees a mesh near the origin, whole or cut by the near plane."""
    eye = rng.normal(size=3)
    eye *= rng.uniform(1.2, 4) / np.linalg.norm(eye)
    ortho_height = 3.0 if rng.uniform() < 0.25 else None
    camera = tl.Camera.look_at(eye, up=(0.1, 1, 0), near=float(rng.choice([0.1, 1.2])), ortho_height=ortho_height)
    if ortho_height is None and rng.uniform() < lens:
        return tl.Camera(camera.view, camera.projection, camera.aspect, tl.OpenCVLens(-0.15, 0.02, 0.001, 0.0005))
    return camera


def random_look(rng):
    """Options of `render` that say how a picture is lit."""
    look = {"shading": str(rng.choice(SHADINGS)), "background": tuple(rng.integers(0, 256, 4).tolist())}
    if rng.uniform() < 0.5:
        bright = tl.Light(rng.normal(size=3), "point", intensity=3.0, space=str(rng.choice(["world", "eye"])))
        look["lights"] = [bright, tl.Light(rng.normal(size=3), intensity=float(rng.uniform(0.5, 2)))]
    if rng.uniform() < 0.2:
        look["fog"] = tl.Fog(1.0, 5.0)
    if rng.uniform() < 0.2:
        look["environment"] = tl.Environment((90, 120, 200))
    if look["shading"] == "matcap":
        look["matcap"] = random_texture(rng)
    if rng.uniform() < 0.15:
        look["material"] = random_material(rng)
    return look


def random_view(rng):
    """Options of `render` that say which triangle is seen where."""
    return {
        "sampling": str(rng.choice(SAMPLINGS, p=[0.1, 0.2, 0.4, 0.2, 0.1])),
        "cull": str(rng.choice(["none", "none", "back", "front"])),
        "threads": int(rng.integers(1, 4)),
        "subpixel_bits": int(rng.choice([8, 8, 4, 0])),
        "edges": bool(rng.uniform() < 0.1),
    }
