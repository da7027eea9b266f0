/* The state of a pass over a mesh, and vectors of triangles, for two geometries: TL_FIXED, snapped vertices
 * (triangles_fixed.c), and TL_FLOAT, vertices that are not snapped (triangles_float.c).  Each walker has a copy for
 * either: the geometry and the sink are constants wherever they are parameters, and no copy has code of the other
 * geometry. */
#ifndef TL_STATE_H
#define TL_STATE_H

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/corners.h"
#include "vertex/exact.h"
#include "vertex/setup.c"
#include "sink/fragments.h"
#include "sink/sink.c"
#include "raster/single_fixed.c"
#include "raster/row_edges.h"

#define TL_SMALL_BOX 4
#define TL_MIDDLE_BOX 16
#define TL_BIT_COLS 31                                         /* in a row that vi_bit_ranges computes at a time */
#define TL_BLOCK_COLS (TL_LANES == 4 ? TL_BIT_COLS : TL_LANES) /* in a row that is drawn at a time, except in masks */
#define TL_MAX_BOX_PX 62                                       /* rows.c: row ends in float32 are exact up to here */
#define TL_QUEUE 256

/* A queue of triangles until a vector of their size is full.  Their vertices are loaded again from the first-level
 * cache: packing twelve vectors a queue cost more. */
typedef struct {
    int n;
    /* picture pixel of the first sample of the box */
    int32_t col[TL_QUEUE + TL_MAX_LANES], row[TL_QUEUE + TL_MAX_LANES];
    int32_t size[TL_QUEUE + TL_MAX_LANES]; /* columns | rows << 16 of the box */
    int32_t id[TL_QUEUE + TL_MAX_LANES];
    float xy[TL_QUEUE + TL_MAX_LANES]; /* TL_FLOAT: X * Y of the extent */
} box_queue;

/* Bounds of the window and the mesh in one pass, in int32. */
typedef struct {
    int32_t left, top, right, bottom;    /* picture pixels */
    int32_t picture_top, picture_bottom; /* rows of the picture, which other passes draw beyond the window */
    vi last_vertex;
    /* TL_FIXED */
    int32_t max_extent; /* of a triangle that 32-bit lanes can process, in units */
    extent_rounding round;
    int32_t special_x; /* TL_SPECIAL as `load_corners` gives it */
    int second, third; /* the order of the second and third corner: culled faces then have negative area */
} batch_limits;

/* The state of one pass over a mesh; on the stack of `draw`. */
typedef struct {
    const tl_snapped *snapped; /* the triangles that are drawn */
    const tl_window *window;
    const tl_target *target;
    tl_slice *slice;
    batch_limits limits;
    int64_t bad_row; /* of triangles, -1: none so far */
    /* TL_FLOAT */
    const tl_exact_points *points;
    double centre_x, centre_y; /* the sample of a pixel from its upper left corner; 0 for squares */
    int is_far;                /* int32 cannot count the pixels of the window: all triangles are drawn singly */
    int has_refined;           /* a row end was in doubt since this was 0 */
    int has_places;            /* vertices have places, and all of the window lies within their limit */
    int may_be_on_grid;        /* triangles in doubt were on the grid: so many more vectors test it first */
    int n_slivers;             /* queued triangles without a depth plane, to be drawn singly */
    int32_t slivers[4 * (TL_QUEUE + TL_MAX_LANES)];
    /* both geometries */
    box_queue small, middle, rows;
    fragment_list fragments;
} walk_state;

/* The snapped corners of TL_LANES triangles, as loaded. */
typedef struct {
    vi x[3], y[3];
    vz z[3];
} lane_corners;

typedef struct {
    vi x_min, x_max, y_min, y_max;
} lane_extents;

/* TL_LANES triangles with positive area; corners doubled and relative to the first sample of their boxes. */
typedef struct {
    vi x[3], y[3];
    vi dx[3], dy[3]; /* edge k runs from corner k to corner k + 1; not doubled */
    vi e[3];         /* E' at the first sample, as in walk.h: >= 0 inside; SAMPLES: 2E + bias at the centre */
    vi sample;       /* the first sample: row * stride_px + column */
} lane_triangles;

/* TL_LANES triangles of TL_FLOAT, turned so that their areas are positive. */
typedef struct {
    vi ids;
    vd x[3], y[3], z[3];           /* z: only with depth */
    tl_test test;                  /* a constant where the sink is a constant */
    vd sample_x, sample_y;         /* the first sample of the box, in the picture; for squares its upper left corner */
    vf e[3], dx[3], dy[3];         /* edge functions at that sample; a row adds dx, a column subtracts dy */
    vf xy;                         /* X * Y */
    vf from_x[3], from_y[3], band; /* boxes of up to 4x4: points from the first sample, and the band of samples */
    vi sample;                     /* the first sample: row * stride_px + column */
    vm live;                       /* lanes with a triangle that has an area and is not culled */
    vm turned;                     /* corners 1 and 2 are swapped in e, dx and dy */
    vm to_turn;                    /* corners 1 and 2 are still to be swapped in x and y */
    vm on_grid;                    /* e, dx and dy are exact, in units of the grid */
} lane_exact;

