/* Blending across silhouettes, and backward: gradients of colours, and sums by vertex of the gradients of edges.
 * In: `rast`, colours, the triangle across each edge.  Out: colours.
 *
 * Each pair of neighbours that show different triangles is processed once in each band that has a pixel of it.  The
 * order of a pixel's pairs is that of rows: with the row below, within its row, with the row above.
 *
 * The straight-through rule leaves the picture as it is.  Where a triangle overlaps its neighbour, the gradient of its
 * point is the change of the two pixels when it moves by a pixel, by finite differences of colours: Pidhorskyi, S. et
 * al., "Rasterized Edge Gradients: Handling Discontinuities Differentiably", 2024. */
#ifndef TL_GRAD_EDGES_C
#define TL_GRAD_EDGES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/grad.h"
#include "grad/outline.c"
#include "grad/pairs.c"
#include "grad/pixels.h"
#include "grad/spans.h"
#include "lanes/lanes.h"

#define TL_NO_ID -2 /* a number that is no triangle's */

/* Adds share * (colour of `from` - colour of `to`). */
TL_INLINE void take_color(const tl_grad_edges *e, int64_t to, int64_t from, double share, int is_f64)
{
    for (int64_t c = 0; c < e->n_channels; c++) {
        const double step =
            get_real(e->color, e->n_channels * from + c, is_f64) - get_real(e->color, e->n_channels * to + c, is_f64);
        const int64_t at = e->n_channels * to + c;
        put_real(e->out, at, get_real(e->out, at, is_f64) + share * step, is_f64);
    }
}

/* Column c of the colour of the far pixel of a pair minus that of the near pixel. */
TL_INLINE double color_step(const tl_grad_edges *e, const tl_pair *pair, int64_t c, int is_f64)
{
    if (e->steps)
        return (double)e->steps[c];
    return get_real(e->color, e->n_channels * pair->far + c, is_f64) -
           get_real(e->color, e->n_channels * pair->near + c, is_f64);
}

/* Whether a pixel lies in the band. */
TL_INLINE int in_band(const tl_grad_view *view, int64_t pixel)
{
    return pixel >= view->first_row * view->width && pixel < view->end_row * view->width;
}

/* Adds the gradients of the shares of a pair by column c; returns the gradient that moves from the far pixel to the
 * near pixel. */
TL_INLINE double backward_column(const tl_grad_edges *e, const tl_pair *pair, const tl_pair_edge *edge, int64_t c,
                                 double *g_near, double *g_far, int is_f64)
{
    const double a = get_real(e->g_out, e->n_channels * pair->near + c, is_f64);
    const double b = get_real(e->g_out, e->n_channels * pair->far + c, is_f64);
    const double step = color_step(e, pair, c, is_f64);
    *g_near += a * step, *g_far -= b * step;
    return edge->far * b - edge->near * a;
}

/* Adds the gradients of the two colours of a pair, and of its edge. */
TL_INLINE void backward_pair(const tl_grad_view *view, const tl_grad_edges *e, const tl_pair *pair,
                             const tl_pair_edge *edge, tl_grad_sums *sums, int is_f64)
{
    double g_near = 0.0, g_far = 0.0;
    const int64_t near = e->n_channels * pair->near, far = e->n_channels * pair->far;
    const int has_near = in_band(view, pair->near), has_far = in_band(view, pair->far);
    for (int64_t c = 0; c < e->n_channels; c++) {
        const double moved = backward_column(e, pair, edge, c, &g_near, &g_far, is_f64);
        if (has_near)
            put_real(e->g_color, near + c, get_real(e->g_color, near + c, is_f64) + moved, is_f64);
        if (has_far)
            put_real(e->g_color, far + c, get_real(e->g_color, far + c, is_f64) - moved, is_f64);
    }
    if (in_band(view, pair->near < pair->far ? pair->near : pair->far))
        backward_edge(view, pair, edge, g_near, g_far, sums);
}

