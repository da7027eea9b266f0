/* Clustered: the triangles of a cluster, and its vertices where they stay in the first-level cache, as a scene of its own.
 * In: a cluster of a mesh in object space, a matrix.  Out: snapped vertices and triangles, which raster.c draws. */
#include "fixed.h"
#include "lanes.h"

#include "culled.c"

/* A cluster as a scene of its own. */
typedef struct {
    tl_scene scene;
    tl_vertex vertices[TL_CLUSTER + TL_CLUSTER_TAIL];
    int32_t corners[3 * (TL_CLUSTER + TL_MAX_LANES)];
    int32_t names[TL_CLUSTER];
} cluster_scene;

/* Lists the triangles that have a special corner, and leaves the others, whose number it returns. */
static __attribute__((noinline)) int64_t list_special(cluster_scene *own, int64_t n, tl_share *share)
{
    int64_t n_left = 0;
    for (int64_t i = 0; i < n; i++) {
        int32_t *corners = own->corners + 3 * i;
        int is_special = 0;
        for (int k = 0; k < 3; k++)
            is_special |= own->vertices[corners[k]].x_fx == TL_SPECIAL;
        const int32_t name = own->scene.names[i];
        if (is_special) {
            share->others[share->n_others++] = name;
            continue;
        }
        memmove(own->corners + 3 * n_left, corners, 3 * sizeof *corners);
        own->names[n_left++] = name;
    }
    own->scene.names = own->names;
    return n_left;
}

/* Snaps the vertices of a cluster and unpacks its triangles; returns how many of them there are to draw. */
static int64_t load_cluster(const tl_cluster *c, const tl_cluster_pass *pass, const tl_scene *scene, tl_share *share, cluster_scene *own)
{
    const uint8_t *corners = pass->mesh->corners + 3 * c->first_triangle;
    const size_t row_bytes = (size_t)pass->source->n_components * (pass->source->scalar == TL_F32 ? sizeof(float) : sizeof(double));
    tl_source source = *pass->source;
    source.data = (const char *)source.data + (size_t)c->first_vertex * row_bytes;
    source.n -= c->first_vertex;
    /* whole vectors: those of other clusters that this snaps are not looked at */
    const int64_t n = ((int64_t)c->n_vertices + TL_LANES - 1) / TL_LANES * TL_LANES;
    const tl_vertex_counts counts = project(&source, 0, n, pass->view, own->vertices, NULL);
    own->scene = *scene;
    own->scene.mesh.vertices = own->vertices;
    own->scene.mesh.n_vertices = TL_CLUSTER;
    own->scene.triangles = own->corners;
    own->scene.n_triangles = c->n_triangles;
    own->scene.names = pass->mesh->names + c->first_triangle;
    for (int i = 0; i < 3 * c->n_triangles; i++)
        own->corners[i] = corners[i];
    memset(own->corners + 3 * c->n_triangles, 0, 3 * TL_LANES * sizeof *own->corners);
    return counts.n_bad || counts.n_wide || counts.n_clipped ? list_special(own, c->n_triangles, share) : c->n_triangles;
}

/* The clusters that a pass draws, unless they turn out to be hidden. */
static int64_t list_clusters(tl_cluster_pass *pass, const tl_window *window, const tl_target *target)
{
    pass->n_drawn = 0;
    pass->n_seen = cull_clusters(pass->mesh, pass->seen, window, pass->may_be_hidden ? target : NULL, pass->list, pass->room);
    return pass->n_seen;
}
