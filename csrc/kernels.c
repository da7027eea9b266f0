/* The kernel table of one instruction set, its units compiled together, with nothing visible but the table.
 * isa_*.c name the set (TL_ISA_NAME) and the table (TL_KERNELS) and include this file.  `setup.py` compiles each unit
 * by itself instead, side by side and only if its files change. */
#include "topleft.h"

#include "unit_raster.c"
#include "unit_pixels.c"
#include "unit_blend.c"
#include "unit_shade.c"
#include "unit_polygons.c"
#include "unit_grad.c"

#ifndef TL_KERNELS /* read by itself, as an editor does */
#define TL_ISA_NAME "none"
#define TL_KERNELS tl_kernels_none
#endif

const tl_kernels TL_KERNELS = {
    .isa = TL_ISA_NAME,
#define TL_KERNEL(result, name, ...) .name = name,
#include "kernels.h"
};
