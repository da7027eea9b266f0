# One colour a pixel from those of its samples. Included by _engine.pyx.


cdef class Transfer:
    """What is averaged of colours with several samples a pixel: their light, or as much of them as their alpha tells."""

    cdef tl_transfer transfer
    cdef object arrays

    def __init__(self, tables, int n_channels, bint is_straight):
        cdef const int32_t[::1] decode
        cdef const uint8_t[::1] encode
        self.transfer.n_channels, self.transfer.is_straight = n_channels, is_straight
        if tables is not None:
            decode, encode = self.arrays = tables
            self.transfer.decode, self.transfer.encode = &decode[0], &encode[0]


cdef class Palette:
    """The colours of triangles, (T[, C]) uint8 or float32, and how those of samples become one."""

    cdef const uint8_t[::1] colors
    cdef int n_channels
    cdef bint is_u8
    cdef Transfer transfer

    def __init__(self, colors, Transfer transfer):
        self.n_channels, self.is_u8, self.transfer = 1 if colors.ndim == 1 else colors.shape[1], colors.dtype == np.uint8, transfer
        if self.is_u8:  # four bytes a colour, aligned
            wide = np.zeros(max(1, len(colors)), np.int32)
            wide.view(np.uint8).reshape(-1, 4)[: len(colors), : self.n_channels] = colors.reshape(len(colors), -1)
            colors = wide
        self.colors = as_bytes(colors)

    cdef void mean(self, const int32_t *labels, int sample_bits, int64_t stride, int64_t n, uint8_t *pixels, int64_t first) noexcept nogil:
        """Write the means of n pixels from the first on: planes of labels lie `stride` apart."""
        cdef const tl_transfer *own = NULL if self.transfer is None else &self.transfer.transfer
        K.mean_flat(labels, sample_bits, stride, n, data(self.colors), self.n_channels, self.is_u8, own,
                    &pixels[first * self.n_channels * (1 if self.is_u8 else 4)])

    def mean_flat(self, const int32_t[:, :, ::1] labels, pixels, int64_t first_row, int64_t n_rows):
        """Write the mean colour of the triangles that the samples see over rows of pixels; labels (S, H, W)."""
        cdef uint8_t[::1] flat = as_bytes(pixels)
        cdef int64_t width = labels.shape[2]
        cdef int sample_bits = int(labels.shape[0]).bit_length() - 1
        if n_rows and width and self.colors.shape[0]:
            with nogil:
                self.mean(&labels[0, first_row, 0], sample_bits, labels.shape[1] * width, n_rows * width, &flat[0], first_row * width)


def fill_bands(scenes, int32_t[:, ::1] labels, Palette palette, pixels, Bins bins, int64_t first_band, int64_t end_band):
    """Write the mean colours of samples over bands of (H, W[, C]) pixels: `scenes` is the scene as each of them sees it.

    `labels`: memory for those of a band, (S, rows * W).
    """
    cdef tl_scene seen[16]
    cdef Scene scene
    cdef tl_target target
    cdef tl_window window
    cdef tl_share share = no_share()
    cdef uint8_t[::1] flat = as_bytes(pixels)
    cdef int k, n_samples = len(scenes), sample_bits = int(len(scenes)).bit_length() - 1
    cdef int64_t band, first_row, n_rows, height = pixels.shape[0], width = pixels.shape[1]
    for k in range(n_samples):
        scene = scenes[k]
        seen[k] = scene.scene
    memset(&target, 0, sizeof(target))
    target.sink, target.stride_px = <tl_sink>LABEL, width
    share.is_first = share.is_last = True
    with nogil:
        for band in range(first_band, end_band):
            first_row = band << bins.band_bits
            n_rows = min(<int64_t>1 << bins.band_bits, height - first_row)
            window = scene.window(first_row, n_rows, width)
            share.ids = &bins.listed[0] + bins.starts[band]
            share.end = bins.starts[band + 1] - bins.starts[band]
            for k in range(n_samples):
                target.pixels = &labels[k, 0]
                K.draw(&seen[k], &window, &target, &share)
            palette.mean(&labels[0, 0], sample_bits, labels.shape[1], n_rows * width, &flat[0], first_row * width)


def mean_colors(painted, pixels, int64_t first_row, int64_t n_rows, int n_channels, Transfer transfer):
    """Write the mean of planes of colours (S, H, W[, C]) over rows of pixels."""
    cdef const uint8_t[::1] planes = as_bytes(painted)
    cdef uint8_t[::1] flat = as_bytes(pixels)
    cdef int is_u8 = painted.dtype == np.uint8
    cdef int64_t height = painted.shape[1], width = painted.shape[2], first
    cdef int sample_bits = int(painted.shape[0]).bit_length() - 1
    cdef const tl_transfer *own = NULL if transfer is None else &transfer.transfer
    first = first_row * width * n_channels * (1 if is_u8 else 4)
    if n_rows and width:
        with nogil:
            K.mean_colors(&planes[first], sample_bits, height * width, n_rows * width, n_channels, is_u8, own, &flat[first])