/* Depth planes: z = (z0 + slope_y * (y - y0)) + slope_x * (x - x0), in half sub-pixels or, TL_FLOAT, in pixels. */
typedef struct {
    vd z0, slope_x, slope_y;
    vd x, y;   /* of the first sample */
    vd x0, y0; /* TL_FLOAT; else 0 */
} lane_planes;

/* TL_LANES loaded triangles, their boxes, and how each is drawn. */
typedef struct {
    vi top, bottom;              /* rows of the extent in the picture */
    vi col, row, n_cols, n_rows; /* the box of samples in the window */
    vm single;                   /* lanes cannot process them */
    vm drawn;                    /* other triangles to draw */
    /* TL_FIXED */
    lane_corners c;
    lane_extents extents;
    vi area, absolute; /* twice the area; positive where the visible side is drawn */
    /* TL_FLOAT */
    lane_exact t;
    vi x_fx[3], y_fx[3]; /* places, if vertices have them */
    int is_placed;       /* boxes are those of the places: at most 4x4 samples */
    vf xy;               /* X * Y, see triangles_float.c */
} lane_batch;

/* Loads the vertices of TL_LANES consecutive triangles. */
TL_INLINE void load_in_order(const tl_snapped *snapped, const int32_t *corners, lane_corners *c)
{
    for (int k = 0; k < 3; k++)
        load_vertices(snapped->mesh.vertices, corners + k, &c->x[k], &c->y[k], &c->z[k]);
}

TL_INLINE lane_extents extents_of(const lane_corners *c)
{
    return (lane_extents){vi_min(vi_min(c->x[0], c->x[1]), c->x[2]), vi_max(vi_max(c->x[0], c->x[1]), c->x[2]),
                          vi_min(vi_min(c->y[0], c->y[1]), c->y[2]), vi_max(vi_max(c->y[0], c->y[1]), c->y[2])};
}

/* Triangles that are too large for lanes; `is_single`: or special.  A special vertex has x = INT32_MIN, or special_x if
 * vertices are shifted: its triangle is then too wide, or all of its vertices are special. */
TL_INLINE vm is_too_large(const lane_extents *e, vi max_extent)
{
    return vm_or(vi_gt_unsigned(vi_sub(e->x_max, e->x_min), max_extent),
                 vi_gt_unsigned(vi_sub(e->y_max, e->y_min), max_extent));
}
TL_INLINE vm is_single(const lane_extents *e, vi max_extent, int32_t special_x)
{
    return vm_or(is_too_large(e, max_extent), vi_eq(e->x_min, vi_set1(special_x)));
}

/* Triangles that are not culled, from those with areas above 0 and below 0. */
TL_INLINE vm not_culled(tl_cull cull, vm positive, vm negative)
{
    return cull == TL_CULL_BACK ? negative : cull == TL_CULL_FRONT ? positive : vm_or(positive, negative);
}

/* Triangles with extents up to 2^25 units that are not culled: twice the area is exact in float64, at every step. */
TL_INLINE vm find_unculled(const lane_corners *c, tl_cull cull, vm *is_negative)
{
    const vd x1 = vd_from_vi(vi_sub(c->x[1], c->x[0])), y1 = vd_from_vi(vi_sub(c->y[1], c->y[0]));
    const vd x2 = vd_from_vi(vi_sub(c->x[2], c->x[0])), y2 = vd_from_vi(vi_sub(c->y[2], c->y[0]));
    const vd area = vd_sub(vd_mul(x1, y2), vd_mul(y1, x2));
    *is_negative = vd_ge(vd_set1(-1.0), area);
    return not_culled(cull, vd_ge(area, vd_set1(1.0)), *is_negative);
}

/* Whether any of the 3 * TL_LANES indices of a vector of triangles lies outside [0, last_vertex]. */
TL_INLINE int has_bad_index(const int32_t *corners, vi last_vertex)
{
    const vm bad01 =
        vm_or(vi_gt_unsigned(vi_load(corners), last_vertex), vi_gt_unsigned(vi_load(corners + TL_LANES), last_vertex));
    return vm_any(vm_or(bad01, vi_gt_unsigned(vi_load(corners + 2 * TL_LANES), last_vertex)));
}

