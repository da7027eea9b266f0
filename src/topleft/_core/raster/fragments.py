"""The visibility buffer: which triangle shows in each pixel, how deep, and attributes on top of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple, Protocol, Self, overload

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike, NDArray

from topleft._core import engine
from topleft._core.base.arrays import as_array, as_checked_triangles, as_number, as_places, as_values, shown
from topleft._core.base.cached import cached_property
from topleft._core.base.memory import empty
from topleft._core.base.texels import ValueLevels, as_levels
from topleft._core.raster.backward import Backward
from topleft._core.raster.view import View
from topleft.typing import EdgesOption, EncodingOption, FilterOption, WrapOption

#: Makes the snapped mesh that attributes of some triangles need: these are snapped, no others.
PartOfMesh = Callable[..., engine.SnappedMesh]


class Viewer(Protocol):
    """The part of a camera that `distance` reads."""

    @property
    def view(self) -> NDArray[np.float64]:
        """Eye from world, (4, 4)."""


class GivenCorners(NamedTuple):
    """The caller's arrays that a visibility buffer was drawn from; derivatives along the picture come from them."""

    vertices: ArrayLike
    triangles: ArrayLike
    transform: ArrayLike | None
    viewport: tuple[int, int]
    origin: tuple[int, int] = (0, 0)
    zero_to_one: bool = False
    """Whether depth is z/w, not (z/w + 1) / 2; pixels with depth have theirs as it is."""

    def homogeneous(self, ids: NDArray[np.int32]) -> NDArray[np.float64]:
        """Corners of triangles (N, 3, 3) float64 as (x w, y w, w), x and y in pixels, not snapped."""
        rows = np.asarray(as_array("triangles", self.triangles))[ids].astype(np.intp)
        points = as_array("vertices", self.vertices)[rows].astype(np.float64)
        if self.transform is not None:
            matrix = np.asarray(as_array("transform", self.transform), np.float64)
            moved = engine.product(points.reshape(-1, points.shape[-1]), matrix[:, :3].T) + matrix[:, 3]
            points = moved.reshape(*points.shape[:-1], 4)
        if points.shape[-1] < 4:
            return np.stack([points[..., 0], points[..., 1], np.ones(points.shape[:-1])], axis=-1)
        (width, height), (x, y, _, w) = self.viewport, np.moveaxis(points, -1, 0)
        return np.stack([(w + x) * (width / 2), (w - y) * (height / 2), w], axis=-1)

    def steps(self, ids: NDArray[np.int32]) -> NDArray[np.float64]:
        """Return the slopes of each corner's l along x and y, and its w: (N, 3, 3) float64.

        The weights of a pixel are l / (l0 + l1 + l2), and l = M^-1 (x, y, 1), where the columns of M are the corners.
        """
        corners = self.homogeneous(ids)
        crossed = np.cross(np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1))
        area = engine.row_products(corners[:, 0], crossed[:, 0])
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            steps = crossed / area[:, None, None]
        steps[..., 2] = corners[..., 2]
        steps[~np.isfinite(steps).all(axis=(1, 2))] = 0  # of triangles without area before the snap
        return steps


class SampleBuffers(NamedTuple):
    """The ids and depths of the samples of a picture, as kernels read them."""

    ids: NDArray[Any]
    """int32, planes (S, H, W); int64 where int32 does not count triangles."""
    depth: NDArray[np.float32]

    @classmethod
    def of(cls, ids: NDArray[Any], depth: NDArray[Any]) -> Self:
        """Take planes; planes that kernels cannot read are copied."""
        return cls(as_read(ids, ids.dtype), as_read(depth, np.float32))

    @property
    def n_samples(self) -> int:
        """The number of samples of a pixel."""
        return len(self.ids)

    def split_pixels(self) -> tuple[tuple[NDArray[np.intp], NDArray[np.intp]], NDArray[Any], NDArray[np.float32]]:
        """Return rows and columns (P,) of pixels that show several triangles, and ids and depths (S, P)."""
        rows, columns = np.nonzero((self.ids[1:] != self.ids[0]).any(axis=0))
        return (rows, columns), self.ids[:, rows, columns], self.depth[:, rows, columns]


