/* Attributes of vertices at pixels, and their derivatives; and backward.
 * In: `rast`, `rast_db`, attributes.  Out: pictures; backward: gradients of `rast` and `rast_db`, sums by row.
 *
 * Up to four attributes of float32 are computed in float32 in the lanes of spans.h; others in float64. */
#ifndef TL_GRAD_VALUES_C
#define TL_GRAD_VALUES_C

#include <stdint.h>

#include "topleft.h"
#include "grad/grad.h"
#include "grad/pixels.h"
#include "grad/spans.h"
#include "lanes/lanes.h"
#include "lanes/quads.h"

/* Offsets of the attributes of the corners of a triangle. */
TL_INLINE void attr_rows(const tl_grad_view *view, int32_t id, int64_t n_columns, int64_t *rows)
{
    for (int k = 0; k < 3; k++)
        rows[k] = n_columns * view->tri[3 * (int64_t)id + k];
}

/* Derivatives of an attribute by u and by v. */
TL_INLINE void attr_steps(const tl_grad_values *v, const int64_t *rows, int64_t c, double *steps, int is_f64)
{
    const double last = get_real(v->attr, rows[2] + c, is_f64);
    steps[0] = get_real(v->attr, rows[0] + c, is_f64) - last;
    steps[1] = get_real(v->attr, rows[1] + c, is_f64) - last;
}

/* Writes the derivatives of the wanted attributes at the pixels of a run. */
TL_INLINE void slopes_of_run(const tl_grad_values *v, const pixel_run *run, const int64_t *rows, int is_f64)
{
    double step[2];
    for (int64_t j = 0; j < v->n_wanted; j++) {
        attr_steps(v, rows, v->wanted[j], step, is_f64);
        for (int64_t at = run->at; at < run->at + run->n; at++)
            for (int axis = 0; axis < 2; axis++) {
                const double du = get_real(v->rast_db, 4 * at + axis, is_f64);
                const double dv = get_real(v->rast_db, 4 * at + 2 + axis, is_f64);
                put_real(v->out_da, 2 * (v->n_wanted * at + j) + axis, step[0] * du + step[1] * dv, is_f64);
            }
    }
}

/* Writes n attributes from `first` on at the pixels of a run; n is at most TL_FEW_COLUMNS. */
TL_INLINE void values_of_run(const tl_grad_values *v, const pixel_run *run, const int64_t *rows, int64_t first, int n,
                             int64_t n_columns, int is_f64)
{
    double step[TL_FEW_COLUMNS][2], last[TL_FEW_COLUMNS];
    for (int c = 0; c < n; c++) {
        attr_steps(v, rows, first + c, step[c], is_f64);
        last[c] = get_real(v->attr, rows[2] + first + c, is_f64);
    }
    for (int64_t at = run->at; at < run->at + run->n; at++) {
        const double by_u = get_real(v->rast, 4 * at, is_f64), by_v = get_real(v->rast, 4 * at + 1, is_f64);
        for (int c = 0; c < n; c++)
            put_real(v->out, n_columns * at + first + c, last[c] + by_u * step[c][0] + by_v * step[c][1], is_f64);
    }
}

TL_INLINE int64_t values_of(const tl_grad_view *view, const tl_grad_values *v, int is_f64)
{
    const int64_t n_columns = v->n_columns;
    int64_t rows[3];
    pixel_run run = before_shown(view);
    clear_band(view, v->out, n_columns);
    clear_band(view, v->out_da, 2 * v->n_wanted);
    while (next_shown(view, v->rast, v->n_attr, &run, is_f64)) {
        attr_rows(view, run.id, n_columns, rows);
        for (int64_t c = 0; c < n_columns; c += TL_FEW_COLUMNS) {
            const int64_t n = n_columns - c;
            values_of_run(v, &run, rows, c, n < TL_FEW_COLUMNS ? (int)n : TL_FEW_COLUMNS, n_columns, is_f64);
        }
        slopes_of_run(v, &run, rows, is_f64);
    }
    return run.bad_id;
}

