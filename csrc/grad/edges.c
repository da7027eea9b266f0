/* Pictures whose silhouettes are smooth, and backwards: gradients of colours, and sums by vertex of those of edges.
 * In: `rast`, colours, which triangle lies across each edge.  Out: colours.
 *
 * Each pair of neighbours that show different triangles is looked at once in each band that has a pixel of it.  A pixel
 * takes its pairs in an order of rows: with the row below, its own row, with the row above.
 *
 * The straight-through rule leaves the picture as it is.  What a triangle that hangs over its neighbour would do to the
 * two pixels if it moved by a pixel is the gradient of its point there, by finite differences of colours: Pidhorskyi,
 * S. et al., "Rasterized Edge Gradients: Handling Discontinuities Differentiably", 2024.  */
#ifndef TL_GRAD_EDGES_C
#define TL_GRAD_EDGES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/outline.c"
#include "grad/pairs.c"
#include "grad/pixels.h"
#include "grad/spans.h"
#include "lanes/lanes.h"

#define TL_NO_ID -2 /* stands for a number that is no triangle's */

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

/* Column c of the colour of the far pixel of a pair less that of the near one. */
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

/* Gradients of the two colours of a pair, and of its edge. */
TL_INLINE void pull_pair(const tl_grad_view *view, const tl_grad_edges *e, const tl_pair *pair,
                         const tl_pair_edge *edge, tl_grad_sums *sums, int is_f64)
{
    double g_near = 0.0, g_far = 0.0;
    const int64_t near = e->n_channels * pair->near, far = e->n_channels * pair->far;
    const int has_near = in_band(view, pair->near), has_far = in_band(view, pair->far);
    for (int64_t c = 0; c < e->n_channels; c++) {
        const double a = get_real(e->g_out, near + c, is_f64), b = get_real(e->g_out, far + c, is_f64);
        const double step = color_step(e, pair, c, is_f64);
        const double moved = edge->far * b - edge->near * a;
        g_near += a * step, g_far -= b * step;
        if (has_near)
            put_real(e->g_color, near + c, get_real(e->g_color, near + c, is_f64) + moved, is_f64);
        if (has_far)
            put_real(e->g_color, far + c, get_real(e->g_color, far + c, is_f64) - moved, is_f64);
    }
    if (in_band(view, pair->near < pair->far ? pair->near : pair->far))
        pull_edge(view, pair, edge, g_near, g_far, sums);
}

/* The weights of a triangle at the middle of a pixel, perspective-correct; 0 when it lies outside. */
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

/* The straight-through rule: of the triangle that hangs over its neighbour, where no other cuts it. */
static void pull_straight(const tl_grad_view *view, const tl_grad_edges *e, const tl_pair *pair, tl_grad_sums *sums)
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
            pull_vertex(view, sums, vertex, g_px);
    }
}

/* Ids of a row of pixels: -1 for none, less for a number that is no triangle's, and in a vector beyond the row. */
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
    vi_store(ids + view->width, vi_set1(TL_NO_ID));
}

/* Whether the surface plainly runs on from one triangle to another, or neither has an edge that counts. */
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

/* Lists the columns where two rows of n ids have a pair to look at; returns how many. */
TL_INLINE int64_t list_pairs(const tl_grad_edges *e, const int32_t *ids, const int32_t *others, int64_t n,
                             int32_t *columns)
{
    const vi beyond = vi_set1(TL_NO_ID), none = vi_set1(-1);
    int64_t n_listed = 0, n_found = 0;
    for (int64_t x = 0; x < n; x += TL_LANES) {
        const vi id = vi_load(ids + x), other = vi_load(others + x);
        const vm m = vm_and_not(vm_and(vi_gt(id, beyond), vi_gt(other, beyond)), vi_eq(id, other));
        vi_compress(columns + n_listed, m, vi_add(vi_iota(), vi_set1((int32_t)x)));
        n_listed += __builtin_popcount(vm_bits(m));
    }
    if (e->rule == TL_PAIR_STRAIGHT)
        return n_listed;
    for (int64_t i = 0; i < n_listed; i += TL_LANES) { /* gathers have full vectors */
        vm m = vm_first(n_listed - i);
        const vi x = vi_load(columns + i), id = vi_gather(m, ids, x), other = vi_gather(m, others, x);
        const vi outlines = vi_or(vi_gather(vm_and(m, vi_gt(id, none)), e->outline, id),
                                  vi_gather(vm_and(m, vi_gt(other, none)), e->outline, other));
        m = vm_and(m, vi_gt(outlines, none)); /* both have corners */
        m = vm_and_not(m, runs_on(e, m, id, other, outlines));
        vi_compress(columns + n_found, m, x);
        n_found += __builtin_popcount(vm_bits(m));
    }
    return n_found;
}

