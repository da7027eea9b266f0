/* The kernels of an instruction set: TL_KERNEL(result, name, parameters ...), a member of the table of dispatch.h.
 * Each section has the kernels of one unit: unit_*.c includes their code, and the build compiles each unit by itself.
 * Where TL_KERNELS_OF is defined, only that section is read. */
#include "dispatch.h" /* for the types, where this file is read by itself */

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
/* Snaps vertices [first, end) from pixels.  z is read with with_depth and n_components = 3.  `wide` may be NULL: wide
 * vertices are then only counted, and the caller calls again with a table. */
TL_KERNEL(tl_vertex_counts, snap, const tl_source *source, int64_t first, int64_t end, int subpixel_bits,
          int with_depth, tl_vertex *out, tl_wide *wide)

/* Projects and snaps vertices [first, end): from clip space, or from object space by the matrix.  Stores vertices with
 * a table of wide vertices or NULL (see `snap`), or points of TL_PLACED numbers.  A point that cannot be drawn has x
 * NaN, and its tl_special in y. */
TL_KERNEL(tl_vertex_counts, project, const tl_source *source, int64_t first, int64_t end, const tl_view *view,
          const tl_projected *out)

/* Cuts the triangles that have clipped vertices: among all n, or among the n in ids, which ascend.  With pieces->source
 * NULL only counts. */
TL_KERNEL(void, clip, const tl_source *source, const tl_projected *projected, const int32_t *triangles,
          const int32_t *ids, int64_t n, const tl_view *view, tl_pieces *pieces)

/* Marks the blocks of 2^block_bits vertices that the triangles among n ids use.  Returns -1, or a triangle with an
 * index outside [0, n_vertices). */
TL_KERNEL(int64_t, mark_vertices, const int32_t *ids, int64_t n, const int32_t *triangles, int64_t n_triangles,
          int64_t n_vertices, int block_bits, uint8_t *is_used)

/* Sets keys: positions of the centres of triangles on a space-filling curve; `box` is low and high of the vertices. */
TL_KERNEL(void, place_on_curve, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
          const double *box, uint32_t *keys)

/* Sets the order that sorts n keys, stable; `room` and `other_room` have n pairs each. */
TL_KERNEL(void, sort_keys, const uint32_t *keys, int64_t n, uint64_t *room, uint64_t *other_room, int32_t *order)

/* Cuts the triangles in `order` into clusters.  Sets the ranges of each cluster; `vertices`: the vertex of the mesh of
 * each vertex of a cluster; `corners`; and the names of the triangles.  `seen` is (n_vertices,), -1.  Returns the
 * number of clusters; *n_used is the number of their vertices. */
TL_KERNEL(int64_t, cut_clusters, const int32_t *triangles, const int32_t *order, int64_t n, int32_t *seen,
          tl_cluster *clusters, int32_t *vertices, uint8_t *corners, int64_t *n_used)

/* Sets the bounds of clusters [first, end), which begin at a multiple of TL_CLUSTER_GROUP, and the boxes of their
 * groups; `source` has the vertices of the clusters. */
TL_KERNEL(void, measure_clusters, const tl_source *source, const uint8_t *corners, int64_t first, int64_t end,
          tl_cluster *clusters, double *group_boxes)

/* Counts every `step`-th cluster by its tl_visibility in a view.  Does not test occlusion. */
TL_KERNEL(void, survey_clusters, const tl_clustered *mesh, const tl_cluster_view *view, int64_t step,
          int64_t n_of[TL_N_VISIBILITIES])

/* Sets shown[i] to 0 where box i, transformed by matrix i instead of the matrix of the view, is outside of the window,
 * between samples, or, unless target is NULL, occluded by the depth in it; else to 1. */
TL_KERNEL(void, find_shown, const tl_cluster_view *view, const double *boxes, const double *matrices, int64_t n,
          const tl_window *window, const tl_target *target, uint8_t *shown)

/* Returns the lowest index of a TL_BAD vertex that a triangle uses, or -1. */
TL_KERNEL(int64_t, first_bad, const tl_vertex *vertices, int64_t n_vertices, const int32_t *triangles,
          int64_t n_triangles)

