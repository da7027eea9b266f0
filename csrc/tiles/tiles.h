/* The contract of windows of huge rasters: which triangles each window needs. */
#ifndef TOPLEFT_TILES_H
#define TOPLEFT_TILES_H

#include <stdint.h>

/* A raster cut into windows of one size; the last row and column may be smaller. */
typedef struct {
    int64_t width_px, height_px;               /* of the raster, below 2^31 */
    int64_t window_width_px, window_height_px; /* at least 1 */
    int subpixel_bits;
} tl_tiling;

/* Windows [first, end) of a row of windows that a triangle may touch. */
typedef struct {
    int32_t triangle, first, end;
} tl_window_span;

/* Windows that a box touches: columns [left, right) of rows [top, bottom). */
typedef struct {
    int32_t left, right, top, bottom;
} tl_window_box;

/* The most windows of a span whose triangle is written to each window. */
#define TL_SHORT_SPAN 2

/* Vertices and triangles in place: rows of numbers of any type, to be copied. */
typedef struct {
    const char *points;
    int64_t point_stride; /* bytes from row to row */
    int64_t point_bytes;  /* of a row */
    int64_t n_points;
    const char *triangles; /* rows of three int32, or int64 */
    int64_t triangle_stride;
    int is_wide;
} tl_corners;

#endif
