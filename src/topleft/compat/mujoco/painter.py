"""Draws scenes of MuJoCo: colours, window depth, and which geom is seen.

Input: an `MjModel`, and an `MjvScene` that MuJoCo has updated. Output: arrays, row 0 on top.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

import topleft as tl
from topleft.compat._arrays import F64, SHOWN_AS_LIGHT, U8, over
from topleft.compat.mujoco import shapes
from topleft.compat.mujoco.looks import Looks, lights_of

SAMPLES = ((16, "msaa16"), (8, "msaa8"), (4, "msaa4"), (2, "msaa2"))
"""Samples of a pixel of a model's quality, and the sampling with as many."""

BEHIND = 0.3
"""Opacity of a plane that is seen from below."""


FEW_PIXELS = 1 << 18
"""Pictures that one thread draws: a second one would set up all triangles again, and 37 geoms at 64x64 take 1.6 times
the CPU time."""


DEFORMED = (shapes.FLEX, shapes.SKIN)
"""Whose vertices are new in each picture."""

MOST_SUBJECTS = 8


class Subject(NamedTuple):
    """What is drawn of some geoms."""

    scene: Any
    """`tl.Scene`, or None of nothing."""
    rows: npt.NDArray[np.intp]
    """Which geom each of its instances is of."""


class Painter:
    """Draws scenes of one model; meshes, materials and scenes are kept from picture to picture."""

    def __init__(self, model: Any) -> None:
        import mujoco

        self.model, self._flags = model, mujoco.mjtRndFlag
        self._assets = Assets(model)
        self._sampling: Any = next((word for n, word in SAMPLES if model.vis.quality.offsamples >= n), "center")
        self._subjects: dict[tuple[Any, ...], Subject] = {}
        self._sky: tuple[Any, Any] = (None, None)
        self._lights: tuple[Any, Any] = (None, None)

    def colors(self, scene: Any, size: tuple[int, int]) -> U8:
        """The picture (H, W, 3)."""
        camera, eye = camera_of(scene.camera, size)
        sky = self._sky_seen(scene, camera, size)
        lights, ambient, gloss = self._lights_seen(scene)
        subject = self._subject(scene, [*scene.geoms[: scene.ngeom]], eye, gloss)
        if subject is None:
            return np.broadcast_to(np.asarray(sky, np.uint8), (*size[::-1], 4))[..., :3].copy()
        look: dict[str, Any] = {"background": "transparent", "lights": lights, "ambient": ambient}
        picture = tl.render(subject.scene, camera, size, sampling=self._sampling, threads=threads_of(size), **look)
        return over(picture, SHOWN_AS_LIGHT, sky)[..., :3]

    def depth(self, scene: Any, size: tuple[int, int], geoms: list[Any]) -> F64:
        """Window depth (H, W) of some geoms: 1 at the near plane, 0 at the far one, where float32 is fine."""
        camera, _ = camera_of(scene.camera, size)
        subject = self._subject(scene, geoms)
        if subject is None:
            return np.zeros(size[::-1])
        projection = camera.projection.copy()
        projection[2] = -projection[2]
        upside = tl.Camera(camera.view, projection)
        drawn = tl.rasterize_mesh(
            subject.scene, upside, size, depth_test="greater", background_depth=0.0, threads=threads_of(size)
        )
        return drawn.depth.astype(np.float64)

    def geoms(self, scene: Any, size: tuple[int, int]) -> tuple[list[Any], npt.NDArray[np.intp]]:
        """The geoms that have ids, and which of them each pixel (H, W) shows, -1 where none."""
        geoms = segmented(scene)
        subject = self._subject(scene, geoms)
        if subject is None:
            return geoms, np.full(size[::-1], -1, np.intp)
        frags = tl.rasterize_mesh(subject.scene, camera_of(scene.camera, size)[0], size, threads=threads_of(size))
        assert isinstance(frags, tl.SceneFragments)
        return geoms, np.append(subject.rows, -1)[frags.instance]

    def _subject(self, scene: Any, geoms: list[Any], eye: F64 | None = None, gloss: float = 1.0) -> Subject | None:
        """The scene of these geoms; None of none. With colours: who sees planes from behind, strength of highlights.

        What stands in it is kept until a geom looks another way: then the next picture needs the poses alone.
        """
        culls = bool(scene.flags[self._flags.mjRND_CULL_FACE])
        below = [eye is not None and geom.type == shapes.PLANE and is_behind(geom, eye) for geom in geoms]
        key = (eye is None, gloss, culls, tuple(below), *looks_of(geoms))
        subject = self._subjects.get(key)
        if subject is None:
            subject = self._made(scene, geoms, below, gloss, culls=culls, is_lit=eye is not None)
            if not any(geom.type in DEFORMED for geom in geoms):
                if len(self._subjects) >= MOST_SUBJECTS:
                    self._subjects.clear()
                self._subjects[key] = subject
        if subject.scene is None:
            return None
        poses = np.zeros((len(geoms), 4, 4))
        poses[:, :3, :3] = orthonormal(
            np.concatenate([geom.mat for geom in geoms]).reshape(-1, 3, 3).astype(np.float64)
        )
        poses[:, :3, 3] = np.concatenate([geom.pos for geom in geoms]).reshape(-1, 3)
        poses[:, 3, 3] = 1
        poses[[geom.type in DEFORMED for geom in geoms]] = np.eye(4)  # they are in the world
        return subject._replace(scene=subject.scene.with_transforms(poses[subject.rows]))

    def _made(
        self, scene: Any, geoms: list[Any], below: list[bool], gloss: float, *, culls: bool, is_lit: bool
    ) -> Subject:
        """What is drawn of geoms, where its vertices are."""
        instances, rows, looks = [], [], self._assets.looks
        for k, (geom, is_below) in enumerate(zip(geoms, below, strict=True)):
            is_double = not culls or geom.type in (shapes.PLANE, shapes.TRIANGLE)
            opacity = BEHIND if is_below else 1.0
            look = looks.of(geom, opacity, gloss, is_double=is_double) if is_lit else looks.plain[is_double]
            for mesh in self._assets.meshes_of(geom, scene):
                instances.append(tl.Instance(mesh, material=look))
                rows.append(k)
        return Subject(tl.Scene(instances) if instances else None, np.array(rows, np.intp))

    def _lights_seen(self, scene: Any) -> tuple[list[tl.Light], float, float]:
        """The lights, as `lights_of` returns them; kept while they stay as they are."""
        names = ("pos", "dir", "attenuation", "ambient", "diffuse", "specular")
        lights = scene.lights[: scene.nlight]
        key = [
            (one.type, one.cutoff, one.exponent, *(getattr(one, name).tobytes() for name in names)) for one in lights
        ]
        if self._lights[0] != key:
            self._lights = key, lights_of(scene, self.model.stat.center)
        return self._lights[1]

    def _sky_seen(self, scene: Any, camera: tl.Camera, size: tuple[int, int]) -> Any:
        """What is behind everything, (H, W, 4) uint8, or black; kept while the camera looks the same way."""
        sky = self._assets.looks.sky
        if sky is None or not scene.flags[self._flags.mjRND_SKYBOX]:
            return (0, 0, 0, 255)
        key = size, camera.view[:3, :3].tobytes(), camera.projection.tobytes()
        if self._sky[0] != key:
            turned = np.eye(4)
            turned[:3, :3] = camera.view[:3, :3]
            picture = tl.render(sky, tl.Camera(turned, camera.projection), size, background="black")
            self._sky = key, over(picture, SHOWN_AS_LIGHT, (0, 0, 0, 255))
        return self._sky[1]


