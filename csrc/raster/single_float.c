/* Single: one triangle of any finite float64 vertices by itself, by the ends of rows in float64.
 * In: points in pixels.  Out: spans of samples to the sink.
 *
 * As in rows.c, with u = 2^-53: setup and rows err by less than 11.01 u XY, so M = 12 u XY, and a quotient by 2.01 u of
 * itself, 3 u for each column of the box.  Results that are not finite are refined.  Extents may have any size: a box
 * is the samples of the window, and its first sample lies in the extent. */
#ifndef TL_SINGLE_FLOAT_C
#define TL_SINGLE_FLOAT_C

#include <float.h>
#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/corners.h"
#include "vertex/exact.h"
#include "vertex/setup.c"
#include "exact/sign.c"
#include "sink/sink.c"
#include "raster/single_fixed.c"
#include "raster/refine.c"
#include "raster/state.h"
#include "raster/triangles_float.c"

/* A triangle by itself, with positive area. */
typedef struct {
    refined_triangle edges;
    double inverse[3];        /* 1 / |dy| */
    int refines_all;          /* some band is wider than half a column */
    int64_t col, row, n_rows; /* the box in the window */
    double z[3];
    int has_plane;
    double slope_x, slope_y;
    scaled_number area; /* twice the area, unless has_plane */
    int32_t id;
} single_triangle;

/* The first pixel of [low, high) whose sample, `centre` from its upper left corner, is not left of x; else `high`.
 * Exact: x - centre can only round to an integer that is too low. */
static int64_t first_pixel(double x, double centre, int64_t low, int64_t high)
{
    if (low >= high || x <= (double)low + centre)
        return low;
    if (x > (double)(high - 1) + centre)
        return high;
    const double distance = x - centre;
    const int64_t below = (int64_t)distance, n = below + ((double)below < distance); /* ceil() is a call */
    return (double)n + centre < x ? n + 1 : n;
}

/* The first square of [low, high) that reaches right of x; else `high`. */
static int64_t first_square(double x, int64_t low, int64_t high)
{
    if (x < (double)low || x >= (double)high)
        return x < (double)low ? low : high;
    const int64_t n = (int64_t)x;
    return n - ((double)n > x);
}

/* Sets the pixels of [low, high) whose samples lie in an extent, or whose squares meet it in more than a line, or lie
 * in it. */
static int64_t find_single_box(double x0, double x1, tl_test test, double centre, int64_t low, int64_t high,
                               int64_t *first)
{
    *first = test == TL_TEST_OUTER ? first_square(x0, low, high) : first_pixel(x0, centre, low, high);
    return (test == TL_TEST_INNER ? first_square(x1, low, high) : first_pixel(x1, centre, low, high)) - *first;
}

TL_INLINE double lesser_of(double a, double b) { return b < a ? b : a; }
TL_INLINE double larger_of(double a, double b) { return b > a ? b : a; }
TL_INLINE double least_of(double a, double b, double c) { return lesser_of(lesser_of(a, b), c); }
TL_INLINE double most_of(double a, double b, double c) { return larger_of(larger_of(a, b), c); }

/* The depth plane, by the operations of plane_of_lanes and take_out_slivers in triangles_float.c: equal bits. */
static void plane_of_points(single_triangle *t, double width, double height)
{
    const exact_point *p = t->edges.corners;
    const double x1 = p[1].x - p[0].x, y1 = p[1].y - p[0].y, x2 = p[2].x - p[0].x, y2 = p[2].y - p[0].y;
    const double area = x1 * y2 - y1 * x2, box = width * height, d1 = t->z[1] - t->z[0], d2 = t->z[2] - t->z[0];
    t->has_plane = width <= TL_MOST_EXTENT && height <= TL_MOST_EXTENT && box >= TL_LEAST_BOX &&
                   area * (double)(1 << TL_SLIVER_BITS) >= box;
    if (!t->has_plane) {
        t->area = edge_value(p[0], p[1], p[2]);
        return;
    }
    const double inverse = 1.0 / area;
    t->slope_x = (d1 * y2 - d2 * y1) * inverse;
    t->slope_y = (d2 * x1 - d1 * x2) * inverse;
}

/* The work of a depth by weights, in pixels of a plane. */
#define TL_WEIGHTED_PX 256