/* Sets the numbers of the runs of a span: each attribute at the last corner, and its derivatives by u and v. */
TL_INLINE void set_value_numbers(const tl_grad_values *v, grad_span *s, int n)
{
    const vf zero = vf_set1(0.0f);
    for (int r = 0; r < s->n_runs; r += TL_LANES) {
        const vm m = vm_and(vm_first(s->n_runs - r), vi_gt(vi_load(s->ids + r), vi_set1(-1)));
        for (int c = 0; c < n; c++) {
            vf at[3];
            for (int k = 0; k < 3; k++) {
                const vi row = vi_mul(vi_load(s->corners[k] + r), vi_set1(n));
                at[k] = vf_of_bits(vi_gather(m, (const int32_t *)v->attr + c, row));
            }
            vf_store(s->numbers[3 * c] + r, at[2]);
            for (int k = 0; k < 2; k++)
                vf_store(s->numbers[3 * c + 1 + k] + r, vf_select(m, vf_sub(at[k], at[2]), zero));
        }
    }
}

/* Steps to the next span of a band and sets the numbers of its runs; 0 at the end. */
TL_INLINE int next_value_span(const tl_grad_view *view, const tl_grad_values *v, grad_span *s, int n)
{
    if (!next_grad_span(view, &(id_rows){.rast = v->rast}, v->n_attr, s))
        return 0;
    set_value_numbers(v, s, n);
    return 1;
}

/* Writes n columns of pixels; four are in the order of quads. */
TL_INLINE void store_columns(float *p, int n_pixels, const vf *columns, int n)
{
    float some[4 * TL_MAX_LANES];
    float *to = n_pixels < TL_LANES ? some : p;
    if (n == 4)
        store_some_quads(to, TL_LANES, columns);
    else if (n == 3)
        vf_store_triples(to, columns);
    else if (n == 2)
        vf_store_pairs(to, columns);
    else
        vf_store(to, columns[0]);
    if (to != p)
        copy_rows(p, some, n_pixels, n);
}

/* Writes n <= TL_FEW_COLUMNS attributes of float32. */
TL_INLINE int64_t values_in_lanes(const tl_grad_view *view, const tl_grad_values *v, int n)
{
    const vi order = n == 4 ? order_of_quads() : vi_iota();
    grad_span s = TL_BEFORE_SPANS(view);
    clear_band(view, v->out_da, 2 * v->n_wanted);
    while (next_value_span(view, v, &s, n)) {
        const int64_t at = s.row * view->width + s.first;
        for (int i = 0; i * TL_LANES < s.n; i++) {
            const span_lanes p = lanes_of_span(&s, i, order, n == 4);
            const float *rast = (const float *)v->rast + 4 * (at + p.x);
            vf uv[4], out[TL_FEW_COLUMNS];
            if (n == 4)
                load_some_quads(rast, p.n, uv);
            else
                load_some_columns(rast, 4, p.n, uv);
            for (int c = 0; c < n; c++) {
                const vf by_v = vf_fma(uv[1], pick_number(&p, 3 * c + 2), pick_number(&p, 3 * c));
                out[c] = vf_select(p.is_shown, vf_fma(uv[0], pick_number(&p, 3 * c + 1), by_v), vf_set1(0.0f));
            }
            store_columns((float *)v->out + n * (at + p.x), p.n, out, n);
        }
        for (int r = 0; v->n_wanted && r < s.n_runs; r++) {
            pixel_run run = {.id = s.ids[r], .at = at + s.begins[r], .n = s.begins[r + 1] - s.begins[r]};
            int64_t rows[3];
            if (run.id < 0)
                continue;
            attr_rows(view, run.id, n, rows);
            slopes_of_run(v, &run, rows, 0);
        }
    }
    return s.bad_id;
}

/* Whether offsets of attributes are below 2^31. */
TL_INLINE int has_few_values(const tl_grad_values *v) { return v->n_attr < INT32_MAX / TL_FEW_COLUMNS; }

