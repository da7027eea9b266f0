/* Sides: triangles of which one side is not drawn, collapsed where they show it, by the exact sign of their areas.
 * In: a mesh of either kind.  Out: its triangles; of what a plane cuts the pieces, in place. */
#ifndef TL_SIDES_EXACT_C
#define TL_SIDES_EXACT_C

#include <stdint.h>

#include "topleft.h"
#include "vertex/clip.c"
#include "vertex/corners.h"
#include "exact/pieces_exact.c"
#include "exact/sign.c"
#include "raster/setup.c"

/* The sign of the area of a triangle, of points `stride` numbers apart. */
static int exact_turn(const double *points, int stride, const int32_t *corners)
{
    tl_exact_counts counts = {0, 0, 0, 0, 0, 0};
    exact_point p[3];
    for (int k = 0; k < 3; k++)
        p[k] = (exact_point){points[(int64_t)corners[k] * stride], points[(int64_t)corners[k] * stride + 1]};
    return edge_sign(p[0], p[1], p[2], &counts);
}

/* As drop_pieces in raster/setup.c. */
static void drop_exact_pieces(const tl_exact_pieces *p, int64_t i, int wanted)
{
    for (int64_t k = first_exact_piece(p, i); p && k < p->n_pieces && p->source[k] == i; k++) {
        int32_t *corners = p->triangles + 3 * k;
        if (exact_turn(p->points, 3, corners) != wanted)
            corners[1] = corners[2] = corners[0];
    }
}

static void drop_exact_sides(const tl_snapped *snapped, const uint8_t *is_single, int64_t first, int64_t end,
                             int32_t *triangles)
{
    const tl_exact_points *points = snapped->mesh.exact;
    const int wanted = snapped->cull == TL_CULL_BACK ? -1 : 1;
    for (int64_t i = first; i < end; i++) {
        int32_t corners[3], *own = triangles + 3 * i;
        read_corners(snapped, i, corners);
        const int is_cut = is_clipped(&snapped->mesh, corners);
        const int is_left = !is_single[i] || is_cut || exact_turn(points->points, points->stride, corners) == wanted;
        own[0] = corners[0];
        own[1] = is_left ? corners[1] : corners[0];
        own[2] = is_left ? corners[2] : corners[0];
        if (is_single[i] && is_cut)
            drop_exact_pieces(points->pieces, i, wanted);
    }
}

static void drop_sides_of_mesh(const tl_snapped *snapped, const uint8_t *is_single, int64_t first, int64_t end,
                               int32_t *triangles)
{
    if (snapped->mesh.exact)
        drop_exact_sides(snapped, is_single, first, end, triangles);
    else
        drop_sides(snapped, is_single, first, end, triangles);
}

#endif
