/* Project: object or clip space to points in pixels with depth, none snapped, and the parts that clip planes leave.
 * In: the caller's vertices, a matrix.  Out: points (x, y, z), those that cannot be drawn marked; pieces of triangles.
 *
 * The operations are those of project.c and clip.c up to the snap, in the same order. */
#ifndef TL_PROJECT_EXACT_C
#define TL_PROJECT_EXACT_C

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/project.c"
#include "exact/sign.c"

#define TL_SURELY_INSIDE_PX 0x1p50 /* of the guard band, which begins 2^52 px from the middle of the picture */

/* Perspective divide and viewport, as store_projected. */
TL_INLINE void set_point(const double *p, const tl_view *view, int was_cut, double *out)
{
    double z = view->zero_to_one ? p[2] / p[3] : (p[2] / p[3] + 1.0) * 0.5;
    if (was_cut && view->near_clip)
        z = z < 0.0 ? 0.0 : z; /* a cut lies on its plane but for rounding */
    if (was_cut && view->far_clip)
        z = z > 1.0 ? 1.0 : z;
    out[0] = (p[0] / p[3] + 1.0) * view->half_width_px;
    out[1] = (1.0 - p[1] / p[3]) * view->half_height_px;
    out[2] = z > FLT_MAX ? FLT_MAX : z < -FLT_MAX ? -FLT_MAX : z; /* only without near and far planes */
}

static void project_point(const tl_source *source, int64_t i, const tl_view *view, double *points,
                          tl_vertex_counts *counts)
{
    double p[4], *out = points + 3 * i;
    clip_position(source, i, p);
    if (!(isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]) && isfinite(p[3]))) {
        out[0] = NAN, out[1] = TL_BAD, out[2] = 0.0;
        counts->n_bad++;
    } else if (outside_planes(p, view)) {
        out[0] = NAN, out[1] = TL_CLIPPED, out[2] = 0.0;
        counts->n_clipped++;
    } else {
        set_point(p, view, 0, out);
    }
}

/* `scalar`, `has_matrix` and `is_affine` are constants, as in project_lanes. */
TL_INLINE int64_t project_point_lanes(const tl_source *source, int64_t first, int64_t end, const tl_view *view,
                                      double *points, tl_vertex_counts *counts, tl_scalar scalar, int has_matrix,
                                      int is_affine)
{
    const vd one = vd_set1(1.0), half = vd_set1(0.5), largest = vd_set1(FLT_MAX);
    const vd half_x = vd_set1(view->half_width_px), half_y = vd_set1(view->half_height_px);
    const vd farthest = vd_set1(TL_SURELY_INSIDE_PX);
    const int stride = has_matrix ? 3 : 4;
    double m64[16], columns[3][TL_MAX_LANES];
    float m32[16];
    if (has_matrix)
        memcpy(scalar == TL_F32 ? (void *)m32 : (void *)m64, source->matrix,
               scalar == TL_F32 ? sizeof m32 : sizeof m64);
    int64_t i = first;
    /* loads read two numbers past the last row */
    for (; i + TL_LANES <= end && i + TL_LANES < source->n; i += TL_LANES) {
        vd p[4], ndc[3];
        vm good;
        if (scalar == TL_F32) {
            vf p32[4];
            clip_lanes_f32((const float *)source->data + i * stride, has_matrix ? m32 : NULL, stride, p32);
            good = inside_lanes_f32(p32, view);
            for (int k = 0; k < 4; k++)
                p[k] = vd_from_vf(p32[k]);
        } else {
            clip_lanes_f64((const double *)source->data + i * stride, has_matrix ? m64 : NULL, stride, p);
            good = inside_lanes(p, view);
        }
        if (is_affine)
            ndc[0] = p[0], ndc[1] = p[1], ndc[2] = p[2];
        else
            vd_quotients(p, p[3], ndc, scalar == TL_F32);
        const vd x = vd_mul(vd_add(ndc[0], one), half_x), y = vd_mul(vd_sub(one, ndc[1]), half_y);
        const vd z = view->zero_to_one ? ndc[2] : vd_mul(vd_add(ndc[2], one), half);
        good = vm_and(good, vm_and(vd_ge(farthest, vd_abs(x)), vd_ge(farthest, vd_abs(y))));
        if (!(view->near_clip && view->far_clip))
            good = vm_and(good, vd_ge(largest, vd_abs(z)));
        vd_store(columns[0], x), vd_store(columns[1], y), vd_store(columns[2], z);
        double *out = points + 3 * i;
        for (int k = 0; k < TL_LANES; k++, out += 3)
            out[0] = columns[0][k], out[1] = columns[1][k], out[2] = columns[2][k];
        for (unsigned rest = vm_bits(vm_and_not(vm_all(), good)); rest; rest &= rest - 1)
            project_point(source, i + __builtin_ctz(rest), view, points, counts);
    }
    return i;
}

