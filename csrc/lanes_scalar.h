/* One lane, plain C: the definition of what every other instruction set must give. */
#include <math.h>

#define TL_LANES 1
#define TL_HALF_LANES 0

typedef int32_t vi;
typedef float vf;
typedef double vd;
typedef unsigned vm; /* 0 or 1 */

TL_INLINE vi vi_set1(int32_t a) { return a; }
TL_INLINE vi vi_load(const int32_t *p) { return *p; }
TL_INLINE void vi_store(int32_t *p, vi a) { *p = a; }
TL_INLINE vi vi_iota(void) { return 0; }
TL_INLINE vi vi_add(vi a, vi b) { return (vi)((uint32_t)a + (uint32_t)b); }
TL_INLINE vi vi_sub(vi a, vi b) { return (vi)((uint32_t)a - (uint32_t)b); }
TL_INLINE vi vi_mul(vi a, vi b) { return (vi)((uint32_t)a * (uint32_t)b); }
TL_INLINE vi vi_min(vi a, vi b) { return a < b ? a : b; }
TL_INLINE vi vi_max(vi a, vi b) { return a > b ? a : b; }
TL_INLINE vi vi_or(vi a, vi b) { return a | b; }
TL_INLINE vi vi_and(vi a, vi b) { return a & b; }
TL_INLINE vi vi_shift_left(vi a, int n) { return (vi)((uint32_t)a << n); }
TL_INLINE vi vi_shift_right(vi a, int n) { return a >> n; }
TL_INLINE vm vi_gt(vi a, vi b) { return a > b; }
TL_INLINE vm vi_gt_unsigned(vi a, vi b) { return (uint32_t)a > (uint32_t)b; }
TL_INLINE vm vi_eq(vi a, vi b) { return a == b; }
TL_INLINE vi vi_select(vm m, vi a, vi b) { return m ? a : b; }
TL_INLINE void vi_compress(int32_t *p, vm m, vi a) { (void)m; *p = a; }
TL_INLINE vi vi_load_masked(vm m, const int32_t *p) { return m ? *p : 0; }
TL_INLINE void vi_store_masked(int32_t *p, vm m, vi a) { if (m) *p = a; }

TL_INLINE vm vm_and(vm a, vm b) { return a & b; }
TL_INLINE vm vm_or(vm a, vm b) { return a | b; }
TL_INLINE vm vm_and_not(vm a, vm b) { return a & ~b; }
TL_INLINE int vm_any(vm a) { return a != 0; }
TL_INLINE unsigned vm_bits(vm a) { return a; }
TL_INLINE vm vm_all(void) { return 1; }
TL_INLINE vm vm_first(int64_t n) { return n > 0; }

/* The masks of TL_LANES ranges of lanes [begin, end); and one of them. */
typedef struct { vm mask; } vm_ranges;
TL_INLINE void set_ranges(vm_ranges *r, vi begin, vi end) { r->mask = begin <= 0 && end > 0; }
TL_INLINE vm get_range(const vm_ranges *r, int k) { (void)k; return r->mask; }

TL_INLINE vf vf_set1(float a) { return a; }
TL_INLINE vf vf_add(vf a, vf b) { return a + b; }
TL_INLINE vf vf_sub(vf a, vf b) { return a - b; }
TL_INLINE vf vf_mul(vf a, vf b) { return a * b; }
TL_INLINE vf vf_div(vf a, vf b) { return a / b; }
TL_INLINE vf vf_sqrt(vf a) { return sqrtf(a); }
TL_INLINE vf vf_from_vi(vi a) { return (float)a; }
TL_INLINE vf vf_select(vm m, vf a, vf b) { return m ? a : b; }
TL_INLINE void vf_store(float *p, vf a) { *p = a; }
TL_INLINE vi vi_floor(vf a) { return fabsf(a) < 0x1p30f ? (vi)floorf(a) : INT32_MIN; }
TL_INLINE vf vf_load_masked(vm m, const float *p) { return m ? *p : 0.0f; }
TL_INLINE void vf_store_masked(float *p, vm m, vf a) { if (m) *p = a; }
TL_INLINE vm vf_lt(vf a, vf b) { return a < b; }
TL_INLINE vm vf_eq(vf a, vf b) { return a == b; }
TL_INLINE vi vi_bits_of_vf(vf a) { vi b; memcpy(&b, &a, 4); return b; }

TL_INLINE vd vd_set1(double a) { return a; }
TL_INLINE vd vd_add(vd a, vd b) { return a + b; }
TL_INLINE vd vd_sub(vd a, vd b) { return a - b; }
TL_INLINE vd vd_mul(vd a, vd b) { return a * b; }
TL_INLINE vd vd_div(vd a, vd b) { return a / b; }
TL_INLINE vd vd_from_vi(vi a) { return (double)a; }
TL_INLINE vf vf_from_vd(vd a) { return (float)a; }
TL_INLINE void vd_quotients(const vd *a, vd b, vd *q)
{
    for (int k = 0; k < 3; k++)
        q[k] = a[k] / b;
}
TL_INLINE vd vd_abs(vd a) { return fabs(a); }
TL_INLINE vd vd_floor(vd a) { return floor(a); }
TL_INLINE vd vd_min(vd a, vd b) { return a < b ? a : b; }
TL_INLINE vd vd_max(vd a, vd b) { return a > b ? a : b; }
TL_INLINE vm vd_ge(vd a, vd b) { return a >= b; }
TL_INLINE vd vd_from_vf(vf a) { return (double)a; }
TL_INLINE vi vi_round(vd a) { return fabs(a) < 0x1p31 ? (vi)rint(a) : INT32_MIN; }
TL_INLINE vd vd_select(vm m, vd a, vd b) { return m ? a : b; }
TL_INLINE void vd_store(double *p, vd a) { *p = a; }

/* The vertices first[step * lane] of TL_LANES pairs or triangles.  z is left in the order of the loads until it is needed. */
typedef double vz;
TL_INLINE void load_vertices_by(int step, const tl_vertex *v, const int32_t *first, vi *x, vi *y, vz *z)
{
    (void)step;
    const tl_vertex a = v[first[0]];
    *x = a.x_fx;
    *y = a.y_fx;
    *z = a.z;
}
TL_INLINE void load_vertices(const tl_vertex *v, const int32_t *first, vi *x, vi *y, vz *z) { load_vertices_by(3, v, first, x, y, z); }
TL_INLINE vd vd_from_vz(vz z) { return z; }

/* The first four numbers of TL_LANES rows, as columns; reads up to two numbers past the last row. */
TL_INLINE void load_columns_f32(const float *p, int stride, vf *columns)
{
    (void)stride;
    for (int k = 0; k < 4; k++)
        columns[k] = p[k];
}
TL_INLINE void load_columns_f64(const double *p, int stride, vd *columns)
{
    (void)stride;
    for (int k = 0; k < 4; k++)
        columns[k] = p[k];
}
TL_INLINE void store_vertices(tl_vertex *v, vi x, vi y, vd z) { *v = (tl_vertex){x, y, z}; }
