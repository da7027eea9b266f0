/* Pieces: cuts triangles by clip planes into fans over new vertices, snapped or not.
 * In: the caller's vertices, a matrix, the projected vertices.  Out: pieces of triangles. */
#ifndef TL_PIECES_C
#define TL_PIECES_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/corners.h"
#include "vertex/exact.h"
#include "vertex/fixed.h"
#include "vertex/project.c"
#include "exact/sign.c"

TL_INLINE exact_point piece_point(const tl_pieces *p, int64_t i)
{
    return (exact_point){p->points[3 * i], p->points[3 * i + 1]};
}

static inline tl_wide snapped_corner(const tl_pieces *p, int64_t i)
{
    if (p->vertices[i].x_fx == TL_SPECIAL)
        return p->wide[i];
    return (tl_wide){p->vertices[i].x_fx, p->vertices[i].y_fx};
}

/* Twice the area of a triangle of a fan: the sign and, of snapped vertices, the size are exact. */
typedef struct {
    int sign;
    tl_int128 size_fx;
    double size;
} fan_area;

/* The area of triangle i of the fan from an apex. */
static fan_area area_in_fan(const tl_pieces *p, int64_t first, int n, int apex, int i)
{
    const int64_t corners[3] = {first + apex, first + (apex + i) % n, first + (apex + i + 1) % n};
    fan_area area = {.size_fx = i128_from(0)};
    if (p->points) {
        const exact_point a = piece_point(p, corners[0]), b = piece_point(p, corners[1]);
        const exact_point c = piece_point(p, corners[2]);
        area.sign = edge_sign(a, b, c);
        area.size = fabs((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
    } else {
        const tl_wide a = snapped_corner(p, corners[0]), b = snapped_corner(p, corners[1]);
        const tl_wide c = snapped_corner(p, corners[2]);
        const tl_int128 doubled =
            i128_sub(i128_product(b.x_fx - a.x_fx, c.y_fx - a.y_fx), i128_product(b.y_fx - a.y_fx, c.x_fx - a.x_fx));
        area.sign = i128_sign(doubled);
        area.size_fx = area.sign < 0 ? i128_neg(doubled) : doubled;
    }
    return area;
}

/* Whether an area is less than another area of the same polygon. */
static int is_less_area(const fan_area *a, const fan_area *b)
{
    return a->size < b->size || i128_less(a->size_fx, b->size_fx);
}

/* Sums the areas of a fan by sign. */
static void add_up_fan(const tl_pieces *p, int64_t first, int n, int apex, fan_area *negative, fan_area *positive)
{
    *negative = *positive = (fan_area){.size_fx = i128_from(0)};
    for (int i = 1; i < n - 1; i++) {
        const fan_area area = area_in_fan(p, first, n, apex, i);
        fan_area *const sum = area.sign < 0 ? negative : positive;
        if (area.sign)
            sum->sign = area.sign;
        sum->size += area.sign ? area.size : 0.0;
        sum->size_fx = i128_add(sum->size_fx, area.size_fx);
    }
}

/* Finds the apex of a fan whose triangles all have one sign: rounding may dent a corner of the convex polygon inwards,
 * and then the fan from that corner is such a fan.  If corners have swapped, none exists: then the fan with the least
 * area of the wrong sign is taken, and its triangles that turn against the source triangle are dropped.  Returns the
 * apex; *turn is the sign of the triangles to draw. */
static int fan_apex(const tl_pieces *p, int64_t first, int n, int source_turn, int *turn)
{
    fan_area least;
    int best = -1;
    for (int apex = 0; apex < n; apex++) {
        fan_area negative, positive;
        add_up_fan(p, first, n, apex, &negative, &positive);
        if (!negative.sign || !positive.sign) {
            *turn = negative.sign + positive.sign;
            return apex;
        }
        if (source_turn == 0)
            source_turn = is_less_area(&positive, &negative) ? -1 : 1;
        const fan_area wrong = source_turn > 0 ? negative : positive;
        if (best < 0 || is_less_area(&wrong, &least))
            best = apex, least = wrong;
    }
    *turn = source_turn;
    return best;
}

/* The sign of a triangle's area as drawn (y down) from its clip-space corners: the sign of its homogeneous
 * determinant. */
static inline int clip_turn(const tl_source *source, const int32_t *corners)
{
    double a[4], b[4], c[4];
    clip_position(source, corners[0], a);
    clip_position(source, corners[1], b);
    clip_position(source, corners[2], c);
    const double det =
        (a[0] * (b[1] * c[3] - b[3] * c[1]) - a[1] * (b[0] * c[3] - b[3] * c[0])) + a[3] * (b[0] * c[1] - b[1] * c[0]);
    return (det < 0.0) - (det > 0.0);
}

/* Appends the fan of the polygon of one triangle. */
static void append_pieces(tl_pieces *p, const clip_corner *polygon, int n, int32_t source, int source_turn,
                          const tl_view *view)
{
    const int64_t first = p->n_vertices;
    tl_vertex_counts counts = {0, 0, 0};
    for (int k = 0; k < n; k++) {
        double *const point = p->points + 3 * (first + k);
        if (!p->points) {
            store_projected(polygon[k].pos, view, first + k, p->vertices, p->wide, 1, &counts);
        } else {
            set_projected(polygon[k].pos, view, 1, point);
            counts.n_bad += !isfinite(point[0]) || !isfinite(point[1]);
        }
        p->inv_w[first + k] = 1.0 / polygon[k].pos[3];
        memcpy(p->weights + 3 * (first + k), polygon[k].weights, sizeof polygon[k].weights);
    }
    if (counts.n_bad)
        return; /* beyond 2^62 in spite of the guard band, or outside of float64: beyond any picture */
    int turn;
    const int apex = fan_apex(p, first, n, source_turn, &turn);
    for (int i = 1; i < n - 1; i++) {
        if (turn == 0 || area_in_fan(p, first, n, apex, i).sign != turn)
            continue;
        int32_t *t = p->triangles + 3 * p->n_pieces;
        t[0] = (int32_t)(first + apex);
        t[1] = (int32_t)(first + (apex + i) % n);
        t[2] = (int32_t)(first + (apex + i + 1) % n);
        p->source[p->n_pieces++] = source;
    }
    p->n_vertices += n;
}

static void clip(const tl_source *source, const tl_projected *projected, const int32_t *triangles, const int32_t *ids,
                 int64_t n_listed, const tl_view *view, tl_pieces *pieces)
{
    clip_corner polygon[TL_MAX_CORNERS];
    const tl_vertex_set mesh = {.vertices = projected->records};
    const tl_exact_points points = {.points = projected->points, .stride = TL_PLACED};
    const tl_vertex_set unsnapped = {.exact = &points};
    const int64_t vertex_room = pieces->n_vertices, room = pieces->n_pieces;
    pieces->n_vertices = pieces->n_pieces = 0;
    for (int64_t i = 0; i < n_listed; i++) {
        const int64_t t = ids ? ids[i] : i;
        int32_t corners[3];
        for (int k = 0; k < 3; k++)
            corners[k] = corner_within(triangles[3 * t + k], source->n);
        const int is_cut = is_clipped(projected->points ? &unsnapped : &mesh, corners);
        const int n = is_cut ? clip_triangle(source, corners, view, polygon) : 0;
        if (n && pieces->source) {
            if (pieces->n_vertices + n > vertex_room || pieces->n_pieces + n - 2 > room)
                return; /* the mesh has changed since they were counted */
            append_pieces(pieces, polygon, n, (int32_t)t, clip_turn(source, corners), view);
        } else if (n) {
            pieces->n_vertices += n;
            pieces->n_pieces += n - 2;
        }
    }
}

#endif
