/* Mark: the vertices that some triangles use.
 * In: ids; most are equal to the id before.  Out: a byte for each block of vertices. */
#ifndef TL_MARK_C
#define TL_MARK_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"

#define TL_MARKED 512    /* ids processed together */
#define TL_MARK_AHEAD 16 /* triangles prefetched ahead: 1.5 times as fast beyond the caches */

/* Lists the ids that differ from the id before; returns how many. */
static int list_new_ids(const int32_t *ids, int n, int64_t n_triangles, vi *before, int32_t *listed)
{
    const vi none = vi_set1(-1), end = vi_set1((int32_t)n_triangles);
    int n_listed = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        const vm inside = vm_first(n - i);
        const vi id = n - i >= TL_LANES ? vi_load(ids + i) : vi_select(inside, vi_load_masked(inside, ids + i), none);
        const vm is_there = vm_and(vi_gt(id, none), vi_gt(end, id));
        const vm is_new = vm_and_not(is_there, vi_eq(id, vi_shift_in(id, *before)));
        n_listed += vi_compress(listed + n_listed, is_new, id);
        *before = id;
    }
    return n_listed;
}

static int64_t mark_vertices(const int32_t *ids, int64_t n, const int32_t *restrict triangles, int64_t n_triangles,
                             int64_t n_vertices, int block_bits, uint8_t *restrict is_used)
{
    int32_t listed[TL_MARKED + TL_MAX_LANES + TL_MARK_AHEAD];
    int64_t bad = -1;
    vi before = vi_set1(-1);
    for (int64_t first = 0; first < n; first += TL_MARKED) {
        const int n_ids = n - first < TL_MARKED ? (int)(n - first) : TL_MARKED;
        const int n_listed = list_new_ids(ids + first, n_ids, n_triangles, &before, listed);
        for (int i = 0; i < TL_MARK_AHEAD; i++)
            listed[n_listed + i] = 0;
        for (int i = 0; i < n_listed; i++) {
            const int32_t *corners = triangles + 3 * (int64_t)listed[i];
            __builtin_prefetch(triangles + 3 * (int64_t)listed[i + TL_MARK_AHEAD]);
            for (int k = 0; k < 3; k++) {
                const int32_t corner = corners[k]; /* read once: another thread may change it */
                if ((uint32_t)corner < (uint64_t)n_vertices)
                    is_used[corner >> block_bits] = 1;
                else
                    bad = listed[i];
            }
        }
    }
    return bad;
}

#endif
