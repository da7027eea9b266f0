/* The contract of polygons: rings of points, and how they are drawn. */
#ifndef TOPLEFT_POLYGONS_H
#define TOPLEFT_POLYGONS_H

#include <stdint.h>

#define TL_POLYGON_PAD 16                   /* points after the last point, which may be read */
#define TL_POLYGON_LIMIT ((int64_t)1 << 60) /* of |x_fx| and |y_fx| */
#define TL_NARROW_POLYGON (1 << 24)         /* |x_fx|, |y_fx| of narrow points, which lanes process */

/* Polygons of rings.  Coordinates count 2^-bits pixels from the upper left corner of the window, bits >= 1.  A point
 * that is not narrow has x_fx = INT32_MIN; wide_fx then has all points. */
typedef struct {
    const int32_t *x_fx, *y_fx; /* (n_points + TL_POLYGON_PAD,) */
    const int64_t *wide_fx;     /* (n_points, 2), or NULL */
    const int64_t *rings;       /* (n_rings + 1,): ring k has the points [rings[k], rings[k + 1]), then closes */
    const int64_t *polygons;    /* (n_polygons + 1,): polygon i has the rings [polygons[i], polygons[i + 1]) */
    const uint8_t *is_wide;     /* (n_polygons,): some point is not narrow */
    const int8_t *weights;      /* (n_rings,): the factor of a ring's signed area, -1, 0 or 1; see `certify_polygons` */
    const uint8_t *is_nonzero;  /* (n_polygons,): the rule, winding other than 0 instead of odd */
    const uint8_t *is_simple;   /* (n_polygons,): the weights are valid; otherwise pixels are resolved one by one */
    int64_t n_polygons;
    int bits;
    int32_t sample_x_fx, sample_y_fx; /* the sample from the pixel's centre */
    int64_t *crossings_left;          /* shared by all threads: how often rings may cross, see slabs.c */
    struct tl_pause *pause;           /* of this call, or NULL: the picture is drawn to its end */
} tl_polygons;

/* The pixels [left, right) x [top, bottom) that a polygon reaches, clipped to the window. */
typedef struct {
    int32_t left, top, right, bottom;
} tl_polygon_box;

typedef enum { TL_POLYGON_CENTER = 0, TL_POLYGON_OUTER = 1, TL_POLYGON_INNER = 2 } tl_polygon_test;

#define TL_SPAN_WAIT 256

/* Scratch of labels; its contents do not matter between two calls. */
#define TL_LABEL_EDGES 4096
#define TL_LABEL_ROWS 1024
#define TL_LABEL_ROOM 65536
typedef struct {
    double num[TL_LABEL_EDGES + 16], inv[TL_LABEL_EDGES + 16], step[TL_LABEL_EDGES + 16];
    int32_t row[TL_LABEL_EDGES + 16], n[TL_LABEL_EDGES + 16], up[TL_LABEL_EDGES + 16];
    int32_t left[TL_LABEL_ROWS + 16], right[TL_LABEL_ROWS + 16], count[TL_LABEL_ROWS + 16], list[TL_LABEL_ROOM + 16];
    char *span_at[2][TL_SPAN_WAIT];
    int32_t span_n[2][TL_SPAN_WAIT], span_value[2][TL_SPAN_WAIT];
    int32_t n_waiting[2], now;
} tl_label_scratch;

/* Rows of cells that are computed at a time for polygons of many edges; and cells in a row. */
#define TL_CELL_ROWS 64
static inline int64_t tl_polygon_stride(int64_t width) { return (width + 128) / 64 * 64; }

/* The part of an edge in one row, from its upper to its lower end. */
typedef struct {
    double x, slope, length; /* px right of column `col` at the upper end; d x / d y; px from end to end along x */
    double ya, yb;           /* px from the top of the row */
    int64_t col;
    int32_t ta, tb; /* ya, yb in sub-pixels */
    int32_t sign;   /* 1 downwards, -1 upwards */
} tl_edge_piece;

/* Scratch of pieces to be resolved. */
#define TL_PIECE_WORDS 31
typedef struct {
    tl_edge_piece *pieces; /* (n_pieces,), at least as many as a polygon has edges */
    int64_t *room;         /* (TL_PIECE_WORDS * n_pieces,) */
    int64_t n_pieces;
    int64_t *row_starts; /* (rows of the window + 2,) */
    double *shares;      /* (width + 16,) */
} tl_piece_scratch;

/* The values to paint: that of polygon i is values[i], or i when that is NULL. */
typedef struct {
    const int32_t *listed; /* the polygons listed[first] to listed[end - 1]; NULL: first to end - 1 */
    int64_t first, end;
    const int32_t *values;
    const tl_polygon_box *boxes; /* (n_polygons,) */
    tl_polygon_test test;
    int64_t width, top, bottom; /* rows of the window that are drawn */
    int n_bytes;                /* of a pixel, 1 or 4 */
    int32_t background;         /* what the rows are filled with first */
    int waits;                  /* spans are buffered and prefetched before they are written */
    void *pixels;               /* the window's first pixel, rows of `width` */
    int32_t *cells;             /* (TL_CELL_ROWS * tl_polygon_stride(width),), all 0, and left so */
    tl_label_scratch *scratch;
    tl_piece_scratch *pieces; /* OUTER, INNER */
} tl_label_job;

/* A job of shares: the areas of each pixel that lie in polygons. */
typedef struct {
    const int32_t *listed; /* the polygons listed[first] to listed[end - 1]; NULL: first to end - 1 */
    int64_t first, end;
    const tl_polygon_box *boxes;
    int64_t width, top, bottom;
    int32_t *cells;  /* (n_cells,), all TL_CELL_CLEAR, and left so */
    int64_t n_cells; /* at least TL_LEAST_SHARE_CELLS */
    tl_piece_scratch *pieces;
    /* pixels: the sum of the shares, at most 1; or, with colours, the pixel's colour mixed with the polygon's by its
     * share */
    float *pixels;       /* the window's first pixel, rows of `width` pixels of n_channels */
    const float *colors; /* (n_polygons, n_channels), or NULL */
    int n_channels;
    int is_alone; /* one polygon replaces the pixels, 0 outside of it; no colours */
    /* or a table: */
    int64_t *starts; /* (n_polygons + 1,) from starts[first] on */
    void *indices;   /* int32 or int64: row * width + column */
    float *areas;
    int is_long;    /* int64 indices */
    int64_t n_room; /* the most entries; 16 more can be written after them */
} tl_share_job;

/* The least number of cells: small polygons are drawn several at a time. */
#define TL_LEAST_SHARE_CELLS 49152

/* int64 that `certify_polygons` needs for a polygon: two keys for each ring, and the nodes of a tree. */
static inline int64_t tl_certify_words(int64_t n_points, int64_t n_rings)
{
    return 4 * n_rings + 18 * (n_points / 16 + n_rings);
}

#endif
