/* Sixteen lanes: what shading needs besides. */
TL_INLINE vf vf_load(const float *p) { return _mm512_loadu_ps(p); }
TL_INLINE vf vf_fma(vf a, vf b, vf c) { return _mm512_fmadd_ps(a, b, c); }
TL_INLINE vf vf_min(vf a, vf b) { return _mm512_min_ps(a, b); }
TL_INLINE vf vf_max(vf a, vf b) { return _mm512_max_ps(a, b); }
TL_INLINE vi vi_rint(vf a) { return _mm512_cvtps_epi32(a); }
TL_INLINE vf vf_of_bits(vi a) { return _mm512_castsi512_ps(a); }
TL_INLINE vi vi_low_half(vi a) { return _mm512_and_si512(a, _mm512_set1_epi32(0xffff)); }
TL_INLINE vi vi_high_half(vi a) { return _mm512_srli_epi32(a, 16); }
TL_INLINE vf vf_lookup(const float *table, vi i) { return _mm512_permutexvar_ps(i, _mm512_loadu_ps(table)); }
TL_INLINE vi vi_lookup(const int32_t *table, vi i) { return _mm512_permutexvar_epi32(i, _mm512_loadu_si512(table)); }
TL_INLINE vf vf_pick(const float *p, vi i) { return _mm512_permutexvar_ps(i, _mm512_loadu_ps(p)); }
TL_INLINE vd vd_load(const double *p) { return (vd){_mm512_loadu_pd(p), _mm512_loadu_pd(p + 8)}; }
TL_INLINE vd vd_sqrt(vd a) { return (vd){_mm512_sqrt_pd(a.lo), _mm512_sqrt_pd(a.hi)}; }
TL_INLINE __m512d bits_minus(__m512d a, uint64_t sum, uint64_t mask)
{
    const __m512i b = _mm512_and_si512(_mm512_castpd_si512(a), _mm512_set1_epi64((long long)mask));
    return _mm512_castsi512_pd(_mm512_sub_epi64(_mm512_set1_epi64((long long)sum), b));
}
TL_INLINE vd vd_power(vd a, uint64_t sum, uint64_t mask) { return (vd){bits_minus(a.lo, sum, mask), bits_minus(a.hi, sum, mask)}; }
TL_INLINE vd vd_pick(const double *p, vi i)
{
    const __m512d low = _mm512_loadu_pd(p), high = _mm512_loadu_pd(p + 8);
    return (vd){_mm512_permutex2var_pd(low, _mm512_cvtepi32_epi64(_mm512_castsi512_si256(i)), high),
                _mm512_permutex2var_pd(low, _mm512_cvtepi32_epi64(_mm512_extracti64x4_epi64(i, 1)), high)};
}
TL_INLINE vi vi_pick(const int32_t *p, vi i) { return _mm512_permutexvar_epi32(i, _mm512_loadu_si512(p)); }
TL_INLINE vi vi_prefix_count(unsigned bits)
{
    const uint64_t ones = 0x0101010101010101u;
    const uint64_t low = _pdep_u64(bits, ones) * ones, high = _pdep_u64(bits >> 8, ones) * ones + (low >> 56) * ones;
    return _mm512_cvtepu8_epi32(_mm_set_epi64x((long long)high, (long long)low));
}

