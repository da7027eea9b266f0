"""Scenes of trimesh, drawn by topleft: `save_image` without a window, silhouettes without rays.

Input: `trimesh.Scene`, told by its attributes. Output: PNG as bytes, masks, `Scene` and `Camera` of topleft. trimesh is
imported by `install` alone.
"""

from __future__ import annotations

import math
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

import topleft as tl
from topleft.compat._arrays import F64, SHOWN_AS_LIGHT, U8, dots_along, moved, over, srgb_bytes, view_of

__all__ = ["as_camera", "as_scene", "install", "installed", "save_image", "silhouette"]

GREY = (102, 102, 102)
"""A mesh without colours, as trimesh has it."""

CREASE_DEG = 20.0
"""Edges at which faces bend by more are sharp, as trimesh smooths."""

MOST_SMOOTH = 60000
"""Meshes of so many faces and more have their faces flat, as in trimesh's viewer."""

SHINE: dict[str, float] = {"specular": 0.508, "shininess": 51.2}
"""Highlights of everything in trimesh's viewer."""

AMBIENT = 0.2
"""Light from all sides in OpenGL, whose numbers are the numbers of the picture; each light adds its colour."""

DEFAULT_LIGHT = 60 / 255
"""Light of each of the two that trimesh gives a scene without lights."""

NOT_DRAWN = ("wireframe", "axis", "grid")
"""Flags of the viewer."""


def save_image(scene: Any, resolution: Any = None, **options: Any) -> bytes:
    """A PNG of a scene, as `scene.save_image` makes it, without a window.

    Parameters
    ----------
    scene : trimesh.Scene
        Its camera looks; where it has none trimesh makes one. Lights that the scene has are read: directional ones
        along -z of their node, points and spots where they stand, without falling off. A scene without lights has the
        two of trimesh's viewer, which move with the camera.
    resolution : (2,) int, optional
        Width and height, pixels: the camera has them from then on. Its own unless given.
    **options
        Of trimesh's `SceneViewer`: `background`, whatever is a colour there, white unless given; `smooth`; `flags`, of
        which "cull" is read; `line_settings`, with "line_width" and "point_size" in pixels; `offset_lines`. What is
        about the window is not looked at.

    Returns
    -------
    bytes
        PNG, red, green, blue and opacity.

    Warns
    -----
    UserWarning
        If flags ask for a wireframe, axes or a grid.
    """
    if resolution is not None:
        scene.camera.resolution = resolution
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "scene.png")
        tl.save_image(path, picture_of(scene, **options))
        return path.read_bytes()


def silhouette(scene: Any, resolution: Any = None) -> npt.NDArray[np.bool_]:
    """The pixels whose ray meets a mesh, of the rays of `scene.camera_rays()`.

    Parameters
    ----------
    scene : trimesh.Scene
    resolution : (2,) int, optional
        Width and height, pixels, as for `save_image`.

    Returns
    -------
    (H, W) bool
        Row 0 is the top. `mask.T.ravel()` is in the order of trimesh's rays.
    """
    if resolution is not None:
        scene.camera.resolution = resolution
    size = size_of(scene)
    if not any(len(getattr(geometry, "faces", ())) for _, geometry, _ in placed(scene)):
        return np.zeros(size[::-1], bool)
    return tl.rasterize_mesh(as_scene(scene), as_camera(scene), size).mask


def as_scene(scene: Any) -> tl.Scene:
    """The meshes of a scene with their own materials, colours and names of nodes; what stands twice is shared.

    Parameters
    ----------
    scene : trimesh.Scene

    Raises
    ------
    ValueError
        If it has no meshes.
    """
    known: dict[int, tl.Mesh] = {}
    found = []
    for node, geometry, pose in placed(scene):
        if len(getattr(geometry, "faces", ())):
            if id(geometry) not in known:
                known[id(geometry)] = tl.as_mesh(geometry)
            found.append(tl.Instance(known[id(geometry)], pose, name=str(node)))
    return tl.Scene(found)


def as_camera(scene: Any) -> tl.Camera:
    """The camera of a scene by its focal lengths across and up: a pixel's centre lies on its ray of `camera_rays`.

    Parameters
    ----------
    scene : trimesh.Scene
    """
    own = scene.camera
    near = float(own.z_near)
    x, y = (near * np.asarray(own.resolution, np.float64) / 2 / np.asarray(own.focal, np.float64)).tolist()
    view = view_of(scene.camera_transform)
    return tl.Camera.off_center(view, left=-x, right=x, bottom=-y, top=y, near=near, far=float(own.z_far))


def install() -> None:
    """Have `scene.save_image` of trimesh be that of this module, from now on."""
    import_module("trimesh").Scene.save_image = save_image


@contextmanager
def installed() -> Iterator[None]:
    """Have `scene.save_image` of trimesh be that of this module within a `with` statement."""
    scene_type = import_module("trimesh").Scene
    kept = scene_type.save_image
    install()
    try:
        yield
    finally:
        scene_type.save_image = kept