/* Returns the lowest row with an index outside [0, n_vertices), or -1. */
TL_KERNEL(int64_t, first_bad_row, const int32_t *triangles, int64_t n_triangles, int64_t n_vertices)

/* Converts int64 indices to int32.  Returns the first row with an index outside [0, n_vertices), or -1. */
TL_KERNEL(int64_t, narrow_triangles, const int64_t *triangles, int64_t n_triangles, int64_t n_vertices, int32_t *out)

/* Clears the window's pixels (0, id -1, the depth that every other depth beats) and draws a mesh.  Returns -1, or a
 * row: an index outside [0, n_vertices) is in that row or before it, and the pixels are undefined.  A mesh without
 * snapped vertices may also return a row with a vertex that is not finite; it has no clusters and no sink SAMPLES.  A
 * slice needs method AUTO, and a picture of less than 2^31 samples within 2^30 pixels of 0. */
TL_KERNEL(int64_t, draw_mesh, const tl_snapped *snapped, const tl_window *window, const tl_target *target,
          tl_slice *slice)

/* Converts vertices [first, end) to float64 `points`, or, with NULL, only checks float64 ones in place.  Returns how
 * many numbers cannot be drawn: not finite, integers beyond 2^53, a depth outside float32.  With bits >= 0 rounds to
 * 2^-bits px; numbers of 2^62 such units and more then cannot be drawn. */
TL_KERNEL(int64_t, take_points, const tl_source *source, int64_t first, int64_t end, int bits, double *points)

/* Counts the triangles of a mesh by the code that `draw_mesh` draws them with; the sink is that of the census.  Of the
 * target the samples are read, for SAMPLES.  Returns as `draw_mesh` does. */
TL_KERNEL(int64_t, count_classes, const tl_snapped *snapped, const tl_window *window, const tl_target *target,
          tl_census *census)

/* Lists the triangles that reach into the window widened by reach_fx, and their bands of 2^band_bits rows; may list a
 * few more.  Returns as `draw_mesh` does, and needs a window as for a slice. */
TL_KERNEL(int64_t, bin, const tl_snapped *snapped, const tl_window *window, int32_t reach_fx, int band_bits,
          tl_bins *bins)

/* Lists the triangles of each band: listed[starts[k]] to listed[starts[k + 1] - 1] are the ids in band k.  `starts` has
 * n_bands + 2 numbers.  A first call with listed = NULL sets starts[n_bands + 1] to the length of `listed`. */
TL_KERNEL(void, list_bins, const tl_bins *bins, int64_t n_bands, int64_t *starts, int32_t *listed)

/* Adds up the exact area of each pixel that the triangles of a slice cover, from its `first` on; the window has fewer
 * than 2^31 cells.  Returns as `draw_mesh` does, or TL_AREA_OVERFLOW; the pixels are undefined unless it returns -1. */
TL_KERNEL(int64_t, draw_area, const tl_snapped *snapped, const tl_window *window, const tl_slice *slice,
          const tl_area *target)

/* Copies rows [first, end) of four numbers, with 1/w of the vertex as the fourth. */
TL_KERNEL(void, set_inverse_w, const tl_source *source, const float *rows, int64_t first, int64_t end, float *out)

/* Copies triangles [first, end).  Collapses a single-sided triangle that the mesh culls to a point; where a clip plane
 * cuts it, collapses its pieces in place.  The result is drawn without culling. */
TL_KERNEL(void, drop_sides, const tl_snapped *snapped, const uint8_t *is_single, int64_t first, int64_t end,
          int32_t *triangles)

/* Lists the edges of the triangles that are not culled, each edge once, as lower index + 2^32 * higher index; `edges`
 * has room for three a triangle.  Returns the first row with an index outside the vertices, or -1. */
TL_KERNEL(int64_t, list_edges, const tl_snapped *snapped, const tl_edge_scratch *scratch, uint64_t *edges,
          int64_t *n_edges)

/* Clears the window's pixels and draws lines. */
TL_KERNEL(void, draw_lines, const tl_edges *lines, const tl_window *window, const tl_line_target *target)

/* Clears the window's pixels and draws points: ids and depth, NEAREST or FARTHEST; at equal depth the lower id. */
TL_KERNEL(void, draw_cloud, const tl_cloud *cloud, const tl_window *window, const tl_target *target)

