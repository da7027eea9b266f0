/* The contract between the kernels and their callers, as far as several rooms share it: types with units, status codes.
 * A header in a room adds the types of that room; `dispatch.h` has all, and the kernel table.
 *
 * A kernel allocates nothing, touches no Python object and keeps no state; every buffer is the caller's.
 * Names carry their space: _px pixels (y down, centres at +0.5), _fx fixed point, _clip homogeneous clip space.
 */
#ifndef TOPLEFT_H
#define TOPLEFT_H

#include <stddef.h>
#include <stdint.h>

/* The value for no data.  Its sign bit is 0; that of Microsoft's NAN depends on the compiler. */
#define TL_NAN __builtin_nan("")

/* ---- vertices ------------------------------------------------------------------------------------------ */

/* A snapped vertex, 16 bytes: one vector load.  x_fx = TL_SPECIAL marks a vertex that does not fit 64-bit code; y_fx
 * then holds the reason, a tl_special. */
typedef struct {
    int32_t x_fx, y_fx; /* |.| < 2^30 */
    double z;           /* depth; 0 when the mesh has none */
} tl_vertex;

#define TL_SPECIAL INT32_MIN

typedef enum {
    TL_BAD = 0,     /* not finite, or |x_fx| >= 2^62, or a depth outside float32 */
    TL_WIDE = 1,    /* 2^30 <= |x_fx| < 2^62: the coordinates are in the table of wide vertices */
    TL_CLIPPED = 2, /* outside a clip plane: triangles that use it are drawn as pieces */
} tl_special;

typedef struct {
    int64_t x_fx, y_fx; /* |.| < 2^62 */
} tl_wide;

typedef enum { TL_F32 = 0, TL_F64 = 1, TL_I64 = 2 } tl_scalar;

/* The caller's vertices. */
typedef struct {
    const void *data; /* (n, n_components) */
    tl_scalar scalar;
    int n_components; /* 2 or 3: pixels (and depth), 3: object space when there is a matrix, 4: clip space */
    int64_t n;
    const void *matrix; /* (4, 4) row-major clip from object, of the type `scalar`, or NULL */
    int is_affine;      /* the last row of the matrix is 0 0 0 1: every w is 1, and dividing by it changes no bit */
} tl_source;

typedef struct {
    const tl_vertex *vertices;
    const tl_wide *wide;     /* a row per vertex, or NULL when no vertex is wide */
    const double *inv_w;     /* 1/w per vertex, or NULL: see `source` */
    const tl_source *source; /* the source of w when inv_w is NULL; if NULL, too, w is constant (pixel space) */
    int64_t n_vertices;
    /* the sample from the pixel's centre, to which vertices are relative: |.| <= half a pixel */
    int32_t sample_x_fx, sample_y_fx;
    const struct tl_exact_points *exact; /* vertices that are not snapped, instead of `vertices` and `wide`; or NULL */
} tl_vertex_set;

/* How many vertices of each special kind a vertex stage has stored, used by a triangle or not. */
typedef struct {
    int64_t n_bad, n_wide, n_clipped;
} tl_vertex_counts;

/* The output of projection: records, with a table of wide vertices or NULL; or, not snapped, points (n, TL_PLACED). */
typedef struct {
    tl_vertex *records;
    tl_wide *wide;
    double *points;
    /* rows of four numbers, one a vertex, copied to seen_rows with 1/w as the fourth; or NULL */
    const float *rows;
    float *seen_rows;
} tl_projected;

/* ---- clip space ---------------------------------------------------------------------------------------- */

typedef struct {
    double half_width_px, half_height_px; /* half of the whole picture, which [-1, 1] maps to */
    double guard_band_x, guard_band_y;    /* largest |x/w| and |y/w|: 2^60 sub-pixels from the middle of the picture */
    int subpixel_bits;                    /* 0 to 16 */
    int zero_to_one;                      /* depth range of clip space: [0, w] instead of [-w, w] */
    int near_clip, far_clip;
} tl_view;

