#include "range_mapping/range_fusion.h"

#include <cmath>
#include <limits>

#include <opencv2/core.hpp>

#include "kernels/parallel_rows.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
// Two measurements contradict each other if they differ by more than this many standard deviations of their
// difference.
constexpr float kMaxDeviations = 3.0f;

float square(float value) {
  return value * value;
}

/// One pixel of a range map as an inverse range with its variance.
struct Measurement {
  float inverse_range;  // NaN if unknown
  float variance;
  float confidence;
};

Measurement measurementAt(const RangeMap& map, int y, int x) {
  const float range = map.range_m.at<float>(y, x);
  return {1.0f / range, square(map.standard_deviation_m.at<float>(y, x) / square(range)),
          map.confidence.at<float>(y, x)};
}

void setUnknown(int y, int x, RangeMap* map) {
  map->range_m.at<float>(y, x) = kNaN;
  map->standard_deviation_m.at<float>(y, x) = kNaN;
  map->confidence.at<float>(y, x) = 0.0f;
}

void set(int y, int x, const Measurement& measurement, RangeMap* map) {
  const float range = 1.0f / measurement.inverse_range;
  map->range_m.at<float>(y, x) = range;
  map->standard_deviation_m.at<float>(y, x) = std::sqrt(measurement.variance) * square(range);
  map->confidence.at<float>(y, x) = measurement.confidence;
}

Measurement fused(const Measurement& a, const Measurement& b) {
  const float sum = a.variance + b.variance;
  const float weight_a = sum > 0.0f ? b.variance / sum : 0.5f;
  return {weight_a * a.inverse_range + (1.0f - weight_a) * b.inverse_range, weight_a * a.variance,
          1.0f - (1.0f - a.confidence) * (1.0f - b.confidence)};
}

}  // namespace

RangeMap copyOf(const RangeMap& map) {
  RangeMap copy = map;
  copy.range_m = map.range_m.clone();
  copy.standard_deviation_m = map.standard_deviation_m.clone();
  copy.confidence = map.confidence.clone();
  return copy;
}

RangeMap confirmedRanges(const RangeMap& map, const RangeMap& other, const RigidTransform& other_from_camera,
                         double tolerance_per_m) {
  RangeMap confirmed = copyOf(map);
  const cv::Rect inside(cv::Point(), other.range_m.size());
  const auto isConfirmed = [&](int y, int x, float range_m) {
    Eigen::Vector3d ray;
    Eigen::Vector2d pixel;
    if (!map.camera.unproject(Eigen::Vector2d(x, y), &ray)) {
      return false;
    }
    const Eigen::Vector3d point = other_from_camera * (static_cast<double>(range_m) * ray);
    if (!other.camera.project(point, &pixel)) {
      return false;
    }
    const cv::Point at(cvRound(pixel.x()), cvRound(pixel.y()));
    return inside.contains(at) &&
           std::abs(1.0 / other.range_m.at<float>(at) - 1.0 / point.norm()) <= tolerance_per_m;  // false: NaN
  };
  forEachRow(map.range_m.rows, [&](int y) {
    for (int x = 0; x < map.range_m.cols; ++x) {
      const float range_m = map.range_m.at<float>(y, x);
      if (!std::isnan(range_m) && !isConfirmed(y, x, range_m)) {
        setUnknown(y, x, &confirmed);
      }
    }
  });
  return confirmed;
}

RangeMap fuseRangeMaps(const RangeMap& a, const RangeMap& b) {
  check(a.stamp == b.stamp && a.range_m.size() == b.range_m.size(),
        "fuseRangeMaps: expected maps of one camera and stamp");
  RangeMap result = copyOf(a);
  forEachRow(a.range_m.rows, [&](int y) {
    for (int x = 0; x < a.range_m.cols; ++x) {
      const Measurement from_a = measurementAt(a, y, x), from_b = measurementAt(b, y, x);
      if (std::isnan(from_b.inverse_range)) {
        continue;
      }
      if (std::isnan(from_a.inverse_range)) {
        set(y, x, from_b, &result);
      } else if (square(from_a.inverse_range - from_b.inverse_range) >
                 square(kMaxDeviations) * (from_a.variance + from_b.variance)) {
        setUnknown(y, x, &result);
      } else {
        set(y, x, fused(from_a, from_b), &result);
      }
    }
  });
  return result;
}

}  // namespace vcharge
