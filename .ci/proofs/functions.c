/* Looks at 2^a and log2 of light (shade/light.c, shade/texture.c), and at unsigned sums as float32 (lanes/), for all
 * float32 that matter, beside float64.
 * In: "exp2", "log2" or "unsigned".  Out: 1 if an error is 2^-22 or more of the result, or a conversion is another. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "shade/light.c"

#define LEAST 0x1p-22

static int is_off(vf got, const double *wanted, const double *bound)
{
    float lanes[TL_MAX_LANES];
    vf_store(lanes, got);
    for (int k = 0; k < TL_LANES; k++)
        if (!(fabs((double)lanes[k] - wanted[k]) < bound[k])) {
            printf("%a instead of %a\n", (double)lanes[k], wanted[k]);
            return 1;
        }
    return 0;
}

/* All a from -1/2 to 1/2, for 2^a is the power of the rest times an exact power of two; and the rest of other a. */
static int look_at_exp2(void)
{
    for (int32_t bits = 0; bits <= 0x3f000000; bits += TL_LANES)
        for (int sign = 0; sign < 2; sign++) {
            float a[TL_MAX_LANES];
            double wanted[TL_MAX_LANES], bound[TL_MAX_LANES];
            if (bits < 0x30000000) /* below 2^-31: as 0 */
                bits = 0x30000000;
            for (int k = 0; k < TL_LANES; k++) {
                const int32_t own = bits + k;
                memcpy(a + k, &own, 4), a[k] = sign ? -a[k] : a[k];
                wanted[k] = exp2((double)a[k]), bound[k] = LEAST * wanted[k];
            }
            if (is_off(vf_exp2(vf_load(a)), wanted, bound))
                return 1;
        }
    for (int i = -126 * 256; i <= 127 * 256; i++) {
        const double a = i / 256.0, wanted[TL_MAX_LANES] = {[0 ... TL_MAX_LANES - 1] = exp2(a)};
        const double bound[TL_MAX_LANES] = {[0 ... TL_MAX_LANES - 1] = LEAST * exp2(a)};
        if (is_off(vf_exp2(vf_set1((float)a)), wanted, bound))
            return 1;
    }
    return vm_any(vf_lt(vf_set1(0.0f), vf_exp2(vf_set1(-0x1.fa0002p+6f))));
}

/* All a from sqrt(1/2) to sqrt(2), and each of them times all powers of two. */
static int look_at_log2(void)
{
    for (int32_t bits = 0x3f3504f3; bits < 0x3fb504f3; bits += TL_LANES) {
        float a[TL_MAX_LANES];
        double first[TL_MAX_LANES], wanted[TL_MAX_LANES], bound[TL_MAX_LANES];
        for (int k = 0; k < TL_LANES; k++) {
            const int32_t own = bits + k;
            memcpy(a + k, &own, 4);
            first[k] = log2((double)a[k]), bound[k] = LEAST * fabs((double)a[k] - 1.0) + 1e-300;
        }
        if (is_off(vf_log2(vf_load(a)), first, bound))
            return 1;
        for (int exponent = -125; exponent <= 127; exponent++) {
            if (exponent == 0)
                continue;
            for (int k = 0; k < TL_LANES; k++)
                wanted[k] = first[k] + exponent, bound[k] = LEAST * fabs(wanted[k]);
            if (is_off(vf_log2(vf_mul(vf_load(a), vf_set1(ldexpf(1.0f, exponent)))), wanted, bound))
                return 1;
        }
    }
    return 0;
}

static int look_at_unsigned(void)
{
    for (uint64_t first = 0; first < (uint64_t)1 << 32; first += TL_LANES) {
        const vi a = vi_add(vi_set1((int32_t)(uint32_t)first), vi_iota());
        float got[TL_MAX_LANES];
        uint32_t numbers[TL_MAX_LANES];
        vf_store(got, vf_from_unsigned(a)), vi_store((int32_t *)numbers, a);
        for (int k = 0; k < TL_LANES; k++)
            if (got[k] != (float)numbers[k])
                return 1;
    }
    return 0;
}

int main(int argc, char **argv)
{
    if (argc != 2)
        return 2;
    return argv[1][0] == 'e' ? look_at_exp2() : argv[1][0] == 'l' ? look_at_log2() : look_at_unsigned();
}
