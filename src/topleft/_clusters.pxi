# Meshes that are sorted into clusters, and passes that draw what a view needs of them. Included by _engine.pyx.

CLUSTER = TL_CLUSTER
CLUSTER_GROUP = TL_CLUSTER_GROUP
CLUSTER_TAIL = TL_CLUSTER_TAIL
CLUSTER_BYTES = sizeof(tl_cluster)


def order_triangles(Source source, const int32_t[:, ::1] triangles, const double[::1] box, uint32_t[::1] keys, uint64_t[:, ::1] room, int32_t[::1] order):
    """Write the order of triangles along a curve that keeps neighbours together; `box`: low and high of the vertices.

    `keys` and `order` have a number a triangle, `room` has two rows of them.
    """
    cdef int64_t n = triangles.shape[0]
    if n:
        with nogil:
            K.place_on_curve(&source.source, &triangles[0, 0], 0, n, &box[0], &keys[0])
            K.sort_keys(&keys[0], n, &room[0, 0], &room[1, 0], &order[0])


def cut_clusters(const int32_t[:, ::1] triangles, const int32_t[::1] order, int32_t[::1] seen, uint8_t[::1] clusters, int32_t[::1] vertices,
                 uint8_t[:, ::1] corners):
    """Cut sorted triangles into clusters; returns how many, and how many vertices of the mesh `vertices` then lists for them.

    `seen`: -1 for each vertex of the mesh; `clusters` has room for one a triangle, `vertices` for three.
    """
    cdef int64_t n = triangles.shape[0], n_clusters = 0, n_used = 0
    if n:
        with nogil:
            n_clusters = K.cut_clusters(&triangles[0, 0], &order[0], n, &seen[0], <tl_cluster *>&clusters[0], &vertices[0], &corners[0, 0], &n_used)
    return n_clusters, n_used


def measure_clusters(Source source, const uint8_t[:, ::1] corners, uint8_t[::1] clusters, double[:, ::1] group_boxes, int64_t first, int64_t end):
    """Measure the clusters [first, end), of whole groups, and the boxes of these."""
    if end > first:
        with nogil:
            K.measure_clusters(&source.source, &corners[0, 0], first, end, <tl_cluster *>&clusters[0], &group_boxes[0, 0])


cdef class ClusterView:
    """A window of a picture, as far as clusters are concerned; `tl_cluster_view` tells what the arrays hold."""

    cdef tl_cluster_view view

    def __init__(self, matrix, sides, eye, viewport, int subpixel_bits, lengths, double error, bint near_clip, bint far_clip,
                 bint zero_to_one, bint is_farthest, int cull):
        cdef tl_cluster_view *v = &self.view
        cdef int i
        for i in range(16):
            v.matrix[i] = matrix.flat[i]
        for i in range(4):
            v.side[i][0], v.side[i][1] = sides[i]
            v.eye[i] = eye[i]
        for i in range(3):
            v.length[i] = lengths[i]
        v.half_width_px, v.half_height_px = viewport[0] / 2, viewport[1] / 2
        v.scale_x, v.scale_y = v.half_width_px * 2.0**subpixel_bits, v.half_height_px * 2.0**subpixel_bits
        v.error, v.near_clip, v.far_clip, v.zero_to_one = error, near_clip, far_clip, zero_to_one
        v.is_farthest, v.cull = is_farthest, <tl_cull>cull


cdef class Clustered:
    """A mesh in object space, sorted into clusters; keeps what it points to alive."""

    cdef tl_clustered mesh
    cdef object arrays
    cdef readonly int64_t n_triangles

    def __init__(self, const uint8_t[::1] clusters, const double[:, ::1] group_boxes, const uint8_t[:, ::1] corners, const int32_t[::1] names):
        self.arrays = clusters, group_boxes, corners, names
        self.n_triangles = corners.shape[0]
        self.mesh.n_clusters = clusters.shape[0] // <int64_t>sizeof(tl_cluster)
        if self.mesh.n_clusters:
            self.mesh.clusters, self.mesh.group_boxes = <const tl_cluster *>&clusters[0], &group_boxes[0, 0]
            self.mesh.corners, self.mesh.names = &corners[0, 0], &names[0]

    def __len__(self):
        return self.mesh.n_clusters

    def cull(self, ClusterView view, int32_t[::1] listed, uint64_t[::1] room):
        """List the clusters that may draw something, in the order in which they are drawn; returns how many.

        `listed` and `room` have a number for each cluster.
        """
        cdef int64_t n = 0
        if self.mesh.n_clusters:
            with nogil:
                n = K.cull_clusters(&self.mesh, &view.view, &listed[0], &room[0])
        return n

    def count_triangles(self, const int32_t[::1] listed):
        """Return how many triangles some clusters have."""
        cdef int64_t i, n = 0
        for i in range(listed.shape[0]):
            n += self.mesh.clusters[listed[i]].n_triangles
        return n

    def draw(self, Scene scene, Source source, View view, ClusterView seen, const int32_t[::1] listed, bint may_be_hidden, Target target,
             int64_t first_row, int64_t n_rows, int32_t[::1] others, bint is_first, bint is_last):
        """Draw clusters into rows of a picture.

        `scene`: how, and what triangle 0 is called; its own triangles are not read. `others`, a number for each triangle,
        gets those that a clip plane may cut, or that 64 bits cannot hold. Returns how many of these there are, and how many
        clusters were not hidden.
        """
        cdef tl_target rows = target.rows(first_row)
        cdef tl_window window = scene.window(first_row, n_rows, target.width)
        cdef tl_share share = no_share()
        cdef tl_cluster_pass clusters
        memset(&clusters, 0, sizeof(clusters))
        clusters.mesh, clusters.seen, clusters.source, clusters.view = &self.mesh, &seen.view, &source.source, &view.view
        clusters.list, clusters.n_listed, clusters.may_be_hidden = &listed[0] if listed.shape[0] else NULL, listed.shape[0], may_be_hidden
        share.clusters, share.others, share.is_first, share.is_last = &clusters, &others[0], is_first, is_last
        with nogil:
            K.draw(&scene.scene, &window, &rows, &share)
        return share.n_others, clusters.n_drawn
