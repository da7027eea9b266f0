/* Area: the exact area of each pixel that the triangles of a mesh cover, added up over the triangles.
 * In: vertex records and triangles.  Out: float32 pixels.
 *
 * Triangles become edges, edges become differences in cells (ramp.c), and one pass over the rows sums these
 * (accumulate.c): the cost grows with the edges, not with the area.  Sums are integers, so order, threads and vectors
 * do not matter, and where a mesh tiles the plane they are exactly 2^24. */
#ifndef TL_AREA_C
#define TL_AREA_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "raster/triangles_fixed.c"
#include "area/accumulate.c"
#include "area/ramp.c"

#define TL_MAX_EDGE_BITS 14 /* pixels of an edge in lanes: see the error bound of ramp.c */
#define TL_SHORT_ROWS 8
/* Pixels for each triangle: then most runs of pixels meet no edge.  31 scenes of 1 to 500 triangles of 51 to 1,536 px
 * gain 1.46 on the median, AVX2 of a Zen 3. */
#define TL_SPARSE_PX 4096
#define TL_EDGE_QUEUE 112

/* The largest extent of an edge in lanes, in units. */
static inline int32_t max_edge_extent(int bits)
{
    return 1 << (bits + TL_MAX_EDGE_BITS < 25 ? bits + TL_MAX_EDGE_BITS : 25);
}

/* Whether lanes can process an edge. */
static inline int is_lane_edge(int64_t x0, int64_t y0, int64_t x1, int64_t y1, int32_t max_extent)
{
    const int64_t limit = (int64_t)1 << 30;
    return x0 > -limit && x0 < limit && x1 > -limit && x1 < limit && min64(y0, y1) > -limit && max64(y0, y1) < limit &&
           max64(x1 - x0, x0 - x1) <= max_extent && max64(y1 - y0, y0 - y1) <= max_extent;
}

/* The queues of edges, until a vector is full: edges of 1 to 8 rows, or more; that cross up to 2 columns a row, up to
 * 6, or more.  The last queue is for edges without effect: horizontal, or outside. */
enum {
    TL_EDGES_LONG = TL_SHORT_ROWS,
    TL_EDGES_FLAT = TL_SHORT_ROWS + 1,
    TL_EDGES_SHALLOW = 2 * TL_EDGES_FLAT,
    TL_EDGES_NONE,
    TL_EDGE_KINDS
};

typedef struct {
    area_plane plane;
    const tl_snapped *snapped;
    const tl_window *window;
    const tl_slice *slice;
    int64_t bad_row;
    int32_t max_extent;
    int32_t n[TL_EDGE_KINDS];
    edge_record edges[TL_EDGE_KINDS][TL_EDGE_QUEUE];
} area_state;

TL_ONCE void flush_kind(area_plane *plane, const edge_record *edges, int kind, int n)
{
    if (kind == TL_EDGES_SHALLOW)
        add_shallow_edges(plane, edges, n);
    else if (kind < TL_EDGES_LONG)
        add_short_edges(plane, 1, edges, n, kind + 1);
    else if (kind == TL_EDGES_LONG)
        add_steep_edges(plane, edges, n);
    else if (kind < TL_EDGES_FLAT + TL_EDGES_LONG)
        add_short_edges(plane, 2, edges, n, kind - TL_EDGES_FLAT + 1);
    else
        add_flat_edges(plane, edges, n);
}

/* Draws the whole vectors of a queue and keeps the rest; at the end of the mesh draws the rest, too. */
static void flush_edges(area_state *s, int kind, int is_end)
{
    int n = s->n[kind];
    const int n_rest = is_end ? 0 : n % TL_LANES;
    n -= n_rest;
    for (int k = n; is_end && k < n + TL_LANES; k++) /* below the window: without height */
        s->edges[kind][k] = (edge_record){0, s->plane.bottom_fx, 0, 1};
    if (n > 0 && (kind == TL_EDGES_LONG || kind >= TL_EDGES_FLAT + TL_EDGES_LONG))
        tl_count_work(s->window, 8 * n * s->window->height); /* at most as long as eight pixels in each row */
    if (n > 0)
        flush_kind(&s->plane, s->edges[kind], kind, n);
    memmove(s->edges[kind], s->edges[kind] + n, sizeof(edge_record) * (size_t)n_rest);
    s->n[kind] = n_rest;
}

static void make_room_for_edges(area_state *s)
{
    for (int kind = 0; kind < TL_EDGES_NONE; kind++)
        if (s->n[kind] > TL_EDGE_QUEUE - 4 * TL_MAX_LANES)
            flush_edges(s, kind, 0);
    s->n[TL_EDGES_NONE] = 0;
}

/* Converts one edge of a triangle of positive area (y down) to a record for lanes.  Its kind depends on the edge alone,
 * so that triangles that share it agree.  Returns the kind, TL_EDGES_NONE where it adds nothing; or -1 if it does not
 * fit lanes: it is then drawn here. */
