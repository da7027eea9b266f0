# The contract with the kernels, as csrc/topleft.h and its parts have it.

cdef extern from "topleft.h" nogil:
    ctypedef struct tl_vertex:
        int32_t x_fx, y_fx
    ctypedef struct tl_wide:
        pass
    ctypedef int tl_scalar
    ctypedef struct tl_source:
        const void *data
        tl_scalar scalar
        int n_components
        int64_t n
        const void *matrix
        int is_affine
    ctypedef struct tl_exact_counts:
        int64_t n_triangles, n_on_grid, n_asked, n_turns, n_expansions, n_integers
    ctypedef struct tl_exact_pieces:
        double *points
        double *inv_w
        double *weights
        int32_t *triangles
        int32_t *source
        int64_t n_points, n_pieces
    ctypedef struct tl_exact_points:
        const double *points
        int stride
        int64_t n_points
        const int32_t *triangles
        int64_t n_triangles
        const int32_t *names
        const tl_exact_pieces *pieces
        double band
    ctypedef struct tl_vertex_set:
        const tl_vertex *vertices
        const tl_wide *wide
        const double *inv_w
        const tl_source *source
        int64_t n_vertices
        int32_t sample_x_fx, sample_y_fx
        const tl_exact_points *exact
    ctypedef struct tl_vertex_counts:
        int64_t n_bad, n_wide, n_clipped
    ctypedef struct tl_view:
        double half_width_px, half_height_px, guard_band_x, guard_band_y
        int subpixel_bits, zero_to_one, near_clip, far_clip
    ctypedef struct tl_pieces:
        tl_vertex *vertices
        tl_wide *wide
        double *inv_w
        double *weights
        int32_t *triangles
        int32_t *source
        int64_t n_vertices, n_pieces
    ctypedef int tl_test
    ctypedef struct tl_pause:
        int64_t left_px
        int (*ask)(tl_pause *) noexcept nogil
    ctypedef struct tl_window:
        int64_t x_px, y_px, width, height
        int subpixel_bits
        tl_test test
        tl_pause *pause
    ctypedef int tl_cull
    ctypedef int tl_method
    ctypedef int tl_sink
    ctypedef struct tl_census:
        tl_sink sink
        int64_t *n
        double *boxes
        double *covered
    int TL_MAX_LAYERS, TL_SINK_PEEL, TL_SINK_FARTHEST, TL_SINK_SAMPLES, TL_TEST_SAMPLE
    ctypedef struct tl_peeled:
        int n_layers, is_farthest
        int32_t *ids
        float *depth
        int64_t plane_px
    ctypedef struct tl_target:
        tl_sink sink
        void *pixels
        float *depth
        int64_t stride_px
        int64_t n_samples
        uint64_t *covered
        int sample_bits
        const int32_t *samples_fx
        int sample
        int32_t flip
        float *bounds
        const tl_peeled *peeled
    int64_t tl_covered_words(int64_t)
    int64_t tl_segments(int64_t)
    ctypedef struct tl_bins:
        int64_t n
        int32_t *ids
        int32_t *first_band
        int32_t *last_band
        int32_t *first_col
        int32_t *end_col
    ctypedef struct tl_split:
        int64_t *rows
        int32_t *columns
        int32_t *ids
        float *depth
        int64_t room
    ctypedef struct tl_seen_samples:
        const int32_t *first_ids
        const int32_t *ids
        const float *depth
        int64_t first_stride
        int64_t stride
        int64_t plane
        int64_t row0
        int64_t n_rows
        int64_t col0
        int64_t n_cols
        int sample_bits
    ctypedef struct tl_transfer:
        const int32_t *decode
        const uint8_t *encode
        int n_channels
        int is_straight
    ctypedef struct tl_area:
        float *pixels
        int64_t stride_px
        void *cells
        int is_wide, is_clamped
    int64_t TL_CELL_CLEAR, TL_AREA_OVERFLOW, TL_PLANE_DOUBLES
    int64_t tl_area_stride(int64_t width)
    ctypedef int tl_blend
    ctypedef struct tl_canvas:
        void *pixels
        int64_t stride_px
        const void *colors
        int n_channels, is_u8, is_flat
        tl_blend blend
        int is_premultiplied
        const uint8_t *ground
        int is_few
        int is_area
        int64_t band_rows
        int32_t *packed
        int32_t *cells
    int64_t tl_blend_cells(int64_t width)
    ctypedef enum tl_few:
        TL_FEW_OF_BITS
        TL_FEW_STORED
        TL_FEW_LABELLED
    int64_t TL_BLENDED_ROWS
    bint tl_are_few(int64_t n, int n_samples, int64_t width, int64_t height, tl_few most)
    bint tl_few_are_blended(int64_t n, int64_t width, int64_t height)
    ctypedef struct tl_snapped:
        tl_vertex_set mesh
        const int32_t *triangles
        int64_t n_triangles
        const tl_pieces *pieces
        tl_cull cull
        tl_method method
        int32_t first_id
        const int32_t *names
    int32_t TL_CLIPPED
    int64_t TL_CLUSTER, TL_CLUSTER_GROUP, TL_CLUSTER_TAIL, TL_N_FATES
    ctypedef struct tl_cluster:
        double low[3]
        double high[3]
        int64_t first_triangle, first_vertex
        int32_t n_triangles, n_vertices
    ctypedef struct tl_clustered:
        const tl_cluster *clusters
        int64_t n_clusters
        const double *group_boxes
        const uint8_t *corners
        const int32_t *names
    ctypedef struct tl_cluster_view:
        double matrix[16]
        double side[4][2]
        double eye[4]
        double scale_x, scale_y
        double half_width_px, half_height_px
        double sample_px[2]
        int has_one_sample
        double length[3]
        double error
        int near_clip, far_clip, zero_to_one, is_farthest
        tl_cull cull
    ctypedef struct tl_cluster_pass:
        const tl_clustered *mesh
        const tl_cluster_view *seen
        const tl_source *source
        const tl_view *view
        int32_t *list
        void *room
        int may_be_hidden
        int64_t n_seen, n_drawn
    ctypedef struct tl_kernels  # the table, below
    int TL_MESHLET_GROWN, TL_MESHLET_TAIL, TL_N_BOUNDS, TL_GROW_ROOM, TL_GROW_PIECE, TL_MAX_DRAWN_PX, TL_SLOT_PX
    ctypedef struct tl_meshlet:
        pass
    ctypedef struct tl_meshlets:
        const tl_meshlet *meshlets
        const float *bounds
        const uint8_t *n_triangles
        int64_t n_meshlets
        double largest[3]
    ctypedef struct tl_seen_meshlet:
        int32_t meshlet
        int16_t left_px, below_px, reach_x, reach_y
        int16_t n_triangles, side
        float depth
    ctypedef struct tl_meshlet_pass:
        const tl_meshlets *mesh
        const tl_cluster_view *seen
        const tl_source *source
        const tl_view *view
        const tl_window *window
        const tl_target *target
        const tl_kernels *kernels
        int32_t first_id, sample_x_fx, sample_y_fx
    ctypedef struct tl_meshlet_kernels:
        int64_t (*grow)(const tl_source *, const int32_t *, const int32_t *, int64_t, int64_t, int32_t *, void *, tl_meshlet *,
                        float *, uint8_t *) noexcept nogil
        int64_t (*list)(const tl_meshlet_pass *, int64_t, int64_t, tl_seen_meshlet *, int32_t *, int64_t *) noexcept nogil
        int64_t (*draw)(const tl_meshlet_pass *, const tl_seen_meshlet *, int64_t, const int32_t *, int64_t, int32_t, int32_t,
                        int, tl_seen_meshlet *, int32_t *) noexcept nogil
    int64_t tl_most_meshlets(int64_t)
    ctypedef struct tl_share:
        const int32_t *ids
        int64_t first, end
        tl_cluster_pass *clusters
        int32_t *others
        int64_t n_others
        const tl_window *picture
        int is_first, is_last
        tl_exact_counts *counts
    ctypedef struct tl_sloped:
        const int32_t *slot
        const double *steps
        const int32_t *rows
        const float *values
        int64_t n_values
    ctypedef struct tl_composite:
        const int32_t *ids
        int64_t n_triangles, plane_px
        int n_layers, n_channels, is_u8, is_flat
        const void *colors
        const float *background
    ctypedef struct tl_edges:
        tl_vertex_set mesh
        const tl_view *view
        const int32_t *edges
        int64_t n_edges
    ctypedef struct tl_edge_scratch:
        int64_t *starts
        int32_t *last_low
        int32_t *highs
    ctypedef struct tl_line_target:
        int is_smooth
        void *pixels
        const float *depth
        double depth_bias
        int is_farthest
        int64_t stride_px
    enum:
        TL_N_CLASSES, TL_FLIP, TL_SPECIAL, TL_SHORT_SPAN, TL_PLACED, TL_PLACE_BITS, TL_PLACE_LIMIT_PX
    ctypedef struct tl_cloud:
        const tl_vertex *vertices
        int64_t n
        int64_t size_fx
        const int32_t *sizes_fx
        int is_disc
        int32_t sample_x_fx, sample_y_fx
    ctypedef struct tl_fans:
        const int32_t *triangles
        const int32_t *starts
        const int32_t *corners
        const double *normals
        const double *angles
        double least_cosine
    ctypedef struct tl_creases:
        const int32_t *starts
        const int32_t *groups
        const int32_t *own_triangles
        int64_t first_row
        double *of_vertices
        double *of_groups
        int32_t *row_of_corner
    ctypedef int tl_filter
    ctypedef int tl_wrap
    ctypedef int tl_light_kind
    ctypedef int tl_show
    int TL_MAX_LEVELS
    ctypedef struct tl_texture:
        const uint16_t *texels
        int32_t *offset
        int32_t *width
        int32_t *height
        int n_levels
        tl_filter filter
        tl_wrap wrap_u, wrap_v
        int uv_set, has_transform
        float[2][3] transform
        float *tangent
        float hand
    ctypedef struct tl_levels:
        const float *texels
        const int64_t *rows
        int n_levels, n_channels
        tl_filter filter
        tl_wrap wrap_u, wrap_v
    ctypedef struct tl_material:
        float *color
        float *back_color
        float *specular
        float back_side, shininess, cutoff
        int is_unlit
        const tl_texture *texture
        int is_full, is_metallic
        float metallic, roughness, occlusion, normal_scale
        float *emission
        const tl_texture *metallic_roughness
        const tl_texture *occlusion_map
        const tl_texture *normal_map
        const tl_texture *emission_map
    ctypedef int tl_surroundings_kind
    ctypedef struct tl_surroundings:
        tl_surroundings_kind kind
        float[3][4] from_shading
        float *sky
        float *ground
        float diffuse
        const float *texels
        int32_t *offset
        int32_t *size
        int n_levels
    ctypedef struct tl_light:
        tl_light_kind kind
        float *at
        float *color
        float falloff
    ctypedef struct tl_shading:
        const float *normals
        bint finds_inverse_w
        const int32_t *normal_of_corner
        const float *corner_normals
        const float *face_normals
        const void *positions
        int is_f64
        const uint8_t *is_turned
        const float *uv
        const float *uv1
        const float *colors
        int has_alpha
        float front_side
        const int32_t *material_of
        const tl_material *materials
        int n_materials
        const tl_light *lights
        int n_lights
        float *ambient
        const tl_surroundings *surroundings
        int wants_opacity
        tl_show show
        const tl_texture *matcap
        float[3][4] eye_from
        int has_perspective
        float *eye
        float[4][3] ray
        float *fog_color
        float fog_near, fog_scale, distance_start, distance_scale
        const float *decode
        float *background
        uint8_t *background_bytes
    ctypedef struct tl_valued:
        const double *points_px
        const double *values
        const int32_t *triangles
        int64_t n_points, n_triangles
        double *planes
    enum:
        TL_TREE_LEAF
        TL_TREE_WIDTH
        TL_TREE_LEVELS
    ctypedef struct tl_tree_node:
        pass
    ctypedef struct tl_surface:
        const double *points
        const int32_t *triangles
        int64_t n_triangles
        tl_tree_node *nodes
        int64_t *first_node
        int64_t *n_nodes
        int n_levels
        float slack
    enum:
        TL_LENS_RINGS
    ctypedef struct tl_lens:
        int is_fisheye
        double k[6]
        double p[2]
        double s[4]
        double tilt[4]
        int has_prism, is_tilted
        double limit, limit_cosine, limit_sine, slope, least_cosine, cap_cosine, cap_sine
        double px_from_plane[6]
        double tolerance_px, near, plain_cosine
        float ring_scale
        float allowed[TL_LENS_RINGS]
    ctypedef struct tl_bent_parts:
        int64_t n_parts, n_points, most
        int32_t first_point
        int32_t *triangles
        int32_t *source
        double *weights
        uint8_t *is_outline
        double *points
    ctypedef struct tl_reach:
        double known, bound
        int64_t n_pieces
    enum:
        TL_POINT_ROWS
    ctypedef int tl_point_kind
    ctypedef struct tl_points:
        const void *positions
        int is_f64
        tl_point_kind kind
        int n_rows
        double rows[TL_POINT_ROWS][4]
        double half_width_px, half_height_px, background
        int is_f64_out
    enum:
        TL_POLYGON_PAD, TL_PIECE_WORDS, TL_CELL_ROWS, TL_LEAST_SHARE_CELLS
    ctypedef struct tl_polygons:
        const int32_t *x_fx
        const int32_t *y_fx
        const int64_t *wide_fx
        const int64_t *rings
        const int64_t *polygons
        const uint8_t *is_wide
        const int8_t *weights
        const uint8_t *is_simple
        int64_t n_polygons
        int bits, is_nonzero
        int32_t sample_x_fx, sample_y_fx
        tl_pause *pause
    ctypedef struct tl_polygon_box:
        int32_t left, top, right, bottom
    ctypedef int tl_polygon_test
    ctypedef struct tl_label_scratch:
        pass
    ctypedef struct tl_edge_piece:
        pass
    ctypedef struct tl_piece_scratch:
        tl_edge_piece *pieces
        int64_t *room
        int64_t n_pieces
        int64_t *row_starts
        double *shares
    ctypedef struct tl_label_job:
        const int32_t *listed
        int64_t first, end
        const int32_t *values
        const tl_polygon_box *boxes
        tl_polygon_test test
        int64_t width, top, bottom
        int n_bytes
        int32_t background
        int waits
        void *pixels
        int32_t *cells
        tl_label_scratch *scratch
        tl_piece_scratch *pieces
    ctypedef struct tl_share_job:
        const int32_t *listed
        int64_t first, end
        const tl_polygon_box *boxes
        int64_t width, top, bottom
        int32_t *cells
        int64_t n_cells
        tl_piece_scratch *pieces
        float *pixels
        const float *colors
        int n_channels, is_alone
        int64_t *starts
        void *indices
        float *areas
        int is_long
        int64_t n_room
    int64_t tl_polygon_stride(int64_t width)
    int64_t tl_certify_words(int64_t n_points, int64_t n_rings)
    ctypedef struct tl_tiling:
        int64_t width_px, height_px, window_width_px, window_height_px
        int subpixel_bits
    ctypedef struct tl_window_span:
        int32_t triangle, first, end
    ctypedef struct tl_window_box:
        int32_t left, right, top, bottom
    ctypedef struct tl_corners:
        const char *points
        int64_t point_stride, point_bytes, n_points
        const char *triangles
        int64_t triangle_stride
        int is_wide
    ctypedef enum tl_merge_rule:
        pass
    ctypedef struct tl_merge:
        int32_t *ids
        float *depth
        const int32_t *other_ids
        const float *other_depth
        int32_t first_id
        tl_merge_rule rule
    ctypedef struct tl_kernels:
        void (*shade_normals)(const tl_snapped *, const tl_window *, const tl_view *, const tl_shading *, const int32_t *, float *) noexcept nogil
        void (*fill_points)(const tl_snapped *, const tl_window *, const tl_points *, const int32_t *, void *) noexcept nogil
        void (*set_inverse_w)(const tl_source *, const float *, int64_t, int64_t, float *) noexcept nogil
        void (*cut_out)(const tl_snapped *, const tl_window *, const tl_view *, const tl_shading *, const int32_t *, int64_t, const tl_target *) noexcept nogil
        void (*shade_samples)(const tl_snapped *, const tl_window *, const tl_view *, const tl_shading *, const int32_t *, int, int64_t, const int32_t *, const float *, const tl_split *, uint8_t *) noexcept nogil
        void (*shade)(const tl_snapped *, const tl_window *, const tl_view *, const tl_shading *, const int32_t *, const float *, uint8_t *) noexcept nogil
        tl_vertex_counts (*snap)(const tl_source *, int64_t, int64_t, int, int, tl_vertex *, tl_wide *) noexcept nogil
        tl_vertex_counts (*project)(const tl_source *, int64_t, int64_t, const tl_view *, tl_vertex *, tl_wide *) noexcept nogil
        void (*clip)(const tl_source *, const tl_vertex *, const int32_t *, const int32_t *, int64_t, const tl_view *, tl_pieces *) noexcept nogil
        int64_t (*mark_vertices)(const int32_t *, int64_t, const int32_t *, int64_t, int64_t, int, uint8_t *) noexcept nogil
        void (*place_on_curve)(const tl_source *, const int32_t *, int64_t, int64_t, const double *, uint32_t *) noexcept nogil
        void (*sort_keys)(const uint32_t *, int64_t, uint64_t *, uint64_t *, int32_t *) noexcept nogil
        int64_t (*cut_clusters)(const int32_t *, const int32_t *, int64_t, int32_t *, tl_cluster *, int32_t *, uint8_t *, int64_t *) noexcept nogil
        void (*measure_clusters)(const tl_source *, const uint8_t *, int64_t, int64_t, tl_cluster *, double *) noexcept nogil
        void (*survey_clusters)(const tl_clustered *, const tl_cluster_view *, int64_t, int64_t *) noexcept nogil
        void (*find_shown)(const tl_cluster_view *, const double *, const double *, int64_t, const tl_window *, const tl_target *, uint8_t *) noexcept nogil
        int64_t (*count_hidden)(const tl_clustered *, const tl_cluster_view *, const tl_window *, const tl_target *, int64_t,
                                int64_t *) noexcept nogil
        int64_t (*first_bad)(const tl_vertex *, int64_t, const int32_t *, int64_t) noexcept nogil
        int64_t (*first_bad_row)(const int32_t *, int64_t, int64_t) noexcept nogil
        int64_t (*narrow_triangles)(const int64_t *, int64_t, int64_t, int32_t *) noexcept nogil
        int64_t (*draw)(const tl_snapped *, const tl_window *, const tl_target *, tl_share *) noexcept nogil
        tl_vertex_counts (*project_points)(const tl_source *, int64_t, int64_t, const tl_view *, double *) noexcept nogil
        void (*clip_points)(const tl_source *, const double *, const int32_t *, int64_t, const tl_view *, tl_exact_pieces *) noexcept nogil
        int64_t (*take_points)(const tl_source *, int64_t, int64_t, int, double *) noexcept nogil
        int64_t (*count_classes)(const tl_snapped *, const tl_window *, const tl_target *, tl_census *) noexcept nogil
        void (*set_flat_depth)(int32_t *, int64_t, int32_t, float, float, float *) noexcept nogil
        int64_t (*bin)(const tl_snapped *, const tl_window *, int32_t, int, tl_bins *) noexcept nogil
        void (*list_bins)(const tl_bins *, int64_t, int64_t *, int32_t *) noexcept nogil
        void (*find_columns)(const tl_bins *, int64_t, int32_t *) noexcept nogil
        int64_t (*split_pixels)(const tl_seen_samples *, const tl_split *, int64_t) noexcept nogil
        void (*spread_ids)(const tl_split *, int, int64_t, int64_t, const int32_t *, int32_t *) noexcept nogil
        void (*find_instances)(const int32_t *, int64_t, int64_t, const int64_t *, int64_t, int32_t *, int32_t *) noexcept nogil
        int64_t (*draw_area)(const tl_snapped *, const tl_window *, const tl_area *) noexcept nogil
        int64_t (*blend)(const tl_snapped *, const tl_window *, const tl_canvas *) noexcept nogil
        int64_t (*fill_few)(const tl_snapped *, const tl_window *, const tl_canvas *, const int32_t *, int, const tl_transfer *) noexcept nogil
        void (*inverse_w)(const tl_source *, int64_t, int64_t, double *) noexcept nogil
        void (*barycentric)(const tl_snapped *, const tl_window *, const int32_t *, float *) noexcept nogil
        void (*interpolate)(const tl_snapped *, const tl_window *, const int32_t *, const float *, int, int, float, float *) noexcept nogil
        void (*paint_flat)(const int32_t *, int64_t, const uint8_t *, int, const uint8_t *, uint8_t *) noexcept nogil
        void (*paint_gouraud)(const tl_snapped *, const tl_window *, const int32_t *, const void *, int, int, void *) noexcept nogil
        void (*fill_slopes)(const tl_sloped *, const int32_t *, const float *, int64_t, float *) noexcept nogil
        void (*fill_texels)(const tl_levels *, const int32_t *, const float *, const float *, float, int64_t, float *) noexcept nogil
        void (*halve_rows)(const float *, int64_t, int64_t, int, int64_t, int64_t, float *) noexcept nogil
        void (*composite)(const tl_composite *, int64_t, void *) noexcept nogil
        void (*drop_sides)(const tl_snapped *, const uint8_t *, int64_t, int64_t, int32_t *) noexcept nogil
        int64_t (*list_edges)(const tl_snapped *, const tl_edge_scratch *, uint64_t *, int64_t *) noexcept nogil
        void (*draw_cloud)(const tl_cloud *, const tl_window *, const tl_target *) noexcept nogil
        void (*draw_lines)(const tl_edges *, const tl_window *, const tl_line_target *) noexcept nogil
        void (*list_planes)(const tl_valued *, int64_t, int64_t) noexcept nogil
        void (*fill_planes)(const tl_valued *, const tl_window *, const int32_t *, int, void *) noexcept nogil
        void (*mean_flat)(const int32_t *, int, int64_t, int64_t, const void *, int, int, const tl_transfer *, void *) noexcept nogil
        void (*mean_colors)(const void *, int, int64_t, int64_t, int, int, const tl_transfer *, void *) noexcept nogil
        int64_t (*vertex_normals)(const tl_source *, const int32_t *, int64_t, int64_t, int64_t, double *) noexcept nogil
        int64_t (*face_normals)(const tl_source *, const int32_t *, int64_t, int64_t, double *, float *) noexcept nogil
        int64_t (*find_turned)(const tl_source *, const int32_t *, int64_t, int64_t, const float *, const int32_t *, uint8_t *) noexcept nogil
        int64_t (*face_angles)(const tl_source *, const int32_t *, int64_t, int64_t, double *, double *) noexcept nogil
        void (*list_corners)(const int32_t *, int64_t, int64_t, int32_t *, int32_t *) noexcept nogil
        void (*find_creases)(const tl_fans *, int64_t, int64_t, uint64_t *, int32_t *, int32_t *) noexcept nogil
        void (*sum_creases)(const tl_fans *, const tl_creases *, int64_t, int64_t) noexcept nogil
        int64_t (*box_of_faces)(const tl_source *, const int32_t *, int64_t, int64_t, double *) noexcept nogil
        void (*unit_vectors)(const tl_source *, const double *, int64_t, int64_t, double *, float *) noexcept nogil
        void (*move_points)(const tl_source *, const double *, int64_t, int64_t, double *) noexcept nogil
        void (*color_rows)(const uint8_t *, int, int64_t, int64_t, float *) noexcept nogil
        int64_t (*group_rows)(const uint32_t *, int, int64_t, int, int32_t *, int32_t *, int32_t *) noexcept nogil
        void (*bend_vertices)(const tl_lens *, const tl_source *, const double *, int64_t, int64_t, double *, float *) noexcept nogil
        void (*see_points)(const tl_lens *, const double *, int64_t, double *) noexcept nogil
        int64_t (*find_bent)(const tl_lens *, const float *, int64_t, const int32_t *, int64_t, int64_t, int32_t *, int32_t *, int64_t *) noexcept nogil
        void (*split_bent)(const tl_lens *, const double *, const float *, int64_t, const int32_t *, const int32_t *, int64_t, tl_bent_parts *) noexcept nogil
        void (*build_tree)(tl_surface *) noexcept nogil
        double (*find_nearest)(const tl_surface *, const double *, int64_t, int64_t, int32_t *, double *) noexcept nogil
        void (*find_reach)(const tl_surface *, const double *, const int32_t *, int64_t, int64_t, double, double, tl_reach *) noexcept nogil
        void (*set_feet)(const double *, const int32_t *, const double *, const int32_t *, const int32_t *, int64_t, double *, double *) noexcept nogil
        tl_vertex_counts (*snap_points)(const tl_source *, int64_t, int64_t, int, int, const int64_t *, int32_t *, int32_t *, int64_t *) noexcept nogil
        int64_t (*bound_polygons)(const tl_polygons *, int64_t, int64_t, int64_t, int64_t, uint8_t *, tl_polygon_box *) noexcept nogil
        void (*sort_polygons)(const tl_polygon_box *, int64_t, int64_t, int64_t, int64_t *, int32_t *) noexcept nogil
        void (*certify_polygons)(const tl_polygons *, int64_t, int64_t, int8_t *, uint8_t *, int64_t *) noexcept nogil
        void (*trust_polygons)(const tl_polygons *, int64_t, int64_t, int8_t *, uint8_t *) noexcept nogil
        void (*mask_even_odd)(const tl_polygons *, int64_t, int64_t, int64_t, int64_t, uint64_t *, uint8_t *) noexcept nogil
        void (*mask_nonzero)(const tl_polygons *, int64_t, int64_t, int64_t, int64_t, uint32_t *, int32_t *, int64_t, int32_t *, uint64_t *, uint8_t *) noexcept nogil
        void (*label_polygons)(const tl_polygons *, const tl_label_job *) noexcept nogil
        int64_t (*share_polygons)(const tl_polygons *, const tl_share_job *) noexcept nogil
        int64_t (*list_spans)(const tl_tiling *, const double *, int64_t, int64_t, tl_window_box *, int64_t *, tl_window_span *) noexcept nogil
        int64_t (*sort_spans)(const tl_window_span *, int64_t, int64_t *, int32_t *) noexcept nogil
        void (*count_windows)(const tl_window_span *, const int64_t *, int64_t, int64_t, int32_t *) noexcept nogil
        int64_t (*take_corners)(const tl_corners *, const int32_t *, int64_t, int64_t, void *) noexcept nogil
        void (*merge_fragments)(const tl_merge *, int64_t, int64_t) noexcept nogil
        void (*name_triangles)(int32_t *, int64_t, int64_t, const int32_t *) noexcept nogil
