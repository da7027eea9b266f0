/* Calls the functions of the lanes with numbers that instruction sets treat each in its own way, and prints a hash of what
 * comes back: every set has to print the lines of scalar.  `tests/engine/test_lanes.py` and `.ci/portable` compare.
 *
 * Hard are: sums of products that a compiler may contract; NaN and signed zeros in minima; conversions out of range; bits
 * shifted out; products that saturate; sums in float64 that are rounded twice; numbers below 2^-126; masks whose lanes end
 * before memory does.  NaN that arithmetic makes has another sign on ARM than on x86: its bits are made one. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "lanes/lanes.h"

enum { N = 4096, ROOM = N + 64 };

static int32_t a_i[ROOM], b_i[ROOM], out_i[4 * ROOM];
static float a_f[ROOM], b_f[ROOM], c_f[ROOM], out_f[4 * ROOM];
static double a_d[4 * ROOM], b_d[ROOM], out_d[4 * ROOM];
static uint64_t words[ROOM];
static tl_vertex vertices[ROOM];

static uint64_t state = 20240607;
static uint32_t random_bits(void)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(state >> 32);
}

static void tell(const char *name, const void *bytes, size_t n)
{
    uint64_t hash = 0xcbf29ce484222325u;
    for (size_t i = 0; i < n; i++)
        hash = (hash ^ ((const uint8_t *)bytes)[i]) * 0x100000001b3u;
    printf("%s %016" PRIx64 "\n", name, hash);
}
static void tell_ints(const char *name) { tell(name, out_i, N * sizeof *out_i); }
static void tell_floats(const char *name) /* of arithmetic */
{
    for (int i = 0; i < N; i++)
        out_f[i] = out_f[i] == out_f[i] ? out_f[i] : NAN;
    tell(name, out_f, N * sizeof *out_f);
}
static void tell_doubles(const char *name)
{
    for (int i = 0; i < N; i++)
        out_d[i] = out_d[i] == out_d[i] ? out_d[i] : (double)NAN;
    tell(name, out_d, N * sizeof *out_d);
}

#define EACH(statement)                   \
    for (int i = 0; i < N; i += TL_LANES) \
        statement;
#define INTS(name, value)            \
    EACH(vi_store(out_i + i, value)) \
    tell_ints(name)
#define FLOATS(name, value)          \
    EACH(vf_store(out_f + i, value)) \
    tell_floats(name)
#define FLOAT_BITS(name, value)      \
    EACH(vf_store(out_f + i, value)) \
    tell(name, out_f, N * sizeof *out_f)
#define DOUBLES(name, value)         \
    EACH(vd_store(out_d + i, value)) \
    tell_doubles(name)
#define MASKS(name, mask) INTS(name, vi_select(mask, vi_set1(-1), vi_set1(0)))
#define AI vi_load(a_i + i)
#define BI vi_load(b_i + i)
#define AF vf_load(a_f + i)
#define BF vf_load(b_f + i)
#define CF vf_load(c_f + i)
#define AD vd_load(a_d + i)
#define BD vd_load(b_d + i)

/* ---- integers ---------------------------------------------------------------------------------------------------- */

static void make_ints(void)
{
    static const int32_t HARD[] = {
        0,          1,       -1,         INT32_MIN, INT32_MAX, 0x7fff,     0x8000,
        0xffff,     0x10000, 0x7fff8000, -0x8000,   -0x8001,   0x00ff00ff, 0x80008000 - 0x100000000,
        0x7f7f8080, 1 << 30};
    for (int i = 0; i < N; i++)
        a_i[i] = i < 256 ? HARD[i / 16] : (int32_t)random_bits(),
        b_i[i] = i < 256 ? HARD[i % 16] : (int32_t)random_bits();
}

