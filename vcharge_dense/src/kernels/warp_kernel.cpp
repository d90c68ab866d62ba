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

struct Positions {
  VF u, v;
  decltype(hn::Lt(VF(), VF())) seen;
};

struct Points {
  VF x, y, z;
};

HWY_INLINE VF normOf(const Points& p) {
  return root(hn::MulAdd(p.x, p.x, hn::MulAdd(p.y, p.y, hn::Mul(p.z, p.z))));
}

HWY_INLINE VF unifiedDenominator(const Points& points, VF norm, float xi) {
  return hn::MulAdd(hn::Set(DF(), xi), norm, points.z);
}

/// The points of rays in the neighbour, times their inverse ranges: at infinity + inverse range * change.
struct Lines {
  Points at_infinity, change;

  HWY_INLINE Points at(VF inverse_range) const {
    return {hn::MulAdd(inverse_range, change.x, at_infinity.x),
            hn::MulAdd(inverse_range, change.y, at_infinity.y),
            hn::MulAdd(inverse_range, change.z, at_infinity.z)};
  }
  /// Adds time * (turn rate x rays + inverse range * velocity).
  HWY_INLINE void move(VF time, const LineMotion& motion, const Points& rays) {
    const DF df;
    const float* w = motion.turn_rate;
    const VF a = hn::Set(df, w[0]), b = hn::Set(df, w[1]), c = hn::Set(df, w[2]);
    at_infinity.x = hn::MulAdd(time, hn::MulSub(b, rays.z, hn::Mul(c, rays.y)), at_infinity.x);
    at_infinity.y = hn::MulAdd(time, hn::MulSub(c, rays.x, hn::Mul(a, rays.z)), at_infinity.y);
    at_infinity.z = hn::MulAdd(time, hn::MulSub(a, rays.y, hn::Mul(b, rays.x)), at_infinity.z);
    change.x = hn::MulAdd(time, hn::Set(df, motion.velocity[0]), change.x);
    change.y = hn::MulAdd(time, hn::Set(df, motion.velocity[1]), change.y);
    change.z = hn::MulAdd(time, hn::Set(df, motion.velocity[2]), change.z);
  }
};

/// When points are exposed, see ExposureTimes; `inverse`: of their denominators.
HWY_INLINE VF exposureTime(const LineMotion& motion, const Points& points, VF inverse) {
  const DF df;
  const VF x = hn::Mul(points.x, inverse), y = hn::Mul(points.y, inverse);
  const VF squared = hn::MulAdd(x, x, hn::Mul(y, y));
  const float* c = motion.times_s;
  const VF bend = hn::MulAdd(squared, hn::Set(df, c[3]), hn::Set(df, c[2]));
  const VF slope = hn::MulAdd(squared, bend, hn::Set(df, c[1]));
  return hn::MulAdd(motion.lines_are_columns ? x : y, slope, hn::Set(df, c[0]));
}

HWY_INLINE VF inverseRange(const RayRow& rays, size_t at) {
  const DF df;
  return hn::MulAdd(hn::Set(df, rays.offset), hn::Load(df, rays.weight + at), hn::Load(df, rays.base + at));
}

/// Where images are exposed on the move, to first order: from where the reference was when it exposed a ray
/// to its stamp, and from the neighbour's stamp to where it was when it exposed the line that would see, at
/// the stamp, the point at `inverse_range`.
HWY_INLINE Lines linesOf(const Projection& p, const RayRow& rays, size_t at, VF inverse_range) {
  const DF df;
  const Points ray{hn::Load(df, rays.x + at), hn::Load(df, rays.y + at), hn::Load(df, rays.z + at)};
  const auto along = [&](int axis) HWY_ATTR {
    const float* r = p.rotation + 3 * axis;
    return hn::MulAdd(hn::Set(df, r[0]), ray.x,
                      hn::MulAdd(hn::Set(df, r[1]), ray.y, hn::Mul(hn::Set(df, r[2]), ray.z)));
  };
  const Points rotated{along(0), along(1), along(2)};
  Lines lines{rotated,
              {hn::Set(df, p.translation[0]), hn::Set(df, p.translation[1]), hn::Set(df, p.translation[2])}};
  if (p.is_moving) {
    const Points seen = lines.at(inverse_range);
    const VF of_ray = reciprocal(unifiedDenominator(ray, hn::Set(df, 1.0f), p.reference_xi));
    const VF of_seen = reciprocal(unifiedDenominator(seen, normOf(seen), p.xi));
    lines.move(exposureTime(p.reference, ray, of_ray), p.reference, rotated);
    lines.move(hn::Neg(exposureTime(p.neighbour, seen, of_seen)), p.neighbour, rotated);
  }
  return lines;
}

