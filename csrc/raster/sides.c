/* Sides: which side of a triangle is visible.
 * In: a mesh of either kind.  Out: its triangles; single-sided triangles are collapsed where they show the culled side,
 * or their pieces, in place, if a plane cuts them. */
#ifndef TL_SIDES_C
#define TL_SIDES_C

#include <stdint.h>

#include "topleft.h"
#include "vertex/clip.c"
#include "vertex/corners.h"
#include "vertex/exact.h"
#include "vertex/setup.c"
#include "exact/sign.c"

/* The sign of the area of a triangle of points `stride` numbers apart; without points, of vertex records. */
static int turn_of(const double *points, int stride, const tl_vertex_set *set, const int32_t *corners)
{
    tl_triangle t;
    exact_point p[3];
    if (!points)
        return load_triangle(set, corners, &t);
    for (int k = 0; k < 3; k++)
        p[k] = (exact_point){points[(int64_t)corners[k] * stride], points[(int64_t)corners[k] * stride + 1]};
    return edge_sign(p[0], p[1], p[2]);
}
static int wanted_turn(const tl_snapped *snapped) { return snapped->cull == TL_CULL_BACK ? -1 : 1; }

/* Whether a triangle that no plane cuts shows the side that is drawn. */
static int shows_whole(const tl_snapped *snapped, const int32_t *corners)
{
    const tl_exact_points *exact = snapped->mesh.exact;
    return turn_of(exact ? exact->points : NULL, exact ? exact->stride : 0, &snapped->mesh, corners) ==
           wanted_turn(snapped);
}

/* Whether a triangle of vertex records shows the side that is drawn, or a piece of it does if a plane cuts it; agrees
 * with `draw_triangle`. */
static int shows_side(const tl_snapped *snapped, int64_t i)
{
    int32_t own[3];
    const triangle_parts parts = parts_of(snapped, i, own);
    for (int k = 0; k < parts.n; k++)
        if (turn_of(NULL, 0, &parts.set, parts.corners + 3 * k) == wanted_turn(snapped))
            return 1;
    return 0;
}

/* Collapses the pieces of a clipped triangle that show the culled side. */
static void drop_pieces(const tl_snapped *snapped, int64_t i)
{
    const tl_pieces *p = snapped->mesh.exact ? snapped->mesh.exact->pieces : snapped->pieces;
    if (!p)
        return;
    const tl_vertex_set cut = piece_set(p, &snapped->mesh);
    for (int64_t k = first_piece(p->source, p->n_pieces, i); k < p->n_pieces && p->source[k] == i; k++) {
        int32_t *corners = p->triangles + 3 * k;
        if (turn_of(p->points, 3, &cut, corners) != wanted_turn(snapped))
            corners[1] = corners[2] = corners[0];
    }
}

static void drop_sides(const tl_snapped *snapped, const uint8_t *is_single, int64_t first, int64_t end,
                       int32_t *triangles)
{
    for (int64_t i = first; i < end; i++) {
        int32_t corners[3], *own = triangles + 3 * i;
        read_corners(snapped, i, corners);
        const int is_cut = is_clipped(&snapped->mesh, corners);
        const int is_left = !is_single[i] || is_cut || shows_whole(snapped, corners);
        own[0] = corners[0];
        own[1] = is_left ? corners[1] : corners[0];
        own[2] = is_left ? corners[2] : corners[0];
        if (is_single[i] && is_cut)
            drop_pieces(snapped, i);
    }
}

#endif
