/* The functions that lower files call of higher ones, and all of them: a sink is compiled into the walkers and into the
 * lanes, so that inner loops have it as a constant, and two sinks are rooms of their own.  A file that includes this
 * and draws for such a sink must be compiled together with the file that defines it: they are in one unit. */
#ifndef TL_HOOKS_H
#define TL_HOOKS_H

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"

/* TL_SINK_BLEND, in blend/mix_shapes.c: the colours of the pixels [at, at + n). */
struct blend_state;
static void mix_run(struct blend_state *b, int64_t at, int64_t n);

/* TL_SINK_SPANS, in large_shapes/row_spans.c: the n samples from `at` on are covered. */
struct span_table;
static void note_span(struct span_table *t, int64_t at, int64_t n);

#endif
