/* Eight lanes: what shading needs besides. */
TL_INLINE vf vf_load(const float *p) { return _mm256_loadu_ps(p); }
TL_INLINE vf vf_fma(vf a, vf b, vf c) { return _mm256_fmadd_ps(a, b, c); }
TL_INLINE vf vf_min(vf a, vf b) { return _mm256_min_ps(a, b); }
TL_INLINE vf vf_max(vf a, vf b) { return _mm256_max_ps(a, b); }
TL_INLINE vi vi_rint(vf a) { return _mm256_cvtps_epi32(a); }
TL_INLINE vf vf_of_bits(vi a) { return _mm256_castsi256_ps(a); }
TL_INLINE vi vi_low_half(vi a) { return _mm256_blend_epi16(a, _mm256_setzero_si256(), 0xaa); }
TL_INLINE vi vi_high_half(vi a) { return _mm256_srli_epi32(a, 16); }
TL_INLINE vf vf_lookup(const float *table, vi i)
{
    const vf low = _mm256_permutevar8x32_ps(_mm256_loadu_ps(table), i), high = _mm256_permutevar8x32_ps(_mm256_loadu_ps(table + 8), i);
    return _mm256_blendv_ps(low, high, _mm256_castsi256_ps(_mm256_slli_epi32(i, 28)));
}
TL_INLINE vi vi_lookup(const int32_t *table, vi i) { return _mm256_castps_si256(vf_lookup((const float *)table, i)); }
TL_INLINE vf vf_pick(const float *p, vi i) { return _mm256_permutevar8x32_ps(_mm256_loadu_ps(p), i); }
TL_INLINE vd vd_load(const double *p) { return (vd){_mm256_loadu_pd(p), _mm256_loadu_pd(p + 4)}; }
TL_INLINE vd vd_sqrt(vd a) { return (vd){_mm256_sqrt_pd(a.lo), _mm256_sqrt_pd(a.hi)}; }
TL_INLINE __m256d bits_minus(__m256d a, uint64_t sum, uint64_t mask)
{
    const __m256i b = _mm256_and_si256(_mm256_castpd_si256(a), _mm256_set1_epi64x((long long)mask));
    return _mm256_castsi256_pd(_mm256_sub_epi64(_mm256_set1_epi64x((long long)sum), b));
}
TL_INLINE vd vd_power(vd a, uint64_t sum, uint64_t mask) { return (vd){bits_minus(a.lo, sum, mask), bits_minus(a.hi, sum, mask)}; }
TL_INLINE vd vd_pick(const double *p, vi i)
{
    return (vd){_mm256_i32gather_pd(p, _mm256_castsi256_si128(i), 8), _mm256_i32gather_pd(p, _mm256_extracti128_si256(i, 1), 8)};
}
TL_INLINE vi vi_pick(const int32_t *p, vi i) { return _mm256_permutevar8x32_epi32(_mm256_loadu_si256((const __m256i *)p), i); }
TL_INLINE vi vi_prefix_count(unsigned bits)
{
    const uint64_t ones = 0x0101010101010101u;
    return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)(_pdep_u64(bits, ones) * ones)));
}