def as_read(planes: NDArray[Any], kind: npt.DTypeLike) -> NDArray[Any]:
    """Planes as kernels read them: copied only if need be."""
    return planes if planes.dtype == kind and planes.flags.carray else np.require(planes, kind, ["C", "A"])


class Attributes:
    """Attributes at the visible pixels of a picture (H, W), or of a batch of pictures (B, H, W)."""

    #: Ids of triangles, -1 where there is none.
    id: NDArray[Any]

    def _at_sample(self, i: object) -> Any:
        """Return ids, depth and attributes at one sample of each pixel."""
        raise NotImplementedError

    def _checked(self, values: Any) -> Any:
        """Check an attribute and return it as float32, or one array for each mesh."""
        raise NotImplementedError

    def _interpolated(self, array: Any, background: float) -> NDArray[np.float32]:
        """The attribute of checked values."""
        raise NotImplementedError

    def _derivatives(self, array: Any) -> NDArray[np.float32]:
        """The derivatives of checked values along x and y, (..., K, 2) or (..., 2) float32."""
        raise NotImplementedError

    @property
    def triangle(self) -> NDArray[np.int32]:
        """Index of the triangle that shows in the pixel, int32 (H, W), -1 where there is none."""
        return self.id

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Where there is a triangle, bool (H, W)."""
        return self.id >= 0

    def _ids(self) -> NDArray[np.int32]:
        return np.require(self.triangle, np.int32, ["C", "A"])

    @overload
    def sample(self, texture: int) -> Any: ...
    @overload
    def sample(
        self,
        texture: object,
        uv: Any,
        *,
        filter: FilterOption = "trilinear",
        wrap: WrapOption | tuple[WrapOption, WrapOption] = "repeat",
        encoding: EncodingOption | None = None,
        background: float = 0.0,
    ) -> NDArray[np.float32]: ...
    def sample(
        self,
        texture: Any,
        uv: Any = None,
        *,
        filter: FilterOption = "trilinear",  # noqa: A002
        wrap: WrapOption | tuple[WrapOption, WrapOption] = "repeat",
        encoding: EncodingOption | None = None,
        background: float = 0.0,
    ) -> Any:
        """Return a texture at each visible pixel; or, of a number alone, the fragments at that sample of each pixel.

        Parameters
        ----------
        texture : Texture, or array_like of real numbers, shape (H, W) or (H, W, C); or int
            Any number of channels. Row 0 is the top, where v = 1; bytes are taken as 0 to 1. A `Texture` has
            its own filter, wrap and encoding. A number without `uv`: the fragments of that sample of several.
        uv : array_like, shape (V, 2) per vertex or (T, 3, 2) per corner; of a scene and of a batch as in `interpolate`
            Where the vertices lie in the texture: u from left to right, v from the bottom up, 0 to 1.
        filter : {"trilinear", "bilinear", "nearest", "pixelated"}
            "trilinear": between texels, and between the two halvings next to the longer side of the pixel's footprint,
            which is that of the analytic derivatives of `uv`.
        wrap : {"repeat", "clamp", "mirror"}, or a pair of them for u and v
            The texture beyond 0 and 1.
        encoding : {"linear", "srgb"}, optional
            "linear", unless given: values are taken as they are. "srgb": the first three channels are decoded
            to linear light.
        background : float
            Value where there is no triangle.

        Returns
        -------
        ndarray of float32, shape (H, W, C), or (H, W) for a texture of shape (H, W); of a batch (B, H, W, C)
            Of a `Texture` linear light and opacity, (H, W, 4), 0 to 1.

        Raises
        ------
        ValueError
            If a shape does not fit or an option is unknown.
        TypeError
            If the texture holds no real numbers.

        References
        ----------
        L. Williams, Pyramidal Parametrics, 1983.

        Examples
        --------
        >>> import topleft as tl
        >>> frags = tl.rasterize([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 2))
        >>> frags.sample([[0.0, 10.0]], [[0, 0], [1, 0], [0, 1]], filter="nearest")
        array([[ 0.,  0., 10.,  0.],
               [ 0.,  0.,  0.,  0.]], dtype=float32)
        """
        if uv is None:
            return self._at_sample(texture)
        levels = as_levels(texture, filter, wrap, encoding)
        ground = as_number("background", background)
        found, slopes = self._places(levels, uv)
        of_pixels = None if slopes is None else slopes.reshape(-1, 2, 2)
        out = levels.look_up(self._ids().reshape(-1), found.reshape(-1, 2), of_pixels, ground)
        return out.reshape(self.id.shape if levels.is_flat else (*self.id.shape, levels.n_channels))

    def _places(self, levels: ValueLevels, uv: Any) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """Return where pixels lie in a texture, and how that changes from one to the next if it has halvings."""
        if len(levels.rows) > 1:
            found, slopes = self.interpolate(uv, derivatives=True)
        else:
            found, slopes = self.interpolate(uv), None
        columns = found.shape[self.id.ndim :]
        if columns != (2,):
            raise ValueError(f"uv must have two columns, (V, 2) or (T, 3, 2), got {columns or 'one'}")
        return found, slopes

    @overload
    def interpolate(
        self, values: Any, *, background: float = 0.0, derivatives: Literal[False] = False
    ) -> NDArray[np.float32]: ...
    @overload
    def interpolate(
        self, values: Any, *, background: float = 0.0, derivatives: Literal[True]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]: ...
    def interpolate(
        self, values: Any, *, background: float = 0.0, derivatives: bool = False
    ) -> NDArray[np.float32] | tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return an attribute of the vertices at each visible pixel, and its derivatives if asked for.

        Parameters
        ----------
        values : array_like of real numbers, shape (V, K) or (V,) per vertex, or (T, 3, K) per corner of each triangle
            Used as float32. Of points (N, K) or (N,); of a scene one array for each instance; of a batch those of all
            poses, or (B, V, K) of each.
        background : float
            Value where there is no triangle.
        derivatives : bool
            Whether to return the derivatives, too.

        Returns
        -------
        ndarray of float32, shape (H, W, K), or (H, W) for values of shape (V,); of a batch (B, H, W, K) or (B, H, W)
            Perspective-correct for clip-space vertices, screen-linear for pixels. With `derivatives` a pair of this and
            (H, W, K, 2), or (H, W, 2): the derivatives along x (to the right) and y (down), per pixel, 0 where there
            is no triangle. They are those of the triangle before the snap, in float64, not differences of pixels.

        Raises
        ------
        ValueError
            If the number of rows is not that of the vertices or triangles, or for derivatives of points or of layers.
        TypeError
            If the values are no real numbers.

        Examples
        --------
        >>> import topleft as tl
        >>> frags = tl.rasterize([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 2))
        >>> frags.interpolate([0.0, 4.0, 0.0])
        array([[0.5, 1.5, 2.5, 0. ],
               [0.5, 1.5, 0. , 0. ]], dtype=float32)
        """
        checked = self._checked(values)
        found = self._interpolated(checked, as_number("background", background))
        return (found, self._derivatives(checked)) if derivatives else found


