"""Visible faces: which triangles of a mesh each of many cameras sees, and in how many pixels.

Input: a mesh or scene, cameras. Output: `VisibleFaces`, a sparse table.
"""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft import Mesh, Scene, as_mesh
from topleft._apps.batch.batch import render_batch
from topleft._apps.batch.jobs import Job
from topleft._core.base.array_types import I32, MeshLike
from topleft._core.base.arrays import as_count, shown
from topleft._core.base.defaults import DEFAULT_SIZE
from topleft.annex.pictures import CameraLike, as_camera
from topleft.typing import CullOption


@dataclass(frozen=True, eq=False)
class VisibleFaces:
    """The triangles that cameras see: a row for each camera and visible triangle, in the order of the cameras.

    Attributes
    ----------
    camera, face, pixels : (N,) int32
        The camera, the triangle and the number of its pixels. Triangles of all instances of a scene are numbered in
        their order.
    shape : (number of cameras, number of triangles)

    Examples
    --------
    >>> import topleft as tl
    >>> cube = tl.Mesh(*tl.scenes.cube())
    >>> cameras = [tl.Camera.look_at((0, 0, 5)), tl.Camera.look_at((5, 0, 0))]
    >>> table = tl.visible_faces(cube, cameras, (64, 64))
    >>> table.shape, len(table.face), table.seen_by.tolist().count(1)
    ((2, 12), 4, 4)
    """

    camera: I32
    face: I32
    pixels: I32
    shape: tuple[int, int]
    triangles: I32
    """(T, 3): the vertices of all triangles, numbered through all instances in their order."""

    def __repr__(self) -> str:
        n_cameras, n_faces = self.shape
        return f"VisibleFaces({n_cameras} cameras, {n_faces} triangles, {len(self.face)} seen)"

    @property
    def seen_by(self) -> npt.NDArray[np.int64]:
        """The number of cameras that see each triangle, (T,)."""
        return np.bincount(self.face, minlength=self.shape[1])

    def vertices(self) -> VisibleFaces:
        """The table by vertices: each has the pixels of all triangles round it."""
        n = int(self.triangles.max(initial=-1)) + 1
        key = (self.camera[:, None].astype(np.int64) * n + self.triangles[self.face]).ravel()
        found, where = np.unique(key, return_inverse=True)
        n_pixels = np.bincount(where.ravel(), weights=np.repeat(self.pixels, 3), minlength=len(found))
        columns: list[I32] = [column.astype(np.int32) for column in (*np.divmod(found, max(n, 1)), n_pixels)]
        return VisibleFaces(columns[0], columns[1], columns[2], (self.shape[0], n), np.empty((0, 3), np.int32))

    def to_scipy(self) -> Any:
        """The table as `scipy.sparse.csr_array`, cameras by triangles.

        Raises
        ------
        ImportError
            If SciPy is not installed.
        """
        from scipy.sparse import csr_array

        return csr_array((self.pixels, (self.camera, self.face)), shape=self.shape)


def visible_faces(
    mesh: MeshLike | Scene,
    cameras: Iterable[CameraLike],
    size: int | tuple[int, int] = DEFAULT_SIZE,
    *,
    min_pixels: int = 1,
    cull: CullOption | None = None,
    executor: Executor | int | Any = None,
) -> VisibleFaces:
    """Return the triangles that each of many cameras sees, and the number of their pixels.

    Parameters
    ----------
    mesh : Mesh, Scene, or whatever `as_mesh` takes
    cameras : iterable of Camera
        May be a generator.
    size : int or (width, height), pixels
        Of the pictures in which triangles are counted; a triangle that owns no pixel's centre is not seen.
    min_pixels : int
        The fewest pixels of a triangle that counts as visible.
    cull : {"none", "back", "front"}, optional
        As for `render`.
    executor : None, int, concurrent.futures.Executor or dask.distributed.Client
        The workers, as for `render_batch`. Never changes a number.

    Returns
    -------
    VisibleFaces

    Raises
    ------
    ValueError, TypeError
        As in `render_layers`; if `min_pixels` is no number of at least 1.

    Examples
    --------
    >>> import topleft as tl
    >>> ball = tl.Mesh(*tl.scenes.icosphere(2))
    >>> table = tl.visible_faces(ball, tl.viewpoints(ball, 6), (128, 128), min_pixels=3)
    >>> bool((table.seen_by > 0).all()), int(table.pixels.min())
    (True, 3)
    """
    least = as_count("min_pixels", min_pixels)
    if not isinstance(cameras, Iterable) or isinstance(cameras, str | bytes | np.ndarray):
        raise TypeError(f"cameras must be an iterable of Camera, got {shown(cameras)}")
    subject: Mesh | Scene = mesh if isinstance(mesh, Scene) else as_mesh(mesh)
    scene = subject if isinstance(subject, Scene) else Scene([subject])
    scene.check_counted("a scene with counts of visible triangles")
    n_faces = scene.n_triangles
    layers = ("triangle",) if len(scene) == 1 else ("triangle", "instance")
    jobs = (Job(subject, as_camera(one), size, {"cull": cull}, None, layers) for one in cameras)
    rows: list[tuple[I32, I32]] = []
    for result in render_batch(jobs, executor=executor):
        ids = result.layers["triangle"]
        if "instance" in layers:
            ids = np.where(ids >= 0, ids + scene.first_ids[result.layers["instance"]], -1)
        counts = np.bincount((ids + 1).ravel(), minlength=n_faces + 1)[1:]
        faces = np.flatnonzero(counts >= least)
        rows.append((faces.astype(np.int32), counts[faces].astype(np.int32)))
    n_seen = [len(faces) for faces, _ in rows]
    camera = np.repeat(np.arange(len(rows), dtype=np.int32), n_seen)
    none = [np.empty(0, np.int32)]
    face, pixels = (np.concatenate(none + [row[k] for row in rows]) for k in range(2))
    meshes = [one.mesh for one in scene]
    firsts = np.cumsum([0, *(len(one.vertices) for one in meshes)])
    corners = [one.triangles + np.int32(first) for one, first in zip(meshes, firsts.tolist(), strict=False)]
    return VisibleFaces(camera, face, pixels, (len(rows), n_faces), np.concatenate(corners))
