# Polygons of rings: masks, labels and shares of pixels. Included by kernels.pyx, which declares the kernels.

POLYGON_PAD = TL_POLYGON_PAD
PIECE_WORDS = TL_PIECE_WORDS
PIECE_BYTES = sizeof(tl_edge_piece)
LABEL_SCRATCH_BYTES = sizeof(tl_label_scratch)
CELL_ROWS = TL_CELL_ROWS
LEAST_SHARE_CELLS = TL_LEAST_SHARE_CELLS


def polygon_stride(int64_t width) -> int:
    """Return how many bits or cells a row of a mask or of labels needs."""
    return tl_polygon_stride(width)


def snap_points(Source source, int64_t first, int64_t end, int bits, int grid_bits, int64_t x_px, int64_t y_px,
                int32_t[::1] x_fx, int32_t[::1] y_fx, int64_t[:, ::1] wide_fx or None) -> tuple[int, int]:
    """The kernel `snap_points`. Returns the numbers of bad and wide points."""
    cdef int64_t[2] corner
    cdef tl_vertex_counts counts
    cdef int64_t *table = &wide_fx[0, 0] if wide_fx is not None else NULL
    corner[0], corner[1] = x_px, y_px
    with nogil:
        counts = K.snap_points(&source.source, first, end, bits, grid_bits, corner, &x_fx[0], &y_fx[0], table)
    return counts.n_bad, counts.n_wide


cdef class PieceScratch:
    """A buffer of n_pieces unresolved parts of edges: at least as many as the largest polygon has edges."""

    cdef tl_piece_scratch scratch
    cdef object arrays

    def __init__(self, int64_t n_pieces, int64_t height, int64_t width):
        cdef uint8_t[::1] pieces = np.empty(n_pieces * PIECE_BYTES, np.uint8)
        cdef int64_t[::1] room = np.empty(n_pieces * PIECE_WORDS, np.int64), starts = np.empty(height + 2, np.int64)
        cdef double[::1] shares = np.empty(width + 16)
        self.arrays = (pieces, room, starts, shares)
        self.scratch.pieces, self.scratch.n_pieces = <tl_edge_piece *>&pieces[0], n_pieces
        self.scratch.room, self.scratch.row_starts, self.scratch.shares = &room[0], &starts[0], &shares[0]