HWY_INLINE Positions project(const Projection& p, const Points& q) {
  const DF df;
  const VF norm = normOf(q);
  const VF inverse = reciprocal(unifiedDenominator(q, norm, p.xi));
  const VF u = hn::MulAdd(hn::Mul(hn::Set(df, p.fx), q.x), inverse, hn::Set(df, p.cx));
  const VF v = hn::MulAdd(hn::Mul(hn::Set(df, p.fy), q.y), inverse, hn::Set(df, p.cy));
  const VF min_cosine = hn::Set(df, p.xi > 1.0f ? -1.0f / p.xi : -p.xi);
  const auto in_front = hn::Gt(q.z, hn::Mul(min_cosine, norm));
  const auto inside_u = hn::And(hn::Ge(u, hn::Set(df, p.min_x)), hn::Le(u, hn::Set(df, p.max_x)));
  const auto inside_v = hn::And(hn::Ge(v, hn::Set(df, p.min_y)), hn::Le(v, hn::Set(df, p.max_y)));
  return {u, v, hn::And(in_front, hn::And(inside_u, inside_v))};
}

HWY_INLINE Positions projectVector(const Projection& p, const RayRow& rays, size_t at) {
  const VF inverse_range = inverseRange(rays, at);
  return project(p, linesOf(p, rays, at, inverse_range).at(inverse_range));
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

/// Cell of the four pixels at column x, see PackedImage.
int32_t cellAt(const PixelRows& rows, size_t x) {
  const auto signedByte = [](uint8_t gray) {
    return static_cast<uint32_t>(gray > 1 ? gray : uint8_t{1}) ^ 0x80u;
  };
  const bool seen = rows.top_valid[x] != 0 && rows.bottom_valid[x] != 0 && rows.top_valid[x + 1] != 0 &&
                    rows.bottom_valid[x + 1] != 0;
  const uint32_t cell = signedByte(rows.top[x]) | signedByte(rows.bottom[x]) << 8 |
                        signedByte(rows.top[x + 1]) << 16 | signedByte(rows.bottom[x + 1]) << 24;
  return seen ? static_cast<int32_t>(cell) : kUnseenCell;
}

void packCellsTarget(const PixelRows& rows, size_t count, int32_t* cells) {
  size_t x = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::CappedTag<uint8_t, 16> d8;
  const hn::Repartition<uint16_t, decltype(d8)> d16;
  const hn::Repartition<int32_t, decltype(d8)> d32;
  const auto top_bit = hn::Set(d8, 0x80);
  for (; x + hn::Lanes(d8) <= count; x += hn::Lanes(d8)) {
    const auto valid =
        hn::Min(hn::Min(hn::LoadU(d8, rows.top_valid + x), hn::LoadU(d8, rows.bottom_valid + x)),
                hn::Min(hn::LoadU(d8, rows.top_valid + x + 1), hn::LoadU(d8, rows.bottom_valid + x + 1)));
    const auto unseen = hn::Eq(valid, hn::Zero(d8));
    const auto bytes = [&](const uint8_t* pixels) HWY_ATTR {
      const auto pixel = hn::Max(hn::LoadU(d8, pixels), hn::Set(d8, 1));
      return hn::IfThenElse(unseen, top_bit, hn::Xor(pixel, top_bit));
    };
    const auto store = [&](auto left, auto right, int32_t* to) HWY_ATTR {
      hn::StoreU(hn::BitCast(d32, hn::InterleaveLower(d16, left, right)), d32, to);
      hn::StoreU(hn::BitCast(d32, hn::InterleaveUpper(d16, left, right)), d32, to + hn::Lanes(d32));
    };
    const auto left_top = bytes(rows.top + x), left_bottom = bytes(rows.bottom + x);
    const auto right_top = bytes(rows.top + x + 1), right_bottom = bytes(rows.bottom + x + 1);
    store(hn::BitCast(d16, hn::InterleaveLower(d8, left_top, left_bottom)),
          hn::BitCast(d16, hn::InterleaveLower(d8, right_top, right_bottom)), cells + x);
    store(hn::BitCast(d16, hn::InterleaveUpper(d8, left_top, left_bottom)),
          hn::BitCast(d16, hn::InterleaveUpper(d8, right_top, right_bottom)), cells + x + 2 * hn::Lanes(d32));
  }
#endif
  for (; x < count; ++x) {
    cells[x] = cellAt(rows, x);
  }
}

/// Quadratic of one coordinate through its positions at -reach, 0 and reach steps.
struct Steps {
  VI steps;                           // see StepTable
  decltype(hn::Lt(VF(), VF())) fits;  // both coefficients fit into 16 bits

  HWY_INLINE Steps(VF before, VF middle, VF after, float reach) {
    const DF df;
    constexpr auto kOneStep = static_cast<float>(1 << kStepBits);
    const VF slope = hn::Mul(hn::Sub(after, before), hn::Set(df, 0.5f * kOneStep / reach));
    const VF bend = hn::Mul(hn::Sub(hn::Add(before, after), hn::Add(middle, middle)),
                            hn::Set(df, 0.5f * kOneStep / (reach * reach)));
    const VF limit = hn::Set(df, 32767.0f);
    fits = hn::And(hn::Lt(hn::Abs(slope), limit), hn::Lt(hn::Abs(bend), limit));
    steps = hn::OrAnd(hn::ShiftLeft<16>(nearest(bend)), nearest(slope), hn::Set(DI(), 0xffff));
  }
};

void makeStepsTarget(const Projection& projection, const RayRow& rays, float step, int reach, size_t count,
                     const StepTable& table) {
  const DF df;
  const DI di;
  const VF one = hn::Set(df, kOne);
  const auto far = static_cast<float>(reach);
  RayRow rays_before = rays, rays_after = rays;
  rays_before.offset -= far * step;
  rays_after.offset += far * step;
  for (size_t i = 0; i < count; i += hn::Lanes(df)) {
    // A few pixels apart, points are exposed at the same time.
    const VF inverse_range = inverseRange(rays, i);
    const Lines lines = linesOf(projection, rays, i, inverse_range);
    const Positions before = project(projection, lines.at(inverseRange(rays_before, i)));
    const Positions middle = project(projection, lines.at(inverse_range));
    const Positions after = project(projection, lines.at(inverseRange(rays_after, i)));
    const Steps along_u(before.u, middle.u, after.u, far), along_v(before.v, middle.v, after.v, far);
    const auto seen =
        hn::And(hn::And(before.seen, middle.seen), hn::And(after.seen, hn::And(along_u.fits, along_v.fits)));
    const auto seen_int = hn::RebindMask(di, seen);
    hn::Store(nearest(hn::IfThenElseZero(seen, hn::Mul(one, middle.u))), di, table.u + i);
    hn::Store(nearest(hn::IfThenElseZero(seen, hn::Mul(one, middle.v))), di, table.v + i);
    hn::Store(hn::IfThenElseZero(seen_int, along_u.steps), di, table.u_steps + i);
    hn::Store(hn::IfThenElseZero(seen_int, along_v.steps), di, table.v_steps + i);
  }
}

void walkStepsTarget(const StepTable& table, int steps, size_t count, int32_t* u, int32_t* v) {
  const DI di;
  const VI powers = hn::Set(di, steps * steps << 16 | (steps & 0xffff));
  for (size_t i = 0; i < count; i += hn::Lanes(di)) {
    const VI motion_u = multiplyHalves(hn::Load(di, table.u_steps + i), powers);
    const VI motion_v = multiplyHalves(hn::Load(di, table.v_steps + i), powers);
    hn::Store(hn::Add(hn::Load(di, table.u + i), hn::ShiftLeft<kPositionBits - kStepBits>(motion_u)), di,
              u + i);
    hn::Store(hn::Add(hn::Load(di, table.v + i), hn::ShiftLeft<kPositionBits - kStepBits>(motion_v)), di,
              v + i);
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
  kernels->packCells = &packCellsTarget;
  kernels->project = &projectTarget;
  kernels->projectFixed = &projectFixedTarget;
  kernels->makeSteps = &makeStepsTarget;
  kernels->walkSteps = &walkStepsTarget;
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
