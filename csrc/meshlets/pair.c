/* Pairs the triangles of a meshlet: two that share an edge and lie on its two sides are drawn together, because no
 * pixel is in both.
 * In: a meshlet with triangles in any order.  Out: triangles 2k and 2k + 1 are a pair. */
#ifndef TL_PAIR_C
#define TL_PAIR_C

#include <stdint.h>
#include <string.h>

#include "clusters.h"
#include "meshlets.h"
#include "topleft.h"

/* Two triangles with a common edge, by how long that is against their other edges. */
typedef struct {
    uint8_t first, second, score;
} edge_pair;

#define TL_PAIR_SCORES 64

static inline float squared_length(const tl_meshlet *m, int a, int b)
{
    const float x = m->x[b] - m->x[a], y = m->y[b] - m->y[a], z = m->z[b] - m->z[a];
    return x * x + y * y + z * z;
}

/* Lists the pairs that are possible, the best first; returns how many. */
static int list_pairs(const tl_meshlet *m, int n, edge_pair *sorted)
{
    uint8_t left_of[TL_MESHLET_VERTICES][TL_MESHLET_VERTICES]; /* triangle of a directed edge */
    float around[TL_MESHLET_ROOM];
    edge_pair found[3 * TL_MESHLET_ROOM];
    int starts[TL_PAIR_SCORES + 1] = {0}, n_found = 0;
    enum { NONE = 255 };
    for (int i = 0; i < n; i++) {
        around[i] = 0.0f;
        for (int k = 0; k < 3; k++) {
            const int a = m->corners[k][i], b = m->corners[k == 2 ? 0 : k + 1][i];
            left_of[a][b] = left_of[b][a] = NONE;
            around[i] += squared_length(m, a, b);
        }
    }
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            left_of[m->corners[k][i]][m->corners[k == 2 ? 0 : k + 1][i]] = (uint8_t)i;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            const int a = m->corners[k][i], b = m->corners[k == 2 ? 0 : k + 1][i], other = left_of[b][a];
            if (other == NONE || other <= i || left_of[a][b] != i)
                continue;
            const float share = squared_length(m, a, b) / (around[i] + around[other]); /* at most a quarter */
            const int score = share > 0.0f && share < 1.0f ? (int)(share * 4.0f * (TL_PAIR_SCORES - 1)) : 0;
            const int last = score < TL_PAIR_SCORES ? TL_PAIR_SCORES - 1 - score : 0;
            found[n_found++] = (edge_pair){(uint8_t)i, (uint8_t)other, (uint8_t)last};
            starts[last + 1]++;
        }
    for (int k = 0; k < TL_PAIR_SCORES; k++)
        starts[k + 1] += starts[k];
    for (int k = 0; k < n_found; k++)
        sorted[starts[found[k].score]++] = found[k];
    return n_found;
}

static inline void put_triangle(tl_meshlet *to, int at, const tl_meshlet *from, int i)
{
    for (int k = 0; k < 3; k++)
        to->corners[k][at] = from->corners[k][i];
    to->names[at] = from->names[i];
}

/* Orders n triangles by pairs, with an empty one for each that has no partner.  Triangles without room go to
 * `rest`; NULL: there is room.  Returns how many there are now. */
static int pair_up(tl_meshlet *m, int n, tl_meshlet *rest, int *n_rest)
{
    edge_pair pairs[3 * TL_MESHLET_ROOM];
    int mate[TL_MESHLET_ROOM], n_held = 0;
    const int n_pairs = list_pairs(m, n, pairs);
    tl_meshlet old;
    memcpy(old.corners, m->corners, sizeof old.corners);
    memcpy(old.names, m->names, sizeof old.names);
    memset(mate, -1, sizeof mate);
    for (int i = 0; i < n_pairs; i++) {
        const int a = pairs[i].first, b = pairs[i].second;
        if (mate[a] < 0 && mate[b] < 0)
            mate[a] = b, mate[b] = a;
    }
    memset(m->corners, 0, sizeof m->corners);
    for (int i = 0; i < n; i++) {
        const int other = mate[i];
        if (other >= 0 && other < i)
            continue;
        if (n_held + 2 > TL_MESHLET_ROOM) {
            put_triangle(rest, (*n_rest)++, &old, i);
            if (other >= 0)
                put_triangle(rest, (*n_rest)++, &old, other);
            continue;
        }
        put_triangle(m, n_held, &old, i);
        m->names[n_held + 1] = old.names[i];
        if (other >= 0)
            put_triangle(m, n_held + 1, &old, other);
        n_held += 2;
    }
    for (int i = n_held; i < TL_MESHLET_ROOM; i++)
        m->names[i] = old.names[0];
    const int last = n_held - 1; /* an empty partner at the end is not needed */
    return n_held && m->corners[0][last] == m->corners[1][last] ? last : n_held;
}

#endif