static tl_vertex_counts project_points(const tl_source *source, int64_t first, int64_t end, const tl_view *view,
                                       double *points)
{
    tl_vertex_counts counts = {0, 0, 0};
    int64_t i = first;
    if (TL_LANES > 1 && source->scalar == TL_F32)
        i = source->is_affine ? project_point_lanes(source, first, end, view, points, &counts, TL_F32, 1, 1)
            : source->matrix  ? project_point_lanes(source, first, end, view, points, &counts, TL_F32, 1, 0)
                              : project_point_lanes(source, first, end, view, points, &counts, TL_F32, 0, 0);
    else if (TL_LANES > 1)
        i = source->is_affine ? project_point_lanes(source, first, end, view, points, &counts, TL_F64, 1, 1)
            : source->matrix  ? project_point_lanes(source, first, end, view, points, &counts, TL_F64, 1, 0)
                              : project_point_lanes(source, first, end, view, points, &counts, TL_F64, 0, 0);
    for (; i < end; i++)
        project_point(source, i, view, points, &counts);
    return counts;
}

/* ---- triangles that a clip plane cuts ------------------------------------------------------------------ */

TL_INLINE exact_point piece_point(const tl_exact_pieces *p, int64_t i)
{
    return (exact_point){p->points[3 * i], p->points[3 * i + 1]};
}

/* First piece of a triangle, by bisection in the ascending sources. */
static int64_t first_exact_piece(const tl_exact_pieces *p, int64_t id)
{
    int64_t low = 0, high = p ? p->n_pieces : 0;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (p->source[middle] < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* The sign of the area of triangle i of the fan from an apex, and about twice the area. */
static int fan_sign(const tl_exact_pieces *p, int64_t first, int n, int apex, int i, double *area)
{
    const exact_point a = piece_point(p, first + apex), b = piece_point(p, first + (apex + i) % n);
    const exact_point c = piece_point(p, first + (apex + i + 1) % n);
    tl_exact_counts counts = {0, 0, 0, 0, 0, 0};
    *area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    return edge_sign(a, b, c, &counts);
}

/* As fan_apex: rounding may dent a corner as the snap may. */
static int exact_fan_apex(const tl_exact_pieces *p, int64_t first, int n, int source_turn, int *turn)
{
    double least = 0.0;
    int best = -1;
    for (int apex = 0; apex < n; apex++) {
        double sums[3] = {0.0, 0.0, 0.0}; /* of negative, no and positive areas */
        int has_positive = 0, has_negative = 0;
        for (int i = 1; i < n - 1; i++) {
            double area;
            const int sign = fan_sign(p, first, n, apex, i, &area);
            has_positive |= sign > 0, has_negative |= sign < 0;
            sums[sign + 1] += fabs(area);
        }
        if (!has_positive || !has_negative) {
            *turn = has_positive - has_negative;
            return apex;
        }
        if (source_turn == 0)
            source_turn = sums[2] >= sums[0] ? 1 : -1;
        const double wrong = source_turn > 0 ? sums[0] : sums[2];
        if (best < 0 || wrong < least)
            best = apex, least = wrong;
    }
    *turn = source_turn;
    return best;
}

/* Appends the fan of the polygon of one triangle. */
static void append_exact_pieces(tl_exact_pieces *p, const clip_corner *polygon, int n, int32_t source, int source_turn,
                                const tl_view *view)
{
    const int64_t first = p->n_points;
    for (int k = 0; k < n; k++) {
        double *point = p->points + 3 * (first + k);
        set_point(polygon[k].pos, view, 1, point);
        if (!isfinite(point[0]) || !isfinite(point[1]))
            return; /* left the range of float64 in the cut: beyond any picture */
        p->inv_w[first + k] = 1.0 / polygon[k].pos[3];
        memcpy(p->weights + 3 * (first + k), polygon[k].weights, sizeof polygon[k].weights);
    }
    int turn;
    const int apex = exact_fan_apex(p, first, n, source_turn, &turn);
    for (int i = 1; i < n - 1; i++) {
        double area;
        if (turn == 0 || fan_sign(p, first, n, apex, i, &area) != turn)
            continue;
        int32_t *t = p->triangles + 3 * p->n_pieces;
        t[0] = (int32_t)(first + apex);
        t[1] = (int32_t)(first + (apex + i) % n);
        t[2] = (int32_t)(first + (apex + i + 1) % n);
        p->source[p->n_pieces++] = source;
    }
    p->n_points += n;
}

static void clip_points(const tl_source *source, const double *points, const int32_t *triangles, int64_t n_triangles,
                        const tl_view *view, tl_exact_pieces *pieces)
{
    clip_corner polygon[TL_MAX_CORNERS];
    pieces->n_points = pieces->n_pieces = 0;
    for (int64_t i = 0; i < n_triangles; i++) {
        const int32_t *corners = triangles + 3 * i;
        int is_cut = 0;
        for (int k = 0; k < 3; k++)
            is_cut |= isnan(points[3 * (int64_t)corners[k]]);
        const int n = is_cut ? clip_triangle(source, corners, view, polygon) : 0;
        if (n && pieces->points) {
            append_exact_pieces(pieces, polygon, n, (int32_t)i, clip_turn(source, corners), view);
        } else if (n) {
            pieces->n_points += n;
            pieces->n_pieces += n - 2;
        }
    }
}

#endif
