// Arrays of vectors do not exist for SVE and RVV, whose vectors have no fixed size.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/warp_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
//
#include <hwy/highway.h>

#include <cmath>
#include <limits>

#include "kernels/lane_operations-inl.h"
#include "kernels/sweep_kernels.h"
#include "kernels/sweep_kernels_internal.h"

HWY_BEFORE_NAMESPACE();
namespace vcharge {
namespace HWY_NAMESPACE {
namespace {

constexpr float kOne = static_cast<float>(1 << kPositionBits);

// Roots and reciprocals with at least 22 correct bits (0.0002 pixels). Where the processor's estimates have
// 11 bits or more, one step of Newton's method doubles them, which is faster than division.
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
#else
HWY_INLINE VF root(VF value) {
  return hn::Sqrt(value);
}
HWY_INLINE VF reciprocal(VF value) {
  return hn::Div(hn::Set(DF(), 1.0f), value);
}
#endif

struct Positions {
  VF u, v;
  decltype(hn::Lt(VF(), VF())) seen;
};

HWY_INLINE Positions projectVector(const Projection& p, const RayRow& rays, size_t at) {
  const DF df;
  const VF inverse_range =
      hn::MulAdd(hn::Set(df, rays.offset), hn::Load(df, rays.weight + at), hn::Load(df, rays.base + at));
  const VF x = hn::Load(df, rays.x + at), y = hn::Load(df, rays.y + at), z = hn::Load(df, rays.z + at);
  const auto transformed = [&](int axis) HWY_ATTR {
    const float* r = p.rotation + 3 * axis;
    const VF rotated =
        hn::MulAdd(hn::Set(df, r[0]), x, hn::MulAdd(hn::Set(df, r[1]), y, hn::Mul(hn::Set(df, r[2]), z)));
    return hn::MulAdd(inverse_range, hn::Set(df, p.translation[axis]), rotated);
  };
  const VF qx = transformed(0), qy = transformed(1), qz = transformed(2);
  const VF norm = root(hn::MulAdd(qx, qx, hn::MulAdd(qy, qy, hn::Mul(qz, qz))));
  const VF xi = hn::Set(df, p.xi);
  const VF inverse = reciprocal(hn::MulAdd(xi, norm, qz));
  const VF u = hn::MulAdd(hn::Mul(hn::Set(df, p.fx), qx), inverse, hn::Set(df, p.cx));
  const VF v = hn::MulAdd(hn::Mul(hn::Set(df, p.fy), qy), inverse, hn::Set(df, p.cy));
  const VF min_cosine = hn::Set(df, p.xi > 1.0f ? -1.0f / p.xi : -p.xi);
  const auto in_front = hn::Gt(qz, hn::Mul(min_cosine, norm));
  const auto inside_u = hn::And(hn::Ge(u, hn::Set(df, p.min_x)), hn::Le(u, hn::Set(df, p.max_x)));
  const auto inside_v = hn::And(hn::Ge(v, hn::Set(df, p.min_y)), hn::Le(v, hn::Set(df, p.max_y)));
  return {u, v, hn::And(in_front, hn::And(inside_u, inside_v))};
}

void projectTarget(const Projection& projection, const RayRow& rays, size_t count, float* u, float* v) {
  const DF df;
  const VF nan = hn::Set(df, std::numeric_limits<float>::quiet_NaN());
  for (size_t i = 0; i < count; i += hn::Lanes(df)) {
    const Positions at = projectVector(projection, rays, i);
    hn::Store(hn::IfThenElse(at.seen, at.u, nan), df, u + i);
    hn::Store(hn::IfThenElse(at.seen, at.v, nan), df, v + i);
  }
}

void projectFixedTarget(const Projection& projection, const RayRow& rays, size_t count, int32_t* u,
                        int32_t* v) {
  const DF df;
  const DI di;
  const VF one = hn::Set(df, kOne);
  for (size_t i = 0; i < count; i += hn::Lanes(df)) {
    const Positions at = projectVector(projection, rays, i);
    hn::Store(hn::NearestInt(hn::IfThenElseZero(at.seen, hn::Mul(one, at.u))), di, u + i);
    hn::Store(hn::NearestInt(hn::IfThenElseZero(at.seen, hn::Mul(one, at.v))), di, v + i);
  }
}

/// a + b x + c x^2 through values at 0, h and 2 h.
struct Quadratic {
  VF a, b, c;
};
HWY_INLINE Quadratic fitQuadratic(VF at_0, VF at_h, VF at_2h, float h) {
  const DF df;
  const VF second = hn::Sub(hn::Add(at_0, at_2h), hn::Add(at_h, at_h));
  const VF c = hn::Mul(second, hn::Set(df, 0.5f / (h * h)));
  const VF slope = hn::Mul(hn::Sub(at_h, at_0), hn::Set(df, 1.0f / h));
  return {at_0, hn::NegMulAdd(c, hn::Set(df, h), slope), c};
}

void makeCellsTarget(const float* const* u_rows, const float* const* v_rows, int nodes, int spacing,
                     float* cells) {
  const DF df;
  const size_t lanes = hn::Lanes(df);
  const VF one = hn::Set(df, kOne);
  const auto h = static_cast<float>(spacing);
  for (int node = 0; node + 2 < nodes; node += 2) {
    const size_t at = static_cast<size_t>(node) * lanes;
    VF coefficients[kCellCoefficients];
    VF sum = hn::Zero(df);
    for (int coordinate = 0; coordinate < 2; ++coordinate) {
      const float* const* rows = coordinate == 0 ? u_rows : v_rows;
      VF starts[3], firsts[3], seconds[3];
      for (int row = 0; row < 3; ++row) {
        const float* values = rows[row] + at;
        const Quadratic along =
            fitQuadratic(hn::Mul(one, hn::Load(df, values)), hn::Mul(one, hn::Load(df, values + lanes)),
                         hn::Mul(one, hn::Load(df, values + 2 * lanes)), h);
        starts[row] = along.a;
        firsts[row] = hn::Add(along.b, along.c);
        seconds[row] = hn::Add(along.c, along.c);
      }
      VF* out = coefficients + 9 * coordinate;
      for (const VF* down : {starts, firsts, seconds}) {
        const Quadratic polynomial = fitQuadratic(down[0], down[1], down[2], h);
        *out++ = polynomial.a;
        *out++ = polynomial.b;
        *out++ = polynomial.c;
        sum = hn::Add(sum, hn::Add(polynomial.a, hn::Add(polynomial.b, polynomial.c)));
      }
    }
    const auto seen = hn::Eq(sum, sum);  // NaN differs from itself
    for (const VF coefficient : coefficients) {
      hn::Store(hn::IfThenElseZero(seen, coefficient), df, cells);
      cells += lanes;
    }
  }
}

/// The larger of both values, ignoring NaN in `value`.
HWY_INLINE VF maxOfKnown(VF value, VF largest) {
  return hn::IfThenElse(hn::Gt(value, largest), value, largest);
}

NodeDifferences nodeDifferencesTarget(const float* u, const float* v, int node_rows, int nodes) {
  const DF df;
  const size_t lanes = hn::Lanes(df);
  const size_t row_size = static_cast<size_t>(nodes) * lanes;
  VF second = hn::Zero(df), third = hn::Zero(df);
  // Updates the differences along `count` values, `step` floats apart.
  const auto consider = [&](const float* values, size_t step, int count) HWY_ATTR {
    VF last = hn::Load(df, values + step);
    VF slope = hn::Sub(last, hn::Load(df, values)), last_bend = slope;
    for (int i = 2; i < count; ++i) {
      const VF value = hn::Load(df, values + static_cast<size_t>(i) * step);
      const VF next_slope = hn::Sub(value, last);
      const VF bend = hn::Sub(next_slope, slope);
      second = maxOfKnown(hn::Abs(bend), second);
      if (i > 2) {
        third = maxOfKnown(hn::Abs(hn::Sub(bend, last_bend)), third);
      }
      last = value;
      slope = next_slope;
      last_bend = bend;
    }
  };
  for (const float* values : {u, v}) {
    for (int row = 0; row < node_rows; ++row) {
      consider(values + static_cast<size_t>(row) * row_size, lanes, nodes);
    }
    for (int node = 0; node < nodes; ++node) {
      consider(values + static_cast<size_t>(node) * lanes, row_size, node_rows);
    }
  }
  return {hn::GetLane(hn::MaxOfLanes(df, second)), hn::GetLane(hn::MaxOfLanes(df, third))};
}

}  // namespace

void fillWarpKernels(SweepKernels* kernels) {
  kernels->lanes = static_cast<int>(hn::Lanes(DF()));
  kernels->project = &projectTarget;
  kernels->projectFixed = &projectFixedTarget;
  kernels->makeCells = &makeCellsTarget;
  kernels->nodeDifferences = &nodeDifferencesTarget;
}

}  // namespace HWY_NAMESPACE
}  // namespace vcharge
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcharge {

HWY_EXPORT(fillWarpKernels);

void addWarpKernels(SweepKernels* kernels) {
  HWY_DYNAMIC_DISPATCH(fillWarpKernels)(kernels);
}

}  // namespace vcharge
#endif
