#include "exposure/range_rectification.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "exposure/row_times.h"
#include "kernels/parallel_rows.h"
#include "kernels/pooled_mat.h"
#include "vcharge_core/base/wide_loops.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
// Each iteration divides the error by the ratio of what lines are apart in time to what they see move.
constexpr int kIterations = 2;
// Four pixels are one surface if their inverse ranges differ less, relatively.
constexpr float kSameSurface = 0.1F;

/// Where the camera saw what the pixels of a row show at the stamp.
struct SeenRow {
  std::vector<float> u, v;            // position in the image
  std::vector<float> time_s;          // after the stamp
  std::vector<float> x, y, z;         // direction of the ray when it was exposed
  std::vector<float> inverse_range;   // from where the camera was then; 0 where it is unknown
  std::vector<float> range_at_stamp;  // without meaning where it is unknown

  explicit SeenRow(size_t columns)
      : u(columns),
        v(columns),
        time_s(columns),
        x(columns),
        y(columns),
        z(columns),
        inverse_range(columns),
        range_at_stamp(columns) {}
};

/// Single precision, as loops take it.
struct Motion {
  float fx, fy, cx, cy, xi;
  float velocity[3], turn_rate[3];

  Motion(const MeiCamera& camera, const Exposure& exposure)
      : fx(static_cast<float>(camera.gamma1())),
        fy(static_cast<float>(camera.gamma2())),
        cx(static_cast<float>(camera.u0())),
        cy(static_cast<float>(camera.v0())),
        xi(static_cast<float>(camera.xi())) {
    for (int i = 0; i < 3; ++i) {
      velocity[i] = static_cast<float>(exposure.velocity_m_per_s[i]);
      turn_rate[i] = static_cast<float>(exposure.turn_rate_rad_per_s[i]);
    }
  }
};

/// Where the camera sees the rays of the stamp at these times, if what they show has these inverse ranges.
/// Compilers trust that parameters do not overlap, but not that local pointers do not.
VCHARGE_WIDE_LOOPS void findDirections(const Motion& motion, size_t count, const float* __restrict ray_x,
                                       const float* __restrict ray_y, const float* __restrict ray_z,
                                       const float* __restrict inverse_range, const float* __restrict time_s,
                                       float* __restrict x, float* __restrict y, float* __restrict z) {
  const float vx = motion.velocity[0], vy = motion.velocity[1], vz = motion.velocity[2];
  const float wx = motion.turn_rate[0], wy = motion.turn_rate[1], wz = motion.turn_rate[2];
  for (size_t i = 0; i < count; ++i) {
    const float time = time_s[i], rx = ray_x[i], ry = ray_y[i], rz = ray_z[i];
    const float approach = vx * rx + vy * ry + vz * rz;
    const float s = inverse_range[i] / (1.0F + inverse_range[i] * time * approach);
    const float dx = rx - time * (wy * rz - wz * ry + s * vx);
    const float dy = ry - time * (wz * rx - wx * rz + s * vy);
    const float dz = rz - time * (wx * ry - wy * rx + s * vz);
    const float per_norm = 1.0F / std::sqrt(dx * dx + dy * dy + dz * dz);
    x[i] = dx * per_norm;
    y[i] = dy * per_norm;
    z[i] = dz * per_norm;
  }
}

VCHARGE_WIDE_LOOPS void project(const Motion& motion, size_t count, const float* __restrict x,
                                const float* __restrict y, const float* __restrict z, float* __restrict u,
                                float* __restrict v) {
  const float fx = motion.fx, fy = motion.fy, cx = motion.cx, cy = motion.cy, xi = motion.xi;
  for (size_t i = 0; i < count; ++i) {
    const float per_denominator = 1.0F / (z[i] + xi);
    u[i] = fx * x[i] * per_denominator + cx;
    v[i] = fy * y[i] * per_denominator + cy;
  }
}

VCHARGE_WIDE_LOOPS void findRangesAtStamp(const Motion& motion, SeenRow* row) {
  const float vx = motion.velocity[0], vy = motion.velocity[1], vz = motion.velocity[2];
  const float *x = row->x.data(), *y = row->y.data(), *z = row->z.data(), *time_s = row->time_s.data();
  const float* inverse_range = row->inverse_range.data();
  float* range_at_stamp = row->range_at_stamp.data();
  for (size_t i = 0; i < row->u.size(); ++i) {
    const float range = 1.0F / inverse_range[i];
    const float px = range * x[i] + time_s[i] * vx, py = range * y[i] + time_s[i] * vy;
    const float pz = range * z[i] + time_s[i] * vz;
    range_at_stamp[i] = std::sqrt(px * px + py * py + pz * pz);
  }
}

/// The pixels of a range map around positions.
class Lookup {
 public:
  Lookup(const RangeMap& map, const cv::Mat& inverse_range)
      : map_(map), inverse_range_(inverse_range), last_(map.range_m.cols - 1, map.range_m.rows - 1) {}

