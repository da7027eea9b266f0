/* Sign: on which side of an edge a point lies, and how far, for any finite float64 numbers, exactly.
 * In: two ends of an edge and a point.  Out: the sign of E = (x1 - x0)(py - y0) - (y1 - y0)(px - x0), or E itself to
 * within 2^-50 of its size.
 *
 * Four methods, each used where the method before it cannot decide: the rounded E and a bound on its error; exact
 * differences, with products compared by rounded value and then by error; sums of floating-point numbers that do not
 * overlap; integers of 2176 bits: every finite float64 is an integer in units of 2^-1074.
 *
 * Based on: J. R. Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates, 1997. */
#ifndef TL_SIGN_C
#define TL_SIGN_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"
#include "vertex/exact.h"

typedef struct {
    double x, y;
} exact_point;

/* mantissa * 2^exponent */
typedef struct {
    double mantissa;
    int exponent;
} scaled_number;

TL_INLINE exact_point point_of(const tl_exact_points *points, int32_t i)
{
    const double *p = points->points + (int64_t)i * points->stride;
    return (exact_point){p[0], p[1]};
}

/* a + b = sum + error, exactly (D. E. Knuth); a * b = product + error, exactly while neither overflows or
 * underflows. */
TL_INLINE void two_sum(double a, double b, double *sum, double *error)
{
    *sum = a + b;
    const double of_b = *sum - a;
    *error = (a - (*sum - of_b)) + (b - of_b);
}
TL_INLINE void two_difference(double a, double b, double *sum, double *error) { two_sum(a, -b, sum, error); }
TL_INLINE void two_product(double a, double b, double *product, double *error)
{
    *product = a * b;
    *error = fma(a, b, -*product);
}

/* ---- integers ------------------------------------------------------------------------------------------ */

#define TL_BIG_WORDS 68
#define TL_LEAST_EXPONENT -1074

typedef struct {
    uint32_t words[TL_BIG_WORDS];
} big_number;
typedef struct {
    uint32_t words[2 * TL_BIG_WORDS];
} big_product;

/* |value| */
static void set_big(double value, big_number *out)
{
    memset(out, 0, sizeof *out);
    if (value == 0.0 || !isfinite(value)) /* not finite: the vertex has changed since the check */
        return;
    int exponent;
    uint64_t mantissa = (uint64_t)ldexp(frexp(fabs(value), &exponent), 53);
    int shift = exponent - 53 - TL_LEAST_EXPONENT;
    if (shift < 0) { /* denormal: the bits shifted out are 0 */
        mantissa >>= -shift;
        shift = 0;
    }
    const int places = shift & 31, word = shift >> 5;
    out->words[word] = (uint32_t)(mantissa << places);
    out->words[word + 1] = (uint32_t)(mantissa << places >> 32);
    out->words[word + 2] = places ? (uint32_t)(mantissa >> (64 - places)) : 0;
}

static int compare_words(const uint32_t *a, const uint32_t *b, int n)
{
    for (int k = n; k--;)
        if (a[k] != b[k])
            return a[k] < b[k] ? -1 : 1;
    return 0;
}

/* a + b, and a - b of a >= b, n words each */
static void add_words(const uint32_t *a, const uint32_t *b, int n, uint32_t *out)
{
    uint64_t carry = 0;
    for (int k = 0; k < n; k++) {
        carry += (uint64_t)a[k] + b[k];
        out[k] = (uint32_t)carry;
        carry >>= 32;
    }
}
static void subtract_words(const uint32_t *a, const uint32_t *b, int n, uint32_t *out)
{
    int64_t carry = 0;
    for (int k = 0; k < n; k++) {
        carry += (int64_t)a[k] - b[k];
        out[k] = (uint32_t)carry;
        carry >>= 32;
    }
}

