# Caches the memory of freed arrays for new arrays. Where Python has no GIL, the critical sections of the list guard
# its counters, too.

from cpython.object cimport PyObject
cimport cython

cdef enum:
    BLOCK_ALIGN = 64  # a cache line, and the longest vector
    MAX_BLOCKS = 256  # in the cache: each request searches all of them

cdef list cached_blocks = []  # least recently used first
cdef int64_t cached_bytes = 0
cdef int64_t max_cached_bytes = 0


@cython.no_gc
cdef class Block:
    """Memory that one array uses at a time."""

    cdef object owner  # an array of bytes
    cdef uint8_t *start
    cdef int64_t n_bytes


@cython.no_gc
cdef class Lease:
    """A block that an array and its views use: when the last of them is freed, the block is cached."""

    cdef Block block
    cdef Py_ssize_t n_bytes

    def __getbuffer__(self, Py_buffer *view, int flags):
        view.buf, view.len, view.obj = self.block.start, self.n_bytes, self
        view.itemsize, view.readonly, view.ndim = 1, 0, 1
        view.format, view.shape, view.strides = NULL, &self.n_bytes, &view.itemsize
        view.suboffsets, view.internal = NULL, NULL

    def __dealloc__(self):
        if self.block is not None:
            keep_block(self.block)


cdef void keep_block(Block block) noexcept:
    """Cache a block; where the cache is full, free the least recently used blocks."""
    global cached_bytes
    with cython.critical_section(cached_blocks):
        if block.n_bytes <= max_cached_bytes:
            cached_blocks.append(block)
            cached_bytes += block.n_bytes
            drop_blocks(max_cached_bytes)


cdef void drop_blocks(int64_t n_bytes) noexcept:
    """Free cached blocks until at most `n_bytes` are left; the caller holds the lock of the list."""
    global cached_bytes
    while cached_bytes > n_bytes or len(cached_blocks) > MAX_BLOCKS:
        cached_bytes -= (<Block>cached_blocks[0]).n_bytes
        del cached_blocks[0]


cdef Block find_block(int64_t n_bytes):
    """Take the smallest cached block of at least `n_bytes` from the cache; None where all are smaller or much larger."""
    global cached_bytes
    cdef int64_t i, best = -1, n_left = 0
    cdef int64_t most_left = n_bytes // 4 + (2 << 20 if n_bytes >= 4 << 20 else 0)
    cdef Block block = None
    with cython.critical_section(cached_blocks):
        for i in range(<int64_t>len(cached_blocks) - 1, -1, -1):
            n_left = (<Block>cached_blocks[i]).n_bytes - n_bytes
            if 0 <= n_left <= most_left:
                best, most_left = i, n_left - 1
                if n_left == 0:
                    break
        if best >= 0:
            block = cached_blocks.pop(best)
            cached_bytes -= block.n_bytes
    return block


def lease_block(int64_t n_bytes, allocate: Callable[[int], U8]) -> memoryview:
    """Return memory for an array: a cached block, or `allocate(n_bytes)`; it is cached when the array is freed."""
    cdef Lease lease
    cdef Block block = find_block(n_bytes)
    cdef uint8_t[::1] raw
    if block is None:
        block = Block.__new__(Block)
        raw = block.owner = allocate(n_bytes)
        block.start, block.n_bytes = &raw[0], raw.shape[0]
    lease = Lease.__new__(Lease)
    lease.block, lease.n_bytes = block, n_bytes
    return lease


def keep_blocks(int64_t n_bytes):
    """Cache at most `n_bytes` of memory from now on; free what is cached beyond."""
    global max_cached_bytes
    with cython.critical_section(cached_blocks):
        max_cached_bytes = n_bytes
        drop_blocks(n_bytes)


def waiting_memory() -> int:
    """Return how many bytes are cached."""
    return cached_bytes