static int take_edge(area_plane *p, int32_t max_extent, int64_t x0, int64_t y0, int64_t x1, int64_t y1,
                     edge_record *record)
{
    const int sign = y0 < y1 ? -1 : 1; /* the interior is right of upward edges */
    if (sign > 0) {
        const int64_t x = x0, y = y0;
        x0 = x1, y0 = y1, x1 = x, y1 = y;
    }
    if (!is_lane_edge(x0, y0, x1, y1, max_extent)) {
        add_exact_edge(p, x0, y0, x1, y1, sign);
        return -1;
    }
    const int32_t dx = (int32_t)(x1 - x0), dy = (int32_t)(y1 - y0), width = dx < 0 ? -dx : dx;
    *record = (edge_record){(int32_t)x0, (int32_t)y0, dx, sign * dy};
    if (dy == 0 || y0 >= p->bottom_fx || y1 <= p->top_fx || min64(x0, x1) >= p->right_fx)
        return TL_EDGES_NONE;
    const int64_t rows = ((y1 - 1) >> p->bits) - (y0 >> p->bits);
    return width > 6 * dy ? TL_EDGES_SHALLOW : (int)min64(rows, TL_EDGES_LONG) + (width > 2 * dy ? TL_EDGES_FLAT : 0);
}

static void push_edge(area_state *s, int64_t x0, int64_t y0, int64_t x1, int64_t y1)
{
    edge_record record;
    const int kind = take_edge(&s->plane, s->max_extent, x0, y0, x1, y1, &record);
    if (kind < 0)
        tl_count_work(s->window, 16 * s->window->height);
    else
        s->edges[kind][s->n[kind]++] = record;
}

static void push_triangle(area_state *s, const tl_vertex_set *set, const int32_t *corners)
{
    tl_triangle t;
    const int sign = load_triangle(set, corners, &t);
    if (is_culled(sign, s->snapped->cull))
        return;
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        push_edge(s, t.x_fx[k], t.y_fx[k], t.x_fx[next], t.y_fx[next]);
    }
    make_room_for_edges(s);
}

/* Pushes the edges of triangle i, or of its pieces, by itself. */
static __attribute__((noinline)) void push_alone(area_state *s, int64_t i)
{
    int32_t own[3];
    const triangle_parts parts = parts_of(s->snapped, i, own);
    for (int k = 0; k < parts.n; k++)
        push_triangle(s, &parts.set, parts.corners + 3 * k);
}

/* TL_LANES edges from their upper ends on; edges in `on` add to areas in the window. */
typedef struct {
    vi x0, y0, dx, dy, width;
    vm on, is_up; /* is_up: the edge runs from its lower end to its upper end */
} area_edges;

TL_INLINE area_edges edges_between(const area_plane *p, vi ax, vi ay, vi bx, vi by, vm live)
{
    const vm is_up = vi_gt(ay, by);
    const vi x0 = vi_select(is_up, bx, ax), x1 = vi_select(is_up, ax, bx), y0 = vi_min(ay, by), y1 = vi_max(ay, by);
    const vi zero = vi_set1(0), dx = vi_sub(x1, x0), dy = vi_sub(y1, y0);
    const vm meets_rows = vm_and(vi_gt(vi_set1(p->bottom_fx), y0), vi_gt(y1, vi_set1(p->top_fx)));
    const vm on =
        vm_and(vm_and(live, vi_gt(dy, zero)), vm_and(meets_rows, vi_gt(vi_set1(p->right_fx), vi_min(x0, x1))));
    return (area_edges){x0, y0, dx, dy, vi_max(dx, vi_sub(zero, dx)), on, is_up};
}

/* Appends edges to the queues of their kinds.  `height`: dy, negative where the area right of the edge is
 * subtracted. */
TL_INLINE void queue_edges(area_state *s, const area_edges *e, vm on, vi height)
{
    const int bits = s->plane.bits;
    const vi dy2 = vi_add(e->dy, e->dy), last = vi_sub(vi_add(e->y0, e->dy), vi_set1(1));
    vi kind = vi_min(vi_sub(vi_shift_right(last, bits), vi_shift_right(e->y0, bits)), vi_set1(TL_EDGES_LONG));
    kind = vi_select(vi_gt(e->width, dy2), vi_add(kind, vi_set1(TL_EDGES_FLAT)), kind);
    kind = vi_select(vi_gt(e->width, vi_add(dy2, vi_shift_left(dy2, 1))), vi_set1(TL_EDGES_SHALLOW), kind);
    kind = vi_select(on, kind, vi_set1(TL_EDGES_NONE));
    int32_t kinds[TL_LANES], records[4 * TL_LANES];
    vi_store(kinds, kind);
    vi_store_quads(records, (const vi[4]){e->x0, e->y0, e->dx, height});
    for (int lane = 0; lane < TL_LANES; lane++) /* no branch: edges without effect are queued and dropped */
        v4_store(&s->edges[kinds[lane]][s->n[kinds[lane]]++].x_fx, v4_load(records + 4 * vi_quad_slot(lane)));
}

