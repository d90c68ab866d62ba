#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "height_map/regularization/primal_dual_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
//
#include <hwy/highway.h>

#include "height_map/regularization/primal_dual_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace vcharge {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, kRowPadding>;
using VF = hn::VFromD<DF>;

HWY_INLINE VF set(float value) {
  return hn::Set(DF(), value);
}

/// Replaces NaN by 0: there are no gradients across the border of the domain.
HWY_INLINE VF orZero(VF value) {
  return hn::IfThenElseZero(hn::Eq(value, value), value);
}

HWY_INLINE void updateDuals(const PrimalDualRow& row, const PrimalDualSteps& steps) {
  const DF df;
  const size_t lanes = hn::Lanes(df);
  const VF one = set(1.0f), step = set(steps.dual), shrink = set(steps.dual_shrink);
  for (size_t i = 0; i < row.padded_columns; i += lanes) {
    const VF here = hn::Load(df, row.extrapolated + i);
    const VF by_x = orZero(hn::Sub(hn::LoadU(df, row.extrapolated + i + 1), here));
    const VF by_y = orZero(hn::Sub(hn::Load(df, row.extrapolated_below + i), here));
    const VF x = hn::Mul(shrink, hn::MulAdd(step, by_x, hn::Load(df, row.dual_x + i)));
    const VF y = hn::Mul(shrink, hn::MulAdd(step, by_y, hn::Load(df, row.dual_y + i)));
    const VF norm = hn::Sqrt(hn::MulAdd(x, x, hn::Mul(y, y)));
    const VF scale = hn::Div(one, hn::Max(one, norm));
    hn::Store(hn::Mul(x, scale), df, row.dual_x + i);
    hn::Store(hn::Mul(y, scale), df, row.dual_y + i);
  }
}

HWY_INLINE void updateValues(const PrimalDualRow& row, const PrimalDualSteps& steps) {
  const DF df;
  const size_t lanes = hn::Lanes(df);
  const VF step = set(steps.primal), below = set(steps.below), above = set(steps.above);
  const VF low = set(steps.low), high = set(steps.high);
  for (size_t i = 0; i < row.padded_columns; i += lanes) {
    const VF before = hn::Load(df, row.value + i);
    const VF floor = hn::Load(df, row.floor + i), ceiling = hn::Load(df, row.ceiling + i);
    const VF divergence = hn::Add(hn::Sub(hn::Load(df, row.dual_x + i), hn::LoadU(df, row.dual_x + i - 1)),
                                  hn::Sub(hn::Load(df, row.dual_y + i), hn::Load(df, row.dual_y_above + i)));
    const VF moved = hn::MulAdd(step, hn::Sub(divergence, hn::Load(df, row.slope + i)), before);
    // Proximal map of the data cost: moves towards [floor, ceiling], but not into it.
    const VF weight_below = hn::Load(df, row.weight_below + i);
    const VF weight_above = hn::Load(df, row.weight_above + i);
    const VF raised = hn::Min(hn::MulAdd(weight_below, below, moved), floor);
    const VF lowered = hn::Min(hn::Max(hn::NegMulAdd(weight_above, above, moved), ceiling), moved);
    const VF inside = hn::Min(hn::Max(hn::Max(raised, lowered), low), high);
    const VF after = hn::IfThenElse(hn::Eq(floor, floor), inside, floor);  // NaN outside the domain
    hn::Store(after, df, row.value + i);
    hn::Store(hn::Sub(hn::Add(after, after), before), df, row.extrapolated + i);
  }
}

void iterateRowTarget(const PrimalDualRow& row, const PrimalDualSteps& steps) {
  updateDuals(row, steps);
  updateValues(row, steps);
}

}  // namespace

IterateRow bestIterateRow() {
  return &iterateRowTarget;
}

}  // namespace HWY_NAMESPACE
}  // namespace vcharge
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcharge {

HWY_EXPORT(bestIterateRow);

IterateRow iterateRowKernel() {
  return HWY_DYNAMIC_DISPATCH(bestIterateRow)();
}

}  // namespace vcharge
#endif
