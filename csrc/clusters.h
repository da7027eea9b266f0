/* Clusters of a mesh in object space, and a view of them.  Part of the contract of
 * topleft.h, which includes it behind the types that it uses. */
#include "topleft.h" /* before the guard: it includes this file behind its types */

#ifndef TOPLEFT_CLUSTERS_H
#define TOPLEFT_CLUSTERS_H

/* A mesh in object space, sorted into clusters: few neighbouring triangles, their vertices together. */

#define TL_CLUSTER 256      /* triangles at most; and vertices, so that a byte tells them apart */
#define TL_CLUSTER_GROUP 64 /* clusters that have a box in common */
#define TL_CLUSTER_TAIL 32  /* rows that must be readable behind the vertices */

typedef struct {
    double low[3], high[3];      /* their box */
    double axis[3], cone_cos;    /* of their normals; cone_cos <= 0: any */
    double min_area, min_height; /* the least doubled area, and of that over the longest side */
    int64_t first_triangle, first_vertex;
    int32_t n_triangles, n_vertices;
} tl_cluster;

typedef struct {
    const tl_cluster *clusters;
    int64_t n_clusters;
    const double *group_boxes; /* (groups, 6): low and high of TL_CLUSTER_GROUP clusters each; NaN: not finite */
    const uint8_t *corners;    /* (n_triangles, 3) into the vertices of their cluster */
    const int32_t *names;      /* (n_triangles,): which triangle of the mesh each is */
} tl_clustered;

/* A view, as far as clusters are concerned. */
typedef struct {
    double matrix[16]; /* clip from object */
    /* left, right, top, bottom: a pixel beyond it where side[0] * x (y) + side[1] * w < 0 */
    double side[4][2];
    double eye[4];           /* the rows of x, y and w take it to 0 */
    double scale_x, scale_y; /* sub-pixels a unit of normalized device coordinates */
    double half_width_px, half_height_px;
    double sample_px[2]; /* the one sample of a pixel, from its left and from its top */
    int has_one_sample;  /* which alone decides: not so of conservative coverage, and of several samples at once */
    double length[3];    /* of the rows of x, y and w, without their last number */
    double error;        /* of the vertex stage, as a share of the sum of all terms of a row */
    int near_clip, far_clip, zero_to_one;
    int is_farthest; /* the farther one is drawn first */
    tl_cull cull;
} tl_cluster_view;

/* The visibility of a cluster in a view. */
typedef enum {
    TL_VISIBILITY_OUTSIDE,
    TL_VISIBILITY_CULLED,
    TL_VISIBILITY_BACK,
    TL_VISIBILITY_FRONT,
    TL_N_VISIBILITIES
} tl_visibility;

/* The clusters that one pass draws. */
typedef struct tl_cluster_pass {
    const tl_clustered *mesh;
    const tl_cluster_view *seen;
    const tl_source *source; /* the vertices of all clusters, with the matrix */
    const tl_view *view;
    int32_t *list; /* room for a number for each cluster, and for two */
    void *room;
    /* whether clusters that lie behind all that is drawn are left out; NEAREST and FARTHEST alone */
    int may_be_hidden;
    int64_t n_seen, n_drawn; /* out: clusters that the window may show, and those of them that were not hidden */
} tl_cluster_pass;

#endif
