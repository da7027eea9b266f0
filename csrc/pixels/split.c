/* Split: lists the pixels whose samples show different triangles; all other pixels show the triangle of their first
 * sample.
 * In: ids and depth of each sample of a band of rows.  Out: the columns of split pixels, the ids and depths of their
 * samples; from these the ids of every pixel. */
#ifndef TL_SPLIT_C
#define TL_SPLIT_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"

static int64_t split_pixels(const tl_seen_samples *seen, const tl_split *split, int64_t at)
{
    const int n_others = (1 << seen->sample_bits) - 1;
    for (int64_t row = 0; row < seen->n_rows; row++) {
        const int64_t left = row * seen->first_stride + seen->col0;
        split->rows[2 * (seen->row0 + row)] = at;
        for (int64_t x = 0; x < seen->n_cols; x += TL_LANES) {
            const vm inside = vm_first(seen->n_cols - x);
            const int32_t *const others = seen->ids + row * seen->stride + x;
            const float *const depths = seen->depth + row * seen->stride + x;
            const vi own = vi_load_masked(inside, seen->first_ids + left + x);
            vm same = inside;
            for (int k = 0; k < n_others; k++)
                same = vm_and(same, vi_eq(own, vi_load_masked(inside, others + k * seen->plane)));
            const vm is_split = vm_and_not(inside, same);
            if (!vm_any(is_split))
                continue;
            vi_compress(split->columns + at, is_split, vi_add(vi_set1((int32_t)(seen->col0 + x)), vi_iota()));
            for (int k = 0; k < n_others; k++) {
                const int64_t to = k * split->room + at, from = k * seen->plane;
                vi_compress(split->ids + to, is_split, vi_load_masked(inside, others + from));
                vi_compress((int32_t *)split->depth + to, is_split,
                            vi_load_masked(inside, (const int32_t *)depths + from));
            }
            at += __builtin_popcount(vm_bits(is_split));
        }
        split->rows[2 * (seen->row0 + row) + 1] = at;
    }
    return at;
}

static void spread_ids(const tl_split *split, int k, int64_t n_rows, int64_t width, const int32_t *first_ids,
                       int32_t *ids)
{
    const int32_t *own = split->ids + (k - 1) * split->room;
    memcpy(ids, first_ids, (size_t)(n_rows * width) * sizeof *ids);
    for (int64_t row = 0; row < n_rows; row++, ids += width)
        for (int64_t at = split->rows[2 * row]; at < split->rows[2 * row + 1]; at++)
            ids[split->columns[at]] = own[at];
}

#endif
