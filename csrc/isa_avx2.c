/* The kernels for x86-64 with AVX2, FMA, BMI1, BMI2, LZCNT and POPCNT. Compiled with those flags: see setup.py. */
#define TL_ISA_NAME "avx2"
#define TL_KERNELS tl_kernels_avx2
#include "kernels.c"
