/* Integers of 128 bits: the compiler's where it has them, otherwise a struct of two words; both give equal bits.
 * Also of 64 bits with like names, for code that is written once for both.
 *
 * Only functions named `wrapping` may overflow.  The struct serves 32-bit machines, and Windows: its libraries cannot
 * divide 128 bits; TL_NO_INT128 forces it.  tests/engine/test_integers.py holds both to Python's integers. */
#ifndef TL_INTEGERS_H
#define TL_INTEGERS_H

#include <math.h>
#include <stdint.h>

_Static_assert((-3 >> 1) == -2, "a right shift of a negative number must floor");

#if defined(__SIZEOF_INT128__) && !defined(TL_NO_INT128) && !defined(_WIN32)

typedef __int128 tl_int128;
typedef unsigned __int128 tl_uint128;

static inline tl_int128 i128_from(int64_t a) { return a; }
static inline tl_int128 i128_from_u64(uint64_t a) { return (tl_int128)a; }
static inline int64_t i128_low(tl_int128 a) { return (int64_t)a; } /* modulo 2^64 */
static inline double i128_to_f64(tl_int128 a) { return (double)a; }
static inline tl_int128 i128_add(tl_int128 a, tl_int128 b) { return a + b; }
static inline tl_int128 i128_sub(tl_int128 a, tl_int128 b) { return a - b; }
static inline tl_int128 i128_product(int64_t a, int64_t b) { return (tl_int128)a * b; }
static inline tl_int128 i128_times(tl_int128 a, int64_t b) { return a * b; }
static inline tl_int128 i128_shift_left(tl_int128 a, int n) { return a * ((tl_int128)1 << n); } /* n < 127 */
static inline tl_int128 i128_shift_right(tl_int128 a, int n) { return a >> n; }                 /* floor(a / 2^n) */
static inline tl_int128 i128_or(tl_int128 a, tl_int128 b) { return a | b; }
static inline int i128_is_negative(tl_int128 a) { return a < 0; }
static inline int i128_is_zero(tl_int128 a) { return a == 0; }
static inline int i128_less(tl_int128 a, tl_int128 b) { return a < b; }

/* Modulo 2^128. */
static inline tl_int128 i128_wrapping_sub(tl_int128 a, tl_int128 b)
{
    return (tl_int128)((tl_uint128)a - (tl_uint128)b);
}
static inline tl_int128 i128_wrapping_times(tl_int128 a, int64_t b)
{
    return (tl_int128)((tl_uint128)a * (tl_uint128)(tl_int128)b);
}

/* Quotient and remainder for b > 0, rounded down. */
static inline void i128_floor_divide(tl_int128 a, tl_int128 b, tl_int128 *quotient, tl_int128 *remainder)
{
    const tl_int128 q = a / b, r = a - q * b;
    *quotient = q - (r < 0);
    *remainder = r < 0 ? r + b : r;
}

#else

/* Two's complement: high * 2^64 + low. */
typedef struct {
    uint64_t low;
    int64_t high;
} tl_int128;

static inline tl_int128 i128_from(int64_t a) { return (tl_int128){(uint64_t)a, -(a < 0)}; }
static inline tl_int128 i128_from_u64(uint64_t a) { return (tl_int128){a, 0}; }
static inline int64_t i128_low(tl_int128 a) { return (int64_t)a.low; }
static inline tl_int128 i128_or(tl_int128 a, tl_int128 b) { return (tl_int128){a.low | b.low, a.high | b.high}; }
static inline int i128_is_negative(tl_int128 a) { return a.high < 0; }
static inline int i128_is_zero(tl_int128 a) { return a.high == 0 && a.low == 0; }
static inline int i128_less(tl_int128 a, tl_int128 b) { return a.high < b.high || (a.high == b.high && a.low < b.low); }

static inline tl_int128 i128_add(tl_int128 a, tl_int128 b)
{
    const uint64_t low = a.low + b.low;
    return (tl_int128){low, (int64_t)((uint64_t)a.high + (uint64_t)b.high + (low < a.low))};
}
static inline tl_int128 i128_wrapping_sub(tl_int128 a, tl_int128 b)
{
    return (tl_int128){a.low - b.low, (int64_t)((uint64_t)a.high - (uint64_t)b.high - (a.low < b.low))};
}
static inline tl_int128 i128_sub(tl_int128 a, tl_int128 b) { return i128_wrapping_sub(a, b); }

/* Both words of a product of two words, by halves of 32 bits: no sum of them reaches 2^64. */
static inline tl_int128 i128_product_u64(uint64_t a, uint64_t b)
{
    const uint64_t half = 0xffffffffu, a0 = a & half, a1 = a >> 32, b0 = b & half, b1 = b >> 32;
    const uint64_t middle = a1 * b0 + (a0 * b0 >> 32), other = a0 * b1 + (middle & half);
    return (tl_int128){other << 32 | (a0 * b0 & half), (int64_t)(a1 * b1 + (middle >> 32) + (other >> 32))};
}
/* A negative factor counts 2^64 times the other factor too much. */
static inline tl_int128 i128_wrapping_times(tl_int128 a, int64_t b)
{
    const tl_int128 low = i128_product_u64(a.low, (uint64_t)b);
    const uint64_t high = (uint64_t)low.high + (uint64_t)a.high * (uint64_t)b - (b < 0 ? a.low : 0);
    return (tl_int128){low.low, (int64_t)high};
}
static inline tl_int128 i128_times(tl_int128 a, int64_t b) { return i128_wrapping_times(a, b); }
static inline tl_int128 i128_product(int64_t a, int64_t b) { return i128_wrapping_times(i128_from(a), b); }

