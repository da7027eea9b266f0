/* The kernels of an instruction set: TL_KERNEL(result, name, parameters ...), which is a member of the table at the end
 * of topleft.h.  A section has the kernels of a unit, which unit_*.c includes and the build compiles by itself; where
 * TL_KERNELS_OF is defined, it alone is read.  Part of the contract of topleft.h. */
#include "topleft.h" /* read by itself: the types */

#define TL_UNIT_raster 1
#define TL_UNIT_pixels 2
#define TL_UNIT_blend 3
#define TL_UNIT_shade 4
#define TL_UNIT_polygons 5
#define TL_UNIT_grad 6

#ifndef TL_KERNEL
#define TL_KERNEL(result, name, ...)
#endif

#if !TL_KERNELS_OF || TL_KERNELS_OF == TL_UNIT_raster
/* The pixels of vertices [first, end) to snapped vertices.  z is read when with_depth and n_components = 3. `wide` may
 * be NULL: wide vertices are then counted, and the caller comes again with a table. */
TL_KERNEL(tl_vertex_counts, snap, const tl_source *source, int64_t first, int64_t end, int subpixel_bits,
          int with_depth, tl_vertex *out, tl_wide *wide)

/* The clip space, or object space by the matrix, of vertices [first, end) to snapped vertices, with a table of wide
 * ones or NULL, as above; or to points of TL_PLACED numbers each.  A point that cannot be drawn has x NaN, and y says
 * why: a tl_special. */
TL_KERNEL(tl_vertex_counts, project, const tl_source *source, int64_t first, int64_t end, const tl_view *view,
          const tl_projected *out)

/* Cuts the triangles that have clipped vertices: of all n, or of the n in ids, which ascend.  With pieces->source NULL
 * only counts. */
TL_KERNEL(void, clip, const tl_source *source, const tl_projected *projected, const int32_t *triangles,
          const int32_t *ids, int64_t n, const tl_view *view, tl_pieces *pieces)

/* Marks the blocks of 2^block_bits vertices that the triangles among n ids use; returns -1, or one of them with an
 * index outside [0, n_vertices). */
TL_KERNEL(int64_t, mark_vertices, const int32_t *ids, int64_t n, const int32_t *triangles, int64_t n_triangles,
          int64_t n_vertices, int block_bits, uint8_t *is_used)

/* Where the middles of triangles lie on a curve that keeps neighbours together; `box` is low and high of the
 * vertices. */
TL_KERNEL(void, place_on_curve, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
          const double *box, uint32_t *keys)

/* The order of n keys, equal ones as they stand; `room` has n pairs. */
TL_KERNEL(void, sort_keys, const uint32_t *keys, int64_t n, uint64_t *room, uint64_t *other_room, int32_t *order)

/* Cuts the triangles in `order` into clusters: sets their ranges, the mesh's vertices that theirs are, corners and
 * names.  `seen` is (n_vertices,), -1.  Returns the number of clusters; *n_used is that of their vertices. */
TL_KERNEL(int64_t, cut_clusters, const int32_t *triangles, const int32_t *order, int64_t n, int32_t *seen,
          tl_cluster *clusters, int32_t *vertices, uint8_t *corners, int64_t *n_used)

/* Measures clusters [first, end), a multiple of TL_CLUSTER_GROUP, with vertices in `source`, and the boxes of their
 * groups. */
TL_KERNEL(void, measure_clusters, const tl_source *source, const uint8_t *corners, int64_t first, int64_t end,
          tl_cluster *clusters, double *group_boxes)

/* Counts some clusters, one of each `step`, by their visibility in a view, hidden or not: outside of the window, turned
 * away and culled, showing their backs, the others. */
TL_KERNEL(void, survey_clusters, const tl_clustered *mesh, const tl_cluster_view *view, int64_t step,
          int64_t n_of[TL_N_VISIBILITIES])

/* Tells of n boxes, each under a matrix of its own in place of the view's, whether they may show: not outside of the
 * window, nor, unless target is NULL, behind its surfaces. */
TL_KERNEL(void, find_shown, const tl_cluster_view *view, const double *boxes, const double *matrices, int64_t n,
          const tl_window *window, const tl_target *target, uint8_t *shown)

