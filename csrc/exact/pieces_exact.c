/* Pieces: triangles cut by clip planes, of vertices that are not snapped.
 * In: the caller's vertices, a matrix, points in pixels.  Out: pieces of triangles.
 *
 * The operations are those of clip.c up to the snap, in the same order. */
#ifndef TL_PIECES_EXACT_C
#define TL_PIECES_EXACT_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/corners.h"
#include "vertex/project.c"
#include "exact/sign.c"

TL_INLINE exact_point piece_point(const tl_exact_pieces *p, int64_t i)
{
    return (exact_point){p->points[3 * i], p->points[3 * i + 1]};
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
        set_projected(polygon[k].pos, view, 1, point);
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
    const int64_t point_room = pieces->n_points, room = pieces->n_pieces;
    pieces->n_points = pieces->n_pieces = 0;
    for (int64_t i = 0; i < n_triangles; i++) {
        int32_t corners[3];
        int is_cut = 0;
        for (int k = 0; k < 3; k++) {
            corners[k] = corner_within(triangles[3 * i + k], source->n);
            is_cut |= isnan(points[TL_PLACED * (int64_t)corners[k]]);
        }
        const int n = is_cut ? clip_triangle(source, corners, view, polygon) : 0;
        if (n && pieces->points) {
            if (pieces->n_points + n > point_room || pieces->n_pieces + n - 2 > room)
                return; /* as clip */
            append_exact_pieces(pieces, polygon, n, (int32_t)i, clip_turn(source, corners), view);
        } else if (n) {
            pieces->n_points += n;
            pieces->n_pieces += n - 2;
        }
    }
}

#endif
