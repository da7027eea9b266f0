/* Batch: setup and cull of TL_LANES triangles at a time, in 32-bit lanes.
 * In: vertex records and triangles.  Out: samples of boxes up to 2x2, queues of boxes up to 4x4 and of larger ones for
 * rows.c, and the triangles that 32 bits cannot take, for draw_triangle.
 *
 * Range: extents of at most TL_MAX_EXTENT units, so |dx|, |dy| < 2^14, doubled relative coordinates fit 16 bits,
 * products 2^30, and doubled edge functions 2^29 (see fixed.h).  Squares and several samples: two pixels less and at
 * most 8 bits, so that all this holds of corners of pixels up to a pixel outside the extent, but that doubled edge
 * functions are below 2^30. */
#ifndef TL_BATCH_C
#define TL_BATCH_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/corners.h"
#include "vertex/fixed.h"
#include "raster/alone.c"
#include "raster/fragments.h"
#include "raster/hooks.h"
#include "raster/setup.c"
#include "raster/sink.c"

#define TL_SMALL_BOX 4
#define TL_MIDDLE_BOX 16
#define TL_MAX_BOX_PX 62 /* rows.c: row ends in float32 are exact up to here */
#define TL_QUEUE 256

/* Triangles that wait until a vector is full of their kind.  Their vertices are read again then: they are still in the
 * first-level cache, and packing twelve vectors a queue cost more. */
typedef struct box_queue {
    int n;
    /* picture pixel of the first sample of the box */
    int32_t col[TL_QUEUE + TL_MAX_LANES], row[TL_QUEUE + TL_MAX_LANES];
    int32_t size[TL_QUEUE + TL_MAX_LANES]; /* columns | rows << 16 of the box */
    int32_t id[TL_QUEUE + TL_MAX_LANES];
} box_queue;

/* What one pass needs to know of the window and the mesh, in int32. */
typedef struct {
    int32_t left, top, right, bottom;    /* picture pixels */
    int32_t picture_top, picture_bottom; /* rows of the picture that other passes draw */
    int32_t max_extent;                  /* of a triangle that 32-bit lanes can take, in units */
    extent_rounding round;
    int32_t special_x; /* TL_SPECIAL as load_corners gives it */
    vi last_vertex;
    int second, third; /* which corner comes second and third: culled faces then have negative area */
} batch_limits;

/* Everything that one pass over a mesh needs; on the stack of draw. */
typedef struct batch_state {
    const tl_snapped *snapped;
    const tl_window *window;
    const tl_target *target;
    tl_share *share;
    batch_limits limits;
    int64_t bad_row; /* of triangles, -1: none so far */
    box_queue small, middle, rows;
    fragment_list fragments;
} batch_state;

/* The snapped corners of TL_LANES triangles, as loaded. */
typedef struct {
    vi x[3], y[3];
    vz z[3];
} lane_corners;

/* TL_LANES triangles as loaded, and what becomes of them. */
typedef struct {
    lane_corners c;
    vi x_min, x_max, y_min, y_max;
    vi area, absolute;           /* twice the area; positive where the side that is drawn shows */
    vi top, bottom;              /* rows of the extent in the picture */
    vi col, row, n_cols, n_rows; /* the box of samples in the window */
    vm alone;                    /* too large for 32-bit lanes, or special */
    vm drawn;                    /* the others that are to be drawn */
} lane_batch;

/* TL_LANES triangles with positive area; corners doubled and relative to the first sample of their boxes. */
typedef struct lane_triangles {
    vi x[3], y[3];
    vi dx[3], dy[3]; /* edge k runs from corner k to corner k + 1; not doubled */
    vi e[3];         /* E' at the first sample, as in walk.h: >= 0 inside; of SAMPLES 2E + bias at the centre */
    vi sample;       /* the first sample: row * stride_px + column */
} lane_triangles;

/* z = (z0 + slope_y * y) + slope_x * x, with x and y half sub-pixels from the first corner. */
typedef struct {
    vd z0, slope_x, slope_y;
    vd x, y; /* of the first sample */
} lane_planes;

