/* Declares the functions that sink.c calls in higher folders: a sink is compiled into the walkers and lanes, so that it
 * is a constant of inner loops, and two sinks have folders of their own.  A file that includes this header and draws
 * for such a sink must be compiled in one unit with the file that defines the function. */
#ifndef TL_HOOKS_H
#define TL_HOOKS_H

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"

/* TL_SINK_BLEND, in blend/mix_shapes.c: blends the colours of the pixels [at, at + n). */
struct blend_state;
static void mix_run(struct blend_state *b, int64_t at, int64_t n);

/* TL_SINK_SPANS, in large_shapes/row_spans.c: lists n covered samples from `at` on. */
struct span_table;
static void note_span(struct span_table *t, int64_t at, int64_t n);

#endif