/* The lanes whose box has a sample. */
TL_INLINE vm has_box(const lane_batch *b) { return vi_gt(vi_min(b->n_cols, b->n_rows), vi_set1(0)); }

/* Clips extents from `left` to `right` and from b->top to b->bottom to boxes in the window; empty boxes have no columns
 * or no rows. */
TL_INLINE void cut_boxes(const walk_state *s, vi left, vi right, lane_batch *b)
{
    const batch_limits *limits = &s->limits;
    b->col = vi_max(left, vi_set1(limits->left));
    b->n_cols = vi_sub(vi_min(right, vi_set1(limits->right)), b->col);
    b->row = vi_max(b->top, vi_set1(limits->top));
    b->n_rows = vi_sub(vi_min(b->bottom, vi_set1(limits->bottom)), b->row);
}

/* The index of the first samples of boxes in the target: row * stride_px + column. */
TL_INLINE vi first_samples(const walk_state *s, vi col, vi row)
{
    return vi_add(vi_mul(vi_sub(row, vi_set1(s->limits.top)), vi_set1((int32_t)s->target->stride_px)),
                  vi_sub(col, vi_set1(s->limits.left)));
}

/* The distance between samples, in units of depth planes. */
TL_INLINE double plane_step(const walk_state *s, tl_geometry g)
{
    return g == TL_FIXED ? (double)(2 << s->window->subpixel_bits) : 1.0;
}

/* ---- queues ---------------------------------------------------------------------------------------------- */

/* Appends the triangles in m; returns whether the queue is full. */
TL_INLINE int push(box_queue *q, tl_geometry g, vm m, const lane_batch *b, vi id)
{
    vi_compress(q->col + q->n, m, b->col);
    vi_compress(q->row + q->n, m, b->row);
    vi_compress(q->size + q->n, m, vi_or(b->n_cols, vi_shift_left(b->n_rows, 16)));
    vi_compress(q->id + q->n, m, id);
    if (g == TL_FLOAT)
        vi_compress((int32_t *)(q->xy + q->n), m, vi_bits_of_vf(b->xy));
    q->n += __builtin_popcount(vm_bits(m));
    return q->n > TL_QUEUE - TL_LANES;
}

/* Loads the corners of the triangles [i, i + TL_LANES) of a queue of n. */
TL_INLINE void pop_corners(const tl_snapped *snapped, vi last_vertex, const box_queue *q, int i, int n, int32_t *own)
{
    for (int k = 0; k < TL_LANES; k++) /* lanes after the end repeat the last triangle */
        memcpy(own + 3 * k, snapped->triangles + 3 * (int64_t)q->id[i + k < n ? i + k : n - 1], 3 * sizeof *own);
    for (int k = 0; k < 3; k++) { /* as in `read_corners` */
        const vi corners = vi_load(own + k * TL_LANES);
        vi_store(own + k * TL_LANES, vi_select(vi_gt_unsigned(corners, last_vertex), last_vertex, corners));
    }
}

/* The number of triangles of a queue of n in the vector at i. */
TL_INLINE int lanes_at(int i, int n) { return n - i < TL_LANES ? n - i : TL_LANES; }

/* The most rows of the boxes [i, i + TL_LANES) of a queue of n. */
TL_INLINE int most_rows(const box_queue *q, int i, int n)
{
    const int end = lanes_at(i, n);
    int most = 0;
    for (int k = 0; k < end; k++)
        most = q->size[i + k] >> 16 > most ? q->size[i + k] >> 16 : most;
    return most;
}

/* Copies of a walker of queues, which has the geometry and the sink as its last parameters, and a call of the right
 * copy. */