TL_INLINE void load_corners(const batch_state *s, const int32_t *corners, lane_corners *c)
{
    const tl_vertex *vertices = s->snapped->mesh.vertices;
    load_vertices(vertices, corners, &c->x[0], &c->y[0], &c->z[0]);
    load_vertices(vertices, corners + s->limits.second, &c->x[1], &c->y[1], &c->z[1]);
    load_vertices(vertices, corners + s->limits.third, &c->x[2], &c->y[2], &c->z[2]);
    for (int k = 0; k < 3; k++) {
        c->x[k] = vi_sub(c->x[k], vi_set1(s->snapped->mesh.sample_x_fx));
        c->y[k] = vi_sub(c->y[k], vi_set1(s->snapped->mesh.sample_y_fx));
    }
}

/* Twice the signed area; exact where the extents are. */
TL_INLINE vi area_lanes(const lane_corners *c)
{
    const vi x1 = vi_sub(c->x[1], c->x[0]), y1 = vi_sub(c->y[1], c->y[0]);
    const vi x2 = vi_sub(c->x[2], c->x[0]), y2 = vi_sub(c->y[2], c->y[0]);
    return vi_sub(vi_mul(x1, y2), vi_mul(y1, x2));
}

/* Whether the 3 * TL_LANES indices of a vector of triangles hold one outside [0, last_vertex]. */
TL_INLINE int has_bad_index(const int32_t *corners, vi last_vertex)
{
    const vm bad01 =
        vm_or(vi_gt_unsigned(vi_load(corners), last_vertex), vi_gt_unsigned(vi_load(corners + TL_LANES), last_vertex));
    return vm_any(vm_or(bad01, vi_gt_unsigned(vi_load(corners + 2 * TL_LANES), last_vertex)));
}

/* As round_extent tells. */
TL_INLINE vi extent_pixels(vi x_fx, int32_t round, int bits)
{
    return vi_shift_right(vi_add(x_fx, vi_set1(round)), bits);
}

/* Loads TL_LANES triangles, and finds those that lanes can take and that show the side which is drawn.  Returns 0, with
 * the row in `bad_row`, when an index lies outside the vertices. */
TL_INLINE int load_batch(batch_state *s, const int32_t *corners, vi id, vm live, lane_batch *b)
{
    const batch_limits *limits = &s->limits;
    const vi zero = vi_set1(0), max_extent = vi_set1(limits->max_extent);
    if (has_bad_index(corners, limits->last_vertex)) {
        int32_t ids[TL_MAX_LANES];
        vi_store(ids, id);
        s->bad_row = ids[0];
        return 0;
    }
    load_corners(s, corners, &b->c);
    const lane_corners *c = &b->c;
    b->x_min = vi_min(vi_min(c->x[0], c->x[1]), c->x[2]), b->x_max = vi_max(vi_max(c->x[0], c->x[1]), c->x[2]);
    b->y_min = vi_min(vi_min(c->y[0], c->y[1]), c->y[2]), b->y_max = vi_max(vi_max(c->y[0], c->y[1]), c->y[2]);
    /* a special vertex has x = INT32_MIN: its triangle is too wide, or special throughout */
    const vm too_wide = vi_gt_unsigned(vi_sub(b->x_max, b->x_min), max_extent);
    const vm too_tall = vi_gt_unsigned(vi_sub(b->y_max, b->y_min), max_extent);
    b->alone = vm_and(live, vm_or(vm_or(too_wide, too_tall), vi_eq(b->x_min, vi_set1(limits->special_x))));
    b->area = area_lanes(c);
    b->absolute = s->snapped->cull == TL_CULL_NONE ? vi_max(b->area, vi_sub(zero, b->area)) : b->area;
    b->drawn = vm_and_not(vm_and(live, vi_gt(b->absolute, zero)), b->alone);
    return 1;
}

/* The boxes of samples in the window; empty ones have no columns or no rows. */
TL_INLINE void find_boxes(const batch_state *s, lane_batch *b)
{
    const batch_limits *limits = &s->limits;
    const int bits = s->window->subpixel_bits;
    b->col = vi_max(extent_pixels(b->x_min, limits->round.first, bits), vi_set1(limits->left));
    b->n_cols = vi_sub(vi_min(extent_pixels(b->x_max, limits->round.end, bits), vi_set1(limits->right)), b->col);
    b->top = extent_pixels(b->y_min, limits->round.first, bits);
    b->bottom = extent_pixels(b->y_max, limits->round.end, bits);
    b->row = vi_max(b->top, vi_set1(limits->top));
    b->n_rows = vi_sub(vi_min(b->bottom, vi_set1(limits->bottom)), b->row);
}

