# Meshes sorted into clusters, and passes that draw the visible clusters.

CLUSTER = TL_CLUSTER
CLUSTER_GROUP = TL_CLUSTER_GROUP
CLUSTER_TAIL = TL_CLUSTER_TAIL
CLUSTER_BYTES = sizeof(tl_cluster)
BLOCK = VERTEX_BLOCK


def mark_vertices(const int32_t[::1] ids, const int32_t[:, ::1] corners, int64_t n_vertices,
                  uint8_t[::1] is_used) -> int:
    """The kernel `mark_vertices`. An id of -1 is of no triangle."""
    cdef int64_t bad
    if not (ids.shape[0] and corners.shape[0]):
        return -1
    with nogil:
        bad = K.mark_vertices(&ids[0], ids.shape[0], &corners[0, 0], corners.shape[0], n_vertices, VERTEX_BLOCK_BITS, &is_used[0])
    return bad


def list_cut(const int32_t[::1] ids, const int32_t[:, ::1] corners, const uint8_t[::1] records,
             int32_t[::1] cut) -> int:
    """List the triangles of `ids` that a clip plane may cut, maybe more than once; returns how many."""
    cdef const tl_vertex *vertices = <const tl_vertex *>data(records)
    cdef const tl_vertex *v
    cdef int64_t i, k, n_cut = 0, n = ids.shape[0]
    cdef int32_t last = -1
    with nogil:
        for i in range(n):
            if ids[i] != last and ids[i] >= 0:
                for k in range(3):
                    v = vertices + corners[ids[i], k]
                    if v.x_fx == TL_SPECIAL and v.y_fx == TL_CLIPPED:
                        cut[n_cut] = ids[i]
                        n_cut += 1
                        break
            last = ids[i]
    return n_cut


def order_triangles(Source source, const int32_t[:, ::1] triangles, const double[::1] box, uint32_t[::1] keys,
                    uint64_t[:, ::1] room, int32_t[::1] order):
    """Write the order of triangles along a curve that keeps neighbours together; `box`: low and high of the vertices.

    `keys` (T,), `order` (T,); `room` (2, T).
    """
    cdef int64_t n = triangles.shape[0]
    if n:
        with nogil:
            K.place_on_curve(&source.source, &triangles[0, 0], 0, n, &box[0], &keys[0])
            K.sort_keys(&keys[0], n, &room[0, 0], &room[1, 0], &order[0])


def cut_clusters(const int32_t[:, ::1] triangles, const int32_t[::1] order, int32_t[::1] seen, uint8_t[::1] clusters,
                 int32_t[::1] vertices, uint8_t[:, ::1] corners) -> tuple[int, int]:
    """The kernel `cut_clusters`.

    Returns the numbers of clusters and of their vertices; `clusters` has room for T clusters, `vertices` for 3 T numbers.
    """
    cdef int64_t n = triangles.shape[0], n_clusters = 0, n_used = 0
    if n:
        with nogil:
            n_clusters = K.cut_clusters(&triangles[0, 0], &order[0], n, &seen[0], <tl_cluster *>&clusters[0], &vertices[0], &corners[0, 0], &n_used)
    return n_clusters, n_used


def measure_clusters(Source source, const uint8_t[:, ::1] corners, uint8_t[::1] clusters, double[:, ::1] group_boxes,
                     int64_t first, int64_t end):
    """The kernel `measure_clusters`."""
    if end > first:
        with nogil:
            K.measure_clusters(&source.source, &corners[0, 0], first, end, <tl_cluster *>&clusters[0], &group_boxes[0, 0])


cdef inline double minor(const double *a, const double *b, const double *c, int i, int j, int k) noexcept nogil:
    """The determinant of three columns of three rows."""
    return a[i] * (b[j] * c[k] - b[k] * c[j]) - a[j] * (b[i] * c[k] - b[k] * c[i]) + a[k] * (b[i] * c[j] - b[j] * c[i])


