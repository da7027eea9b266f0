/* Looks at the whole roots of points/cloud.c, 0 <= a <= 2^60: at the first and the last a of each root.  Between the two,
 * sqrt of float64 is monotone and corrected by one, so a root that is right at both is right at all. */
#include <inttypes.h>
#include <stdio.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "points/cloud.c"

int main(void)
{
    for (int64_t root = 0; root < (int64_t)1 << 30; root++)
        if (floor_root(root * root) != root || floor_root(root * (root + 2)) != root) {
            printf("the root %" PRId64 " is wrong\n", root);
            return 1;
        }
    return floor_root((int64_t)1 << 60) != (int64_t)1 << 30;
}
