/* Angles from their tangents, equal on every instruction set. */
#ifndef TL_ANGLE_H
#define TL_ANGLE_H

#include "lanes/lanes.h"

/* The angle with tangent y / x, for y >= 0 and an x that is positive up to rounding; 0 for 0 and 0.  The quotient is
 * rotated by 0, 45 or 90 degrees to within tan(22.5 degrees) of 0, where the polynomial is within 2^-56 of atan(q) /
 * q. */
TL_INLINE vd angle_of(vd y, vd x)
{
    const vd slope = vd_set1(0x1.a827999fcef32p-2), zero = vd_set1(0.0);
    const vm is_low = vd_ge(vd_mul(x, slope), y), is_high = vd_ge(vd_mul(y, slope), x);
    const vd above = vd_select(is_low, y, vd_select(is_high, vd_sub(zero, x), vd_sub(y, x)));
    const vd below = vd_select(is_low, x, vd_select(is_high, y, vd_add(y, x)));
    const vd start =
        vd_select(is_low, zero, vd_select(is_high, vd_set1(0x1.921fb54442d18p+0), vd_set1(0x1.921fb54442d18p-1)));
    const vm is_none = vd_ge(zero, below);
    const vd q = vd_div(above, vd_select(is_none, vd_set1(1.0), below)), z = vd_mul(q, q);
    static const double RISING[] = {-0x1.3a2f1cc1ba3c5p-6, 0x1.4161b24be475bp-5,  -0x1.a0993ef875d4ap-5,
                                    0x1.dfe637a48099bp-5,  -0x1.10fa76aa9b02cp-4, 0x1.3b1262f3a2b5bp-4,
                                    -0x1.745d0b27da190p-4, 0x1.c71c7185386f1p-4,  -0x1.2492492436180p-3,
                                    0x1.999999999934bp-3,  -0x1.5555555555555p-2};
    vd sum = vd_set1(RISING[0]);
    for (int k = 1; k < 11; k++)
        sum = vd_add(vd_mul(sum, z), vd_set1(RISING[k]));
    return vd_select(is_none, zero, vd_add(start, vd_add(q, vd_mul(q, vd_mul(z, sum)))));
}

#endif
