/* Clip: cuts triangles by the clip planes.
 * In: homogeneous vertices.  Out: convex polygons; and readers of the pieces that exact/pieces.c makes of them.
 * Based on: I. E. Sutherland, G. W. Hodgman, Reentrant Polygon Clipping, 1974. */
#ifndef TL_CLIP_C
#define TL_CLIP_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "vertex/corners.h"
#include "vertex/exact.h"
#include "vertex/fixed.h"
#include "vertex/project.c"

#define TL_MAX_CORNERS (3 + TL_N_PLANES)
#define TL_MAX_PIECES (TL_MAX_CORNERS - 2) /* of one triangle */

typedef struct {
    double pos[4];     /* x, y, z, w */
    double weights[3]; /* barycentrics in the source triangle */
} clip_corner;

#define TL_PASSING_W 0x1p-24 /* half a step of float32 */

/* The w of the cut of an edge that passes the eye, from its end a in front.  Where no near plane cuts afterwards, a w
 * of TL_MIN_W would give the cut a depth so large that float64 loses the depths in the picture. */
static inline double passing_w(const clip_corner *a, const tl_view *view)
{
    const double w = a->pos[3] * TL_PASSING_W;
    return view->near_clip || w < TL_MIN_W ? TL_MIN_W : w;
}

/* Moves a cut point exactly onto its plane: far from the eye rounding may miss the plane by more than the picture. */
static inline void put_on_plane(double *p, int plane, double least_w, const tl_view *view)
{
    switch (plane) {
    case 0: p[3] = least_w; return;
    case 1: p[2] = view->zero_to_one ? 0.0 : -p[3]; return;
    case 2: p[2] = p[3]; return;
    case 3: p[0] = -(view->guard_band_x * p[3]); return;
    case 4: p[0] = view->guard_band_x * p[3]; return;
    case 5: p[1] = -(view->guard_band_y * p[3]); return;
    default: p[1] = view->guard_band_y * p[3]; return;
    }
}

/* The point where the edge from a (inside) to b (outside) meets the plane: both weights are positive, so w stays
 * positive. */
static inline clip_corner cut_edge(const clip_corner *a, const clip_corner *b, double da, double db, int plane,
                                   const tl_view *view)
{
    clip_corner cut;
    const double least_w = passing_w(a, view);
    if (plane == 0)
        da = a->pos[3] - least_w, db = b->pos[3] - least_w;
    const double of_a = -db / (da - db), of_b = da / (da - db);
    for (int k = 0; k < 4; k++)
        cut.pos[k] = a->pos[k] * of_a + b->pos[k] * of_b;
    for (int k = 0; k < 3; k++)
        cut.weights[k] = a->weights[k] * of_a + b->weights[k] * of_b;
    put_on_plane(cut.pos, plane, least_w, view);
    return cut;
}

/* Clips a convex polygon by one plane; returns the new number of corners. */
static int clip_polygon(const clip_corner *in, int n_in, int plane, const tl_view *view, clip_corner *out)
{
    int n = 0;
    for (int k = 0; k < n_in; k++) {
        const clip_corner *a = in + k, *b = in + (k + 1) % n_in;
        const double da = plane_distance(a->pos, plane, view), db = plane_distance(b->pos, plane, view);
        if (da >= 0.0)
            out[n++] = *a;
        if (da >= 0.0 && db < 0.0)
            out[n++] = cut_edge(a, b, da, db, plane, view);
        else if (da < 0.0 && db >= 0.0)
            out[n++] = cut_edge(b, a, db, da, plane, view);
    }
    return n;
}

/* Clips one triangle; returns the number of corners, 0 when nothing of it is left. */
static int clip_triangle(const tl_source *source, const int32_t *corners, const tl_view *view, clip_corner *polygon)
{
    clip_corner other[TL_MAX_CORNERS];
    unsigned any = 0, all = ~0u;
    for (int k = 0; k < 3; k++) {
        clip_position(source, corners[k], polygon[k].pos);
        for (int j = 0; j < 3; j++)
            polygon[k].weights[j] = j == k;
        const unsigned out = outside_planes(polygon[k].pos, view);
        any |= out;
        all &= out;
    }
    if (all)
        return 0;
    int n = 3;
    for (int plane = 0; plane < TL_N_PLANES && n; plane++) {
        if (!(any >> plane & 1))
            continue;
        n = clip_polygon(polygon, n, plane, view, other);
        memcpy(polygon, other, sizeof *polygon * (size_t)n);
    }
    for (int k = 0; k < n; k++)
        if (!(polygon[k].pos[3] >= TL_MIN_W * 0.5)) /* overflow or underflow: beyond any picture */
            return 0;
    return n < 3 ? 0 : n;
}

/* Whether a corner of a triangle is outside a clip plane. */
static inline int is_clipped(const tl_vertex_set *set, const int32_t *corners)
{
    int clipped = 0;
    if (set->exact) {
        for (int k = 0; k < 3; k++)
            clipped |= isnan(set->exact->points[(int64_t)corners[k] * set->exact->stride]);
        return clipped;
    }
    for (int k = 0; k < 3; k++)
        clipped |= set->vertices[corners[k]].x_fx == TL_SPECIAL && set->vertices[corners[k]].y_fx == TL_CLIPPED;
    return clipped;
}

/* The vertices of the pieces, for the sample of the mesh. */
static tl_vertex_set piece_set(const tl_pieces *p, const tl_vertex_set *mesh)
{
    return (tl_vertex_set){p->vertices,   p->wide,           p->inv_w,          NULL,
                           p->n_vertices, mesh->sample_x_fx, mesh->sample_y_fx, NULL};
}

/* The first of n pieces of a triangle, by bisection; sources ascend. */
static int64_t first_piece(const int32_t *source, int64_t n, int64_t id)
{
    int64_t low = 0, high = n;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (source[middle] < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* The parts of a triangle that are drawn: the triangle, or its pieces at clip planes; n parts, three of `corners`
 * each. */
typedef struct {
    tl_vertex_set set;
    const int32_t *corners;
    int n, is_cut;
} triangle_parts;

/* `own` holds the corners of a triangle that no plane cuts. */
static inline triangle_parts parts_of(const tl_snapped *snapped, int64_t i, int32_t *own)
{
    const tl_pieces *pieces = snapped->pieces;
    triangle_parts parts = {snapped->mesh, own, 1, 0};
    read_corners(snapped, i, own);
    if (!is_clipped(&parts.set, parts.corners))
        return parts;
    parts.is_cut = 1, parts.n = 0;
    if (!pieces)
        return parts;
    const int64_t first = first_piece(pieces->source, pieces->n_pieces, i);
    while (first + parts.n < pieces->n_pieces && pieces->source[first + parts.n] == i)
        parts.n++;
    parts.set = piece_set(pieces, &snapped->mesh);
    parts.corners = pieces->triangles + 3 * first;
    return parts;
}

#endif
