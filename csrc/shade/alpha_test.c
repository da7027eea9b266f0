/* Alpha test: draws alpha-tested triangles over a visibility buffer or over layers.  Samples with too little opacity
 * are discarded, so that surfaces behind them stay visible.
 * In: the buffer of all other triangles, a list of triangles.  Out: the buffer, the nearest remaining sample in every
 * pixel.
 *
 * A triangle is drawn by itself into a tile, then tested pixel by pixel: the order of the list does not matter. */
#ifndef TL_ALPHA_TEST_C
#define TL_ALPHA_TEST_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "exact/sign.c"
#include "sink/peel.c"
#include "raster/raster.c"
#include "pixels/runs.c"
#include "pixels/shading.h"
#include "shade/full.c"
#include "shade/shade_pixels.c"
#include "shade/span_list.c"
#include "shade/texture.c"

#define TL_CUTOUT_TILE 64

typedef struct {
    int32_t ids[TL_CUTOUT_TILE * TL_CUTOUT_TILE];
    float depth[TL_CUTOUT_TILE * TL_CUTOUT_TILE];
} cutout_tile;

/* The opacity of a material at the pixels of a run. */
TL_INLINE vf opacity_of(shaded_lanes *p, const tl_material *m)
{
    vf texel[4], opacity = vf_set1(m->color[3]);
    if (!p->s->needs_q)
        return opacity;
    p->q = weighed(p, RUN_Q, RUN_Q + 1, RUN_Q + 2);
    p->inv_q = vf_div(vf_set1(1.0f), p->q);
    if (p->s->needs_more)
        set_more(p);
    if (m->texture) {
        if (p->s->needs_uv)
            set_uv_lanes(p);
        laid_texture laid;
        laid.as = (const tl_texture *)0;
        look_up(p, m->texture, &laid, texel, 4);
        opacity = vf_mul(texel[3], opacity);
    }
    return p->s->needs_alpha ? vf_mul(p->alpha, opacity) : opacity;
}

/* The target of alpha-tested triangles. */
typedef struct {
    const tl_target *target; /* NEAREST or PEEL */
    tl_snapped snapped;      /* as the target's, but its first id is 0 */
    int32_t first_id;        /* the first id in the target */
    cutout_tile tile;
} cutout;

/* Removes those of n pixels of a row that the buffer occludes. */
TL_INLINE void hide_nearest(const cutout *c, int n, int32_t *own, const float *own_depth, int64_t to)
{
    const int32_t *ids = (const int32_t *)c->target->pixels + to;
    const float *depth = c->target->depth + to;
    for (int x = 0; x < n; x += TL_LANES) {
        const vm inside = vm_first(n - x);
        const vi id = vi_load_masked(inside, own + x), there = vi_load_masked(inside, ids + x);
        const vf z = vf_load_masked(inside, own_depth + x), z_there = vf_load_masked(inside, depth + x);
        const vi name = vi_add(id, vi_set1(c->first_id));
        const vm is_tie = vm_and(vf_eq(z, z_there), vm_or(vi_gt(vi_set1(0), there), vi_gt(there, name)));
        const vm wins = vm_and(vm_and(inside, vi_gt(id, vi_set1(-1))), vm_or(vf_lt(z, z_there), is_tie));
        vi_store_masked(own + x, inside, vi_select(wins, id, vi_set1(-1)));
    }
}

/* Tests n pixels of a row of a tile, and stores the remaining pixels in the target, from pixel `to` on. */
TL_INLINE void keep_opaque(cutout *c, shade_runs *s, const tl_material *m, int64_t row, int64_t column, int n,
                           int64_t from, int64_t to)
{
    int32_t *own = c->tile.ids + from;
    const float *own_depth = c->tile.depth + from;
    const int is_nearest = c->target->sink == TL_SINK_NEAREST;
    if (is_nearest)
        hide_nearest(c, n, own, own_depth, to);
    find_runs(s, own, n, column);
    if (!s->n_runs)
        return;
    set_runs(s, row);
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
        if (!s->visible[i])
            continue;
        shaded_lanes p;
        find_pixels(&p, s, i, column);
        const vm is_opaque = vm_and(p.visible, vf_ge(opacity_of(&p, m), vf_set1(m->cutoff)));
        if (!vm_any(is_opaque))
            continue;
        const int32_t name = s->ints[RUN_ID][TL_LANES] + c->first_id; /* all runs show one triangle */
        const vf z = vf_load_masked(is_opaque, own_depth + x);
        if (is_nearest) {
            vi_store_masked((int32_t *)c->target->pixels + to + x, is_opaque, vi_set1(name));
            vf_store_masked(c->target->depth + to + x, is_opaque, z);
        } else {
            peel_lanes(c->target, to + x, is_opaque, z, name);
        }
    }
}