def threads_of(size: tuple[int, int]) -> int | None:
    """One thread for pictures that many environments draw side by side; all for large ones."""
    return 1 if size[0] * size[1] <= FEW_PIXELS else None


def segmented(scene: Any) -> list[Any]:
    """The geoms of a scene that have ids."""
    return [geom for geom in scene.geoms[: scene.ngeom] if geom.segid >= 0]


class Assets:
    """The meshes and materials of a model, made when a scene first shows them."""

    def __init__(self, model: Any) -> None:
        self.model, self.looks = model, Looks(model)
        self.quality = int(model.vis.quality.numslices), int(model.vis.quality.numstacks)
        self.made: dict[tuple[Any, ...], tuple[tl.Mesh, ...]] = {}

    def meshes_of(self, geom: Any, scene: Any) -> tuple[tl.Mesh, ...]:
        """What is drawn for a geom: one mesh, or none."""
        kind, data = int(geom.type), int(geom.dataid)
        if kind in DEFORMED:
            return deformed(self.model, geom, scene)
        size = tuple(geom.size.tolist())
        cube, laying = self.looks.cube_of(geom), self.looks.laying_of(geom)
        has_own_size = data < 0 or kind in (shapes.PLANE, *shapes.TAKES_SIZE) or cube
        key = (kind, data, cube, laying, size if has_own_size else None)
        if key not in self.made:
            mesh = self._make(kind, data, size)
            if mesh is not None and cube is not None:
                mesh = self.looks.laid_on_cube(mesh, geom, cube)
            elif mesh is not None and laying is not None and mesh.uv is not None:
                mesh = shapes.laid(mesh, *laying)
            self.made[key] = () if mesh is None else (mesh,)
        return self.made[key]

    def _make(self, kind: int, data: int, size: Any) -> tl.Mesh | None:
        if kind == shapes.PLANE:
            reach = 1.05 * self.model.vis.map.zfar * self.model.stat.extent
            return shapes.plane(size[:2], reach)
        if kind == shapes.HFIELD:
            return shapes.height_field(self.model, data) if data >= 0 else None
        if kind in (shapes.MESH, shapes.SDF):
            return shapes.asset(self.model, data) if data >= 0 else None
        return shapes.primitive(kind, size, self.quality) if kind in shapes.TAKES_SIZE else None