/* |a - b|; returns the sign of a - b */
static int big_difference(double a, double b, big_number *out)
{
    big_number big_a, big_b;
    set_big(a, &big_a);
    set_big(b, &big_b);
    if ((a < 0.0) != (b < 0.0))
        add_words(big_a.words, big_b.words, TL_BIG_WORDS, out->words);
    else if (compare_words(big_a.words, big_b.words, TL_BIG_WORDS) < 0)
        subtract_words(big_b.words, big_a.words, TL_BIG_WORDS, out->words);
    else
        subtract_words(big_a.words, big_b.words, TL_BIG_WORDS, out->words);
    return (a > b) - (a < b);
}

static void multiply_big(const big_number *a, const big_number *b, big_product *out)
{
    memset(out, 0, sizeof *out);
    for (int i = 0; i < TL_BIG_WORDS; i++) {
        uint64_t carry = 0;
        for (int k = 0; a->words[i] && k < TL_BIG_WORDS; k++) {
            carry += (uint64_t)a->words[i] * b->words[k] + out->words[i + k];
            out->words[i + k] = (uint32_t)carry;
            carry >>= 32;
        }
        out->words[i + TL_BIG_WORDS] = (uint32_t)carry;
    }
}

/* |E|, in 2^-2148; returns its sign */
static int big_edge(exact_point a, exact_point b, exact_point p, big_product *out)
{
    big_number factors[4];
    big_product left, right;
    const int sign_left = big_difference(b.x, a.x, &factors[0]) * big_difference(p.y, a.y, &factors[1]);
    const int sign_right = big_difference(b.y, a.y, &factors[2]) * big_difference(p.x, a.x, &factors[3]);
    const int n = 2 * TL_BIG_WORDS;
    multiply_big(&factors[0], &factors[1], &left);
    multiply_big(&factors[2], &factors[3], &right);
    if (sign_left != sign_right) { /* different signs, or one is 0 */
        add_words(left.words, right.words, n, out->words);
        return sign_left > sign_right ? 1 : -1;
    }
    const int order = compare_words(left.words, right.words, n);
    if (order < 0)
        subtract_words(right.words, left.words, n, out->words);
    else
        subtract_words(left.words, right.words, n, out->words);
    return sign_left * order;
}

static scaled_number big_edge_value(exact_point a, exact_point b, exact_point p)
{
    big_product size;
    const int sign = big_edge(a, b, p, &size);
    int top = 2 * TL_BIG_WORDS - 1;
    while (top > 2 && !size.words[top])
        top--;
    double mantissa = 0.0; /* from the first 65 bits or more: the rest is below 2^-64 of them */
    for (int k = 0; k < 3; k++)
        mantissa = mantissa * 0x1p32 + size.words[top - k];
    return (scaled_number){sign < 0 ? -mantissa : mantissa, 32 * (top - 2) + 2 * TL_LEAST_EXPONENT};
}

/* ---- sums that do not overlap -------------------------------------------------------------------------- */

#define TL_EXPANSION 17

/* Adds a number to a sum of n numbers of ascending size that do not overlap; returns the new n.  Zeros are dropped. */
TL_INLINE int grow_sum(double *sum, int n, double term)
{
    int n_kept = 0;
    for (int i = 0; i < n; i++) {
        double total, error;
        two_sum(term, sum[i], &total, &error);
        term = total;
        if (error != 0.0)
            sum[n_kept++] = error;
    }
    if (term != 0.0)
        sum[n_kept++] = term;
    return n_kept;
}

/* E as a sum of up to 16 numbers of ascending size that do not overlap, so that the last number has its sign; returns
 * their number.  Exact while no number but 0 is below 2^-440 or above 2^500: every product of parts is then a multiple
 * of 2^-1074 and below 2^1004. */
