/* Declares the function that sink.c calls in a higher folder: a sink is compiled into the walkers and lanes, so that it
 * is a constant of inner loops, and one sink has a folder.  A file that includes this header and draws for that sink
 * must be compiled in one unit with the file that defines the function. */
#ifndef TL_HOOKS_H
#define TL_HOOKS_H

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"

/* TL_SINK_BLEND, in blend/fill_shapes.c: the pixels [at, at + n) are covered. */
struct blend_state;
static void mix_run(struct blend_state *b, int64_t at, int64_t n);

#endif
