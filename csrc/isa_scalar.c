/* The kernels for the compiler's default architecture: the definition that every other unit must equal bit for bit. */
#define TL_ISA_NAME "scalar"
#define TL_KERNELS tl_kernels_scalar
#include "kernels.c"
