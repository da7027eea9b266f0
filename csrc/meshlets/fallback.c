/* Triangles of meshlets that lanes of 16 bits do not draw: large ones, slivers, and all of a meshlet that near or far
 * may cut, or that is very close to the eye.
 * In: a meshlet and a bit for each of its triangles.  Out: the target's buffers, by the kernels that draw any mesh; the
 * names of triangles with special corners. */
#ifndef TL_FALLBACK_C
#define TL_FALLBACK_C

#include <stdint.h>
#include <string.h>

#include "clusters.h"
#include "topleft.h"
#include "lanes/halves.h"
#include "meshlets/batch.h"

#if TL_HAS_HALVES

static __attribute__((noinline)) void draw_fallback(meshlet_batch *s, const tl_meshlet *m, const uint64_t *which)
{
    enum { TAIL = TL_CLUSTER_TAIL };
    const tl_meshlet_pass *pass = s->pass;
    float points32[3 * (TL_MESHLET_VERTICES + TAIL)];
    double points64[3 * (TL_MESHLET_VERTICES + TAIL)];
    tl_vertex vertices[TL_MESHLET_VERTICES + TAIL];
    int32_t triangles[3 * (TL_MESHLET_ROOM + TL_MAX_LANES)], names[TL_MESHLET_ROOM + TL_MAX_LANES];
    int64_t n = 0;
    for (int i = 0; i < TL_MESHLET_VERTICES; i++)
        points32[3 * i] = m->x[i], points32[3 * i + 1] = m->y[i], points32[3 * i + 2] = m->z[i];
    memset(points32 + 3 * TL_MESHLET_VERTICES, 0, 3 * TAIL * sizeof *points32);
    for (int i = 0; s->is_f64 && i < 3 * (TL_MESHLET_VERTICES + TAIL); i++)
        points64[i] = (double)points32[i];
    tl_source source = *pass->source;
    source.data = s->is_f64 ? (const void *)points64 : (const void *)points32;
    source.n = TL_MESHLET_VERTICES + TAIL;
    pass->kernels->project(&source, 0, TL_MESHLET_VERTICES, pass->view, &(tl_projected){.records = vertices});
    for (int i = 0; i < TL_MESHLET_ROOM; i++) {
        if (!(which[i >> 6] >> (i & 63) & 1) || m->corners[0][i] == m->corners[1][i]) /* or an empty one */
            continue;
        int is_special = 0;
        for (int k = 0; k < 3; k++) {
            triangles[3 * n + k] = m->corners[k][i];
            is_special |= vertices[m->corners[k][i]].x_fx == TL_SPECIAL;
        }
        names[n] = m->names[i];
        if (is_special)
            s->others[s->n_others++] = names[n];
        else
            n++;
    }
    if (!n)
        return;
    memset(triangles + 3 * n, 0, 3 * TL_MAX_LANES * sizeof *triangles);
    const tl_snapped snapped = {
        .mesh = {.vertices = vertices,
                 .n_vertices = TL_MESHLET_VERTICES,
                 .sample_x_fx = pass->sample_x_fx,
                 .sample_y_fx = pass->sample_y_fx},
        .triangles = triangles,
        .n_triangles = n,
        .cull = pass->seen->cull,
        .first_id = s->first_id,
        .names = names,
    };
    tl_window window = *pass->window;
    tl_target target = *pass->target;
    const int64_t first = (int64_t)s->row0 * s->stride_px;
    window.y_px += s->row0, window.height = s->row1 - s->row0;
    target.pixels = (int32_t *)target.pixels + first, target.depth += first, target.bounds = NULL;
    tl_slice slice = {.end = n};
    pass->kernels->draw_mesh(&snapped, &window, &target, &slice);
}

#endif
#endif
