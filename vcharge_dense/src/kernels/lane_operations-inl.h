// Operations on the parts of 32-bit lanes. Kernel files include this once per instruction set.
#if defined(VCHARGE_LANE_OPERATIONS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef VCHARGE_LANE_OPERATIONS_INL_H_
#undef VCHARGE_LANE_OPERATIONS_INL_H_
#else
#define VCHARGE_LANE_OPERATIONS_INL_H_
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace vcharge {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::ScalableTag<float>;
using DI = hn::ScalableTag<int32_t>;
using VF = hn::VFromD<DF>;
using VI = hn::VFromD<DI>;
using MI = decltype(hn::Lt(VI(), VI()));

// multiplyHalves  sum of the products of the signed 16-bit halves
// multiplyBytes   for each half, sum of the products of its unsigned with its signed bytes
// gather          reads 32-bit values. On x86 a gather depends on its register's old value even where all
//                 lanes are read, so it starts from zeros; the compiler must not know that `lanes` are all
//                 set
// loadEach        the same with one load per lane, which is faster on processors whose gathers are slow
// negateHighHalf  negates the high half and keeps the low one
// fractionBytes   copies byte 1, the highest bits of a position's fraction, into all bytes
// fractionHalves  copies byte 1 into the low byte of both halves
// nearest         rounds floats that fit into integers
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_SSSE3
#if HWY_TARGET <= HWY_AVX2
HWY_INLINE __m128i loadFour(const int32_t* base, __m128i index) {
  const auto first = static_cast<uint64_t>(_mm_cvtsi128_si64(index));
  const auto last = static_cast<uint64_t>(_mm_extract_epi64(index, 1));
  __m128i values = _mm_cvtsi32_si128(base[first & 0xffffffffu]);
  values = _mm_insert_epi32(values, base[first >> 32], 1);
  values = _mm_insert_epi32(values, base[last & 0xffffffffu], 2);
  return _mm_insert_epi32(values, base[last >> 32], 3);
}
HWY_INLINE __m256i loadEight(const int32_t* base, __m256i index) {
  const __m128i low = loadFour(base, _mm256_castsi256_si128(index));
  return _mm256_inserti128_si256(_mm256_castsi128_si256(low),
                                 loadFour(base, _mm256_extracti128_si256(index, 1)), 1);
}
#endif
#if HWY_TARGET <= HWY_AVX3
HWY_INLINE VI nearest(VF a) {
  return VI{_mm512_cvtps_epi32(a.raw)};
}
HWY_INLINE VI multiplyHalves(VI a, VI b) {
  return VI{_mm512_madd_epi16(a.raw, b.raw)};
}
HWY_INLINE VI multiplyBytes(VI u, VI s) {
  return VI{_mm512_maddubs_epi16(u.raw, s.raw)};
}
HWY_INLINE VI gather(const int32_t* base, VI index, MI lanes) {
  return VI{_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), lanes.raw, index.raw, base, 4)};
}
HWY_INLINE VI loadEach(const int32_t* base, VI index) {
  const __m256i low = loadEight(base, _mm512_castsi512_si256(index.raw));
  return VI{_mm512_inserti64x4(_mm512_castsi256_si512(low),
                               loadEight(base, _mm512_extracti64x4_epi64(index.raw, 1)), 1)};
}
#elif HWY_TARGET == HWY_AVX2
HWY_INLINE VI nearest(VF a) {
  return VI{_mm256_cvtps_epi32(a.raw)};
}
HWY_INLINE VI multiplyHalves(VI a, VI b) {
  return VI{_mm256_madd_epi16(a.raw, b.raw)};
}
HWY_INLINE VI multiplyBytes(VI u, VI s) {
  return VI{_mm256_maddubs_epi16(u.raw, s.raw)};
}
HWY_INLINE VI gather(const int32_t* base, VI index, MI lanes) {
  return VI{_mm256_mask_i32gather_epi32(_mm256_setzero_si256(), base, index.raw, lanes.raw, 4)};
}
HWY_INLINE VI loadEach(const int32_t* base, VI index) {
  return VI{loadEight(base, index.raw)};
}
#else
HWY_INLINE VI nearest(VF a) {
  return VI{_mm_cvtps_epi32(a.raw)};
}
HWY_INLINE VI multiplyHalves(VI a, VI b) {
  return VI{_mm_madd_epi16(a.raw, b.raw)};
}
HWY_INLINE VI multiplyBytes(VI u, VI s) {
  return VI{_mm_maddubs_epi16(u.raw, s.raw)};
}
HWY_INLINE VI gather(const int32_t* base, VI index, MI /*lanes*/) {
  return hn::GatherIndex(DI(), base, index);
}
HWY_INLINE VI loadEach(const int32_t* base, VI index) {
  return hn::GatherIndex(DI(), base, index);
}
#endif
HWY_INLINE VI negateHighHalf(VI a) {
  const hn::Repartition<int16_t, DI> d16;
  const VI signs = hn::Set(DI(), static_cast<int32_t>(0xffff0001u));
  return hn::BitCast(DI(), hn::Mul(hn::BitCast(d16, a), hn::BitCast(d16, signs)));
}
HWY_INLINE VI shuffleBytes(VI from, uint32_t bytes_of_lane) {
  const DI di;
  const hn::Repartition<uint8_t, DI> du8;
  alignas(16) const uint32_t block[4] = {bytes_of_lane, bytes_of_lane + 0x04040404u,
                                         bytes_of_lane + 0x08080808u, bytes_of_lane + 0x0c0c0c0cu};
  const VI at = hn::LoadDup128(di, reinterpret_cast<const int32_t*>(block));
  return hn::BitCast(di, hn::TableLookupBytesOr0(hn::BitCast(du8, from), hn::BitCast(du8, at)));
}
HWY_INLINE VI fractionBytes(VI position) {
  return shuffleBytes(position, 0x01010101u);
}
HWY_INLINE VI fractionHalves(VI position) {
  return shuffleBytes(position, 0x80018001u);
}
#else
HWY_INLINE VI nearest(VF a) {
  return hn::NearestInt(a);
}
HWY_INLINE VI gather(const int32_t* base, VI index, MI /*lanes*/) {
  return hn::GatherIndex(DI(), base, index);
}
HWY_INLINE VI loadEach(const int32_t* base, VI index) {
  return hn::GatherIndex(DI(), base, index);
}
HWY_INLINE VI lowHalf(VI a) {
  return hn::ShiftRight<16>(hn::ShiftLeft<16>(a));
}
HWY_INLINE VI multiplyHalves(VI a, VI b) {
  return hn::Add(hn::Mul(lowHalf(a), lowHalf(b)), hn::Mul(hn::ShiftRight<16>(a), hn::ShiftRight<16>(b)));
}
HWY_INLINE VI multiplyBytes(VI u, VI s) {
  const VI byte = hn::Set(DI(), 0xff);
  const auto product = [&](VI weight, VI pixel_on_top) HWY_ATTR {
    return hn::Mul(hn::And(weight, byte), hn::ShiftRight<24>(pixel_on_top));
  };
  const VI low =
      hn::Add(product(u, hn::ShiftLeft<24>(s)), product(hn::ShiftRight<8>(u), hn::ShiftLeft<16>(s)));
  const VI high =
      hn::Add(product(hn::ShiftRight<16>(u), hn::ShiftLeft<8>(s)), product(hn::ShiftRight<24>(u), s));
  return hn::OrAnd(hn::ShiftLeft<16>(high), low, hn::Set(DI(), 0xffff));
}
HWY_INLINE VI negateHighHalf(VI a) {
  const VI high = hn::And(a, hn::Set(DI(), -65536));
  return hn::OrAnd(hn::Sub(hn::Zero(DI()), high), a, hn::Set(DI(), 0xffff));
}
HWY_INLINE VI fractionHalves(VI position) {
  const VI byte = hn::And(hn::ShiftRight<8>(position), hn::Set(DI(), 0xff));
  return hn::Or(byte, hn::ShiftLeft<16>(byte));
}
HWY_INLINE VI fractionBytes(VI position) {
  const VI halves = fractionHalves(position);
  return hn::Or(halves, hn::ShiftLeft<8>(halves));
}
#endif

