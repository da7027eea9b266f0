/* The unit for meshes in meshlets, for AVX-512 with VBMI and VBMI2.  Compiled with those flags: see setup.py. */
#include "topleft.h"

#include "meshlets/draw.c"
#include "meshlets/grow.c"
#include "meshlets/list.c"

#if TL_HAS_HALVES
const tl_meshlet_kernels tl_meshlets_vbmi = {.grow = grow_meshlets, .list = list_seen, .draw = draw_meshlets};
#endif