static inline tl_int128 i128_shift_left(tl_int128 a, int n)
{
    if (n == 0)
        return a;
    if (n >= 64)
        return (tl_int128){0, (int64_t)(a.low << (n - 64))};
    return (tl_int128){a.low << n, (int64_t)((uint64_t)a.high << n | a.low >> (64 - n))};
}
static inline tl_int128 i128_shift_right(tl_int128 a, int n)
{
    if (n == 0)
        return a;
    if (n >= 64)
        return (tl_int128){(uint64_t)(a.high >> (n - 64)), -(a.high < 0)};
    return (tl_int128){a.low >> n | (uint64_t)a.high << (64 - n), a.high >> n};
}

/* Rounded to nearest, ties to even.  A number of more than 64 bits is converted from its first 64, with the last of
 * them set if any later bit is: float64 has no room for it, but rounds by it. */
static inline double i128_to_f64(tl_int128 a)
{
    tl_int128 size = a.high < 0 ? i128_wrapping_sub(i128_from(0), a) : a; /* unsigned from here on: may be 2^127 */
    int exponent = 0;
    if (size.high != 0) {
        uint64_t high = (uint64_t)size.high, low = size.low;
        for (exponent = 64; !(high >> 63); exponent--)
            high = high << 1 | low >> 63, low <<= 1;
        size.low = high | (low != 0);
    }
    const double value = ldexp((double)size.low, exponent);
    return a.high < 0 ? -value : value;
}

/* Quotient and remainder for b > 0, rounded down: by the machine if both fit one word, otherwise bit by bit. */
static inline void i128_floor_divide(tl_int128 a, tl_int128 b, tl_int128 *quotient, tl_int128 *remainder)
{
    const int is_negative = a.high < 0;
    uint64_t high = (uint64_t)a.high ^ -(uint64_t)is_negative, low = a.low ^ -(uint64_t)is_negative; /* a, or -a - 1 */
    tl_int128 q = {0, 0}, r = {0, 0};
    if (high == 0 && b.high == 0) {
        q.low = low / b.low, r.low = low % b.low;
    } else {
        for (int k = 0; k < 128; k++) { /* r < b < 2^127, so 2 r < 2^128 */
            const uint64_t next = high >> 63;
            high = high << 1 | low >> 63, low <<= 1;
            uint64_t r_high = (uint64_t)r.high << 1 | r.low >> 63, r_low = r.low << 1 | next;
            const int fits = r_high > (uint64_t)b.high || (r_high == (uint64_t)b.high && r_low >= b.low);
            q = (tl_int128){q.low << 1 | (unsigned)fits, (int64_t)((uint64_t)q.high << 1 | q.low >> 63)};
            if (fits)
                r_high -= (uint64_t)b.high + (r_low < b.low), r_low -= b.low;
            r = (tl_int128){r_low, (int64_t)r_high};
        }
    }
    if (is_negative) { /* a = -(q b + r) - 1 = (-q - 1) b + (b - 1 - r) */
        q = (tl_int128){~q.low, ~q.high};
        r = i128_wrapping_sub(i128_wrapping_sub(b, i128_from(1)), r);
    }
    *quotient = q;
    *remainder = r;
}

#endif

static inline tl_int128 i128_neg(tl_int128 a) { return i128_sub(i128_from(0), a); }
static inline int i128_sign(tl_int128 a) { return i128_less(i128_from(0), a) - i128_is_negative(a); }
static inline tl_int128 i128_min(tl_int128 a, tl_int128 b) { return i128_less(b, a) ? b : a; }
static inline tl_int128 i128_max(tl_int128 a, tl_int128 b) { return i128_less(a, b) ? b : a; }

static inline int64_t i64_from(int64_t a) { return a; }
static inline int64_t i64_low(int64_t a) { return a; }
static inline int64_t i64_add(int64_t a, int64_t b) { return a + b; }
static inline int64_t i64_sub(int64_t a, int64_t b) { return a - b; }
static inline int64_t i64_neg(int64_t a) { return -a; }
static inline int64_t i64_product(int64_t a, int64_t b) { return a * b; }
static inline int64_t i64_shift_left(int64_t a, int n) { return a * ((int64_t)1 << n); } /* n < 63 */
static inline int64_t i64_shift_right(int64_t a, int n) { return a >> n; }
static inline int64_t i64_or(int64_t a, int64_t b) { return a | b; }
static inline int i64_is_negative(int64_t a) { return a < 0; }
static inline int i64_is_zero(int64_t a) { return a == 0; }
static inline int i64_less(int64_t a, int64_t b) { return a < b; }
static inline int64_t i64_min(int64_t a, int64_t b) { return b < a ? b : a; }
static inline int64_t i64_max(int64_t a, int64_t b) { return a < b ? b : a; }
static inline int64_t i64_wrapping_sub(int64_t a, int64_t b) { return (int64_t)((uint64_t)a - (uint64_t)b); }
static inline int64_t i64_wrapping_times(int64_t a, int64_t b) { return (int64_t)((uint64_t)a * (uint64_t)b); }
static inline void i64_floor_divide(int64_t a, int64_t b, int64_t *quotient, int64_t *remainder)
{
    const int64_t q = a / b, r = a % b;
    *quotient = q - (r < 0);
    *remainder = r < 0 ? r + b : r;
}

#endif