/* Sets the perspective-correct weights of a triangle at the centre of a pixel; returns whether it lies inside. */
static int weights_of_middle(const tl_grad_view *view, int32_t id, int64_t pixel, double *weights)
{
    double p[3][3], a[3];
    const double x = (2.0 * (double)(pixel % view->width) + 1.0) * view->scale[0] + view->shift[0];
    const double y = (2.0 * (double)(pixel / view->width) + 1.0) * view->scale[1] + view->shift[1];
    for (int k = 0; k < 3; k++) {
        const int64_t at = 4 * (int64_t)view->tri[3 * (int64_t)id + k];
        const double w = get_real(view->pos, at + 3, view->is_f64);
        p[k][0] = get_real(view->pos, at, view->is_f64) - x * w;
        p[k][1] = get_real(view->pos, at + 1, view->is_f64) - y * w;
    }
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        a[k] = p[i][0] * p[j][1] - p[i][1] * p[j][0];
    }
    const double total = a[0] + a[1] + a[2];
    for (int k = 0; k < 3; k++)
        weights[k] = total == 0.0 ? -1.0 : a[k] / total;
    return weights[0] >= 0.0 && weights[1] >= 0.0 && weights[2] >= 0.0;
}

/* Backward of the straight-through rule, for the triangle that overlaps its neighbour; not where both or none do. */
static void backward_straight(const tl_grad_view *view, const tl_grad_edges *e, const tl_pair *pair, tl_grad_sums *sums)
{
    double weights[3], step = 0.0, other[3];
    const int hangs = pair->far_id < 0 || weights_of_middle(view, pair->far_id, pair->near, other);
    const int is_hung_over = pair->far_id >= 0 && weights_of_middle(view, pair->id, pair->far, other);
    if (hangs == is_hung_over || !in_band(view, pair->near < pair->far ? pair->near : pair->far))
        return;
    const int64_t pixel = hangs ? pair->near : pair->far;
    const int32_t id = hangs ? pair->id : pair->far_id;
    weights_of_middle(view, id, pixel, weights);
    for (int64_t c = 0; c < e->n_channels; c++) {
        const int64_t near = e->n_channels * pair->near + c, far = e->n_channels * pair->far + c;
        const double both = get_real(e->g_out, near, view->is_f64) + get_real(e->g_out, far, view->is_f64);
        step -= color_step(e, pair, c, view->is_f64) * 0.5 * both;
    }
    for (int k = 0; k < 3; k++) {
        double g_px[2] = {0};
        const int32_t vertex = view->tri[3 * (int64_t)id + k];
        g_px[pair->axis] = pair->flip * step * weights[k];
        if (get_real(view->pos, 4 * (int64_t)vertex + 3, view->is_f64) > 0.0)
            backward_vertex(view, sums, vertex, g_px);
    }
}

/* Loads the ids of a row of pixels: -1 for none, TL_NO_ID for a number that is no triangle's. */
TL_INLINE void load_ids(const tl_grad_view *view, const tl_grad_edges *e, int64_t row, int32_t *ids, int is_f64)
{
    const int64_t first = row * view->width;
    const vi end = vi_set1(clamped_to_int(view->n_triangles));
    int64_t x = 0;
    for (; !is_f64 && x + TL_LANES <= view->width; x += TL_LANES) {
        vf columns[4];
        load_columns_f32((const float *)e->rast + 4 * (first + x), 4, columns);
        const vi id = ids_of_numbers(columns[3]);
        vi_store(ids + x, vi_select(vi_gt(end, id), id, vi_set1(TL_NO_ID)));
    }
    for (; x < view->width; x++) {
        const int32_t id = id_of_label(get_label(e->rast, first + x, is_f64), is_f64);
        ids[x] = id < view->n_triangles ? id : TL_NO_ID;
    }
}

/* Whether two triangles are neighbours on the surface, without silhouettes, so that the pair has no edge. */
TL_INLINE vm runs_on(const tl_grad_edges *e, vm m, vi id, vi other, vi outlines)
{
    const vi none = vi_set1(0);
    const vm is_within = vm_and(m, vi_eq(vi_and(outlines, vi_set1(TL_SILHOUETTES)), none));
    if (e->rule == TL_PAIR_SILHOUETTE || !vm_any(is_within))
        return is_within;
    const vm is_pair = vm_and(is_within, vm_and(vi_gt(id, vi_set1(-1)), vi_gt(other, vi_set1(-1))));
    const vi id_3 = vi_add(id, vi_add(id, id)), other_3 = vi_add(other, vi_add(other, other));
    vm found = vm_first(0);
    for (int k = 0; k < 3; k++) {
        const vi corner = vi_sub(vi_gather(is_pair, e->across + k, id_3), other_3);
        found = vm_or(found, vm_and(is_pair, vi_gt_unsigned(vi_set1(3), corner)));
    }
    return found;
}

