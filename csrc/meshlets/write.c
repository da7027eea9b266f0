/* Samples of meshlets to the buffers: rows of lanes at once, tiny triangles as a list of samples.
 * In: samples with ids and depths.  Out: the target's buffers; at equal depth the lower id stays. */
#ifndef TL_WRITE_C
#define TL_WRITE_C

#include <stdint.h>

#include "lanes/halves.h"
#include "lanes/lanes.h"
#include "sink/fragments.h"
#include "meshlets/batch.h"

#if TL_HAS_HALVES

/* A copy of a function for each sink. */
#define TL_DEPTH_COPIES(f, declared, ...)                                             \
    static __attribute__((noinline)) void f##_nearest declared { f(__VA_ARGS__, 0); } \
    static __attribute__((noinline)) void f##_farthest declared { f(__VA_ARGS__, 1); }

/* A row of lanes, whole or half. */
#define TL_PUT_ROW(NAME, M, F, I, P)                                                                  \
    TL_INLINE void NAME(const meshlet_batch *s, int64_t at, M m, F depth, I id, int is_farthest)      \
    {                                                                                                 \
        const F old = P##f_load_masked(m, s->depth + at);                                             \
        const M equal = P##m_and(m, P##f_eq(depth, old));                                             \
        M wins = P##m_and(m, is_farthest ? P##f_lt(old, depth) : P##f_lt(depth, old));                \
        if (__builtin_expect(P##m_any(equal), 0))                                                     \
            wins = P##m_or(wins, P##m_and(equal, P##i_gt(P##i_load_masked(equal, s->ids + at), id))); \
        P##f_store_masked(s->depth + at, wins, depth);                                                \
        P##i_store_masked(s->ids + at, wins, id);                                                     \
    }
TL_PUT_ROW(put_row, vm, vf, vi, v)
TL_PUT_ROW(put_short_row, hm, hf, hi, h)

TL_INLINE void write_fragments(meshlet_batch *s, int is_farthest)
{
    const int32_t *names = (const int32_t *)s->meshlets;
    const int32_t turn = is_farthest ? -1 : 0;
    const int n = s->n_fragments;
    for (int k = 0; k < n; k++) {
        prefetch(s->depth + s->sample[k + TL_PREFETCH_FRAGMENTS]);
        prefetch(s->ids + s->sample[k + TL_PREFETCH_FRAGMENTS]);
        const int64_t at = s->sample[k];
        const int64_t key = sample_key(s->fragment_depth[k], names[s->name[k]] + s->first_id, turn);
        const int64_t old = sample_key(s->depth[at], s->ids[at], turn), least = key < old ? key : old;
        s->depth[at] = key_depth(least, turn);
        s->ids[at] = (int32_t)least;
    }
    s->n_fragments = 0;
}
TL_DEPTH_COPIES(write_fragments, (meshlet_batch * s), s)

/* Writes the list when it has no room for so many more. */
TL_INLINE void make_fragment_room(meshlet_batch *s, int n)
{
    if (__builtin_expect(s->n_fragments > TL_FRAGMENTS_KEPT - n, 0)) {
        if (s->is_farthest)
            write_fragments_farthest(s);
        else
            write_fragments_nearest(s);
    }
}

TL_INLINE void add_fragments(meshlet_batch *s, vm m, vi sample, vi name, vf depth)
{
    const int n = s->n_fragments;
    vi_compress(s->sample + n, m, sample);
    vi_compress(s->name + n, m, name);
    s->n_fragments = n + vf_compress(s->fragment_depth + n, m, depth);
}

#endif
#endif