/* The pixels of a window from `start` on that contain the interval from low to high, and one more on each side. */
static void find_pixels_around(double low, double high, int64_t start, int64_t size, int64_t *first, int64_t *end)
{
    const double most = (double)size;
    *first = (int64_t)fmin(fmax(floor(low) - (double)start - 1.0, 0.0), most);
    *end = (int64_t)fmin(fmax(ceil(high) - (double)start + 1.0, 0.0), most);
}

/* Sets the box of a window that a triangle can reach; 0 if it is empty. */
static int find_cut_box(const tl_vertex_set *set, const int32_t *corners, const tl_window *window, tl_triangle *t)
{
    t->col0 = 0, t->col1 = window->width, t->row0 = 0, t->row1 = window->height;
    if (is_clipped(set, corners))
        return 1;
    if (!set->exact)
        return load_triangle(set, corners, t) && clip_box(t, window);
    const exact_point a = point_of(set->exact, corners[0]), b = point_of(set->exact, corners[1]);
    const exact_point c = point_of(set->exact, corners[2]);
    const double left = fmin(a.x, fmin(b.x, c.x)), right = fmax(a.x, fmax(b.x, c.x));
    const double top = fmin(a.y, fmin(b.y, c.y)), bottom = fmax(a.y, fmax(b.y, c.y));
    find_pixels_around(left, right, window->x_px, window->width, &t->col0, &t->col1);
    find_pixels_around(top, bottom, window->y_px, window->height, &t->row0, &t->row1);
    return t->col0 < t->col1 && t->row0 < t->row1;
}

/* Draws one triangle, tile by tile of the box that it can reach. */
static void cut_triangle(cutout *c, shade_runs *s, const tl_window *window, int32_t id)
{
    const tl_shading *shading = s->shading;
    const int32_t material = shading->material_of ? shading->material_of[id] : 0;
    tl_triangle t;
    int32_t corners[3];
    read_corners(&c->snapped, id, corners);
    if (!find_cut_box(&c->snapped.mesh, corners, window, &t))
        return;
    for (int64_t top = t.row0; top < t.row1; top += TL_CUTOUT_TILE)
        for (int64_t left = t.col0; left < t.col1; left += TL_CUTOUT_TILE) {
            tl_window part = *window;
            part.x_px += left, part.y_px += top;
            part.width = min64(TL_CUTOUT_TILE, t.col1 - left), part.height = min64(TL_CUTOUT_TILE, t.row1 - top);
            const tl_target target = {
                .sink = TL_SINK_PAINT, .pixels = c->tile.ids, .depth = c->tile.depth, .stride_px = TL_CUTOUT_TILE};
            tl_slice slice = {.ids = &id, .end = 1, .is_first = 1, .is_last = 1};
            draw_mesh(&c->snapped, &part, &target, &slice);
            for (int64_t row = 0; row < part.height; row++)
                keep_opaque(c, s, &shading->materials[material], top + row, left, (int)part.width, row * TL_CUTOUT_TILE,
                            (top + row) * c->target->stride_px + left);
        }
}

static void cut_out(const tl_snapped *snapped, const tl_window *window, const tl_view *view, const tl_shading *shading,
                    const int32_t *triangles, int64_t n, const tl_target *target)
{
    shade_runs s;
    cutout c;
    c.target = target, c.snapped = *snapped, c.first_id = snapped->first_id;
    c.snapped.first_id = 0;
    start_runs(&s, window, view);
    set_mesh(&s, &c.snapped, shading);
    s.needs_normal = s.needs_colors = s.needs_point = 0;
    s.needs_tangents[0] = s.needs_tangents[1] = 0;
    s.needs_alpha = shading->colors && shading->has_alpha;
    s.needs_more = s.needs_alpha || s.needs_uv1;
    s.needs_q = s.needs_uv || s.needs_more;
    for (int64_t k = 0; k < n; k++)
        cut_triangle(&c, &s, window, triangles[k]);
}

#endif
