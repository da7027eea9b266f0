# Computes pixels from ids and samples, and draws lines and clouds: means, layers, slopes, texels, points, planes, PNG rows.


cdef class Transfer:
    """How the colours of a pixel's samples are averaged: in linear light, or weighted by alpha."""

    cdef tl_transfer transfer
    cdef object arrays

    def __init__(self, tables: tuple[I32, U8] | None, int n_channels, bint is_straight):
        cdef const int32_t[::1] decode
        cdef const uint8_t[::1] encode
        self.transfer.n_channels, self.transfer.is_straight = n_channels, is_straight
        if tables is not None:
            decode, encode = self.arrays = tables
            self.transfer.decode, self.transfer.encode = &decode[0], &encode[0]


cdef class Palette:
    """The colours of triangles, (T[, C]) uint8 or float32, and the transfer that averages the samples of a pixel."""

    cdef const uint8_t[::1] colors
    cdef int n_channels
    cdef bint is_u8
    cdef Transfer transfer

    def __init__(self, colors: Array, Transfer transfer or None):
        self.n_channels, self.is_u8, self.transfer = 1 if colors.ndim == 1 else colors.shape[1], colors.dtype == np.uint8, transfer
        if self.is_u8:  # four bytes a colour, aligned
            wide = np.zeros(max(1, len(colors)), np.int32)
            wide.view(np.uint8).reshape(-1, 4)[: len(colors), : self.n_channels] = colors.reshape(len(colors), -1)
            colors = wide
        self.colors = as_bytes(colors)

    cdef void mean(self, const int32_t *labels, int sample_bits, int64_t stride, int64_t n, uint8_t *pixels, int64_t first) noexcept nogil:
        """Write the means of n pixels from pixel `first` on; `stride`: labels from plane to plane."""
        cdef const tl_transfer *c_transfer = NULL if self.transfer is None else &self.transfer.transfer
        K.mean_flat(labels, sample_bits, stride, n, data(self.colors), self.n_channels, self.is_u8, c_transfer,
                    &pixels[first * self.n_channels * (1 if self.is_u8 else 4)])

    def mean_flat(self, const int32_t[:, :, ::1] labels, pixels: Array, int64_t first_row, int64_t n_rows):
        """Write the mean colour of the triangles that the samples see over rows of pixels; labels (S, H, W)."""
        cdef uint8_t[::1] flat = as_bytes(pixels)
        cdef int64_t width = labels.shape[2]
        cdef int sample_bits = int(labels.shape[0]).bit_length() - 1
        if n_rows and width and self.colors.shape[0]:
            with nogil:
                self.mean(&labels[0, first_row, 0], sample_bits, labels.shape[1] * width, n_rows * width, &flat[0], first_row * width)


def fill_bands(meshes: Sequence[SnappedMesh], int32_t[:, ::1] labels, uint64_t[::1] covered, Palette palette,
               pixels: Array, ground: Array | None, Bins bins, int64_t first_band, int64_t end_band):
    """Write the mean colours of samples over bands of (H, W[, C]) pixels; `meshes`: the mesh, moved to each sample.

    `labels`: scratch for a band, (S, rows * W); `covered`: a bit for each pixel of a band. `ground`: a row (W[, C]) that
    is copied to all rows first, or None.
    """
    cdef tl_snapped seen[16]
    cdef SnappedMesh mesh
    cdef tl_target target
    cdef tl_window window
    cdef tl_slice slice = no_slice()
    cdef uint8_t[::1] flat = as_bytes(pixels)
    cdef int k, n_samples = len(meshes), sample_bits = int(len(meshes)).bit_length() - 1
    cdef const uint8_t[::1] ground_row = None if ground is None else as_bytes(ground)
    cdef int64_t band, first_row, n_rows, height = pixels.shape[0], width = pixels.shape[1], row, n_row_bytes = flat.shape[0] // height
    for k in range(n_samples):
        mesh = meshes[k]
        seen[k] = mesh.snapped
    memset(&target, 0, sizeof(target))
    target.sink, target.stride_px = <tl_sink>LABEL, width
    target.covered = &covered[0]
    slice.is_first = slice.is_last = True
    with nogil:
        for band in range(first_band, end_band):
            first_row = band << bins.band_bits
            n_rows = min(<int64_t>1 << bins.band_bits, height - first_row)
            window = mesh.window(first_row, n_rows, width)
            slice.end = bins.starts[band + 1] - bins.starts[band]
            slice.ids = bins.backwards(band)
            if ground_row is not None:
                for row in range(first_row, first_row + n_rows):
                    memcpy(&flat[row * n_row_bytes], &ground_row[0], n_row_bytes)
            for k in range(n_samples):
                target.pixels = &labels[k, 0]
                K.draw_mesh(&seen[k], &window, &target, &slice)
            palette.mean(&labels[0, 0], sample_bits, labels.shape[1], n_rows * width, &flat[0], first_row * width)
    raise_if_given_up()