/* Lowest index of a TL_BAD vertex that a triangle uses, -1 if there is none. */
TL_KERNEL(int64_t, first_bad, const tl_vertex *vertices, int64_t n_vertices, const int32_t *triangles,
          int64_t n_triangles)

/* Lowest row with an index outside [0, n_vertices), -1 if there is none. */
TL_KERNEL(int64_t, first_bad_row, const int32_t *triangles, int64_t n_triangles, int64_t n_vertices)

/* int64 indices as int32; returns the first row with an index outside [0, n_vertices), -1 if there is none. */
TL_KERNEL(int64_t, narrow_triangles, const int64_t *triangles, int64_t n_triangles, int64_t n_vertices, int32_t *out)

/* Returns -1, or, when it has met an index outside [0, n_vertices), the number of a row at or before which there is
 * one; the picture is then worthless.  The window's pixels are cleared first: 0, id -1, and the depth that every other
 * beats.  A slice needs method AUTO, a picture of less than 2^31 samples within 2^30 pixels of 0.  A bad row
 * of a mesh without snapped vertices may also be that of one that is not finite; it is drawn without clusters and not
 * to SAMPLES. */
TL_KERNEL(int64_t, draw_mesh, const tl_snapped *snapped, const tl_window *window, const tl_target *target,
          tl_slice *slice)

/* The numbers of vertices [first, end) as float64 in `points`, or NULL: they stay where they are.  Returns how many
 * cannot be drawn: not finite, integers beyond 2^53, a depth outside float32.  With bits >= 0 they are rounded to
 * 2^-bits px, and those beyond 2^62 of these cannot be drawn. */
TL_KERNEL(int64_t, take_points, const tl_source *source, int64_t first, int64_t end, int bits, double *points)

/* Counts the triangles of a mesh by the code that `draw_mesh` has for them, with the sink of the census; the target's
 * samples are read when that is SAMPLES.  Returns as `draw_mesh` does. */
TL_KERNEL(int64_t, count_classes, const tl_snapped *snapped, const tl_window *window, const tl_target *target,
          tl_census *census)

/* Lists the triangles that are in the window or within reach_fx of it, with their bands of 2^band_bits rows; they may
 * be a few too many.  Returns as `draw_mesh` does; the window as for a share of a part. */
TL_KERNEL(int64_t, bin, const tl_snapped *snapped, const tl_window *window, int32_t reach_fx, int band_bits,
          tl_bins *bins)

/* Lists the triangles of each band: starts[k] to starts[k + 1] are the places of those of band k in `listed`.  `starts`
 * has n_bands + 2 numbers.  A first call with listed = NULL sets starts[n_bands + 1] to the length of `listed`. */
TL_KERNEL(void, list_bins, const tl_bins *bins, int64_t n_bands, int64_t *starts, int32_t *listed)

/* The columns [columns[2 k], columns[2 k + 1]) that the triangles of band k may reach. */
TL_KERNEL(void, find_columns, const tl_bins *bins, int64_t n_bands, int32_t *columns)

/* The exact area that the triangles of a slice, from its first on, cover of each pixel, their sum; the window has fewer
 * than 2^31 cells.  Returns as `draw_mesh` does, or TL_AREA_OVERFLOW; either way the pixels are then worthless. */
TL_KERNEL(int64_t, draw_area, const tl_snapped *snapped, const tl_window *window, const tl_slice *slice,
          const tl_area *target)

/* Copies rows [first, end) of four numbers, the last of them replaced by 1/w of the vertex. */
TL_KERNEL(void, set_inverse_w, const tl_source *source, const float *rows, int64_t first, int64_t end, float *out)

/* Copies triangles [first, end).  A single-sided one turned the way that the mesh culls is collapsed to a point; if a
 * plane cuts it, so are its pieces, in place.  The result is drawn with any cull. */
TL_KERNEL(void, drop_sides, const tl_snapped *snapped, const uint8_t *is_single, int64_t first, int64_t end,
          int32_t *triangles)

/* The edges of the triangles that are not culled, each once, as lower index + 2^32 * higher index; room for three a
 * triangle.  Returns the first row with an index outside the vertices, or -1. */