/* Whether there is a sample in them. */
TL_INLINE vm has_box(const lane_batch *b) { return vi_gt(vi_min(b->n_cols, b->n_rows), vi_set1(0)); }

TL_INLINE void setup_edges_lanes(lane_triangles *t, const tl_window *window, tl_sink sink)
{
    const int bits = window->subpixel_bits;
    const int of_squares = (sink == TL_SINK_MASK || sink == TL_SINK_COUNT) && window->test != TL_TEST_SAMPLE;
    for (int k = 0; k < 3; k++) {
        const vi doubled = vi_sub(vi_mul(t->dy[k], t->x[k]), vi_mul(t->dx[k], t->y[k]));
        if (of_squares) { /* from the centre to the corner that counts: half a pixel in x and in y */
            const vi zero = vi_set1(0), is_outer = vi_set1(window->test == TL_TEST_OUTER);
            const vi sides = vi_add(vi_max(t->dx[k], vi_sub(zero, t->dx[k])), vi_max(t->dy[k], vi_sub(zero, t->dy[k])));
            const vi reach = vi_shift_left(sides, bits);
            const vi inwards = window->test == TL_TEST_OUTER ? reach : vi_sub(zero, reach);
            t->e[k] = vi_shift_right(vi_sub(vi_add(doubled, inwards), is_outer), bits + 1);
            continue;
        }
        /* left: dy < 0, top: dy = 0 and dx > 0; as one number, |dx| < 2^15 */
        const vm top_left = vi_gt(vi_set1(0), vi_sub(vi_shift_left(t->dy[k], 16), t->dx[k]));
        const vi biased = vi_select(top_left, doubled, vi_sub(doubled, vi_set1(1)));
        t->e[k] = sink == TL_SINK_SAMPLES ? biased : vi_shift_right(biased, bits + 1);
    }
}

/* Turns the triangles so that their areas are positive, and measures them from the first samples of their boxes. */
TL_INLINE void place_triangles(const batch_state *s, tl_sink sink, const lane_corners *c, vi col, vi row,
                               lane_triangles *t, vd *z)
{
    const int bits = s->window->subpixel_bits, either_turn = s->snapped->cull == TL_CULL_NONE;
    const vi centre_x = vi_add(vi_shift_left(col, bits + 1), vi_set1(1 << bits));
    const vi centre_y = vi_add(vi_shift_left(row, bits + 1), vi_set1(1 << bits));
    vi x[3] = {c->x[0], c->x[1], c->x[2]}, y[3] = {c->y[0], c->y[1], c->y[2]};
    for (int k = 0; sink_has_depth(sink) && k < 3; k++)
        z[k] = vd_from_vz(c->z[k]);
    if (either_turn) {
        const vm turn = vi_gt(vi_set1(0), area_lanes(c));
        x[1] = vi_select(turn, c->x[2], c->x[1]), y[1] = vi_select(turn, c->y[2], c->y[1]);
        x[2] = vi_select(turn, c->x[1], c->x[2]), y[2] = vi_select(turn, c->y[1], c->y[2]);
        if (sink_has_depth(sink)) {
            const vd z1 = z[1];
            z[1] = vd_select(turn, z[2], z1);
            z[2] = vd_select(turn, z1, z[2]);
        }
    }
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        t->x[k] = vi_sub(vi_add(x[k], x[k]), centre_x);
        t->y[k] = vi_sub(vi_add(y[k], y[k]), centre_y);
        t->dx[k] = vi_sub(x[next], x[k]);
        t->dy[k] = vi_sub(y[next], y[k]);
    }
    t->sample = vi_add(vi_mul(vi_sub(row, vi_set1(s->limits.top)), vi_set1((int32_t)s->target->stride_px)),
                       vi_sub(col, vi_set1(s->limits.left)));
    setup_edges_lanes(t, s->window, sink);
}

