/* Data that the stages of drawing share: meshlets of a batch with their vertices snapped, queues, the list of samples.
 *
 * Units: a grid of 2^-8 px, whatever the picture's sub-pixels are, at most 8 bits: those of a coarser grid are
 * multiples.  x runs to the right, y upwards, from the left end of the row below the meshlet's own window of 128 x 128
 * pixels: so both are positive 16-bit numbers, and an edge keeps its zero (the top-left rule) where the pair
 * x | y << 16 of its end is less than that of its start.  A triangle that shows its drawn side is counter-clockwise. */
#ifndef TL_MESHLET_BATCH_H
#define TL_MESHLET_BATCH_H

#include <stdint.h>

#include "clusters.h"
#include "meshlets.h"
#include "topleft.h"
#include "lanes/halves.h"
#include "lanes/lanes.h"

#if TL_HAS_HALVES

#define TL_PX_BITS 8
#define TL_PX (1 << TL_PX_BITS)
#define TL_MAX_LANE_PX 62 /* rows of boxes of 16 bits: row ends in float32 are exact up to here, as in rows.c */

#define TL_BATCH 8 /* meshlets; 1 and 16 are 6 % slower at 10,000,000 triangles */
#define TL_FRAGMENTS_KEPT 2048
#define TL_FRAGMENTS_WRITTEN 512 /* from so many on they are written at the end of a batch */
#define TL_PREFETCH_FRAGMENTS 16
#define TL_LANE_QUEUE (2 * TL_MESHLET_ROOM + 32)

/* A meshlet of a batch. */
typedef struct {
    vi pairs[4];   /* x | y << 16 of the vertices */
    vi x[2], y[2]; /* the same apart, plus the offset that rounds them to samples */
    int32_t z_low[TL_MESHLET_VERTICES] __attribute__((aligned(64))),
        z_high[TL_MESHLET_VERTICES] __attribute__((aligned(64)));
    const tl_meshlet *meshlet;
    const uint8_t *corners[3]; /* in the order in which the drawn side is counter-clockwise */
    uint8_t turned[2][TL_MESHLET_ROOM]
        __attribute__((aligned(64))); /* the last two of them, where triangles show one side or the other */
    tl_seen_meshlet at;
    int32_t name0;     /* place of its names among all words of the mesh */
    int32_t base;      /* sample of the left end of the lowest row of its window */
    int32_t low, high; /* the samples that are drawn, of its window: column | row << 16 */
    int n_triangles;
    int n_one, n_tiny, n_larger, n_covered;
    uint8_t one[TL_MESHLET_ROOM + 64], tiny[TL_MESHLET_ROOM + 64], larger[TL_MESHLET_ROOM + 64];
    int32_t covered[TL_MESHLET_ROOM + 64]; /* column | triangle << 8 | row << 16 | samples << 24 */
    uint64_t fallback[2];                  /* a bit for each triangle for draw_fallback */
} meshlet_slot;

/* Triangles with boxes over 2x2, their corners measured from the first sample of the box: the lowest at the left. */
typedef struct {
    int n;
    int32_t v0[TL_LANE_QUEUE], v1[TL_LANE_QUEUE], v2[TL_LANE_QUEUE];
    int32_t sample[TL_LANE_QUEUE], size[TL_LANE_QUEUE], triangle[TL_LANE_QUEUE];
} lane_queue;

/* The state of one pass over rows of the window; on the stack of draw_meshlets. */
typedef struct {
    const tl_meshlet_pass *pass;
    const tl_meshlet *meshlets;
    int32_t *ids;
    float *depth;
    int32_t stride_px, width, row0, row1;
    int32_t first_id;
    int is_farthest, fine_bits; /* bits that the grid is finer than the picture's sub-pixels */
    int is_f64;                 /* whether vertices are transformed in float64, by the second matrix */
    float matrix[16];
    double matrix64[16];
    double scale_x, scale_y, x_fx, y_fx; /* of the picture's middle, in the window */
    int is_zero_to_one;
    int32_t *others;
    int64_t n_others;
    int n_slots;
    meshlet_slot slots[TL_BATCH];
    int is_too_far; /* vertices, for 32-bit numbers */
    int32_t wide_x[TL_MESHLET_VERTICES] __attribute__((aligned(64))),
        wide_y[TL_MESHLET_VERTICES] __attribute__((aligned(64)));
    int n_fragments; /* sample, place of the name, depth */
    int32_t sample[TL_FRAGMENTS_KEPT + 64], name[TL_FRAGMENTS_KEPT + 64];
    float fragment_depth[TL_FRAGMENTS_KEPT + 64];
    lane_queue small, middle, rows;
} meshlet_batch;

/* ---- sixteen triangles of a meshlet ------------------------------------------------------------------------- */

/* The corners of triangles with numbers in the lowest bytes of the lanes. */
TL_INLINE void pick_corners(const meshlet_slot *s, vi triangle, vi *corner)
{
    for (int k = 0; k < 3; k++)
        corner[k] = vi_pick_bytes(s->corners[k], triangle);
}

TL_INLINE vi pick_pairs(const meshlet_slot *s, vi vertex)
{
    return vi_select(vi_any_bit(vertex, vi_set1(32)), vi_pick_of(s->pairs[2], vertex, s->pairs[3]),
                     vi_pick_of(s->pairs[0], vertex, s->pairs[1]));
}

TL_INLINE vd pick_depths(const meshlet_slot *s, vi vertex)
{
    return vd_of_words(vi_pick_64(s->z_low, vertex), vi_pick_64(s->z_high, vertex));
}

/* The sample at a column and row of the meshlet's window. */
TL_INLINE vi place_of_sample(vi sample) { return vi_or(vh_shift_left(sample, TL_PX_BITS), vi_set1(0x00800080)); }

/* The edge function from one corner to the next at the point that both are measured from. */
TL_INLINE vi edge_at(vi from, vi to) { return vi_dot_pairs(from, vi_turn_pairs(to)); }

/* The same less one unless the edge keeps its zero: when the next pair is less. */
TL_INLINE vi less_bias(vi e, vi from, vi to) { return vi_select(vi_gt(from, to), e, vi_sub(e, vi_set1(1))); }

#endif
#endif