TL_KERNEL(int64_t, list_edges, const tl_snapped *snapped, const tl_edge_scratch *scratch, uint64_t *edges,
          int64_t *n_edges)

/* Clears the window's pixels and draws lines. */
TL_KERNEL(void, draw_lines, const tl_edges *lines, const tl_window *window, const tl_line_target *target)

/* Clears the window's pixels and draws points: ids and depth, NEAREST or FARTHEST; at equal depth the lower id. */
TL_KERNEL(void, draw_cloud, const tl_cloud *cloud, const tl_window *window, const tl_target *target)

/* The windows that n triangles, corners (n, 3, 2) in pixels, may touch.  With out = NULL sets `boxes`, adds to
 * starts[row + 1] how many spans a row of windows has, and returns the first triangle that cannot be snapped, or -1.
 * Otherwise writes the spans of each row from starts[row] on, which is then where they end, by the boxes. */
TL_KERNEL(int64_t, list_spans, const tl_tiling *tiling, const double *corners_px, int64_t n, int64_t first_triangle,
          tl_window_box *boxes, int64_t *starts, tl_window_span *out)

/* The triangles of the windows of a row, of n spans of at most TL_SHORT_SPAN windows.  With out = NULL adds to
 * starts[column + 1] how many a window has.  Otherwise writes them from starts[column] on, which is then where they
 * end.  Returns how many spans are longer. */
TL_KERNEL(int64_t, sort_spans, const tl_window_span *spans, int64_t n, int64_t *starts, int32_t *out)

/* Adds spans [starts[i], starts[i + 1]) of n_rows rows of windows to the differences of triangle counts from window to
 * window: rows of n_columns + 1 numbers. */
TL_KERNEL(void, count_windows, const tl_window_span *spans, const int64_t *starts, int64_t n_rows, int64_t n_columns,
          int32_t *steps)

/* The corners of n triangles, those from `first` on unless `which` names them: their rows, one after the other. Returns
 * the first that names a vertex that does not exist, or -1. */
TL_KERNEL(int64_t, take_corners, const tl_corners *mesh, const int32_t *which, int64_t first, int64_t n, void *out)

/* Pixels [first, end) of two visibility buffers into the first. */
TL_KERNEL(void, merge_fragments, const tl_merge *merge, int64_t first, int64_t end)

/* Ids [first, end) become names[1 + id]. */
TL_KERNEL(void, name_triangles, int32_t *ids, int64_t first, int64_t end, const int32_t *names)
#endif

#if !TL_KERNELS_OF || TL_KERNELS_OF == TL_UNIT_pixels
/* The depth of n pixels, one for all triangles: `depth` where there is an id, `background` elsewhere.  The ids are
 * xored with `flip` first. */
TL_KERNEL(void, set_flat_depth, int32_t *ids, int64_t n, int32_t flip, float depth, float background, float *out)

/* Writes rows of a picture of that width, from their first number on, past the caches. */
TL_KERNEL(void, lay_rows, const tl_laid_rows *rows, int32_t *to, int64_t width)

/* Lists pixels that show several triangles, from place `at` on, where there is room for 16 more than there are; returns
 * where they end. */
TL_KERNEL(int64_t, split_pixels, const tl_seen_samples *seen, const tl_split *split, int64_t at)

/* Writes rows of `width` ids that sample k, not the first, sees, from those of the first and `split`, which begins with
 * the same row. */
TL_KERNEL(void, spread_ids, const tl_split *split, int k, int64_t n_rows, int64_t width, const int32_t *first_ids,
          int32_t *ids)

/* Writes which of n instances each id belongs to, -1 below 0; instance i has the ids from first_ids[i] on to
 * first_ids[i + 1].  Boxes may be NULL: (n, 4) left, top, right, bottom, which are widened. */
TL_KERNEL(void, find_instances, const int32_t *ids, int64_t n_rows, int64_t width, const int64_t *first_ids, int64_t n,
          int32_t *out, int32_t *boxes)

/* Appends the runs of a window to a table of *n, which has room for n_room; `rows` has TL_RLE_LINE * height numbers.
 * Returns whether there was room for all. */
TL_KERNEL(int, list_column_runs, const tl_run_source *source, int32_t *rows, tl_run *runs, int64_t n_room, int64_t *n)

