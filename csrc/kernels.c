/* The kernel table of one instruction set, with its units compiled together and only the table visible.
 * isa_*.c define the name of the set (TL_ISA_NAME) and of the table (TL_KERNELS) and include this file.  `setup.py`
 * compiles each unit by itself instead, in parallel and only if its files change. */
#include "dispatch.h"

#include "unit_raster.c"
#include "unit_pixels.c"
#include "unit_blend.c"
#include "unit_shade.c"
#include "unit_polygons.c"
#include "unit_grad.c"

#ifndef TL_KERNELS /* for editors, which read this file alone */
#define TL_ISA_NAME "none"
#define TL_KERNELS tl_kernels_none
#endif

const tl_kernels TL_KERNELS = {
    .isa = TL_ISA_NAME,
#define TL_KERNEL(result, name, ...) .name = name,
#include "kernels.h"
};
