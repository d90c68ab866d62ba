#include "ground/point_warp.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "vcharge_core/base/wide_loops.h"

namespace vcharge {
namespace {

// Points further off the axis than this (cosine of the unified model's denominator) are not projected.
constexpr float kMinDenominator = 0.1F;
constexpr int kFractionBits = 8, kOne = 1 << kFractionBits;
constexpr size_t kBlock = 256;

struct Projection {
  std::array<float, 9> rotation;  // by row
  std::array<float, 3> center;    // in the camera's axes, times the factor of the inverse range
  float xi, gamma1, gamma2, u0, v0;
};

/// Pixels of points; (-1, -1) too far off the axis.
VCHARGE_WIDE_LOOPS void project(const Projection& to, const PixelPoints& points, size_t first, size_t count,
                                float* u, float* v) {
  const float* x = points.x.data() + first;
  const float* y = points.y.data() + first;
  const float* z = points.z.data() + first;
  const float* inverse = points.inverse_range_per_m.data() + first;
  const std::array<float, 9> r = to.rotation;
  const std::array<float, 3> c = to.center;
  for (size_t i = 0; i < count; ++i) {
    const float px = r[0] * x[i] + r[1] * y[i] + r[2] * z[i] + c[0] * inverse[i];
    const float py = r[3] * x[i] + r[4] * y[i] + r[5] * z[i] + c[1] * inverse[i];
    const float pz = r[6] * x[i] + r[7] * y[i] + r[8] * z[i] + c[2] * inverse[i];
    const float norm = std::sqrt(px * px + py * py + pz * pz);
    const float denominator = pz + to.xi * norm;
    const bool is_seen = denominator > kMinDenominator * norm;
    const float scale = 1.0F / denominator;
    u[i] = is_seen ? to.gamma1 * px * scale + to.u0 : -1.0F;
    v[i] = is_seen ? to.gamma2 * py * scale + to.v0 : -1.0F;
  }
}

/// Bilinear; the coordinates have kFractionBits bits behind the point.
uint8_t interpolate(const cv::Mat& image, int x, int y) {
  const int a = x & (kOne - 1), b = y & (kOne - 1);
  const uint8_t* top = image.ptr<uint8_t>(y >> kFractionBits) + (x >> kFractionBits);
  const uint8_t* bottom = top + image.step;
  const int upper = top[0] * (kOne - a) + top[1] * a, lower = bottom[0] * (kOne - a) + bottom[1] * a;
  return static_cast<uint8_t>((upper * (kOne - b) + lower * b + kOne * kOne / 2) >> (2 * kFractionBits));
}

}  // namespace

WarpedImage unknownImage(cv::Size size) {
  return {cv::Mat::zeros(size, CV_8UC1), cv::Mat::zeros(size, CV_8UC1),
          cv::Mat(size, CV_32SC1, cv::Scalar(-1))};
}

void PixelPoints::reserve(size_t size) {
  pixel.reserve(size);
  for (std::vector<float>* values : {&x, &y, &z, &inverse_range_per_m}) {
    values->reserve(size);
  }
}

void PixelPoints::add(int32_t at_pixel, float ray_x, float ray_y, float ray_z, float at_inverse_range_per_m) {
  pixel.push_back(at_pixel);
  x.push_back(ray_x);
  y.push_back(ray_y);
  z.push_back(ray_z);
  inverse_range_per_m.push_back(at_inverse_range_per_m);
}

PointWarp::PointWarp(const MeiCamera& model, const cv::Mat& valid) : model_(model), valid_(valid.clone()) {}

WarpedImage PointWarp::warp(const cv::Mat& before, const RigidTransform& camera_from_points,
                            const Eigen::Vector3d& center, const PixelPoints& points,
                            float inverse_range_factor, const cv::Rect& rows) const {
  WarpedImage warped = unknownImage(rows.size());
  warpAgain(before, camera_from_points, center, points, inverse_range_factor, rows, &warped);
  return warped;
}

void PointWarp::warpAgain(const cv::Mat& before, const RigidTransform& camera_from_points,
                          const Eigen::Vector3d& center, const PixelPoints& points,
                          float inverse_range_factor, const cv::Rect& rows, WarpedImage* warped) const {
  const Eigen::Matrix3d rotation = camera_from_points.rotationMatrix();
  const Eigen::Vector3d at = static_cast<double>(inverse_range_factor) * (camera_from_points * center);
  Projection to{{},
                {},
                static_cast<float>(model_.xi()),
                static_cast<float>(model_.gamma1()),
                static_cast<float>(model_.gamma2()),
                static_cast<float>(model_.u0()),
                static_cast<float>(model_.v0())};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      to.rotation[3 * i + j] = static_cast<float>(rotation(static_cast<int>(i), static_cast<int>(j)));
    }
    to.center[i] = static_cast<float>(at[static_cast<int>(i)]);
  }
  const int columns = before.cols, offset = rows.y * columns;
  const auto last_column = static_cast<float>(columns - 1), last_row = static_cast<float>(before.rows - 1);
  uint8_t *image = warped->image.data, *known = warped->known.data;
  auto* nearest_of = warped->nearest.ptr<int32_t>();
  std::array<float, kBlock> u{}, v{};
  for (size_t first = 0; first < points.size(); first += kBlock) {
    const size_t count = std::min(kBlock, points.size() - first);
    project(to, points, first, count, u.data(), v.data());
    for (size_t i = 0; i < count; ++i) {
      int nearest = -1;
      uint8_t value = 0;
      if (u[i] >= 0.0F && v[i] >= 0.0F && u[i] < last_column && v[i] < last_row) {
        const auto x = static_cast<int>(u[i] * kOne), y = static_cast<int>(v[i] * kOne);
        const int candidate = ((y + kOne / 2) >> kFractionBits) * columns + ((x + kOne / 2) >> kFractionBits);
        if (isValid(candidate)) {
          nearest = candidate;
          value = interpolate(before, x, y);
        }
      }
      const int pixel = points.pixel[first + i] - offset;
      image[pixel] = value;
      known[pixel] = nearest >= 0 ? 255 : 0;
      nearest_of[pixel] = nearest;
    }
  }
}

}  // namespace vcharge
