/* Looks at every row end of a snapped triangle: the code of raster/row_edges.h beside division of integers.
 * In: the range [FIRST, END) of heights |dy| of an edge, in sub-pixels.  Out: 1 if a row end is wrong.
 *
 * An edge function v at the first sample of a row ends the row at floor(v / d).  All v with |v / d| < 64 are tried, and
 * one v beyond on either side: sums, products and floor are monotone, so all v farther out are clamped as it is. */
#include <stdlib.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "raster/row_edges.h"

enum { COLUMNS = 62 };

/* Whether lanes have row ends other than those of floor(v / d) = quotient, as far as columns of the box see it. */
TL_INLINE vm differs(vi v, int32_t d, int32_t quotient)
{
    const vi e[3] = {v, v, vi_set1(0)}, dx[3] = {vi_set1(0), vi_set1(0), vi_set1(0)};
    const vi dy[3] = {vi_set1(-d), vi_set1(d), vi_set1(0)}, n_cols = vi_set1(COLUMNS), zero = vi_set1(0);
    const int32_t left = -quotient, right = quotient + 1;
    lane_edges edges;
    vi begin, end;
    vm doubted = vm_first(0);
    sort_fixed_edges(e, dx, dy, &edges);
    next_row(TL_FIXED, &edges, n_cols, &begin, &end, &doubted);
    const vi first = vi_set1(left < 0 ? 0 : left > COLUMNS ? COLUMNS : left);
    const vi last = vi_set1(right < 0 ? 0 : right > COLUMNS ? COLUMNS : right);
    const vm agree = vm_and(vi_eq(vi_min(begin, n_cols), first), vi_eq(vi_max(end, zero), last));
    return vm_and_not(vm_all(), agree);
}

int main(int argc, char **argv)
{
    const int32_t first = argc == 3 ? atoi(argv[1]) : 1, end = argc == 3 ? atoi(argv[2]) : 1;
    vm wrong = vm_first(0);
    for (int32_t d = first; d < end; d++) {
        for (int32_t quotient = -64; quotient < 64; quotient++)
            for (int32_t r = 0; r < d; r += TL_LANES) /* the last vector tries its largest v again */
                wrong = vm_or(
                    wrong, differs(vi_add(vi_set1(quotient * d), vi_min(vi_add(vi_iota(), vi_set1(r)), vi_set1(d - 1))),
                                   d, quotient));
        wrong = vm_or(wrong, vm_or(differs(vi_set1(64 * d), d, 64), differs(vi_set1(-64 * d - 1), d, -65)));
    }
    return vm_any(wrong);
}
