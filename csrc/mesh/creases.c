/* Creases: normals of corners, where a surface bends at an edge by more than an angle.
 * In: triangles, their normals and angles.  Out: the groups of the corners of each vertex, and a normal for each group.
 *
 * Two corners of a vertex are in one group when their triangles share a side at the vertex and their normals differ by
 * at most the angle; so are corners that a chain of such pairs joins.  A triangle without an area has no normal: its
 * two sides at the vertex count as one side, so that the triangles on either side of it are neighbours.  Sides that
 * more than TL_MOST_AT_SIDE triangles share join no corners.
 *
 * Each vertex is computed by itself, and sums have the order of the triangles: threads change no bit. Based on: G.
 * Thurmer and C. A. Wuthrich, Computing Vertex Normals from Polygonal Facets, Journal of Graphics Tools 3(1), 1998 (the
 * weights). */
#ifndef TL_CREASES_C
#define TL_CREASES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "mesh/normals.c"

/* Lists corners in the order of their vertices, for each vertex in the order of the triangles. */
static void list_corners(const int32_t *triangles, int64_t n_triangles, int64_t n_vertices, int32_t *starts,
                         int32_t *corners)
{
    memset(starts, 0, (size_t)(n_vertices + 1) * sizeof *starts);
    for (int64_t i = 0; i < 3 * n_triangles; i++)
        starts[triangles[i]]++;
    for (int64_t v = 1; v <= n_vertices; v++)
        starts[v] += starts[v - 1]; /* the ends of the vertices, which count down to their starts */
    for (int64_t i = 3 * n_triangles - 1; i >= 0; i--)
        corners[--starts[triangles[i]]] = (int32_t)i;
}

static int64_t face_angles(const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
                           double *normals, double *angles)
{
    face_block b = {.n = 0};
    for (int64_t i = first; i < end; i += b.n) {
        const int64_t bad = load_block(source, triangles, i, end, &b);
        if (bad >= 0)
            return bad;
        measure_block(&b, 1);
        for (int j = 0; j < b.n; j++)
            for (int k = 0; k < 3; k++) {
                normals[3 * (i + j) + k] = b.normal[k][j];
                angles[3 * (i + j) + k] = b.angle[k][j];
            }
    }
    return -1;
}

/* The corners of one vertex. */
typedef struct {
    int n;
    const int32_t *corners;
    uint64_t *sides; /* (2 n,): upper half: the other vertex of a side; lower half: 2 * corner, or that + 1 */
    int32_t *group;  /* (n,): a corner of its group, itself or a lower one */
    int32_t *run_of; /* (2 n,): the run of equal sides of each side of a corner; later numbers of groups */
    int32_t *joined; /* (2 n,): a run that each run is joined to */
} vertex_fan;

static inline int has_area(const tl_fans *fans, int32_t corner)
{
    const double *n = fans->normals + 3 * (int64_t)(corner / 3);
    return (n[0] != 0.0) | (n[1] != 0.0) | (n[2] != 0.0);
}

/* The lowest index that i is joined to. */
static inline int32_t root_of(int32_t *joined, int32_t i)
{
    while (joined[i] != i)
        i = joined[i] = joined[joined[i]];
    return i;
}

static inline void join(int32_t *joined, int32_t a, int32_t b)
{
    a = root_of(joined, a), b = root_of(joined, b);
    joined[a > b ? a : b] = a > b ? b : a;
}

/* Restores the heap below index i of n keys. */
static inline void sift_down(uint64_t *keys, int64_t i, int64_t n)
{
    const uint64_t own = keys[i];
    for (int64_t k; (k = 2 * i + 1) < n; i = k) {
        k += k + 1 < n && keys[k + 1] > keys[k];
        if (keys[k] <= own)
            break;
        keys[i] = keys[k];
    }
    keys[i] = own;
}

static void sort_sides(uint64_t *keys, int64_t n)
{
    if (n <= 64) { /* insertion sort: few vertices have more corners */
        for (int64_t i = 1; i < n; i++) {
            const uint64_t own = keys[i];
            int64_t k = i;
            for (; k > 0 && keys[k - 1] > own; k--)
                keys[k] = keys[k - 1];
            keys[k] = own;
        }
        return;
    }
    for (int64_t i = n / 2 - 1; i >= 0; i--)
        sift_down(keys, i, n);
    for (int64_t last = n - 1; last > 0; last--) {
        const uint64_t largest = keys[0];
        keys[0] = keys[last], keys[last] = largest;
        sift_down(keys, 0, last);
    }
}

/* Joins the two sides of each triangle without an area; sides get the number of their run. */
static void join_sides(const tl_fans *fans, vertex_fan *f)
{
    int32_t run = 0;
    for (int i = 0; i < 2 * f->n; i++) {
        run += i && f->sides[i] >> 32 != f->sides[i - 1] >> 32;
        f->run_of[(uint32_t)f->sides[i]] = run;
        f->joined[i] = i;
    }
    for (int j = 0; j < f->n; j++)
        if (!has_area(fans, f->corners[j]))
            join(f->joined, f->run_of[2 * j], f->run_of[2 * j + 1]);
    for (int i = 0; i < 2 * f->n; i++) {
        const uint32_t side = (uint32_t)f->sides[i];
        f->sides[i] = (uint64_t)root_of(f->joined, f->run_of[side]) << 32 | side;
    }
    sort_sides(f->sides, 2 * (int64_t)f->n);
}