/* The depth of a sample by weights: shares of the area, each within 2^-49 of its size. */
static float weighted_depth(const single_triangle *t, exact_point sample)
{
    const exact_point *p = t->edges.corners;
    const double w1 = scaled_quotient(edge_value(p[2], p[0], sample), t->area);
    const double w2 = scaled_quotient(edge_value(p[0], p[1], sample), t->area);
    return (float)(t->z[0] + (w1 * (t->z[1] - t->z[0]) + w2 * (t->z[2] - t->z[0]))) + 0.0f;
}

/* Sets the edge functions at the first sample of the box, with their bands. */
static void setup_single_edges(const walk_state *s, single_triangle *t, double width, double height)
{
    refined_triangle *e = &t->edges;
    const double border = e->test == TL_TEST_SAMPLE ? 0.0 : 2.0;
    const double margin =
        12.0 * 0x1p-53 * larger_of(width + border, 1.0) * larger_of(height + border, 1.0) * s->points->band;
    for (int k = 0; k < 3; k++) {
        const exact_point a = e->corners[k], b = e->corners[k == 2 ? 0 : k + 1];
        const double dx = b.x - a.x, dy = b.y - a.y;
        const exact_point p = tested_point(a, b, (exact_point){e->sample_x, e->sample_y}, e->test);
        const double v = dy * (a.x - p.x) - dx * (a.y - p.y), inverse = 1.0 / fabs(dy);
        const double band = margin * inverse + 3.0 * 0x1p-53 * (e->n_cols + 2) * s->points->band;
        e->v[k] = v, e->dx[k] = dx, e->dy[k] = dy;
        e->band[k] = margin < INFINITY && isfinite(v) && isfinite(dx) && band < 0.49 ? band
                     : dy == 0.0                                                     ? 0.0
                                                                                     : INFINITY;
        t->inverse[k] = inverse < 1e290 ? inverse : 1e290;
    }
}

/* The nearest integer of a number below 2^51. */
TL_INLINE double nearest_of(double x) { return (x + 0x1.8p52) - 0x1.8p52; }

/* Sets the edge functions without a band if vertices lie on 2^-8 px, near enough that 2E < 2^51.  Returns whether they
 * do. */
static int setup_on_grid(single_triangle *t)
{
    refined_triangle *e = &t->edges;
    const double unit = (double)(1 << TL_GRID_BITS);
    int64_t x[3], y[3]; /* doubled, relative to the first sample */
    for (int k = 0; k < 3; k++) {
        const double x_fx = e->corners[k].x * unit, y_fx = e->corners[k].y * unit;
        if (!(fabs(x_fx) < 0x1p23 && fabs(y_fx) < 0x1p23 && x_fx == nearest_of(x_fx) && y_fx == nearest_of(y_fx)))
            return 0;
        x[k] = (int64_t)(2.0 * (x_fx - e->sample_x * unit)), y[k] = (int64_t)(2.0 * (y_fx - e->sample_y * unit));
    }
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const int64_t dx = (x[next] - x[k]) / 2, dy = (y[next] - y[k]) / 2;
        const int top_left = dy < 0 || (dy == 0 && dx > 0), is_outer = e->test == TL_TEST_OUTER;
        const int is_square = e->test != TL_TEST_SAMPLE, bias = is_square ? is_outer : !top_left;
        const int64_t side = is_square ? 2 << TL_GRID_BITS : 0; /* as in `tested_point` */
        const int64_t px = is_outer == (dy < 0) ? side : 0, py = is_outer == (dx > 0) ? side : 0;
        e->v[k] = (double)((dy * (x[k] - px) - dx * (y[k] - py) - bias) >> (TL_GRID_BITS + 1)) + 0.5;
        e->dx[k] = (double)dx, e->dy[k] = (double)dy, e->band[k] = -1.0;
        t->inverse[k] = dy ? 1.0 / fabs((double)dy) : 1.0;
    }
    return 1;
}

/* Sets the columns [*first, *end) of a row; returns whether the row is in doubt.  Adding 0x1.8p52 rounds to the nearest
 * integer: floor() is a call on the scalar set. */
TL_INLINE unsigned find_single_end(const single_triangle *t, int64_t row, int32_t *first, int32_t *end)
{
    const refined_triangle *e = &t->edges;
    const double far = e->n_cols + 2.0, magic = 0x1.8p52;
    double begin = 0.0, stop = e->n_cols;
    int is_doubted = t->refines_all;
    for (int k = 0; k < 3; k++) {
        if (e->dy[k] == 0.0)
            continue;
        const double any_q = (e->v[k] + e->dx[k] * (double)row) * t->inverse[k], low_q = any_q < far ? any_q : far;
        const double q = low_q > -far ? low_q : -far, nearest = (q + magic) - magic, off = q - nearest;
        const double quotient = off < 0.0 ? nearest - 1.0 : nearest;
        is_doubted |= (fabs(off) <= e->band[k]) & (q == any_q); /* beyond the box no column is in doubt */
        if (e->dy[k] < 0.0)
            begin = -quotient > begin ? -quotient : begin;
        else
            stop = quotient + 1.0 < stop ? quotient + 1.0 : stop;
    }
    *first = (int32_t)begin, *end = (int32_t)(stop > 0.0 ? stop : 0.0);
    return (unsigned)is_doubted;
}