/* A scan for pairs: between rows, from the lowest to `top`, and within the rows of the band, row by row. */
typedef struct {
    const tl_grad_view *view; /* the band */
    const tl_grad_edges *edges;
    int64_t lowest, top;
    const int32_t *shown, *begins; /* of a picture, unless NULL: ids of row 0, and where runs begin */
    int64_t step;
    const int64_t *row_runs;
    int64_t meeting;                       /* 2 * row: a row with the row below; 2 * row + 1: within the row */
    const int32_t *ids, *others, *columns; /* of the compared pixels; columns where they may differ */
    int64_t n_columns, n_taken;            /* columns, and how many of them are processed */
} pair_scan;

TL_INLINE pair_scan scan_of(const tl_grad_view *view, const tl_grad_edges *e, int64_t lowest, int64_t top)
{
    return (pair_scan){.view = view, .edges = e, .lowest = lowest, .top = top, .meeting = 2 * lowest - 1};
}

/* Lists the columns where two rows of n ids differ; returns how many. */
TL_INLINE int64_t list_changes(const int32_t *ids, const int32_t *others, int64_t n, int32_t *columns)
{
    int64_t n_listed = 0, x = 0;
    for (; x + TL_LANES <= n; x += TL_LANES) {
        const vm m = vm_and_not(vm_all(), vi_eq(vi_load(ids + x), vi_load(others + x)));
        n_listed += vi_compress(columns + n_listed, m, vi_add(vi_iota(), vi_set1((int32_t)x)));
    }
    for (; x < n; x++) {
        columns[n_listed] = (int32_t)x;
        n_listed += ids[x] != others[x];
    }
    return n_listed;
}

/* Steps to the next comparison: of two rows, or within a row; 0 at the end. */
TL_INLINE int next_meeting(pair_scan *s, int is_f64)
{
    const int64_t width = s->view->width, room = width + TL_IDS_ROOM, meeting = ++s->meeting, row = meeting / 2;
    const int is_within = meeting % 2;
    int32_t *scratch = s->edges->ids, *own = scratch + row % 2 * room, *columns = scratch + 2 * room;
    if (row >= s->top)
        return 0;
    s->n_columns = s->n_taken = 0;
    if (!is_within && !s->shown)
        load_ids(s->view, s->edges, row, own, is_f64);
    if (is_within ? row < s->view->first_row || row >= s->view->end_row : row == s->lowest)
        return 1;
    if (is_within && s->begins) {
        const int64_t *runs = s->row_runs + row - s->lowest;
        s->columns = s->begins + runs[0] + 1, s->n_columns = runs[1] - runs[0] - 1;
        s->ids = s->shown + s->step * row, s->others = s->ids + 1;
        return 1;
    }
    s->others = s->shown ? s->shown + s->step * row : own;
    s->ids = is_within ? s->others++ : s->shown ? s->others - s->step : scratch + (row + 1) % 2 * room;
    s->n_columns = list_changes(s->ids, s->others, width - is_within, columns);
    s->columns = columns;
    return 1;
}

/* Appends the pairs of the next TL_LANES columns that may have an edge. */
TL_INLINE void list_some(pair_scan *s, tl_pair_list *list)
{
    const tl_grad_edges *e = s->edges;
    const vi none = vi_set1(-1), end = vi_set1(clamped_to_int(s->view->n_triangles));
    const int in_column = s->meeting % 2 == 0;
    const vm are_left = vm_first(s->n_columns - s->n_taken);
    /* a run begins at the second pixel of a pair */
    const vi x = vi_sub(vi_load(s->columns + s->n_taken), vi_set1(s->begins && !in_column));
    const vi id = vi_max(vi_gather(are_left, s->ids, x), none), other = vi_max(vi_gather(are_left, s->others, x), none);
    vm m = vm_and(are_left, vm_and(vi_gt(end, id), vi_gt(end, other)));
    m = vm_and_not(m, vi_eq(id, other));
    if (e->rule != TL_PAIR_STRAIGHT) {
        const vi outlines = vi_or(vi_gather(vm_and(m, vi_gt(id, none)), e->outline, id),
                                  vi_gather(vm_and(m, vi_gt(other, none)), e->outline, other));
        m = vm_and(m, vi_gt(outlines, none)); /* both have corners */
        m = vm_and_not(m, runs_on(e, m, id, other, outlines));
    }
    const int64_t row = s->meeting / 2 - in_column;
    vi_compress(list->near + list->n, m, id), vi_compress(list->far + list->n, m, other);
    vi_compress(list->column + list->n, m, x);
    list->n +=
        vi_compress(list->where + list->n, m, vi_set1((int32_t)(row << TL_ROW_SHIFT) + in_column * TL_IN_COLUMN));
    s->n_taken += TL_LANES;
}