/* Queues the edges of the triangles in `drawn`; those in `turned` have negative area. */
TL_INLINE void push_edges(area_state *s, const lane_corners *c, vm drawn, vm turned)
{
    const vi zero = vi_set1(0), one = vi_set1(1);
    const vi down = vi_select(turned, one, vi_set1(-1)); /* the sign of a downward edge */
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const area_edges e = edges_between(&s->plane, c->x[k], c->y[k], c->x[next], c->y[next], drawn);
        const vi sign = vi_select(e.is_up, vi_sub(zero, down), down);
        queue_edges(s, &e, e.on, vi_select(vi_gt(sign, zero), e.dy, vi_sub(zero, e.dy)));
    }
    make_room_for_edges(s);
}

/* Setup and cull of the triangles [i, i + TL_LANES). */
TL_INLINE void push_batch(area_state *s, int64_t i, const int32_t *corners, vm live)
{
    const area_plane *p = &s->plane;
    if (has_bad_index(corners, vi_set1((int32_t)(s->snapped->mesh.n_vertices - 1)))) {
        s->bad_row = i;
        return;
    }
    lane_corners c;
    load_in_order(s->snapped, corners, &c);
    const lane_extents e = extents_of(&c);
    const vm single = vm_and(live, is_single(&e, vi_set1(s->max_extent), TL_SPECIAL));
    for (unsigned lanes = vm_bits(single); lanes && !tl_is_given_up(s->window); lanes &= lanes - 1)
        push_alone(s, slice_id(s->slice, i + __builtin_ctz(lanes)));
    const vm meets_rows = vm_and(vi_gt(vi_set1(p->bottom_fx), e.y_min), vi_gt(e.y_max, vi_set1(p->top_fx)));
    /* heights are whole numbers of units: the edges of a triangle left of the window add up to 0 there */
    const vm meets_cols = vm_and(vi_gt(vi_set1(p->right_fx), e.x_min), vi_gt(e.x_max, vi_set1(p->left_fx)));
    vm drawn = vm_and(vm_and_not(live, single), vm_and(meets_rows, meets_cols));
    if (!vm_any(drawn))
        return;
    vm is_negative;
    drawn = vm_and(drawn, find_unculled(&c, s->snapped->cull, &is_negative));
    if (vm_any(drawn))
        push_edges(s, &c, drawn, is_negative);
}

static void place_plane(const tl_window *window, const tl_area *area, area_plane *p)
{
    const int bits = window->subpixel_bits;
    const int64_t far = (int64_t)1 << 30, beyond = (int64_t)1 << 29; /* beyond narrow edges and the widest window */
    p->cells = area->is_wide ? NULL : area->cells;
    p->wide_cells = area->is_wide ? area->cells : NULL;
    p->stride = (int32_t)tl_area_stride(window->width);
    p->n_cols = (int32_t)window->width;
    p->n_rows = (int32_t)window->height;
    p->x_px = window->x_px;
    p->y_px = window->y_px;
    p->left_px = clamp32(window->x_px, -far - beyond, far);
    p->top_px = clamp32(window->y_px, -far - beyond, far);
    p->top_fx = clamp32(window->y_px * ((int64_t)1 << bits), -far, far);
    p->bottom_fx = clamp32((window->y_px + window->height) * ((int64_t)1 << bits), -far, far);
    p->left_fx = clamp32(window->x_px * ((int64_t)1 << bits), -far, far);
    p->right_fx = clamp32((window->x_px + window->width) * ((int64_t)1 << bits), -far, far);
    p->bits = bits;
    p->is_sparse = 0;
    p->n_waiting = 0;
    p->seen = v4_zero();
}

static int64_t draw_area(const tl_snapped *snapped, const tl_window *window, const tl_slice *slice,
                         const tl_area *target)
{
    const int64_t n = slice->end, n_pixels = window->width * window->height;
    area_state s;
    place_plane(window, target, &s.plane);
    s.plane.is_sparse = n < n_pixels / TL_SPARSE_PX;
    s.snapped = snapped, s.window = window, s.slice = slice, s.bad_row = -1;
    s.max_extent = max_edge_extent(window->subpixel_bits);
    memset(s.n, 0, sizeof s.n);
    int32_t corners[3 * TL_LANES];
    for (int64_t i = 0; i < n && s.bad_row < 0 && !tl_is_given_up(window); i += TL_LANES) {
        tl_count_work(window, TL_SETUP_PX * TL_LANES);
        push_batch(&s, i, slice_corners(snapped, slice, i, corners), vm_first(n - i));
    }
    for (int kind = 0; kind < TL_EDGES_NONE; kind++)
        flush_edges(&s, kind, 1);
    flush_quads(&s.plane);
    const int fits = accumulate(&s.plane, target);
    return s.bad_row >= 0 ? s.bad_row : fits ? -1 : TL_AREA_OVERFLOW;
}

#endif
