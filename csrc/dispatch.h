/* The whole contract between the kernels and their callers: the headers of the rooms, the kernel table, which
 * instruction sets were built, and which of them this CPU can run. */
#ifndef TL_DISPATCH_H
#define TL_DISPATCH_H

#include "topleft.h"
#include "vertex/exact.h"
#include "clusters/clusters.h"
#include "mesh/faces.h"
#include "mesh/lens.h"
#include "mesh/nearest.h"
#include "pixels/shading.h"
#include "grad/grad.h"
#include "polygons/polygons.h"
#include "tiles/tiles.h"
#include "grid/grid.h"

/* The table of an instruction set: the kernels of kernels.h. */
typedef struct tl_kernels {
    const char *isa;
#define TL_KERNEL(result, name, ...) result (*name)(__VA_ARGS__);
#include "kernels.h"
} tl_kernels;

/* From the plainest to the widest: the last one that is built and runs is the one to take. */
enum { TL_ISA_SCALAR, TL_ISA_SIMD128, TL_ISA_AVX2, TL_ISA_AVX512, TL_N_ISA };

/* The name of an instruction set, NULL outside [0, TL_N_ISA). */
const char *tl_isa_name(int i_isa);

/* 1 when the unit is in this binary. */
int tl_isa_built(int i_isa);

/* 1 when the CPU and the operating system support an instruction set. */
int tl_isa_runs(int i_isa);

/* The compiler flags of a unit, "" when it was not built. */
const char *tl_isa_flags(int i_isa);

/* Sets a table to the kernels of an instruction set; 0 unless it is built and runs, and the table is as it was. */
int tl_set_kernels(const char *name, tl_kernels *kernels);

/* The compiler of this binary, for example "gcc 12.2.0", and the version it was compiled as. */
const char *tl_compiler(void);
const char *tl_version(void);

#endif
