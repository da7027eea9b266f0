/* The contract of clusters: a mesh in object space, and a view of it. */
#ifndef TOPLEFT_CLUSTERS_H
#define TOPLEFT_CLUSTERS_H

#include <stdint.h>

#include "topleft.h"

/* A mesh in object space, sorted into clusters: a few neighbouring triangles, with their vertices stored together. */

#define TL_CLUSTER 256      /* the most triangles; and vertices, so that a byte indexes them */
#define TL_CLUSTER_GROUP 64 /* clusters that share a group box */
#define TL_CLUSTER_TAIL 32  /* rows that must be readable after the vertices */

typedef struct {
    double low[3], high[3];      /* box of the vertices */
    double axis[3], cone_cos;    /* cone of the normals; cone_cos <= 0: any normal */
    double min_area, min_height; /* the least doubled area, and the least doubled area over the longest side */
    int64_t first_triangle, first_vertex;
    int32_t n_triangles, n_vertices;
} tl_cluster;

typedef struct {
    const tl_cluster *clusters;
    int64_t n_clusters;
    const double *group_boxes; /* (groups, 6): low and high of TL_CLUSTER_GROUP clusters each; NaN: not finite */
    const uint8_t *corners;    /* (n_triangles, 3) into the vertices of their cluster */
    const int32_t *names;      /* (n_triangles,): the index of each triangle in the mesh */
} tl_clustered;

/* A view, as clusters are tested against it. */
typedef struct {
    double matrix[16]; /* clip from object */
    /* left, right, top, bottom of the window: outside where side[0] * x (or y) + side[1] * w < 0 */
    double side[4][2];
    double eye[4];           /* the rows of x, y and w map it to 0 */
    double scale_x, scale_y; /* sub-pixels per unit of normalized device coordinates */
    double half_width_px, half_height_px;
    double sample_px[2]; /* the sample of a pixel, from its left and top edge */
    int has_one_sample;  /* only this sample is drawn: no conservative coverage, no multisampling */
    double length[3];    /* of the rows of x, y and w, without their fourth number */
    double error;        /* of the vertex stage, relative to the sum of the absolute terms of a row */
    int near_clip, far_clip, zero_to_one;
    int is_farthest; /* larger depth wins */
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
    int32_t *list; /* n_clusters + 2 numbers */
    void *room;
    /* whether occluded clusters are skipped; NEAREST and FARTHEST alone */
    int may_be_hidden;
    int64_t n_seen, n_drawn; /* out: clusters that the window may show; of these, not occluded */
} tl_cluster_pass;

#endif
