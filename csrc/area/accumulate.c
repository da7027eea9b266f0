/* Accumulate: one pass over the rows that sums the cells from the left, writes the sums as float32 and clears the
 * cells.
 * In: cells (ramp.c).  Out: pixels, and whether every sum is right.
 *
 * 32 bits hold sums below 192.  A cell is below 2^30 units.  So a sum that leaves [-2^-4, 192 - 2^-4) first has the two
 * upper bits of sum + 2^20 set, before it can wrap: the overflow is detected, and the mesh is drawn again in 64 bits,
 * with equal results wherever both are right.
 *
 * Based on: R. Levien, font-rs, 2015. */
#ifndef TL_ACCUMULATE_C
#define TL_ACCUMULATE_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "area/ramp.c"

#define TL_SUM_MARGIN (1 << 20) /* rounding may give a few units less than 0 */
/* Pixels of a run that is tested as a whole: inside of a shape it is filled. */
#define TL_RUN_LANES (4 * TL_LANES)
#define TL_SUM_UNIT (1.0f / (1 << TL_AREA_BITS))

/* Sums are unsigned, except those just below 0. */
TL_INLINE vf area_of_sums(vi sums, int is_clamped)
{
    const vi one = vi_set1(1 << TL_AREA_BITS);
    const vi positive = vi_select(vi_gt_unsigned(sums, vi_set1(-TL_SUM_MARGIN - 1)), vi_set1(0), sums);
    if (is_clamped)
        return vf_mul(vf_from_vi(vi_select(vi_gt_unsigned(positive, one), one, positive)), vf_set1(TL_SUM_UNIT));
    return vf_mul(vf_from_unsigned(positive), vf_set1(TL_SUM_UNIT));
}

/* Bit 31 is set where a sum is near the end of its range. */
TL_INLINE vi sum_alarm(vi sums)
{
    const vi shifted = vi_add(sums, vi_set1(TL_SUM_MARGIN));
    return vi_and(shifted, vi_add(shifted, shifted));
}

/* The sum of the four cells left of column 0.  Only the whole sum is an area; partial sums may have any value. */
TL_INLINE vi left_sum(int32_t *row, vi *seen)
{
    int64_t sum = 0;
    for (int k = TL_CELL_PAD - 4; k < TL_CELL_PAD; k++)
        sum += (int64_t)row[k] - TL_CELL_ZERO;
    if (sum < -TL_SUM_MARGIN || sum >= ((int64_t)3 << 30) - TL_SUM_MARGIN)
        *seen = vi_set1(INT32_MIN);
    for (int k = 0; k < TL_CELL_PAD; k += TL_LANES)
        vi_store(row + k, vi_set1(TL_CELL_ZERO));
    return vi_set1((int32_t)(uint32_t)sum);
}

/* The sums of the next TL_LANES cells; the first n are pixels.  Cells right of the window may have any value, because
 * edges are clamped there. */
TL_INLINE vi accumulate_lanes(int32_t *cells, int64_t n, vi *carry, vi *seen)
{
    const vi bias = vi_set1(TL_CELL_ZERO), sums = vi_add(vi_prefix_sum(vi_sub(vi_load(cells), bias)), *carry);
    const vi alarm = sum_alarm(sums);
    vi_store(cells, bias);
    *carry = vi_last(sums);
    *seen = vi_or(*seen, n >= TL_LANES ? alarm : vi_select(vm_first(n), alarm, vi_set1(0)));
    return sums;
}

/* A masked store costs 20 cycles on AMD with AVX2: only for the last vector of a row. */
TL_INLINE void store_areas(float *out, int64_t n, vf areas)
{
    if (n >= TL_LANES)
        vf_store(out, areas);
    else
        vf_store_masked(out, vm_first(n), areas);
}