cdef class SnappedPolygons:
    """Snapped polygons in a window: their rings, boxes and weights, and the kernels that draw them."""

    cdef tl_polygons set
    cdef uint8_t[::1] flags, is_simple
    cdef int8_t[::1] weights
    cdef int32_t[:, ::1] boxes
    cdef object arrays
    cdef readonly int64_t n_polygons, n_rings, width, height
    cdef int64_t crossings_left, max_crossings

    def __init__(self, int32_t[::1] x_fx, int32_t[::1] y_fx, int64_t[:, ::1] wide_fx or None, const int64_t[::1] rings,
                 const int64_t[::1] polygons, int64_t width, int64_t height, int bits, bint is_nonzero,
                 const uint8_t[::1] unions or None):
        """Take snapped points (x, y), offsets, and the rule: "nonzero" for all or for the polygons that are 1 in `unions`."""
        cdef int64_t i
        cdef uint8_t *rules
        self.n_polygons, self.n_rings = polygons.shape[0] - 1, rings.shape[0] - 1
        self.width, self.height = width, height
        self.flags = np.empty(2 * (self.n_polygons + 1), np.uint8)  # of each polygon, is_wide; then is_nonzero
        self.boxes = np.empty((self.n_polygons + 1, 4), np.int32)
        self.arrays = (x_fx, y_fx, wide_fx, rings, polygons)
        memset(&self.set, 0, sizeof(self.set))
        self.set.x_fx, self.set.y_fx = &x_fx[0], &y_fx[0]
        self.set.wide_fx = &wide_fx[0, 0] if wide_fx is not None else NULL
        self.set.rings, self.set.polygons, self.set.n_polygons = &rings[0], &polygons[0], self.n_polygons
        rules = &self.flags[self.n_polygons + 1]
        memset(rules, is_nonzero, self.n_polygons)
        for i in range(self.n_polygons if unions is not None else 0):
            rules[i] |= unions[i]
        self.set.is_wide, self.set.is_nonzero, self.set.bits = &self.flags[0], rules, bits

    cdef tl_polygon_box *box(self) noexcept:
        return <tl_polygon_box *>&self.boxes[0, 0]

    @property
    def boxes_px(self) -> I32:
        """The boxes of the polygons in pixels: left, top, right, bottom (P, 4), clipped to the window."""
        return np.asarray(self.boxes)[: self.n_polygons]

    def is_nonzero(self, int64_t i) -> bool:
        """Return whether the rule of a polygon is "nonzero"."""
        return self.set.is_nonzero[i] != 0

    cdef tl_polygons asking(self) noexcept:
        """Return `tl_polygons`, with the pause of this thread."""
        cdef tl_polygons set = self.set
        set.pause = pause_of_thread()
        return set

    def bound(self, int64_t first, int64_t end) -> int:
        """The kernel `bound_polygons`."""
        cdef tl_polygon_box *boxes = self.box()
        cdef int64_t most
        with nogil:
            most = K.bound_polygons(&self.set, first, end, self.width, self.height, &self.flags[0], boxes)
        return most

    def make_weights(self, int64_t max_crossings):
        """Allocate the weights of rings that `certify` writes; `max_crossings`: as for `topleft.polygons`."""
        self.crossings_left = self.max_crossings = max_crossings
        self.set.crossings_left = &self.crossings_left
        self.weights, self.is_simple = np.zeros(self.n_rings + 1, np.int8), np.zeros(self.n_polygons + 1, np.uint8)
        self.set.weights, self.set.is_simple = &self.weights[0], &self.is_simple[0]

    cdef int raise_if_given_up(self) except -1:
        raise_if_given_up()
        if self.crossings_left < 0:
            raise ValueError(f"rings must cross at most {self.max_crossings:,} times within the picture where areas are "
                             "exact, and cross or crowd a pixel more often: max_crossings= allows more")
        return 0

    def certify_words(self) -> int:
        """Return how many int64 of room `certify` needs."""
        cdef int64_t most = 1, i, first, end
        for i in range(self.n_polygons):
            first, end = self.set.polygons[i], self.set.polygons[i + 1]
            most = max(most, tl_certify_words(self.set.rings[end] - self.set.rings[first], end - first))
        return most

    def certify(self, int64_t first, int64_t end, int64_t[::1] room or None):
        """Test whether the rings of polygons [first, end) meet; without `room` they are assumed to stay apart."""
        cdef tl_polygons set = self.asking()
        cdef int64_t *words = &room[0] if room is not None else NULL
        with nogil:
            if words == NULL:
                K.trust_polygons(&set, first, end, &self.weights[0], &self.is_simple[0])
            else:
                K.certify_polygons(&set, first, end, &self.weights[0], &self.is_simple[0], words)
        raise_if_given_up()

    def which_are_simple(self) -> NDArray[np.bool_]:
        """Return (P,) bool: whether the rings of each polygon stay apart."""
        return np.asarray(self.is_simple)[: self.n_polygons].view(np.bool_)

    def weights_of_rings(self) -> I8:
        """Return the sign with which each ring's area counts, (R,) int8; defined where rings do not meet."""
        return np.asarray(self.weights)[: self.n_rings]

    def at_sample(self, int32_t sample_x_fx, int32_t sample_y_fx):
        """Move the sample of pixels from their centre, in sub-pixels, for all further calls."""
        self.set.sample_x_fx, self.set.sample_y_fx = sample_x_fx, sample_y_fx

    def sort(self, int64_t band_rows, int64_t n_bands, int64_t[::1] starts, int32_t[::1] listed or None):
        """The kernel `sort_polygons`."""
        cdef tl_polygon_box *boxes = self.box()
        cdef int32_t *to = &listed[0] if listed is not None else NULL
        with nogil:
            K.sort_polygons(boxes, self.n_polygons, band_rows, n_bands, &starts[0], to)

    def mask_even_odd(self, int64_t polygon, uint8_t[:, ::1] out, int64_t top, int64_t bottom, int32_t[::1] bits):
        """The kernel `mask_even_odd`. `bits`: scratch for the rows, 0."""
        cdef tl_polygons set = self.asking()
        with nogil:
            K.mask_even_odd(&set, polygon, self.width, top, bottom, <uint64_t *>&bits[0], &out[0, 0])
        raise_if_given_up()

    def mask_nonzero(self, int64_t polygon, uint8_t[:, ::1] out, int64_t top, int64_t bottom, uint32_t[::1] at,
                     int32_t[::1] room, int32_t[::1] cells, uint64_t[::1] bits):
        """The kernel `mask_nonzero`. `cells`: scratch for a row, 0."""
        cdef tl_polygons set = self.asking()
        with nogil:
            K.mask_nonzero(&set, polygon, self.width, top, bottom, &at[0], &room[0], room.shape[0], &cells[0],
                           &bits[0], &out[0, 0])
        raise_if_given_up()

    def label(self, uint8_t[::1] pixels, int n_bytes, const int32_t[::1] values or None, int32_t background, int test,
              bint waits, int64_t band_rows, const int64_t[::1] starts or None, const int32_t[::1] listed or None,
              int64_t first_band, int64_t end_band, int32_t[::1] cells, uint8_t[::1] scratch,
              PieceScratch pieces or None):
        """Paint bands of rows: the background, then the polygons of the band in `listed`; without `listed` all polygons."""
        cdef tl_polygons set = self.asking()
        cdef tl_label_job job
        cdef int64_t band
        job.listed = &listed[0] if listed is not None else NULL
        job.values = &values[0] if values is not None else NULL
        job.boxes, job.test, job.width = self.box(), <tl_polygon_test>test, self.width
        job.n_bytes, job.background, job.waits = n_bytes, background, waits
        job.pixels, job.cells, job.scratch = &pixels[0], &cells[0], <tl_label_scratch *>&scratch[0]
        job.pieces = &pieces.scratch if pieces is not None else NULL
        with nogil:
            for band in range(first_band, end_band):
                job.top, job.bottom = band * band_rows, min((band + 1) * band_rows, self.height)
                job.first = 0 if job.listed == NULL else starts[band]
                job.end = self.n_polygons if job.listed == NULL else starts[band + 1]
                K.label_polygons(&set, &job)
        self.raise_if_given_up()

    def add_shares(self, float[::1] pixels, const float[:, ::1] colors or None, int64_t band_rows,
                   const int64_t[::1] starts, const int32_t[::1] listed, int64_t first_band, int64_t end_band,
                   int32_t[::1] cells, PieceScratch pieces or None, bint is_alone):
        """Add the shares of polygons to bands of rows, to at most 1; with colours (P, C) blend the colours by the shares.

        `is_alone`: the only polygon replaces the pixels of the bands.
        """
        cdef tl_polygons set = self.asking()
        cdef tl_share_job job
        cdef int64_t band
        memset(&job, 0, sizeof(job))
        job.listed, job.boxes, job.width = &listed[0], self.box(), self.width
        job.cells, job.n_cells = &cells[0], cells.shape[0]
        job.pieces = &pieces.scratch if pieces is not None else NULL
        job.pixels, job.colors = &pixels[0], &colors[0, 0] if colors is not None else NULL
        job.n_channels, job.is_alone = colors.shape[1] if colors is not None else 1, is_alone
        with nogil:
            for band in range(first_band, end_band):
                job.top, job.bottom = band * band_rows, min((band + 1) * band_rows, self.height)
                job.first, job.end = starts[band], starts[band + 1]
                if is_alone:  # also in bands that the polygon does not reach
                    job.listed, job.first, job.end = NULL, 0, 1
                K.share_polygons(&set, &job)
        self.raise_if_given_up()

    def list_shares(self, int64_t first, int64_t end, int64_t[::1] starts, indices: Array, float[::1] areas,
                    int32_t[::1] cells, PieceScratch pieces or None) -> int:
        """Append the shares of polygons [first, end) to a table that holds starts[first] entries.

        Returns how many are finished; `areas` has 16 numbers more than it has room for.
        """
        cdef tl_polygons set = self.asking()
        cdef tl_share_job job
        cdef uint8_t[::1] raw = as_bytes(indices)
        cdef int64_t n
        memset(&job, 0, sizeof(job))
        job.first, job.end, job.boxes, job.width = first, end, self.box(), self.width
        job.bottom, job.cells, job.n_cells = self.height, &cells[0], cells.shape[0]
        job.pieces = &pieces.scratch if pieces is not None else NULL
        job.starts, job.indices, job.areas = &starts[0], &raw[0], &areas[0]
        job.is_long, job.n_room = indices.itemsize == 8, areas.shape[0] - 16
        with nogil:
            n = K.share_polygons(&set, &job)
        self.raise_if_given_up()
        return n
