# Meshes that are grown into meshlets, and passes that draw the meshlets in view.

MESHLET_BYTES = sizeof(tl_meshlet)
MESHLET_TRIANGLES = TL_MESHLET_GROWN
MESHLET_TAIL = TL_MESHLET_TAIL
MESHLET_BOUNDS = TL_N_BOUNDS
MESHLET_PIECE = TL_GROW_PIECE
GROW_ROOM = TL_GROW_ROOM
SEEN_BYTES = sizeof(tl_seen_meshlet)
MAX_DRAWN_PX = TL_MAX_DRAWN_PX


def has_meshlets() -> bool:
    """Tell whether there is code for meshlets beside the kernels in use, and a CPU for it."""
    return BESIDE != NULL


def most_meshlets(int64_t n_triangles) -> int:
    """Return how many meshlets a part of a mesh is grown into at most."""
    return tl_most_meshlets(n_triangles)


def grow_meshlets(Source source, const int32_t[:, ::1] triangles, const int32_t[::1] order, int64_t first, int64_t end,
                  int32_t[::1] numbers, uint8_t[::1] room, uint8_t[::1] meshlets, float[:, ::1] records,
                  uint8_t[::1] n_triangles) -> int:
    """Grow triangles order[first] to order[end - 1] into meshlets, with a record of bounds each; returns how many.

    `numbers`: -1 for each vertex; `room`: GROW_ROOM bytes. The rest has room for `most_meshlets`.
    """
    cdef const tl_meshlet_kernels *kernels = BESIDE
    cdef int64_t n
    if kernels == NULL or end <= first:
        return 0
    with nogil:
        n = kernels.grow(&source.source, &triangles[0, 0], &order[0], first, end, &numbers[0], &room[0],
                         <tl_meshlet *>&meshlets[0], &records[0, 0], &n_triangles[0])
    return n


cdef class Grown:
    """A mesh in object space with float32 coordinates, grown into meshlets; keeps its arrays alive."""

    cdef tl_meshlets mesh
    cdef object arrays

    def __init__(self, const uint8_t[::1] meshlets, const float[:, ::1] bounds, const uint8_t[::1] n_triangles,
                 largest: Sequence[float]):
        """`bounds` (MESHLET_BOUNDS, N + MESHLET_TAIL); `largest`: the absolute coordinate of each axis."""
        cdef int k
        self.arrays = meshlets, bounds, n_triangles
        self.mesh.n_meshlets = meshlets.shape[0] // <int64_t>sizeof(tl_meshlet)
        self.mesh.meshlets = <const tl_meshlet *>&meshlets[0]
        self.mesh.bounds, self.mesh.n_triangles = &bounds[0, 0], &n_triangles[0]
        for k in range(3):
            self.mesh.largest[k] = largest[k]

    def __len__(self) -> int:
        return self.mesh.n_meshlets


cdef class MeshletPass:
    """A picture of meshlets: lists those that it may show, then draws rows of them, in several threads if wanted."""

    cdef Grown meshlets
    cdef SnappedMesh mesh
    cdef Source source
    cdef ClusterView seen
    cdef Target target

    def __init__(self, Grown meshlets, SnappedMesh mesh, Source source, ClusterView seen, Target target):
        """`mesh`: viewport, culling and the id of triangle 0; its own triangles are not read. `source`: the matrix."""
        self.meshlets, self.mesh, self.source, self.seen, self.target = meshlets, mesh, source, seen, target

    def find(self, int64_t first, int64_t end, int32_t[::1] found, int32_t[::1] odd) -> tuple[int, int]:
        """List those of meshlets [first, end) that the picture may show, and in `odd` those that need care.

        `found` has room for SEEN_BYTES of each, `odd` for a number. Returns how many there are of the first, and of the second.
        """
        cdef const tl_meshlet_kernels *kernels = BESIDE
        cdef tl_window window = self.mesh.window(0, self.target.height, self.target.width)
        cdef tl_target target = self.target.rows(0)
        cdef tl_meshlet_pass drawn = self.with_window(&window, &target)
        cdef int64_t n = 0, n_odd = 0
        if kernels != NULL and end > first:
            with nogil:
                n = kernels.list(&drawn, first, end, <tl_seen_meshlet *>&found[0], &odd[0], &n_odd)
        return n, n_odd

    def split_rows(self, const int32_t[::1] found, int64_t n, int n_parts) -> list[int]:
        """Return the rows at which to cut the picture into parts that show about as many meshlets each."""
        cdef const tl_seen_meshlet *list = <const tl_seen_meshlet *>&found[0]
        cdef int64_t n_of[256]
        cdef int64_t i, total = 0, sum = 0, row, cell, height = self.target.height
        memset(n_of, 0, sizeof(n_of))
        for i in range(0, n, 4):
            row = min(max(list[i].below_px - TL_SLOT_PX // 2, 0), height - 1)
            n_of[row * 256 // height] += 1
            total += 1
        rows = [0]
        cell = 0
        for i in range(1, n_parts):
            while cell < 255 and (sum + n_of[cell]) * n_parts < total * i:
                sum += n_of[cell]
                cell += 1
            share = (total * i / n_parts - sum) / n_of[cell] if n_of[cell] else 0.5
            rows.append(min(max(int((cell + share) * height / 256), rows[len(rows) - 1] + 1), height - n_parts + i))
        return [*rows, height]

    def draw(self, const int32_t[::1] found, int64_t n, const int32_t[::1] odd, int64_t n_odd, int64_t first_row,
             int64_t end_row, bint is_first, int32_t[::1] room, int32_t[::1] others) -> int:
        """Draw the listed meshlets in rows [first_row, end_row), cleared before if `is_first`. `room`: as long as `found`.

        `others`, a number for each triangle, gets those that a clip plane may cut, or that 64 bits cannot hold; returns how
        many.
        """
        cdef const tl_meshlet_kernels *kernels = BESIDE
        cdef tl_window window = self.mesh.window(0, self.target.height, self.target.width)
        cdef tl_target target = self.target.rows(0)
        cdef tl_meshlet_pass drawn = self.with_window(&window, &target)
        cdef int64_t n_others = 0
        if kernels != NULL:
            with nogil:
                n_others = kernels.draw(&drawn, <const tl_seen_meshlet *>&found[0], n, &odd[0], n_odd, <int32_t>first_row,
                                        <int32_t>end_row, is_first, <tl_seen_meshlet *>&room[0], &others[0])
        raise_if_given_up()
        return n_others

    cdef tl_meshlet_pass with_window(self, const tl_window *window, const tl_target *target) noexcept:
        cdef tl_meshlet_pass drawn
        memset(&drawn, 0, sizeof(drawn))
        drawn.mesh, drawn.seen, drawn.source = &self.meshlets.mesh, &self.seen.view, &self.source.source
        drawn.view, drawn.window, drawn.target, drawn.kernels = &self.mesh.viewport.view, window, target, K
        drawn.first_id = self.mesh.snapped.first_id
        drawn.sample_x_fx, drawn.sample_y_fx = self.mesh.snapped.mesh.sample_x_fx, self.mesh.snapped.mesh.sample_y_fx
        return drawn