/* Whether no edge meets the cells of a run in two rows. */
TL_INLINE int is_clear(const int32_t *a, const int32_t *b)
{
    const vi bias = vi_set1(TL_CELL_ZERO);
    vi met = vi_set1(0);
    for (int k = 0; k < TL_RUN_LANES; k += TL_LANES)
        met = vi_or(met, vi_or(vi_xor(vi_load(a + k), bias), vi_xor(vi_load(b + k), bias)));
    return !vm_any(vi_gt_unsigned(met, vi_set1(0)));
}

TL_INLINE void fill_areas(float *out, vf areas)
{
    for (int k = 0; k < TL_RUN_LANES; k += TL_LANES)
        vf_store(out + k, areas);
}

/* Two rows at a time hide the latency of the carry. */
TL_INLINE int accumulate_narrow(const area_plane *plane, const tl_area *target, int is_clamped)
{
    const int64_t stride = plane->stride, n_cols = plane->n_cols;
    vi seen = vi_set1(0);
    for (int64_t row = 0; row < plane->n_rows; row += 2) {
        const int64_t below = row + 1 < plane->n_rows ? row + 1 : row;
        int32_t *a = plane->cells + row * stride + TL_CELL_PAD, *b = plane->cells + below * stride + TL_CELL_PAD;
        float *out_a = target->pixels + row * target->stride_px, *out_b = target->pixels + below * target->stride_px;
        vi carry_a = left_sum(a - TL_CELL_PAD, &seen), carry_b = left_sum(b - TL_CELL_PAD, &seen);
        const int looks = plane->is_sparse && below != row;
        for (int64_t col = 0, end; col < n_cols; col = end) {
            end = min64(col + TL_RUN_LANES, n_cols);
            if (looks && end - col == TL_RUN_LANES && is_clear(a + col, b + col)) {
                fill_areas(out_a + col, area_of_sums(carry_a, is_clamped));
                fill_areas(out_b + col, area_of_sums(carry_b, is_clamped));
                continue;
            }
            for (int64_t k = col; k < end; k += TL_LANES) {
                const vi sums_a = accumulate_lanes(a + k, n_cols - k, &carry_a, &seen);
                const vf area_a = area_of_sums(sums_a, is_clamped);
                if (below != row) {
                    const vi sums_b = accumulate_lanes(b + k, n_cols - k, &carry_b, &seen);
                    store_areas(out_b + k, n_cols - k, area_of_sums(sums_b, is_clamped));
                }
                store_areas(out_a + k, n_cols - k, area_a);
            }
        }
        for (int64_t col = n_cols / TL_LANES * TL_LANES; col < stride - TL_CELL_PAD; col += TL_LANES) {
            vi_store(a + col, vi_set1(TL_CELL_ZERO));
            vi_store(b + col, vi_set1(TL_CELL_ZERO));
        }
    }
    return !vm_any(vi_gt(vi_set1(0), seen));
}

static void accumulate_wide(const area_plane *plane, const tl_area *target)
{
    for (int64_t row = 0; row < plane->n_rows; row++) {
        int64_t *cells = plane->wide_cells + row * plane->stride, sum = 0;
        for (int64_t k = TL_CELL_PAD - 4; k < TL_CELL_PAD; k++)
            sum += cells[k];
        for (int64_t col = 0; col < plane->n_cols; col++) {
            sum += cells[TL_CELL_PAD + col];
            const int64_t positive = max64(sum, 0);
            const int64_t shown = target->is_clamped ? min64(positive, 1 << TL_AREA_BITS) : positive;
            target->pixels[row * target->stride_px + col] = (float)shown * TL_SUM_UNIT;
        }
        memset(cells, 0, sizeof *cells * (size_t)plane->stride);
    }
}

/* Returns whether the pixels are right; the cells are clear afterwards in any case. */
static int accumulate(const area_plane *plane, const tl_area *target)
{
    if (target->is_wide) {
        accumulate_wide(plane, target);
        return 1;
    }
    int32_t seen[4];
    v4_store(seen, plane->seen);
    const int fits = target->is_clamped ? accumulate_narrow(plane, target, 1) : accumulate_narrow(plane, target, 0);
    return fits && (seen[0] | seen[1] | seen[2] | seen[3]) >= 0;
}

#endif