/* Row ends without lanes, in steps of 2^-TL_STEP_BITS columns from row to row: like `walk_scanline`, but quotients are
 * rounded, once and in each step. */
#define TL_STEP_BITS 40
typedef struct {
    int n;
    int is_left[3];
    int64_t at[3], step[3]; /* q, and its step from row to row */
    int64_t band[3];        /* q is refined if it is as near to an integer */
    int64_t twice[3];       /* 2 * band, or -1: not refined */
} row_steps;

/* Sets the steps; returns 0 where 64 bits do not suffice.  Besides the errors that the band covers, q at the first row
 * and each step err by 2^-52 of the largest |q|, and by one unit in the conversion to integers.  On the grid, where
 * nothing is refined, q is at least 0.5 / |dy| from an integer. */
static int setup_steps(const single_triangle *t, row_steps *r)
{
    const refined_triangle *e = &t->edges;
    const double unit = (double)((int64_t)1 << TL_STEP_BITS), n_rows = (double)t->n_rows;
    if (t->refines_all || t->n_rows > 1 << 12 || e->n_cols > 1 << 20)
        return 0;
    r->n = 0;
    for (int k = 0; k < 3; k++) {
        const double q = e->v[k] * t->inverse[k], step = e->dx[k] * t->inverse[k], most = fabs(q) + fabs(step) * n_rows;
        const int is_refined = e->band[k] >= 0.0, i = r->n;
        const double band = (is_refined ? e->band[k] * unit : 0.0) + n_rows * (1.0 + 0x1p-12 * most) + 4.0;
        if (e->dy[k] == 0.0)
            continue;
        if (!(most < 0x1p20) || !(band < 0.49 * unit * (is_refined ? 1.0 : t->inverse[k])))
            return 0;
        r->is_left[i] = e->dy[k] < 0.0;
        r->at[i] = (int64_t)(q * unit), r->step[i] = (int64_t)(step * unit);
        r->band[i] = is_refined ? (int64_t)band : 0, r->twice[i] = is_refined ? 2 * (int64_t)band : -1;
        r->n++;
    }
    return 1;
}

/* Sets the columns [*first, *end) of the current row, and steps to the next row; returns whether the row is in
 * doubt. */
TL_INLINE unsigned take_step(row_steps *r, int32_t n_cols, int32_t *first, int32_t *end)
{
    const int64_t below_1 = ((int64_t)1 << TL_STEP_BITS) - 1;
    int64_t begin = 0, stop = n_cols;
    int is_doubted = 0;
    for (int k = 0; k < r->n; k++) {
        const int64_t at = r->at[k], quotient = at >> TL_STEP_BITS;
        is_doubted |= ((at + r->band[k]) & below_1) <= r->twice[k];
        if (r->is_left[k])
            begin = -quotient > begin ? -quotient : begin;
        else
            stop = quotient + 1 < stop ? quotient + 1 : stop;
        r->at[k] = at + r->step[k];
    }
    *first = (int32_t)begin, *end = (int32_t)stop;
    return (unsigned)is_doubted;
}

/* Sets the columns [first, end) of TL_LANES rows; returns the rows in doubt. */
TL_INLINE unsigned find_single_ends(const single_triangle *t, int64_t row0, int32_t *first, int32_t *end)
{
    const refined_triangle *e = &t->edges;
    if (TL_LANES == 1)
        return find_single_end(t, row0, first, end);
    const vd rows = vd_add(vd_set1((double)row0), vd_from_vi(vi_iota())), low = vd_set1(0.0);
    const vd high = vd_set1((double)e->n_cols);
    vd begins = low, ends = high;
    vm doubted = vm_first(t->refines_all ? TL_LANES : 0);
    for (int k = 0; k < 3; k++) {
        if (e->dy[k] == 0.0)
            continue;
        const vd v = vd_add(vd_set1(e->v[k]), vd_mul(vd_set1(e->dx[k]), rows));
        const vd q = vd_mul(v, vd_set1(t->inverse[k])), quotient = vd_floor(q);
        doubted = vm_or(doubted, vd_ge(vd_set1(e->band[k]), vd_abs(vd_off_integer(q))));
        if (e->dy[k] < 0.0)
            begins = vd_max(begins, vd_sub(low, quotient));
        else
            ends = vd_min(ends, vd_add(quotient, vd_set1(1.0)));
    }
    vi_store(first, vi_round(vd_min(begins, high)));
    vi_store(end, vi_round(vd_max(ends, low)));
    return vm_bits(doubted);
}