/* Finds the windows that n triangles, corners (n, 3, 2) in pixels, may touch.  With out = NULL sets `boxes`, adds the
 * number of spans of each row of windows to starts[row + 1], and returns the first triangle that cannot be snapped, or
 * -1.  Otherwise reads `boxes` and writes the spans of each row from starts[row] on; starts[row] becomes their end. */
TL_KERNEL(int64_t, list_spans, const tl_tiling *tiling, const double *corners_px, int64_t n, int64_t first_triangle,
          tl_window_box *boxes, int64_t *starts, tl_window_span *out)

/* Sorts n spans of one row, those of at most TL_SHORT_SPAN windows, by window.  With out = NULL adds the number of
 * triangles of each window to starts[column + 1].  Otherwise writes the triangles from starts[column] on;
 * starts[column] becomes their end.  Returns how many spans are longer. */
TL_KERNEL(int64_t, sort_spans, const tl_window_span *spans, int64_t n, int64_t *starts, int32_t *out)

/* Adds spans [starts[i], starts[i + 1]) of n_rows rows of windows to `steps`, rows of n_columns + 1 numbers:
 * differences between the triangle counts of neighbouring windows. */
TL_KERNEL(void, count_windows, const tl_window_span *spans, const int64_t *starts, int64_t n_rows, int64_t n_columns,
          int32_t *steps)

/* Copies the vertex rows of the corners of n triangles: triangles first to first + n - 1, or those that `which` lists.
 * Returns the first triangle with an index outside the vertices, or -1. */
TL_KERNEL(int64_t, take_corners, const tl_corners *mesh, const int32_t *which, int64_t first, int64_t n, void *out)

/* Draws n alpha-tested triangles over a target, NEAREST or PEEL, that has all other triangles; the window as for a
 * slice, and fewer than 2^31 pixels. */
TL_KERNEL(void, cut_out, const tl_snapped *snapped, const tl_window *window, const tl_view *view,
          const tl_shading *shading, const int32_t *triangles, int64_t n, const tl_target *target)
#endif

#if !TL_KERNELS_OF || TL_KERNELS_OF == TL_UNIT_pixels
/* Sets the depth of n pixels for triangles that all have one depth: `depth` where there is an id, `background`
 * elsewhere.  Xors the ids with `flip` first. */
TL_KERNEL(void, set_flat_depth, int32_t *ids, int64_t n, int32_t flip, float depth, float background, float *out)

/* Writes which of n instances each id belongs to, -1 below 0; instance i has the ids first_ids[i] to first_ids[i + 1] -
 * 1. Widens `boxes`, (n, 4) left, top, right, bottom, or NULL, by the pixels of each instance. */
TL_KERNEL(void, find_instances, const int32_t *ids, int64_t n_rows, int64_t width, const int64_t *first_ids, int64_t n,
          int32_t *out, int32_t *boxes)

/* Appends the column runs of a window to `runs`, which has *n runs and room for n_room; `rows` has room for TL_RLE_LINE
 * * height numbers.  Returns whether there was room for all. */
TL_KERNEL(int, list_column_runs, const tl_run_source *source, int32_t *rows, tl_run *runs, int64_t n_room, int64_t *n)

/* `count_runs` sets the counts of objects from n runs in their order: run i belongs to object[i], to none below 0.
 * `write_counts` writes the counts as text: object k from text_starts[k] to text_starts[k + 1], at most 13 characters a
 * count. */
TL_KERNEL(void, count_runs, const tl_run *runs, const int32_t *object, int64_t n, const tl_rles *rles)
TL_KERNEL(void, write_counts, const tl_rles *rles, int64_t *text_starts, uint8_t *text)

/* Writes rows as a block of deflate that ends at a byte, and updates Adler-32; `row` has room for 1 + n_bytes, `out`
 * for tl_png_room.  Returns the number of bytes written. */
TL_KERNEL(int64_t, encode_rows, const tl_png_rows *rows, uint8_t *row, uint32_t *adler, uint8_t *out)

