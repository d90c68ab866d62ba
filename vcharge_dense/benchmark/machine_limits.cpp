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
using DI = hn::ScalableTag<int32_t>;

/// On x86, a gather depends on its register's old value even if all lanes are read, so it starts from
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

int64_t gatherPixelsTarget(const int32_t* image, size_t rows, size_t columns) {
  const DI di;
  const auto all_lanes = hn::Gt(hn::Set(di, static_cast<int32_t>(rows)), hn::Zero(di));
  const auto strip = columns / hn::Lanes(di);
  const auto lane = hn::Mul(hn::Iota(di, 0), hn::Set(di, static_cast<int32_t>(4 * strip)));
  auto sum = hn::Zero(di);
  const auto pixel = hn::Set(di, 4);
  for (size_t y = 0; y < rows; ++y) {
    auto offset = hn::Add(lane, hn::Set(di, static_cast<int32_t>(4096 * y)));
    for (size_t s = 0; s < strip; ++s) {
      sum = hn::Add(sum, gatherBytes(image, offset, all_lanes));
      offset = hn::Add(offset, pixel);
    }
  }
  return hn::GetLane(hn::SumOfLanes(di, sum));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace vcharge
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcharge {

HWY_EXPORT(gatherPixelsTarget);

int64_t gatherPixels(const int32_t* image, size_t rows, size_t columns) {
  return HWY_DYNAMIC_DISPATCH(gatherPixelsTarget)(image, rows, columns);
}

}  // namespace vcharge
#endif
