/* Grows meshlets: sets of triangles that share vertices, at most 64 of them.
 * In: triangles along a curve.  Out: meshlets, with the bounds that measure.c finds of each.
 *
 * A piece of the curve at a time, so that look-ups stay in a near cache: the triangles round each vertex, how
 * many of them are free.  A meshlet begins with the next free triangle.  It then takes triangles that need no new
 * vertex; then of those that need one the nearest to its middle with few other free triangles at the new vertex, so
 * that none are left over that lie alone. */
#ifndef TL_GROW_C
#define TL_GROW_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "clusters.h"
#include "meshlets.h"
#include "topleft.h"
#include "meshlets/measure.c"
#include "meshlets/pair.c"

#define TL_MAX_CANDIDATES 4096 /* of a meshlet; the others are found along the curve */
#define TL_MAX_JUMP 256        /* along the curve, to a triangle that shares no vertex */
#define TL_LEAST_GROWN 20      /* triangles of a meshlet with 64 vertices that no two of them share */
#define TL_LIVE_WEIGHT 0.1f    /* of a free triangle at the new vertex, against the distance from the middle */
#define TL_DISTANCE_WEIGHT 0.02f

/* A piece of the curve: triangles by their place in it, and vertices by when it first met them. */
typedef struct {
    int64_t n_triangles, n_vertices;
    int32_t *corners;        /* (n_triangles, 3) */
    float *points;           /* (n_vertices, 3) */
    int32_t *starts, *round; /* triangles round[starts[i]] to round[starts[i + 1] - 1] meet at vertex i */
    int32_t *n_free;         /* of the triangles at each vertex */
    int32_t *vertex_stamp;   /* the last meshlet that each vertex is in, and its number there */
    uint8_t *local;
    int32_t *triangle_stamp; /* the last meshlet that each triangle has met, and how many of its vertices that lacks */
    uint8_t *n_lacking, *is_used;
} grow_piece;

static grow_piece place_piece(void *room)
{
    const int64_t n = TL_GROW_PIECE, n_vertices = 3 * n;
    grow_piece p = {.corners = room};
    p.points = (float *)(p.corners + 3 * n);
    p.starts = (int32_t *)(p.points + 3 * n_vertices);
    p.round = p.starts + n_vertices + 2;
    p.n_free = p.round + 3 * n;
    p.vertex_stamp = p.n_free + n_vertices;
    p.triangle_stamp = p.vertex_stamp + n_vertices;
    p.local = (uint8_t *)(p.triangle_stamp + n);
    p.n_lacking = p.local + n_vertices;
    p.is_used = p.n_lacking + n;
    return p;
}

/* Numbers the vertices of the triangles that `order` lists.  `numbers` has one for each vertex of the mesh, less than
 * `first_number` where this piece has not met it. */
static void number_vertices(const tl_source *source, const int32_t *triangles, const int32_t *order, int32_t *numbers,
                            int32_t first_number, grow_piece *p)
{
    const float *points = source->data;
    p->n_vertices = 0;
    for (int64_t i = 0; i < p->n_triangles; i++) {
        const int32_t *t = triangles + 3 * (int64_t)order[i];
        for (int k = 0; k < 3; k++) {
            if (numbers[t[k]] < first_number) {
                memcpy(p->points + 3 * p->n_vertices, points + 3 * (int64_t)t[k], 3 * sizeof *points);
                numbers[t[k]] = first_number + (int32_t)p->n_vertices++;
            }
            p->corners[3 * i + k] = numbers[t[k]] - first_number;
        }
        /* never drawn: no area in any picture */
        p->is_used[i] = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    }
}