/* The same operations as setup_plane in setup.c. */
TL_INLINE lane_planes plane_lanes(const lane_triangles *t, const vd *z)
{
    const vd x1 = vd_from_vi(t->dx[0]), y1 = vd_from_vi(t->dy[0]);
    const vi x2i = vi_sub(vi_set1(0), t->dx[2]), y2i = vi_sub(vi_set1(0), t->dy[2]);
    const vd x2 = vd_from_vi(x2i), y2 = vd_from_vi(y2i), d1 = vd_sub(z[1], z[0]), d2 = vd_sub(z[2], z[0]);
    const vd area = vd_from_vi(vi_sub(vi_mul(t->dx[0], y2i), vi_mul(t->dy[0], x2i))); /* exact: below 2^29 */
    const vd inverse = vd_div(vd_set1(0.5), area);
    lane_planes p;
    p.z0 = z[0];
    p.slope_x = vd_mul(vd_sub(vd_mul(d1, y2), vd_mul(d2, y1)), inverse);
    p.slope_y = vd_mul(vd_sub(vd_mul(d2, x1), vd_mul(d1, x2)), inverse);
    p.x = vd_from_vi(vi_sub(vi_set1(0), t->x[0]));
    p.y = vd_from_vi(vi_sub(vi_set1(0), t->y[0]));
    return p;
}

TL_INLINE vf plane_depth(const lane_planes *p, vd x, vd y)
{
    return sum_depth(vd_add(p->z0, vd_mul(p->slope_y, y)), vd_mul(p->slope_x, x));
}

/* Appends the lanes in m to a list of n; returns its new length.  The length is passed by value: in memory, every call
 * would wait for the last one's store. */
TL_INLINE int emit(fragment_list *f, int n, tl_sink sink, vm m, vi sample, vi id, vf depth)
{
    vi_compress(f->sample + n, m, sample);
    if (sink != TL_SINK_MASK && sink != TL_SINK_COUNT)
        vi_compress(f->id + n, m, id);
    if (sink_has_depth(sink))
        vi_compress((int32_t *)(f->depth + n), m, vi_bits_of_vf(depth));
    return n + __builtin_popcount(vm_bits(m));
}

/* Writes a full list out; returns its length. */
TL_INLINE int make_room(batch_state *s, int n)
{
    if (n <= TL_FRAGMENTS)
        return n;
    flush_fragments(s->target, &s->fragments, n);
    return 0;
}

/* Boxes of up to 2x2 samples, tested where they are. */
TL_INLINE void draw_tiny(batch_state *s, tl_sink sink, const lane_triangles *t, const vd *z, vm live, vi n_cols,
                         vi n_rows, vi id)
{
    const int bits = s->window->subpixel_bits;
    if (sink == TL_SINK_SAMPLES) {
        draw_tiny_of_samples(s, t, live, n_cols, n_rows);
        return;
    }
    const vi sample = t->sample;
    const vi stride = vi_set1((int32_t)s->target->stride_px), one = vi_set1(1), minus_one = vi_set1(-1);
    vm in[2][2];
    const vm has_col = vm_and(live, vi_gt(n_cols, one)), has_row = vm_and(live, vi_gt(n_rows, one));
    const vm boxes[2][2] = {{live, has_col}, {has_row, vm_and(has_col, has_row)}};
    for (int row = 0; row < 2; row++)
        for (int col = 0; col < 2; col++) {
            vi all = vi_set1(0);
            for (int k = 0; k < 3; k++) {
                const vi below = row ? vi_add(t->e[k], t->dx[k]) : t->e[k];
                all = vi_or(all, col ? vi_sub(below, t->dy[k]) : below);
            }
            in[row][col] = vm_and(boxes[row][col], vi_gt(all, minus_one));
        }
    const vm any = vm_or(vm_or(in[0][0], in[0][1]), vm_or(in[1][0], in[1][1]));
    if (!vm_any(any))
        return;
    lane_planes p;
    vd x_right, y_down;
    if (sink_has_depth(sink)) {
        const vd step = vd_set1((double)(2 << bits));
        p = plane_lanes(t, z);
        x_right = vd_add(p.x, step);
        y_down = vd_add(p.y, step);
    }
    /* the first sample of every triangle in one go, further ones by their place */
    const vm first01 = vm_and_not(in[0][1], in[0][0]);
    const vm first10 = vm_and_not(in[1][0], vm_or(in[0][0], in[0][1]));
    const vm first11 = vm_and_not(in[1][1], vm_or(vm_or(in[0][0], in[0][1]), in[1][0]));
    const vm on_right = vm_or(first01, first11), below = vm_or(first10, first11);
    const vi right = vi_select(on_right, vi_add(sample, one), sample);
    vf depth = vf_set1(0.0f);
    if (sink_has_depth(sink))
        depth = plane_depth(&p, vd_select(on_right, x_right, p.x), vd_select(below, y_down, p.y));
    fragment_list *f = &s->fragments;
    int n = emit(f, f->n, sink, any, vi_select(below, vi_add(right, stride), right), id, depth);
    const vm more01 = vm_and_not(in[0][1], first01), more10 = vm_and_not(in[1][0], first10);
    const vm more11 = vm_and_not(in[1][1], first11);
    if (vm_any(more01))
        n = emit(f, n, sink, more01, vi_add(sample, one), id,
                 sink_has_depth(sink) ? plane_depth(&p, x_right, p.y) : depth);
    if (vm_any(more10))
        n = emit(f, n, sink, more10, vi_add(sample, stride), id,
                 sink_has_depth(sink) ? plane_depth(&p, p.x, y_down) : depth);
    if (vm_any(more11))
        n = emit(f, n, sink, more11, vi_add(vi_add(sample, stride), one), id,
                 sink_has_depth(sink) ? plane_depth(&p, x_right, y_down) : depth);
    f->n = make_room(s, n);
}