/* The counts of objects from n runs in their order: run i is of object[i], of none where that is below 0.  Then these
 * as text, that of object k from text_starts[k] to text_starts[k + 1]: room for 13 characters a count. */
TL_KERNEL(void, count_runs, const tl_run *runs, const int32_t *object, int64_t n, const tl_rles *rles)
TL_KERNEL(void, write_counts, const tl_rles *rles, int64_t *text_starts, uint8_t *text)

/* A band of rows as a block of deflate that ends at a byte, and Adler-32 of the bytes so far; `row` has room for
 * 1 + n_bytes, `out` for tl_png_room.  Returns how many bytes it has. */
TL_KERNEL(int64_t, encode_rows, const tl_png_rows *rows, uint8_t *row, uint32_t *adler, uint8_t *out)

/* 1/w of vertices [first, end) of clip space, for tl_vertex_set; nothing of it is checked. */
TL_KERNEL(void, inverse_ws, const tl_source *source, int64_t first, int64_t end, double *out)

/* Per pixel of `ids` (rows of window->width): float32 weights of the triangle's three vertices. */
TL_KERNEL(void, barycentric, const tl_snapped *snapped, const tl_window *window, const int32_t *ids, float *out)

/* Values at each pixel of `ids` by the weights of `barycentric`: of float32 (n_vertices, n_values), or
 * (n_triangles, 3, n_values) per corner. */
TL_KERNEL(void, interpolate, const tl_snapped *snapped, const tl_window *window, const int32_t *ids,
          const float *values, int n_values, int per_corner, float background, float *out)

/* Derivatives of values along x and y at n pixels: (n, n_values, 2), 0 where ids are -1. */
TL_KERNEL(void, fill_slopes, const tl_sloped *values, const int32_t *ids, const float *weights, int64_t n, float *out)

/* The values (n, n_channels) of an array at n pixels where ids are not -1: uv (n, 2), and where there are halvings
 * slopes of u and v along x and y, (n, 2, 2). */
TL_KERNEL(void, fill_texels, const tl_levels *array, const int32_t *ids, const float *uv, const float *slopes,
          float background, int64_t n, float *out)

/* Which level n pixels look at. */
TL_KERNEL(void, levels_seen, const tl_levels *array, const float *slopes, int64_t n, double *out)

/* Rows [first, end) of the halving of a level of such an array, (max(1, height / 2), max(1, width / 2)). */
TL_KERNEL(void, halve_rows, const float *level, int64_t width, int64_t height, int n_channels, int64_t first,
          int64_t end, float *out)

/* Colours where labels are not -1: per triangle, or interpolated screen-linearly from those of the vertices. n_channels
 * of uint8 or float32 a colour.  `ground`, or NULL: the colour elsewhere. */
TL_KERNEL(void, paint_flat, const int32_t *labels, int64_t n, const uint8_t *colors, int pixel_bytes,
          const uint8_t *ground, uint8_t *pixels)
TL_KERNEL(void, paint_gouraud, const tl_snapped *snapped, const tl_window *window, const int32_t *labels,
          const void *colors, int n_channels, int is_u8, void *pixels)

/* The mean colour of the samples of n pixels: from planes of labels and the colours of the triangles, or from planes of
 * colours.  Planes lie `stride` pixels apart; transfer is NULL where all channels are averaged as they are.  A row of a
 * palette of uint8 has four numbers, whatever n_channels. */
TL_KERNEL(void, mean_flat, const int32_t *labels, int sample_bits, int64_t stride, int64_t n, const void *palette,
          int n_channels, int is_u8, const tl_transfer *transfer, void *pixels)
TL_KERNEL(void, mean_colors, const void *colors, int sample_bits, int64_t stride, int64_t n, int n_channels, int is_u8,
          const tl_transfer *transfer, void *pixels)

/* The composite of the layers of n pixels. */
TL_KERNEL(void, composite, const tl_composite *layers, int64_t n, void *pixels)

/* Per pixel of `ids` (rows of window->width): the value of its point, float32 or float64.  No shading is read. */
TL_KERNEL(void, fill_points, const tl_shaded_scene *scene, const tl_window *window, const tl_points *points,
          const int32_t *ids, void *out)

