/* Refine: row ends in the band of doubt, for vertices that are not snapped.
 * In: a vector of triangles, and rows.  Out: row ends, by float64 and, where its error is too large, by the exact
 * sign. */
#ifndef TL_REFINE_C
#define TL_REFINE_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/exact.h"
#include "exact/sign.c"
#include "sink/sink.c"
#include "raster/state.h"
#include "raster/triangles_float.c"

#define TL_NEAR_BAND 0x1.2p-19f /* 36 u: for row ends up to 17 columns away */
#define TL_FAR_BAND 0x1.04p-17f /* 130 u: for row ends up to 62 columns away */

/* The samples [first, end) of TL_LANES rows of one triangle. */
typedef struct {
    int32_t first[TL_MAX_LANES], end[TL_MAX_LANES];
} row_ends;

/* A triangle whose row ends are refined. */
typedef struct {
    exact_point corners[3];
    double v[3], dx[3], dy[3], band[3]; /* of edge 0, 1, 2; at row 0 of the box */
    double sample_x, sample_y;          /* the first sample of the box */
    tl_test test;
    int n_cols;
} refined_triangle;

/* Sets the bands of the edges of a triangle, in columns. */
TL_INLINE void set_bands(const walk_state *s, const lane_exact *t, float far, vf *inverse, vf *band)
{
    const vf zero = vf_set1(0.0f), margin = vf_mul(t->xy, vf_set1(TL_ROW_BAND));
    const vf slack = vf_set1(far * (float)s->points->band), never = vf_set1(-1.0f);
    for (int k = 0; k < 3; k++) {
        const vm level = vf_eq(t->dy[k], zero);
        const vf size = vf_max(t->dy[k], vf_sub(zero, t->dy[k]));
        inverse[k] = vf_div(vf_set1(1.0f), vf_select(level, vf_set1(1.0f), size));
        band[k] = vf_select(vm_or(level, t->on_grid), never, vf_add(vf_mul(margin, inverse[k]), slack));
    }
}

/* Whether column k of a row lies inside edge i. */
TL_INLINE int is_column_inside(const refined_triangle *a, int i, double y, int64_t k)
{
    const exact_point sample = {a->sample_x + (double)k, y};
    return is_inside_edge(a->corners[i], a->corners[i == 2 ? 0 : i + 1], sample, a->test);
}

/* The columns of [*first, *end) inside edge i, by bisection. */
static __attribute__((noinline)) void bisect_row(const refined_triangle *a, int i, double y, int64_t *first,
                                                 int64_t *end)
{
    const int is_left = a->dy[i] < 0.0;
    int64_t low = *first, high = *end; /* the first column that is inside a left edge, or outside a right edge */
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (is_column_inside(a, i, y, middle) == is_left)
            high = middle;
        else
            low = middle + 1;
    }
    *(is_left ? first : end) = low;
}

/* Sets the columns [*first, *end) of a row with an end in doubt. */
TL_INLINE void decide_row(const refined_triangle *a, int64_t row, int64_t *first, int64_t *end)
{
    const double y = a->sample_y + (double)row;
    *first = 0, *end = a->n_cols;
    for (int i = 0; i < 3; i++) {
        if (a->dy[i] == 0.0 || *first >= *end)
            continue;
        const double size = fabs(a->dy[i]), v = a->v[i] + a->dx[i] * (double)row, q = v / size;
        if (!(a->band[i] < 0.49) && !(fabs(q) > a->n_cols + 2.0 * a->band[i])) {
            bisect_row(a, i, y, first, end);
            continue;
        }
        const double far = a->n_cols + 2.0, near = q > far ? far : q < -far ? -far : q;
        const double nearest = (near + 0x1.8p52) - 0x1.8p52, off = near - nearest;
        int64_t floor_q = (int64_t)nearest - (off < 0.0);
        if (fabs(off) <= a->band[i]) {
            const int64_t k = a->dy[i] < 0.0 ? -(int64_t)nearest : (int64_t)nearest;
            if (k >= 0 && k < a->n_cols)
                floor_q = (int64_t)nearest - !is_column_inside(a, i, y, k);
        }
        if (a->dy[i] < 0.0)
            *first = -floor_q > *first ? -floor_q : *first;
        else
            *end = floor_q + 1 < *end ? floor_q + 1 : *end;
    }
}

