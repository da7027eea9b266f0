# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False, embedsignature=False
# cython: freethreading_compatible=True
# cython: auto_pickle=False, emit_code_comments=False, annotation_typing=False
"""Each function takes memoryviews, calls a kernel and returns its status. Callers check every shape, dtype and index.

`csrc/kernels.h` describes the kernels: a docstring names its kernel, and adds what an array of NumPy has beyond it.
"""

from libc.stdint cimport int8_t, int16_t, int32_t, int64_t, uint8_t, uint16_t, uint32_t, uint64_t
from cpython.buffer cimport PyBUF_SIMPLE, PyBUF_STRIDED_RO, PyBuffer_Release, PyObject_GetBuffer
from libc.math cimport INFINITY, NAN, frexp, isinf, isnan, ldexp, rint, sqrt
from libc.string cimport memcpy, memset

import numpy as np

include "contract.pxi"  # the declarations of csrc's headers: packaging/bindings.py makes it

# The kernels of each instruction set that was used, and of the set in use. Scalar until `isa.py` has chosen: never NULL.
cdef tl_kernels tables[TL_N_ISA]
cdef const tl_kernels *K = &tables[TL_ISA_SCALAR]
cdef str isa_name = "scalar"
tl_set_kernels(b"scalar", &tables[TL_ISA_SCALAR])


def use_isa(name: str) -> None:
    """Run all further calls on the kernels of an available instruction set."""
    global K, isa_name
    if name not in isa_available():
        raise ValueError(f"instruction set must be one of {', '.join(isa_available())}, got {name!r}")
    cdef tl_kernels *table = &tables[isa_built().index(name)]
    tl_set_kernels(name.encode(), table)
    K, isa_name = table, name


def isa_in_use() -> str:
    """Return the name of the instruction set that the kernels in use were compiled for."""
    return isa_name


def isa_built() -> list[str]:
    """Return the instruction sets in this binary, the plainest first."""
    return [tl_isa_name(i).decode() for i in range(TL_N_ISA) if tl_isa_built(i)]


def isa_available() -> list[str]:
    """Return the instruction sets in this binary that this machine can run, the plainest first."""
    return [tl_isa_name(i).decode() for i in range(TL_N_ISA) if tl_isa_built(i) and tl_isa_runs(i)]


def isa_missing() -> list[str]:
    """Return the instruction sets that this machine can run, wider than those available, that this binary lacks."""
    widest = max(i for i in range(TL_N_ISA) if tl_isa_built(i) and tl_isa_runs(i))
    return [tl_isa_name(i).decode() for i in range(widest + 1, TL_N_ISA) if tl_isa_runs(i)]


def compiler_info() -> dict[str, object]:
    """Return how this binary was built: version, compiler, flags of each unit."""
    return {
        "version": tl_version().decode(),
        "compiler": tl_compiler().decode().strip(),
        "flags": {tl_isa_name(i).decode(): tl_isa_flags(i).decode() for i in range(TL_N_ISA) if tl_isa_built(i)},
    }

cdef enum:
    LABEL = 2  # TL_SINK_LABEL

# Less work than this keeps the GIL: to release and retake it costs 50 us and more while other threads run Python.
# Kernels that threads run in parallel on parts of a picture always release it.
cdef enum:
    HELD_VERTICES = 1 << 15
    HELD_PX = 1 << 14  # shaded pixels
    HELD_DRAWN_PX = 1 << 24  # if each triangle covered the whole window

VERTEX_BYTES = sizeof(tl_vertex)
PLACED = TL_PLACED  # numbers of a transformed vertex that is not snapped
CELL_CLEAR = TL_CELL_CLEAR
AREA_OVERFLOW = TL_AREA_OVERFLOW
MAX_LAYERS = TL_MAX_LAYERS
LENS_RINGS = TL_LENS_RINGS
SCALARS: dict[np.dtype[Any], int] = {np.dtype(np.float32): 0, np.dtype(np.float64): 1, np.dtype(np.int64): 2}  # tl_scalar


cdef inline const void *data(const uint8_t[::1] view) noexcept nogil:
    return &view[0] if view is not None and view.shape[0] > 0 else NULL


def area_stride(int64_t width) -> int:
    """Return how many cells `SnappedMesh.draw_area` needs for a row of pixels."""
    return tl_area_stride(width)


def blend_cells(int64_t width) -> int:
    """Return how many cells `SnappedMesh.blend` needs for areas."""
    return tl_blend_cells(width)


def as_bytes(array: Array) -> U8:
    """Return the memory of a contiguous array as a flat uint8 view."""
    return array.reshape(-1).view(np.uint8)


include "pause.pxi"
include "blocks.pxi"
include "buffers.pxi"
include "exact.pxi"
include "triangles.pxi"
include "instances.pxi"
include "clusters.pxi"
include "pixels.pxi"
include "rle.pxi"
include "matrices.pxi"
include "shade.pxi"
include "detail.pxi"
include "lens.pxi"
include "mesh.pxi"
include "polygons.pxi"
include "tiles.pxi"
include "gradients.pxi"
include "grid.pxi"