/* The planes of triangles [first, end); the one of no triangle, with first = 0. */
TL_KERNEL(void, list_planes, const tl_valued *mesh, int64_t first, int64_t end)

/* Per pixel of `ids` (rows of window->width): the value of its centre on the plane of the triangle, float32 or
 * float64. */
TL_KERNEL(void, fill_planes, const tl_valued *mesh, const tl_window *window, const int32_t *ids, int is_f32, void *out)
#endif

#if !TL_KERNELS_OF || TL_KERNELS_OF == TL_UNIT_blend
/* Blends the colours of triangles into the canvas in their order.  Returns as `draw_mesh` does. */
TL_KERNEL(int64_t, blend, const tl_snapped *snapped, const tl_window *window, const tl_canvas *canvas)

/* Fills the canvas, its ground not NULL, with the flat colours of a few triangles: tl_is_large_shapes. 2^sample_bits
 * samples a pixel lie at samples_fx, or one where the mesh says; of several the mean.  Returns as `draw_mesh` does. */
TL_KERNEL(int64_t, fill_large_shapes, const tl_snapped *snapped, const tl_window *window, const tl_canvas *canvas,
          const int32_t *samples_fx, int sample_bits, const tl_transfer *transfer)
#endif

#if !TL_KERNELS_OF || TL_KERNELS_OF == TL_UNIT_shade
/* The picture of a visibility buffer, rows of window->width: uint8 red, green, blue, opacity; as the sample sees it
 * that lies at_fx = (x, y) sub-pixels from the centre, NULL: that which each mesh is seen from. */
TL_KERNEL(void, shade, const tl_shaded_scene *scene, const tl_window *window, const int32_t *at_fx, const int32_t *ids,
          const float *depth, uint8_t *pixels)

/* The picture of several samples a pixel, from planes of ids and depth that lie `stride` pixels apart, one a sample;
 * otherwise as `shade`; samples_fx as in tl_target. With
 * `split`, its rows those of the window, there is the plane of the first sample alone. */
TL_KERNEL(void, shade_samples, const tl_shaded_scene *scene, const tl_window *window, const int32_t *samples_fx,
          int sample_bits, int64_t stride, const int32_t *ids, const float *depth, const tl_split *split,
          uint8_t *pixels)

/* Unit normals on the side that is seen, float32 (x, y, z), 0 where nothing is: turned by shading->eye_from; show is
 * NORMALS. */
TL_KERNEL(void, shade_normals, const tl_shaded_scene *scene, const tl_window *window, const int32_t *ids, float *out)

/* Draws n alpha-tested triangles over a target, NEAREST or PEEL, of all others; the window as for a share of a part,
 * and fewer than 2^31 pixels. */
TL_KERNEL(void, cut_out, const tl_snapped *snapped, const tl_window *window, const tl_view *view,
          const tl_shading *shading, const int32_t *triangles, int64_t n, const tl_target *target)
#endif

#if !TL_KERNELS_OF || TL_KERNELS_OF == TL_UNIT_polygons
/* Unit normals (n_vertices, 3) of the vertices [first, end): the faces round a vertex count by the angle there, in
 * their order; 0 where nothing is left.  This one and the next three return -1, or a row with an index outside the
 * vertices. */
TL_KERNEL(int64_t, vertex_normals, const tl_source *source, const int32_t *triangles, int64_t n_triangles,
          int64_t first, int64_t end, double *out)

/* Unit normals of triangles [first, end), on the side that is counter-clockwise, 0 without an area: float64
 * (n_triangles, 3), or float32 (n_triangles, 4) and 1; the other is NULL. */
TL_KERNEL(int64_t, face_normals, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
          double *out, float *rows)

/* 1 for the triangles of [first, end) with corner normals, rows of four, that point to the other side, else 0;
 * row_of_corner is (n_triangles, 3), the triangles themselves where vertices have a row each. */
TL_KERNEL(int64_t, find_turned, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
          const float *normals, const int32_t *row_of_corner, uint8_t *is_turned)

/* Unit normals and angles of triangles [first, end), both float64 (n_triangles, 3).  Returns as vertex_normals. */
TL_KERNEL(int64_t, face_angles, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
          double *normals, double *angles)

