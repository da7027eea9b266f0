/* Meshlets of a mesh with float32 coordinates, for processors that permute bytes, and a pass
 * that draws them.  Part of the contract of topleft.h, which includes it behind the types that it uses. */
#include "topleft.h" /* before the guard: it includes this file behind its types */

#ifndef TOPLEFT_MESHLETS_H
#define TOPLEFT_MESHLETS_H

#define TL_MESHLET_VERTICES 64
#define TL_MESHLET_GROWN 96 /* triangles that a meshlet grows to */
#define TL_MESHLET_ROOM 128 /* triangles that it holds with the empty ones */

/* Triangles 2k and 2k + 1 share an edge and lie on its two sides; one without a partner has one of no area. */
typedef struct {
    float x[TL_MESHLET_VERTICES], y[TL_MESHLET_VERTICES], z[TL_MESHLET_VERTICES];
    uint8_t corners[3][TL_MESHLET_ROOM];
    int32_t names[TL_MESHLET_ROOM]; /* which triangle of the mesh each is */
} tl_meshlet;

/* Rows of bounds: the middle of a ball and its radius; the axis of the normals, the cosine and the sine of their cone;
 * the least of twice the area over the longest side, and the least longest side. */
enum {
    TL_BOUND_X,
    TL_BOUND_Y,
    TL_BOUND_Z,
    TL_BOUND_RADIUS,
    TL_BOUND_AXIS_X,
    TL_BOUND_AXIS_Y,
    TL_BOUND_AXIS_Z,
    TL_BOUND_COS,
    TL_BOUND_SIN,
    TL_BOUND_HEIGHT,
    TL_BOUND_SIDE,
    TL_N_BOUNDS
};

/* Triangles that are grown into meshlets at a time, and bytes of scratch for that. */
#define TL_GROW_PIECE 65536
#define TL_GROW_ROOM (TL_GROW_PIECE * 105 + 64)

#define TL_SLOT_PX 128        /* a side of the window that vertices of a meshlet are measured from */
#define TL_MAX_DRAWN_PX 16384 /* a side of the window */
#define TL_MESHLET_TAIL 16    /* bounds and counts that must be readable behind the last */

typedef struct {
    const tl_meshlet *meshlets;
    const float *bounds;        /* TL_N_BOUNDS rows of n_meshlets + TL_MESHLET_TAIL */
    const uint8_t *n_triangles; /* (n_meshlets + TL_MESHLET_TAIL,): with the empty ones */
    int64_t n_meshlets;
    double largest[3]; /* absolute coordinate of each axis */
} tl_meshlets;

/* Which side of a meshlet shows: its back, in the middle at least; both, or that is not certain. */
enum { TL_SIDE_BACK = 1, TL_SIDE_BOTH = 2 };

/* A meshlet that a view may show: the left column and the row below the window of 128 pixels that its vertices are
 * measured from, in the window that is drawn, and how many columns and rows it reaches from the middle of that. */
typedef struct {
    int32_t meshlet;
    int16_t left_px, below_px, reach_x, reach_y;
    int16_t n_triangles, side;
    float depth; /* no sample of it is drawn nearer, or, where the farthest stays, farther */
} tl_seen_meshlet;

/* How meshlets are seen and drawn.  Of pixels, rows [0, height) of the window; the picture lies within 2^14 pixels of
 * the window's corner. */
typedef struct {
    const tl_meshlets *mesh;
    const tl_cluster_view *seen;
    const tl_source *source; /* its matrix; no vertices */
    const tl_view *view;
    const tl_window *window;
    const tl_target *target;   /* NEAREST, FARTHEST */
    const tl_kernels *kernels; /* draw triangles that are large, or need draw_fallback */
    int32_t first_id;
    int32_t sample_x_fx, sample_y_fx; /* where in a pixel it is sampled, from the centre */
} tl_meshlet_pass;

/* The kernels of the unit that is compiled for AVX-512 with VBMI alone. */
typedef struct {
    /* Grows triangles order[first] to order[end - 1] into meshlets: at most tl_most_meshlets of them, with a record of
     * TL_N_BOUNDS numbers each.  `numbers`: (n_vertices,), negative; room: TL_GROW_ROOM bytes.  Returns how many. */
    int64_t (*grow)(const tl_source *source, const int32_t *triangles, const int32_t *order, int64_t first, int64_t end,
                    int32_t *numbers, void *room, tl_meshlet *out, float *records, uint8_t *n_triangles);

    /* Lists meshlets [first, end) that the window may show, and in `fallback` the others; returns how many of the
     * first there are.  Both have room for all. */
    int64_t (*list)(const tl_meshlet_pass *pass, int64_t first, int64_t end, tl_seen_meshlet *seen, int32_t *fallback,
                    int64_t *n_fallback);

    /* Draws the listed meshlets, rows [row0, row1) of the window, cleared first if `is_first`.  `others`, a number for
     * each triangle, gets those that clip planes may cut, or that 64 bits cannot hold; returns how many. */
    int64_t (*draw)(const tl_meshlet_pass *pass, const tl_seen_meshlet *seen, int64_t n_seen, const int32_t *fallback,
                    int64_t n_fallback, int32_t row0, int32_t row1, int is_first, tl_seen_meshlet *sorted,
                    int32_t *others);
} tl_meshlet_kernels;

/* The most meshlets that n triangles are grown into. */
static inline int64_t tl_most_meshlets(int64_t n) { return n / 20 + 2 * (n / TL_GROW_PIECE) + 8; }

#endif
