/* The kernels for x86-64 with AVX-512 F, BW, DQ, VL and CD. Compiled with those flags: see setup.py. */
#define TL_ISA_NAME "avx512"
#define TL_KERNELS tl_kernels_avx512
#include "kernels.c"
