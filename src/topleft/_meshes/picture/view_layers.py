"""Draws layers for vision, as named arrays in one call: depth, normals, positions, ids, flow and more.

Input: `Mesh` or `Scene`, `Camera`, names. Output: `ViewLayers`, arrays by name; nothing else is computed.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal, Unpack

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import F64, Array, MeshLike
from topleft._core.base.arrays import as_real, shown
from topleft._core.base.color import ColorLike
from topleft._core.base.defaults import DEFAULT_SIZE
from topleft._core.base.options import LAYER_NAMES, check_layers
from topleft._core.base.remote import Location
from topleft._core.polygons.rle import to_rle
from topleft._core.raster.verbs import Rasterizer
from topleft._meshes.camera.camera import CameraLike, as_camera
from topleft._meshes.io.layer_files import save_layers
from topleft._meshes.model.points import Points
from topleft._meshes.picture.cloud import CloudShot
from topleft._meshes.picture.layers import CloudLayers, Layers, MeshLayers
from topleft._meshes.picture.shade import LookOptions
from topleft._meshes.picture.shot import Shot
from topleft._meshes.scene.scene import Scene
from topleft.typing import CullOption, LayerOption, SamplesOption, ShadingOption

LOOKS = frozenset({"shading", "color", "background", "edges", "sampling", *LookOptions.__annotations__})
GLASS_LOOKS = frozenset({"shading", "color", "background", "opacity", "layers", *LookOptions.__annotations__})
"""Options of `render` and of `render_transparent` that are for colours alone, and `sampling`."""


class ViewLayers(Mapping[str, Array]):
    """Named arrays of one view, in the given order: the result of `render_layers`.

    Examples
    --------
    >>> import topleft as tl
    >>> ball = tl.Mesh(*tl.scenes.icosphere(2))
    >>> views = tl.render_layers(ball, tl.Camera.framing(ball), (32, 24), layers=["depth", "world_normal"])
    >>> {name: array.shape for name, array in views.items()}
    {'depth': (24, 32), 'world_normal': (24, 32, 3)}
    """

    def __init__(self, arrays: Mapping[str, Array], n_instances: int | None = None) -> None:
        self._arrays = dict(arrays)
        self._n_instances = n_instances

    def __getitem__(self, name: str) -> Array:
        if name not in self._arrays:
            raise KeyError(f"layers drawn are {', '.join(self._arrays)}, got {name!r}")
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __repr__(self) -> str:
        return f"ViewLayers({', '.join(f'{name} {array.shape} {array.dtype}' for name, array in self.items())})"

    def save(
        self, path: str | os.PathLike[str], layer: str | None = None, *, depth_scale: float = 0.001
    ) -> tuple[Location, ...]:
        """Write the layers, or one of them, and return the files.

        Parameters
        ----------
        path : path or URL
            `.npz` and `.npy` hold arrays as they are, `.tif` float32 or int32, `.png` whole numbers of 16 bits with 0
            where nothing is: ids plus 1, distances in steps. `{layer}` in the name stands for the name of the layer.
        layer : str, optional
            This one alone.
        depth_scale : float
            Units of a step of distances in PNG: 0.001 writes millimetres where units are metres.

        Raises
        ------
        ValueError
            If there is no such layer; and as `save_layers` does.
        """
        return save_layers(path, self if layer is None else {layer: self._named(layer)}, depth_scale=depth_scale)

    def rle(
        self, layer: LayerOption = "instance", *, labels: npt.ArrayLike | None = None, compressed: bool = True
    ) -> Any:
        """Run lengths of a layer as `to_rle` returns them, in the format of COCO.

        Parameters
        ----------
        layer : {"instance", "silhouette", "triangle"}
            "instance": a list with one for each instance of the scene, those that do not show too. "silhouette": one,
            unless it holds shares. "triangle": needs `labels`.
        labels : array_like (N,) of int, optional
            Only these numbers.
        compressed : bool
            As for `to_rle`.

        Raises
        ------
        ValueError
            If there is no such layer, and as `to_rle` does.
        TypeError
            If the layer is neither a mask nor ids, or has ids and there are no labels.

        Examples
        --------
        >>> import topleft as tl
        >>> view = tl.render_layers(tl.Mesh(*tl.scenes.shape("cube")), size=(8, 6), layers="instance")
        >>> view.rle("instance", compressed=False)[0]["counts"][:4]
        [13, 4, 2, 4]
        """
        found = self._named(layer)
        if layer == "instance" and labels is None and self._n_instances is not None:
            labels = np.arange(self._n_instances)
        return to_rle(found, labels=labels, compressed=compressed)

    def _named(self, layer: str) -> Array:
        if not (isinstance(layer, str) and layer in self):
            raise ValueError(f"layer must be one of {', '.join(self)}, got {layer!r}")
        return self[layer]


class LayerLookOptions(LookOptions, total=False):
    """The options of `render` and `render_transparent` that `render_layers` passes on."""

    shading: ShadingOption
    color: ColorLike
    background: ColorLike
    edges: bool
    sampling: SamplesOption
    opacity: float


def render_layers(
    mesh: MeshLike | Scene | Points,
    camera: CameraLike | None = None,
    size: int | tuple[int, int] = DEFAULT_SIZE,
    *,
    layers: LayerOption | str | Iterable[LayerOption | str] = ("color", "depth"),
    attributes: Mapping[str, Any] | None = None,
    camera_to: CameraLike | None = None,
    transforms_to: npt.ArrayLike | None = None,
    cull: CullOption | None = None,
    subpixel_bits: int | Literal["exact"] = 8,
    tolerance: float = 0.0,
    threads: int | None = None,
    rasterizer: Rasterizer | None = None,
    **look: Unpack[LayerLookOptions],
) -> ViewLayers:
    """Layers of one view by name: depth, normals, positions, ids and flow beside the colours.

    Parameters
    ----------
    mesh : Mesh, Scene, Points, or whatever `as_mesh` takes
        The subject.
    camera : Camera, optional
        Unless given, the three-quarter view of `Camera.framing`, with y up.
    size : (width, height), pixels
        640 x 480 unless given.
    layers : str or iterable of str
        Names of the table below; only these are computed.
    attributes : mapping of str to array_like, optional
        Further layers: values of the vertices (V, K) or (V,), or of the corners (T, 3, K); of a scene a sequence of
        such arrays, one of each instance.
    camera_to : Camera, optional
        For "flow": the camera at its end; the same one unless given.
    transforms_to : (N, 4, 4) array_like, optional
        For "flow": where the instances of the scene are at its end, world from object; (4, 4) for a mesh. Unless
        given they stay.
    cull, subpixel_bits, tolerance, threads
        As for `render`, of every layer. With a tolerance, "triangle" counts those of the level of detail, and there are
        no attributes.
    rasterizer : Rasterizer, optional
        Of this size: "depth" and "triangle" lie in its memory, until the next call.
    **look
        Further options of `render`, for "color"; with `opacity` those of `render_transparent`. `sampling` also holds
        for "alpha" and "silhouette"; every other layer is taken at the centres of the pixels.

    Returns
    -------
    ViewLayers
        Arrays by name, in the given order, the attributes last:

        ============== ============== ========== =================================================================
        name           shape, dtype   background content
        ============== ============== ========== =================================================================
        color          (H, W, 4) u8   as given   the picture of `render`
        alpha          (H, W) u8      0          how much of the pixel is covered, of 255
        silhouette     (H, W) bool    False      where the mesh is; with several samples their share, float32
        depth          (H, W) f32     +inf       window depth, 0 near to 1 far, or as `Camera.has_planes` says
        distance       (H, W) f32     +inf       along the view, world units ("metric z")
        ray_distance   (H, W) f32     +inf       from the eye; without perspective the same as distance
        triangle       (H, W) i32     -1         index of the triangle in its mesh
        instance       (H, W) i32     -1         index of the instance, 0 for a mesh
        barycentric    (H, W, 3) f32  0          weights of the triangle's vertices
        world_position (H, W, 3) f32  NaN        the point of the surface
        world_normal   (H, W, 3) f32  0          unit, interpolated from the vertices, on the side that is seen
        camera_normal  (H, W, 3) f32  0          the same in eye space: x right, y up, z to the viewer
        uv             (H, W, 2) f32  NaN        texture coordinates, of meshes that have them
        flow           (H, W, 2) f32  NaN        where the point moves to, pixels (dx, dy), y down; NaN too
                                                 if it ends behind the camera
        attributes     as given, f32  NaN        interpolated
        ============== ============== ========== =================================================================

    Raises
    ------
    ValueError
        If there is no such layer, an attribute has its name or does not fit, "flow" has no end, "uv" finds no texture
        coordinates, an option of `render` is wrong, or there are attributes and a tolerance.
    TypeError
        If an option is unknown, or of colours and "color" is no layer.

    Notes
    -----
    The point of a pixel lies on its triangle and projects to within half a sub-pixel of the centre in x and y, 2**-9
    pixels at 8 bits, as far as the snap moves a vertex; float32 then rounds it. Flow is the difference of its
    two projections in float64, so points that do not move have flow 0, to the bit.

    All layers show the mesh or scene without the holes of its materials. Of `Points` "triangle" is the index of the
    point, and positions, distances and normals are those of its centre all over it; there are no "barycentric" and no
    "uv", and attributes are of the points.

    Through a lens a point projects to within its `tolerance_px` and half a sub-pixel of the centre. "distance" is along
    the axis, also through a fisheye; its "depth" is that of the distance from the eye.

    Examples
    --------
    >>> import topleft as tl
    >>> found = tl.render_layers(tl.Mesh(*tl.scenes.shape("cube")), size=(8, 6), layers=("distance", "triangle"))
    >>> found
    ViewLayers(distance (6, 8) float32, triangle (6, 8) int32)
    >>> found["triangle"][3]
    array([-1, -1, 11, 10, 10,  3, -1, -1], dtype=int32)
    """
    names = check_layers(layers)
    for option in look.keys() - {"sampling"} if "color" not in names else ():
        raise TypeError(f"option {option!r} is for layer 'color', which is not among {', '.join(names)}")
    if not isinstance(attributes, Mapping | None):
        raise TypeError(f"attributes must map names to values, got {shown(attributes)}")
    if attributes and tolerance:
        raise ValueError("attributes are those of the mesh's own vertices, which a tolerance may leave out")
    view = layers_of(
        mesh, camera, size, camera_to=camera_to, transforms_to=transforms_to, cull=cull,
        subpixel_bits=subpixel_bits, tolerance=tolerance, threads=threads, rasterizer=rasterizer, **look,
    )  # fmt: skip
    found = view.draw(names)
    for name, values in (attributes or {}).items():
        if name in LAYER_NAMES:
            raise ValueError(f"attributes must not have the name of a layer, got {name!r}")
        found[name] = view.frags.interpolate(values, background=np.nan)
    return ViewLayers(found, view.n_instances)


def layers_of(
    mesh: MeshLike | Scene | Points,
    camera: CameraLike | None,
    size: int | tuple[int, int],
    *,
    camera_to: CameraLike | None = None,
    transforms_to: npt.ArrayLike | None = None,
    cull: CullOption | None = None,
    subpixel_bits: int | Literal["exact"] = 8,
    tolerance: float = 0.0,
    threads: int | None = None,
    rasterizer: Rasterizer | None = None,
    **look: Any,
) -> Layers:
    """Return the layers of a view, which are drawn by name; arguments and errors as for `render_layers`."""
    for option in sorted(look.keys() - (GLASS_LOOKS if "opacity" in look else LOOKS)):
        raise TypeError(f"there is no option {option!r} of a picture")
    options: dict[str, Any] = {"cull": cull, "subpixel_bits": subpixel_bits, "threads": threads}
    shot = Shot.of(mesh, camera, size)
    end = None if camera_to is None else as_camera(camera_to, "camera_to")
    if isinstance(shot, CloudShot):
        return CloudLayers(shot, options, look, end, as_transforms(transforms_to, 1), rasterizer)
    shot = shot.within(tolerance, cull=cull, material=look.get("material"))
    return MeshLayers(shot, options, look, end, as_transforms(transforms_to, len(shot.scene)), rasterizer)


def as_transforms(transforms: npt.ArrayLike | None, n: int) -> F64 | None:
    """Return a matrix for each instance, (N, 4, 4) float64; None of none."""
    if transforms is None:
        return None
    array = as_real("transforms_to", transforms)
    if n == 1 and array.shape == (4, 4):
        array = array[None]
    if array.shape != (n, 4, 4):
        raise ValueError(f"transforms_to must have shape ({n}, 4, 4), got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError("transforms_to must hold finite numbers")
    if not (array[:, 3] == [0, 0, 0, 1]).all():
        raise ValueError("the last row of each of transforms_to must be [0, 0, 0, 1]")
    return array
