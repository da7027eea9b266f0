"""Scenes: meshes that stand in one world, each placed by a matrix, as often as wanted.

Input: meshes and matrices; or another subject, a path, say. Output: a `Scene`, or the `Mesh`, `Scene` or `Points`
that is drawn. (Ready-made test scenes are in `topleft.scenes`.)
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import InitVar, dataclass, field
from functools import partial
from html import escape
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, MeshLike
from topleft._core.base.arrays import INT32_MAX, as_real, check_regular, set_read_only, shown
from topleft._core.base.cached import cached_property
from topleft._core.base.color import ColorLike
from topleft._core.raster.clusters import Backoff
from topleft._meshes.io.load import load
from topleft._meshes.model.cache import ByMaterial
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh, extreme_points, trusted_mesh, used_vertices
from topleft._meshes.model.normals import moved
from topleft._meshes.model.points import Points
from topleft._meshes.model.pose import as_pose
from topleft._meshes.scene.adapt import as_mesh, is_mesh_like

if TYPE_CHECKING:
    from topleft._meshes.picture.holes import Cut
    from topleft._meshes.picture.render import PictureOptions

EYE = np.eye(4)


@dataclass(frozen=True, eq=False)
class Instance:
    """A mesh and where it stands; the arrays of the mesh are never copied.

    Parameters
    ----------
    mesh : Mesh
    transform : (4, 4) or (3, 4) array_like, pair (R, t) or (rvec, tvec), or mapping
        World from object, with last row [0, 0, 0, 1] and not singular; a rotation (3, 3), or OpenCV's vector (3,) for
        it, and a translation (3,); or a mapping of BOP, with `cam_R_m2c` and `cam_t_m2c`: the camera is the world then.
        One that mirrors turns the winding over, and `cull` with it, so that the outside stays outside.
    name : str, optional
    material : Material, optional
        For all triangles, instead of those of the mesh; `render(material=)` goes before it.
    color : str, integers of 0 to 255 or floats of 0 to 1, optional
        sRGB, as for `Material`: short for ``material=Material(color)``.

    Raises
    ------
    ValueError
        If the matrix has another shape or last row, is singular, or holds a number that is not finite; if both a colour
        and a material are given.
    TypeError
        If `mesh` or `material` is none.

    Examples
    --------
    >>> import numpy as np
    >>> import topleft as tl
    >>> cube = tl.Mesh(*tl.scenes.cube())
    >>> aside = np.eye(4)
    >>> aside[0, 3] = 3.0
    >>> scene = tl.Scene([tl.Instance(cube), tl.Instance(cube, aside, name="right")])
    >>> scene.n_triangles
    24
    """

    mesh: Mesh
    transform: F64 = field(default_factory=lambda: EYE)
    name: str | None = None
    material: Material | None = None
    color: InitVar[ColorLike | None] = None

    if TYPE_CHECKING:  # anything that NumPy reads may be given; the types above are kept

        def __init__(
            self,
            mesh: Mesh,
            transform: npt.ArrayLike | Mapping[str, npt.ArrayLike] = ...,
            name: str | None = None,
            material: Material | None = None,
            color: ColorLike | None = None,
        ) -> None: ...

    __setstate__ = set_read_only

    def __post_init__(self, color: ColorLike | None) -> None:
        if not isinstance(self.mesh, Mesh):
            raise TypeError(f"mesh must be a Mesh, got {shown(self.mesh)}: topleft.as_mesh makes one of others")
        if not (self.name is None or isinstance(self.name, str)):
            raise TypeError(f"name must be a str or None, got {shown(self.name)}")
        if not (self.material is None or isinstance(self.material, Material)):
            raise TypeError(f"material must be a Material or None, got {shown(self.material)}")
        if color is not None:
            if self.material is not None:
                raise ValueError("an instance takes a colour or a material, got both: Material(color, ...) has one")
            object.__setattr__(self, "material", Material(color))
        matrix = as_pose("transform", self.transform)
        matrix.flags.writeable = False
        object.__setattr__(self, "transform", matrix)

    def __repr__(self) -> str:
        """One line: the mesh and where its origin stands."""
        place = ", ".join(f"{x:.4g}" for x in self.transform[:3, 3])
        name = "" if self.name is None else f", name={self.name!r}"
        return f"Instance({self.mesh!r}, at=({place}){name})"

    def but(self, **changes: Any) -> Instance:
        """Return the instance with other values, which have been checked."""
        instance = object.__new__(Instance)
        vars(instance).update(vars(self), **changes)
        return instance

    @cached_property
    def is_mirrored(self) -> bool:
        """Whether the matrix turns the winding of triangles over."""
        return engine.determinant(self.transform[:3, :3]) < 0


IN_PLACE = Instance(Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32)))
"""An empty mesh in place, which `but` copies."""
vars(IN_PLACE)["is_mirrored"] = False  # as copies know


class SceneCache:
    """Values computed of one scene for its next pictures: scenes made of it by `with_transforms` share them.

    They go with the last of these scenes; no copy or pickle has them. Memory, for N instances and M different
    meshes: `first_vertices` takes 8 N bytes, `mesh_list` about 64 M, each of `sides` 5 N; `cuts` and `blended` refer to
    values of the meshes. Threads share it as they do a `MeshCache`.
    """

    def __init__(self) -> None:
        self.is_drawn_often = False
        """Whether pictures have drawn each mesh so often that clusters pay."""
        self.first_vertices: npt.NDArray[np.int64] | None = None
        self.mesh_list: tuple[engine.MeshList, npt.NDArray[np.int64]] | None = None
        self.sides: dict[tuple[int, bool], tuple[npt.NDArray[np.int32], npt.NDArray[np.bool_]]] = {}
        """By `cull` and whether materials decide: the `tl_cull` of each instance unless mirrored, which are mixed."""
        self.pictures: dict[tuple[Hashable, ...], PictureOptions] = {}
        """Checked options of pictures, `MOST_KEPT` at most."""
        self.cuts: ByMaterial[list[Cut | None]] = ByMaterial()
        """The materials with holes of each instance."""
        self.blended: ByMaterial[list[npt.NDArray[np.bool_] | None]] = ByMaterial()
        """The blended triangles of each instance."""
        self.checked_cameras: WeakSet[object] = WeakSet()
        """Cameras whose planes were compared with the scene."""


@dataclass(frozen=True, eq=False, repr=False)
class Scene:
    """Meshes in one world.

    Parameters
    ----------
    instances : iterable of Instance, mesh, (mesh, transform) or (mesh, transform, name)
        At least one. A mesh is whatever `as_mesh` takes: a `Mesh`, a path, a mesh of trimesh, (vertices, triangles).
        By itself it stands where its vertices are. Make a `Mesh` first to share it among instances.

    Raises
    ------
    ValueError
        If there is no instance.
    TypeError
        If an instance is something else.

    Examples
    --------
    >>> import numpy as np, topleft as tl
    >>> cube = tl.Mesh(*tl.scenes.shape("cube"))
    >>> aside = np.eye(4)
    >>> aside[0, 3] = 3
    >>> scene = tl.Scene([cube, (cube, aside, "right")])
    >>> scene
    Scene(2 instances of 1 mesh, 24 triangles)
    >>> scene[1].name, scene.bounds.tolist()
    ('right', [[-1.0, -1.0, -1.0], [4.0, 1.0, 1.0]])
    """

    instances: tuple[Instance, ...]

    def __init__(self, instances: Iterable[Instance | MeshLike | tuple[object, ...]]) -> None:
        if isinstance(instances, Mesh | str | np.ndarray) or not isinstance(instances, Iterable):
            raise TypeError(f"instances must be a sequence of meshes, got {shown(instances)}: Scene([mesh])")
        object.__setattr__(self, "instances", tuple(map(as_instance, instances)))
        if not self.instances:
            raise ValueError("a scene needs at least one instance, got none")

    @cached_property  # type: ignore[no-redef]
    def instances(self) -> tuple[Instance, ...]:
        """The instances; a scene that was made like another makes them when all are needed."""
        return tuple(map(self._made, range(len(self))))

    def _made(self, i: int) -> Instance:
        """Return an instance of a scene that was made like another."""
        meshes, of_instance = self._numbered
        own = {"transform": self.transforms[i], "is_mirrored": bool(self.are_mirrored[i])}
        return vars(self)["_like"].instances[i].but(mesh=meshes[of_instance[i]], **own)

    def __getstate__(self) -> dict[str, object]:
        """The state for another process, which finds out the rest itself."""
        return {"instances": self.instances}

    def _repr_html_(self) -> str:
        """A table of the instances, the first hundred of them."""
        rows = [
            (i, one.name or "", len(one.mesh.vertices), len(one.mesh.triangles), one.transform[:3, 3].round(4).tolist())
            for i, one in enumerate(self.instances[:100])
        ]
        head = "".join(f"<th>{escape(name)}</th>" for name in ("", "name", "vertices", "triangles", "at"))
        body = "".join("<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows)
        return f"<p>{escape(repr(self))}</p><table><tr>{head}</tr>{body}</table>"

    def __len__(self) -> int:
        return len(self.first_ids) - 1

    def __iter__(self) -> Iterator[Instance]:
        return iter(self.instances)

    def __getitem__(self, i: int) -> Instance:
        is_kept = "instances" in vars(self) or isinstance(i, slice)
        return self.instances[i] if is_kept else self._made(i)

    def __repr__(self) -> str:
        n, n_meshes = len(self), len(self.meshes)
        many, kinds = "s" * (n > 1), "es" * (n_meshes > 1)
        return f"Scene({n} instance{many} of {n_meshes} mesh{kinds}, {self.n_triangles} triangles)"

    @property
    def first_vertices(self) -> npt.NDArray[np.int64]:
        """Where the vertices of each instance begin when all are counted, and the number of all: (N + 1,) int64."""
        found = self.cache.first_vertices
        if found is None:
            found = self.cache.first_vertices = self._firsts(lambda mesh: len(mesh.vertices))
        return found

    @property
    def mesh_list(self) -> tuple[engine.MeshList, npt.NDArray[np.int64]]:
        """The different meshes, and which of them each instance has, (N,)."""
        found = self.cache.mesh_list
        if found is None:
            meshes, of_instance = self._numbered
            listed = engine.MeshList([(mesh.vertices, mesh.triangles) for mesh in meshes])
            found = self.cache.mesh_list = listed, of_instance
        return found

    @cached_property
    def are_mirrored(self) -> npt.NDArray[np.bool_]:
        """Which matrices turn the winding of triangles over, (N,)."""
        return np.array([instance.is_mirrored for instance in self.instances], np.bool_)

    @cached_property
    def backoff(self) -> Backoff:
        """How long to go on drawing the meshes whole."""
        return Backoff()

    @property
    def n_triangles(self) -> int:
        """Triangles of all instances together."""
        return int(self.first_ids[-1])

    @cached_property
    def first_ids(self) -> npt.NDArray[np.int64]:
        """Where the triangles of each instance begin when all are counted, and the number of all: (N + 1,) int64."""
        first_ids = self._firsts(lambda mesh: len(mesh.triangles))
        first_ids.flags.writeable = False
        return first_ids

    def _firsts(self, count: Callable[[Mesh], int]) -> npt.NDArray[np.int64]:
        """Return where something of each instance begins that a mesh has so often, and the number of all: (N + 1,)."""
        counts: npt.NDArray[np.int64] = np.zeros(1 + sum(len(at) for _, at in self.meshes.values()), np.int64)
        for mesh, at in self.meshes.values():
            counts[1 + at] = count(mesh)
        return np.cumsum(counts)

    @cached_property
    def transforms(self) -> F64:
        """World from object of each instance, (N, 4, 4)."""
        transforms = np.stack([instance.transform for instance in self.instances])
        transforms.flags.writeable = False
        return transforms

    def clip_from_objects(self, clip_from_world: F64) -> F64:
        """Clip from object of each instance, (N, 4, 4): the product of each, to the bit."""
        if len(self) == 1:
            own = self.instances[0].transform
            return (clip_from_world if own is IN_PLACE.transform else engine.product(clip_from_world, own))[None]
        columns = np.ascontiguousarray(self.transforms.transpose(1, 0, 2)).reshape(4, -1)
        products = engine.product(clip_from_world, columns).reshape(4, -1, 4)
        return np.ascontiguousarray(products.transpose(1, 0, 2))

    @cached_property
    def meshes(self) -> dict[int, tuple[Mesh, npt.NDArray[np.intp]]]:
        """The different meshes, by their `id`, and which instances are of each, ascending."""
        found: dict[int, list[int]] = {}
        for i, instance in enumerate(self.instances):
            found.setdefault(id(instance.mesh), []).append(i)
        return {key: (self.instances[at[0]].mesh, np.array(at, np.intp)) for key, at in found.items()}

    @cached_property
    def _numbered(self) -> tuple[list[Mesh], npt.NDArray[np.int64]]:
        """The different meshes, and which of them each instance has, (N,)."""
        of_instance: npt.NDArray[np.int64] = np.empty(len(self), np.int64)
        for k, (_, at) in enumerate(self.meshes.values()):
            of_instance[at] = k
        return [mesh for mesh, _ in self.meshes.values()], of_instance

    @cached_property
    def cache(self) -> SceneCache:
        """Values computed for its next pictures."""
        return SceneCache()

    def looks(self, material: Material | None) -> list[tuple[Mesh, Material | None, npt.NDArray[np.intp]]]:
        """The different meshes, each with this material or that of its instances, and which instances these are."""
        if material is not None or vars(self).get("_like", self).has_no_materials:
            return [(mesh, material, at) for mesh, at in self.meshes.values()]
        found: dict[tuple[int, int], list[int]] = {}
        for i, one in enumerate(self.instances):
            found.setdefault((id(one.mesh), id(one.material)), []).append(i)
        firsts = [(self.instances[at[0]], at) for at in found.values()]
        return [(one.mesh, one.material, np.array(at, np.intp)) for one, at in firsts]

    @cached_property
    def has_no_materials(self) -> bool:
        """Whether no instance has a material beside its mesh."""
        return all(one.material is None for one in self.instances)

    @cached_property
    def boxes(self) -> F64:
        """The `vertex_box` of the mesh of each instance, (N, 6); NaN where a vertex is not finite."""
        boxes = np.empty((len(self), 6))
        for mesh, at in self.meshes.values():
            boxes[at] = mesh.vertex_box if mesh.is_finite else np.nan
        return boxes

    @cached_property
    def groups(self) -> tuple[tuple[int, Scene], ...]:
        """The scene in parts that int32 can count from 1 on, each with the index of its first instance."""
        groups = []
        for first, end in counted_ranges(self.first_ids):
            part = unchecked_scene(self.instances[first:end], transforms=self.transforms[first:end])
            groups.append((first, part))
        return tuple(groups)

    def check_counted(self, what: str) -> None:
        """Check that int32 counts all triangles.

        Raises
        ------
        ValueError
            If it does not.
        """
        if self.n_triangles > INT32_MAX:
            raise ValueError(f"{what} must have at most {INT32_MAX} triangles, got {self.n_triangles}")

    def with_transforms(self, transforms: npt.ArrayLike) -> Scene:
        """The scene with its instances elsewhere: meshes and materials are shared, and values computed of them kept.

        Parameters
        ----------
        transforms : (N, 4, 4) array_like
            World from object of each instance.

        Raises
        ------
        ValueError
            If the shape is another, a number is not finite, a last row is not [0, 0, 0, 1], or a matrix is singular.

        Examples
        --------
        >>> import numpy as np, topleft as tl
        >>> scene = tl.Scene([tl.Mesh(*tl.scenes.shape("cube"))])
        >>> scene.with_transforms([np.diag([2, 2, 2, 1])]).bounds.tolist()
        [[-2.0, -2.0, -2.0], [2.0, 2.0, 2.0]]
        """
        placed = as_real("transforms", transforms).copy()
        if placed.shape != (len(self), 4, 4):
            raise ValueError(f"transforms must have shape ({len(self)}, 4, 4), got {placed.shape}")
        placed.flags.writeable = False
        mirrored = engine.are_mirrored(placed)
        if mirrored is None:  # unless all are regular, far beyond rounding
            if not np.isfinite(placed).all():
                raise ValueError("transforms must hold finite numbers")
            if not (placed[:, 3] == [0, 0, 0, 1]).all():
                raise ValueError("the last row of each of transforms must be [0, 0, 0, 1]")
            for k, matrix in enumerate(placed):
                check_regular(f"transforms[{k}]", matrix)
            mirrored = np.array([engine.determinant(matrix[:3, :3]) < 0 for matrix in placed], np.uint8)
        kept = {"first_ids": self.first_ids, "meshes": self.meshes, "boxes": self.boxes, "backoff": self.backoff}
        own = {"cache": self.cache, "_numbered": self._numbered}
        return self._but(transforms=placed, are_mirrored=mirrored.view(np.bool_), **kept, **own)

    def with_meshes(self, meshes: Sequence[Mesh], of_instance: npt.NDArray[np.int64]) -> Scene:
        """Return the scene with other meshes, all different; `of_instance` (N,): which of them each instance has."""
        known = {"transforms": self.transforms, "are_mirrored": self.are_mirrored, "backoff": self.backoff}
        if len(self) == 1:
            return unchecked_scene([self[0].but(mesh=meshes[of_instance[0]])], **known)
        places = ((mesh, np.flatnonzero(of_instance == k)) for k, mesh in enumerate(meshes))
        return self._but(meshes={id(mesh): (mesh, at) for mesh, at in places if len(at)}, **known)

    def _but(self, **values: object) -> Scene:
        """Return a scene like this scene, with these values in place of the values of its instances."""
        scene = object.__new__(Scene)
        vars(scene).update(values, _like=vars(self).get("_like", self))
        return scene

    @property
    def bounds(self) -> F64:
        """Lower and upper corner (2, 3) float64 of the box round all triangles, in the world.

        Raises
        ------
        ValueError
            If there are no triangles.
        """
        points = self.extreme_points()
        return np.stack([points.min(axis=0), points.max(axis=0)])

    def extreme_points(self) -> F64:
        """Corners of triangles in the world, (N, 3) float64, which have the box and the bounding sphere of all.

        Raises
        ------
        ValueError
            If there are no triangles.
        """
        drawn = [instance for instance in self.instances if len(instance.mesh.triangles)]
        points = {id(mesh): used_vertices(mesh) for mesh, _ in self.meshes.values()}
        used = [partial(moved, points[id(instance.mesh)], instance.transform) for instance in drawn]
        if not used:
            raise ValueError("a scene without triangles has no bounds")
        return extreme_points(*used)


def counted_ranges(first_ids: npt.NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """Yield ranges of instances that int32 can count the triangles of, from 1 on, by the first id of each instance."""
    first = 0
    while first < len(first_ids) - 1:
        end = int(np.searchsorted(first_ids, first_ids[first] + INT32_MAX, side="right")) - 1
        yield first, end
        first = end


def as_instance(value: object) -> Instance:
    """Return the instance of a value that a scene is made from."""
    if isinstance(value, Instance):
        return value
    if isinstance(value, Scene):
        raise TypeError("instances must be meshes, got a Scene: Scene([*scene, mesh]) joins them")
    if isinstance(value, tuple) and 2 <= len(value) <= 3 and not is_pair(value):
        mesh, *place = value
        if is_subject(mesh):
            return Instance(as_mesh(mesh), *place)
    elif is_subject(value):
        return Instance(as_mesh(value))
    raise TypeError(
        "instances must be Instance, a mesh, (mesh, transform) or (mesh, transform, name), a mesh being a Mesh, a "
        f"path, a mesh of another library or (vertices, triangles), got {shown(value)}"
    )


def is_subject(value: object) -> bool:
    """Whether the value is to be given to `as_mesh`."""
    return isinstance(value, Mesh) or is_mesh_like(value) or is_pair(value) or hasattr(value, "vertices")


def is_pair(value: object) -> bool:
    """Whether it is (vertices, triangles), and not (mesh, transform)."""
    if not isinstance(value, tuple | list) or len(value) != 2:
        return False
    try:
        first, second = (np.shape(part) for part in value)
    except ValueError:  # polygons of several numbers of corners
        return not is_mesh_like(value[0])
    return len(first) == 2 and first[1] in (2, 3) and len(second) == 2


def world_corners(instance: Instance) -> F64:
    """The vertices that triangles of an instance use, in the world: (N, 3) float64."""
    return moved(used_vertices(instance.mesh), instance.transform)


def as_subject(given: MeshLike | Scene | Points) -> Mesh | Scene | Points:
    """The subject itself, the file that a path names, or the mesh that `as_mesh` makes of it."""
    if isinstance(given, Mesh | Scene | Points):
        return given
    return load(given) if isinstance(given, str | os.PathLike) else as_mesh(given)


def as_meshes(given: MeshLike | Scene) -> Mesh | Scene:
    """The scene or mesh that calls draw as triangles; points are refused."""
    return given if isinstance(given, Scene) else as_mesh(given)


def scene_of(subject: Mesh | Scene) -> Scene:
    """The scene, or that of a mesh alone."""
    return subject if isinstance(subject, Scene) else unchecked_scene([IN_PLACE.but(mesh=subject)])


def unchecked_scene(instances: Sequence[Instance], **known: object) -> Scene:
    """A scene of checked instances, with values known of it."""
    scene = object.__new__(Scene)
    vars(scene).update(instances=tuple(instances), **known)
    return scene


def collapsed(scene: Scene, masks: Sequence[npt.NDArray[np.bool_] | None], *, keeps_others: bool = True) -> Scene:
    """The scene with these triangles collapsed to points, so ids stay; other instances whole, or all of them."""
    made: dict[tuple[int, int], Mesh] = {}
    instances = []
    for instance, mask in zip(scene, masks, strict=True):
        mesh, key = instance.mesh, (id(instance.mesh), id(instance.material))
        if mask is None and keeps_others:
            instances.append(instance)
            continue
        if key not in made:
            if mask is None:
                made[key] = Mesh(mesh.vertices[mesh.triangles[:1, 0]], np.zeros_like(mesh.triangles))
            else:
                made[key] = trusted_mesh(mesh.vertices, np.where(mask[:, None], mesh.triangles[:, :1], mesh.triangles))
        instances.append(instance.but(mesh=made[key]))
    return Scene(instances)