/* Copies lane k of a vector of triangles, with the lane's numbers. */
static __attribute__((noinline)) void set_refined(const walk_state *s, const box_queue *q, int i, int k,
                                                  const lane_exact *t, float far, refined_triangle *a)
{
    vf inverse[3], band[3];
    float lane[TL_MAX_LANES];
    set_bands(s, t, far, inverse, band);
    load_turned(s, q->id[i + k], vm_bits(t->turned) >> k & 1, a->corners);
    for (int edge = 0; edge < 3; edge++) {
        vf_store(lane, t->e[edge]), a->v[edge] = lane[k];
        vf_store(lane, t->dx[edge]), a->dx[edge] = lane[k];
        vf_store(lane, t->dy[edge]), a->dy[edge] = lane[k];
        vf_store(lane, band[edge]), a->band[edge] = lane[k];
    }
    a->sample_x = q->col[i + k] + s->centre_x, a->sample_y = q->row[i + k] + s->centre_y;
    a->n_cols = q->size[i + k] & 0xffff, a->test = t->test;
}

/* floor(q) of edge k in TL_LANES rows, of TL_LANES triangles or of one: where q is in its band, by the sign of E at
 * that column in float64.  Adds to *unsure the lanes where float64 is in doubt, too. */
TL_INLINE vi decide_floors(const vd *x, const vd *y, int k, tl_test test, vd sample_x, vd py, vm is_left, vf q, vf band,
                           vm *unsure)
{
    const vf off = vf_off_integer(q), size = vf_max(off, vf_sub(vf_set1(0.0f), off)), nearest = vf_sub(q, off);
    const vm near = vf_ge(band, size);
    const vf col = vf_select(is_left, vf_sub(vf_set1(0.0f), nearest), nearest);
    const lane_sides_of_edge sides = sides_of_edge(x, y, k, vd_add(sample_x, vd_from_vf(col)), py, test);
    const vi end = vi_nearest(nearest), before = vi_sub(end, vi_set1(1));
    const vm told = vm_and_not(vm_or(sides.inside, sides.outside), vf_ge(band, vf_set1(0.49f)));
    *unsure = vm_or(*unsure, vm_and_not(near, told));
    return vi_select(near, vi_select(sides.inside, end, before), vi_floor(q));
}

/* ---- boxes of up to 16 rows and TL_LANES columns -------------------------------------------------------- */

/* Columns in doubt of one edge in a vector of triangles: lane | row << 8 | col << 16. */
typedef struct {
    int n;
    int32_t codes[(TL_MIDDLE_BOX + 1) * TL_MAX_LANES];
} doubted_columns;

/* Decides the columns in doubt of edge k, TL_LANES at a time by float64, then by the exact sign; clears the bits of
 * columns outside. */