static void test_ints(void)
{
    make_ints();
    INTS("add", vi_add(AI, BI));
    INTS("subtract", vi_sub(AI, BI));
    INTS("multiply", vi_mul(AI, BI));
    INTS("minimum", vi_min(AI, BI));
    INTS("maximum", vi_max(AI, BI));
    INTS("or, xor, and", vi_or(vi_xor(AI, BI), vi_and(AI, BI)));
    INTS("products of halves", vi_mul_halves(AI, BI));
    INTS("their upper halves", vi_mul_high_halves(AI, BI));
    INTS("sums of halves", vi_sub_halves(vi_add_halves(AI, BI), vi_set1(0x00010001)));
    INTS("sums of bytes", vi_add_bytes(AI, BI));
    INTS("extremes of bytes", vi_xor(vi_max_bytes(AI, BI), vi_min_bytes(AI, vi_upper_bytes(BI))));
    INTS("halves", vi_xor(vi_low_half(AI), vi_high_half(BI)));
    MASKS("greater", vi_gt(AI, BI));
    MASKS("greater, unsigned", vi_gt_unsigned(AI, BI));
    MASKS("equal, and not greater", vm_and_not(vm_or(vi_eq(AI, BI), vm_all()), vm_and(vi_gt(AI, BI), vm_all())));
    for (int n = 0; n < 32; n++) {
        INTS("shift", vi_xor(vi_shift_left(AI, n), vi_shift_right(BI, n)));
    }
    FLOATS("to float", vf_from_vi(AI));
    FLOATS("unsigned to float", vf_from_unsigned(AI));
    DOUBLES("to double", vd_from_vi(AI));
    /* differences of bytes times 128 at most: -2^15 by -2^15 is where saturating products differ */
    for (int i = 0; i < N; i++)
        a_i[i] = (int32_t)(((uint32_t)((a_i[i] & 0xffff) % 511 - 255) << 23) + (uint32_t)((a_i[i] >> 16 & 255) << 7));
    INTS("scaled halves", vi_scale_halves(AI, BI));
}

static void test_bits(void)
{
    make_ints();
    for (int i = 0; i < N; i++) /* ends at 31 and 32, and at 63 and 64 */
        a_i[i] = i % 97, b_i[i] = i / 97 % 32;
    INTS("ranges of bits", vi_bit_ranges(AI, BI));
    for (int i = 0; i < N; i++)
        b_i[i] = i / 97 * 3;
    EACH(vw_store(words + i, vw_add_range(i % 64 ? vw_load(words + i) : vw_zero(), AI, BI, 0x5555555555555555u)))
    tell("ranges of words", words, N * sizeof *words);
    for (int i = 0; i < N / 64; i++)
        bytes_from_bits((uint8_t *)out_i + 64 * i, (uint64_t)random_bits() << 32 | 0x0180ff01);
    tell("bytes of bits", out_i, N);
    make_ints();
    vi sum = vi_set1(0), before = vi_set1(7), counts = vi_set1(0);
    EACH((sum = vi_add(vi_prefix_sum(AI), vi_last(sum)), vi_store(out_i + i, sum)))
    tell_ints("running sum");
    EACH((vi_store(out_i + i, vi_shift_in(AI, before)), before = AI))
    tell_ints("one lane up");
    for (int i = 0; i < N; i++) /* AI > BI has every mask of eight lanes, twice */
        a_i[i] = i, b_i[i] = i + (i / 8 >> i % 8 & 1 ? -N : N);
    EACH((counts = vi_add(vi_prefix_count(vm_bits(vi_gt(AI, BI))), vi_last(counts)), vi_store(out_i + i, counts)))
    tell_ints("running count");
    int n = 0;
    EACH((vi_compress(out_i + n, vi_gt(AI, BI), BI), n += __builtin_popcount(vm_bits(vi_gt(AI, BI)))))
    tell("packed", out_i, (size_t)n * sizeof *out_i);
    MASKS("from bits", vm_from_bits(vm_bits(vi_gt(AI, BI))));
    EACH(out_i[i / TL_LANES] = vm_any(vi_eq(AI, vi_set1(a_i[i]))) + 2 * vm_any(vm_first(0)))
    tell("any", out_i, (size_t)(N / 16) * sizeof *out_i);
}

/* ---- float32 ----------------------------------------------------------------------------------------------------- */