cdef class ClusterView:
    """Rows of a picture's window, for tests of clusters: `tl_cluster_view`."""

    cdef tl_cluster_view view

    def __init__(self, Source source, SnappedMesh mesh, int64_t first_row, int64_t n_rows, int64_t width,
                 double margin_px, double error, tl_sink sink):
        """`source`: clip from object; `mesh`: viewport, sample and culling; nothing beyond `margin_px` round the window shows.

        `error`: of the vertex stage, as a share of the terms that it adds up; `sink`: that of covered samples.
        """
        cdef tl_cluster_view *v = &self.view
        cdef const tl_view *how = &mesh.viewport.view
        cdef tl_window window = mesh.window(first_row, n_rows, width)
        cdef double *x = v.matrix
        cdef double *y = v.matrix + 4
        cdef double *w = v.matrix + 12
        cdef double unit = 2.0**window.subpixel_bits
        cdef int i
        for i in range(16):
            v.matrix[i] = source.matrix.flat[i]
        v.half_width_px, v.half_height_px = how.half_width_px, how.half_height_px
        v.scale_x, v.scale_y = how.half_width_px * unit, how.half_height_px * unit
        v.side[0][0], v.side[0][1] = how.half_width_px, how.half_width_px - (window.x_px - margin_px)
        v.side[1][0], v.side[1][1] = -how.half_width_px, (window.x_px + window.width + margin_px) - how.half_width_px
        v.side[2][0], v.side[2][1] = -how.half_height_px, how.half_height_px - (window.y_px - margin_px)
        v.side[3][0], v.side[3][1] = how.half_height_px, (window.y_px + window.height + margin_px) - how.half_height_px
        v.eye[0], v.eye[1] = minor(x, y, w, 1, 2, 3), -minor(x, y, w, 0, 2, 3)
        v.eye[2], v.eye[3] = minor(x, y, w, 0, 1, 3), -minor(x, y, w, 0, 1, 2)
        v.length[0] = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
        v.length[1] = sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2])
        v.length[2] = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
        v.error, v.near_clip, v.far_clip, v.zero_to_one = error, how.near_clip, how.far_clip, how.zero_to_one
        v.is_farthest, v.cull = sink == TL_SINK_FARTHEST, mesh.snapped.cull
        v.has_one_sample = window.test == TL_TEST_SAMPLE and sink != TL_SINK_SAMPLES
        v.sample_px[0], v.sample_px[1] = 0.5 + mesh.snapped.mesh.sample_x_fx / unit, 0.5 + mesh.snapped.mesh.sample_y_fx / unit


def find_shown(SnappedMesh mesh, ClusterView view, const double[:, ::1] boxes, const double[:, :, ::1] matrices,
               Target target, bint is_drawn, uint8_t[::1] shown):
    """The kernel `find_shown`.

    `boxes` (N, 6), `matrices` (N, 4, 4); `view`: with any matrix; `mesh`: viewport, sample and culling; target unless
    `is_drawn`: NULL.
    """
    cdef tl_window window = mesh.window(0, target.height, target.width)
    cdef tl_target rows = target.rows(0)
    if boxes.shape[0]:
        with nogil:
            K.find_shown(&view.view, &boxes[0, 0], &matrices[0, 0, 0], boxes.shape[0], &window, &rows if is_drawn else NULL, &shown[0])


cdef class Clustered:
    """A mesh in object space, sorted into clusters; keeps its arrays alive."""

    cdef tl_clustered mesh
    cdef object arrays
    cdef readonly int64_t n_triangles

    def __init__(self, const uint8_t[::1] clusters, const double[:, ::1] group_boxes, const uint8_t[:, ::1] corners,
                 const int32_t[::1] names):
        self.arrays = clusters, group_boxes, corners, names
        self.n_triangles = corners.shape[0]
        self.mesh.n_clusters = clusters.shape[0] // <int64_t>sizeof(tl_cluster)
        if self.mesh.n_clusters:
            self.mesh.clusters, self.mesh.group_boxes = <const tl_cluster *>&clusters[0], &group_boxes[0, 0]
            self.mesh.corners, self.mesh.names = &corners[0, 0], &names[0]

    def __len__(self) -> int:
        return self.mesh.n_clusters

    def survey(self, ClusterView view, int64_t step, int64_t[::1] n_of):
        """Count every `step`-th cluster in `n_of`, by its `tl_visibility`."""
        if n_of.shape[0] != TL_N_VISIBILITIES:
            raise ValueError("n_of must have a number for each `tl_visibility`")
        with nogil:
            K.survey_clusters(&self.mesh, &view.view, step, &n_of[0])

    def draw(self, SnappedMesh mesh, Source source, ClusterView seen, bint may_be_hidden, Target target,
             int64_t first_row, int64_t n_rows, int32_t[::1] room, int32_t[::1] others, bint is_first,
             bint is_last) -> tuple[int, int, int]:
        """Draw the clusters that rows of a picture show.

        `mesh`: viewport, culling, id of triangle 0; its triangles are not read. `room`: (3 N + 1,) for N clusters.
        `others` (T,): receives the triangles that a clip plane may cut, or that 64 bits cannot hold. Returns how many
        triangles that are, how many clusters the window may show, and how many of these clusters were not hidden.
        """
        cdef tl_target rows = target.rows(first_row)
        cdef tl_window window = mesh.window(first_row, n_rows, target.width)
        cdef tl_slice slice = no_slice()
        cdef tl_cluster_pass clusters
        memset(&clusters, 0, sizeof(clusters))
        clusters.mesh, clusters.seen, clusters.source, clusters.view = &self.mesh, &seen.view, &source.source, &mesh.viewport.view
        clusters.list, clusters.room, clusters.may_be_hidden = &room[0], &room[self.mesh.n_clusters], may_be_hidden
        slice.clusters, slice.outside, slice.is_first, slice.is_last = &clusters, &others[0], is_first, is_last
        with nogil:
            K.draw_mesh(&mesh.snapped, &window, &rows, &slice)
        raise_if_given_up()
        return slice.n_outside, clusters.n_seen, clusters.n_drawn