/* Joins the corners of n equal sides. */
static inline void join_corners(const tl_fans *fans, vertex_fan *f, const uint64_t *sides, int n)
{
    for (int a = 0; a < n; a++)
        for (int b = a + 1; b < n; b++) {
            const int32_t i = (int32_t)((uint32_t)sides[a] >> 1), j = (int32_t)((uint32_t)sides[b] >> 1);
            const double *u = fans->normals + 3 * (int64_t)(f->corners[i] / 3);
            const double *v = fans->normals + 3 * (int64_t)(f->corners[j] / 3);
            if (has_area(fans, f->corners[i]) && has_area(fans, f->corners[j]) &&
                (u[0] * v[0] + u[1] * v[1]) + u[2] * v[2] >= fans->least_cosine)
                join(f->group, i, j);
        }
}

/* Sets the groups of the corners of a vertex; returns how many. */
static int32_t group_corners(const tl_fans *fans, vertex_fan *f, int32_t *groups)
{
    int n_flat = 0;
    for (int j = 0; j < f->n; j++) {
        const int32_t corner = f->corners[j], k = corner % 3;
        const int32_t onward = fans->triangles[corner - k + (k == 2 ? 0 : k + 1)];
        const int32_t back = fans->triangles[corner - k + (k == 0 ? 2 : k - 1)];
        f->sides[2 * j] = (uint64_t)onward << 32 | (uint64_t)(2 * j);
        f->sides[2 * j + 1] = (uint64_t)back << 32 | (uint64_t)(2 * j + 1);
        f->group[j] = j;
        n_flat += !has_area(fans, corner);
    }
    sort_sides(f->sides, 2 * (int64_t)f->n);
    if (n_flat)
        join_sides(fans, f);
    for (int i = 0, end; i < 2 * f->n; i = end) {
        for (end = i + 1; end < 2 * f->n && f->sides[end] >> 32 == f->sides[i] >> 32;)
            end++;
        if (end - i <= TL_MOST_AT_SIDE)
            join_corners(fans, f, f->sides + i, end - i);
    }
    int32_t n_groups = 0, *number = f->run_of;
    for (int j = 0; j < f->n; j++) {
        const int32_t root = root_of(f->group, j);
        const int is_some = has_area(fans, f->corners[j]);
        if (is_some && root == j)
            number[j] = n_groups++;
        groups[f->corners[j]] = is_some ? number[root] : -1;
    }
    return n_groups;
}

static void find_creases(const tl_fans *fans, int64_t first, int64_t end, uint64_t *room, int32_t *groups,
                         int32_t *n_groups)
{
    for (int64_t v = first; v < end; v++) {
        const int n = fans->starts[v + 1] - fans->starts[v];
        int32_t *rest = (int32_t *)(room + 2 * (int64_t)n);
        vertex_fan f = {.n = n,
                        .corners = fans->corners + fans->starts[v],
                        .sides = room,
                        .group = rest,
                        .run_of = rest + n,
                        .joined = rest + 3 * (int64_t)n};
        const int32_t found = group_corners(fans, &f, groups);
        n_groups[v] = found > 1 ? found : 0;
    }
}

static void sum_creases(const tl_fans *fans, const tl_creases *creases, int64_t first, int64_t end)
{
    const int64_t first_row = creases->starts[first], end_row = creases->starts[end];
    double *sums = creases->of_vertices, *rows = creases->of_groups;
    memset(sums + 3 * first, 0, (size_t)(end - first) * 3 * sizeof *sums);
    if (end_row > first_row)
        memset(rows + 3 * first_row, 0, (size_t)(end_row - first_row) * 3 * sizeof *rows);
    for (int64_t v = first; v < end; v++) {
        const int64_t row = creases->starts[v];
        const int is_creased = creases->starts[v + 1] > row;
        for (int32_t i = fans->starts[v]; i < fans->starts[v + 1]; i++) {
            const int32_t corner = fans->corners[i], group = is_creased ? creases->groups[corner] : -1;
            const double *n = fans->normals + 3 * (int64_t)(corner / 3), angle = fans->angles[corner];
            for (int k = 0; k < 3; k++) {
                sums[3 * v + k] += angle * n[k];
                if (group >= 0)
                    rows[3 * (row + group) + k] += angle * n[k];
            }
            if (creases->row_of_corner)
                creases->row_of_corner[corner] =
                    group >= 0 ? (int32_t)(creases->first_row + row + group) : creases->own_triangles[corner];
        }
    }
    const tl_source of_vertices = {.data = sums, .scalar = TL_F64, .n_components = 3};
    const tl_source of_groups = {.data = rows, .scalar = TL_F64, .n_components = 3};
    unit_vectors(&of_vertices, NULL, first, end, sums, NULL);
    if (end_row > first_row)
        unit_vectors(&of_groups, NULL, first_row, end_row, rows, NULL);
}

#endif