static void make_floats(void)
{
    static const uint32_t HARD[] = {0,          0x80000000, 1,          0x807fffff, 0x00800000, 0x3f800000, 0xbf800000,
                                    0x3f800001, 0x4b000001, 0xcb800001, 0x4effffff, 0x4f000000, 0xcf000000, 0xcf000001,
                                    0x4f800000, 0x7f7fffff, 0x7f800000, 0xff800000, 0x7fc00000, 0xffc12345, 0x3effffff,
                                    0x3f000000, 0xbf000000, 0x3fc00000, 0x40200000, 0xc0200000, 0x1f800000, 0x9f800001,
                                    0x5f7fffff, 0x00ffffff, 0x4e7fffff, 0xce7fffff};
    for (int i = 0; i < N; i++) {
        const uint32_t near = random_bits();
        /* exponents within 2^+-8 of each other and of 1, and any */
        const uint32_t bits[3] = {i < 1024 ? HARD[i / 32] : (near & 0x807fffff) | (120 + (near >> 23 & 15)) << 23,
                                  i < 1024 ? HARD[i % 32] : random_bits(),
                                  i < 1024 ? HARD[(i * 7 + i / 32) % 32] : random_bits()};
        memcpy(a_f + i, bits, 4), memcpy(b_f + i, bits + 1, 4), memcpy(c_f + i, bits + 2, 4);
        if (i >= 2048) { /* sums of products that nearly cancel */
            b_f[i] = (float)(int32_t)random_bits() * 0x1p-31f;
            c_f[i] = -a_f[i] * b_f[i] * (i & 1 ? 1.0f : 0x1p24f);
        }
        if (i >= 3072) /* and that are tiny, or lie in the middle between two float32 in float64 */
            b_f[i] *= i & 2 ? 0x1p-126f : 0x1p-1f, c_f[i] = i & 2 ? -a_f[i] * b_f[i] : ldexpf(1.0f, i % 60 - 30);
        a_i[i] = i % 16, b_i[i] = (int32_t)random_bits();
    }
}

static void test_floats(void)
{
    make_floats();
    FLOATS("float: add", vf_add(AF, BF));
    FLOATS("float: subtract", vf_sub(AF, BF));
    FLOATS("float: multiply", vf_mul(AF, BF));
    FLOATS("float: divide", vf_div(AF, BF));
    FLOATS("float: square root", vf_sqrt(AF));
    FLOATS("multiply and add, apart", vf_add(vf_mul(AF, BF), CF));
    FLOATS("multiply and subtract, apart", vf_sub(CF, vf_mul(AF, BF)));
    FLOATS("multiply and add at once", vf_fma(AF, BF, CF));
    FLOAT_BITS("float: minimum", vf_min(AF, BF));
    FLOAT_BITS("float: maximum", vf_max(AF, BF));
    FLOAT_BITS("lesser size", vf_min_size(vf_max(AF, vf_set1(0.0f)), vf_select(vf_eq(BF, BF), BF, vf_set1(3.0f))));
    FLOAT_BITS("float: select", vf_select(vf_lt(AF, BF), AF, BF));
    MASKS("float: less", vf_lt(AF, BF));
    MASKS("float: not less", vf_ge(AF, BF));
    MASKS("float: equal", vf_eq(AF, BF));
    INTS("float: down to int", vi_floor(BF));
    INTS("float: nearest int", vi_nearest(BF));
    FLOATS("float: off integer", vf_add(vf_off_integer(vf_min(vf_mul(BF, BF), vf_set1(0x1p60f))), vf_set1(0.0f)));
    FLOAT_BITS("bits", vf_of_bits(vi_xor(vi_bits_of_vf(AF), BI)));
    FLOAT_BITS("float: of sixteen", vf_lookup(c_f, BI));
    INTS("of sixteen", vi_lookup(b_i, BI));
    DOUBLES("float to double", vd_from_vf(AF));
}

/* ---- float64 ----------------------------------------------------------------------------------------------------- */

static void make_doubles(void)
{
    static const double HARD[] = {0.0,
                                  -0.0,
                                  0.5,
                                  -0.5,
                                  1.5,
                                  2.5,
                                  -2.5,
                                  0x1p-1074,
                                  0x1p31,
                                  -0x1p31,
                                  0x1.fffffffffffffp30,
                                  -0x1.0000001p31,
                                  2147483647.25,
                                  2147483647.5,
                                  -2147483648.5,
                                  2147483646.5,
                                  0x1p52,
                                  0x1.8p51,
                                  -0x1p53,
                                  1e300,
                                  -1e-300,
                                  0x1p-149,
                                  0x1.8p-150,
                                  0x1.000001p0,
                                  0x1.000001000001p0,
                                  0x1.ffffffp127,
                                  0x1.fffffefp127,
                                  INFINITY,
                                  -INFINITY,
                                  NAN,
                                  1.0 / 3,
                                  0x1p-8};
    for (int i = 0; i < N; i++) {
        const double high = (double)(int32_t)random_bits(), low = 0x1p-32 * random_bits();
        const double any = ldexp(high + low, (int)(random_bits() % 200) - 100);
        a_d[i] = i < 1024 ? HARD[i / 32] : any;
        b_d[i] = i < 1024 ? HARD[i % 32] : (double)(int32_t)random_bits() * (i & 1 ? 1.0 : 0x1p-8);
    }
}