/* Draws the samples [first, end) of a row of the box, with depth; `at` is the first sample of the row. */
TL_INLINE void put_single_depths(const tl_target *target, tl_sink sink, const single_triangle *t, int64_t row,
                                 int64_t at, int32_t first, int32_t end)
{
    const exact_point *p = t->edges.corners;
    const double y = t->edges.sample_y + (double)row;
    if (!t->has_plane) {
        for (int32_t col = first; col < end; col++) {
            const float z = weighted_depth(t, (exact_point){t->edges.sample_x + (double)col, y});
            put_depths(target, sink, at + col, vm_first(1), vf_set1(z), t->id);
        }
        return;
    }
    const vd z_row = vd_set1(t->z[0] + t->slope_y * (y - p[0].y)), slope_x = vd_set1(t->slope_x), steps = ramp(1.0);
    const vd x0 = vd_set1(p[0].x);
    for (int32_t col = first; col < end; col += TL_LANES) {
        const vd x = vd_sub(vd_add(vd_set1(t->edges.sample_x + (double)col), steps), x0);
        put_depths(target, sink, at + col, vm_first(end - col), sum_depth(z_row, vd_mul(slope_x, x)), t->id);
    }
}

/* Sets up triangle i; returns whether there is something to draw.  A vertex that is not finite ends the pass. */
static int setup_single_float(walk_state *s, int32_t i, single_triangle *t, tl_test test, int with_depth)
{
    refined_triangle *e = &t->edges;
    const tl_window *w = s->window;
    exact_point *p = e->corners;
    int32_t corners[3];
    read_corners(s->snapped, i, corners);
    for (int k = 0; k < 3; k++)
        p[k] = point_of(s->points, corners[k]);
    const double x0 = least_of(p[0].x, p[1].x, p[2].x), x1 = most_of(p[0].x, p[1].x, p[2].x);
    const double y0 = least_of(p[0].y, p[1].y, p[2].y), y1 = most_of(p[0].y, p[1].y, p[2].y);
    for (int k = 0; k < 3; k++)
        if (!isfinite(p[k].x) || !isfinite(p[k].y)) {
            s->bad_row = i;
            return 0;
        }
    e->test = test;
    e->n_cols = (int)find_single_box(x0, x1, test, s->centre_x, w->x_px, w->x_px + w->width, &t->col);
    t->n_rows = find_single_box(y0, y1, test, s->centre_y, w->y_px, w->y_px + w->height, &t->row);
    if (e->n_cols <= 0 || t->n_rows <= 0)
        return 0;
    const int sign = edge_sign(p[0], p[1], p[2]), second = sign < 0 ? 2 : 1;
    if (is_culled(sign, s->snapped->cull))
        return 0;
    if (sign < 0) {
        const exact_point first = p[1];
        p[1] = p[2], p[2] = first;
    }
    e->sample_x = (double)t->col + s->centre_x, e->sample_y = (double)t->row + s->centre_y;
    t->id = name_of(s->snapped, i);
    if (!setup_on_grid(t))
        setup_single_edges(s, t, x1 - x0, y1 - y0);
    t->refines_all = e->band[0] == INFINITY || e->band[1] == INFINITY || e->band[2] == INFINITY;
    if (with_depth) {
        const int32_t ordered[3] = {corners[0], corners[second], corners[3 - second]};
        for (int k = 0; k < 3; k++)
            t->z[k] = s->points->stride < 3 ? 0.0 : s->points->points[(int64_t)ordered[k] * s->points->stride + 2];
        plane_of_points(t, x1 - x0, y1 - y0);
    }
    return 1;
}

/* Decides the ends of the rows in doubt, by the exact sign. */
static __attribute__((noinline)) void refine_single_ends(const refined_triangle *a, int64_t row0, unsigned doubted,
                                                         int32_t *first, int32_t *end)
{
    for (; doubted; doubted &= doubted - 1) {
        const int k = __builtin_ctz(doubted);
        int64_t from, to;
        decide_row(a, row0 + k, &from, &to);
        first[k] = (int32_t)from, end[k] = (int32_t)to;
    }
}

