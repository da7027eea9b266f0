/* The two geometries, of which each walker has copies: vertices that are snapped (batch.c), and vertices that are not
 * (exact/setup_exact.c).  A geometry is a constant wherever it is a parameter, as a sink is: what the other one needs
 * is in no copy.
 *
 * Here: the types of TL_FLOAT, and what walkers ask of either; hooks.h has what rows.c calls of exact/. */
#ifndef TL_GEOMETRY_H
#define TL_GEOMETRY_H

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "raster/batch.c"

typedef enum { TL_FIXED, TL_FLOAT } tl_geometry;

/* A queue of boxes, and X * Y of each extent. */
typedef struct exact_queue {
    box_queue boxes;
    float xy[TL_QUEUE + TL_MAX_LANES];
} exact_queue;

/* Everything that one pass over a mesh needs; on the stack of draw_exact. */
typedef struct exact_state {
    const tl_snapped *mesh; /* with the triangles that are drawn */
    const tl_exact_points *points;
    const tl_window *window;
    const tl_target *target;
    tl_exact_counts *counts;
    tl_share *share;
    int64_t left, top, right, bottom; /* picture pixels */
    double centre_x, centre_y;        /* of a pixel's sample, from its upper left corner; of squares 0 */
    vi last_vertex;
    int64_t bad_row;    /* of triangles, -1: none so far */
    int has_places;     /* of vertices, and all of the window lies within their limit */
    int may_be_on_grid; /* the triangles that asked last were: of so many vectors, that is looked at first */
    exact_queue small, middle, rows;
    int n_slivers; /* triangles of the queues that have no depth plane, and wait to be drawn by themselves */
    int32_t slivers[4 * (TL_QUEUE + TL_MAX_LANES)];
    fragment_list fragments;
} exact_state;

/* TL_LANES triangles, turned so that their areas are positive. */
typedef struct lane_exact {
    vi ids;
    vd x[3], y[3], z[3];           /* z: where there is depth */
    tl_test test;                  /* a constant where the sink is */
    vd sample_x, sample_y;         /* the first sample of the box, in the picture; of squares the upper left corner */
    vf e[3], dx[3], dy[3];         /* edge functions there, and what a row adds and a column subtracts */
    vf xy;                         /* X * Y */
    vf from_x[3], from_y[3], band; /* of boxes of up to 4x4: points from the first sample, and the band of samples */
    vi sample;                     /* the first sample: row * stride_px + column */
    vm live;                       /* of those that are there, the ones with an area, and that are not culled */
    vm turned;                     /* corners 1 and 2 have changed places in e, dx and dy */
    vm to_turn;                    /* and are still to do so in x and y */
    vm on_grid;                    /* e, dx and dy are exact, in units of their own */
} lane_exact;

/* z = (z0 + slope_y * (y - y0)) + slope_x * (x - x0), in pixels from corner 0. */
typedef struct {
    vd z0, slope_x, slope_y;
} exact_planes;

/* The state of the pass that the geometry says. */
typedef union {
    batch_state *fixed;
    exact_state *floats;
} walk_state;

/* What a walker asks of either. */
TL_INLINE const tl_snapped *mesh_of(walk_state s, tl_geometry g)
{
    return g == TL_FIXED ? s.fixed->snapped : s.floats->mesh;
}
TL_INLINE const tl_target *target_of(walk_state s, tl_geometry g)
{
    return g == TL_FIXED ? s.fixed->target : s.floats->target;
}
TL_INLINE box_queue *middle_queue(walk_state s, tl_geometry g)
{
    return g == TL_FIXED ? &s.fixed->middle : &s.floats->middle.boxes;
}
TL_INLINE box_queue *rows_queue(walk_state s, tl_geometry g)
{
    return g == TL_FIXED ? &s.fixed->rows : &s.floats->rows.boxes;
}

/* From sample to sample, in units of depth planes: half sub-pixels, or pixels. */
TL_INLINE double plane_step(walk_state s, tl_geometry g)
{
    return g == TL_FIXED ? (double)(2 << s.fixed->window->subpixel_bits) : 1.0;
}

#endif