def deformed(model: Any, geom: Any, scene: Any) -> tuple[tl.Mesh, ...]:
    """The faces of a flex or a skin, in the world."""
    k = int(geom.objid)
    if geom.type == shapes.SKIN:
        rows = slice(int(scene.skinvertadr[k]), int(scene.skinvertadr[k]) + int(scene.skinvertnum[k]))
        points, normals = (np.array(own, np.float64).reshape(-1, 3)[rows] for own in (scene.skinvert, scene.skinnormal))
        first = int(model.skin_faceadr[k])
        return (tl.Mesh(points, model.skin_face[first : first + int(scene.skinfacenum[k])], normals),)
    first, n = 3 * int(scene.flexfaceadr[k]), 3 * int(scene.flexfaceused[k])
    if not n:
        return ()
    points, normals = (
        np.array(own, np.float64).reshape(-1, 3)[first : first + n] for own in (scene.flexface, scene.flexnormal)
    )
    return (tl.Mesh(points, np.arange(n).reshape(-1, 3), normals),)


def orthonormal(axes: F64) -> F64:
    """Rotations (N, 3, 3) of float32 as rotations of float64, whose columns are at right angles to the last bits."""
    x, y = axes[:, :, 0], axes[:, :, 1]
    x = x / np.sqrt((x * x).sum(axis=1, keepdims=True))
    y = y - x * (x * y).sum(axis=1, keepdims=True)
    y = y / np.sqrt((y * y).sum(axis=1, keepdims=True))
    z = x[:, [1, 2, 0]] * y[:, [2, 0, 1]] - x[:, [2, 0, 1]] * y[:, [1, 2, 0]]
    return np.stack([x, y, z], axis=2)


def looks_of(geoms: list[Any]) -> tuple[Any, ...]:
    """What geoms look like, wherever they stand: equal looks are drawn alike."""
    numbers = [
        (one.type, one.dataid, one.matid, one.texid, one.texuniform, one.emission, one.specular, one.shininess)
        for one in geoms
    ]
    arrays = [array.tobytes() for one in geoms for array in (one.size, one.rgba, one.texrepeat)]
    return tuple(numbers), b"".join(arrays)


def is_behind(geom: Any, eye: F64) -> bool:
    """Whether the eye is on the back of a plane."""
    return float(((eye - geom.pos) * geom.mat[:, 2]).sum()) < 0


def cross(a: F64, b: F64) -> F64:
    """The cross product of two vectors (3,), without what NumPy does for arrays of them."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def camera_of(pair: Any, size: tuple[int, int]) -> tuple[tl.Camera, F64]:
    """The camera between the cameras of two eyes, and where it is."""
    place, forward, up = (
        (np.asarray(getattr(pair[0], name), np.float64) + getattr(pair[1], name)) / 2
        for name in ("pos", "forward", "up")
    )
    backward = -forward / np.sqrt((forward**2).sum())
    right = cross(up, backward)
    right /= np.sqrt((right**2).sum())
    view = np.eye(4)
    view[:3, :3] = right, cross(backward, right), backward
    view[:3, 3] = -(view[:3, :3] * place).sum(axis=1)
    names = ("center", "width", "bottom", "top", "near", "far")
    center, width, bottom, top, near, far = (
        (getattr(pair[0], f"frustum_{name}") + getattr(pair[1], f"frustum_{name}")) / 2 for name in names
    )
    half = width if width else 0.5 * size[0] / size[1] * (top - bottom)
    camera = tl.Camera.off_center(
        view, left=center - half, right=center + half, bottom=bottom, top=top, near=near, far=far,
        ortho=bool(pair[0].orthographic),
    )  # fmt: skip
    return camera, place
