/* The functions that lower files call of higher ones, and all of them: a sink is compiled into the walkers and into the
 * lanes, so that inner loops know what they draw, and three sinks are rooms of their own.  What includes this file and
 * draws for such a sink must be compiled together with the file that defines it, as kernels.c does. */
#ifndef TL_HOOKS_H
#define TL_HOOKS_H

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"

/* TL_SINK_BLEND, in blend/mix_few.c: the colours of the pixels [at, at + n). */
struct blend_state;
static void mix_run(struct blend_state *b, int64_t at, int64_t n);

/* TL_SINK_SPANS, in few/row_spans.c: the n samples from `at` on are covered. */
struct span_table;
static void note_span(struct span_table *t, int64_t at, int64_t n);

/* TL_SINK_SAMPLES, in raster/sampled.c: what it does instead of batch.c and rows.c. */
struct batch_state;
struct lane_triangles;
static void draw_tiny_of_samples(struct batch_state *s, const struct lane_triangles *t, vm live, vi n_cols, vi n_rows);
static void flush_small_of_samples(struct batch_state *s);
static void flush_middle_of_samples(struct batch_state *s);
static void flush_rows_of_samples(struct batch_state *s);

/* TL_FLOAT, in exact/rows_exact.c: TL_LANES triangles at i in a queue of n, and what is in doubt, decided. */
struct box_queue;
struct exact_queue;
struct exact_state;
struct lane_exact;
struct row_ends;
struct row_lanes;
TL_INLINE void load_floats(struct exact_state *s, tl_sink sink, const struct exact_queue *queue, int i, int n,
                           float far, struct lane_exact *t, struct row_lanes *r);
static void refine_middle_rows(struct exact_state *s, const struct box_queue *q, int i, struct lane_exact *t,
                               vm doubted, int n_rows, int32_t (*bits)[TL_MAX_LANES]);
static void refine_row_ends(struct exact_state *s, int i, int k, const struct lane_exact *t, int row0, unsigned doubted,
                            struct row_ends *ends);
static vm try_grid(struct exact_state *s, struct lane_exact *t, int of_boxes);

#endif