/* `starts` and `corners` of tl_fans. */
TL_KERNEL(void, list_corners, const int32_t *triangles, int64_t n_triangles, int64_t n_vertices, int32_t *starts,
          int32_t *corners)

/* Groups of the corners of vertices [first, end), and how many each vertex has, 0 for one; room for five numbers a
 * corner of the vertex that has most. */
TL_KERNEL(void, find_creases, const tl_fans *fans, int64_t first, int64_t end, uint64_t *room, int32_t *groups,
          int32_t *n_groups)

/* Normals of vertices [first, end) as vertex_normals has them, and of their groups. */
TL_KERNEL(void, sum_creases, const tl_fans *fans, const tl_creases *creases, int64_t first, int64_t end)

/* Triangles of faces with any number of corners, as rows of `corners`: n_corners - 2 of each that has three; room as
 * tl_ear_words tells for the largest.  Returns how many faces are finished. */
TL_KERNEL(int64_t, cut_faces, const tl_faces *faces, int64_t *triangles, int64_t *room)

/* Low and high of the corners of triangles [first, end): six numbers. */
TL_KERNEL(int64_t, box_of_faces, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
          double *box)

/* Vectors [first, end), times a matrix (3, 3) from the right unless that is NULL, scaled to length 1; 0 where they have
 * none, or are not finite.  Out as for face_normals. */
TL_KERNEL(void, unit_vectors, const tl_source *vectors, const double *turn, int64_t first, int64_t end, double *out,
          float *rows)

/* Points [first, end) by an affine matrix (3, 4), float64 (n, 3). */
TL_KERNEL(void, move_points, const tl_source *points, const double *matrix, int64_t first, int64_t end, double *out)

/* The first three of n_channels of colours [first, end) as float32 (n, 4) and 1. */
TL_KERNEL(void, color_rows, const uint8_t *colors, int n_channels, int64_t first, int64_t end, float *rows)

/* Bends vertices [first, end), float32 or float64, moved to eye space by the rows of an affine matrix, as far as they
 * lie well in the picture; their records. */
TL_KERNEL(void, bend_vertices, const tl_lens *lens, const tl_source *source, const double *eye_from, int64_t first,
          int64_t end, double *bent, float *records)

/* The places (n, 2) in the image plane at which a lens sees points (n, 3) in eye space. */
TL_KERNEL(void, see_points, const tl_lens *lens, const double *points, int64_t n, double *places)

/* Lists the triangles [first, end) that a lens may bend, and those that it cannot see, with room for end - first + 16
 * each; returns how many it may bend. */
TL_KERNEL(int64_t, find_bent, const tl_lens *lens, const float *records, int64_t n_vertices, const int32_t *triangles,
          int64_t first, int64_t end, int32_t *bent, int32_t *outside, int64_t *n_outside)

/* Splits n listed triangles until their sides are straight enough; adds their parts to `parts`, or counts them. */
TL_KERNEL(void, split_bent, const tl_lens *lens, const double *points, const float *records, int64_t n_vertices,
          const int32_t *triangles, const int32_t *ids, int64_t n, tl_bent_parts *parts)

/* Groups of n equal rows of n_words words, in the order of their first rows: the first row of each, and the group of
 * every row.  `table`: 2^table_bits numbers of -1, more than n.  Returns how many groups there are, or -1 where many
 * hashes meet. */
TL_KERNEL(int64_t, group_rows, const uint32_t *rows, int n_words, int64_t n, int table_bits, int32_t *table,
          int32_t *first, int32_t *group)

/* Sets the boxes of a surface's nodes; all else of it is there. */
TL_KERNEL(void, build_tree, tl_surface *surface)

/* The nearest triangle of points [first, end), and where on it unless `at` is NULL.  Returns the largest distance. */
TL_KERNEL(double, nearest_of_points, const tl_surface *surface, const double *points, int64_t first, int64_t end,
          int32_t *triangle, double *at)

/* How far triangles [first, end) can be from a surface.  A bound is near enough when it passes the known one by
 * `least`, or by that share.  In and out: reach, only `known` is read on entry. */
TL_KERNEL(void, find_reach, const tl_surface *surface, const double *points, const int32_t *triangles, int64_t first,
          int64_t end, double share, double least, tl_reach *reach)