/* The pieces of clipped triangles: fans of triangles over new vertices, in the order of their source triangles. */
typedef struct tl_pieces {
    tl_vertex *vertices; /* (n_vertices,) */
    tl_wide *wide;       /* (n_vertices,) */
    double *points;      /* instead of `vertices` and `wide` where vertices are not snapped: (n_vertices, 3); or NULL */
    double *inv_w;       /* (n_vertices,) */
    double *weights;     /* (n_vertices, 3): barycentrics in the source triangle */
    int32_t *triangles;  /* (n_pieces, 3) into `vertices` */
    int32_t *source;     /* (n_pieces,) index of the input triangle, ascending */
    int64_t n_vertices, n_pieces;
} tl_pieces;

/* ---- drawing ------------------------------------------------------------------------------------------- */

/* When a triangle covers a pixel: when it holds the sample, when it meets the pixel's square in positive area, or when
 * it holds the whole square.  OUTER and INNER have no depth and no order: they draw masks and counts. */
typedef enum { TL_TEST_SAMPLE = 0, TL_TEST_OUTER = 1, TL_TEST_INNER = 2 } tl_test;

/* Polled now and then to cancel a call. */
typedef struct tl_pause {
    int64_t left_px;                /* about how many pixels are left to draw before the next poll */
    int (*poll)(struct tl_pause *); /* resets left_px; unless it returns 0 the call is cancelled */
} tl_pause;

/* The part of the picture that a buffer shows, in whole pixels. */
typedef struct {
    int64_t x_px, y_px; /* picture pixel of column 0, row 0 */
    int64_t width, height;
    int subpixel_bits;
    tl_test test;
    tl_pause *pause; /* or NULL: the picture is drawn to its end */
} tl_window;

/* Counts work that takes as long as n_px pixels of a large triangle, n_px <= 2^62; not below 0, where the sum could
 * overflow. */
static inline void tl_count_work(const tl_window *window, int64_t n_px)
{
    if (window->pause && window->pause->left_px >= 0)
        window->pause->left_px -= n_px;
}

/* Whether to cancel the call: kernels then return soon, restore scratch buffers where they say so, and their other
 * results are undefined. */
static inline int tl_is_given_up(const tl_window *window)
{
    return window->pause && window->pause->left_px < 0 && window->pause->poll(window->pause);
}

/* The work of setup and cull of a triangle, and of shading a pixel, in pixels. */
#define TL_SETUP_PX 32
#define TL_SHADE_PX 32

typedef enum { TL_CULL_NONE = 0, TL_CULL_BACK = 1, TL_CULL_FRONT = 2 } tl_cull;
typedef enum { TL_METHOD_AUTO = 0, TL_METHOD_EDGE = 1, TL_METHOD_SCANLINE = 2 } tl_method;

/* How a covered sample changes the buffers. */
typedef enum {
    TL_SINK_MASK = 0,     /* uint8 = 1; a bit in `covered` until the last pass */
    TL_SINK_COUNT = 1,    /* int32 += 1 */
    TL_SINK_LABEL = 2,    /* int32 = id, painter's order: the later triangle wins */
    TL_SINK_PAINT = 3,    /* as LABEL, and float = depth */
    TL_SINK_NEAREST = 4,  /* id and depth where the depth is less; at equal depth the lower id */
    TL_SINK_FARTHEST = 5, /* id and depth where the depth is greater; at equal depth the lower id */
    TL_SINK_SAMPLES = 6,  /* float: the share of samples that are covered; bits in `covered` until the last pass */
    TL_SINK_BLEND = 7,    /* the colour of the triangle that `blend` draws; not for draw */
    TL_SINK_PEEL = 8,     /* ids and depths of the nearest layers, sorted: `peeled` */
    TL_SINK_CENSUS = 16,  /* nothing is drawn: triangles are counted by class; not for draw */
} tl_sink;

/* Which code draws a triangle, or why none does.  A triangle that a clip plane cuts is counted by its pieces. */
typedef enum {
    TL_CLASS_DEGENERATE = 0, /* no area after the snap */
    TL_CLASS_CULLED = 1,
    TL_CLASS_OUTSIDE = 2, /* of the window */
    TL_CLASS_BETWEEN = 3, /* its extent holds no sample */
    TL_CLASS_TINY = 4,    /* a vector of triangles at a time in 32 bits: boxes up to 2x2 */
    TL_CLASS_SMALL = 5,   /* up to 4x4 */
    TL_CLASS_MIDDLE = 6,  /* up to 16 rows of a vector's width */
    TL_CLASS_ROWS = 7,    /* a vector of rows of one triangle at a time */
    TL_CLASS_LONG = 8,    /* by itself from here on: row ends in float64 */
    TL_CLASS_EDGE_64 = 9, /* sample by sample in 64 bits */
    TL_CLASS_SPAN_64 = 10,
    TL_CLASS_EDGE_128 = 11,
    TL_CLASS_SPAN_128 = 12,
    TL_N_CLASSES = 13,
} tl_class;

