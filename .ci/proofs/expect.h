/* What programs that look at all values share: a claim fails with its name, and the program ends with 1. */
#ifndef PROOFS_EXPECT_H
#define PROOFS_EXPECT_H

#include <stdio.h>
#include <stdlib.h>

#include "lanes/lanes.h"

static void expect(const char *claim, vi got, vi wanted)
{
    if (vm_any(vm_and_not(vm_all(), vi_eq(got, wanted)))) {
        printf("%s: a value is wrong\n", claim);
        exit(1);
    }
}

/* The lanes of a function of whole numbers from `first` on. */
#define FILL(name, first, expression)                     \
    vi name;                                              \
    do {                                                  \
        int32_t lanes[TL_MAX_LANES];                      \
        for (int32_t lane = 0; lane < TL_LANES; lane++) { \
            const int32_t a = (first) + lane;             \
            lanes[lane] = (int32_t)(expression);          \
        }                                                 \
        name = vi_load(lanes);                            \
    } while (0)

#endif
