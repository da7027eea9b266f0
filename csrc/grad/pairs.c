/* An edge between two neighbouring pixels that show different triangles: which it is, and what share of the colour of
 * the other one each pixel takes.
 *
 * Coordinates are pixels about the middle of the near pixel: `along` towards the far one, `beside` across.
 *
 *   silhouette   an edge of the near triangle that is a silhouette, steeper than 45 degrees, and passes between the two
 *                middles at t: beyond 1/2 the far pixel takes t - 1/2, before it the near one takes 1/2 - t
 *                (Laine et al. 2020, 3.5)
 *   area         the edge where the surface ends or folds, found by a walk from the near triangle towards the far
 *                middle; each pixel takes the exact share of it that lies beyond the line of that edge.  Near 45
 *                degrees rows and columns share it, the more gradually the shorter the edge is */
#ifndef TL_GRAD_PAIRS_C
#define TL_GRAD_PAIRS_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/inline.h"
#include "grad/pixels.h"

#define TL_CROSSING_SLACK 0.0625 /* px by which the snap may move an edge past a middle that it separates */
#define TL_HANDOVER 0.6          /* width of the hand-over about 45 degrees, in the cosine of twice the angle */
#define TL_WALK_STEPS 256        /* of a walk */

/* Two neighbours. */
typedef struct {
    int64_t near, far;      /* pixels */
    int32_t id, far_id;     /* their triangles; the last may be -1 */
    int axis;               /* 0: in a row */
    double flip, middle[2]; /* flip: 1, or -1 where the far one comes first */
} tl_pair;

/* The edge that separates them. */
typedef struct {
    int32_t vertices[2];
    double t, slope, rise, ends[2]; /* where it crosses the line of middles; d along / d beside; ends: weights of t */
    double near, far;               /* shares */
    double near_by[2], far_by[2];   /* what they change by with t and with the slope */
} tl_pair_edge;

/* The corners of a triangle about a pair. */
TL_INLINE void place_corners(const tl_grad_view *view, const tl_grad_edges *e, const tl_pair *pair, int32_t id,
                             double *along, double *beside)
{
    for (int k = 0; k < 3; k++) {
        const double *px = e->places + 2 * (int64_t)view->tri[3 * (int64_t)id + k];
        along[k] = pair->flip * (px[pair->axis] - pair->middle[pair->axis]);
        beside[k] = px[1 - pair->axis] - pair->middle[1 - pair->axis];
    }
}

/* The edge among `allowed` that crosses the line of middles farthest along; -1 for none. */
TL_INLINE int exit_edge(const double *along, const double *beside, int allowed, tl_pair_edge *edge)
{
    int found = -1;
    edge->t = -9.0;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        if (!(allowed >> k & 1) || (beside[i] <= 0.0) == (beside[j] <= 0.0))
            continue;
        const double rise = beside[j] - beside[i], slope = (along[j] - along[i]) / rise;
        const double t = along[i] - beside[i] * slope;
        if (!(t > edge->t))
            continue;
        found = k;
        edge->t = t, edge->slope = slope, edge->rise = rise;
        edge->ends[0] = beside[j] / rise, edge->ends[1] = -beside[i] / rise;
    }
    return edge->t > -TL_CROSSING_SLACK && edge->t < 1.0 + TL_CROSSING_SLACK ? found : -1;
}

/* The edges of a triangle that are steep enough for a pair in a row, or flat enough for one in a column. */
TL_INLINE int steep_edges(const double *along, const double *beside, int axis)
{
    int found = 0;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const double rise = fabs(beside[j] - beside[i]), run = fabs(along[j] - along[i]);
        found |= (axis ? rise > run : rise >= run) << k;
    }
    return found;
}

TL_INLINE void set_vertices(const tl_grad_view *view, int32_t id, int k, tl_pair_edge *edge)
{
    edge->vertices[0] = view->tri[3 * (int64_t)id + (k + 1) % 3];
    edge->vertices[1] = view->tri[3 * (int64_t)id + (k + 2) % 3];
}

static int find_silhouette(const tl_grad_view *view, const tl_grad_edges *e, const tl_pair *pair, tl_pair_edge *edge)
{
    double along[3], beside[3];
    const int allowed = e->outline[pair->id] & TL_SILHOUETTES;
    if (!allowed || !(e->outline[pair->id] & TL_IS_AHEAD))
        return 0;
    place_corners(view, e, pair, pair->id, along, beside);
    const int k = exit_edge(along, beside, allowed & steep_edges(along, beside, pair->axis), edge);
    if (k < 0)
        return 0;
    set_vertices(view, pair->id, k, edge);
    const int is_between = edge->t >= 0.0 && edge->t <= 1.0;
    const double shift = clamped(edge->t, 0.0, 1.0) - 0.5;
    edge->near = shift > 0.0 ? 0.0 : -shift, edge->far = shift > 0.0 ? shift : 0.0;
    edge->near_by[0] = is_between && shift < 0.0 ? -1.0 : 0.0, edge->far_by[0] = is_between && shift > 0.0 ? 1.0 : 0.0;
    edge->near_by[1] = edge->far_by[1] = 0.0;
    return 1;
}

/* The share of a square of side 1 that lies before a line, which crosses its middle line at u and has a slope of 2 h
 * there; what it changes by with u and with h. */
