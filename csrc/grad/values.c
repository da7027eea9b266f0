/* Attributes of vertices at pixels, and what they change by; and backwards.
 * In: `rast`, `rast_db`, attributes.  Out: pictures; backward: gradients of `rast` and `rast_db`, sums by row. */
#ifndef TL_GRAD_VALUES_C
#define TL_GRAD_VALUES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"
#include "grad/pixels.h"

/* First numbers of the attributes of the corners of a triangle. */
TL_INLINE void attr_rows(const tl_grad_view *view, const tl_grad_values *v, int32_t id, int64_t *rows)
{
    for (int k = 0; k < 3; k++)
        rows[k] = v->n_columns * view->tri[3 * (int64_t)id + k];
}

/* What an attribute changes by with u and with v. */
TL_INLINE void attr_steps(const tl_grad_values *v, const int64_t *rows, int64_t c, double *steps, int is_f64)
{
    const double last = get_real(v->attr, rows[2] + c, is_f64);
    steps[0] = get_real(v->attr, rows[0] + c, is_f64) - last;
    steps[1] = get_real(v->attr, rows[1] + c, is_f64) - last;
}

TL_INLINE int64_t values_of(const tl_grad_view *view, const tl_grad_values *v, int is_f64)
{
    band_place place;
    pixel_group group;
    start_band(view, &place, &group);
    while (next_group(view, v->rast, v->n_attr, &place, &group, is_f64))
        for (int i = 0; i < group.n; i++) {
            const int64_t at = group.at[i];
            const double by_u = get_real(v->rast, 4 * at, is_f64), by_v = get_real(v->rast, 4 * at + 1, is_f64);
            int64_t rows[3];
            double step[2];
            attr_rows(view, v, group.id[i], rows);
            for (int64_t c = 0; c < v->n_columns; c++) {
                attr_steps(v, rows, c, step, is_f64);
                const double last = get_real(v->attr, rows[2] + c, is_f64);
                put_real(v->out, v->n_columns * at + c, last + by_u * step[0] + by_v * step[1], is_f64);
            }
            for (int64_t j = 0; j < v->n_wanted; j++)
                for (int axis = 0; axis < 2; axis++) {
                    const double du = get_real(v->rast_db, 4 * at + axis, is_f64);
                    const double dv = get_real(v->rast_db, 4 * at + 2 + axis, is_f64);
                    attr_steps(v, rows, v->wanted[j], step, is_f64);
                    put_real(v->out_da, 2 * (v->n_wanted * at + j) + axis, step[0] * du + step[1] * dv, is_f64);
                }
        }
    return place.bad_id;
}

/* See kernels.h. */
static int64_t grad_values(const tl_grad_view *view, const tl_grad_values *values)
{
    return view->is_f64 ? values_of(view, values, 1) : values_of(view, values, 0);
}

/* The gradients that derivatives of attributes give at a pixel. */
TL_INLINE void pull_slopes(const tl_grad_values *v, int64_t at, const int64_t *rows, double **to, double *g_db,
                           int is_f64)
{
    double db[4], step[2];
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
}

TL_INLINE int64_t pull_values(const tl_grad_view *view, const tl_grad_values *v, tl_grad_sums *sums, int is_f64)
{
    band_place place;
    pixel_group group;
    double *to[3] = {0};
    int64_t rows[3] = {0};
    start_band(view, &place, &group);
    while (next_group(view, v->rast, v->n_attr, &place, &group, is_f64))
        for (int i = 0; i < group.n; i++) {
            const int64_t at = group.at[i];
            const double by_u = get_real(v->rast, 4 * at, is_f64), by_v = get_real(v->rast, 4 * at + 1, is_f64);
            const double by_w = 1.0 - by_u - by_v;
            double g_u = 0.0, g_v = 0.0, g_db[4] = {0}, step[2];
            if (!i || group.id[i] != group.id[i - 1]) {
                attr_rows(view, v, group.id[i], rows);
                corner_sums(view, sums, group.id[i], to);
            }
            for (int64_t c = 0; c < v->n_columns; c++) {
                const double g = get_real(v->out, v->n_columns * at + c, is_f64);
                attr_steps(v, rows, c, step, is_f64);
                g_u += g * step[0], g_v += g * step[1];
                to[0][c] += g * by_u, to[1][c] += g * by_v, to[2][c] += g * by_w;
            }
            put_real(v->g_rast, 4 * at, g_u, is_f64);
            put_real(v->g_rast, 4 * at + 1, g_v, is_f64);
            if (!v->out_da)
                continue;
            pull_slopes(v, at, rows, to, g_db, is_f64);
            for (int c = 0; c < 4; c++)
                put_real(v->g_rast_db, 4 * at + c, g_db[c], is_f64);
        }
    leave_band(sums);
    return place.bad_id;
}

/* See kernels.h. */
static int64_t grad_values_vjp(const tl_grad_view *view, const tl_grad_values *values, tl_grad_sums *sums)
{
    return view->is_f64 ? pull_values(view, values, sums, 1) : pull_values(view, values, sums, 0);
}

#endif