/* See kernels.h. */
static int64_t grad_values(const tl_grad_view *view, const tl_grad_values *v)
{
    if (view->is_f64)
        return values_of(view, v, 1);
    switch (has_few_values(v) ? v->n_columns : 0) {
    case 1: return values_in_lanes(view, v, 1);
    case 2: return values_in_lanes(view, v, 2);
    case 3: return values_in_lanes(view, v, 3);
    case 4: return values_in_lanes(view, v, 4);
    default: return values_of(view, v, 0);
    }
}

/* Backward of the derivatives of attributes at the pixels of a run. */
TL_INLINE void backward_slopes(const tl_grad_values *v, const pixel_run *run, const int64_t *rows, double **to,
                               int is_f64)
{
    for (int64_t at = run->at; at < run->at + run->n; at++) {
        double db[4], g_db[4] = {0}, step[2];
        for (int c = 0; c < 4; c++)
            db[c] = get_real(v->rast_db, 4 * at + c, is_f64);
        for (int64_t j = 0; j < v->n_wanted; j++) {
            const int64_t c = v->wanted[j];
            attr_steps(v, rows, c, step, is_f64);
            for (int axis = 0; axis < 2; axis++) {
                const double g = get_real(v->out_da, 2 * (v->n_wanted * at + j) + axis, is_f64);
                g_db[axis] += g * step[0], g_db[2 + axis] += g * step[1];
                to[0][c] += g * db[axis], to[1][c] += g * db[2 + axis], to[2][c] -= g * (db[axis] + db[2 + axis]);
            }
        }
        for (int c = 0; c < 4; c++)
            put_real(v->g_rast_db, 4 * at + c, g_db[c], is_f64);
    }
}

/* Adds the sums of an attribute over a run, times u, times v and plain, to its corners. */
TL_INLINE void add_to_corners(double **to, int64_t column, double by_u, double by_v, double whole)
{
    to[0][column] += by_u, to[1][column] += by_v, to[2][column] += whole - by_u - by_v;
}

/* Backward of n attributes from `first` on at the pixels of a run; adds to the gradients of `rast`, except at `first` =
 * 0. */
TL_INLINE void backward_run(const tl_grad_values *v, const pixel_run *run, const int64_t *rows, int64_t first, int n,
                            int64_t n_columns, double **to, int is_f64)
{
    double step[TL_FEW_COLUMNS][2], sum[TL_FEW_COLUMNS][3] = {{0}};
    for (int c = 0; c < n; c++)
        attr_steps(v, rows, first + c, step[c], is_f64);
    for (int64_t at = run->at; at < run->at + run->n; at++) {
        const double by_u = get_real(v->rast, 4 * at, is_f64), by_v = get_real(v->rast, 4 * at + 1, is_f64);
        double g_u = 0.0, g_v = 0.0;
        for (int c = 0; c < n; c++) {
            const double g = get_real(v->out, n_columns * at + first + c, is_f64);
            g_u += g * step[c][0], g_v += g * step[c][1];
            sum[c][0] += g * by_u, sum[c][1] += g * by_v, sum[c][2] += g;
        }
        if (first) {
            g_u += get_real(v->g_rast, 4 * at, is_f64);
            g_v += get_real(v->g_rast, 4 * at + 1, is_f64);
        }
        put_real(v->g_rast, 4 * at, g_u, is_f64);
        put_real(v->g_rast, 4 * at + 1, g_v, is_f64);
    }
    for (int c = 0; c < n; c++)
        add_to_corners(to, first + c, sum[c][0], sum[c][1], sum[c][2]);
}

TL_INLINE int64_t backward_values(const tl_grad_view *view, const tl_grad_values *v, tl_grad_sums *sums, int is_f64)
{
    double *to[3];
    int64_t rows[3];
    pixel_run run = before_shown(view);
    clear_band(view, v->g_rast, 4);
    clear_band(view, v->g_rast_db, 4);
    while (next_shown(view, v->rast, v->n_attr, &run, is_f64)) {
        attr_rows(view, run.id, v->n_columns, rows);
        corner_sums(view, sums, run.id, to);
        for (int64_t c = 0; c < v->n_columns; c += TL_FEW_COLUMNS) {
            const int64_t n = v->n_columns - c;
            backward_run(v, &run, rows, c, n < TL_FEW_COLUMNS ? (int)n : TL_FEW_COLUMNS, v->n_columns, to, is_f64);
        }
        if (v->out_da)
            backward_slopes(v, &run, rows, to, is_f64);
    }
    return run.bad_id;
}