typedef struct {
    tl_sink sink;                 /* the sink that triangles are counted for */
    int64_t n[TL_N_CLASSES];      /* triangles, or pieces */
    double boxes[TL_N_CLASSES];   /* samples of the window in their boxes */
    double covered[TL_N_CLASSES]; /* about how many of these are covered: the sum of the lesser of area and box */
} tl_census;

/* The crossings of columns: a bit a step for each sample, in rows of the target.  A depth z flips bit ceil(z - 0.5),
 * the first step whose middle is behind the surface, or n_steps; with is_set it sets bit floor(z), if that is a
 * step. */
typedef struct {
    uint64_t *bits; /* n_words of 64 a sample, more bits than n_steps */
    uint64_t *twos; /* with the bits the sum modulo 4 of 1 for each front and -1 for each back; or NULL */
    int64_t n_words;
    int is_back; /* only backs are drawn, else fronts; read with twos */
    int n_steps;
    int is_set;
} tl_crossings;

/* The layers of pixels: of all covered samples of a pixel the n_layers that come first by depth, then id.  Planes, the
 * first layer first; missing layers have id -1 and the depth that every other depth comes before. */
#define TL_MAX_LAYERS 16
typedef struct {
    int n_layers;    /* 1 to TL_MAX_LAYERS */
    int is_farthest; /* the larger depth comes first */
    int32_t *ids;    /* the window's first pixel in the first plane, with the rows of the target */
    float *depth;
    int64_t plane_px;              /* from plane to plane */
    const tl_crossings *crossings; /* instead of ids and depth, which are then not read; or NULL */
} tl_peeled;

typedef struct {
    tl_sink sink;
    void *pixels; /* mask, counts or ids; rows of stride_px pixels.  BLEND: the blend_state of mix.h */
    float *depth; /* PAINT, NEAREST, FARTHEST; rows of stride_px */
    int64_t stride_px;
    int64_t n_samples; /* from the first sample to the last, set by draw */
    /* MASK, SAMPLES: tl_covered_words(samples of stride_px * height of the window), at most 2^31 pixels.  LABEL:
     * tl_covered_words, or NULL; if not NULL, triangles are drawn from the last to the first. */
    uint64_t *covered;
    /* SAMPLES: 2^sample_bits samples a pixel, 1 to 4; stride_px is the width of the window */
    int sample_bits;
    const int32_t *samples_fx; /* (2^sample_bits, 2): x, y of each from the pixel's centre */
    int sample;                /* the sample that is drawn; set by draw */
    int32_t flip;              /* LABEL: ids are xored with it: 0, or TL_FLIP: the earlier triangle wins */
    tl_census *census;         /* CENSUS */
    const tl_peeled *peeled;   /* PEEL; the window has less than 2^31 pixels */
    /* NEAREST, FARTHEST: a bound behind all depths of a segment of a row, tl_segments(stride_px) numbers a row, set by
     * draw, so that hidden triangles and clusters are skipped; or NULL */
    float *bounds;
} tl_target;

#define TL_SEGMENT_BITS 6 /* columns of a segment */
static inline int64_t tl_segments(int64_t width) { return (width + (1 << TL_SEGMENT_BITS) - 1) >> TL_SEGMENT_BITS; }

#define TL_FLIP INT32_MAX

/* Limits of a picture of a few large triangles, filled row by row: spans in a row (one for each triangle and sample),
 * spans in a band of rows. */
#define TL_SHAPE_SLOTS 128
#define TL_SHAPE_SPANS 4096

/* Whether the flat colours of n triangles or pieces are filled row by row: few of them for the size of the picture.
 * AVX2 of a Zen 3, 1 to 32 triangles, 512x512 to 1920x1080, medians of the gain: RGBA8 by msaa4 2.7, RGBA8 `over` 2.4,
 * float32 RGBA `over` 2.3, RGB8 by centres 2.2, RGBA8 by centres 1.16. */