TL_INLINE void decide_columns(const picked_points *m, int k, tl_test test, doubted_columns *d,
                              int32_t (*bits)[TL_MAX_LANES])
{
    const int next = k == 2 ? 0 : k + 1;
    vi_store(d->codes + d->n, vi_set1(0));
    for (int i = 0; i < d->n; i += TL_LANES) {
        const vi code = vi_load(d->codes + i), lane = vi_and(code, vi_set1(0xff));
        const vi row = vi_and(vi_shift_right(code, 8), vi_set1(0xff)), col = vi_shift_right(code, 16);
        const vd px = vd_add(vd_pick(m->sample_x, lane), vd_from_vi(col));
        const vd py = vd_add(vd_pick(m->sample_y, lane), vd_from_vi(row));
        const vd x[2] = {vd_pick(m->x[k], lane), vd_pick(m->x[next], lane)};
        const vd y[2] = {vd_pick(m->y[k], lane), vd_pick(m->y[next], lane)};
        const lane_sides_of_edge sides = sides_of_edge(x, y, 0, px, py, test);
        const unsigned outside = vm_bits(sides.outside);
        for (unsigned left = vm_bits(vm_and_not(vm_first(d->n - i), sides.inside)); left; left &= left - 1) {
            const int j = __builtin_ctz(left), code_j = d->codes[i + j];
            const int lane_j = code_j & 0xff, row_j = code_j >> 8 & 0xff, col_j = code_j >> 16;
            const exact_point a = {m->x[k][lane_j], m->y[k][lane_j]}, b = {m->x[next][lane_j], m->y[next][lane_j]};
            const exact_point sample = {m->sample_x[lane_j] + col_j, m->sample_y[lane_j] + row_j};
            if (outside >> j & 1 || !is_inside_edge(a, b, sample, test))
                bits[row_j][lane_j] &= ~(1 << col_j);
        }
    }
}

/* Sets the bits of a row of the lanes in doubt as if columns in doubt were inside, and lists these columns; returns the
 * lanes whose band is as wide as a column. */
TL_INLINE vm list_columns(const lane_exact *t, const vf *inverse, const vf *band, vm doubted, vi n_cols, int row,
                          int32_t *bits, doubted_columns *d)
{
    const vi zero = vi_set1(0), one = vi_set1(1);
    const vf far = vf_set1(2.0f * TL_MIDDLE_BOX);
    vi begin = zero, end = n_cols, col[3];
    vm near[3], wide = vm_first(0);
    for (int k = 0; k < 3; k++) {
        const vm is_left = vf_lt(t->dy[k], vf_set1(0.0f)), is_right = vf_lt(vf_set1(0.0f), t->dy[k]);
        const vf unclamped = vf_mul(vf_fma(t->dx[k], vf_set1((float)row), t->e[k]), inverse[k]);
        const vf q = vf_max(vf_min(unclamped, far), vf_sub(vf_set1(0.0f), far)), off = vf_off_integer(q);
        const vf reach = vf_fma(vf_set1(2.0f), band[k], vf_from_vi(n_cols)); /* beyond it all are inside or none */
        const vm may_end = vf_ge(reach, vf_max(unclamped, vf_sub(vf_set1(0.0f), unclamped)));
        near[k] = vm_and(vm_and(doubted, may_end), vf_ge(band[k], vf_max(off, vf_sub(vf_set1(0.0f), off))));
        wide = vm_or(wide, vm_and(near[k], vf_ge(band[k], vf_set1(0.49f))));
        const vi nearest = vi_nearest(vf_sub(q, off)), floors = vi_select(near[k], nearest, vi_floor(q));
        begin = vi_select(is_left, vi_max(begin, vi_sub(zero, floors)), begin);
        end = vi_select(is_right, vi_min(end, vi_add(floors, one)), end);
        col[k] = vi_select(is_left, vi_sub(zero, nearest), nearest);
    }
    const vi found = vi_bit_ranges(vi_min(begin, n_cols), vi_max(end, zero));
    vi_store(bits, vi_select(doubted, found, vi_load(bits)));
    for (int k = 0; k < 3; k++) {
        const vm is_refined = vm_and(near[k], vm_and(vi_gt(end, col[k]), vi_gt(col[k], vi_sub(begin, one))));
        if (!vm_any(is_refined))
            continue;
        d[k].n += vi_compress(d[k].codes + d[k].n, is_refined,
                              vi_add(vi_iota(), vi_shift_left(vi_add(vi_set1(row), vi_shift_left(col[k], 8)), 8)));
    }
    return wide;
}

/* Decides all rows of the lanes in doubt: on their grid, by float64 at each column in doubt, by the exact sign; rows
 * with wide bands one by one. */