/* Two rows of pixels that meet, or one whose columns do: first the lower row, or the left columns. */
typedef struct {
    const tl_grad_view *view;
    const tl_grad_edges *edges;
    tl_grad_sums *sums;
    int64_t row;
    int axis; /* 0: columns meet */
    const int32_t *ids, *others;
} meeting;

/* A pair and its edge. */
typedef struct {
    tl_pair pair;
    tl_pair_edge edge;
} tl_met_pair;

/* Finds what meets in a column, the second pixel being the nearer one if it is flipped; 0 if nothing comes of it. */
TL_INLINE int meet_pair(const meeting *m, int64_t x, int is_flipped, tl_met_pair *p)
{
    const tl_grad_edges *e = m->edges;
    const int64_t first = m->row * m->view->width + x, second = first + (m->axis ? m->view->width : 1);
    const int32_t id = m->ids[x], other = m->others[x];
    p->pair = (tl_pair){is_flipped ? second : first,
                        is_flipped ? first : second,
                        is_flipped ? other : id,
                        is_flipped ? id : other,
                        m->axis,
                        is_flipped ? -1.0 : 1.0,
                        {(double)x + 0.5, (double)m->row + 0.5}};
    p->pair.middle[m->axis] += is_flipped;
    return e->rule == TL_PAIR_STRAIGHT ? 1
           : e->rule == TL_PAIR_AREA   ? find_area_edge(m->view, e, &p->pair, &p->edge)
                                       : find_silhouette(m->view, e, &p->pair, &p->edge);
}

/* Blends the pixels of a pair in the band; backward adds the gradients of their colours and of its edge. */
TL_INLINE void blend_pair(const tl_grad_view *view, const tl_grad_edges *e, const tl_met_pair *p, tl_grad_sums *sums,
                          int is_f64)
{
    const tl_pair *pair = &p->pair;
    if (e->rule == TL_PAIR_STRAIGHT) {
        if (e->g_out)
            pull_straight(view, e, pair, sums);
        return;
    }
    if (e->g_out) {
        pull_pair(view, e, pair, &p->edge, sums, is_f64);
        return;
    }
    if (in_band(view, pair->near) && p->edge.near != 0.0)
        take_color(e, pair->near, pair->far, p->edge.near, is_f64);
    if (in_band(view, pair->far) && p->edge.far != 0.0)
        take_color(e, pair->far, pair->near, p->edge.far, is_f64);
}

/* The pairs of n columns. */
TL_INLINE void meet_row(const meeting *m, int64_t n, int is_f64)
{
    int32_t *columns = m->edges->ids + 2 * (m->view->width + TL_IDS_ROOM);
    const int64_t n_pairs = list_pairs(m->edges, m->ids, m->others, n, columns);
    for (int64_t i = 0; i < n_pairs; i++) {
        const int64_t first = m->row * m->view->width + columns[i], second = first + (m->axis ? m->view->width : 1);
        const int is_flipped = m->ids[columns[i]] < 0 ||
                               (m->others[columns[i]] >= 0 && get_real(m->edges->rast, 4 * second + 2, is_f64) <
                                                                  get_real(m->edges->rast, 4 * first + 2, is_f64));
        tl_met_pair pair;
        if (meet_pair(m, columns[i], is_flipped, &pair))
            blend_pair(m->view, m->edges, &pair, m->sums, is_f64);
    }
}

TL_INLINE void edges_of_band(const tl_grad_view *view, const tl_grad_edges *e, tl_grad_sums *sums, int is_f64)
{
    const int64_t width = view->width, room = width + TL_IDS_ROOM;
    const int64_t top = view->end_row < view->height ? view->end_row + 1 : view->height;
    const int64_t bottom = view->first_row > 0 ? view->first_row - 1 : 0;
    for (int64_t row = bottom; row < top; row++) {
        int32_t *ids = e->ids + row % 2 * room;
        load_ids(view, e, row, ids, is_f64);
        if (row > bottom)
            meet_row(&(meeting){view, e, sums, row - 1, 1, e->ids + (row + 1) % 2 * room, ids}, width, is_f64);
        if (row >= view->first_row && row < view->end_row)
            meet_row(&(meeting){view, e, sums, row, 0, ids, ids + 1}, width - 1, is_f64);
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
        leave_band(sums);
}

#endif
