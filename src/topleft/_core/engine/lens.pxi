# Meshes behind a lens: distorts vertices, and splits triangles into parts with straight sides in the picture.


cdef class LensTable:
    """A lens and the picture behind it, for kernels: `tl_lens`."""

    cdef tl_lens lens

    def __init__(self, bint is_fisheye, k: Sequence[float], p: Sequence[float], s: Sequence[float], tilt: Sequence[float],
                 px_from_plane: Sequence[Sequence[float]], double tolerance_px):
        """The terms: k (6,), p (2,), s (4,); `tilt`: cosine and sine of tau_x, then of tau_y; `px_from_plane` (2, 3)."""
        cdef int i
        memset(&self.lens, 0, sizeof(self.lens))
        self.lens.is_fisheye, self.lens.tolerance_px, self.lens.plain_chord = is_fisheye, tolerance_px, -1.0
        self.lens.has_prism, self.lens.is_tilted = any(s), bool(tilt[1] or tilt[3])
        for i in range(6):
            self.lens.k[i], self.lens.px_from_plane[i] = k[i], px_from_plane[i // 3][i % 3]
        for i in range(4):
            self.lens.s[i], self.lens.tilt[i] = s[i], tilt[i]
        self.lens.p[0], self.lens.p[1] = p

    def go_on_from(self, double limit, double cosine, double sine, double slope):
        """Extend the lens linearly beyond an angle."""
        self.lens.limit, self.lens.limit_cosine, self.lens.limit_sine, self.lens.slope = limit, cosine, sine, slope

    def set_frame(self, double least_cosine, double cap_cosine, double cap_sine):
        """Set the least range over the distance, and the angle from the axis beyond which nothing shows."""
        self.lens.least_cosine, self.lens.cap_cosine, self.lens.cap_sine = least_cosine, cap_cosine, cap_sine

    def set_rings(self, double cosine, const float[::1] allowed):
        """Set the squared chords that are straight in rings up to the angle of this cosine."""
        cdef int i
        self.lens.plain_chord = 2.0 * (1.0 - cosine)
        self.lens.ring_scale = TL_LENS_RINGS * TL_LENS_RINGS / self.lens.plain_chord
        for i in range(TL_LENS_RINGS):
            self.lens.allowed[i] = allowed[i]

    def places(self, const double[:, ::1] points) -> F64:
        """The kernel `see_points`."""
        cdef double[:, ::1] out = np.empty((points.shape[0], 2))
        if points.shape[0]:
            with nogil:
                K.see_points(&self.lens, &points[0, 0], points.shape[0], &out[0, 0])
        return np.asarray(out)

    def bend_vertices(self, Source source, const double[:, ::1] eye_from, double near, int64_t first, int64_t end,
                      double[:, ::1] bent, float[:, ::1] records):
        """The kernel `bend_vertices`."""
        cdef tl_lens lens = self.lens
        lens.near = near
        if end > first:
            with nogil:
                K.bend_vertices(&lens, &source.source, &eye_from[0, 0], first, end, &bent[0, 0], &records[0, 0])

    def find_bent(self, const float[:, ::1] records, const int32_t[:, ::1] triangles, int64_t first, int64_t end,
                  int32_t[::1] bent, int32_t[::1] outside) -> tuple[int, int]:
        """The kernel `find_bent`."""
        cdef int64_t n_bent = 0, n_outside = 0
        if end > first:
            with nogil:
                n_bent = K.find_bent(&self.lens, &records[0, 0], records.shape[0], &triangles[0, 0], first, end, &bent[0],
                                     &outside[0], &n_outside)
        return n_bent, n_outside

    def count_parts(self, const double[:, ::1] points, const float[:, ::1] records, const int32_t[:, ::1] triangles,
                    const int32_t[::1] ids, double near, int64_t most) -> tuple[int, int]:
        """Return how many parts listed triangles have, up to `most` and a few, and how many points the parts add."""
        cdef tl_bent_parts parts
        memset(&parts, 0, sizeof(parts))
        self.split(points, records, triangles, ids, near, most, &parts)
        return parts.n_parts, parts.n_points

    def write_parts(self, const double[:, ::1] points, const float[:, ::1] records, const int32_t[:, ::1] triangles,
                    const int32_t[::1] ids, double near, int32_t[:, ::1] part_corners, int32_t[::1] source,
                    double[:, :, ::1] weights, uint8_t[:, ::1] is_outline, double[:, ::1] part_points):
        """Write the parts that `count_parts` has counted; their points are numbered from the number of vertices on."""
        cdef tl_bent_parts parts
        memset(&parts, 0, sizeof(parts))
        if part_corners.shape[0]:
            parts.triangles, parts.source, parts.weights = &part_corners[0, 0], &source[0], &weights[0, 0, 0]
            parts.is_outline, parts.first_point = &is_outline[0, 0], <int32_t>points.shape[0]
            parts.points = &part_points[0, 0] if part_points.shape[0] else NULL
            self.split(points, records, triangles, ids, near, part_corners.shape[0], &parts)

    cdef void split(self, const double[:, ::1] points, const float[:, ::1] records, const int32_t[:, ::1] triangles,
                    const int32_t[::1] ids, double near, int64_t most, tl_bent_parts *parts):
        cdef tl_lens lens = self.lens
        lens.near, parts.most = near, most
        if ids.shape[0]:
            with nogil:
                K.split_bent(&lens, &points[0, 0], &records[0, 0], points.shape[0], &triangles[0, 0], &ids[0],
                             ids.shape[0], parts)
