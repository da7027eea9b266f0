/* The steps of a method: the interface of steps.c to Python and to the module of WebAssembly. */
#ifndef CLASSIC_TRACE_H
#define CLASSIC_TRACE_H

#include <stdint.h>

/* A kind of step.  "triangle": it is set up, (x, y) the first of its pixels.  "test": a pixel is asked.  "row": a row begins.
 * "line": a line of that side passes a pixel.  "span": the pixels x to last are drawn.  Then the names of the numbers that
 * decide it, how many each has, and how many that makes. */
typedef struct {
    const char *name, *side;
    int is_real;
    const char *numbers;
    int n;
} classic_kind;

extern const classic_kind CLASSIC_KINDS[]; /* up to one without a name */

/* Draws counts over a cleared window (x, y, width, height), and writes the steps, as steps.h says; a number of a method
 * behind the last one of classics.h: the walkers of walks.h.  Returns how many steps there are: there is room for all of
 * them where the words hold 24 of each, and 24 more of each triangle. */
int64_t trace_steps(int method, int form, int subpixel_bits, const double *vertices, int64_t stride,
                    const int32_t *triangles, int64_t n, const int64_t *window, int32_t *counts, int64_t *words,
                    int64_t n_words);

#endif
