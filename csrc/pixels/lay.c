/* Lay: copies rows that were drawn in a cached buffer to the picture, with non-temporal stores.
 * In: some columns of a band of rows.  Out: all columns of these rows. */
#ifndef TL_LAY_C
#define TL_LAY_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"

#define TL_LINE 16 /* numbers in a cache line */

/* How many numbers come before the next cache line. */
TL_INLINE int64_t until_line(const int32_t *p) { return (int64_t)((0 - (uintptr_t)p / sizeof *p) % TL_LINE); }

/* Writes the numbers [k, end) of a row through the caches: `drawn`, or `blanks` if that is NULL. */
TL_INLINE void lay_near(int32_t *to, const int32_t *drawn, int64_t k, int64_t end, vi blanks)
{
    for (; k + TL_LANES <= end; k += TL_LANES)
        vi_store(to + k, drawn ? vi_load(drawn + k) : blanks);
    if (k < end)
        vi_store_masked(to + k, vm_first(end - k), drawn ? vi_load_masked(vm_first(end - k), drawn + k) : blanks);
}

/* Writes n numbers of a row.  Only whole cache lines are stored non-temporally: partial lines are far slower. */
TL_INLINE void lay_row(int32_t *to, const int32_t *drawn, int64_t n, int32_t blank)
{
    const vi blanks = vi_set1(blank);
    const int64_t first = min64(until_line(to), n), end = first + (n - first) / TL_LINE * TL_LINE;
    lay_near(to, drawn, 0, first, blanks);
    for (int64_t k = first; k < end; k += TL_LANES)
        vi_stream(to + k, drawn ? vi_load(drawn + k) : blanks);
    lay_near(to, drawn, end, n, blanks);
}

static void lay_rows(const tl_laid_rows *rows, int32_t *to, int64_t width)
{
    const int64_t end = rows->col0 + rows->n_cols;
    for (int64_t row = 0; row < rows->n_rows; row++, to += width) {
        lay_row(to, 0, rows->col0, rows->blank);
        lay_row(to + rows->col0, rows->drawn + row * rows->stride, rows->n_cols, rows->blank);
        lay_row(to + end, 0, width - end, rows->blank);
    }
    end_stream();
}

#endif
