/* The contract of gradients: tensors of pixels, and sums by vertex and by texel.
 *
 * All tensors of a call hold float32, or all hold float64; computations are in float64.  A call processes a band, some
 * rows of one picture; the bands of a picture depend on its height alone.  `rast` has four numbers a pixel: the weights
 * of the first and the second corner, z/w, and the number of the triangle plus 1. */
#ifndef TOPLEFT_GRAD_H
#define TOPLEFT_GRAD_H

#include <stdint.h>

enum { TL_MOST_LEVELS = 32, TL_IDS_ROOM = 32 };

typedef enum { TL_TEXEL_NEAREST, TL_TEXEL_LINEAR, TL_TEXEL_LEVEL, TL_TEXEL_LEVELS } tl_texel_filter;
typedef enum { TL_EDGE_WRAP, TL_EDGE_CLAMP, TL_EDGE_ZERO, TL_EDGE_CUBE } tl_texel_edge;
typedef enum { TL_PAIR_SILHOUETTE, TL_PAIR_AREA, TL_PAIR_STRAIGHT } tl_pair_rule;

/* A picture, the mesh in it, and the band: rows [first_row, end_row). */
typedef struct {
    const void *pos;    /* (n_vertices, 4): x, y, z, w */
    const int32_t *tri; /* (n_triangles, 3) */
    int64_t n_vertices, n_triangles, width, height, first_row, end_row;
    double z_most;             /* z/w is clamped to [-z_most, z_most] */
    double scale[2], shift[2]; /* the centre of column c has x / w = (2 c + 1) scale[0] + shift[0] */
    int is_f64;
} tl_grad_view;

/* Sums of the rows of a tensor that a band uses, in the order of first use. */
typedef struct {
    int32_t *slot_of; /* of each row of the tensor: its index in `rows`; -1 before and after */
    int32_t *rows;
    double *sums; /* (n, n_columns) */
    int64_t n, n_columns;
} tl_grad_sums;

/* Sums of a triangle in tl_grad_points.faces; the most attributes of float32 that are computed in float32. */
enum { TL_SUMS_OF_POINTS = 16, TL_FEW_COLUMNS = 4 };

/* Gradients of `rast`.  g_db may be NULL. */
typedef struct {
    const void *rast, *g_rast, *g_db;
    tl_grad_sums *faces;    /* by triangle, TL_SUMS_OF_POINTS columns: scratch */
    tl_grad_sums *vertices; /* x, y, z, w */
} tl_grad_points;

/* Attributes of vertices.  Backward reads `out` and `out_da` as gradients, and writes g_rast and g_rast_db. */
typedef struct {
    const void *attr; /* (n_attr, n_columns) */
    int64_t n_attr, n_columns;
    const int32_t *wanted; /* (n_wanted): columns with derivatives in out_da */
    int64_t n_wanted;
    const void *rast, *rast_db;
    void *out, *out_da; /* (height, width, n_columns), (height, width, 2 n_wanted) or NULL */
    void *g_rast, *g_rast_db;
} tl_grad_values;

/* A texture with its mipmap levels, and lookups.  Backward reads `out` as a gradient, and writes g_uv, g_uv_da,
 * g_bias. */
typedef struct {
    const void *levels[TL_MOST_LEVELS];
    int64_t widths[TL_MOST_LEVELS], heights[TL_MOST_LEVELS];
    int64_t first_texels[TL_MOST_LEVELS]; /* the first row of level k in the sums */
    int64_t n_levels, n_channels;
    tl_texel_filter filter;
    tl_texel_edge edge;
    const void *uv, *uv_da, *bias; /* uv_da and bias may be NULL */
    void *out;
    void *g_uv, *g_uv_da, *g_bias; /* or NULL */
} tl_grad_texture;

/* Edges of a mesh in a view, computed in parts. */
typedef struct {
    /* (n_triangles, 3), of the edge opposite to a corner: h = 3 * the other triangle + its corner; -1 for none; -2 - h
     * where the two are wound differently or the edge has more than two triangles */
    const int32_t *across;
    double *places; /* (n_vertices, 2): positions in pixels */
    /* (n_triangles): side and TL_IS_AHEAD, -1 for a triangle without corners; in `outline` also the edges that are
     * silhouettes */
    int32_t *sides, *outline;
    int64_t part, n_parts;
} tl_grad_outline;

/* Pairs of neighbouring pixels across silhouettes. */
typedef struct {
    const void *rast;
    const int32_t *across; /* across, places, outline: as in tl_grad_outline */
    const double *places;
    const int32_t *outline;
    int32_t *ids; /* (3, width + TL_IDS_ROOM): scratch */
    tl_pair_rule rule;
    const void *color;
    int64_t n_channels;
    void *out;         /* forward */
    const void *g_out; /* backward, NULL forward */
    void *g_color;
    float *steps; /* NULL, or of one pair: n_channels colours of the far pixel minus those of the near pixel */
} tl_grad_edges;

/* A picture of attributes of float32 with smooth silhouettes: forward, backward, or both against a target.  The band is
 * drawn with up to two rows more on either side, n_px pixels in all; a face is a triangle that these show. */
enum { TL_ROWS_KEPT = 12, TL_PAIR_BYTES = 152, TL_HEAD_OF_FACE = 16, TL_SUMS_OF_FACE = 28, TL_FACE_ROWS = 6 };
typedef struct {
    const int32_t *ids; /* of row 0; -1 for none */
    int64_t step;       /* from row to row */
    const float *attr;  /* (n_attr, n_columns) */
    int64_t n_attr, n_columns;
    tl_grad_edges edges; /* without `color`, `out`, `g_out`, g_color */
    /* (height, width, n_columns), one of three: the picture, its gradients, or a target; `scale`: twice the weight of
     * the squared differences from the target */
    float *out;
    const float *g_out, *target;
    double scale;
    /* Written by a forward pass; read by a backward pass from `g_out`. */
    int64_t *row_runs, *row_pairs; /* (rows + 1): the first run, the first pair of each row */
    int32_t *begins, *run_faces;   /* (n_px + TL_IDS_ROOM): of runs */
    int32_t *of_faces;             /* (TL_FACE_ROWS, face_step), face_step >= n_faces + TL_IDS_ROOM */
    int64_t face_step, n_faces;
    void *pairs;  /* (2 n_px, TL_PAIR_BYTES) */
    float *steps; /* (2 n_px, n_columns): of pairs */
    /* Scratch. */
    float *window;          /* TL_ROWS_KEPT rows of n_columns numbers a pixel, + TL_IDS_ROOM */
    double *moves;          /* 16 rows of n_columns numbers a pixel */
    float *rast;            /* a row of four numbers a pixel */
    tl_grad_sums *faces;    /* by triangle, TL_HEAD_OF_FACE columns and TL_SUMS_OF_FACE for each three attributes */
    tl_grad_sums *vertices; /* out, not scratch: x, y, z, w, then attributes; NULL forward */
} tl_grad_picture;

/* Areas of triangles in pixels, each times the values of the triangle, NULL for 1. */
typedef struct {
    const double *points_px;  /* (n_points, 2), finite */
    const int32_t *triangles; /* (n_triangles, 3) */
    int64_t n_triangles, width, height, n_channels;
    const double *values; /* (n_triangles, n_channels) */
    const double *grad;   /* (height, width, n_channels) */
    double *out;          /* (n_points, 2): gradients are added */
} tl_grad_area;

#endif