def size_of(scene: Any) -> tuple[int, int]:
    """Width and height of the picture of the scene's camera."""
    width, height = (int(n) for n in scene.camera.resolution)
    return width, height


def placed(scene: Any) -> Iterator[tuple[Any, Any, F64]]:
    """Each node with a geometry, the geometry, and world from geometry (4, 4); grids of voxels are boxes."""
    for node in scene.graph.nodes_geometry:
        pose, name = scene.graph[node]
        own = scene.geometry[name]
        yield node, own.as_boxes() if hasattr(own, "as_boxes") else own, np.asarray(pose, np.float64)


def picture_of(
    scene: Any,
    *,
    smooth: bool = True,
    flags: Mapping[str, Any] | None = None,
    background: Any = None,
    line_settings: Mapping[str, float] | None = None,
    offset_lines: bool = True,
    **_: Any,
) -> U8:
    """What trimesh's viewer shows of a scene, (H, W, 4); options as of `save_image`."""
    flags = flags or {}
    for word in NOT_DRAWN:
        if flags.get(word):
            warnings.warn(f"topleft.compat.trimesh draws no {word}", stacklevel=3)
    size = size_of(scene)
    pose, own = scene.camera_transform, scene.camera
    near, far = float(own.z_near), float(own.z_far)
    camera = tl.Camera.perspective(view_of(pose), near=near, far=far, fov_y_deg=float(own.fov[1]))
    scale = {"point_size": max(size) / 200, "line_width": max(size) / 400, **(line_settings or {})}
    lifted = np.asarray(pose)[:3, 2] * (float(scene.scale) / 1000 if offset_lines else 0)
    instances: list[tl.Instance] = []
    clouds: list[tl.Points] = []
    known: dict[int, tuple[tl.Mesh, tl.Material]] = {}
    for _node, geometry, place in placed(scene):
        if len(getattr(geometry, "faces", ())):
            if id(geometry) not in known:
                known[id(geometry)] = drawn(geometry, smooth)
            mesh, look = known[id(geometry)]
            instances.append(tl.Instance(mesh, place, material=look))
        elif hasattr(geometry, "entities"):
            clouds += lines_of(geometry, place, lifted, camera, size, scale["line_width"])
        elif len(getattr(geometry, "vertices", ())):
            clouds.append(points_of(geometry, place, scale["point_size"]))
    behind = as_rgba(background, (255, 255, 255, 255))
    if instances:
        lights, ambient = lights_of(scene)
        look_options: dict[str, Any] = {"lights": lights, "ambient": ambient, "background": "transparent"}
        side: Literal["back", "none"] = "back" if flags.get("cull", True) else "none"
        found = tl.render_layers(
            tl.Scene(instances), camera, size, layers=("color", "depth"), cull=side, sampling="msaa4", **look_options
        )
        picture, depth = over(found["color"], SHOWN_AS_LIGHT, behind), found["depth"]
    else:
        picture, depth = np.empty((*size[::-1], 4), np.uint8), np.full(size[::-1], np.inf, np.float32)
        picture[:] = behind
    for cloud in clouds:
        found = tl.render_layers(cloud, camera, size, layers=("color", "depth"))
        is_nearer = found["depth"] < depth
        depth = np.where(is_nearer, found["depth"], depth)
        picture[is_nearer] = found["color"][is_nearer]
    return picture


def drawn(geometry: Any, smooth: bool) -> tuple[tl.Mesh, tl.Material]:
    """A mesh and its look as trimesh's viewer has them: numbers of colours are light."""
    own = tl.as_mesh(geometry)
    look: dict[str, Any] = {"color": (255, 255, 255), **SHINE}
    if own.materials:
        given, source = own.materials[0], geometry.visual.material
        is_rough = hasattr(source, "baseColorFactor")  # of glTF, which says whether opacity counts
        laid = given.texture.image if given.texture is not None and own.uv is not None else None
        is_plain = laid is not None and (not is_rough or source.baseColorFactor is None)
        color = np.full(4, 255) if is_plain else as_rgba(source.main_color, (*GREY, 255))
        has_alpha = color[3] < 255 or (laid is not None and bool((laid[..., 3] < 255).any()))
        look |= {
            "color": srgb_bytes(color[:3] / 255),
            "texture": None if laid is None else tl.Texture(laid, encoding="linear"),
            "opacity": float(color[3] / 255),
            "alpha_mode": given.alpha_mode if is_rough else "blend" if has_alpha else "opaque",
            "alpha_cutoff": given.alpha_cutoff,
        }
        return own, tl.Material(**look)
    colors = np.array([(*GREY, 255)], np.uint8) if own.colors is None else own.colors
    if colors.shape[1] == 4 and bool((colors[:, 3] < 255).any()):
        look["alpha_mode"] = "blend"
    light = np.concatenate([srgb_bytes(colors[:, :3] / 255), colors[:, 3:]], axis=1)
    crease = CREASE_DEG if smooth and len(own.triangles) < MOST_SMOOTH else 0.0
    if own.colors is None:
        look["color"] = light[0, :3]
        return tl.Mesh(own.vertices, own.triangles, crease=crease), tl.Material(**look)
    vertices: Any = own.vertices
    triangles: Any = own.triangles
    if geometry.visual.kind == "face":  # faces share no corners: they are joined where colours are equal
        vertices, triangles, light = joined_again(geometry, light)
    return tl.Mesh(vertices, triangles, None, light, crease=crease, color_interpolation="linear"), tl.Material(**look)