def find_instances(const int32_t[:, ::1] ids, const int64_t[::1] first_ids, int32_t[:, ::1] out,
                   int32_t[:, ::1] boxes or None):
    """The kernel `find_instances`."""
    cdef int64_t n = first_ids.shape[0] - 1
    if ids.shape[0] and ids.shape[1]:
        with nogil:
            K.find_instances(&ids[0, 0], ids.shape[0], ids.shape[1], &first_ids[0], n, &out[0, 0],
                             &boxes[0, 0] if boxes is not None and n else NULL)


def mean_colors(painted: Array, pixels: Array, int64_t first_row, int64_t n_rows, int n_channels,
                Transfer transfer or None):
    """The kernel `mean_colors`. Planes (S, H, W[, C])."""
    cdef const uint8_t[::1] planes = as_bytes(painted)
    cdef uint8_t[::1] flat = as_bytes(pixels)
    cdef int is_u8 = painted.dtype == np.uint8
    cdef int64_t height = painted.shape[1], width = painted.shape[2], first
    cdef int sample_bits = int(painted.shape[0]).bit_length() - 1
    cdef const tl_transfer *c_transfer = NULL if transfer is None else &transfer.transfer
    first = first_row * width * n_channels * (1 if is_u8 else 4)
    if n_rows and width:
        with nogil:
            K.mean_colors(&planes[first], sample_bits, height * width, n_rows * width, n_channels, is_u8, c_transfer, &flat[first])


def composite(const int32_t[:, :, ::1] ids, int64_t n_triangles, int64_t first_row, int64_t n_rows,
              const uint8_t[::1] colors, bint is_flat, bint is_u8, int n_channels, const float[::1] background or None,
              uint8_t[::1] pixels):
    """Composite layers, planes (K, H, W), into rows [first_row, first_row + n_rows) of a picture.

    `colors`: of the triangles, or of the layers of the rows, (K, n_rows, W, n_channels) float32. `background` may be None.
    """
    cdef tl_composite layers
    cdef int64_t width = ids.shape[2], n = n_rows * width
    cdef int pixel_bytes = n_channels if is_u8 else 4 * n_channels
    if n == 0:
        return
    layers.ids, layers.plane_px, layers.n_layers = &ids[0, first_row, 0], ids.shape[1] * width, ids.shape[0]
    layers.n_triangles, layers.colors = n_triangles, data(colors)
    layers.n_channels, layers.is_u8, layers.is_flat = n_channels, is_u8, is_flat
    layers.background = &background[0] if background is not None else NULL
    with nogil:
        K.composite(&layers, n, &pixels[first_row * width * pixel_bytes])


def fill_slopes(const int32_t[::1] ids, const float[:, ::1] weights, const int32_t[::1] slot,
                const double[:, :, ::1] steps, const int32_t[:, ::1] rows, const float[:, ::1] values,
                float[:, :, ::1] out):
    """The kernel `fill_slopes`. `steps` (M, 3, 3) and `rows` (M, 3) are fields of `tl_sloped`."""
    cdef tl_sloped sloped
    cdef int64_t n = ids.shape[0]
    if n == 0 or values.shape[1] == 0:
        return
    if steps.shape[0] == 0:
        out[:, :, :] = 0
        return
    sloped.slot, sloped.steps, sloped.rows = &slot[0], &steps[0, 0, 0], &rows[0, 0]
    sloped.values, sloped.n_values = &values[0, 0], values.shape[1]
    with nogil:
        K.fill_slopes(&sloped, &ids[0], &weights[0, 0], n, &out[0, 0, 0])