static void test_doubles(void)
{
    make_doubles();
    DOUBLES("double: add", vd_add(AD, BD));
    DOUBLES("double: subtract", vd_sub(AD, BD));
    DOUBLES("double: multiply", vd_mul(AD, BD));
    DOUBLES("double: divide", vd_div(AD, BD));
    DOUBLES("double: multiply and add, apart", vd_add(vd_mul(AD, BD), vd_sub(BD, vd_mul(AD, AD))));
    DOUBLES("double: square root", vd_sqrt(AD));
    DOUBLES("double: down", vd_floor(AD));
    DOUBLES("double: size", vd_abs(AD));
    EACH(vd_store(out_d + i, vd_select(vd_ge(AD, BD), vd_min(AD, BD), vd_max(AD, BD))))
    tell("double: extremes", out_d, N * sizeof *out_d);
    EACH(vd_store(out_d + i, vd_or(vd_power(AD, 0x7fe0000000000000u, 0x7ff0000000000000u), vd_set1(0.0))))
    tell("double: bits", out_d, N * sizeof *out_d);
    FLOATS("double to float", vf_from_vd(AD));
    INTS("double: nearest int", vi_round(AD));
    INTS("double: nearest int of halves", vi_round(BD));
    INTS("double: up to int", vi_ceil(AD));
    INTS("double: low bits", vi_low_bits(AD));
    const vd small = vd_set1(0x1p40), zero = vd_set1(0.0);
    DOUBLES("double: off integer", vd_add(vd_off_integer(vd_select(vd_ge(small, vd_abs(BD)), BD, zero)), zero));
    DOUBLES("double: off 256th", vd_add(vd_off_256th(vd_select(vd_ge(small, vd_abs(BD)), BD, zero)), zero));
    for (int are_f32 = 0; are_f32 < 2; are_f32++) {
        for (int i = 0; i < N; i++) {
            const double way = are_f32 ? 0x1p-31 : 1.0 / 3;
            a_d[i] = are_f32 ? (double)(float)((int32_t)random_bits() * way) : (int32_t)random_bits() * way;
            b_d[i] = (double)(float)((random_bits() | 1) * 0x1p-30) * (are_f32 ? 1.0 : 1.0 + 0x1p-50);
        }
        for (int k = 0; k < 3; k++) {
            for (int i = 0; i < N; i += TL_LANES) {
                const vd a[3] = {AD, vd_sub(zero, AD), vd_mul(AD, AD)};
                vd q[3];
                vd_quotients(a, BD, q, are_f32);
                vd_store(out_d + i, q[are_f32 && k == 2 ? 0 : k]);
            }
            tell_doubles("three quotients");
        }
    }
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static void test_masked(void)
{
    make_ints();
    for (int n = 0; n < 40; n++) {
        memset(out_i, 7, sizeof out_i);
        for (int i = 0; i < n; i += TL_LANES) {
            const vm m = vm_and_not(vm_first(n - i), vi_gt(vi_set1(0), BI));
            const vi loaded = vi_select(m, vi_load_some(m, a_i + i, 1), vi_load_masked(m, a_i + i));
            vi_store_masked(out_i + i, m, loaded);
            vi_store_some(out_i + 64 + i, m, loaded, n & 1);
            vf_store_some((float *)out_i + 128 + i, m, vf_load_masked(m, (const float *)a_i + i), n & 1);
            vf_store_masked((float *)out_i + 192 + i, m, vf_load_some(m, (const float *)a_i + i, 0));
            vi_store(out_i + 256 + i, vi_gather(m, b_i, vi_and(AI, vi_set1(1023))));
        }
        memset(out_i + 256 + n, 0, 64 * sizeof *out_i); /* behind the end: as many as there are lanes */
        tell("masked", out_i, 320 * sizeof *out_i);
    }
}

static void test_columns(void)
{
    make_ints(), make_floats(), make_doubles();
    for (int i = 0; i < N; i++)
        vertices[i] = (tl_vertex){a_i[i], b_i[i], a_d[i]}, words[i] = random_bits();
    for (int i = 0; i < N; i++)
        a_i[i] = (int32_t)(random_bits() % (N / 4 - 4));
    for (int i = 0; i < N / 4; i += TL_LANES) {
        vi x, y, q[4];
        vz z;
        vf c[4];
        vd d[4];
        load_vertices(vertices, a_i + 3 * i, &x, &y, &z);
        store_vertices((tl_vertex *)(void *)(out_d + 2 * i), x, y, vd_from_vz(z));
        load_columns_f32(b_f + 3 * i, 3, c);
        vf_store(out_f + i, c[2]), vf_store_pairs(out_f + N + 2 * i, c), vf_store_triples(out_f + 2 * N + 3 * i, c);
        vf_store_fourths(b_f + 4 * i, c[0],
                         out_f + 3 * N + 4 * i < out_f + 4 * ROOM - 64 ? out_f + 3 * N + 4 * i : out_f);
        vi_load_records(b_f, 12, a_i + i, q);
        vi_store(out_i + i, vi_xor(vi_xor(q[0], q[1]), vi_xor(q[2], vi_shift_left(q[3], 3))));
        vi_load_records(b_f, 8, a_i + i, q);
        vf_load_pairs(b_f, a_i + i, c);
        vi_store(out_i + N + i, vi_xor(vi_xor(q[0], vi_shift_left(q[1], 1)), vi_xor(vi_shift_left(q[2], 2), q[3])));
        vi_store(out_i + 2 * N + i, vi_xor(vi_bits_of_vf(c[0]), vi_shift_left(vi_bits_of_vf(c[1]), 1)));
        vd_load_records(b_d, 3, a_i + i, d);
        vd_store(out_d + N + i, vd_or(d[3], d[1])), vd_store(out_d + N + N / 4 + i, vd_or(d[2], d[0]));
        vd_load_triples(b_d, a_i + 3 * i, d, d + 1, d + 2);
        vd_store_places(out_d + 2 * N + 4 * i, d[0], d[1], d[2], q[0], q[1]);
        vd_load_pairs(b_d, 2, a_i + 3 * i, d, d + 1);
        vd_store(out_d + 3 * N + i, vd_or(d[0], d[0])), vd_store(out_d + 3 * N + N / 4 + i, d[1]);
        load_columns_f64(b_d + 4 * (i % 512), 4, d);
        vd_store(out_d + 3 * N + N / 2 + i, d[3]);
    }
    tell("vertices", out_d, N / 2 * sizeof *out_d);
    tell("columns of float", out_f, N / 4 * sizeof *out_f);
    tell("pairs of float", out_f + N, N / 2 * sizeof *out_f);
    tell("triples of float", out_f + 2 * N, 3 * N / 4 * sizeof *out_f);
    tell("fourths", out_f + 3 * N, N * sizeof *out_f);
    for (int k = 0; k < 3; k++)
        tell("records", out_i + k * N, N / 4 * sizeof *out_i);
    tell("records of double", out_d + N, N / 2 * sizeof *out_d);
    tell("triples and places", out_d + 2 * N, N * sizeof *out_d);
    tell("pairs and columns", out_d + 3 * N, 3 * N / 4 * sizeof *out_d);
    for (int i = 0; i < N / 4; i += TL_LANES) {
        vi x, y, c[4];
        vd d[3];
        vd_load_places(out_d + 2 * N, a_i + 3 * i < a_i + N ? a_i + 3 * i : a_i, d, d + 1, d + 2, &x, &y);
        vi_store(out_i + i, vi_xor(vi_xor(x, vi_shift_left(y, 1)), vi_low_bits(vd_or(d[0], d[2]))));
        for (int k = 0; k < 4; k++)
            c[k] = vi_load(b_i + k * (N / 4) + i);
        vi_store_quads(out_i + N + 4 * i, c);
        for (int k = 0; k < TL_LANES; k++) /* in the order of the lanes */
            v4_store(out_i + 2 * N + 4 * (i + k),
                     v4_add(v4_or(v4_load(out_i + N + 4 * (i + vi_quad_slot(k))), v4_zero()), v4_load(b_i)));
        vi_load_quads(out_i + N + 4 * i, c);
        vi_store(out_i + 3 * N + i, vi_xor(c[3], c[1]));
    }
    tell("places", out_i, N / 4 * sizeof *out_i);
    tell("quads", out_i + 2 * N, N * sizeof *out_i);
    tell("quads again", out_i + 3 * N, N / 4 * sizeof *out_i);
}

int main(void)
{
    test_ints(), test_bits(), test_floats(), test_doubles(), test_masked(), test_columns();
    return 0;
}