#define TL_WALK_COPIES(f)                                                           \
    TL_INLINE void f##_fixed(walk_state *s, tl_sink sink) { f(s, TL_FIXED, sink); } \
    TL_INLINE void f##_float(walk_state *s, tl_sink sink) { f(s, TL_FLOAT, sink); } \
    TL_LIST_COPIES(f##_fixed, (walk_state * s), s)                                  \
    TL_LIST_COPIES(f##_float, (walk_state * s), s)
#define TL_WALK_CALL(f, s, g, sink)      \
    if ((g) == TL_FIXED)                 \
        TL_LIST_CALL(f##_fixed, sink, s) \
    else                                 \
        TL_LIST_CALL(f##_float, sink, s)

/* ---- the list of samples --------------------------------------------------------------------------------- */

/* Appends the lanes in m to a list of n; returns its new length.  The length is passed by value: in memory, every call
 * would wait for the store of the call before. */
TL_INLINE int emit(fragment_list *f, int n, tl_sink sink, vm m, vi sample, vi id, vf depth)
{
    vi_compress(f->sample + n, m, sample);
    if (sink != TL_SINK_MASK && sink != TL_SINK_COUNT)
        vi_compress(f->id + n, m, id);
    if (sink_has_depth(sink))
        vi_compress((int32_t *)(f->depth + n), m, vi_bits_of_vf(depth));
    return n + __builtin_popcount(vm_bits(m));
}

/* Flushes a full list; returns its length. */
TL_INLINE int make_room(walk_state *s, int n)
{
    if (n <= TL_FRAGMENTS)
        return n;
    flush_fragments(s->target, &s->fragments, n);
    return 0;
}

/* ---- triangles of a slice -------------------------------------------------------------------------------- */

/* The id of the triangle at index i of a slice. */
TL_INLINE int64_t slice_id(const tl_slice *slice, int64_t i) { return slice->ids ? slice->ids[i] : i; }

/* Copies the corners of the triangles [i, i + TL_LANES) of a slice, unchecked; zeros after the end.  Later writes of
 * another thread to the indices have no effect. */
TL_INLINE const int32_t *slice_corners(const tl_snapped *snapped, const tl_slice *slice, int64_t i, int32_t *own)
{
    if (!slice->ids && i + TL_LANES <= slice->end) {
        const int32_t *given = snapped->triangles + 3 * i;
        for (int k = 0; k < 3 * TL_LANES; k += 16) /* 5 % of a million-triangle mesh */
            __builtin_prefetch(given + 12 * 48 + k);
        const vi first = vi_load(given), second = vi_load(given + TL_LANES), third = vi_load(given + 2 * TL_LANES);
        vi_store(own, first);
        vi_store(own + TL_LANES, second);
        vi_store(own + 2 * TL_LANES, third);
        return own;
    }
    for (int k = 0; k < TL_LANES; k++) {
        const int64_t id = i + k >= slice->end ? -1 : slice_id(slice, i + k);
        if (id >= 0)
            memcpy(own + 3 * k, snapped->triangles + 3 * id, 3 * sizeof *own);
        else
            memset(own + 3 * k, 0, 3 * sizeof *own);
    }
    return own;
}

/* Prefetches the rows of vertices of later triangles. */
TL_INLINE void fetch_rows(const void *rows, size_t n_bytes, const int32_t *corners)
{
    for (int k = 2; k < 3 * TL_LANES; k += 6) /* by address: indices are not checked yet */
        __builtin_prefetch((const void *)((uintptr_t)rows + (uint32_t)corners[k] * n_bytes));
}

/* Prefetches the rows of vertices of listed triangles, and the rows of indices of later triangles. */
TL_INLINE void fetch_listed(const void *rows, size_t n_bytes, const int32_t *triangles, const int32_t *ids)
{
    for (int k = 0; k < TL_LANES; k++) {
        const int32_t *corners = triangles + 3 * (int64_t)ids[4 * TL_LANES + k];
        __builtin_prefetch(triangles + 3 * (int64_t)ids[8 * TL_LANES + k]);
        __builtin_prefetch((const void *)((uintptr_t)rows + (uint32_t)corners[0] * n_bytes));
        __builtin_prefetch((const void *)((uintptr_t)rows + (uint32_t)corners[2] * n_bytes));
    }
}

/* The window has fewer than 2^31 samples; lanes need it within 2^30 pixels of 0. */
TL_INLINE void start_walk(walk_state *s, const tl_snapped *snapped, const tl_window *window, const tl_target *target)
{
    const int64_t farthest = (int64_t)1 << 30;
    s->snapped = snapped, s->window = window, s->target = target, s->bad_row = -1;
    s->small.n = s->middle.n = s->rows.n = s->fragments.n = s->n_slivers = 0;
    s->limits.left = (int32_t)window->x_px, s->limits.top = (int32_t)window->y_px;
    s->limits.right = (int32_t)min64(window->x_px + window->width, farthest);
    s->limits.bottom = (int32_t)min64(window->y_px + window->height, farthest);
    s->limits.picture_top = s->limits.top, s->limits.picture_bottom = s->limits.bottom;
    s->limits.last_vertex = vi_set1((int32_t)(snapped->mesh.n_vertices - 1));
}

/* Sets the rows of the picture that the passes of a slice draw. */
TL_INLINE void set_slice(walk_state *s, tl_slice *slice)
{
    s->slice = slice;
    memset(s->fragments.sample, 0, sizeof s->fragments.sample); /* prefetched after the end of the list */
    if (slice->outside && !slice->clusters) {
        s->limits.picture_top = (int32_t)slice->picture->y_px;
        s->limits.picture_bottom = (int32_t)min64(slice->picture->y_px + slice->picture->height, (int64_t)1 << 30);
    }
}

#endif
