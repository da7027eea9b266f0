# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False, embedsignature=False
"""Memoryviews in, one nogil kernel call, status out. The array layer has checked every shape, dtype and index."""

from libc.stdint cimport int32_t, int64_t, uint8_t, uint16_t, uint32_t, uint64_t
from libc.math cimport sqrt
from libc.string cimport memset

import numpy as np

include "contract.pxi"
include "dispatch.pxi"

cdef enum:
    LABEL = 2  # TL_SINK_LABEL

VERTEX_BYTES = sizeof(tl_vertex)
CELL_CLEAR = TL_CELL_CLEAR
AREA_OVERFLOW = TL_AREA_OVERFLOW
MAX_LAYERS = TL_MAX_LAYERS
SCALARS = {np.dtype(np.float32): 0, np.dtype(np.float64): 1, np.dtype(np.int64): 2}  # tl_scalar


cdef inline const void *data(const uint8_t[::1] view) noexcept nogil:
    return &view[0] if view is not None and view.shape[0] > 0 else NULL


def area_stride(int64_t width):
    """Return how many cells `Scene.draw_area` needs for a row of pixels."""
    return tl_area_stride(width)


def blend_cells(int64_t width):
    """Return how many cells `Scene.blend` needs for areas."""
    return tl_blend_cells(width)


def as_bytes(array):
    """Return the memory of a contiguous array as a flat uint8 view."""
    return array.reshape(-1).view(np.uint8)


include "inputs.pxi"
include "scene.pxi"
include "bands.pxi"
include "clusters.pxi"
include "means.pxi"
include "lines.pxi"
include "shade.pxi"
include "faces.pxi"
include "planes.pxi"
include "nearest.pxi"
include "points.pxi"