static int expand_edge(exact_point a, exact_point b, exact_point p, double *sum)
{
    double left[2][2], right[2][2], terms[16];
    int n_terms = 0, n = 0;
    two_difference(b.x, a.x, &left[0][0], &left[0][1]);
    two_difference(p.y, a.y, &left[1][0], &left[1][1]);
    two_difference(b.y, a.y, &right[0][0], &right[0][1]);
    two_difference(p.x, a.x, &right[1][0], &right[1][1]);
    for (int i = 2; i--;)
        for (int k = 2; k--;) {
            double product, error;
            two_product(left[0][i], left[1][k], &product, &error);
            terms[n_terms++] = error, terms[n_terms++] = product;
            two_product(right[0][i], right[1][k], &product, &error);
            terms[n_terms++] = -error, terms[n_terms++] = -product;
        }
    for (int k = 0; k < n_terms; k++)
        n = grow_sum(sum, n, terms[k]);
    return n;
}

TL_INLINE int is_in_range(double v) { return v == 0.0 || (fabs(v) >= 0x1p-440 && fabs(v) <= 0x1p500); }
TL_INLINE int are_in_range(exact_point a, exact_point b, exact_point p)
{
    return is_in_range(a.x) && is_in_range(a.y) && is_in_range(b.x) && is_in_range(b.y) && is_in_range(p.x) &&
           is_in_range(p.y);
}

/* ---- signs ----------------------------------------------------------------------------------------------- */

static __attribute__((noinline)) int slow_sign(exact_point a, exact_point b, exact_point p)
{
    double dx, dy, px, py, dx_error, dy_error, px_error, py_error;
    two_difference(b.x, a.x, &dx, &dx_error);
    two_difference(b.y, a.y, &dy, &dy_error);
    two_difference(p.x, a.x, &px, &px_error);
    two_difference(p.y, a.y, &py, &py_error);
    const double size = fabs(dx * py) + fabs(dy * px);
    const int is_safe =
        size == 0.0 ? (dx == 0.0 || py == 0.0) && (dy == 0.0 || px == 0.0) : size > 1e-200 && size < 1e300;
    if (dx_error == 0.0 && dy_error == 0.0 && px_error == 0.0 && py_error == 0.0 && is_safe) {
        /* Products round monotonically; where they round to one number, their errors decide.  A product may underflow
         * only where the other is larger by far. */
        double left, right, left_error, right_error;
        two_product(dx, py, &left, &left_error);
        two_product(dy, px, &right, &right_error);
        return left != right ? (left > right) - (left < right)
                             : (left_error > right_error) - (left_error < right_error);
    }
    if (are_in_range(a, b, p)) {
        double sum[TL_EXPANSION];
        const int n = expand_edge(a, b, p, sum);
        return n ? (sum[n - 1] > 0.0) - (sum[n - 1] < 0.0) : 0;
    }
    big_product size_of_edge;
    return big_edge(a, b, p, &size_of_edge);
}

/* The rounded E; *bound is its largest error (Shewchuk's A), if nothing overflows or underflows. */
TL_INLINE double rounded_edge(exact_point a, exact_point b, exact_point p, double *bound)
{
    const double left = (b.x - a.x) * (p.y - a.y), right = (b.y - a.y) * (p.x - a.x);
    const double size = fabs(left) + fabs(right);
    *bound = size > 1e-280 && size < 1e300 ? (3.0 + 16.0 * 0x1p-53) * 0x1p-53 * size : INFINITY;
    return left - right;
}

TL_INLINE int edge_sign(exact_point a, exact_point b, exact_point p)
{
    double bound;
    const double e = rounded_edge(a, b, p, &bound);
    if (fabs(e) > bound)
        return e > 0.0 ? 1 : -1;
    return slow_sign(a, b, p);
}

/* The point at which an edge is tested: the sample; or for the square with its upper left corner there, the corner
 * farthest inside (OUTER) or outside (INNER), see walk.h. */
TL_INLINE exact_point tested_point(exact_point a, exact_point b, exact_point p, tl_test test)
{
    const int is_outer = test == TL_TEST_OUTER;
    if (test == TL_TEST_SAMPLE)
        return p;
    return (exact_point){p.x + (is_outer == (b.y < a.y)), p.y + (is_outer == (b.x > a.x))};
}

