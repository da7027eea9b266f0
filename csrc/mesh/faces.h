/* The contract of faces with any number of corners, which are cut into triangles. */
#ifndef TOPLEFT_FACES_H
#define TOPLEFT_FACES_H

#include <stdint.h>

typedef struct {
    const double *points;     /* (n_points, 3) */
    const int64_t *corners;   /* points, face by face */
    const int64_t *n_corners; /* (n_faces,), each below 2^31 */
    int64_t n_faces;
    int64_t most_steps;     /* the most comparisons of corners with boxes and triangles, for all faces */
    struct tl_pause *pause; /* of this call, or NULL */
} tl_faces;

/* int64 that `cut_faces` needs for a face of n_corners. */
static inline int64_t tl_ear_words(int64_t n_corners) { return 12 * n_corners + 256; }

#endif