/* Sets 1/w of vertices [first, end) of clip space, for tl_vertex_set.  Checks nothing. */
TL_KERNEL(void, inverse_ws, const tl_source *source, int64_t first, int64_t end, double *out)

/* Sets float32 weights of the triangle's three vertices per pixel of `ids`, rows of window->width. */
TL_KERNEL(void, barycentric, const tl_snapped *snapped, const tl_window *window, const int32_t *ids, float *out)

/* Interpolates values per pixel of `ids` with the weights of `barycentric`; values are float32 (n_vertices, n_values),
 * or per corner (n_triangles, 3, n_values). */
TL_KERNEL(void, interpolate, const tl_snapped *snapped, const tl_window *window, const int32_t *ids,
          const float *values, int n_values, int per_corner, float background, float *out)

/* Sets the derivatives of values along x and y at n pixels: (n, n_values, 2), 0 where ids are -1. */
TL_KERNEL(void, fill_slopes, const tl_sloped *values, const int32_t *ids, const float *weights, int64_t n, float *out)

/* Samples an array at n pixels where ids are not -1: writes (n, n_channels) at uv (n, 2); with mipmap levels reads
 * `slopes`, (n, 2, 2), of u and v along x and y. */
TL_KERNEL(void, fill_texels, const tl_levels *array, const int32_t *ids, const float *uv, const float *slopes,
          float background, int64_t n, float *out)

/* Sets the mipmap level of n pixels. */
TL_KERNEL(void, levels_seen, const tl_levels *array, const float *slopes, int64_t n, double *out)

/* Halves rows [first, end) of the next mipmap level: (max(1, height / 2), max(1, width / 2)). */
TL_KERNEL(void, halve_rows, const float *level, int64_t width, int64_t height, int n_channels, int64_t first,
          int64_t end, float *out)

/* Writes rows [first, end) of a picture, of which row 0 is the lowest, and the rows of all levels that they complete.
 * The rows of a picture come in order. */
TL_KERNEL(void, write_levels, const tl_picture_levels *picture, int64_t first, int64_t end)

/* Writes colours where labels are not -1: per triangle, or interpolated linearly on the screen from the vertices.
 * n_channels of uint8 or float32 a colour.  `ground`, or NULL, is the colour elsewhere. */
TL_KERNEL(void, paint_flat, const int32_t *labels, int64_t n, const uint8_t *colors, int pixel_bytes,
          const uint8_t *ground, uint8_t *pixels)
TL_KERNEL(void, paint_gouraud, const tl_snapped *snapped, const tl_window *window, const int32_t *labels,
          const void *colors, int n_channels, int is_u8, void *pixels)

/* Averages the colours of the samples of n pixels: colours of triangles by planes of labels, or planes of colours.
 * Planes are `stride` pixels apart.  With transfer NULL all channels are averaged as they are.  A uint8 palette has
 * four numbers a row, whatever n_channels. */
TL_KERNEL(void, mean_flat, const int32_t *labels, int sample_bits, int64_t stride, int64_t n, const void *palette,
          int n_channels, int is_u8, const tl_transfer *transfer, void *pixels)
TL_KERNEL(void, mean_colors, const void *colors, int sample_bits, int64_t stride, int64_t n, int n_channels, int is_u8,
          const tl_transfer *transfer, void *pixels)

/* Composites the layers of n pixels. */
TL_KERNEL(void, composite, const tl_composite *layers, int64_t n, void *pixels)

/* Sets the value of the surface point per pixel of `ids`, rows of window->width: float32 or float64.  Reads no
 * shading. */
TL_KERNEL(void, fill_points, const tl_shaded_scene *scene, const tl_window *window, const tl_points *points,
          const int32_t *ids, void *out)

/* Sets the planes of triangles [first, end); with first = 0 also the plane of id -1. */
TL_KERNEL(void, list_planes, const tl_valued *mesh, int64_t first, int64_t end)

/* Sets the value of the triangle's plane at the pixel's centre per pixel of `ids`, rows of window->width: float32 or
 * float64. */
TL_KERNEL(void, fill_planes, const tl_valued *mesh, const tl_window *window, const int32_t *ids, int is_f32, void *out)
#endif