def fill_texels(const float[:, ::1] texels, const int64_t[:, ::1] rows, codes: tuple[int, int, int],
                const int32_t[::1] ids, const float[:, ::1] uv, slopes: F32 | None, float background,
                float[:, ::1] out):
    """The kernel `fill_texels`.

    `rows` of (offset, width, height); `codes`: of the filter and of both wraps; `slopes` may be None.
    """
    cdef tl_levels levels
    cdef const float[:, :, ::1] slopes_view = slopes
    cdef int64_t n = ids.shape[0]
    if n == 0 or texels.shape[1] == 0:
        return
    levels.texels, levels.rows, levels.n_channels = &texels[0, 0], &rows[0, 0], <int>texels.shape[1]
    levels.n_levels = 1 if slopes_view is None else <int>rows.shape[0]
    levels.filter, levels.wrap_u, levels.wrap_v = <tl_filter><int>codes[0], <tl_wrap><int>codes[1], <tl_wrap><int>codes[2]
    cdef const float *first = NULL
    if slopes_view is not None:
        first = &slopes_view[0, 0, 0]
    with nogil:
        K.fill_texels(&levels, &ids[0], &uv[0, 0], first, background, n, &out[0, 0])


def levels_seen(const int64_t[:, ::1] rows, const float[:, :, ::1] slopes, double[::1] out):
    """The kernel `levels_seen`."""
    cdef tl_levels levels
    cdef int64_t n = slopes.shape[0]
    if n:
        levels.rows, levels.n_levels = &rows[0, 0], <int>rows.shape[0]
        with nogil:
            K.levels_seen(&levels, &slopes[0, 0, 0], n, &out[0])


def halve_rows(const float[:, ::1] level, int64_t width, int64_t height, int64_t first, int64_t end, float[:, ::1] out):
    """The kernel `halve_rows`."""
    if first < end and level.shape[1]:
        with nogil:
            K.halve_rows(&level[0, 0], width, height, <int>level.shape[1], first, end, &out[0, 0])


def write_levels(const uint8_t[:, :, ::1] image, const double[:, ::1] light, const int32_t[:, ::1] levels,
                 int64_t first, int64_t end, int64_t[::1] n_written, double[::1] room, uint16_t[:, ::1] texels):
    """The kernel `write_levels`."""
    cdef tl_picture_levels picture
    if first < end:
        picture.image, picture.light, picture.levels = &image[0, 0, 0], &light[0, 0], &levels[0, 0]
        picture.n_levels, picture.n_written = <int>levels.shape[0], &n_written[0]
        picture.room, picture.texels = &room[0], &texels[0, 0]
        with nogil:
            K.write_levels(&picture, first, end)