TL_INLINE void push(box_queue *q, vm m, vi col, vi row, vi n_cols, vi n_rows, vi id)
{
    vi_compress(q->col + q->n, m, col);
    vi_compress(q->row + q->n, m, row);
    vi_compress(q->size + q->n, m, vi_or(n_cols, vi_shift_left(n_rows, 16)));
    vi_compress(q->id + q->n, m, id);
    q->n += __builtin_popcount(vm_bits(m));
}

/* The corners of the triangles [i, i + TL_LANES) of a queue of n. */
TL_INLINE void pop_corners(const tl_snapped *snapped, vi last_vertex, const box_queue *q, int i, int n, int32_t *own)
{
    for (int k = 0; k < TL_LANES; k++) /* lanes behind the end repeat the last triangle */
        memcpy(own + 3 * k, snapped->triangles + 3 * (int64_t)q->id[i + k < n ? i + k : n - 1], 3 * sizeof *own);
    for (int k = 0; k < 3; k++) { /* as read_corners */
        const vi corners = vi_load(own + k * TL_LANES);
        vi_store(own + k * TL_LANES, vi_select(vi_gt_unsigned(corners, last_vertex), last_vertex, corners));
    }
}

/* The triangles themselves. */
TL_INLINE void pop(const batch_state *s, tl_sink sink, const box_queue *q, int i, int n, lane_triangles *t, vd *z)
{
    int32_t corners[3 * TL_LANES];
    lane_corners c;
    pop_corners(s->snapped, s->limits.last_vertex, q, i, n, corners);
    load_corners(s, corners, &c);
    place_triangles(s, sink, &c, vi_load(q->col + i), vi_load(q->row + i), t, z);
}

/* Boxes of up to 4x4 samples: every sample of TL_LANES boxes. */
TL_INLINE void flush_small(batch_state *s, tl_sink sink)
{
    box_queue *q = &s->small;
    const int bits = s->window->subpixel_bits, n = q->n;
    const int32_t stride = (int32_t)s->target->stride_px;
    const vd step = vd_set1((double)(2 << bits));
    int n_fragments = s->fragments.n;
    q->n = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        lane_triangles t;
        lane_planes p;
        vd z_col[TL_SMALL_BOX];
        vd z[3];
        pop(s, sink, q, i, n, &t, z);
        if (sink_has_depth(sink)) {
            p = plane_lanes(&t, z);
            for (int col = 0; col < TL_SMALL_BOX; col++) {
                z_col[col] = vd_mul(p.slope_x, p.x);
                p.x = vd_add(p.x, step);
            }
        }
        const vi sample = t.sample, size = vi_load(q->size + i);
        const vi n_cols = vi_and(size, vi_set1(0xffff)), n_rows = vi_shift_right(size, 16);
        const vm live = vm_first(n - i);
        const vi id = names_of(s->snapped, live, vi_load(q->id + i));
        for (int row = 0; row < TL_SMALL_BOX; row++) {
            const vm in_row = vm_and(live, vi_gt(n_rows, vi_set1(row)));
            vi e0 = t.e[0], e1 = t.e[1], e2 = t.e[2];
            vd z_row;
            if (sink_has_depth(sink)) {
                z_row = vd_add(p.z0, vd_mul(p.slope_y, p.y));
                p.y = vd_add(p.y, step);
            }
            for (int col = 0; col < TL_SMALL_BOX; col++) {
                const vm in_box = vm_and(in_row, vi_gt(n_cols, vi_set1(col)));
                const vm in = vm_and(in_box, vi_gt(vi_or(vi_or(e0, e1), e2), vi_set1(-1)));
                if (TL_LANES > 1 || vm_any(in))
                    n_fragments =
                        emit(&s->fragments, n_fragments, sink, in, vi_add(sample, vi_set1(row * stride + col)), id,
                             sink_has_depth(sink) ? sum_depth(z_row, z_col[col]) : vf_set1(0.0f));
                e0 = vi_sub(e0, t.dy[0]), e1 = vi_sub(e1, t.dy[1]), e2 = vi_sub(e2, t.dy[2]);
            }
            for (int k = 0; k < 3; k++)
                t.e[k] = vi_add(t.e[k], t.dx[k]);
            if ((row & 1) == 1)
                n_fragments = make_room(s, n_fragments);
        }
    }
    s->fragments.n = n_fragments;
}