/* For n pairs of a point of `from` and a triangle of `points`: where on it is nearest to the point, and the squared
 * distance. */
TL_KERNEL(void, set_feet, const double *points, const int32_t *triangles, const double *from, const int32_t *triangle,
          const int32_t *point, int64_t n, double *at, double *squared)

/* The pixels of points [first, end) to columns of coordinates: rounded to 2^-bits pixels, counted in 2^-grid_bits from
 * the corner.  With wide_fx NULL points that are not narrow are counted, and the caller comes again with a table. */
TL_KERNEL(tl_vertex_counts, snap_points, const tl_source *source, int64_t first, int64_t end, int bits, int grid_bits,
          const int64_t *corner_px, int32_t *x_fx, int32_t *y_fx, int64_t *wide_fx)

/* Boxes of polygons [first, end) in a window, and which are wide.  Returns the largest number of edges of one. */
TL_KERNEL(int64_t, bound_polygons, const tl_polygons *polygons, int64_t first, int64_t end, int64_t width,
          int64_t height, uint8_t *is_wide, tl_polygon_box *boxes)

/* The polygons of each band of rows, in their order: those of band k are listed[starts[k]] to listed[starts[k + 1] -
 * 1]. A first call with listed = NULL sets starts[n_bands + 1] to the length of `listed`; `starts` has n_bands + 2
 * numbers. */
TL_KERNEL(void, sort_polygons, const tl_polygon_box *boxes, int64_t n, int64_t band_rows, int64_t n_bands,
          int64_t *starts, int32_t *listed)

/* Sets weights and is_simple of polygons [first, end); room as tl_certify_words tells.  `trust_polygons`: of polygons
 * that are known to be valid, the first ring of each its border and the others holes. */
TL_KERNEL(void, certify_polygons, const tl_polygons *polygons, int64_t first, int64_t end, int8_t *weights,
          uint8_t *is_simple, int64_t *room)
TL_KERNEL(void, trust_polygons, const tl_polygons *polygons, int64_t first, int64_t end, int8_t *weights,
          uint8_t *is_simple)

/* Rows [top, bottom) of the mask of one polygon: see mask.c for the memory. */
TL_KERNEL(void, mask_even_odd, const tl_polygons *polygons, int64_t polygon, int64_t width, int64_t top, int64_t bottom,
          uint64_t *bits, uint8_t *out)
TL_KERNEL(void, mask_nonzero, const tl_polygons *polygons, int64_t polygon, int64_t width, int64_t top, int64_t bottom,
          uint32_t *at, int32_t *list, int64_t n_list, int32_t *cells, uint64_t *bits, uint8_t *out)

/* Paints polygons over rows, the later over the earlier. */
TL_KERNEL(void, label_polygons, const tl_polygons *polygons, const tl_label_job *job)

/* Exact shares of pixels.  Returns how many polygons of the job are finished: fewer than all when the table is full. */
TL_KERNEL(int64_t, share_polygons, const tl_polygons *polygons, const tl_share_job *job)

/* Rows [first, end) of an atlas, (rows of) width texels.  Where an id is -1, that of the nearest triangle that meets
 * the texel, and its values there; `squared` has a number a texel of these rows, INFINITY.  Or means over covered
 * areas: `sums` has 1 + n_values numbers a texel of these rows, `most` one, all 0. */
TL_KERNEL(void, touch_texels, const tl_atlas *atlas, int64_t first, int64_t end, int32_t *ids, float *squared,
          float *out)
TL_KERNEL(void, average_texels, const tl_atlas *atlas, int64_t first, int64_t end, double *sums, float *most,
          int32_t *ids, float *out)

/* The nearest texel with an id, within `reach` < TL_NO_TEXEL: along rows; then by Euclid, its index or -1, with room
 * for 2 * width numbers; and texels [first, end) of n_bytes copied from there. */
TL_KERNEL(void, find_in_rows, const int32_t *ids, int64_t width, int64_t first, int64_t end, int reach, int16_t *along)
TL_KERNEL(void, find_gutter, const int16_t *along, int64_t width, int64_t height, int64_t first, int64_t end, int reach,
          int32_t *room, int32_t *from)