def joined_again(geometry: Any, light: U8) -> tuple[F64, npt.NDArray[np.int64], U8]:
    """Vertices (V, 3), triangles and colours (V, C) of a mesh with colours of faces: a vertex has one colour."""
    faces = np.asarray(geometry.faces, np.int64)
    _, kind = np.unique(light[::3], axis=0, return_inverse=True)
    key = faces * (int(kind.max(initial=0)) + 1) + kind.reshape(-1, 1)
    _, first, vertex = np.unique(key.ravel(), return_index=True, return_inverse=True)
    points = np.asarray(geometry.vertices, np.float64)[faces.ravel()[first]]
    return points, vertex.reshape(-1, 3), light[first]


def as_rgba(color: Any, default: Sequence[int]) -> U8:
    """A colour of trimesh, bytes or floats of 0 to 1, as four bytes."""
    given: Any = np.asarray(default if color is None else color).ravel()
    scale = 255 if given.dtype.kind == "f" and given.max(initial=0) <= 1 else 1
    return np.append(np.rint(scale * given), 255)[:4].astype(np.uint8)


def lights_of(scene: Any) -> tuple[list[tl.Light], float]:
    """The lights of a scene, and light from all sides."""
    own = getattr(scene, "_lights", None)
    if own is None:  # as in the viewer: towards the corners of the scene's box, in the space of the eye
        color, corners = srgb_bytes(np.full(3, DEFAULT_LIGHT)), np.asarray(scene.bounds, np.float64)
        lights = [tl.Light(corner, color=color, space="eye") for corner in corners if corner.any()]
        return lights, AMBIENT + 2 * DEFAULT_LIGHT
    lights, ambient = [], AMBIENT
    for light in own:
        pose = np.asarray(scene.graph[light.name][0], np.float64)
        shown = np.asarray(light.color, np.float64)[:3] / 255
        shared: dict[str, Any] = {"color": srgb_bytes(shown), "intensity": float(light.intensity)}
        ambient += float(shown.mean() * light.intensity)
        if hasattr(light, "outerConeAngle"):
            inner, outer = math.degrees(light.innerConeAngle), math.degrees(light.outerConeAngle)
            cone: dict[str, Any] = {"direction": -pose[:3, 2], "inner_deg": inner, "outer_deg": outer}
            lights.append(tl.Light(pose[:3, 3], "spot", **cone, **shared))
        elif "Directional" in type(light).__name__:
            lights.append(tl.Light(pose[:3, 2], **shared))
        else:
            lights.append(tl.Light(pose[:3, 3], "point", **shared))
    return lights, ambient


def points_of(cloud: Any, pose: F64, size: float) -> tl.Points:
    """A cloud of points as squares, black where it has no colours."""
    positions = in_space(cloud.vertices, pose)
    colors = np.asarray(getattr(cloud, "colors", ()))
    shown = colors[:, :3].astype(np.uint8) if len(colors) == len(positions) else np.zeros((len(positions), 3), np.uint8)
    return tl.Points(positions, shown, size=size, shape="square")


def lines_of(
    path: Any, pose: F64, lifted: F64, camera: tl.Camera, size: tuple[int, int], width: float
) -> list[tl.Points]:
    """The curves of a path as discs side by side, as many as a picture of this size shows."""
    colors = getattr(path, "colors", None)
    segments, shown = [], []
    for k, entity in enumerate(path.entities):
        along = in_space(entity.discrete(path.vertices), pose) + lifted
        segments.append(np.stack([along[:-1], along[1:]], axis=1))
        color = as_rgba(None if colors is None or k >= len(colors) else colors[k], (0, 0, 0))
        shown.append(np.tile(color[:3], (len(along) - 1, 1)))
    if not segments:
        return []
    dots, rows = dots_along(np.concatenate(segments), camera.clip_from_world(size), size)
    return [tl.Points(dots, np.concatenate(shown)[rows], size=width)] if len(dots) else []


def in_space(points: Any, pose: F64) -> F64:
    """Points (N, 2) or (N, 3) where a pose takes them, (N, 3)."""
    points = np.asarray(points, np.float64)
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    return moved(points, pose)