/* Whether a point lies on the inner side of an edge of a triangle with positive area, or on the edge if it is a top or
 * left edge.  Two triangles that share the edge decide by one number with opposite signs, and exactly one of them owns
 * a tie: no gaps, no overlap.  For squares a tie is inside for INNER alone. */
TL_INLINE int is_inside_edge(exact_point a, exact_point b, exact_point p, tl_test test)
{
    const int sign = edge_sign(a, b, tested_point(a, b, p, test));
    if (sign || test != TL_TEST_SAMPLE)
        return sign > 0 || (sign == 0 && test == TL_TEST_INNER);
    return b.y < a.y || (b.y == a.y && b.x > a.x);
}

static int is_inside(const exact_point *corners, exact_point p, tl_test test)
{
    return is_inside_edge(corners[0], corners[1], p, test) &&
           is_inside_edge(corners[1], corners[2], p, test) &&
           is_inside_edge(corners[2], corners[0], p, test);
}

/* E to within 2^-50 of its size. */
static scaled_number edge_value(exact_point a, exact_point b, exact_point p)
{
    double sum[TL_EXPANSION], total = 0.0;
    if (!are_in_range(a, b, p))
        return big_edge_value(a, b, p);
    const int n = expand_edge(a, b, p, sum);
    for (int k = 0; k < n; k++)
        total += sum[k];
    return (scaled_number){total, 0};
}

/* An edge function at a point, times an integer of up to 10 bits. */
typedef struct {
    exact_point a, b, p;
    int factor;
} edge_term;

/* The sign of a sum of n edge functions, in integers: positive terms against negative ones. */
static int big_terms_sign(const edge_term *terms, int n)
{
    const int n_words = 2 * TL_BIG_WORDS;
    big_product sums[2], size;
    memset(sums, 0, sizeof sums);
    for (int k = 0; k < n; k++) {
        const int sign = big_edge(terms[k].a, terms[k].b, terms[k].p, &size) * (terms[k].factor < 0 ? -1 : 1);
        const uint64_t factor = (uint64_t)(terms[k].factor < 0 ? -terms[k].factor : terms[k].factor);
        uint64_t carry = 0;
        for (int i = 0; i < n_words; i++) { /* |E| is below 2^4200, the words have 4352 bits */
            carry += factor * size.words[i];
            size.words[i] = (uint32_t)carry;
            carry >>= 32;
        }
        if (sign)
            add_words(sums[sign < 0].words, size.words, n_words, sums[sign < 0].words);
    }
    return compare_words(sums[0].words, sums[1].words, n_words);
}

#define TL_MAX_TERMS 3

/* The sign of a sum of n edge functions, by expansions of float64 where they are in range, else by big_terms_sign. */
static int terms_sign(const edge_term *terms, int n)
{
    double sum[2 * 16 * TL_MAX_TERMS + 1];
    int n_sum = 0;
    for (int k = 0; k < n; k++) {
        double edge[TL_EXPANSION], product, error;
        if (!are_in_range(terms[k].a, terms[k].b, terms[k].p))
            return big_terms_sign(terms, n);
        const int n_edge = expand_edge(terms[k].a, terms[k].b, terms[k].p, edge);
        for (int i = 0; i < n_edge; i++) {
            two_product(edge[i], terms[k].factor, &product, &error);
            n_sum = grow_sum(sum, n_sum, error);
            n_sum = grow_sum(sum, n_sum, product);
        }
    }
    return n_sum ? (sum[n_sum - 1] > 0.0) - (sum[n_sum - 1] < 0.0) : 0;
}

/* The quotient of two scaled numbers; both are within the range of a float64 after one shift. */
TL_INLINE double scaled_quotient(scaled_number a, scaled_number b)
{
    int shift_a, shift_b;
    const double quotient = frexp(a.mantissa, &shift_a) / frexp(b.mantissa, &shift_b);
    return ldexp(quotient, a.exponent + shift_a - b.exponent - shift_b);
}

#endif
