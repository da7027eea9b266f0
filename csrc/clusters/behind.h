/* Behind: whether all depths in a rectangle beat a given depth.
 * In: depths, and bounds of segments of rows, or NULL.  Out: yes or no; tighter bounds. */
#ifndef TL_BEHIND_H
#define TL_BEHIND_H

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"

/* Columns of a rectangle from which bounds pay off. */
#define TL_LEAST_BOUNDED 96

/* The lanes in which `there` does not beat `depth`. */
TL_INLINE vm not_beating(vm live, vf there, vf depth, int is_farthest)
{
    return vm_and_not(live, is_farthest ? vf_lt(depth, there) : vf_lt(there, depth));
}

/* Whether all depths in columns [col0, col1) of a row beat `depth`. */
TL_INLINE int row_beats(const float *row, int64_t col0, int64_t col1, vf depth, int is_farthest)
{
    for (int64_t col = col0; col < col1; col += TL_LANES) {
        const vm live = vm_first(col1 - col);
        if (vm_any(not_beating(live, vf_load_masked(live, row + col), depth, is_farthest)))
            return 0;
    }
    return 1;
}

/* Like `row_beats`, with bounds: tests whole segments first and stores what passed; later depths only come nearer. */
TL_INLINE int bounded_row_beats(const float *row, float *bounds, int64_t width, int64_t col0, int64_t col1, float depth,
                                int is_farthest)
{
    const vf depths = vf_set1(depth);
    const int64_t n_segments = ((col1 - 1) >> TL_SEGMENT_BITS) + 1;
    for (int64_t i = col0 >> TL_SEGMENT_BITS; i < n_segments; i += TL_LANES) {
        const vm live = vm_first(n_segments - i);
        unsigned open = vm_bits(not_beating(live, vf_load_masked(live, bounds + i), depths, is_farthest));
        for (; open; open &= open - 1) {
            const int64_t k = i + __builtin_ctz(open), first = k << TL_SEGMENT_BITS;
            const int64_t end = min64(first + (1 << TL_SEGMENT_BITS), width);
            if (row_beats(row, first, end, depths, is_farthest))
                bounds[k] = depth;
            else if (!row_beats(row, max64(first, col0), min64(end, col1), depths, is_farthest))
                return 0;
        }
    }
    return 1;
}

/* Whether every depth of a rectangle beats `depth`; `bounds` may be NULL. */
TL_INLINE int all_beat(const float *depths, int64_t stride_px, float *bounds, int64_t row0, int64_t row1, int64_t col0,
                       int64_t col1, float depth, int is_farthest)
{
    const int64_t n_segments = tl_segments(stride_px);
    const int has_bounds = bounds && col1 - col0 >= TL_LEAST_BOUNDED;
    for (int64_t row = row0; row < row1 && col0 < col1; row++) {
        const float *p = depths + row * stride_px;
        if (has_bounds ? !bounded_row_beats(p, bounds + row * n_segments, stride_px, col0, col1, depth, is_farthest)
                       : !row_beats(p, col0, col1, vf_set1(depth), is_farthest))
            return 0;
    }
    return 1;
}

#endif
