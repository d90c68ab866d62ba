#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "machine_limits.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
//
#include <hwy/highway.h>

#include "machine_limits.h"

HWY_BEFORE_NAMESPACE();
namespace vcharge {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::ScalableTag<float>;
using DI = hn::ScalableTag<int32_t>;

/// On x86 a gather depends on its register's old value even where all lanes are read, so it starts from
/// zeros; the compiler must not know that `lanes` are all set.
HWY_INLINE hn::VFromD<DI> gatherBytes(const int32_t* base, hn::VFromD<DI> offset,
                                      decltype(hn::Lt(offset, offset)) lanes) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  return hn::VFromD<DI>{_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), lanes.raw, offset.raw, base, 1)};
#elif HWY_ARCH_X86 && HWY_TARGET == HWY_AVX2
  return hn::VFromD<DI>{_mm256_mask_i32gather_epi32(_mm256_setzero_si256(), base, offset.raw, lanes.raw, 1)};
#else
  (void)lanes;
  return hn::GatherOffset(DI(), base, offset);
#endif
}

template <class Gather>
HWY_INLINE int64_t sumOfGathers(const int32_t* image, size_t rows, size_t columns, const Gather& gather) {
  const DI di;
  const auto strip = columns / hn::Lanes(di);
  const auto lane = hn::Mul(hn::Iota(di, 0), hn::Set(di, static_cast<int32_t>(4 * strip)));
  auto sum = hn::Zero(di);
  const auto pixel = hn::Set(di, 4);
  for (size_t y = 0; y < rows; ++y) {
    auto offset = hn::Add(lane, hn::Set(di, static_cast<int32_t>(4096 * y)));
    for (size_t s = 0; s < strip; ++s) {
      sum = hn::Add(sum, gather(image, offset));
      offset = hn::Add(offset, pixel);
    }
  }
  return hn::GetLane(hn::SumOfLanes(di, sum));
}

int64_t gatherPixelsTarget(const int32_t* image, size_t rows, size_t columns) {
  const DI di;
  const auto all_lanes = hn::Gt(hn::Set(di, static_cast<int32_t>(rows)), hn::Zero(di));
  return sumOfGathers(image, rows, columns, [&](const int32_t* base, hn::VFromD<DI> offset) HWY_ATTR {
    return gatherBytes(base, offset, all_lanes);
  });
}

int64_t gatherPixelsInTurnTarget(const int32_t* image, size_t rows, size_t columns) {
  return sumOfGathers(image, rows, columns, [](const int32_t* base, hn::VFromD<DI> offset) HWY_ATTR {
    return hn::GatherOffset(DI(), base, offset);
  });
}

float multiplyAddTarget(size_t count) {
  const DF df;
  const auto factor = hn::Set(df, 0.999f);
  auto a = hn::Set(df, 1.0f), b = a, c = a, d = a, e = a, f = a, g = a, h = a;
  for (size_t i = 0; i < count; i += 8) {
    a = hn::MulAdd(a, factor, factor);
    b = hn::MulAdd(b, factor, factor);
    c = hn::MulAdd(c, factor, factor);
    d = hn::MulAdd(d, factor, factor);
    e = hn::MulAdd(e, factor, factor);
    f = hn::MulAdd(f, factor, factor);
    g = hn::MulAdd(g, factor, factor);
    h = hn::MulAdd(h, factor, factor);
  }
  const auto sum = hn::Add(hn::Add(hn::Add(a, b), hn::Add(c, d)), hn::Add(hn::Add(e, f), hn::Add(g, h)));
  return hn::GetLane(hn::SumOfLanes(df, sum));
}

float readFloatsTarget(const float* values, size_t count, size_t repetitions) {
  const DF df;
  const size_t lanes = hn::Lanes(df);
  auto a = hn::Zero(df), b = a, c = a, d = a;
  for (size_t r = 0; r < repetitions; ++r) {
    for (size_t i = 0; i + 4 * lanes <= count; i += 4 * lanes) {
      a = hn::Add(a, hn::Load(df, values + i));
      b = hn::Add(b, hn::Load(df, values + i + lanes));
      c = hn::Add(c, hn::Load(df, values + i + 2 * lanes));
      d = hn::Add(d, hn::Load(df, values + i + 3 * lanes));
    }
  }
  return hn::GetLane(hn::SumOfLanes(df, hn::Add(hn::Add(a, b), hn::Add(c, d))));
}

size_t vectorLanesTarget() {
  return hn::Lanes(DF());
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace vcharge
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcharge {

HWY_EXPORT(gatherPixelsTarget);
HWY_EXPORT(gatherPixelsInTurnTarget);
HWY_EXPORT(multiplyAddTarget);
HWY_EXPORT(readFloatsTarget);
HWY_EXPORT(vectorLanesTarget);

int64_t gatherPixels(const int32_t* image, size_t rows, size_t columns) {
  return HWY_DYNAMIC_DISPATCH(gatherPixelsTarget)(image, rows, columns);
}

int64_t gatherPixelsInTurn(const int32_t* image, size_t rows, size_t columns) {
  return HWY_DYNAMIC_DISPATCH(gatherPixelsInTurnTarget)(image, rows, columns);
}

float multiplyAdd(size_t count) {
  return HWY_DYNAMIC_DISPATCH(multiplyAddTarget)(count);
}

float readFloats(const float* values, size_t count, size_t repetitions) {
  return HWY_DYNAMIC_DISPATCH(readFloatsTarget)(values, count, repetitions);
}

size_t vectorLanes() {
  return HWY_DYNAMIC_DISPATCH(vectorLanesTarget)();
}

}  // namespace vcharge
#endif