TL_INLINE double area_before(double u, double h, double *by_u, double *by_h)
{
    *by_u = *by_h = 0.0;
    if (u <= -h || u >= 1.0 + h)
        return u > 0.5;
    h = h < 1e-9 ? 1e-9 : h;
    const double p = h - u > 0.0 ? h - u : 0.0, q = u + h > 1.0 ? u + h - 1.0 : 0.0;
    *by_u = 1.0 - (p + q) / (2.0 * h);
    *by_h = (p * (h + u) - q * (h - u + 1.0)) / (4.0 * h * h);
    return u + (p * p - q * q) / (4.0 * h);
}

/* How much of an edge is left to this axis, the rest being the other one's: rows and columns of pixels. */
TL_INLINE double share_of_axis(double slope, double low, double high, int axis)
{
    const double open = 1.0 - (high < 0.5 ? high : 0.5) + (low > -0.5 ? low : -0.5), width = TL_HANDOVER * open;
    if (width <= 1e-9)
        return axis ? fabs(slope) < 1.0 : fabs(slope) <= 1.0;
    return clamped(0.5 + (1.0 - slope * slope) / (1.0 + slope * slope) / (2.0 * width), 0.0, 1.0);
}

/* The walk; 1: an edge was found, 0: the surface goes on to the far triangle, -1: neither. */
static int walk_edge(const tl_grad_view *view, const tl_grad_edges *e, const tl_pair *pair, tl_pair_edge *edge,
                     double *beside)
{
    double along[3];
    int32_t id = pair->id;
    for (int step = 0; step <= TL_WALK_STEPS; step++) {
        if (!(e->outline[id] & TL_IS_AHEAD))
            return -1;
        place_corners(view, e, pair, id, along, beside);
        const int k = exit_edge(along, beside, 7, edge);
        if (k < 0)
            return -1;
        const int32_t other = e->across[3 * (int64_t)id + k];
        set_vertices(view, id, k, edge);
        const double low = beside[(k + 1) % 3], high = beside[(k + 2) % 3];
        beside[0] = low < high ? low : high, beside[1] = low < high ? high : low;
        if (other < 0 || e->outline[id] >> k & 1 || step == TL_WALK_STEPS)
            return 1;
        if (other / 3 == pair->far_id)
            return 0;
        id = other / 3;
    }
    return -1;
}

static int find_area_edge(const tl_grad_view *view, const tl_grad_edges *e, tl_pair *pair, tl_pair_edge *edge)
{
    double beside[3];
    int found = walk_edge(view, e, pair, edge, beside);
    if (found < 0 && pair->far_id >= 0) { /* from the far one */
        const int64_t near = pair->near;
        const int32_t id = pair->id;
        pair->middle[pair->axis] += pair->flip, pair->flip = -pair->flip;
        pair->near = pair->far, pair->far = near, pair->id = pair->far_id, pair->far_id = id;
        found = walk_edge(view, e, pair, edge, beside);
    }
    if (found <= 0)
        return 0;
    const double part = share_of_axis(edge->slope, beside[0], beside[1], pair->axis), u = clamped(edge->t, 0.0, 1.0);
    if (part == 0.0)
        return 0;
    const double h = fabs(edge->slope) / 2.0, sign = edge->slope < 0.0 ? -0.5 : edge->slope > 0.0 ? 0.5 : 0.0;
    double by_u, by_h;
    edge->near = part * (1.0 - area_before(u + 0.5, h, &by_u, &by_h));
    edge->near_by[0] = -part * by_u, edge->near_by[1] = -part * by_h * sign;
    edge->far = part * area_before(u - 0.5, h, &by_u, &by_h);
    edge->far_by[0] = part * by_u, edge->far_by[1] = part * by_h * sign;
    return 1;
}

/* Adds a gradient of a vertex's pixel coordinates to its sums of x, y, z, w. */
TL_INLINE void pull_vertex(const tl_grad_view *view, tl_grad_sums *sums, int32_t vertex, const double *g_px)
{
    double *to = sums_of(sums, vertex);
    const double w = get_real(view->pos, 4 * (int64_t)vertex + 3, view->is_f64);
    for (int axis = 0; axis < 2; axis++) {
        const double g = g_px[axis] / (2.0 * view->scale[axis]) / w;
        to[axis] += g;
        to[3] -= g * (get_real(view->pos, 4 * (int64_t)vertex + axis, view->is_f64) / w);
    }
}

/* Adds what the ends of an edge get, from the gradients of both shares. */
static void pull_edge(const tl_grad_view *view, const tl_pair *pair, const tl_pair_edge *edge, double g_near,
                      double g_far, tl_grad_sums *sums)
{
    const double g_t = g_near * edge->near_by[0] + g_far * edge->far_by[0];
    const double by_rise = (g_near * edge->near_by[1] + g_far * edge->far_by[1]) / edge->rise;
    for (int k = 0; k < 2; k++) {
        const double g = g_t * edge->ends[k] + (k ? by_rise : -by_rise);
        double g_px[2];
        g_px[pair->axis] = pair->flip * g, g_px[1 - pair->axis] = -edge->slope * g;
        pull_vertex(view, sums, edge->vertices[k], g_px);
    }
}

#endif
