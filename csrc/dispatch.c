/* CPU probe and choice of an instruction set: a name in, a kernel table out.
 *
 * setup.py defines TL_HAVE_<ISA> for each set that it links, TL_FLAGS_<ISA> and TL_VERSION. Nothing here is kept
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
#ifndef TL_FLAGS_SIMD128
#define TL_FLAGS_SIMD128 ""
#endif
#ifndef TL_FLAGS_AVX2
#define TL_FLAGS_AVX2 ""
#endif
#ifndef TL_FLAGS_AVX512
#define TL_FLAGS_AVX512 ""
#endif

/* The functions of unit.h, which set the kernels of a unit. */
#define TL_DECLARE(unit, isa) void tl_set_##unit##_##isa(tl_kernels *kernels);
#define TL_CALL(unit, isa) tl_set_##unit##_##isa(kernels);
#define TL_UNITS(f, isa) f(raster, isa) f(pixels, isa) f(blend, isa) f(shade, isa) f(polygons, isa) f(grad, isa)
#define TL_SET(isa)           \
    TL_UNITS(TL_DECLARE, isa) \
    static void set_##isa(tl_kernels *kernels) { TL_UNITS(TL_CALL, isa) }

TL_SET(scalar)
#ifdef TL_HAVE_SIMD128
TL_SET(simd128)
#define TL_SET_SIMD128 set_simd128
#else
#define TL_SET_SIMD128 NULL
#endif
#ifdef TL_HAVE_AVX2
TL_SET(avx2)
#define TL_SET_AVX2 set_avx2
#else
#define TL_SET_AVX2 NULL
#endif
#ifdef TL_HAVE_AVX512
TL_SET(avx512)
#define TL_SET_AVX512 set_avx512
#else
#define TL_SET_AVX512 NULL
#endif

typedef struct {
    const char *name;
    const char *flags;
    void (*set)(tl_kernels *kernels); /* NULL: not built */
} tl_isa_unit;

static const tl_isa_unit UNITS[TL_N_ISA] = {
    [TL_ISA_SCALAR] = {"scalar", TL_FLAGS_SCALAR, set_scalar},
    [TL_ISA_SIMD128] = {"simd128", TL_FLAGS_SIMD128, TL_SET_SIMD128},
    [TL_ISA_AVX2] = {"avx2", TL_FLAGS_AVX2, TL_SET_AVX2},
    [TL_ISA_AVX512] = {"avx512", TL_FLAGS_AVX512, TL_SET_AVX512},
};

#if defined(__x86_64__)
/* Features of the CPU and the operating system, by hand: __builtin_cpu_supports needs a library that clang
 * for Windows does not link. */
typedef struct {
    unsigned ecx_1, ebx_7, ecx_extended; /* registers of cpuid */
    unsigned saved;                      /* which vectors the system saves for a thread, of xgetbv */
} cpu_words;

#ifdef __APPLE__ /* macOS reports longer vectors only once they are used, and saves them from then on */
enum { SAVES_AVX2 = 0x06, SAVES_AVX512 = 0x06 };
#else /* 128 and 256 bits; masks, 512 bits, 32 vectors */
enum { SAVES_AVX2 = 0x06, SAVES_AVX512 = 0xe6 };
#endif

static cpu_words ask_cpu(void)
{
    cpu_words cpu = {0};
    unsigned a, b, c, d;
    if (__get_cpuid(1, &a, &b, &cpu.ecx_1, &d) && (cpu.ecx_1 & bit_OSXSAVE))
        __asm__ volatile("xgetbv" : "=a"(cpu.saved), "=d"(d) : "c"(0));
    __get_cpuid_count(7, 0, &a, &cpu.ebx_7, &c, &d);
    __get_cpuid(0x80000001u, &a, &b, &cpu.ecx_extended, &d);
    return cpu;
}

static int has(unsigned word, unsigned bits) { return (word & bits) == bits; }

/* Each probe tests all extensions that setup.py compiles its unit with. */
static int cpu_has_simd128(void) { return has(ask_cpu().ecx_1, bit_SSSE3 | bit_SSE4_1 | bit_POPCNT); }

static int cpu_has_avx2(void)
{
    const cpu_words cpu = ask_cpu();
    return has(cpu.saved, SAVES_AVX2) && has(cpu.ecx_1, bit_AVX | bit_FMA | bit_POPCNT) &&
           has(cpu.ebx_7, bit_AVX2 | bit_BMI | bit_BMI2) && has(cpu.ecx_extended, bit_LZCNT);
}

static int cpu_has_avx512(void)
{
    const cpu_words cpu = ask_cpu();
    return cpu_has_avx2() && has(cpu.saved, SAVES_AVX512) &&
           has(cpu.ebx_7, bit_AVX512F | bit_AVX512BW | bit_AVX512DQ | bit_AVX512VL | bit_AVX512CD);
}
#else /* every processor has the unit's instructions: aarch64, WebAssembly */
static int cpu_has_simd128(void) { return 1; }
static int cpu_has_avx2(void) { return 0; }
static int cpu_has_avx512(void) { return 0; }
#endif

const char *tl_isa_name(int i_isa) { return i_isa >= 0 && i_isa < TL_N_ISA ? UNITS[i_isa].name : NULL; }

const char *tl_isa_flags(int i_isa) { return i_isa >= 0 && i_isa < TL_N_ISA ? UNITS[i_isa].flags : ""; }

int tl_isa_built(int i_isa) { return i_isa >= 0 && i_isa < TL_N_ISA && UNITS[i_isa].set != NULL; }

int tl_isa_runs(int i_isa)
{
    switch (i_isa) {
    case TL_ISA_SIMD128: return cpu_has_simd128();
    case TL_ISA_AVX2: return cpu_has_avx2();
    case TL_ISA_AVX512: return cpu_has_avx512();
    default: return 1;
    }
}

int tl_set_kernels(const char *name, tl_kernels *kernels)
{
    for (int i = 0; i < TL_N_ISA; i++)
        if (strcmp(UNITS[i].name, name) == 0 && tl_isa_built(i) && tl_isa_runs(i)) {
            kernels->isa = UNITS[i].name;
            UNITS[i].set(kernels);
            return 1;
        }
    return 0;
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