TL_KERNEL(void, copy_texels, const int32_t *from, int64_t first, int64_t end, int64_t n_bytes, uint8_t *texels)

/* Adds a picture's colours of texels [first, end), at positions, with normals and ids (-1: none), to sums and
 * weights. */
TL_KERNEL(void, add_taken, const tl_taken *taken, const float *positions, const float *normals, const int32_t *ids,
          int64_t first, int64_t end, float *sums, float *weights)

/* Rows [first, end) of how high above the ground something is seen; NaN where there is no ground, or too far. */
TL_KERNEL(void, view_heights, const tl_terrain *terrain, int64_t first, int64_t end, double *out)

/* Columns of tl_crossings: filled by the even-odd rule in place, where the number of odd ones is returned; a byte or a
 * share of each voxel, n_steps a column; each bit at strides of a row, a column and a step. */
TL_KERNEL(int64_t, fill_columns, uint64_t *bits, int64_t n_columns, int64_t n_words)
TL_KERNEL(void, expand_columns, const uint64_t *bits, int64_t n_columns, int64_t n_words, int64_t n_steps, uint8_t *out)
TL_KERNEL(void, count_columns, const uint64_t *bits, int64_t n_columns, int64_t n_words, int64_t n_steps,
          int sample_bits, float *out)
TL_KERNEL(void, scatter_columns, const uint64_t *bits, int64_t n_rows, int64_t n_columns, int64_t n_words,
          const int64_t *strides, uint8_t *out)

/* Writes 1 for the voxels of a grid of a shape that triangles [first, end) meet; points are in voxels. */
TL_KERNEL(void, touch_voxels, const double *points, int64_t n_points, const int32_t *triangles, int64_t first,
          int64_t end, const int64_t *shape, uint8_t *out)
#endif

#if !TL_KERNELS_OF || TL_KERNELS_OF == TL_UNIT_grad
/* Where the pixels of a band lie in the triangles that they show: `ids` is its picture's lowest row, -1 for none, the
 * next one stands `step` numbers on, and first_id is added.  rast_db may be NULL. */
TL_KERNEL(void, grad_points, const tl_grad_view *view, const int32_t *ids, int64_t step, int64_t first_id, void *rast,
          void *rast_db)

/* The gradients of vertices from those of `rast` and `rast_db`, summed in a band.  Returns, as those of values and of
 * colors do, the number of a triangle that does not exist, or -1. */
TL_KERNEL(int64_t, grad_points_vjp, const tl_grad_view *view, const tl_grad_points *points)

/* Attributes in a band, and their slopes. */
TL_KERNEL(int64_t, grad_values, const tl_grad_view *view, const tl_grad_values *values)

/* Their gradients: sums by row of attributes, and those of `rast` and `rast_db`. */
TL_KERNEL(int64_t, grad_values_vjp, const tl_grad_view *view, const tl_grad_values *values, tl_grad_sums *sums)

/* A texture at the pixels of a band. */
TL_KERNEL(void, grad_texels, const tl_grad_view *view, const tl_grad_texture *texture)

/* Its gradients: sums by texel, a multiple of four columns, unless NULL; and those of where it is looked at. */
TL_KERNEL(void, grad_texels_vjp, const tl_grad_view *view, const tl_grad_texture *texture, tl_grad_sums *sums)

/* Of a part of a mesh in a view, whatever the band: where vertices are, and sides of triangles. */
TL_KERNEL(void, grad_sides, const tl_grad_view *view, const tl_grad_outline *outline)

/* When the sides of all parts are known: its outline. */
TL_KERNEL(void, mark_silhouettes, const tl_grad_view *view, const tl_grad_outline *outline)

/* A band with smooth silhouettes; or backward the gradients of its colours, and the sums by vertex. */
TL_KERNEL(void, grad_edges, const tl_grad_view *view, const tl_grad_edges *edges, tl_grad_sums *sums)

/* A band of attributes with smooth silhouettes; or the sums of its gradients; or these, and the sum of squares of its
 * differences from another picture. */
TL_KERNEL(double, grad_picture, const tl_grad_view *view, tl_grad_picture *picture)

/* The gradients of vertices from those of areas. */
TL_KERNEL(void, grad_area, const tl_grad_area *area)
#endif

#undef TL_KERNEL
