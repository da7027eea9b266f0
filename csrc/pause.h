/* What kernels ask now and then: whether to go on.  Part of the contract of topleft.h, which includes it. */
#ifndef TOPLEFT_PAUSE_H
#define TOPLEFT_PAUSE_H

#include <stdint.h>

typedef struct tl_pause {
    int64_t left_px;               /* about how many pixels are drawn before it asks again */
    int (*ask)(struct tl_pause *); /* sets left_px anew; unless it returns 0 the picture is given up */
} tl_pause;

/* Counts the work of a polygon with so many points and so many pixels in its box, as tl_count_work does. */
static inline void tl_count_polygon(tl_pause *pause, int64_t n_points, int64_t n_box_px)
{
    if (pause)
        pause->left_px -= 32 + 8 * n_points + n_box_px;
}

static inline int tl_is_polygon_given_up(tl_pause *pause) { return pause && pause->left_px < 0 && pause->ask(pause); }

#endif
