/* The mean squared difference of a picture from another one, and its gradients: points, attributes, edges and all of
 * them backwards, a few rows at a time, which stay in the cache.
 * In: ids of a picture, a mesh with attributes, the other picture.  Out: a sum of squares; sums by vertex, attribute.
 *
 * Rows go through the kernels of this room, so sums have the bits that these give one after the other.  What backward
 * takes of a row depends on the one above it, that on the colours of the next: rows are drawn two ahead, compared one
 * ahead. */
#ifndef TL_GRAD_LOSS_C
#define TL_GRAD_LOSS_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/colors.c"
#include "grad/edges.c"
#include "grad/pixels.h"
#include "grad/points.c"
#include "grad/values.c"

enum {
    WINDOW_RAST,
    WINDOW_COLOR,
    WINDOW_G_OUT,
    N_KEPT_WINDOWS,
    WINDOW_OUT = N_KEPT_WINDOWS,
    WINDOW_G_COLOR,
    WINDOW_G_RAST,
    N_WINDOWS
};

/* Rows of pictures, from `base` on. */
typedef struct {
    char *rows[N_WINDOWS];
    int64_t n_bytes[N_WINDOWS]; /* of a row */
    int64_t base;
} loss_windows;

static loss_windows open_windows(const tl_grad_view *view, const tl_grad_loss *l, int64_t base)
{
    loss_windows w = {.base = base};
    char *next = l->scratch;
    for (int k = 0; k < N_WINDOWS; k++) {
        const int64_t n = k == WINDOW_RAST || k == WINDOW_G_RAST ? 4 : l->n_columns;
        w.n_bytes[k] = (view->is_f64 ? 8 : 4) * n * view->width;
        w.rows[k] = next;
        next += TL_LOSS_WINDOW * w.n_bytes[k];
    }
    return w;
}

/* Where row 0 of a picture would be. */
TL_INLINE void *window_of(const loss_windows *w, int k)
{
    return (void *)((uintptr_t)w->rows[k] - (uintptr_t)(w->base * w->n_bytes[k]));
}

/* Forgets what lies below a row. */
static void slide_windows(loss_windows *w, int64_t base, int64_t end)
{
    for (int k = 0; k < N_KEPT_WINDOWS; k++)
        memmove(w->rows[k], w->rows[k] + (base - w->base) * w->n_bytes[k], (size_t)((end - base) * w->n_bytes[k]));
    w->base = base;
}

TL_INLINE tl_grad_view rows_of(const tl_grad_view *view, int64_t first, int64_t end)
{
    tl_grad_view rows = *view;
    rows.first_row = first, rows.end_row = end;
    return rows;
}

static void show_rows(const tl_grad_view *view, const tl_grad_loss *l, const loss_windows *w)
{
    const tl_grad_values values = {.attr = l->attr,
                                   .n_attr = l->n_attr,
                                   .n_columns = l->n_columns,
                                   .rast = window_of(w, WINDOW_RAST),
                                   .out = window_of(w, WINDOW_COLOR)};
    grad_points(view, l->ids, l->step, l->first_id, window_of(w, WINDOW_RAST), 0);
    grad_values(view, &values);
}

TL_INLINE double compare_row(const void *out, const void *target, void *g_out, int64_t n, double scale, int is_f64)
{
    double sum = 0.0;
    for (int64_t i = 0; i < n; i++) {
        const double step = is_f64 ? ((const double *)out)[i] - ((const double *)target)[i]
                                   : (double)(((const float *)out)[i] - ((const float *)target)[i]);
        sum += step * step;
        put_real(g_out, i, is_f64 ? step * scale : (double)((float)step * (float)scale), is_f64);
    }
    return sum;
}