TL_INLINE __m512i load_four_records(const char *base, int scale, const int32_t *i)
{
    const __m128i a = _mm_loadu_si128((const __m128i *)(base + (int64_t)i[0] * scale)), b = _mm_loadu_si128((const __m128i *)(base + (int64_t)i[4] * scale));
    const __m128i c = _mm_loadu_si128((const __m128i *)(base + (int64_t)i[8] * scale)), d = _mm_loadu_si128((const __m128i *)(base + (int64_t)i[12] * scale));
    const __m256i low = _mm256_inserti128_si256(_mm256_castsi128_si256(a), b, 1), high = _mm256_inserti128_si256(_mm256_castsi128_si256(c), d, 1);
    return _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
}
TL_INLINE void vi_load_records(const void *base, int scale, const int32_t *i, vi *c)
{
    const vi rows[4] = {load_four_records(base, scale, i), load_four_records(base, scale, i + 1), load_four_records(base, scale, i + 2),
                        load_four_records(base, scale, i + 3)};
    transpose_quads(rows, c);
}
TL_INLINE vi load_eight_pairs(const char *base, const int32_t *i)
{
    __m128i two[4];
    for (int k = 0; k < 4; k++) {
        const __m128i a = _mm_loadl_epi64((const __m128i *)(base + (int64_t)i[2 * k] * 8));
        two[k] = _mm_castpd_si128(_mm_loadh_pd(_mm_castsi128_pd(a), (const double *)(base + (int64_t)i[2 * k + 1] * 8)));
    }
    const __m256i low = _mm256_inserti128_si256(_mm256_castsi128_si256(two[0]), two[1], 1);
    const __m256i high = _mm256_inserti128_si256(_mm256_castsi128_si256(two[2]), two[3], 1);
    return _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
}
TL_INLINE void vf_load_pairs(const void *base, const int32_t *i, vf *c)
{
    const vi even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    const vi a = load_eight_pairs(base, i), b = load_eight_pairs(base, i + 8);
    c[0] = _mm512_castsi512_ps(_mm512_permutex2var_epi32(a, even, b));
    c[1] = _mm512_castsi512_ps(_mm512_permutex2var_epi32(a, _mm512_add_epi32(even, _mm512_set1_epi32(1)), b));
}
/* Writes the fourth column over that of TL_LANES rows of four. */
TL_INLINE void vf_store_fourths(const float *rows, vf fourth, float *out)
{
    for (int k = 0; k < 4; k++) {
        const vi at = _mm512_add_epi32(_mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3), _mm512_set1_epi32(4 * k));
        _mm512_storeu_ps(out + 16 * k, _mm512_mask_permutexvar_ps(_mm512_loadu_ps(rows + 16 * k), 0x8888, at, fourth));
    }
}
/* Pixels of two and of three numbers, one after the other. */
TL_INLINE void vf_store_pairs(float *p, const vf *c)
{
    const vi low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    _mm512_storeu_ps(p, _mm512_permutex2var_ps(c[0], low, c[1]));
    _mm512_storeu_ps(p + 16, _mm512_permutex2var_ps(c[0], _mm512_add_epi32(low, _mm512_set1_epi32(8)), c[1]));
}
TL_INLINE void vf_store_triples(float *p, const vf *c)
{
    static const int32_t from[48] = {0, 16, 0, 1, 17, 1, 2, 18, 2, 3, 19, 3, 4, 20, 4, 5, 21, 5, 6, 22, 6, 7, 23, 7, 8, 24, 8, 9, 25, 9, 10, 26, 10, 11, 27, 11, 12, 28, 12, 13, 29, 13, 14, 30, 14, 15, 31, 15};
    static const __mmask16 is_third[3] = {0x4924, 0x2492, 0x9249};
    for (int k = 0; k < 3; k++) {
        const vi at = _mm512_loadu_si512(from + 16 * k);
        _mm512_storeu_ps(p + 16 * k, _mm512_mask_permutexvar_ps(_mm512_permutex2var_ps(c[0], at, c[1]), is_third[k], at, c[2]));
    }
}
/* Four doubles at base + 8 * stride * i[k], as columns. */
TL_INLINE void vd_load_records(const double *base, int stride, const int32_t *i, vd *c)
{
    __m512d half[2][4];
    for (int part = 0; part < 2; part++) {
        __m512d row[4];
        for (int k = 0; k < 4; k++) { /* lanes k and k + 4 */
            const double *a = base + (int64_t)i[8 * part + k] * stride, *b = base + (int64_t)i[8 * part + k + 4] * stride;
            row[k] = _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(a)), _mm256_loadu_pd(b), 1);
        }
        const __m512d even[2] = {_mm512_unpacklo_pd(row[0], row[1]), _mm512_unpackhi_pd(row[0], row[1])};
        const __m512d odd[2] = {_mm512_unpacklo_pd(row[2], row[3]), _mm512_unpackhi_pd(row[2], row[3])};
        const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13), high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
        for (int k = 0; k < 2; k++) {
            half[part][k] = _mm512_permutex2var_pd(even[k], low, odd[k]);
            half[part][k + 2] = _mm512_permutex2var_pd(even[k], high, odd[k]);
        }
    }
    for (int k = 0; k < 4; k++)
        c[k] = (vd){half[0][k], half[1][k]};
}