#if !TL_KERNELS_OF || TL_KERNELS_OF == TL_UNIT_blend
/* Blends the colours of triangles into the canvas in their order.  Returns as `draw_mesh` does. */
TL_KERNEL(int64_t, blend, const tl_snapped *snapped, const tl_window *window, const tl_canvas *canvas)

/* Fills the canvas, whose ground is not NULL, with a few triangles of flat colours: see tl_is_large_shapes.  Averages
 * the 2^sample_bits samples at samples_fx of a pixel; of one sample the mesh says where it is.  Returns as `draw_mesh`
 * does. */
TL_KERNEL(int64_t, fill_large_shapes, const tl_snapped *snapped, const tl_window *window, const tl_canvas *canvas,
          const int32_t *samples_fx, int sample_bits, const tl_transfer *transfer)
#endif

#if !TL_KERNELS_OF || TL_KERNELS_OF == TL_UNIT_shade
/* Shades a visibility buffer, rows of window->width: uint8 red, green, blue, opacity.  The sample is at_fx = (x, y)
 * sub-pixels from the centre; NULL: the sample of each mesh. */
TL_KERNEL(void, shade, const tl_shaded_scene *scene, const tl_window *window, const int32_t *at_fx, const int32_t *ids,
          const float *depth, uint8_t *pixels)

/* Shades and averages several samples a pixel, from planes of ids and depth, `stride` pixels apart, one a sample;
 * samples_fx as in tl_target, all else as in `shade`. */
TL_KERNEL(void, shade_samples, const tl_shaded_scene *scene, const tl_window *window, const int32_t *samples_fx,
          int sample_bits, int64_t stride, const int32_t *ids, const float *depth, uint8_t *pixels)

/* Writes unit normals on the visible side, float32 (x, y, z), 0 for the background, rotated by shading->eye_from; show
 * is NORMALS. */
TL_KERNEL(void, shade_normals, const tl_shaded_scene *scene, const tl_window *window, const int32_t *ids, float *out)
#endif

#if !TL_KERNELS_OF || TL_KERNELS_OF == TL_UNIT_polygons
/* Sets unit normals (n_vertices, 3) of vertices [first, end): the sum of the face normals weighted by their angle, in
 * the order of the faces; 0 where the sum is 0.  Returns -1, or a row with an index outside the vertices. */
TL_KERNEL(int64_t, vertex_normals, const tl_source *source, const int32_t *triangles, int64_t n_triangles,
          int64_t first, int64_t end, double *out)

/* Sets unit normals of triangles [first, end), on the counter-clockwise side, 0 without an area: float64 (n_triangles,
 * 3), or float32 (n_triangles, 4) with 1 as the fourth; the other array is NULL.  Returns as `vertex_normals` does. */
TL_KERNEL(int64_t, face_normals, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
          double *out, float *rows)

/* Sets is_turned of triangles [first, end): 1 where the corner normals, rows of four, point away from the face normal.
 * row_of_corner is (n_triangles, 3): the triangles, where each vertex has one row.  Returns as `vertex_normals`
 * does. */
TL_KERNEL(int64_t, find_turned, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
          const float *normals, const int32_t *row_of_corner, uint8_t *is_turned)

/* Sets unit normals and angles of triangles [first, end), both float64 (n_triangles, 3).  Returns as `vertex_normals`
 * does. */
TL_KERNEL(int64_t, face_angles, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
          double *normals, double *angles)

/* Sets `starts` and `corners` of tl_fans. */
TL_KERNEL(void, list_corners, const int32_t *triangles, int64_t n_triangles, int64_t n_vertices, int32_t *starts,
          int32_t *corners)

/* Sets the groups of the corners of vertices [first, end), and the number of groups of each vertex, 0 instead of 1;
 * room for five numbers a corner of the vertex that has most corners. */
TL_KERNEL(void, find_creases, const tl_fans *fans, int64_t first, int64_t end, uint64_t *room, int32_t *groups,
          int32_t *n_groups)

/* Sets the normals of vertices [first, end), as `vertex_normals` does, and of their groups. */
TL_KERNEL(void, sum_creases, const tl_fans *fans, const tl_creases *creases, int64_t first, int64_t end)