/* Lists the next pairs, the first pixel of each as the near pixel; 0 at the end. */
TL_INLINE int next_pairs(pair_scan *s, tl_pair_list *list, int is_f64)
{
    list->n = 0;
    while (list->n < TL_PAIRS_AT_ONCE)
        if (s->n_taken < s->n_columns)
            list_some(s, list);
        else if (!next_meeting(s, is_f64))
            break;
    return list->n > 0;
}

/* Blends the pixels of a pair in the band; backward adds the gradients of their colours and of its edge. */
TL_INLINE void blend_pair(const tl_grad_view *view, const tl_grad_edges *e, const tl_met_pair *p, tl_grad_sums *sums,
                          int is_f64)
{
    const tl_pair *pair = &p->pair;
    if (e->rule == TL_PAIR_STRAIGHT) {
        if (e->g_out)
            backward_straight(view, e, pair, sums);
        return;
    }
    if (e->g_out) {
        backward_pair(view, e, pair, &p->edge, sums, is_f64);
        return;
    }
    if (in_band(view, pair->near) && p->edge.near != 0.0)
        take_color(e, pair->near, pair->far, p->edge.near, is_f64);
    if (in_band(view, pair->far) && p->edge.far != 0.0)
        take_color(e, pair->far, pair->near, p->edge.far, is_f64);
}

/* Whether the second pixel of a pair is nearer. */
TL_INLINE int is_nearer(const tl_grad_view *view, const tl_grad_edges *e, const tl_pair_list *list, int64_t i,
                        int is_f64)
{
    const int64_t first = (list->where[i] >> TL_ROW_SHIFT) * view->width + list->column[i];
    const int64_t second = first + (list->where[i] & TL_IN_COLUMN ? view->width : 1);
    return list->near[i] < 0 ||
           (list->far[i] >= 0 && get_real(e->rast, 4 * second + 2, is_f64) < get_real(e->rast, 4 * first + 2, is_f64));
}

TL_INLINE void edges_of_band(const tl_grad_view *view, const tl_grad_edges *e, tl_grad_sums *sums, int is_f64)
{
    const int64_t top = view->end_row < view->height ? view->end_row + 1 : view->height;
    const int64_t bottom = view->first_row > 0 ? view->first_row - 1 : 0;
    pair_scan scan = scan_of(view, e, bottom, top);
    tl_pair_list list;
    tl_met_pair pairs[TL_MAX_LANES];
    int32_t which[TL_PAIRS_ROOM];
    while (next_pairs(&scan, &list, is_f64)) {
        for (int64_t i = 0; i < list.n; i++)
            list.turned[i] = -is_nearer(view, e, &list, i, is_f64);
        orient_pairs(&list);
        const int64_t n = list_pairs(view, e, &list, which);
        for (int64_t i = 0; i < n; i += TL_LANES) {
            const int64_t n_met = find_pairs(view, e, &list, which + i, n - i, pairs);
            for (int64_t k = 0; k < n_met; k++)
                blend_pair(view, e, pairs + k, sums, is_f64);
        }
    }
}

static void smooth_rows(const tl_grad_view *view, const tl_grad_edges *e, tl_grad_sums *sums)
{
    const int64_t size = (view->is_f64 ? 8 : 4) * e->n_channels * view->width;
    char *target = (char *)(e->g_out ? e->g_color : e->out) + view->first_row * size;
    const char *source = (const char *)(e->g_out ? e->g_out : e->color) + view->first_row * size;
    memcpy(target, source, (size_t)((view->end_row - view->first_row) * size));
    if (!e->g_out && e->rule == TL_PAIR_STRAIGHT)
        return;
    if (view->is_f64)
        edges_of_band(view, e, sums, 1);
    else
        edges_of_band(view, e, sums, 0);
}

/* See kernels.h. */
static void grad_edges(const tl_grad_view *view, const tl_grad_edges *e, tl_grad_sums *sums)
{
    smooth_rows(view, e, sums);
    if (e->g_out)
        flush_band(sums);
}

#endif
