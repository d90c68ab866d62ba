#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/uncertainty_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
//
#include <hwy/highway.h>

#include <limits>

#include "kernels/lane_operations-inl.h"
#include "kernels/sweep_kernels.h"
#include "kernels/sweep_kernels_internal.h"

HWY_BEFORE_NAMESPACE();
namespace vcharge {
namespace HWY_NAMESPACE {
namespace {

using MF = decltype(hn::Lt(VF(), VF()));

HWY_INLINE VF set(float value) {
  return hn::Set(DF(), value);
}

struct Vector3 {
  VF x, y, z;

  HWY_INLINE VF dot(const Vector3& other) const {
    return hn::MulAdd(x, other.x, hn::MulAdd(y, other.y, hn::Mul(z, other.z)));
  }
  /// this + factor * other
  HWY_INLINE Vector3 plus(VF factor, const Vector3& other) const {
    return {hn::MulAdd(factor, other.x, x), hn::MulAdd(factor, other.y, y), hn::MulAdd(factor, other.z, z)};
  }
  HWY_INLINE Vector3 times(VF factor) const {
    return {hn::Mul(factor, x), hn::Mul(factor, y), hn::Mul(factor, z)};
  }
};

// Smaller squares count as zero.
constexpr float kTiny = 1e-30f;

/// Square root of a sum of squares; 0 for NaN.
HWY_INLINE VF length(VF squares) {
  return hn::IfThenElseZero(hn::Gt(squares, set(kTiny)), root(squares));
}

/// Sensitivity of a point's image in a neighbour, from the derivative of the unified projection. Of points
/// that are not visible, the first two are 0 and the others 1.
struct Sensitivity {
  VF pixels_per_inverse_range;
  VF squared_pixels_per_radian;     // in the same direction, for a rotation about the worst axis
  VF range_ratio, per_range_ratio;  // ratio of the ranges from the neighbour and from the reference
};

HWY_INLINE Sensitivity sensitivityOf(const Projection& camera, const Vector3& ray, VF inverse_range) {
  const VF fx = set(camera.fx), fy = set(camera.fy), one = set(1.0f);
  const Vector3 t{set(camera.translation[0]), set(camera.translation[1]), set(camera.translation[2])};
  const float* r = camera.rotation;
  const auto rotated = [&](const float* row) HWY_ATTR {
    return ray.dot({set(row[0]), set(row[1]), set(row[2])});
  };
  const Vector3 point = Vector3{rotated(r), rotated(r + 3), rotated(r + 6)}.plus(inverse_range, t);
  const VF squares = point.dot(point);
  const VF per_norm = reciprocalOfRoot(squares);
  const Vector3 direction = point.times(per_norm);
  const VF denominator = hn::Add(direction.z, set(camera.xi));
  const float min_cosine = camera.xi > 1.0f ? -1.0f / camera.xi : -camera.xi;
  const MF seen = hn::And(hn::And(hn::Gt(squares, set(1e-12f)), hn::Gt(denominator, set(1e-6f))),
                          hn::Gt(direction.z, set(min_cosine)));
  const VF per_denominator = reciprocal(denominator);
  const VF plane_x = hn::Mul(direction.x, per_denominator), plane_y = hn::Mul(direction.y, per_denominator);
  // Derivative of the direction, then of the pixel.
  const Vector3 turn = t.plus(hn::Neg(direction.dot(t)), direction).times(per_norm);
  const VF motion_x = hn::Mul(hn::Mul(fx, per_denominator), hn::NegMulAdd(plane_x, turn.z, turn.x));
  const VF motion_y = hn::Mul(hn::Mul(fy, per_denominator), hn::NegMulAdd(plane_y, turn.z, turn.y));
  const VF motion_squares = hn::MulAdd(motion_x, motion_x, hn::Mul(motion_y, motion_y));
  const VF per_motion = reciprocalOfRoot(hn::Max(motion_squares, set(kTiny)));
  const MF moves = hn::And(seen, hn::Gt(motion_squares, set(kTiny)));
  const VF scale = hn::Mul(per_denominator, per_motion);
  const VF along_x = hn::Mul(fx, hn::Mul(motion_x, scale)), along_y = hn::Mul(fy, hn::Mul(motion_y, scale));
  const Vector3 row{along_x, along_y, hn::Neg(hn::MulAdd(along_x, plane_x, hn::Mul(along_y, plane_y)))};
  const Vector3 across = row.plus(hn::Neg(direction.dot(row)), direction);
  return {hn::IfThenElseZero(moves, hn::Mul(motion_squares, per_motion)),
          hn::IfThenElseZero(seen, across.dot(across)), hn::IfThenElse(seen, hn::Mul(squares, per_norm), one),
          hn::IfThenElse(seen, per_norm, one)};
}

HWY_INLINE Vector3 loadRay(const UncertaintyRow& row, size_t at) {
  const DF df;
  return {hn::LoadU(df, row.ray_x + at), hn::LoadU(df, row.ray_y + at), hn::LoadU(df, row.ray_z + at)};
}

void largestMotionTarget(const UncertaintyRow& row, float* motion) {
  const DF df;
  const size_t lanes = hn::Lanes(df);
  for (size_t first = 0; first < row.count; first += lanes) {
    const size_t at = HWY_MIN(first, row.count - lanes);
    const Vector3 ray = loadRay(row, at);
    const VF inverse_range = hn::LoadU(df, row.inverse_range + at);
    VF largest = hn::Zero(df);
    for (int n = 0; n < row.num_neighbours; ++n) {
      const VF pixels =
          sensitivityOf(row.neighbours[n].projection, ray, inverse_range).pixels_per_inverse_range;
      largest = hn::IfThenElse(hn::Gt(pixels, largest), pixels, largest);  // ignores NaN
    }
    hn::StoreU(largest, df, motion + at);
  }
}

HWY_INLINE VF square(VF value) {
  return hn::Mul(value, value);
}

void inverseRangeSigmaTarget(const UncertaintyRow& row, float* sigma) {
  const DF df;
  const DI di;
  const size_t lanes = hn::Lanes(df);
  const VF zero = hn::Zero(df), one = set(1.0f), infinite = set(std::numeric_limits<float>::infinity());
  for (size_t first = 0; first < row.count; first += lanes) {
    const size_t at = HWY_MIN(first, row.count - lanes);
    const Vector3 ray = loadRay(row, at);
    const VF inverse_range = hn::LoadU(df, row.inverse_range + at);
    const VI voters = hn::LoadU(di, row.voters + at);
    VF motion_squares = zero, errors_before = zero, errors_after = zero, matching_errors = zero, count = zero;
    for (int n = 0; n < row.num_neighbours; ++n) {
      const NeighbourUncertainty& neighbour = row.neighbours[n];
      const VI bit = hn::Set(di, static_cast<int32_t>(1u << n));
      const MF votes = hn::RebindMask(df, hn::Eq(hn::And(voters, bit), bit));
      const Sensitivity s = sensitivityOf(neighbour.projection, ray, inverse_range);
      const VF motion = hn::IfThenElseZero(votes, s.pixels_per_inverse_range);
      const VF shift = hn::Mul(inverse_range, s.per_range_ratio);
      const VF pose_variance = hn::MulAdd(set(neighbour.translation_variance_m2), square(shift),
                                          set(neighbour.rotation_variance_rad2));
      // Windows at different scales differ by more than a shift.
      const VF scale = hn::Max(s.range_ratio, s.per_range_ratio);
      const VF matching = hn::Mul(hn::Mul(motion, set(row.matching_noise_px)), square(scale));
      VF& errors = neighbour.after ? errors_after : errors_before;
      errors = hn::MulAdd(motion, length(hn::Mul(s.squared_pixels_per_radian, pose_variance)), errors);
      motion_squares = hn::MulAdd(motion, motion, motion_squares);
      matching_errors = hn::MulAdd(matching, matching, matching_errors);
      count = hn::Add(count, hn::IfThenElseZero(votes, one));
    }
    const VF left = hn::Max(hn::Sub(one, hn::LoadU(df, row.score + at)), set(1e-3f));
    const VF noise = hn::Div(hn::Mul(set(row.noise_factor), left), hn::LoadU(df, row.curvature + at));
    const VF per_square = hn::Div(one, square(motion_squares));
    const VF errors = hn::MulAdd(errors_before, errors_before, square(errors_after));
    const VF pose = hn::MulAdd(errors, per_square, square(hn::Mul(set(row.scale_noise), inverse_range)));
    const VF variance = hn::Add(noise, hn::MulAdd(hn::Mul(count, matching_errors), per_square, pose));
    const MF is_known =
        hn::And(hn::Gt(motion_squares, zero), hn::Eq(noise, noise));  // NaN differs from itself
    const VF result = hn::IfThenElse(is_known, hn::Sqrt(variance), infinite);
    const VF nan = set(std::numeric_limits<float>::quiet_NaN());
    hn::StoreU(hn::IfThenElse(hn::Gt(inverse_range, zero), result, nan), df, sigma + at);
  }
}

void sumAgreeingTarget(const NeighbourhoodRow& row, float* number, float* sum) {
  const DF df;
  const size_t lanes = hn::Lanes(df);
  for (size_t first = 0; first < row.count; first += lanes) {
    const size_t at = HWY_MIN(first, row.count - lanes);
    const VF middle = hn::LoadU(df, row.middle + at), tolerance = hn::LoadU(df, row.tolerance + at);
    VF agreeing = hn::Zero(df), total = hn::Zero(df);
    for (int r = 0; r < row.num_rows; ++r) {
      const float* values = row.rows[r] + at;
      for (int shift = -row.max_shift; shift <= row.max_shift; shift += row.shift_step) {
        const VF value = hn::LoadU(df, values + shift);
        const MF agrees = hn::Le(hn::Abs(hn::Sub(value, middle)), tolerance);
        agreeing = hn::Add(agreeing, hn::IfThenElseZero(agrees, set(1.0f)));
        total = hn::Add(total, hn::IfThenElseZero(agrees, value));
      }
    }
    hn::StoreU(agreeing, df, number + at);
    hn::StoreU(total, df, sum + at);
  }
}

}  // namespace

void fillUncertaintyKernels(SweepKernels* kernels) {
  kernels->sumAgreeing = &sumAgreeingTarget;
  kernels->largestMotion = &largestMotionTarget;
  kernels->inverseRangeSigma = &inverseRangeSigmaTarget;
}

}  // namespace HWY_NAMESPACE
}  // namespace vcharge
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcharge {

HWY_EXPORT(fillUncertaintyKernels);

void addUncertaintyKernels(SweepKernels* kernels) {
  HWY_DYNAMIC_DISPATCH(fillUncertaintyKernels)(kernels);
}

}  // namespace vcharge
#endif