/* Cuts faces with any number of corners into triangles, rows of `corners`: n_corners - 2 for a face of three or more;
 * `room` has tl_ear_words of the largest face.  Returns how many faces are finished. */
TL_KERNEL(int64_t, cut_faces, const tl_faces *faces, int64_t *triangles, int64_t *room)

/* Sets low and high of the corners of triangles [first, end), six numbers.  Returns as `vertex_normals` does. */
TL_KERNEL(int64_t, box_of_faces, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
          double *box)

/* Scales vectors [first, end), first multiplied from the right by a matrix (3, 3) unless that is NULL, to length 1; 0
 * where a vector is 0 or not finite.  `out` and `rows` as for `face_normals`. */
TL_KERNEL(void, unit_vectors, const tl_source *vectors, const double *turn, int64_t first, int64_t end, double *out,
          float *rows)

/* Transforms points [first, end) by an affine matrix (3, 4) into float64 (n, 3). */
TL_KERNEL(void, move_points, const tl_source *points, const double *matrix, int64_t first, int64_t end, double *out)

/* Converts the first three of n_channels of colours [first, end) to float32 rows (n, 4) with 1 as the fourth. */
TL_KERNEL(void, color_rows, const uint8_t *colors, int n_channels, int64_t first, int64_t end, float *rows)

/* Moves vertices [first, end), float32 or float64, to eye space by the rows of an affine matrix, and bends those that
 * the lens can show; writes their records. */
TL_KERNEL(void, bend_vertices, const tl_lens *lens, const tl_source *source, const double *eye_from, int64_t first,
          int64_t end, double *bent, float *records)

/* Projects points (n, 3) in eye space through a lens to the image plane: `places` (n, 2). */
TL_KERNEL(void, see_points, const tl_lens *lens, const double *points, int64_t n, double *places)

/* Lists the triangles [first, end) that a lens may bend and the triangles outside of its view, each list with room for
 * end - first + 16.  Returns how many it may bend. */
TL_KERNEL(int64_t, find_bent, const tl_lens *lens, const float *records, int64_t n_vertices, const int32_t *triangles,
          int64_t first, int64_t end, int32_t *bent, int32_t *outside, int64_t *n_outside)

/* Splits n listed triangles until their sides are straight enough.  Appends the parts to `parts`, or counts them. */
TL_KERNEL(void, split_bent, const tl_lens *lens, const double *points, const float *records, int64_t n_vertices,
          const int32_t *triangles, const int32_t *ids, int64_t n, tl_bent_parts *parts)

/* Groups n equal rows of n_words words, in the order of their first rows: sets the first row of each group and the
 * group of every row.  `table` has 2^table_bits numbers of -1, more than n.  Returns the number of groups, or -1 after
 * too many collisions of hashes. */
TL_KERNEL(int64_t, group_rows, const uint32_t *rows, int n_words, int64_t n, int table_bits, int32_t *table,
          int32_t *first, int32_t *group)

/* Sets the boxes of the nodes of a surface; all other fields are set. */
TL_KERNEL(void, build_tree, tl_surface *surface)

/* Sets the nearest triangle of points [first, end), and the nearest point of it unless `at` is NULL.  Returns the
 * largest distance. */
TL_KERNEL(double, nearest_of_points, const tl_surface *surface, const double *points, int64_t first, int64_t end,
          int32_t *triangle, double *at)

/* Bounds the distance of triangles [first, end) from a surface.  Stops where the bound exceeds the known distance by
 * `least`, or by `share` of it.  Of `reach`, only `known` is read on entry. */
TL_KERNEL(void, find_reach, const tl_surface *surface, const double *points, const int32_t *triangles, int64_t first,
          int64_t end, double share, double least, tl_reach *reach)

/* For n pairs of a point of `from` and a triangle of `points`: sets the point of the triangle nearest to the point, and
 * the squared distance. */
TL_KERNEL(void, set_feet, const double *points, const int32_t *triangles, const double *from, const int32_t *triangle,
          const int32_t *point, int64_t n, double *at, double *squared)

/* Converts the pixels of points [first, end) to columns of coordinates: rounded to 2^-bits pixels, in units of
 * 2^-grid_bits from the corner.  With wide_fx NULL points that are not narrow are only counted, and the caller calls
 * again with a table. */