cdef class PixelPoints:
    """`tl_points` of the instances of a picture: positions of vertices, and the kind of value to compute at points."""

    cdef tl_points points
    cdef tl_shaded_scene scene
    cdef SnappedMesh mesh  # the first mesh: all share its window
    cdef uint8_t[::1] instances
    cdef uint8_t[::1] meshes
    cdef object arrays

    def __init__(self, snapped: Sequence[SnappedMesh], positions: Sequence[Array], first_ids: Sequence[int], int kind,
                 const double[:, :, ::1] rows, half_size: tuple[float, float], double background, bint is_f64_out):
        """Take at least one mesh, its vertices (V, 3) float32 or float64, and the id of triangle 0, of each instance.

        `rows`: (N, R, 4); `half_size`: half of width and height of the whole picture.
        """
        cdef int64_t i, n = len(snapped)
        cdef const uint8_t[::1] raw
        cdef SnappedMesh mesh
        cdef tl_shaded *instances
        cdef tl_point_mesh *meshes
        self.arrays, self.mesh = (snapped, positions), snapped[0]
        self.instances, self.meshes = np.zeros(n * sizeof(tl_shaded), np.uint8), np.zeros(n * sizeof(tl_point_mesh), np.uint8)
        instances, meshes = <tl_shaded *>&self.instances[0], <tl_point_mesh *>&self.meshes[0]
        for i in range(n):
            mesh, raw = snapped[i], as_bytes(positions[i])
            instances[i].snapped, instances[i].first_id = &mesh.snapped, first_ids[i]
            meshes[i].positions, meshes[i].is_f64 = data(raw), positions[i].dtype == np.float64
            memcpy(&meshes[i].rows[0][0], &rows[i, 0, 0], rows.shape[1] * 4 * sizeof(double))
        self.scene.instances, self.scene.n, self.scene.view = instances, n, self.mesh.clip_view()
        self.points.meshes, self.points.is_f64_out = meshes, is_f64_out
        self.points.kind, self.points.n_rows, self.points.background = <tl_point_kind>kind, rows.shape[1], background
        self.points.half_width_px, self.points.half_height_px = half_size

    def fill(self, const int32_t[:, ::1] ids, out: Array, int64_t first_row, int64_t n_rows):
        """Write rows of the value of each pixel's point, a `tl_point_kind`, (H, W) or (H, W, C)."""
        cdef tl_window window = self.mesh.window(first_row, n_rows, ids.shape[1])
        cdef uint8_t[::1] flat
        if n_rows and ids.shape[1]:
            flat = as_bytes(out[first_row:first_row + n_rows])
            with nogil:
                K.fill_points(&self.scene, &window, &self.points, &ids[first_row, 0], &flat[0])


PLANE_DOUBLES = TL_PLANE_DOUBLES


cdef class Valued:
    """Triangles with a value at each point."""

    cdef tl_valued mesh
    cdef object arrays

    def __init__(self, const double[:, ::1] points_px, const int32_t[:, ::1] triangles, const double[::1] values,
                 double[::1] planes=None):
        """`planes`: (1 + n_triangles) * PLANE_DOUBLES, for `list_planes`."""
        self.arrays = (points_px, triangles, values, planes)
        self.mesh.points_px = &points_px[0, 0] if points_px.shape[0] else NULL
        self.mesh.values = &values[0] if values.shape[0] else NULL
        self.mesh.triangles = &triangles[0, 0] if triangles.shape[0] else NULL
        self.mesh.n_points, self.mesh.n_triangles = points_px.shape[0], triangles.shape[0]
        self.mesh.planes = &planes[0] if planes is not None else NULL

    def list_planes(self, int64_t first, int64_t end):
        """The kernel `list_planes`. `fill_planes` reads the planes of all triangles."""
        with nogil:
            K.list_planes(&self.mesh, first, end)

    def fill_planes(self, const int32_t[:, ::1] ids, out: Array, int64_t first_row, int64_t n_rows, int64_t x_px,
                    int64_t y_px):
        """Write the values of the pixels in the rows [first_row, first_row + n_rows) of a float32 or float64 array.

        Pixel (0, 0) of the array is (x_px, y_px) of the whole picture.
        """
        cdef tl_window window
        cdef bint is_f32 = out.dtype == np.float32
        cdef uint8_t[::1] flat = as_bytes(out)
        cdef int64_t width = ids.shape[1]
        if width == 0 or n_rows == 0:
            return
        window.x_px, window.y_px, window.width, window.height = x_px, y_px + first_row, width, n_rows
        window.subpixel_bits, window.test, window.pause = 0, 0, NULL
        with nogil:
            K.fill_planes(&self.mesh, &window, &ids[first_row, 0], is_f32, &flat[first_row * width * (4 if is_f32 else 8)])


