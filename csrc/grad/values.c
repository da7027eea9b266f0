/* Attributes of vertices at pixels, and what they change by; and backwards.
 * In: `rast`, `rast_db`, attributes.  Out: pictures; backward: gradients of `rast` and `rast_db`, sums by row.
 *
 * Of three attributes of float32 the number is a constant: what a run needs of its triangle stays in registers. */
#ifndef TL_GRAD_VALUES_C
#define TL_GRAD_VALUES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"
#include "grad/pixels.h"

#define TL_FEW_COLUMNS 4

/* First numbers of the attributes of the corners of a triangle. */
TL_INLINE void attr_rows(const tl_grad_view *view, int32_t id, int64_t n_columns, int64_t *rows)
{
    for (int k = 0; k < 3; k++)
        rows[k] = n_columns * view->tri[3 * (int64_t)id + k];
}

/* What an attribute changes by with u and with v. */
TL_INLINE void attr_steps(const tl_grad_values *v, const int64_t *rows, int64_t c, double *steps, int is_f64)
{
    const double last = get_real(v->attr, rows[2] + c, is_f64);
    steps[0] = get_real(v->attr, rows[0] + c, is_f64) - last;
    steps[1] = get_real(v->attr, rows[1] + c, is_f64) - last;
}

/* What some attributes change by at the pixels of a run. */
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

/* `n` attributes from `first` on at the pixels of a run; n is at most TL_FEW_COLUMNS. */
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

/* n_few: the number of attributes where it is a constant, or 0. */
TL_INLINE int64_t values_of(const tl_grad_view *view, const tl_grad_values *v, int n_few, int is_f64)
{
    const int64_t n_columns = n_few ? n_few : v->n_columns;
    int64_t rows[3];
    pixel_run run = before_shown(view);
    clear_band(view, v->out, n_columns);
    clear_band(view, v->out_da, 2 * v->n_wanted);
    while (next_shown(view, v->rast, v->n_attr, &run, is_f64)) {
        attr_rows(view, run.id, n_columns, rows);
        if (n_few)
            values_of_run(v, &run, rows, 0, n_few, n_columns, is_f64);
        for (int64_t c = 0; !n_few && c < n_columns; c += TL_FEW_COLUMNS) {
            const int64_t n = n_columns - c;
            values_of_run(v, &run, rows, c, n < TL_FEW_COLUMNS ? (int)n : TL_FEW_COLUMNS, n_columns, is_f64);
        }
        slopes_of_run(v, &run, rows, is_f64);
    }
    return run.bad_id;
}

/* See kernels.h. */
static int64_t grad_values(const tl_grad_view *view, const tl_grad_values *v)
{
    if (view->is_f64)
        return values_of(view, v, 0, 1);
    return v->n_columns == 3 ? values_of(view, v, 3, 0) : values_of(view, v, 0, 0);
}

/* The gradients that derivatives of attributes give at the pixels of a run. */
TL_INLINE void pull_slopes(const tl_grad_values *v, const pixel_run *run, const int64_t *rows, double **to, int is_f64)
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

/* The gradients that n attributes from `first` on give at the pixels of a run; those of `rast` are added. */
TL_INLINE void pull_run(const tl_grad_values *v, const pixel_run *run, const int64_t *rows, int64_t first, int n,
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
    for (int c = 0; c < n; c++) {
        to[0][first + c] += sum[c][0], to[1][first + c] += sum[c][1];
        to[2][first + c] += sum[c][2] - sum[c][0] - sum[c][1];
    }
}

TL_INLINE int64_t pull_values(const tl_grad_view *view, const tl_grad_values *v, tl_grad_sums *sums, int n_few,
                              int is_f64)
{
    const int64_t n_columns = n_few ? n_few : v->n_columns;
    double *to[3];
    int64_t rows[3];
    pixel_run run = before_shown(view);
    clear_band(view, v->g_rast, 4);
    clear_band(view, v->g_rast_db, 4);
    while (next_shown(view, v->rast, v->n_attr, &run, is_f64)) {
        attr_rows(view, run.id, n_columns, rows);
        corner_sums(view, sums, run.id, to);
        if (n_few)
            pull_run(v, &run, rows, 0, n_few, n_columns, to, is_f64);
        for (int64_t c = 0; !n_few && c < n_columns; c += TL_FEW_COLUMNS) {
            const int64_t n = n_columns - c;
            pull_run(v, &run, rows, c, n < TL_FEW_COLUMNS ? (int)n : TL_FEW_COLUMNS, n_columns, to, is_f64);
        }
        if (v->out_da)
            pull_slopes(v, &run, rows, to, is_f64);
    }
    leave_band(sums);
    return run.bad_id;
}

/* See kernels.h. */
static int64_t grad_values_vjp(const tl_grad_view *view, const tl_grad_values *v, tl_grad_sums *sums)
{
    if (view->is_f64)
        return pull_values(view, v, sums, 0, 1);
    return v->n_columns == 3 ? pull_values(view, v, sums, 3, 0) : pull_values(view, v, sums, 0, 0);
}

#endif