static __attribute__((noinline)) void refine_middle_rows(walk_state *s, const box_queue *q, int i, lane_exact *t,
                                                         vm doubted, int n_rows, int32_t (*bits)[TL_MAX_LANES])
{
    const vi size = vi_load(q->size + i), n_cols = vi_and(size, vi_set1(0xffff));
    picked_points m;
    doubted_columns d[3];
    vf inverse[3], band[3];
    unsigned wide_rows[TL_MIDDLE_BOX], any = 0;
    d[0].n = d[1].n = d[2].n = 0;
    try_grid(s, t, 0);
    set_bands(s, t, TL_NEAR_BAND, inverse, band);
    for (int row = 0; row < n_rows; row++) {
        const vm in_box = vm_and(doubted, vi_gt(vi_shift_right(size, 16), vi_set1(row)));
        wide_rows[row] = vm_bits(list_columns(t, inverse, band, in_box, n_cols, row, bits[row], d));
        any |= wide_rows[row];
    }
    store_points_to_pick(t, &m);
    for (int k = 0; k < 3; k++)
        decide_columns(&m, k, t->test, &d[k], bits);
    for (; any; any &= any - 1) {
        const int k = __builtin_ctz(any), n = q->size[i + k] >> 16;
        refined_triangle a;
        set_refined(s, q, i, k, t, TL_NEAR_BAND, &a);
        for (int row = 0; row < n; row++) {
            int64_t first, end;
            if (!(wide_rows[row] >> k & 1))
                continue;
            decide_row(&a, row, &first, &end);
            bits[row][k] = first < end ? (int32_t)((1u << end) - (1u << first)) : 0;
        }
    }
}

/* Decides TL_LANES rows of a triangle from row0 on: by float64, and where float64 is in doubt, row by row by the exact
 * sign. */
TL_INLINE void decide_row_ends(const refined_triangle *a, int row0, unsigned doubted, row_ends *ends)
{
    const vi zero = vi_set1(0), n_cols = vi_set1(a->n_cols);
    const vf rows = vf_from_vi(vi_add(vi_iota(), vi_set1(row0)));
    const vd py = vd_add(vd_set1(a->sample_y + row0), ramp(1.0)), sample_x = vd_set1(a->sample_x);
    vd x[3], y[3];
    vi begin = zero, end = n_cols;
    vm unsure = vm_first(0);
    for (int k = 0; k < 3; k++)
        x[k] = vd_set1(a->corners[k].x), y[k] = vd_set1(a->corners[k].y);
    for (int k = 0; k < 3; k++) {
        const float size = (float)fabs(a->dy[k]);
        const vm is_left = vm_first(a->dy[k] < 0.0 ? TL_LANES : 0);
        if (a->dy[k] == 0.0)
            continue;
        const vf v = vf_fma(vf_set1((float)a->dx[k]), rows, vf_set1((float)a->v[k])),
                 q = vf_mul(v, vf_set1(1.0f / size));
        const vi floors =
            decide_floors(x, y, k, a->test, sample_x, py, is_left, q, vf_set1((float)a->band[k]), &unsure);
        if (a->dy[k] < 0.0)
            begin = vi_max(begin, vi_sub(zero, floors));
        else
            end = vi_min(end, vi_add(floors, vi_set1(1)));
    }
    vi_store(ends->first, begin), vi_store(ends->end, end);
    for (unsigned left = vm_bits(unsure) & doubted; left; left &= left - 1) {
        const int row = __builtin_ctz(left);
        int64_t first, stop;
        decide_row(a, row0 + row, &first, &stop);
        ends->first[row] = (int32_t)first, ends->end[row] = (int32_t)stop;
    }
}

/* Decides the rows from row0 on of triangle i + k of the queue. */
static __attribute__((noinline)) void refine_row_ends(walk_state *s, int i, int k, const lane_exact *t, int row0,
                                                      unsigned doubted, row_ends *ends)
{
    refined_triangle a;
    set_refined(s, &s->rows, i, k, t, TL_FAR_BAND, &a);
    decide_row_ends(&a, row0, doubted, ends);
    s->has_refined = 1;
}

#endif