  /// Nearest pixel; false where it is outside of the image.
  bool nearest(float u, float v, cv::Point* pixel) const {
    pixel->x = cvRound(u);
    pixel->y = cvRound(v);
    return pixel->x >= 0 && pixel->y >= 0 && pixel->x <= last_.x && pixel->y <= last_.y;
  }
  /// Inverse range of the nearest pixel; 0, as if far away, where it is unknown.
  float inverseRangeNear(float u, float v) const {
    cv::Point pixel;
    return nearest(u, v, &pixel) ? inverse_range_.at<float>(pixel) : 0.0F;
  }
  /// Interpolated where the four pixels around the position are one surface.
  float inverseRangeAt(float u, float v) const {
    const cv::Point corner = cornerOf(u, v);
    const auto* top = inverse_range_.ptr<float>(corner.y) + corner.x;
    const auto* bottom = inverse_range_.ptr<float>(corner.y + 1) + corner.x;
    const float least = std::min(std::min(top[0], top[1]), std::min(bottom[0], bottom[1]));
    const float most = std::max(std::max(top[0], top[1]), std::max(bottom[0], bottom[1]));
    if (!(most <= (1.0F + kSameSurface) * least)) {
      return inverseRangeNear(u, v);
    }
    const float a = u - static_cast<float>(corner.x), b = v - static_cast<float>(corner.y);
    const float upper = top[0] + a * (top[1] - top[0]), lower = bottom[0] + a * (bottom[1] - bottom[0]);
    return upper + b * (lower - upper);
  }
  uint8_t gray(float u, float v) const {
    const cv::Point corner = cornerOf(u, v);
    const float a = std::clamp(u - static_cast<float>(corner.x), 0.0F, 1.0F);
    const float b = std::clamp(v - static_cast<float>(corner.y), 0.0F, 1.0F);
    const auto* top = map_.reference.ptr<uint8_t>(corner.y) + corner.x;
    const auto* bottom = map_.reference.ptr<uint8_t>(corner.y + 1) + corner.x;
    const float upper = static_cast<float>(top[0]) + a * static_cast<float>(top[1] - top[0]);
    const float lower = static_cast<float>(bottom[0]) + a * static_cast<float>(bottom[1] - bottom[0]);
    return static_cast<uint8_t>(upper + b * (lower - upper) + 0.5F);  // NOLINT: never negative
  }

 private:
  /// The first of the four pixels around a position, within the image.
  cv::Point cornerOf(float u, float v) const {
    return {std::clamp(static_cast<int>(u), 0, last_.x - 1), std::clamp(static_cast<int>(v), 0, last_.y - 1)};
  }

  const RangeMap& map_;
  const cv::Mat& inverse_range_;
  const cv::Point last_;
};

/// 0 where the range is unknown.
VCHARGE_WIDE_LOOPS void invert(const float* range, int count, float* inverse_range) {
  for (int i = 0; i < count; ++i) {
    const float inverse = 1.0F / range[i];
    inverse_range[i] = inverse > 0.0F ? inverse : 0.0F;  // false for NaN
  }
}

}  // namespace

RangeMap rectified(const RangeMap& map, const RayTable& rays, const Exposure& exposure) {
  const cv::Size size = map.range_m.size();
  const auto columns = static_cast<size_t>(size.width);
  const Motion motion(map.camera, exposure);
  cv::Mat inverse_range = pooledMat(size, CV_32FC1);
  forEachRow(size.height,
             [&](int y) { invert(map.range_m.ptr<float>(y), size.width, inverse_range.ptr<float>(y)); });
  const Lookup lookup(map, inverse_range);
  RangeMap result = map;
  result.range_m = pooledMat(size, CV_32FC1);
  result.standard_deviation_m = pooledMat(size, CV_32FC1);
  result.confidence = pooledMat(size, CV_32FC1);
  result.reference = map.reference.clone();
  forEachRow(size.height, [&](int y) {
    const size_t first = static_cast<size_t>(y) * columns;
    SeenRow seen(columns);
    for (size_t i = 0; i < columns; ++i) {
      seen.u[i] = static_cast<float>(i);
      seen.v[i] = static_cast<float>(y);
    }
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      for (size_t i = 0; i < columns; ++i) {
        seen.inverse_range[i] = lookup.inverseRangeNear(seen.u[i], seen.v[i]);
      }
      exposureTimesOfRow(map.camera, exposure.times, seen.u.data(), seen.v.data(), columns,
                         seen.time_s.data());
      findDirections(motion, columns, rays.x().data() + first, rays.y().data() + first,
                     rays.z().data() + first, seen.inverse_range.data(), seen.time_s.data(), seen.x.data(),
                     seen.y.data(), seen.z.data());
      project(motion, columns, seen.x.data(), seen.y.data(), seen.z.data(), seen.u.data(), seen.v.data());
    }
    for (size_t i = 0; i < columns; ++i) {
      const bool is_valid = rays.valid(static_cast<int>(i), y);
      seen.inverse_range[i] = is_valid ? lookup.inverseRangeAt(seen.u[i], seen.v[i]) : 0.0F;
    }
    findRangesAtStamp(motion, &seen);
    auto* range = result.range_m.ptr<float>(y);
    auto* deviation = result.standard_deviation_m.ptr<float>(y);
    auto* confidence = result.confidence.ptr<float>(y);
    auto* gray = result.reference.ptr<uint8_t>(y);
    for (size_t i = 0; i < columns; ++i) {
      cv::Point at;
      const bool is_seen = rays.valid(static_cast<int>(i), y) && lookup.nearest(seen.u[i], seen.v[i], &at);
      const bool is_known = is_seen && map.range_m.at<float>(at) > 0.0F;  // false for NaN
      range[i] = is_known ? seen.range_at_stamp[i] : kNaN;
      deviation[i] = is_known ? map.standard_deviation_m.at<float>(at) : kNaN;
      confidence[i] = is_known ? map.confidence.at<float>(at) : 0.0F;
      gray[i] = is_seen ? lookup.gray(seen.u[i], seen.v[i]) : gray[i];
    }
  });
  return result;
}

}  // namespace vcharge