/* Backward of n attributes of float32 at the pixels of a run; TL_SUMMED pixels at most are summed in float32. */
TL_INLINE void backward_quads(const tl_grad_values *v, const pixel_run *run, const grad_span *s, int r, int n,
                              double **to)
{
    const float *attr = (const float *)v->attr, *rast = (const float *)v->rast + 4 * run->at;
    const float *g_out = (const float *)v->out + n * run->at;
    float *g_rast = (float *)v->g_rast + 4 * run->at;
    const vq last = vq_load_some(attr + n * (int64_t)s->corners[2][r], n);
    const vq4 of_u = vq4_all(vq_load_some(attr + n * (int64_t)s->corners[0][r], n) - last);
    const vq4 of_v = vq4_all(vq_load_some(attr + n * (int64_t)s->corners[1][r], n) - last);
    const vq4 zero = vq4_set1(0.0f);
    for (int64_t first = 0; first < run->n; first += TL_SUMMED) {
        vq4 by_u = zero, by_v = zero, whole = zero;
        for (int64_t i = first; i < first + TL_SUMMED && i < run->n; i += 4) {
            const vq4 g = vq4_load(g_out + n * i, run->n - i, n), at = vq4_load(rast + 4 * i, run->n - i, 4);
            const vq4 g_uv = TL_VQ4_BLEND(vq4_sum(vq4_mul(g, of_u)), vq4_sum(vq4_mul(g, of_v)), 2);
            vq4_store(g_rast + 4 * i, TL_VQ4_BLEND(g_uv, zero, 12), run->n - i, 4);
            by_u = vq4_add(by_u, vq4_mul(g, TL_VQ4_PERMUTE(at, 0, 0, 0, 0)));
            by_v = vq4_add(by_v, vq4_mul(g, TL_VQ4_PERMUTE(at, 1, 1, 1, 1)));
            whole = vq4_add(whole, g);
        }
        const vq sum_u = vq4_fold(by_u), sum_v = vq4_fold(by_v), sum = vq4_fold(whole);
        for (int c = 0; c < n; c++)
            add_to_corners(to, c, (double)sum_u[c], (double)sum_v[c], (double)sum[c]);
    }
}

TL_INLINE int64_t backward_values_in_lanes(const tl_grad_view *view, const tl_grad_values *v, tl_grad_sums *sums, int n)
{
    grad_span s = TL_BEFORE_SPANS(view);
    clear_band(view, v->g_rast, 4);
    while (next_grad_span(view, &(id_rows){.rast = v->rast}, v->n_attr, &s))
        for (int r = 0; r < s.n_runs; r++) {
            const pixel_run run = run_of_span(view, &s, r);
            double *to[3];
            if (run.id < 0)
                continue;
            corner_sums(view, sums, run.id, to);
            backward_quads(v, &run, &s, r, n, to);
        }
    return s.bad_id;
}

static int64_t backward_value_rows(const tl_grad_view *view, const tl_grad_values *v, tl_grad_sums *sums)
{
    switch (!view->is_f64 && has_few_values(v) && !v->out_da ? v->n_columns : 0) {
    case 1: return backward_values_in_lanes(view, v, sums, 1);
    case 2: return backward_values_in_lanes(view, v, sums, 2);
    case 3: return backward_values_in_lanes(view, v, sums, 3);
    case 4: return backward_values_in_lanes(view, v, sums, 4);
    default: return view->is_f64 ? backward_values(view, v, sums, 1) : backward_values(view, v, sums, 0);
    }
}

/* See kernels.h. */
static int64_t grad_values_vjp(const tl_grad_view *view, const tl_grad_values *v, tl_grad_sums *sums)
{
    const int64_t bad_id = backward_value_rows(view, v, sums);
    flush_band(sums);
    return bad_id;
}

#endif