static inline int tl_is_large_shapes(int64_t n, int n_samples, int64_t width, int64_t height)
{
    const int64_t slots = n * (n_samples > 4 ? n_samples : 4);
    return slots <= TL_SHAPE_SLOTS && width >= 64 && width < INT32_MAX && slots * 4096 <= width * height;
}

/* A bit a sample, and a word after the end. */
static inline int64_t tl_covered_words(int64_t n_samples) { return n_samples / 64 + 2; }

/* A mesh after the snap, which kernels draw. */
typedef struct {
    tl_vertex_set mesh;
    /* (n_triangles, 3), maybe the caller's memory: draw checks the indices; later reads use vertex/corners.h, because
     * they may have changed */
    const int32_t *triangles;
    int64_t n_triangles;
    const tl_pieces *pieces; /* of triangles with TL_CLIPPED vertices, or NULL */
    tl_cull cull;
    tl_method method;
    int32_t first_id; /* the id of triangle 0 in a buffer of ids that several meshes share; read by draw alone */
    /* (n_triangles,): the id of each, less first_id; NULL: its index; read by draw alone */
    const int32_t *names;
} tl_snapped;

/* The part of a mesh that one pass draws.  Several passes may share a mesh: each processes some of the triangles, draws
 * them in its window and lists those that reach beyond it, for the passes that draw the rest of the picture. */
typedef struct {
    const int32_t *ids; /* the triangles ids[first] to ids[end - 1]; NULL: the triangles [first, end) */
    int64_t first, end;
    /* or NULL; then `snapped` has no vertices and no triangles, and `outside` gets triangles with a TL_SPECIAL
     * corner */
    struct tl_cluster_pass *clusters;
    /* out, or NULL: triangles that reach into `picture` beyond the window; end - first + 16 numbers */
    int32_t *outside;
    int64_t n_outside;
    const tl_window *picture; /* the whole of all passes; read if `outside` is not NULL */
    int is_first, is_last;    /* among the passes over the window: the first clears it */
} tl_slice;

/* The triangles that reach into a window, and the first and last band of rows of each. */
typedef struct {
    int64_t n;
    int32_t *ids, *first_band, *last_band; /* n_triangles + 16 numbers each */
} tl_bins;

#define TL_MAX_SAMPLES 16 /* of a pixel */

/* How the samples' colours are averaged: uint8 values are decoded to light and back in 65537 steps, except alpha, after
 * the first n_channels.  With straight alpha colours are weighted by it. */
typedef struct {
    const int32_t *decode; /* (256,), 0 to 65536; NULL: the values as they are */
    const uint8_t *encode; /* (65537,) */
    int n_channels;        /* of colour */
    int is_straight;       /* channel n_channels is alpha, and colours are not multiplied by it */
} tl_transfer;

/* The target of exact areas.  `cells` is scratch: tl_area_stride(width) numbers a row, int32 that are all
 * TL_CELL_CLEAR, or int64 that are all 0 when is_wide.  They end with these values. */
typedef struct {
    float *pixels; /* rows of stride_px pixels */
    int64_t stride_px;
    void *cells;
    int is_wide;
    int is_clamped; /* a pixel counts as 1 at most, instead of the sum of its areas */
} tl_area;

#define TL_CELL_CLEAR (1 << 30)
#define TL_AREA_OVERFLOW -2 /* of draw_area: the sums need int64 cells */

/* Cells a row: 16 before the first pixel, at least 16 after the last, whole cache lines. */
static inline int64_t tl_area_stride(int64_t width) { return (width + 47) / 16 * 16; }

/* How a triangle's colour changes a pixel. */
typedef enum {
    TL_BLEND_REPLACE = 0,
    TL_BLEND_OVER = 1,
    TL_BLEND_ADD = 2,
    TL_BLEND_MULTIPLY = 3,
    TL_BLEND_MAX = 4,
    TL_BLEND_MIN = 5,
} tl_blend;

