/* Looks at every number whose bits are spread: clusters/cluster_sort.c and base/sort_pairs.h. */
#include "topleft.h"
#include "base/sort_pairs.h"
#include "clusters/cluster_sort.c"

/* The bits of a number, `apart` places from each other. */
static int64_t spread(int64_t a, int apart)
{
    int64_t bits = 0;
    for (int k = 0; k < 16; k++)
        bits |= (a >> k & 1) << k * apart;
    return bits;
}

int main(void)
{
    for (uint32_t a = 0; a < 1u << 10; a++)
        if (spread_bits(a) != (uint32_t)spread(a, 3))
            return 1;
    for (int64_t a = 0; a < 1 << 16; a++)
        if (interleave_zeros(a) != spread(a, 2))
            return 1;
    return 0;
}