def list_edges(SnappedMesh mesh, int64_t[::1] starts, int32_t[::1] last_low, int32_t[::1] highs,
               uint64_t[::1] edges) -> int:
    """Write the edges of the triangles that are not culled; returns how many, -1 when an index is outside the vertices.

    `edges` has room for three a triangle; the other arrays are `tl_edge_scratch`.
    """
    cdef tl_edge_scratch scratch
    cdef int64_t n = 0, bad_row = -1
    if mesh.snapped.n_triangles and mesh.snapped.mesh.n_vertices:
        scratch.starts, scratch.last_low, scratch.highs = &starts[0], &last_low[0], &highs[0]
        with nogil:
            bad_row = K.list_edges(&mesh.snapped, &scratch, &edges[0], &n)
    return n if bad_row < 0 else -1


def draw_lines(SnappedMesh mesh, const uint64_t[::1] edges, uint8_t[::1] pixels, const float[:, ::1] depth or None,
               double depth_bias, bint is_farthest, bint is_smooth, int64_t width, int64_t first_row, int64_t n_rows):
    """Clear the rows [first_row, first_row + n_rows) of a buffer that is `width` pixels wide and draw lines into them."""
    cdef tl_edges lines
    cdef tl_line_target target
    cdef tl_window window = mesh.window(first_row, n_rows, width)
    if width == 0 or n_rows == 0:
        return
    lines.mesh, lines.n_edges = mesh.snapped.mesh, edges.shape[0]
    lines.view = mesh.clip_view()
    lines.edges = <const int32_t *>&edges[0] if edges.shape[0] else NULL
    target.is_smooth, target.is_farthest, target.depth_bias, target.stride_px = is_smooth, is_farthest, depth_bias, width
    target.pixels = &pixels[first_row * width * (4 if is_smooth else 1)]
    target.depth = &depth[first_row, 0] if depth is not None else NULL
    with nogil:
        K.draw_lines(&lines, &window, &target)
    raise_if_given_up()


def draw_cloud(const uint8_t[::1] records, int64_t size_fx, const int32_t[::1] sizes_fx or None, bint is_disc,
               int32_t x_fx, int32_t y_fx, Target target, origin: tuple[int, int], int subpixel_bits, int64_t first_row,
               int64_t n_rows):
    """Clear rows of ids and depth and draw snapped points into them; samples lie (x_fx, y_fx) off the centres of pixels.

    `sizes_fx`: a size each, or None: all have `size_fx`. Column 0 and row 0 of the target are the pixel `origin`.
    """
    cdef tl_cloud cloud
    cdef tl_window window
    cdef tl_target rows = target.rows(first_row)
    memset(&window, 0, sizeof(window))
    window.x_px, window.y_px = origin
    window.y_px += first_row
    window.width, window.height = target.width, n_rows
    window.subpixel_bits, window.pause = subpixel_bits, pause_of_thread()
    cloud.vertices, cloud.n = <const tl_vertex *>data(records), records.shape[0] // <int64_t>sizeof(tl_vertex)
    cloud.size_fx, cloud.sizes_fx = size_fx, &sizes_fx[0] if sizes_fx is not None and sizes_fx.shape[0] else NULL
    cloud.is_disc, cloud.sample_x_fx, cloud.sample_y_fx = is_disc, x_fx, y_fx
    with nogil:
        K.draw_cloud(&cloud, &window, &rows)
    raise_if_given_up()


def png_room(int64_t n_rows, int64_t n_bytes) -> int:
    """Return how many bytes `encode_rows` needs for rows of n_bytes."""
    return tl_png_room(n_rows, n_bytes)


def encode_rows(const uint8_t[:, ::1] pixels, const uint8_t[::1] above, int pixel_bytes, uint32_t adler,
                uint8_t[::1] row, uint8_t[::1] out) -> tuple[int, int]:
    """The kernel `encode_rows`. `above`: the row before the first. Returns Adler-32, too."""
    cdef tl_png_rows rows
    cdef int64_t n
    rows.pixels, rows.above = &pixels[0, 0], &above[0]
    rows.n_rows, rows.n_bytes, rows.pixel_bytes = pixels.shape[0], pixels.shape[1], pixel_bytes
    with nogil:
        n = K.encode_rows(&rows, &row[0], &adler, &out[0])
    return n, adler
