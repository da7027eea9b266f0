# Keeps the memory of arrays that have died, for arrays to come. Where Python has no GIL, the critical sections of the
# list hold its numbers, too.

from cpython.object cimport PyObject
cimport cython

cdef enum:
    BLOCK_ALIGN = 64  # a cache line, and the longest vector
    MAX_BLOCKS = 256  # that wait at a time: each request looks at all of them

cdef list waiting_blocks = []  # longest without use first
cdef int64_t waiting_bytes = 0
cdef int64_t most_waiting_bytes = 0


@cython.no_gc
cdef class Block:
    """Memory that is given to one array at a time."""

    cdef object owner  # an array of bytes
    cdef uint8_t *start
    cdef int64_t n_bytes


@cython.no_gc
cdef class Lease:
    """A block in the hands of one array and its views: when the last of them dies, the block waits for another."""

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
    """Let a block wait; those that have waited longest go back to the system where there are too many."""
    global waiting_bytes
    with cython.critical_section(waiting_blocks):
        if block.n_bytes <= most_waiting_bytes:
            waiting_blocks.append(block)
            waiting_bytes += block.n_bytes
            drop_blocks(most_waiting_bytes)


cdef void drop_blocks(int64_t n_bytes) noexcept:
    """Give back waiting blocks beyond so many bytes; the caller has the list for itself."""
    global waiting_bytes
    while waiting_bytes > n_bytes or len(waiting_blocks) > MAX_BLOCKS:
        waiting_bytes -= (<Block>waiting_blocks[0]).n_bytes
        del waiting_blocks[0]


cdef Block find_block(int64_t n_bytes):
    """The smallest block that waits and has room for so much, unless much of it would be left; None if there is none."""
    global waiting_bytes
    cdef int64_t i, best = -1, n_left = 0
    cdef int64_t most_left = n_bytes // 4 + (2 << 20 if n_bytes >= 4 << 20 else 0)
    cdef Block block = None
    with cython.critical_section(waiting_blocks):
        for i in range(<int64_t>len(waiting_blocks) - 1, -1, -1):
            n_left = (<Block>waiting_blocks[i]).n_bytes - n_bytes
            if 0 <= n_left <= most_left:
                best, most_left = i, n_left - 1
                if n_left == 0:
                    break
        if best >= 0:
            block = waiting_blocks.pop(best)
            waiting_bytes -= block.n_bytes
    return block


def lease_block(int64_t n_bytes, allocate: Callable[[int], U8]) -> memoryview:
    """Return memory for an array, which comes back when the array dies; `allocate(n_bytes)` is asked where none waits."""
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
    """Keep at most so many bytes that no array has; the rest goes back to the system now."""
    global most_waiting_bytes
    with cython.critical_section(waiting_blocks):
        most_waiting_bytes = n_bytes
        drop_blocks(n_bytes)


def waiting_memory() -> int:
    """Return how many bytes wait for an array."""
    return waiting_bytes
