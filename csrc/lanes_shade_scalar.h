/* One lane: what shading needs besides. */
TL_INLINE vf vf_load(const float *p) { return *p; }
TL_INLINE vf vf_fma(vf a, vf b, vf c) { return fmaf(a, b, c); }
TL_INLINE vf vf_min(vf a, vf b) { return a < b ? a : b; } /* b when one is NaN */
TL_INLINE vf vf_max(vf a, vf b) { return a > b ? a : b; }
TL_INLINE vi vi_rint(vf a) { return fabsf(a) < 0x1p31f ? (vi)lrintf(a) : INT32_MIN; }
TL_INLINE vf vf_of_bits(vi a) { vf b; memcpy(&b, &a, 4); return b; }
TL_INLINE vi vi_low_half(vi a) { return a & 0xffff; }
TL_INLINE vi vi_high_half(vi a) { return (vi)((uint32_t)a >> 16); }
TL_INLINE vf vf_lookup(const float *table, vi i) { return table[i & 15]; }
TL_INLINE vi vi_lookup(const int32_t *table, vi i) { return table[i & 15]; }
TL_INLINE vf vf_pick(const float *p, vi i) { (void)i; return *p; }
TL_INLINE vd vd_load(const double *p) { return *p; }
TL_INLINE vd vd_sqrt(vd a) { return sqrt(a); }
TL_INLINE vd vd_power(vd a, uint64_t sum, uint64_t mask) { uint64_t b; memcpy(&b, &a, 8); b = sum - (b & mask); memcpy(&a, &b, 8); return a; }
TL_INLINE vd vd_pick(const double *p, vi i) { (void)i; return *p; }
TL_INLINE vi vi_pick(const int32_t *p, vi i) { (void)i; return *p; }
TL_INLINE vi vi_prefix_count(unsigned bits) { return (vi)(bits & 1); }
TL_INLINE void vi_load_records(const void *base, int scale, const int32_t *i, vi *c) { memcpy(c, (const char *)base + (int64_t)*i * scale, 16); }
TL_INLINE void vf_load_pairs(const void *base, const int32_t *i, vf *c) { memcpy(c, (const char *)base + (int64_t)*i * 8, 8); }
/* Writes the fourth column over that of TL_LANES rows of four. */
TL_INLINE void vf_store_fourths(const float *rows, vf fourth, float *out)
{
    for (int k = 0; k < 3; k++)
        out[k] = rows[k];
    out[3] = fourth;
}
/* Pixels of two and of three numbers, one after the other. */
TL_INLINE void vf_store_pairs(float *p, const vf *c) { p[0] = c[0], p[1] = c[1]; }
TL_INLINE void vf_store_triples(float *p, const vf *c) { p[0] = c[0], p[1] = c[1], p[2] = c[2]; }
/* Four doubles at base + 8 * stride * i[k], as columns. */
TL_INLINE void vd_load_records(const double *base, int stride, const int32_t *i, vd *c) { memcpy(c, base + (int64_t)*i * stride, 32); }