static void list_round(grow_piece *p)
{
    memset(p->n_free, 0, (size_t)p->n_vertices * sizeof *p->n_free);
    memset(p->vertex_stamp, 0, (size_t)p->n_vertices * sizeof *p->vertex_stamp);
    memset(p->triangle_stamp, 0, (size_t)p->n_triangles * sizeof *p->triangle_stamp);
    for (int64_t i = 0; i < p->n_triangles; i++)
        for (int k = 0; k < 3 && !p->is_used[i]; k++)
            p->n_free[p->corners[3 * i + k]]++;
    int32_t sum = 0;
    for (int64_t i = 0; i < p->n_vertices; i++) { /* where each ends: filling moves that to where it starts */
        sum += p->n_free[i];
        p->starts[i] = sum;
    }
    p->starts[p->n_vertices] = sum;
    for (int64_t i = 0; i < p->n_triangles; i++)
        for (int k = 0; k < 3 && !p->is_used[i]; k++)
            p->round[--p->starts[p->corners[3 * i + k]]] = (int32_t)i;
}

/* A meshlet that grows. */
typedef struct {
    int32_t number; /* from 1 on, in its piece */
    int n_vertices, n_triangles;
    int32_t vertices[TL_MESHLET_VERTICES]; /* of the piece */
    int n_whole, n_near;                   /* triangles that lack no vertex, and one */
    int32_t whole[TL_MAX_CANDIDATES], near_by[TL_MAX_CANDIDATES];
    float sum[3], area; /* of its vertices, of its triangles */
} grown_meshlet;

static void add_vertex(grow_piece *p, grown_meshlet *m, int32_t vertex)
{
    p->vertex_stamp[vertex] = m->number;
    p->local[vertex] = (uint8_t)m->n_vertices;
    m->vertices[m->n_vertices++] = vertex;
    for (int k = 0; k < 3; k++)
        m->sum[k] += p->points[3 * (int64_t)vertex + k];
    for (int32_t i = p->starts[vertex]; i < p->starts[vertex + 1]; i++) {
        const int32_t t = p->round[i];
        if (p->is_used[t])
            continue;
        if (p->triangle_stamp[t] != m->number)
            p->triangle_stamp[t] = m->number, p->n_lacking[t] = 3;
        p->n_lacking[t]--;
        if (p->n_lacking[t] == 1 && m->n_near < TL_MAX_CANDIDATES)
            m->near_by[m->n_near++] = t;
        if (p->n_lacking[t] == 0 && m->n_whole < TL_MAX_CANDIDATES)
            m->whole[m->n_whole++] = t;
    }
}

static void add_triangle(grow_piece *p, grown_meshlet *m, int32_t triangle, tl_meshlet *out, const int32_t *order)
{
    const int32_t *t = p->corners + 3 * (int64_t)triangle;
    float a[3], b[3];
    p->is_used[triangle] = 1;
    for (int k = 0; k < 3; k++) {
        p->n_free[t[k]]--;
        if (p->vertex_stamp[t[k]] != m->number)
            add_vertex(p, m, t[k]);
        out->corners[k][m->n_triangles] = p->local[t[k]];
        a[k] = p->points[3 * (int64_t)t[1] + k] - p->points[3 * (int64_t)t[0] + k];
        b[k] = p->points[3 * (int64_t)t[2] + k] - p->points[3 * (int64_t)t[0] + k];
    }
    const float x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    m->area += 0.5f * sqrtf(x * x + y * y + z * z);
    out->names[m->n_triangles++] = order[triangle];
}

/* The triangle with one new vertex that suits a meshlet best, -1 if there is none; drops those that do no longer. */
static int32_t take_best(const grow_piece *p, grown_meshlet *m)
{
    const float share = m->n_vertices ? 1.0f / (float)m->n_vertices : 0.0f;
    const float middle[3] = {m->sum[0] * share, m->sum[1] * share, m->sum[2] * share};
    const float scale = m->area > 0.0f ? TL_DISTANCE_WEIGHT * (float)m->n_triangles / m->area : 0.0f;
    float best_score = INFINITY;
    int best = -1;
    for (int k = 0; k < m->n_near; k++) {
        const int32_t t = m->near_by[k];
        if (p->is_used[t] || p->n_lacking[t] != 1) {
            m->near_by[k--] = m->near_by[--m->n_near];
            continue;
        }
        const int32_t *c = p->corners + 3 * (int64_t)t;
        const int32_t vertex = p->vertex_stamp[c[0]] != m->number   ? c[0]
                               : p->vertex_stamp[c[1]] != m->number ? c[1]
                                                                    : c[2];
        const float *at = p->points + 3 * (int64_t)vertex;
        const float x = at[0] - middle[0], y = at[1] - middle[1], z = at[2] - middle[2];
        const float score = (x * x + y * y + z * z) * scale + TL_LIVE_WEIGHT * (float)p->n_free[vertex];
        if (score < best_score)
            best_score = score, best = k;
    }
    if (best < 0)
        return -1;
    const int32_t found = m->near_by[best];
    m->near_by[best] = m->near_by[--m->n_near];
    return found;
}

