"""Keeps values computed of a mesh for its next pictures.

Input: values that pictures make of a mesh, or of a mesh in a material. Output: `MeshCache`, with a field for each kind.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, TypeVar
from weakref import WeakSet

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:  # types of the fields alone: pictures fill them
    from topleft._meshes.model.material import Material
    from topleft._meshes.picture.holes import Cut
    from topleft._meshes.picture.look import ShadingMesh, Surface
    from topleft._meshes.picture.render import PictureOptions

Value = TypeVar("Value")

MOST_LOOKS = 256
"""Values of one kind that are kept of a mesh or a scene: instances differ in material, and in how they are lit."""


class ByMaterial(dict[tuple[Hashable, ...], tuple[Value, "Material | None"]]):
    """Values of one kind by the material, `MOST_LOOKS` at most: all go when another one comes.

    Two threads may compute a value at once; all of them take that of the first to end.
    """

    def find(self, material: Material | None, make: Callable[[], Value], *key: Hashable) -> Value:
        """Return the value of a material and a key, computed at the first call."""
        found = self.get((id(material), *key))
        if found is None:
            made = make(), material  # the material keeps its id while the value is kept
            if len(self) >= MOST_LOOKS:
                self.clear()
            found = self.setdefault((id(material), *key), made)
        return found[0]


class MeshCache:
    """Values computed of one mesh for its next pictures: they go with the mesh, and no copy or pickle has them.

    Memory, for V vertices and T triangles: `shading` takes 16 V bytes of normals, as many of colours, and 17 T of faces
    where they are flat or their normals disagree; each of `stretched` also 12 or 24 V of positions. `cuts` and
    `blended` take a byte per triangle and material; the rest less than a kilobyte each. Threads share it: a field is
    read and set at once, and a value that two threads compute is equal.
    """

    def __init__(self) -> None:
        self.n_drawn = 0
        """Pictures that `Mesh.note_drawn` has counted."""
        self.shading: ShadingMesh | None = None
        """The mesh as shading kernels read it."""
        self.stretched: dict[bytes, ShadingMesh] = {}
        """Stretched copies by the bytes of their matrix; all go where they pass `MOST_STRETCHED` vertices."""
        self.pictures: dict[tuple[Hashable, ...], PictureOptions] = {}
        """Checked options of pictures of the mesh alone, `MOST_KEPT` at most."""
        self.surfaces: ByMaterial[Surface] = ByMaterial()
        self.cuts: ByMaterial[Cut | None] = ByMaterial()
        """The materials with holes and their triangles."""
        self.blended: ByMaterial[npt.NDArray[np.bool_] | None] = ByMaterial()
        """Which triangles blend with what lies behind them."""
        self.checked_cameras: WeakSet[object] = WeakSet()
        """Cameras whose planes were compared with the mesh."""
