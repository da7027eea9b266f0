/* Shared by the classics: pixels out, points in whole pixels.
 *
 * In: pixel-space vertices, finite and within the method's limit.  Out: a window of the picture.  `plot` and `fill_span`
 * clamp to the window; `put` is for loops that are clamped already.  Nothing else writes. */
#ifndef CLASSIC_TARGET_H
#define CLASSIC_TARGET_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

/* Reports a step of a method, by steps.h: the kind, pixels x to last of row y, whether they are drawn, and the numbers
 * that decided it, whole or real.  Nothing, unless that file was included before. */
#ifndef CLASSIC_STEP
#define CLASSIC_STEP(t, kind, x, y, last, is_drawn, ...) ((void)0)
#define CLASSIC_REAL_STEP(t, kind, x, y, last, is_drawn, ...) ((void)0)
#endif

typedef enum { CLASSIC_MASK = 0, CLASSIC_COUNT = 1, CLASSIC_LABEL = 2 } classic_sink; /* Sink in options.py */

typedef struct {
    void *pixels; /* uint8 for MASK, int32 otherwise */
    classic_sink sink;
    int32_t label;               /* of the triangle being drawn */
    int64_t x0, y0, x1, y1;      /* window of the whole picture, pixels, half-open */
    struct classic_trace *trace; /* of steps.h alone */
} classic_target;

typedef struct {
    int64_t x, y;
} classic_point;

static inline int64_t smaller(int64_t a, int64_t b) { return a < b ? a : b; }
static inline int64_t larger(int64_t a, int64_t b) { return a > b ? a : b; }

/* A vertex truncated to its pixel. */
static inline classic_point truncated(const double *v) { return (classic_point){(int64_t)v[0], (int64_t)v[1]}; }

static inline void swap_points(classic_point *a, classic_point *b)
{
    const classic_point kept = *a;
    *a = *b, *b = kept;
}

/* Twice the signed area; |coordinate| < 2^29: each product is below 2^60. */
static inline int64_t cross_of_points(classic_point a, classic_point b, classic_point p)
{
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

/* The floor of a finite or infinite value, clamped before it becomes an integer. */
static inline int64_t pixel_floor(double value, int64_t smallest, int64_t largest)
{
    if (value <= (double)smallest)
        return smallest;
    return value >= (double)largest ? largest : (int64_t)floor(value);
}

/* Draws one pixel of the window. */
static inline void put(const classic_target *t, int64_t x, int64_t y)
{
    const int64_t i = (y - t->y0) * (t->x1 - t->x0) + x - t->x0;
    if (t->sink == CLASSIC_MASK)
        ((uint8_t *)t->pixels)[i] = 1;
    else if (t->sink == CLASSIC_COUNT)
        ((int32_t *)t->pixels)[i] += 1;
    else
        ((int32_t *)t->pixels)[i] = t->label;
}

/* Draws one pixel, if it lies in the window. */
static inline void plot(const classic_target *t, int64_t x, int64_t y)
{
    CLASSIC_STEP(t, CLASSIC_SPAN, x, y, x, 1, 0);
    if (t->x0 <= x && x < t->x1 && t->y0 <= y && y < t->y1)
        put(t, x, y);
}

/* Draws the pixels first to last of a row, both of them included. */
static inline void fill_span(const classic_target *t, int64_t y, int64_t first, int64_t last)
{
    CLASSIC_STEP(t, CLASSIC_SPAN, first, y, last, 1, 0);
    if (y < t->y0 || y >= t->y1)
        return;
    uint8_t *mask = t->pixels; /* bytes may overlay `t` itself: read it once, or there is no memset */
    int32_t *cells = t->pixels;
    const int32_t label = t->label;
    const int64_t row = (y - t->y0) * (t->x1 - t->x0) - t->x0;
    const int64_t start = row + larger(first, t->x0), end = row + smaller(last, t->x1 - 1) + 1;
    if (t->sink == CLASSIC_MASK)
        for (int64_t i = start; i < end; i++)
            mask[i] = 1;
    else if (t->sink == CLASSIC_COUNT)
        for (int64_t i = start; i < end; i++)
            cells[i] += 1;
    else
        for (int64_t i = start; i < end; i++)
            cells[i] = label;
}

#endif
