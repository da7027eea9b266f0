/* Flat: the depth of a picture whose triangles all lie at one, after the ids have been drawn without any.
 * In: ids.  Out: ids and depth. */
#include <stdint.h>

static void set_flat_depth(int32_t *restrict ids, int64_t n, int32_t flip, float depth, float background, float *restrict out)
{
    for (int64_t k = 0; k < n; k++) {
        const int32_t id = ids[k];
        out[k] = id < 0 ? background : depth;
        ids[k] = id < 0 ? id : id ^ flip;
    }
}
