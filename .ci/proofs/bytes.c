/* Looks at every byte that mixing makes: the code of blend/mix_u8.c beside division of integers. */
#include "topleft.h"
#include "blend/mix_u8.c"
#include "expect.h"

static vi in_all_bytes(vi a) { return vi_or(in_both_halves(a), vi_shift_left(in_both_halves(a), 8)); }

static void divide(void)
{
    for (int32_t first = 0; first <= 255 * 255; first += TL_LANES) {
        FILL(x, first, a > 255 * 255 ? 0 : a);
        FILL(wanted, first, a > 255 * 255 ? 0 : (2 * a + 255) / 510);
        expect("divide_by_255", divide_by_255(in_both_halves(x)), in_both_halves(wanted));
    }
    for (int32_t first = 0; first <= 65536 * 255; first += TL_LANES) {
        FILL(x, first, a > 65536 * 255 ? 0 : a);
        FILL(wanted, first, a > 65536 * 255 ? 0 : (2 * (int64_t)a + 255) / 510);
        expect("divide_24_bits by 255", divide_24_bits(x, vi_set1(255)), wanted);
    }
}

static void mix(void)
{
    for (int32_t d = 0; d < 256; d++)
        for (int32_t s = 0; s < 256; s++) {
            const vi under = in_all_bytes(vi_set1(d)), over = in_all_bytes(vi_set1(s));
            for (int32_t first = 0; first < 256; first += TL_LANES) {
                FILL(alpha, first, a);
                FILL(wanted, first, (2 * (d * (255 - a) + s * a) + 255) / 510);
                expect("over_opaque", over_opaque(under, over, alpha), in_all_bytes(wanted));
            }
            for (int32_t first = 0; first <= 1 << 15; first += TL_LANES) {
                vi weight = vi_min(vi_add(vi_iota(), vi_set1(first)), vi_set1(1 << 15));
                const vi sum = vi_add(vi_mul(weight, vi_set1(s - d)), vi_set1((d << 15) + (1 << 14)));
                expect("move_bytes", move_bytes(under, over, weight), in_all_bytes(vi_shift_right(sum, 15)));
            }
        }
    for (int32_t alpha = 0; alpha < 256; alpha++)
        for (int32_t first = 0; first <= 1 << 15; first += TL_LANES) {
            const vi coverage = vi_min(vi_add(vi_iota(), vi_set1(first)), vi_set1(1 << 15));
            FILL(wanted, first, (2 * (int64_t)(a > 1 << 15 ? 1 << 15 : a) * alpha + 255) / 510);
            expect("weight_15", weight_15(coverage, vi_set1(alpha)), wanted);
        }
}

int main(void)
{
    divide(), mix();
    return 0;
}