TL_INLINE void draw_single_float(walk_state *s, int32_t i, tl_sink sink)
{
    const tl_target target = *s->target; /* copies that no store can alias */
    single_triangle found;
    int32_t first[TL_MAX_LANES], end[TL_MAX_LANES];
    if (!setup_single_float(s, i, &found, test_of(s, sink), sink_has_depth(sink)))
        return;
    const single_triangle t = found;
    const int64_t stride = target.stride_px, corner = (t.row - s->window->y_px) * stride + t.col - s->window->x_px;
    const int is_slow = sink_has_depth(sink) && !t.has_plane;
    if (!is_slow)
        tl_count_work(s->window, t.n_rows * t.edges.n_cols);
    row_steps steps;
    const int takes_steps = TL_LANES == 1 && setup_steps(&t, &steps);
    for (int64_t row0 = 0; row0 < t.n_rows && !(is_slow && tl_is_given_up(s->window)); row0 += TL_LANES) {
        const int n = t.n_rows - row0 < TL_LANES ? (int)(t.n_rows - row0) : TL_LANES;
        if (is_slow)
            tl_count_work(s->window, (int64_t)TL_WEIGHTED_PX * n * t.edges.n_cols);
        const unsigned doubted = takes_steps ? take_step(&steps, t.edges.n_cols, first, end)
                                             : find_single_ends(&t, row0, first, end) & ((1u << n) - 1);
        if (__builtin_expect(doubted != 0, 0))
            refine_single_ends(&found.edges, row0, doubted, first, end);
        for (int k = 0; k < n; k++) {
            const int64_t at = corner + (row0 + k) * stride;
            if (first[k] >= end[k])
                continue;
            if (sink_has_depth(sink))
                put_single_depths(&target, sink, &t, row0 + k, at, first[k], end[k]);
            else
                put_plain(&target, sink, at + first[k], end[k] - first[k], t.id);
        }
    }
}

TL_SINK_COPIES(draw_single_float, (walk_state * s, int32_t i), s, i)

/* Counts the squares that any of the pieces [first, end) of one triangle meets, or holds, once each. */
static void count_squares_of_pieces(walk_state *s, int64_t first, int64_t end)
{
    single_triangle t[TL_MAX_PIECES];
    const int64_t left = s->window->x_px, top = s->window->y_px;
    int64_t row0 = top + s->window->height, row1 = top;
    int n = 0;
    for (int64_t i = first; i < end && n < TL_MAX_PIECES; i++) {
        if (!setup_single_float(s, (int32_t)i, &t[n], s->window->test, 0))
            continue;
        row0 = min64(row0, t[n].row);
        row1 = max64(row1, t[n].row + t[n].n_rows);
        n++;
    }
    for (int64_t row = row0; row < row1; row++) {
        row_span spans[TL_MAX_PIECES];
        int n_spans = 0;
        for (int i = 0; i < n; i++) {
            int32_t from, to;
            if (row < t[i].row || row >= t[i].row + t[i].n_rows)
                continue;
            if (find_single_end(&t[i], row - t[i].row, &from, &to))
                refine_single_ends(&t[i].edges, row - t[i].row, 1, &from, &to);
            const int64_t col = t[i].col - left;
            spans[n_spans++] = (row_span){col + from, col + to};
        }
        count_spans(spans, n_spans, s->window, s->target, row - top);
    }
}

/* Counts triangles [first, end), which are pieces: the pieces of one triangle have one name. */
static __attribute__((noinline)) void count_pieces(walk_state *s, int64_t first, int64_t end)
{
    for (int64_t i = first, next; i < end && s->bad_row < 0 && !tl_is_given_up(s->window); i = next) {
        for (next = i + 1; next < end && s->snapped->names[next] == s->snapped->names[i];)
            next++;
        count_squares_of_pieces(s, i, next);
    }
}

static __attribute__((noinline)) void draw_one_float(walk_state *s, int32_t i)
{
    TL_SINK_CALL(draw_single_float, s->target->sink, s, i)
}

/* Draws the queued slivers, which have no depth plane. */
static __attribute__((noinline)) void draw_slivers(walk_state *s)
{
    for (int k = 0; k < s->n_slivers && s->bad_row < 0 && !tl_is_given_up(s->window); k++)
        draw_one_float(s, s->slivers[k]);
    s->n_slivers = 0;
}

#endif
