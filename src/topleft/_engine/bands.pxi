# Passes over bands of rows that list their triangles: samples, layers; what is seen through layers. Included by _engine.pyx.


cdef class Bins:
    """The triangles that reach into each band of 2**band_bits rows of a picture."""

    cdef tl_bins bins
    cdef int64_t[::1] starts
    cdef int32_t[::1] listed
    cdef object room
    cdef readonly int band_bits
    cdef readonly int64_t bad_row, n_bands, n_listed

    def __init__(self, Scene scene, int64_t height, int64_t width, int32_t reach_fx, int band_bits, int32_t[:, ::1] room):
        """`room`: (3, n_triangles + 16). `bad_row` is -1, or a triangle has an index outside the vertices."""
        cdef tl_window window = scene.window(0, height, width)
        self.room, self.band_bits, self.n_bands = room, band_bits, (height + (1 << band_bits) - 1) >> band_bits
        self.starts = np.empty(self.n_bands + 2, np.int64)
        self.bins.n = self.n_listed = 0
        self.bins.ids, self.bins.first_band, self.bins.last_band = &room[0, 0], &room[1, 0], &room[2, 0]
        with nogil:
            self.bad_row = K.bin(&scene.scene, &window, reach_fx, band_bits, &self.bins)
            if self.bad_row < 0:
                K.list_bins(&self.bins, self.n_bands, &self.starts[0], NULL)
                self.n_listed = self.starts[self.n_bands + 1]

    def fill(self, int32_t[::1] listed):
        """Sort the triangles into `listed`, which has room for `n_listed` and one more."""
        self.listed = listed
        with nogil:
            K.list_bins(&self.bins, self.n_bands, &self.starts[0], &listed[0])


def draw_bands(scenes, targets, Bins bins, int64_t first_band, int64_t end_band):
    """Clear and draw bands of several pictures, a scene each, one band of all after the other."""
    cdef Scene scene
    cdef Target target
    cdef tl_target rows
    cdef tl_window window
    cdef tl_share share = no_share()
    cdef int64_t band, first_row
    cdef list pairs = list(zip(scenes, targets, strict=True))
    share.is_first = share.is_last = True
    for band in range(first_band, end_band):
        first_row = band << bins.band_bits
        share.ids = &bins.listed[0] + bins.starts[band]
        share.end = bins.starts[band + 1] - bins.starts[band]
        for scene, target in pairs:
            rows = target.rows(first_row)
            window = scene.window(first_row, min(<int64_t>1 << bins.band_bits, target.height - first_row), target.width)
            with nogil:
                K.draw(&scene.scene, &window, &rows, &share)


def peel(scenes, bins, int32_t[:, :, ::1] ids, float[:, :, ::1] depth, bint is_farthest, int band_bits,
         int64_t first_band, int64_t end_band):
    """Write the nearest layers of all scenes together, as planes (K, H, W), in bands of 2**band_bits rows.

    `bins`: those of each scene, or None, where a band is to look at all triangles. Returns as `Scene.draw` does.
    """
    cdef tl_peeled peeled
    cdef tl_target target
    cdef tl_window window
    cdef tl_share share = no_share()
    cdef Scene scene
    cdef Bins own
    cdef int64_t band, first_row, height = ids.shape[1], width = ids.shape[2], bad_row = -1
    cdef list pairs = list(zip(scenes, bins, strict=True))
    cdef int64_t i, n = len(pairs)
    peeled.n_layers, peeled.is_farthest = ids.shape[0], is_farthest
    peeled.plane_px = height * width
    memset(&target, 0, sizeof(target))
    target.sink, target.stride_px, target.peeled = <tl_sink>TL_SINK_PEEL, width, &peeled
    for band in range(first_band, end_band):
        first_row = band << band_bits
        peeled.ids, peeled.depth = &ids[0, first_row, 0], &depth[0, first_row, 0]
        for i in range(n):
            scene, own = pairs[i]
            share.ids, share.end = NULL, scene.scene.n_triangles
            if own is not None:
                share.ids, share.end = &own.listed[0] + own.starts[band], own.starts[band + 1] - own.starts[band]
            share.is_first, share.is_last = i == 0, i == n - 1
            window = scene.window(first_row, min(<int64_t>1 << band_bits, height - first_row), width)
            with nogil:
                bad_row = K.draw(&scene.scene, &window, &target, &share)
            if bad_row >= 0:
                return bad_row
    return bad_row


def composite(const int32_t[:, :, ::1] ids, int64_t first_row, int64_t n_rows, const uint8_t[::1] colors, bint is_flat, bint is_u8,
              int n_channels, const float[::1] background, uint8_t[::1] pixels):
    """Write what is seen through layers, planes (K, H, W), in rows [first_row, first_row + n_rows) of a picture.

    `colors`: of the triangles, or of the layers of these rows, (K, n_rows, W, n_channels) float32. `background` may be None.
    """
    cdef tl_composite layers
    cdef int64_t width = ids.shape[2], n = n_rows * width
    cdef int pixel_bytes = n_channels if is_u8 else 4 * n_channels
    if n == 0:
        return
    layers.ids, layers.plane_px, layers.n_layers = &ids[0, first_row, 0], ids.shape[1] * width, ids.shape[0]
    layers.n_channels, layers.is_u8, layers.is_flat, layers.colors = n_channels, is_u8, is_flat, data(colors)
    layers.background = &background[0] if background is not None else NULL
    with nogil:
        K.composite(&layers, n, &pixels[first_row * width * pixel_bytes])
