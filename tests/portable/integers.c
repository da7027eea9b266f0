/* Reads lines of two integers of 128 bits and a small one, each integer as two words in hexadecimal, the high one first,
 * and prints what csrc/base/integers.h makes of them; tests/engine/test_integers.py compares it with Python's integers.
 * A pair that an operation does not take, or whose result does not fit, is the test's to leave out. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/integers.h"

static tl_int128 from_words(uint64_t high, uint64_t low)
{
    tl_int128 words = i128_shift_left(i128_from_u64(high & INT64_MAX), 64);
    if (high >> 63) /* -2^127, which no shift reaches */
        words = i128_sub(i128_sub(words, i128_shift_left(i128_from(1), 126)), i128_shift_left(i128_from(1), 126));
    return i128_or(words, i128_from_u64(low));
}

static void tell(const char *name, tl_int128 a)
{
    printf("%s %016" PRIx64 "%016" PRIx64 "\n", name, (uint64_t)i128_low(i128_shift_right(a, 64)),
           (uint64_t)i128_low(a));
}

static void tell_f64(const char *name, double a)
{
    uint64_t bits;
    memcpy(&bits, &a, sizeof bits);
    printf("%s %016" PRIx64 "\n", name, bits);
}

int main(void)
{
    uint64_t words[4];
    int n;
    char name[32];
    while (scanf("%31s %" SCNx64 "%" SCNx64 "%" SCNx64 "%" SCNx64 "%d", name, words, words + 1, words + 2, words + 3,
                 &n) == 6) {
        const tl_int128 a = from_words(words[0], words[1]), b = from_words(words[2], words[3]);
        const int64_t a64 = i128_low(a), b64 = i128_low(b);
        tl_int128 quotient, remainder;
        if (!strcmp(name, "from"))
            tell(name, i128_from(a64));
        else if (!strcmp(name, "add"))
            tell(name, i128_add(a, b));
        else if (!strcmp(name, "sub"))
            tell(name, i128_sub(a, b));
        else if (!strcmp(name, "neg"))
            tell(name, i128_neg(a));
        else if (!strcmp(name, "wrapping_sub"))
            tell(name, i128_wrapping_sub(a, b));
        else if (!strcmp(name, "product"))
            tell(name, i128_product(a64, b64));
        else if (!strcmp(name, "times"))
            tell(name, i128_times(a, b64));
        else if (!strcmp(name, "wrapping_times"))
            tell(name, i128_wrapping_times(a, b64));
        else if (!strcmp(name, "shift_left"))
            tell(name, i128_shift_left(a, n));
        else if (!strcmp(name, "shift_right"))
            tell(name, i128_shift_right(a, n));
        else if (!strcmp(name, "or"))
            tell(name, i128_or(a, b));
        else if (!strcmp(name, "min"))
            tell(name, i128_min(a, b));
        else if (!strcmp(name, "max"))
            tell(name, i128_max(a, b));
        else if (!strcmp(name, "less"))
            tell(name, i128_from(i128_less(a, b)));
        else if (!strcmp(name, "sign"))
            tell(name, i128_from(i128_sign(a)));
        else if (!strcmp(name, "is_zero"))
            tell(name, i128_from(i128_is_zero(a)));
        else if (!strcmp(name, "to_f64"))
            tell_f64(name, i128_to_f64(a));
        else if (!strcmp(name, "quotient"))
            i128_floor_divide(a, b, &quotient, &remainder), tell(name, quotient);
        else if (!strcmp(name, "remainder"))
            i128_floor_divide(a, b, &quotient, &remainder), tell(name, remainder);
        else
            return 1;
    }
    return 0;
}