/* Grows one meshlet from triangle `seed` on. */
static void grow_one(grow_piece *p, grown_meshlet *m, int64_t seed, int may_end_early, const int32_t *order,
                     tl_meshlet *out)
{
    int64_t next = seed;
    while (m->n_triangles < TL_MESHLET_GROWN) {
        int32_t t = -1;
        if (m->n_whole) {
            t = m->whole[--m->n_whole];
            if (p->is_used[t])
                continue;
        } else {
            if (m->n_vertices == TL_MESHLET_VERTICES)
                return;
            t = take_best(p, m);
        }
        if (t < 0) { /* nothing that shares two vertices: the next on the curve */
            while (next < p->n_triangles && p->is_used[next])
                next++;
            const int is_far = m->n_triangles && next > seed + TL_MAX_JUMP && may_end_early;
            if (next >= p->n_triangles || is_far || m->n_vertices + 3 > TL_MESHLET_VERTICES)
                return;
            t = (int32_t)next;
        }
        add_triangle(p, m, t, out, order);
    }
}

static void set_points(const grow_piece *p, const grown_meshlet *m, tl_meshlet *out)
{
    for (int k = 0; k < TL_MESHLET_VERTICES; k++) {
        const float *at = p->points + 3 * (int64_t)m->vertices[k < m->n_vertices ? k : 0];
        out->x[k] = at[0], out->y[k] = at[1], out->z[k] = at[2];
    }
}

/* Meshlets of triangles order[first] to order[end - 1]; returns how many. */
static int64_t grow_meshlets(const tl_source *source, const int32_t *triangles, const int32_t *order, int64_t first,
                             int64_t end, int32_t *numbers, void *room, tl_meshlet *out, float *records,
                             uint8_t *n_triangles)
{
    grow_piece p = place_piece(room);
    int64_t n = 0, n_done = 0;
    int32_t first_number = 0;
    for (int64_t begin = first; begin < end; begin += TL_GROW_PIECE) {
        p.n_triangles = end - begin < TL_GROW_PIECE ? end - begin : TL_GROW_PIECE;
        number_vertices(source, triangles, order + begin, numbers, first_number, &p);
        first_number += (int32_t)p.n_vertices;
        list_round(&p);
        const int64_t n_before = n;
        for (int64_t seed = 0; seed < p.n_triangles; seed++) {
            if (p.is_used[seed])
                continue;
            grown_meshlet m;
            m.number = (int32_t)(n - n_before) + 1;
            m.n_vertices = m.n_triangles = m.n_whole = m.n_near = 0;
            m.sum[0] = m.sum[1] = m.sum[2] = m.area = 0.0f;
            grow_one(&p, &m, seed, n_done >= TL_LEAST_GROWN * n, order + begin, out + n);
            n_done += m.n_triangles;
            set_points(&p, &m, out + n);
            tl_meshlet rest;
            int n_rest = 0;
            int n_held = pair_up(out + n, m.n_triangles, &rest, &n_rest);
            n_triangles[n] = (uint8_t)n_held;
            measure_meshlet(out + n, m.n_vertices, n_held, records + TL_N_BOUNDS * n);
            n++;
            if (n_rest) {
                memcpy(rest.x, out[n - 1].x, 3 * sizeof rest.x);
                n_held = pair_up(&rest, n_rest, NULL, NULL);
                out[n] = rest;
                n_triangles[n] = (uint8_t)n_held;
                measure_meshlet(out + n, m.n_vertices, n_held, records + TL_N_BOUNDS * n);
                n++;
            }
        }
    }
    return n;
}

#endif
