/* The contract of distances between surfaces: a surface with its triangles in a tree of boxes, and the results.
 * Coordinates are those of the object, shifted to near the origin. */
#ifndef TOPLEFT_NEAREST_H
#define TOPLEFT_NEAREST_H

#include <stdint.h>

enum {
    TL_TREE_LEAF = 2,    /* triangles of a leaf */
    TL_TREE_WIDTH = 8,   /* boxes of a node: leaves in the lowest level, nodes of the level below elsewhere */
    TL_TREE_LEVELS = 12, /* 2 * 8^11 triangles are more than int32 counts */
    TL_TREE_BOX = 6,     /* numbers of a box: lower corner, upper corner */
};

/* A node: box k has its lower x at [0][k], y at [1][k], z at [2][k], and its upper x, y, z at [3][k] to [5][k]. */
typedef struct {
    float ends[TL_TREE_BOX][TL_TREE_WIDTH];
} tl_tree_node;

typedef struct {
    const double *points;     /* (n_points, 3) */
    const int32_t *triangles; /* (n_triangles, 3), sorted in space; vertices at one position have one index */
    int64_t n_triangles;
    tl_tree_node *nodes; /* level by level from the lowest */
    int64_t first_node[TL_TREE_LEVELS], n_nodes[TL_TREE_LEVELS];
    int n_levels; /* the last level has one node */
    float slack;  /* by which boxes are larger than their triangles */
} tl_surface;

/* How far triangles may lie from a surface. */
typedef struct {
    double known;     /* some point of some triangle has this distance */
    double bound;     /* no point has a larger distance */
    int64_t n_pieces; /* the most pieces of a triangle */
} tl_reach;

#endif
