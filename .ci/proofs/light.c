/* Looks at the sRGB value of every step of light: the code of shade/srgb.c beside a root in long double. */
#include <math.h>

#include "topleft.h"
#include "shade/srgb.c"
#include "expect.h"

/* The sRGB value of a step of light; fails where it is too near the middle between two for long double to tell. */
static int32_t srgb_of(int32_t step)
{
    const long double light = step / 65536.0L;
    const long double value = 255 * (light <= 0.0031308L ? 12.92L * light : 1.055L * powl(light, 1 / 2.4L) - 0.055L);
    if (fabsl(value - floorl(value) - 0.5L) < 1e-12L) {
        printf("the sRGB value of step %d is not told\n", step);
        exit(1);
    }
    return (int32_t)floorl(value + 0.5L);
}

int main(void)
{
    for (int32_t first = 0; first <= 65536; first += TL_LANES) {
        float light[TL_MAX_LANES];
        for (int32_t k = 0; k < TL_LANES; k++)
            light[k] = (float)(first + k > 65536 ? 65536 : first + k) / 65536.0f;
        FILL(wanted, first, srgb_of(a > 65536 ? 65536 : a));
        expect("encode_srgb", encode_srgb(vf_load(light)), wanted);
    }
    return 0;
}