TL_KERNEL(tl_vertex_counts, snap_points, const tl_source *source, int64_t first, int64_t end, int bits, int grid_bits,
          const int64_t *corner_px, int32_t *x_fx, int32_t *y_fx, int64_t *wide_fx)

/* Sets the boxes of polygons [first, end) in a window, and is_wide.  Returns the largest number of edges of a
 * polygon. */
TL_KERNEL(int64_t, bound_polygons, const tl_polygons *polygons, int64_t first, int64_t end, int64_t width,
          int64_t height, uint8_t *is_wide, tl_polygon_box *boxes)

/* Lists the polygons of each band of rows, in their order: listed[starts[k]] to listed[starts[k + 1] - 1] are in band
 * k.  A first call with listed = NULL sets starts[n_bands + 1] to the length of `listed`; `starts` has n_bands + 2
 * numbers. */
TL_KERNEL(void, sort_polygons, const tl_polygon_box *boxes, int64_t n, int64_t band_rows, int64_t n_bands,
          int64_t *starts, int32_t *listed)

/* Sets weights and is_simple of polygons [first, end); `room` has tl_certify_words.  `trust_polygons` takes valid
 * polygons: the first ring of each is its border, the others are holes. */
TL_KERNEL(void, certify_polygons, const tl_polygons *polygons, int64_t first, int64_t end, int8_t *weights,
          uint8_t *is_simple, int64_t *room)
TL_KERNEL(void, trust_polygons, const tl_polygons *polygons, int64_t first, int64_t end, int8_t *weights,
          uint8_t *is_simple)

/* Writes rows [top, bottom) of the mask of one polygon: mask.c describes the buffers. */
TL_KERNEL(void, mask_even_odd, const tl_polygons *polygons, int64_t polygon, int64_t width, int64_t top, int64_t bottom,
          uint64_t *bits, uint8_t *out)
TL_KERNEL(void, mask_nonzero, const tl_polygons *polygons, int64_t polygon, int64_t width, int64_t top, int64_t bottom,
          uint32_t *at, int32_t *list, int64_t n_list, int32_t *cells, uint64_t *bits, uint8_t *out)

/* Paints polygons over rows in their order. */
TL_KERNEL(void, label_polygons, const tl_polygons *polygons, const tl_label_job *job)

/* Computes exact shares of pixels.  Returns how many polygons of the job are finished: fewer than all when the table is
 * full. */
TL_KERNEL(int64_t, share_polygons, const tl_polygons *polygons, const tl_share_job *job)

/* For rows [first, end) of an atlas of `width` texels a row.  `touch_texels` gives each texel without an id the nearest
 * triangle that meets it, and its values there; `squared` has a number a texel of these rows, INFINITY.
 * `average_texels` writes means over covered areas; `sums` has 1 + n_values numbers a texel of these rows, `most` 1,
 * all 0. */
TL_KERNEL(void, touch_texels, const tl_atlas *atlas, int64_t first, int64_t end, int32_t *ids, float *squared,
          float *out)
TL_KERNEL(void, average_texels, const tl_atlas *atlas, int64_t first, int64_t end, double *sums, float *most,
          int32_t *ids, float *out)

/* The nearest texel with an id, within `reach` < TL_NO_TEXEL.  `find_in_rows` finds it along rows; `find_gutter` by
 * Euclidean distance: its index or -1, `room` for 2 * width numbers; `copy_texels` copies n_bytes of it to texels
 * [first, end). */
TL_KERNEL(void, find_in_rows, const int32_t *ids, int64_t width, int64_t first, int64_t end, int reach, int16_t *along)
TL_KERNEL(void, find_gutter, const int16_t *along, int64_t width, int64_t height, int64_t first, int64_t end, int reach,
          int32_t *room, int32_t *from)
TL_KERNEL(void, copy_texels, const int32_t *from, int64_t first, int64_t end, int64_t n_bytes, uint8_t *texels)

/* Adds the light of a photo to the sums and weights of texels [first, end) of given positions, normals and ids (-1:
 * none). */
TL_KERNEL(void, add_taken, const tl_taken *taken, const float *positions, const float *normals, const int32_t *ids,
          int64_t first, int64_t end, float *sums, float *weights)