// Roots and reciprocals of positive numbers with at least 22 correct bits. Where the processor's estimates
// have 11 bits or more, one step of Newton's method doubles them, which is faster than division.
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
HWY_INLINE VF root(VF value) {
  const DF df;
  const VF estimate = hn::ApproximateReciprocalSqrt(value);
  const VF root = hn::Mul(value, estimate);
  const VF error = hn::NegMulAdd(root, estimate, hn::Set(df, 1.0f));
  return hn::MulAdd(hn::Mul(root, hn::Set(df, 0.5f)), error, root);
}
HWY_INLINE VF reciprocal(VF value) {
  const VF estimate = hn::ApproximateReciprocal(value);
  return hn::Mul(estimate, hn::NegMulAdd(value, estimate, hn::Set(DF(), 2.0f)));
}
HWY_INLINE VF reciprocalOfRoot(VF value) {
  const DF df;
  const VF estimate = hn::ApproximateReciprocalSqrt(value);
  const VF error = hn::NegMulAdd(hn::Mul(value, estimate), estimate, hn::Set(df, 1.0f));
  return hn::MulAdd(hn::Mul(estimate, hn::Set(df, 0.5f)), error, estimate);
}
#else
HWY_INLINE VF root(VF value) {
  return hn::Sqrt(value);
}
HWY_INLINE VF reciprocal(VF value) {
  return hn::Div(hn::Set(DF(), 1.0f), value);
}
HWY_INLINE VF reciprocalOfRoot(VF value) {
  return reciprocal(root(value));
}
#endif

/// sum + multiplyHalves(a, b).
HWY_INLINE VI addHalves(VI sum, VI a, VI b) {
  return hn::Add(sum, multiplyHalves(a, b));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace vcharge
HWY_AFTER_NAMESPACE();

#endif  // per instruction set
