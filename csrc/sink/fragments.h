/* The list of covered samples of small triangles, and a sample as one integer.
 * In: samples with id and depth.  Out: a list that a sink flushes when it is full. */
#ifndef TL_FRAGMENTS_H
#define TL_FRAGMENTS_H

#include <stdint.h>
#include <string.h>

#include "lanes/lanes.h"

/* The length of the list at which it is flushed. */
#define TL_FRAGMENTS 1024
#define TL_PREFETCH 16

typedef struct {
    int n;
    int32_t sample[TL_FRAGMENTS + 8 * TL_MAX_LANES + TL_PREFETCH]; /* row * stride_px + column */
    int32_t id[TL_FRAGMENTS + 8 * TL_MAX_LANES];
    float depth[TL_FRAGMENTS + 8 * TL_MAX_LANES];
} fragment_list;

/* A sample as one integer, smaller if it wins: depth bits in the order of the numbers, then id; `key_depth` is the
 * inverse. */
TL_INLINE int64_t sample_key(float depth, int32_t id, int32_t turn)
{
    int32_t bits;
    memcpy(&bits, &depth, 4);
    bits ^= (int32_t)((uint32_t)(bits >> 31) >> 1) ^ turn;
    return (int64_t)((uint64_t)(uint32_t)bits << 32 | (uint32_t)id);
}
TL_INLINE float key_depth(int64_t key, int32_t turn)
{
    int32_t bits = (int32_t)(key >> 32) ^ turn;
    float depth;
    bits ^= (int32_t)((uint32_t)(bits >> 31) >> 1);
    memcpy(&depth, &bits, 4);
    return depth;
}

#endif
