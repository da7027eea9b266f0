/* The steps of a method: the interface of steps.c to Python and to the module of WebAssembly. */
#ifndef CLASSIC_TRACE_H
#define CLASSIC_TRACE_H

#include <stdint.h>

/* A kind of step.  "triangle": a triangle is set up, (x, y) is its first pixel.  "test": a pixel is tested.  "row": a row
 * begins.  "line": the line of `side` passes a pixel.  "span": the pixels x to last are drawn.  `numbers`: the names of the
 * numbers that decide the step, with their counts; `n`: how many in all. */
typedef struct {
    const char *name, *side;
    int is_real;
    const char *numbers;
    int n;
} classic_kind;

extern const classic_kind CLASSIC_KINDS[]; /* the last has no name */

/* Draws counts over a cleared window (x, y, width, height), and writes the steps in the format of steps.h; methods beyond
 * the last of classics.h are the walkers of walks.h.  Returns how many steps there are: `words` holds all of them where it
 * has 24 words for each step, and 24 more for each triangle. */
int64_t trace_steps(int method, int form, int subpixel_bits, const double *vertices, int64_t stride,
                    const int32_t *triangles, int64_t n, const int64_t *window, int32_t *counts, int64_t *words,
                    int64_t n_words);

#endif
