#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "height_map/fusion/weight_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
//
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "height_map/fusion/weight_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace vcharge {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, kVoxelLanes>;
using DI = hn::Rebind<int32_t, DF>;
using VF = hn::VFromD<DF>;
using VI = hn::VFromD<DI>;
using MF = decltype(hn::Lt(VF(), VF()));

HWY_INLINE VF set(float value) {
  return hn::Set(DF(), value);
}

/// Weight at a signed distance behind the surface.
HWY_INLINE VF weightAt(const WeightProfile& profile, VF behind, VF sigma, VF scale) {
  const VF one = set(1.0f), zero = hn::Zero(DF());
  const VF ramp = hn::Max(sigma, set(profile.min_ramp_m));
  const VF signed_weight = hn::Max(set(-1.0f), hn::Min(hn::Div(behind, ramp), one));
  const VF sided = hn::IfThenElse(hn::Lt(signed_weight, zero),
                                  hn::Mul(signed_weight, set(profile.free_weight)), signed_weight);
  return hn::IfThenElseZero(hn::Le(behind, hn::Add(set(profile.band_m), ramp)), hn::Mul(scale, sided));
}

void addColumnWeightsTarget(const PackedRangeMap& map, const WeightProfile& profile,
                            const VoxelColumn& column, float* weights) {
  const DF df;
  const DI di;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  const VF iota = hn::Iota(df, 0.0f);
  const VF half = set(0.5f), one = set(1.0f);
  const float* values = map.values.data();
  for (int z = 0; z < column.count; z += lanes) {
    const VF at = hn::Add(iota, set(static_cast<float>(z)));
    const VF x = hn::MulAdd(at, set(column.step[0]), set(column.first[0]));
    const VF y = hn::MulAdd(at, set(column.step[1]), set(column.first[1]));
    const VF depth = hn::MulAdd(at, set(column.step[2]), set(column.first[2]));
    const VF distance = hn::Sqrt(hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(depth, depth))));
    const VF denominator = hn::MulAdd(set(map.xi), distance, depth);
    MF seen = hn::And(
        hn::Lt(distance, set(profile.max_range_m)),
        hn::And(hn::Gt(depth, hn::Mul(distance, set(map.min_cosine))), hn::Gt(denominator, set(1e-6f))));
    const VF inverse = hn::Div(one, hn::IfThenElse(seen, denominator, one));
    const VF u = hn::MulAdd(hn::Mul(x, inverse), set(map.fx), set(map.u0));
    const VF v = hn::MulAdd(hn::Mul(y, inverse), set(map.fy), set(map.v0));
    const VF column_px = hn::Floor(hn::Add(u, half)), row_px = hn::Floor(hn::Add(v, half));
    seen = hn::And(seen, hn::And(hn::And(hn::Ge(column_px, hn::Zero(df)), hn::Ge(row_px, hn::Zero(df))),
                                 hn::And(hn::Lt(column_px, set(static_cast<float>(map.width))),
                                         hn::Lt(row_px, set(static_cast<float>(map.height))))));
    if (hn::AllFalse(df, seen)) {
      continue;
    }
    const VI pixel = hn::ConvertTo(
        di, hn::IfThenElseZero(seen, hn::MulAdd(row_px, set(static_cast<float>(map.width)), column_px)));
    const VI index = hn::Add(hn::ShiftLeft<2>(pixel), pixel);  // PackedRangeMap::kValues
    const VF middle = hn::GatherIndex(df, values, index);
    const VF by_column = hn::GatherIndex(df, values + 1, index);
    const VF by_row = hn::GatherIndex(df, values + 2, index);
    const VF sigma = hn::GatherIndex(df, values + 3, index);
    const VF scale = hn::GatherIndex(df, values + 4, index);
    const VF rho =
        hn::MulAdd(by_column, hn::Sub(u, column_px), hn::MulAdd(by_row, hn::Sub(v, row_px), middle));
    const MF known = hn::And(seen, hn::And(hn::Gt(middle, hn::Zero(df)), hn::Gt(rho, set(1e-4f))));
    const VF behind = hn::Sub(distance, hn::Div(one, hn::IfThenElse(known, rho, one)));
    const VF weight = hn::IfThenElseZero(known, weightAt(profile, behind, sigma, scale));
    hn::StoreU(hn::Add(hn::LoadU(df, weights + z), weight), df, weights + z);
  }
}

}  // namespace

AddColumnWeights bestColumnWeights() {
  return &addColumnWeightsTarget;
}

}  // namespace HWY_NAMESPACE
}  // namespace vcharge
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcharge {

HWY_EXPORT(bestColumnWeights);

AddColumnWeights addColumnWeightsKernel() {
  return HWY_DYNAMIC_DISPATCH(bestColumnWeights)();
}

WeightProfile::WeightProfile(const HeightFusionOptions& options)
    : max_range_m(static_cast<float>(options.max_range_m)),
      free_weight(static_cast<float>(options.free_weight)) {}

}  // namespace vcharge
#endif
