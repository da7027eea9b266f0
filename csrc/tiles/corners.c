/* Corners: copies the corners of some triangles of a mesh, three rows of numbers each, from memory or a mapped file.
 * In: vertices and triangles with any row stride.  Out: the corners, contiguous. */
#ifndef TL_CORNERS_C
#define TL_CORNERS_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"
#include "tiles/tiles.h"

/* n_bytes is a constant at each call, so that a row is copied by one or two moves. */
TL_INLINE int64_t copy_corners(const tl_corners *c, const int32_t *which, int64_t first, int64_t n, char *out,
                               const size_t n_bytes)
{
    for (int64_t i = 0; i < n; i++) {
        const char *row = c->triangles + (which ? (int64_t)which[i] : first + i) * c->triangle_stride;
        int64_t corner[3];
        if (c->is_wide) {
            memcpy(corner, row, sizeof(corner));
        } else {
            int32_t narrow[3];
            memcpy(narrow, row, sizeof(narrow));
            for (int k = 0; k < 3; k++)
                corner[k] = narrow[k];
        }
        for (int k = 0; k < 3; k++) {
            if ((uint64_t)corner[k] >= (uint64_t)c->n_points)
                return i;
            memcpy(out, c->points + corner[k] * c->point_stride, n_bytes);
            out += n_bytes;
        }
    }
    return -1;
}

static int64_t take_corners(const tl_corners *c, const int32_t *which, int64_t first, int64_t n, void *out)
{
    switch (c->point_bytes) {
    case 8: return copy_corners(c, which, first, n, out, 8);
    case 12: return copy_corners(c, which, first, n, out, 12);
    case 16: return copy_corners(c, which, first, n, out, 16);
    case 24: return copy_corners(c, which, first, n, out, 24);
    default: return copy_corners(c, which, first, n, out, (size_t)c->point_bytes);
    }
}

#endif