TL_LIST_COPIES(flush_small, (batch_state *s), s)

/* Copies the corners of the triangles [i, i + TL_LANES) of a share, unchecked; behind the end zeros.  What another
 * thread then writes to the indices is not seen any more. */
TL_INLINE const int32_t *share_corners(const tl_snapped *snapped, const tl_share *share, int64_t i, int32_t *own)
{
    if (!share->ids && i + TL_LANES <= share->end) {
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
        const int64_t id = i + k >= share->end ? -1 : share->ids ? share->ids[i + k] : i + k;
        if (id >= 0)
            memcpy(own + 3 * k, snapped->triangles + 3 * id, 3 * sizeof *own);
        else
            memset(own + 3 * k, 0, 3 * sizeof *own);
    }
    return own;
}

/* The rows of vertices of triangles that come later. */
TL_INLINE void fetch_rows(const void *rows, size_t n_bytes, const int32_t *corners)
{
    for (int k = 2; k < 3 * TL_LANES; k += 6) /* indices that were not checked: addresses, and no pointers */
        __builtin_prefetch((const void *)((uintptr_t)rows + (uint32_t)corners[k] * n_bytes));
}

/* The same of triangles in a list, and the rows of indices of those that come after them. */
TL_INLINE void fetch_listed(const void *rows, size_t n_bytes, const int32_t *triangles, const int32_t *ids)
{
    for (int k = 0; k < TL_LANES; k++) {
        const int32_t *corners = triangles + 3 * (int64_t)ids[4 * TL_LANES + k];
        __builtin_prefetch(triangles + 3 * (int64_t)ids[8 * TL_LANES + k]);
        __builtin_prefetch((const void *)((uintptr_t)rows + (uint32_t)corners[0] * n_bytes));
        __builtin_prefetch((const void *)((uintptr_t)rows + (uint32_t)corners[2] * n_bytes));
    }
}

/* For triangles that cover the centres of pixels; the window has fewer than 2^31 samples and lies within 2^30 pixels of
 * 0. */
static void start_batch(batch_state *s, const tl_snapped *snapped, const tl_window *window, const tl_target *target)
{
    const int bits = window->subpixel_bits, is_back = snapped->cull == TL_CULL_BACK;
    const int64_t farthest = (int64_t)1 << 30;
    s->snapped = snapped, s->window = window, s->target = target, s->bad_row = -1;
    s->small.n = s->middle.n = s->rows.n = s->fragments.n = 0;
    s->limits = (batch_limits){
        .left = (int32_t)window->x_px,
        .top = (int32_t)window->y_px,
        .right = (int32_t)min64(window->x_px + window->width, farthest),
        .bottom = (int32_t)min64(window->y_px + window->height, farthest),
        .picture_top = (int32_t)window->y_px,
        .picture_bottom = (int32_t)min64(window->y_px + window->height, farthest),
        .max_extent = TL_MAX_BOX_PX << (bits < 8 ? bits : 8),
        .round = round_extent(window),
        .special_x = (int32_t)((uint32_t)TL_SPECIAL - (uint32_t)snapped->mesh.sample_x_fx),
        .second = is_back ? 2 : 1,
        .third = is_back ? 1 : 2,
        .last_vertex = vi_set1((int32_t)(snapped->mesh.n_vertices - 1)),
    };
}

#endif