class Fragments(Attributes):
    """The visibility buffer that `rasterize` returns.

    Attributes are computed on first access, from the `triangles` that were passed in, and for clip space from the
    `vertices` too: do not change those arrays before.

    Attributes
    ----------
    triangle : ndarray of int32, shape (H, W)
        Index of the triangle that shows in the pixel, -1 where there is none.
    depth : ndarray of float32, shape (H, W)
        Depth of that triangle at the pixel's centre; the background's value elsewhere.
    mask : ndarray of bool, shape (H, W)
        Where there is a triangle.
    id, instance : ndarray of int32, shape (H, W)
        Equal to `triangle`, and 0 where there is a triangle: of several instances `SceneFragments` tells more.
    samples_triangle, samples_depth : ndarray of int32 and of float32, shape (H, W, S)
        `triangle` and `depth` of each sample, with several a pixel. `triangle`, `depth`, `mask` and the attributes are
        then of the first sample, which is nearest to the centre; `sample` returns the fragments of another.

    Examples
    --------
    >>> import topleft as tl
    >>> frags = tl.rasterize([(0, 0, 0.0), (4, 0, 1.0), (0, 4, 0.0)], [(0, 1, 2)], (4, 2))
    >>> frags.triangle.tolist()
    [[0, 0, 0, -1], [0, 0, -1, -1]]
    >>> frags.depth[0, :3].tolist()
    [0.125, 0.375, 0.625]
    >>> frags.interpolate([10.0, 20.0, 30.0])[0, 0].tolist()
    13.75
    """

    #: Ids and depth of several samples as drawn, (S, H, W).
    _planes: tuple[NDArray[Any], NDArray[np.float32]] | None = None
    #: The mesh as each of several samples sees it.
    _meshes: Sequence[engine.SnappedMesh | PartOfMesh] = ()
    #: The mesh that it was drawn from; None where that is not kept.
    corners: GivenCorners | None = None
    #: The subject that attributes belong to: "Mesh", "Scene" (one for each instance) or "Points".
    _subject_kind = "Mesh"

    def __init__(
        self,
        triangle: NDArray[np.int32],
        depth: NDArray[np.float32] | float,
        snapped: engine.SnappedMesh | PartOfMesh,
        n_vertices: int,
        n_triangles: int,
    ) -> None:
        self.id = triangle
        self._depth = depth
        self._snapped_or_maker = snapped
        self._n_vertices = n_vertices
        self._n_triangles = n_triangles

    def drawn_from(self, vertices: ArrayLike, triangles: ArrayLike, view: View) -> Self:
        """Keep the arrays that it was drawn from, for derivatives and distances; returns itself."""
        camera = view.transform, view.viewport, view.origin, view.zero_to_one
        self.corners = GivenCorners(vertices, triangles, *camera)
        return self

    @property
    def drawn_planes(self) -> tuple[NDArray[Any], NDArray[np.float32]]:
        """Ids and depth of all samples as they were drawn, (S, H, W)."""
        return self._planes or (self.id[None], self.depth[None])

    def _of_sample(self, k: int, ids: NDArray[Any], depth: NDArray[np.float32]) -> Fragments:
        """Return the fragments of ids and depth (H, W) as drawn, seen from sample k."""
        mesh = self._meshes[k] if self._meshes else self._snapped_or_maker
        frags = Fragments(ids, depth, mesh, self._n_vertices, self._n_triangles)
        frags.corners = self.corners
        return frags

    def _whole(self, ids: NDArray[Any]) -> NDArray[Any]:
        """Return the ids of drawn triangles as `.id` has them: equal, unless a lens cuts triangles into parts."""
        return ids

    @property
    def _visible_meshes(self) -> Sequence[tuple[int, engine.SnappedMesh, int]]:
        """Return each visible mesh as the first sample sees it: its index, the mesh, the id of its triangle 0."""
        return [(0, self._snapped, 0)]

    def _counts(self) -> list[tuple[int, int]]:
        """Vertices and triangles of each mesh that was drawn."""
        return [(self._n_vertices, self._n_triangles)]

    def _parts_of(self, i: int, mesh: Any) -> Any:  # noqa: ARG002
        """Return mesh `i` as it was drawn: itself, unless a lens cuts it."""
        return mesh

    def _buffers(self) -> SampleBuffers:
        """Return the ids and depths of the samples, as drawn."""
        return SampleBuffers.of(*self.drawn_planes)

    def __repr__(self) -> str:
        height, width = self.triangle.shape
        return f"Fragments({width}x{height}, {self._n_triangles} triangles)"

    @property
    def instance(self) -> NDArray[np.int32]:
        """Index of the mesh that shows in the pixel, int32 (H, W): 0, -1 where there is none."""
        return np.minimum(self.id, 0)

    @property
    def depth(self) -> NDArray[np.float32]:
        """Depth of each pixel, float32 (H, W); made now where all triangles lie at 0."""
        if not isinstance(self._depth, np.ndarray):
            self._depth = np.where(self.mask, np.float32(0.0), np.float32(self._depth))
        return self._depth

    @property
    def samples_id(self) -> NDArray[Any]:
        """The ids of `id` at each sample, (H, W, S)."""
        return np.moveaxis(self._whole(self.drawn_planes[0]), 0, -1)

    @property
    def samples_triangle(self) -> NDArray[np.int32]:
        """Indices of triangles by sample, int32 (H, W, S)."""
        return self.samples_id

    @property
    def samples_depth(self) -> NDArray[np.float32]:
        """Depth by sample, float32 (H, W, S)."""
        return np.moveaxis(self.drawn_planes[1], 0, -1)

    @classmethod
    def of_samples(
        cls,
        triangle: NDArray[np.int32],
        depth: NDArray[np.float32],
        meshes: Sequence[engine.SnappedMesh | PartOfMesh],
        n_vertices: int,
        n_triangles: int,
    ) -> Fragments:
        """Return the fragments of several samples: planes (S, H, W), and the mesh as each sample sees it."""
        frags = cls(triangle[0], depth[0], meshes[0], n_vertices, n_triangles)
        frags._planes, frags._meshes = (triangle, depth), meshes
        return frags

    def _at_sample(self, i: object) -> Fragments:
        """Return ids, depth and attributes at one sample of each pixel."""
        ids, depth = self.drawn_planes
        k = as_sample(i, len(ids))
        return self if len(ids) == 1 else self._of_sample(k, ids[k], depth[k])

    def distance(self, camera: Viewer) -> NDArray[np.float32]:
        """Return the distance of each visible pixel along the view ("metric z"), in units of the world.

        Parameters
        ----------
        camera : Camera
            The camera of the picture.

        Returns
        -------
        ndarray of float32, shape (H, W)
            +inf where there is no triangle. Computed from the vertices, not from the depth buffer, so a far plane far
            away costs no digits: the relative error is that of float32.

        Raises
        ------
        ValueError
            If the vertices were not given in the world: pixels, or clip space.

        Examples
        --------
        >>> import topleft as tl
        >>> mesh = tl.Mesh([[0, 0, -3], [1, 0, -3], [0, 1, -3]], [[0, 1, 2]])
        >>> camera = tl.Camera.look_at((0, 0, 0), (0, 0, -1), near=1, far=9)
        >>> tl.rasterize_mesh(mesh, camera, (4, 4)).distance(camera)[1].tolist()
        [inf, inf, 3.0, inf]
        """
        view = view_of(camera)
        if self.corners is None or self.corners.transform is None:
            raise ValueError("distance needs vertices (V, 3) in the world, drawn with transform= or by rasterize_mesh")
        points = np.asarray(as_array("vertices", self.corners.vertices), np.float64)
        return self.interpolate(-(engine.product(points, view[2, :3]) + view[2, 3]), background=np.inf)

    def interpolate_vjp(
        self, values: Any, grad: ArrayLike, *, grad_derivatives: ArrayLike | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return gradients of the values and of the vertices from those of `interpolate`: vector-Jacobian products.

        Parameters
        ----------
        values : array_like
            As in `interpolate`.
        grad : array_like, shape (H, W, K), or (H, W) for values of shape (V,)
            Gradient of some number with respect to the values that `interpolate` returns.
        grad_derivatives : array_like, shape (H, W, K, 2), or (H, W, 2), optional
            Its gradient with respect to the derivatives.

        Returns
        -------
        (ndarray of float64, ndarray of float64)
            Its gradients with respect to the values and to the vertices, in their shapes. The triangle of each pixel
            is constant here: `antialias_vjp` has the gradients of edges. 0 where a value or vertex shows nowhere, and
            for triangles without area.

        Raises
        ------
        ValueError
            If a shape does not fit, or for layers.

        References
        ----------
        S. Laine et al., Modular Primitives for High-Performance Differentiable Rendering, 2020.

        Examples
        --------
        >>> import numpy as np, topleft as tl
        >>> frags = tl.rasterize([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 2))
        >>> by_values, by_vertices = frags.interpolate_vjp([0.0, 4.0, 0.0], np.ones((2, 4)))
        >>> by_values, by_vertices[:, 0]
        (array([2.25 , 1.625, 1.125]), array([-2.25 , -1.625, -1.125]))
        """
        return Backward.of(self).interpolate(self._checked(values), grad, grad_derivatives)

    def sample_vjp(
        self,
        texture: object,
        uv: Any,
        grad: ArrayLike,
        *,
        filter: FilterOption = "trilinear",  # noqa: A002
        wrap: WrapOption = "repeat",
        encoding: EncodingOption | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return gradients of a texture, of uv and of the vertices from those of `sample`: vector-Jacobian products.

        Parameters
        ----------
        texture, uv, filter, wrap, encoding
            As in `sample`; `wrap` is one word, and a `Texture` has the same for u and v.
        grad : array_like, shape (H, W, C), or (H, W) for a texture of shape (H, W)
            Gradient of some number with respect to the values that `sample` returns.

        Returns
        -------
        (ndarray of float64, ndarray of float64, ndarray of float64)
            Its gradients with respect to the values of the texture, to uv and to the vertices, in their shapes. Values
            are those that are looked up: bytes are 0 to 1, a `Texture` and sRGB are linear light.

        Raises
        ------
        ValueError, TypeError
            As in `sample`; for layers, and for a wrap of u that is not that of v.

        References
        ----------
        L. Williams, Pyramidal Parametrics, 1983; S. Laine et al., Modular Primitives for High-Performance
        Differentiable Rendering, 2020.

        Examples
        --------
        >>> import numpy as np, topleft as tl
        >>> frags = tl.rasterize([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 2))
        >>> texture, uv = [[0.0, 10.0]], [[0, 0], [1, 0], [0, 1]]
        >>> frags.sample_vjp(texture, uv, np.ones((2, 4)), filter="nearest")[0]  # one of five looks at the second
        array([[4., 1.]])
        """
        levels = as_levels(texture, filter, wrap, encoding)
        return Backward.of(self).sample(levels, self._checked(uv), *self._places(levels, uv), grad)

    def barycentric_vjp(self, grad: ArrayLike) -> NDArray[np.float64]:
        """Return the gradient of the vertices from that of the weights, (H, W, 3), as `interpolate_vjp` does.

        Examples
        --------
        >>> import numpy as np, topleft as tl
        >>> frags = tl.rasterize([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (1, 1))
        >>> frags.barycentric_vjp([[[0, 1, 0]]])
        array([[-0.1875 ,  0.     ],
               [-0.03125,  0.     ],
               [-0.03125,  0.     ]])
        """
        return Backward.of(self).weights(grad)

    def depth_vjp(self, grad: ArrayLike) -> NDArray[np.float64]:
        """Return the gradient of the vertices from that of `depth`, (H, W), as `interpolate_vjp` does.

        Examples
        --------
        >>> import topleft as tl
        >>> frags = tl.rasterize([[0, 0, 0.0], [4, 0, 1.0], [0, 4, 0.0]], [[0, 1, 2]], (1, 1))
        >>> frags.depth_vjp([[1.0]])[:, 2]  # the weights of the corners
        array([0.75 , 0.125, 0.125])
        """
        return Backward.of(self).depth(grad)

    def antialias(self, picture: ArrayLike, *, edges: EdgesOption = "area") -> NDArray[Any]:
        """Return the picture with smooth silhouettes.

        Parameters
        ----------
        picture : array_like of real numbers, shape (H, W, C) or (H, W)
            A colour, or numbers, for each pixel.
        edges : {"area", "silhouette", "straight-through"}
            "area": where a surface ends or folds, pixels take the exact share of their square that lies on the other
            side. "silhouette": the rule of nvdiffrast. "straight-through": the picture as it is.

        Returns
        -------
        ndarray of float64, or float32 for float32, shape of `picture`
            Pixels beside an edge are blended with their neighbour beyond it.

        Raises
        ------
        ValueError
            If the shape does not fit, the option is unknown, or for layers.

        Examples
        --------
        >>> import topleft as tl
        >>> frags = tl.rasterize([[0, -4], [2.25, -4], [2.25, 8], [0, 8]], [[0, 1, 2], [0, 2, 3]], (4, 1))
        >>> frags.antialias(frags.mask)
        array([[1.  , 1.  , 0.25, 0.  ]])
        """
        return Backward.of(self).smooth(picture, edges)

    def antialias_vjp(
        self, picture: ArrayLike, grad: ArrayLike, *, edges: EdgesOption = "area"
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return gradients of the picture and of the vertices from those of `antialias`: vector-Jacobian products.

        Parameters
        ----------
        picture, edges
            As in `antialias`.
        grad : array_like, shape of `picture`
            Gradient of some number with respect to the picture that `antialias` returns.

        Returns
        -------
        (ndarray of float64, ndarray of float64)
            Its gradients with respect to the picture and to the vertices, in their shapes.

        Raises
        ------
        ValueError
            As in `antialias`.

        Examples
        --------
        >>> import numpy as np, topleft as tl
        >>> frags = tl.rasterize([[0, -4], [2.25, -4], [2.25, 8], [0, 8]], [[0, 1, 2], [0, 2, 3]], (4, 1))
        >>> by_picture, by_vertices = frags.antialias_vjp(frags.mask, np.ones((1, 4)))
        >>> by_vertices[:, 0].sum().tolist()  # one more pixel is covered for each that the right edge moves
        1.0
        """
        return Backward.of(self).smooth_vjp(picture, grad, edges)

    def only(self, rows: NDArray[np.intp], cols: NDArray[np.intp]) -> Fragments:
        """Return the fragments with background in all pixels but these."""
        rows, cols = as_places(rows, cols, self.id.shape)
        drawn = self._buffers().ids[0]
        ids = np.full_like(drawn, -1)
        ids[rows, cols] = drawn[rows, cols]
        return self._of_sample(0, ids, self.depth)

    def barycentric(self) -> NDArray[np.float32]:
        """Return the weights of the three vertices of the triangle that shows in each pixel.

        Returns
        -------
        ndarray of float32, shape (H, W, 3)
            In the order of the triangle's row in `triangles`; they sum to 1. 0 where there is no triangle.
            Perspective-correct for clip-space vertices, screen-linear for pixels.

        Notes
        -----
        The weights come from the exact edge functions of the snapped triangle, so none is below 0 and the rounding of
        float32 is the only error, 2**-23 at most; for triangles cut by a clip plane 2**-21.

        References
        ----------
        J. F. Blinn, Hyperbolic Interpolation, 1992.

        Examples
        --------
        >>> import topleft as tl
        >>> frags = tl.rasterize([[0, 0], [2, 0], [0, 2]], [[0, 1, 2]], (2, 2))
        >>> frags.barycentric()[0, 0]
        array([0.5 , 0.25, 0.25], dtype=float32)
        """
        out = empty((*self.triangle.shape, 3), np.float32)
        self._snapped.with_inverse_w(self.id.size, empty).barycentric(self._ids(), out)
        return out

    def _checked(self, values: Any) -> Any:
        """Check an attribute and return it as float32."""
        return as_values(values, self._n_vertices, self._n_triangles)

    def _interpolated(self, array: NDArray[np.float32], background: float) -> NDArray[np.float32]:
        """The attribute of checked values."""
        channels = array.shape[-1] if array.ndim > 1 else 1
        out: NDArray[Any] = empty((*self.triangle.shape, channels), np.float32)
        rows = array.reshape(-1, channels) if array.size else np.empty((0, channels), np.float32)
        snapped = self._snapped.with_inverse_w(self.id.size, empty)
        snapped.interpolate(self._ids(), rows, array.ndim == 3, background, out)
        return out if array.ndim > 1 else out[..., 0]

    def _derivatives(self, array: NDArray[np.float32]) -> NDArray[np.float32]:
        """The derivatives of checked values along x and y, (H, W, K, 2) or (H, W, 2) float32."""
        if self.corners is None:
            raise ValueError("derivatives are those of rasterize and rasterize_mesh, not of layers")
        channels = array.shape[-1] if array.ndim > 1 else 1
        out = np.empty((*self.triangle.shape, channels, 2), np.float32)
        ids = np.maximum(self._ids().reshape(-1), -1)  # a copy: nobody else changes it after the check
        is_seen = np.zeros(self._n_triangles + 1, np.bool_)
        if ids.size and ids.max() >= self._n_triangles:  # the caller has written into them
            raise IndexError(f"triangle must hold ids below {self._n_triangles}, got {ids.max()}")
        is_seen[ids] = True  # the last, too, by -1
        seen = np.flatnonzero(is_seen[:-1]).astype(np.int32)
        slot = np.empty(self._n_triangles, np.int32)
        slot[seen] = np.arange(len(seen), dtype=np.int32)
        if array.ndim == 3:
            rows = (3 * seen[:, None] + np.arange(3)).astype(np.int32)
        else:
            rows = as_checked_triangles(as_array("triangles", self.corners.triangles)[seen], len(array))
        engine.fill_slopes(
            ids, self.barycentric().reshape(-1, 3), slot, self.corners.steps(seen), rows,
            array.reshape(-1, channels) if array.size else np.empty((0, channels), np.float32),
            out.reshape(-1, channels, 2),
        )  # fmt: skip
        return out if array.ndim > 1 else out[..., 0, :]

    @cached_property
    def _snapped(self) -> engine.SnappedMesh:
        """The triangles that show, snapped; maybe the others too."""
        return self._snapped_with()

    def _snapped_with(self, *triangles: NDArray[np.int32]) -> engine.SnappedMesh:
        """Return the triangles that show and these, snapped; maybe the others too."""
        if isinstance(self._snapped_or_maker, engine.SnappedMesh):
            return self._snapped_or_maker
        return self._snapped_or_maker(self.id, *triangles)


def as_sample(i: object, n: int) -> int:
    """Return the index of a sample, of n; -1 is the last."""
    if not isinstance(i, int | np.integer):
        raise TypeError(f"sample takes the number of a sample, or a texture and uv, got {shown(i)} alone")
    if not -n <= i < n:
        raise IndexError(f"the number of a sample must lie in 0 to {n - 1}, got {i}")
    return int(i) % n


def view_of(camera: object) -> NDArray[np.float64]:
    """Return eye from world, (4, 4), of a camera."""
    view = getattr(camera, "view", None)
    if not isinstance(view, np.ndarray) or view.shape != (4, 4):
        raise TypeError(f"camera must be a Camera, got {shown(camera)}")
    return view