/* Columns of tl_crossings.  `fill_columns` fills them by the even-odd rule in place, returns the number of columns with
 * an odd count, and adds those with winding numbers other than 0 and 1, and than 0 and -1, to n_nested (2).
 * `expand_columns` writes a byte for each voxel, `count_columns` a share, n_steps a column; `scatter_columns` each bit
 * at strides of a row, a column and a step. */
TL_KERNEL(int64_t, fill_columns, uint64_t *bits, const uint64_t *twos, int64_t n_columns, int64_t n_words,
          int64_t *n_nested)
TL_KERNEL(void, expand_columns, const uint64_t *bits, int64_t n_columns, int64_t n_words, int64_t n_steps, uint8_t *out)
TL_KERNEL(void, count_columns, const uint64_t *bits, int64_t n_columns, int64_t n_words, int64_t n_steps,
          int sample_bits, float *out)
TL_KERNEL(void, scatter_columns, const uint64_t *bits, int64_t n_rows, int64_t n_columns, int64_t n_words,
          const int64_t *strides, uint8_t *out)

/* Writes 1 for the voxels of a grid of `shape` that triangles [first, end) meet; points are in voxels. */
TL_KERNEL(void, touch_voxels, const double *points, int64_t n_points, const int32_t *triangles, int64_t first,
          int64_t end, const int64_t *shape, uint8_t *out)
#endif

#if !TL_KERNELS_OF || TL_KERNELS_OF == TL_UNIT_grad
/* Writes `rast` of a band: weights, z/w and triangle of each pixel.  `ids` is the lowest row of the picture, -1 for
 * none; rows are `step` numbers apart; first_id is added.  rast_db may be NULL. */
TL_KERNEL(void, grad_points, const tl_grad_view *view, const int32_t *ids, int64_t step, int64_t first_id, void *rast,
          void *rast_db)

/* Backward of `grad_points`: sums the gradients of vertices in a band from the gradients of `rast` and `rast_db`.
 * Returns the number of a triangle that does not exist, or -1, as `grad_values` and `grad_values_vjp` do. */
TL_KERNEL(int64_t, grad_points_vjp, const tl_grad_view *view, const tl_grad_points *points)

/* Interpolates attributes in a band, and their derivatives. */
TL_KERNEL(int64_t, grad_values, const tl_grad_view *view, const tl_grad_values *values)

/* Backward of `grad_values`: sums by row of attributes, and the gradients of `rast` and `rast_db`. */
TL_KERNEL(int64_t, grad_values_vjp, const tl_grad_view *view, const tl_grad_values *values, tl_grad_sums *sums)

/* Samples a texture at the pixels of a band. */
TL_KERNEL(void, grad_texels, const tl_grad_view *view, const tl_grad_texture *texture)

/* Backward of `grad_texels`: sums by texel, n_channels rounded up to a multiple of four columns, unless NULL; and the
 * gradients of uv, uv_da and bias. */
TL_KERNEL(void, grad_texels_vjp, const tl_grad_view *view, const tl_grad_texture *texture, tl_grad_sums *sums)

/* Sets the pixel positions of the vertices and the sides of the triangles of one part of a mesh. */
TL_KERNEL(void, grad_sides, const tl_grad_view *view, const tl_grad_outline *outline)

/* Sets the outline of one part of a mesh, after `grad_sides` of all parts. */
TL_KERNEL(void, mark_silhouettes, const tl_grad_view *view, const tl_grad_outline *outline)

/* Blends a band across silhouettes; or, backward, the gradients of its colours, and sums by vertex. */
TL_KERNEL(void, grad_edges, const tl_grad_view *view, const tl_grad_edges *edges, tl_grad_sums *sums)

/* Draws a band of attributes with smooth silhouettes; or sums its gradients; or sums the gradients of the squared
 * difference from `target`, and returns the sum of these squares. */
TL_KERNEL(double, grad_picture, const tl_grad_view *view, tl_grad_picture *picture)

/* Sums the gradients of points from the gradients of areas. */
TL_KERNEL(void, grad_area, const tl_grad_area *area)
#endif

#undef TL_KERNEL