/* The target of blended colours, one triangle after the other. */
typedef struct {
    void *pixels; /* rows of stride_px pixels of n_channels uint8 or float32 */
    int64_t stride_px;
    const void *colors; /* (n_triangles, n_channels), or (n_vertices, n_channels) unless is_flat */
    int n_channels, is_u8, is_flat;
    tl_blend blend;
    int is_premultiplied; /* colours are multiplied by alpha; otherwise the last of 2 or 4 channels is alpha */
    const void *ground;   /* the initial colour of all pixels; NULL: they keep their colours */
    int is_area;          /* colours are weighted by the covered area of the pixel; otherwise its centre decides */
    int64_t band_rows;    /* rows of a band, > 0: with fewer rows all triangles are set up more often */
    int32_t *packed;      /* uint8 with other than 4 channels: room for a band */
    int32_t *cells;       /* is_area: tl_blend_cells(width), all TL_CELL_CLEAR before and after */
} tl_canvas;

/* Cells for small triangles, or for strips of the width of a window. */
#define TL_STRIP_ROWS 16
#define TL_ATLAS_ROWS 1024
static inline int64_t tl_blend_cells(int64_t width)
{
    const int64_t atlas = 16 * (TL_ATLAS_ROWS + 4), strip = TL_STRIP_ROWS * tl_area_stride(width) + 16;
    return atlas > strip ? atlas : strip;
}

/* The layers to composite, and their colours: straight alpha, last. */
typedef struct {
    const int32_t *ids;  /* planes, from the first pixel on; -1, or an id of no triangle, ends the layers of a pixel */
    int64_t n_triangles; /* number of triangles that were peeled */
    int64_t plane_px;
    int n_layers;
    int n_channels; /* 2 or 4 */
    int is_u8;      /* colours are 0 to 255, and pixels uint8; otherwise colours are 0 to 1 and float32 */
    /* colours of the triangles, uint8 or float32; otherwise float32 planes (n_layers, n, n_channels) */
    int is_flat;
    const void *colors;
    const float *background; /* (n_channels,), in the range of the colours, behind all layers; or NULL */
} tl_composite;

/* ---- lines --------------------------------------------------------------------------------------------- */

typedef struct {
    tl_vertex_set mesh;
    const tl_view *view;  /* for edges with a TL_CLIPPED end; NULL in pixel space */
    const int32_t *edges; /* (n_edges, 2) into the vertices */
    int64_t n_edges;
} tl_edges;

/* Scratch and output of listing edges. */
typedef struct {
    int64_t *starts;   /* (n_vertices + 1,) */
    int32_t *last_low; /* (n_vertices,) */
    int32_t *highs;    /* (3 * n_triangles,) */
} tl_edge_scratch;

typedef struct {
    int is_smooth;      /* float32 coverage; otherwise uint8, 1 where a line is */
    void *pixels;       /* rows of stride_px */
    const float *depth; /* hides lines; rows of stride_px, or NULL */
    double depth_bias;  /* how far behind `depth` a line is still visible */
    int is_farthest;    /* larger depths are nearer */
    int64_t stride_px;
} tl_line_target;

/* ---- clouds of points ---------------------------------------------------------------------------------- */

/* Points as discs or squares. */
typedef struct {
    const tl_vertex *vertices; /* TL_SPECIAL vertices are not drawn */
    int64_t n;
    /* sub-pixels: the diameter of the disc, the side of the square, below 2^30; of all points if sizes_fx is NULL */
    int64_t size_fx;
    const int32_t *sizes_fx;
    int is_disc;
    int32_t sample_x_fx, sample_y_fx; /* of the sample, from the pixel's centre */
} tl_cloud;

/* ---- creases ------------------------------------------------------------------------------------------- */

/* Sides at a vertex that more triangles share join no corners: this bounds comparisons. */
#define TL_MOST_AT_SIDE 32

/* The triangles round vertices. */
typedef struct {
    const int32_t *triangles; /* (n_triangles, 3) */
    const int32_t *starts;    /* (n_vertices + 1,): where the corners of each vertex begin, and the end of the last */
    const int32_t *corners;   /* (3 n_triangles,): 3 * triangle + corner, vertex by vertex */
    const double *normals;    /* (n_triangles, 3), unit, 0 without an area */
    const double *angles;     /* (n_triangles, 3) */
    double least_cosine;      /* of the angle between triangles that are not creased */
} tl_fans;

