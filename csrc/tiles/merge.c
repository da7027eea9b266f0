/* Merge: merges visibility buffers of shares of the triangles into that of all triangles; renames triangles.
 * In: ids and depth of two buffers.  Out: those of the nearer triangle; at equal depth of the lower index.
 *
 * The depth of a pixel depends on its triangle alone, so the least (depth, index) over the buffers is the least over
 * all triangles: any split, in any order, gives equal bits.
 *
 * Based on: S. Molnar, M. Cox, D. Ellsworth, H. Fuchs, A Sorting Classification of Parallel Rendering, 1994
 * (sort-last). */
#ifndef TL_MERGE_C
#define TL_MERGE_C

#include <stdint.h>

#include "topleft.h"
#include "tiles/tiles.h"

/* No branch inside the loops, so that the compiler vectorises. */
static void merge_fragments(const tl_merge *m, int64_t first, int64_t end)
{
    int32_t *restrict ids = m->ids;
    float *restrict depth = m->depth;
    const int32_t *restrict other_ids = m->other_ids;
    const float *restrict other_depth = m->other_depth;
    const int32_t first_id = m->first_id;
    if (m->rule == TL_MERGE_LATER) {
        for (int64_t i = first; i < end; i++) {
            const int32_t id = other_ids[i] < 0 ? -1 : (int32_t)((uint32_t)other_ids[i] + (uint32_t)first_id);
            const int takes = id > ids[i];
            ids[i] = takes ? id : ids[i];
            depth[i] = takes ? other_depth[i] : depth[i];
        }
        return;
    }
    const float sign = m->rule == TL_MERGE_GREATER ? -1.0f : 1.0f; /* exact; -1 reverses the order */
    for (int64_t i = first; i < end; i++) {
        const int32_t id = other_ids[i] < 0 ? -1 : (int32_t)((uint32_t)other_ids[i] + (uint32_t)first_id);
        const float mine = sign * depth[i], other = sign * other_depth[i];
        const int is_nearer = (other < mine) | ((other == mine) & (id < ids[i]));
        const int takes = (id >= 0) & ((ids[i] < 0) | is_nearer);
        ids[i] = takes ? id : ids[i];
        depth[i] = takes ? other_depth[i] : depth[i];
    }
}

/* names[0] is for the background, names[1 + i] for triangle i. */
static void name_triangles(int32_t *restrict ids, int64_t first, int64_t end, const int32_t *restrict names)
{
    for (int64_t i = first; i < end; i++)
        ids[i] = names[1 + ids[i]];
}

#endif
