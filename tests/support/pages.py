"""Arrays between pages that must not be touched: a stray access ends the process."""

import ctypes
import mmap
from functools import cache

import numpy as np


@cache
def protect():
    """The function of the system, found once: arrays come by the ten thousand."""
    return ctypes.CDLL(None).mprotect


def between_pages(array, start):
    """A copy that starts at a place in whole pages of its own, with inaccessible pages on both sides."""
    page, n_bytes = mmap.PAGESIZE, size_in_pages(array)
    memory = mmap.mmap(-1, n_bytes + 2 * page)
    address = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    for first in (address, address + page + n_bytes):
        assert protect()(ctypes.c_void_p(first), ctypes.c_size_t(page), 0) == 0
    copy = np.frombuffer(memory, array.dtype, array.size, page + start).reshape(array.shape)
    copy[...] = array
    return copy


def size_in_pages(array):
    return -(-array.nbytes // mmap.PAGESIZE) * mmap.PAGESIZE


def before_a_page(array):
    """A copy that ends where an inaccessible page begins."""
    return between_pages(array, size_in_pages(array) - array.nbytes)


def behind_a_page(array):
    """A copy that begins where an inaccessible page ends."""
    return between_pages(array, 0)
