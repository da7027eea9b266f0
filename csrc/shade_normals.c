/* Normals: those that shading has, as numbers.
 * In: a visibility buffer, normals of the vertices.  Out: unit vectors, float32, on the side that is seen; 0 where nothing is. */
#include "fixed.h"
#include "lanes.h"

static void shade_normals(const tl_scene *scene, const tl_window *window, const tl_view *view, const tl_shading *shading,
                          const int32_t *ids, float *restrict out)
{
    shade_runs s;
    const vf zero = vf_set1(0.0f);
    start_runs(&s, scene, window, view, shading);
    for (int64_t row = 0; row < window->height; row++)
        for (int64_t column = 0; column < window->width; column += TL_SPAN) {
            const int64_t at = row * window->width + column;
            const int n = (int)min64(TL_SPAN, window->width - column);
            find_runs(&s, ids + at, n);
            set_runs(&s, row);
            for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
                vf normal[3] = {zero, zero, zero};
                if (s.visible[i]) {
                    shaded_lanes p;
                    find_pixels(&p, &s, i, column);
                    set_normals(&p);
                    for (int axis = 0; axis < 3; axis++)
                        normal[axis] = in_eye_space(&p, axis);
                    const vf squared = dot3(normal, normal), scale = vf_div(vf_set1(1.0f), vf_sqrt(squared));
                    const vm has_some = vm_and(p.visible, vf_lt(zero, squared));
                    for (int axis = 0; axis < 3; axis++)
                        normal[axis] = vf_select(has_some, vf_mul(normal[axis], scale), zero);
                }
                store_channels(out + 3 * (at + x), 3, (int)min64(n - x, TL_LANES), normal, 3);
            }
        }
}