/* Smooths rows and compares them; returns the sum of squares of those of the band. */
static double compare_rows(const tl_grad_view *view, const tl_grad_loss *l, const loss_windows *w,
                           const tl_grad_view *band)
{
    tl_grad_edges e = l->edges;
    double sum = 0.0;
    e.rast = window_of(w, WINDOW_RAST), e.color = window_of(w, WINDOW_COLOR), e.out = window_of(w, WINDOW_OUT);
    smooth_rows(view, &e, 0);
    for (int64_t row = view->first_row; row < view->end_row; row++) {
        const int64_t at = (row - w->base) * w->n_bytes[WINDOW_OUT], n = l->n_columns * view->width;
        const char *target = (const char *)l->target + row * w->n_bytes[WINDOW_OUT];
        const char *out = w->rows[WINDOW_OUT] + at;
        const double found = view->is_f64 ? compare_row(out, target, w->rows[WINDOW_G_OUT] + at, n, l->scale, 1)
                                          : compare_row(out, target, w->rows[WINDOW_G_OUT] + at, n, l->scale, 0);
        sum += row >= band->first_row && row < band->end_row ? found : 0.0;
    }
    return sum;
}

/* The gradient of a picture of attributes; of float32 at once to the vertices. */
static tl_grad_colors colors_of(const tl_grad_view *view, const tl_grad_loss *l, const loss_windows *w)
{
    return (tl_grad_colors){.values = {.attr = l->attr,
                                       .n_attr = l->n_attr,
                                       .n_columns = l->n_columns,
                                       .rast = window_of(w, WINDOW_RAST),
                                       .out = window_of(w, WINDOW_G_COLOR),
                                       .g_rast = window_of(w, WINDOW_G_RAST)},
                            .corners = view->tri,
                            .faces = l->faces,
                            .vertices = l->of_points,
                            .attr = l->of_attr};
}

static void pull_rows(const tl_grad_view *view, const tl_grad_loss *l, const loss_windows *w)
{
    tl_grad_edges e = l->edges;
    const tl_grad_colors colors = colors_of(view, l, w);
    const tl_grad_values *values = &colors.values;
    e.rast = values->rast, e.color = window_of(w, WINDOW_COLOR);
    e.g_out = window_of(w, WINDOW_G_OUT), e.g_color = values->out;
    smooth_rows(view, &e, l->of_edges);
    if (!view->is_f64) {
        pull_colors(view, &colors);
        return;
    }
    pull_value_rows(view, values, l->of_attr);
    pull_point_rows(view, &(tl_grad_points){.rast = values->rast, .g_rast = values->g_rast, .faces = l->faces});
}

/* See kernels.h. */
static double grad_loss(const tl_grad_view *view, const tl_grad_loss *l)
{
    const int64_t lowest = view->first_row > 2 ? view->first_row - 2 : 0;
    int64_t n_drawn = lowest, n_compared = view->first_row > 1 ? view->first_row - 1 : 0;
    loss_windows w = open_windows(view, l, lowest);
    double sum = 0.0;
    for (int64_t row = view->first_row; row < view->end_row; row += TL_LOSS_ROWS) {
        const int64_t end = row + TL_LOSS_ROWS < view->end_row ? row + TL_LOSS_ROWS : view->end_row;
        const int64_t to_draw = end + 2 < view->height ? end + 2 : view->height;
        const int64_t to_compare = end + 1 < view->height ? end + 1 : view->height;
        tl_grad_view rows = rows_of(view, n_drawn, to_draw);
        show_rows(&rows, l, &w);
        rows = rows_of(view, n_compared, to_compare);
        sum += compare_rows(&rows, l, &w, view);
        rows = rows_of(view, row, end);
        pull_rows(&rows, l, &w);
        n_drawn = to_draw, n_compared = to_compare;
        slide_windows(&w, end - 1, n_drawn);
    }
    if (view->is_f64) {
        close_points(view, &(tl_grad_points){.faces = l->faces, .vertices = l->of_points});
        leave_band(l->faces);
        leave_band(l->of_attr);
    } else {
        const tl_grad_colors colors = colors_of(view, l, &w);
        close_colors(view, &colors);
    }
    leave_band(l->of_edges);
    return sum;
}

#endif
