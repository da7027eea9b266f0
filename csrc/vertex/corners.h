/* Corners: the vertices of a triangle, read from indices of the caller, which another thread may write to.
 * In: indices that have been checked.  Out: these indices, clamped to the vertices. */
#ifndef TL_CORNERS_H
#define TL_CORNERS_H

#include <stdint.h>

#include "topleft.h"

static inline int32_t corner_within(int32_t corner, int64_t n_vertices)
{
    const uint32_t last = (uint32_t)(n_vertices - 1);
    return (int32_t)((uint32_t)corner < last ? (uint32_t)corner : last);
}

/* Code that uses the corners of a triangle more than once reads them once, here: a mesh that changes while it is drawn
 * gives a wrong picture, but no access outside of arrays. */
static inline void read_corners(const tl_snapped *snapped, int64_t i, int32_t *own)
{
    const int32_t *given = snapped->triangles + 3 * i;
    for (int k = 0; k < 3; k++)
        own[k] = corner_within(given[k], snapped->mesh.n_vertices);
}

#endif
