/* CPU probe and choice of the kernel unit: a name in, a kernel table out.
 *
 * setup.py defines TL_HAVE_<ISA> for each unit that it links, TL_FLAGS_<ISA> and TL_VERSION. Nothing here is kept
 * between calls; which table is in use is the caller's to remember. */
#include "dispatch.h"

#include <stddef.h>
#include <string.h>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

#ifndef TL_VERSION
#define TL_VERSION "unknown"
#endif
#ifndef TL_FLAGS_SCALAR
#define TL_FLAGS_SCALAR ""
#endif
#ifndef TL_FLAGS_AVX2
#define TL_FLAGS_AVX2 ""
#endif
#ifndef TL_FLAGS_AVX512
#define TL_FLAGS_AVX512 ""
#endif

extern const tl_kernels tl_kernels_scalar;
#ifdef TL_HAVE_AVX2
extern const tl_kernels tl_kernels_avx2;
#define TL_TABLE_AVX2 (&tl_kernels_avx2)
#else
#define TL_TABLE_AVX2 NULL
#endif
#ifdef TL_HAVE_AVX512
extern const tl_kernels tl_kernels_avx512;
#define TL_TABLE_AVX512 (&tl_kernels_avx512)
#else
#define TL_TABLE_AVX512 NULL
#endif

typedef struct {
    const char *name;
    const char *flags;
    const tl_kernels *kernels; /* NULL: not built */
} tl_isa_unit;

static const tl_isa_unit UNITS[TL_N_ISA] = {
    [TL_ISA_SCALAR] = {"scalar", TL_FLAGS_SCALAR, &tl_kernels_scalar},
    [TL_ISA_AVX2] = {"avx2", TL_FLAGS_AVX2, TL_TABLE_AVX2},
    [TL_ISA_AVX512] = {"avx512", TL_FLAGS_AVX512, TL_TABLE_AVX512},
};

/* Each probe asks for all that its unit is compiled with in setup.py. __builtin_cpu_supports knows whether the
 * operating system saves the registers; not every clang knows "lzcnt", so that bit is read by hand. */
static int cpu_has_avx2(void)
{
#if defined(__x86_64__)
    unsigned a, b, c, d;
    __builtin_cpu_init();
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
           __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("popcnt") &&
           __get_cpuid(0x80000001u, &a, &b, &c, &d) && (c & bit_LZCNT);
#else
    return 0;
#endif
}

static int cpu_has_avx512(void)
{
#if defined(__x86_64__)
    return cpu_has_avx2() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("avx512cd");
#else
    return 0;
#endif
}

#ifdef TL_HAVE_VBMI
extern const tl_meshlet_kernels tl_meshlets_vbmi;

static int cpu_has_vbmi(void) { return __builtin_cpu_supports("avx512vbmi") && __builtin_cpu_supports("avx512vbmi2"); }
#endif

const tl_meshlet_kernels *tl_meshlets_beside(const tl_kernels *kernels)
{
#ifdef TL_HAVE_VBMI
    if (kernels == UNITS[TL_ISA_AVX512].kernels && cpu_has_avx512() && cpu_has_vbmi())
        return &tl_meshlets_vbmi;
#endif
    (void)kernels;
    return NULL;
}

const char *tl_isa_name(int i_isa) { return i_isa >= 0 && i_isa < TL_N_ISA ? UNITS[i_isa].name : NULL; }

const char *tl_isa_flags(int i_isa) { return i_isa >= 0 && i_isa < TL_N_ISA ? UNITS[i_isa].flags : ""; }

int tl_isa_built(int i_isa) { return i_isa >= 0 && i_isa < TL_N_ISA && UNITS[i_isa].kernels != NULL; }

int tl_isa_available(int i_isa)
{
    if (!tl_isa_built(i_isa))
        return 0;
    switch (i_isa) {
    case TL_ISA_AVX2: return cpu_has_avx2();
    case TL_ISA_AVX512: return cpu_has_avx512();
    default: return 1;
    }
}

const tl_kernels *tl_kernels_for(const char *name)
{
    for (int i = 0; i < TL_N_ISA; i++)
        if (strcmp(UNITS[i].name, name) == 0)
            return tl_isa_available(i) ? UNITS[i].kernels : NULL;
    return NULL;
}

const char *tl_compiler(void)
{
#if defined(__clang__)
    return "clang " __clang_version__;
#elif defined(__GNUC__)
    return "gcc " __VERSION__;
#else
    return "unknown";
#endif
}

const char *tl_version(void) { return TL_VERSION; }