TL_INLINE __m256i load_two_records(const char *base, int scale, const int32_t *i)
{
    const __m128i a = _mm_loadu_si128((const __m128i *)(base + (int64_t)i[0] * scale)), b = _mm_loadu_si128((const __m128i *)(base + (int64_t)i[4] * scale));
    return _mm256_inserti128_si256(_mm256_castsi128_si256(a), b, 1);
}
TL_INLINE void vi_load_records(const void *base, int scale, const int32_t *i, vi *c)
{
    const vi rows[4] = {load_two_records(base, scale, i), load_two_records(base, scale, i + 1), load_two_records(base, scale, i + 2),
                        load_two_records(base, scale, i + 3)};
    transpose_quads(rows, c);
}
TL_INLINE __m256i load_four_pairs(const char *base, const int32_t *i)
{
    __m128i two[2];
    for (int k = 0; k < 2; k++) {
        const __m128i a = _mm_loadl_epi64((const __m128i *)(base + (int64_t)i[2 * k] * 8));
        two[k] = _mm_castpd_si128(_mm_loadh_pd(_mm_castsi128_pd(a), (const double *)(base + (int64_t)i[2 * k + 1] * 8)));
    }
    return _mm256_inserti128_si256(_mm256_castsi128_si256(two[0]), two[1], 1);
}
TL_INLINE void vf_load_pairs(const void *base, const int32_t *i, vf *c)
{
    const vf a = _mm256_castsi256_ps(load_four_pairs(base, i)), b = _mm256_castsi256_ps(load_four_pairs(base, i + 4));
    const __m256d first = _mm256_castps_pd(_mm256_shuffle_ps(a, b, 0x88)), second = _mm256_castps_pd(_mm256_shuffle_ps(a, b, 0xdd));
    c[0] = _mm256_castpd_ps(_mm256_permute4x64_pd(first, 0xd8)); /* 0 1 4 5 2 3 6 7 */
    c[1] = _mm256_castpd_ps(_mm256_permute4x64_pd(second, 0xd8));
}
/* Writes the fourth column over that of TL_LANES rows of four. */
TL_INLINE void vf_store_fourths(const float *rows, vf fourth, float *out)
{
    for (int k = 0; k < 4; k++) {
        const vi at = _mm256_add_epi32(_mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1), _mm256_set1_epi32(2 * k));
        _mm256_storeu_ps(out + 8 * k, _mm256_blend_ps(_mm256_loadu_ps(rows + 8 * k), _mm256_permutevar8x32_ps(fourth, at), 0x88));
    }
}
/* Pixels of two and of three numbers, one after the other. */
TL_INLINE void vf_store_pairs(float *p, const vf *c)
{
    const vf low = _mm256_unpacklo_ps(c[0], c[1]), high = _mm256_unpackhi_ps(c[0], c[1]);
    _mm256_storeu_ps(p, _mm256_permute2f128_ps(low, high, 0x20));
    _mm256_storeu_ps(p + 8, _mm256_permute2f128_ps(low, high, 0x31));
}
TL_INLINE void vf_store_triples(float *p, const vf *c)
{
    static const int32_t from[24] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4, 5, 5, 5, 6, 6, 6, 7, 7, 7};
    vf turned[3][3];
    for (int k = 0; k < 3; k++)
        for (int channel = 0; channel < 3; channel++)
            turned[k][channel] = _mm256_permutevar8x32_ps(c[channel], _mm256_loadu_si256((const __m256i *)(from + 8 * k)));
    _mm256_storeu_ps(p, _mm256_blend_ps(_mm256_blend_ps(turned[0][0], turned[0][1], 0x92), turned[0][2], 0x24));
    _mm256_storeu_ps(p + 8, _mm256_blend_ps(_mm256_blend_ps(turned[1][0], turned[1][1], 0x24), turned[1][2], 0x49));
    _mm256_storeu_ps(p + 16, _mm256_blend_ps(_mm256_blend_ps(turned[2][0], turned[2][1], 0x49), turned[2][2], 0x92));
}
/* Four doubles at base + 8 * stride * i[k], as columns. */
TL_INLINE void vd_load_records(const double *base, int stride, const int32_t *i, vd *c)
{
    __m256d half[2][4];
    for (int part = 0; part < 2; part++) {
        __m256d row[4];
        for (int k = 0; k < 4; k++)
            row[k] = _mm256_loadu_pd(base + (int64_t)i[4 * part + k] * stride);
        const __m256d even[2] = {_mm256_unpacklo_pd(row[0], row[1]), _mm256_unpackhi_pd(row[0], row[1])};
        const __m256d odd[2] = {_mm256_unpacklo_pd(row[2], row[3]), _mm256_unpackhi_pd(row[2], row[3])};
        for (int k = 0; k < 2; k++) {
            half[part][k] = _mm256_permute2f128_pd(even[k], odd[k], 0x20);
            half[part][k + 2] = _mm256_permute2f128_pd(even[k], odd[k], 0x31);
        }
    }
    for (int k = 0; k < 4; k++)
        c[k] = (vd){half[0][k], half[1][k]};
}