/* The output of creased normals. */
typedef struct {
    const int32_t *starts;        /* (n_vertices + 1,): the rows of each vertex's groups; no rows for a single group */
    const int32_t *groups;        /* (3 n_triangles,): the group of each corner at its vertex, -1 without an area */
    const int32_t *own_triangles; /* (n_triangles, 3): the rows of corners without a group */
    int64_t first_row;            /* the number of row 0 of the groups in row_of_corner */
    double *of_vertices;          /* (n_vertices, 3) */
    double *of_groups;            /* (rows, 3) */
    int32_t *row_of_corner;       /* (n_triangles, 3), or NULL */
} tl_creases;

/* ---- values on triangles ------------------------------------------------------------------------------- */

typedef struct {
    const double *points_px;  /* (n_points, 2), before the snap */
    const double *values;     /* (n_points,) */
    const int32_t *triangles; /* (n_triangles, 3) */
    int64_t n_points, n_triangles;
    /* (1 + n_triangles, TL_PLANE_DOUBLES) of list_planes, or NULL: `fill_planes` then computes them on the fly */
    double *planes;
} tl_valued;

#define TL_PLANE_DOUBLES 8

/* ---- points of pixels ---------------------------------------------------------------------------------- */

/* The kinds of value of the point of a pixel. */
typedef enum {
    TL_POINT_ROWS_OF = 0, /* n_rows numbers, 1 or 3 */
    TL_POINT_LENGTH = 1,  /* the length of three numbers */
    /* the motion in pixels, x and y, from the projection of three numbers x, y, w to that of three others; NaN unless w
     * > 0 */
    TL_POINT_FLOW = 2,
} tl_point_kind;

#define TL_POINT_ROWS 6

typedef struct {
    const void *positions; /* (n_vertices, 3) float32 or float64 */
    int is_f64;
    double rows[TL_POINT_ROWS][4]; /* a number is row . (x, y, z, 1) */
} tl_point_mesh;

typedef struct {
    const tl_point_mesh *meshes; /* one for each instance of the picture */
    tl_point_kind kind;
    int n_rows;
    double half_width_px, half_height_px; /* FLOW: half of the whole picture */
    double background;
    int is_f64_out;
} tl_points;

/* Values of vertices, or of corners, whose derivatives are wanted, and the visible triangles. */
typedef struct {
    const int32_t *slot; /* of each triangle: its index among the visible triangles */
    const double *steps; /* of each corner: the derivatives of its weight over w along x and y, and its w: (n, 3, 3) */
    const int32_t *rows; /* of each corner: its row of `values`: (n, 3) */
    const float *values; /* (rows, n_values) */
    int64_t n_values;
} tl_sloped;

/* ---- run lengths --------------------------------------------------------------------------------------- */

#define TL_RLE_LINE 64 /* bytes of a row that are compared together */

/* A window of a picture, to list its runs of equal pixels down the columns. */
typedef struct {
    const uint8_t *pixels; /* of a mask uint8, of ids int32 */
    int n_bytes;           /* of a pixel, 1 or 4 */
    int64_t stride;        /* bytes */
    int64_t width, height; /* of the window, less than 2^31 */
    int64_t left, top;     /* of the window in the picture */
    int64_t frame_height;  /* of the picture */
    int64_t background;    /* pixels of this value are in no run */
    int is_mask;           /* runs get `key`; otherwise the value of their pixels */
    int64_t key;
} tl_run_source;

/* Pixels [start, end) of a picture, counted down its columns. */
typedef struct {
    int64_t start, end, key;
} tl_run;

/* Run lengths of n objects: how many pixels are outside of the object, then how many inside, alternating. */
typedef struct {
    int64_t n, n_pixels;   /* objects; pixels of the picture */
    const int64_t *starts; /* where the counts of each object begin; room for two a run, and one */
    int64_t *n_counts;
    int64_t *ends; /* of the last run of each object */
    int64_t *counts;
} tl_rles;

/* Rows of a picture, in the order of bytes that a PNG has. */
typedef struct {
    const uint8_t *pixels;
    const uint8_t *above;    /* the row before the first; zeros at the top of the picture */
    int64_t n_rows, n_bytes; /* of a row */
    int pixel_bytes;         /* 1 to 4 */
} tl_png_rows;

/* The most bytes of n_rows in the file: codes of 12 bits; tables, and what is written past the end. */
static inline int64_t tl_png_room(int64_t n_rows, int64_t n_bytes) { return n_rows * (1 + n_bytes) * 3 / 2 + 256; }

#endif
