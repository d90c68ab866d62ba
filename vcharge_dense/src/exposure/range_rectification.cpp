#include "exposure/range_rectification.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "kernels/parallel_rows.h"
#include "kernels/pooled_mat.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
// Each iteration divides the error by the ratio of what lines are apart in time to what they see move.
constexpr int kIterations = 2;
// Four pixels are one surface if their inverse ranges differ less, relatively.
constexpr float kSameSurface = 0.1F;

/// Where the camera saw something, and how far from there.
struct Seen {
  cv::Point2f position_px;
  float time_s = 0.0F;
  Eigen::Vector3f direction;  // of the pixel's ray when it was exposed
};

class Rectification {
 public:
  Rectification(const RangeMap& map, const Exposure& exposure)
      : map_(map),
        times_(exposure.times),
        velocity_(exposure.velocity_m_per_s.cast<float>()),
        turn_rate_(exposure.turn_rate_rad_per_s.cast<float>()),
        xi_(static_cast<float>(map.camera.xi())),
        focal_px_(static_cast<float>(map.camera.gamma1()), static_cast<float>(map.camera.gamma2())),
        centre_px_(static_cast<float>(map.camera.u0()), static_cast<float>(map.camera.v0())) {}

  /// Where the camera saw what a pixel at the stamp shows.
  Seen find(cv::Point pixel, const Eigen::Vector3f& ray) const {
    Seen seen{pixel, 0.0F, ray};
    const Eigen::Vector3f turn = turn_rate_.cross(ray);
    const float approach = velocity_.dot(ray);
    for (int i = 0; i < kIterations; ++i) {
      seen.time_s = timeAt(seen.position_px);
      const float inverse_range = inverseRangeNear(seen.position_px);
      const float at_stamp = inverse_range / (1.0F + inverse_range * seen.time_s * approach);
      seen.direction = ray - seen.time_s * (turn + at_stamp * velocity_);
      seen.position_px = project(seen.direction);
    }
    return seen;
  }

  /// Range at the stamp; NaN where it is unknown.
  float range(const Seen& seen) const {
    const float inverse_range = inverseRangeAt(seen.position_px);
    return inverse_range > 0.0F
               ? (seen.direction.normalized() / inverse_range + seen.time_s * velocity_).norm()
               : kNaN;
  }

  /// The pixel nearest to where the camera saw it; outside of the image: none.
  bool nearest(const Seen& seen, cv::Point* pixel) const {
    *pixel = cv::Point(cvRound(seen.position_px.x), cvRound(seen.position_px.y));
    return cv::Rect(cv::Point(), map_.range_m.size()).contains(*pixel);
  }

  uint8_t gray(const Seen& seen) const {
    const cv::Point corner = cornerOf(seen.position_px);
    const float a = std::clamp(seen.position_px.x - static_cast<float>(corner.x), 0.0F, 1.0F);
    const float b = std::clamp(seen.position_px.y - static_cast<float>(corner.y), 0.0F, 1.0F);
    const auto* top = map_.reference.ptr<uint8_t>(corner.y) + corner.x;
    const auto* bottom = map_.reference.ptr<uint8_t>(corner.y + 1) + corner.x;
    const float upper = static_cast<float>(top[0]) + a * static_cast<float>(top[1] - top[0]);
    const float lower = static_cast<float>(bottom[0]) + a * static_cast<float>(bottom[1] - bottom[0]);
    return cv::saturate_cast<uint8_t>(upper + b * (lower - upper));
  }

 private:
  float timeAt(cv::Point2f position_px) const {
    return static_cast<float>(times_.at({(position_px.x - centre_px_.x()) / focal_px_.x(),
                                         (position_px.y - centre_px_.y()) / focal_px_.y()}));
  }
  cv::Point2f project(const Eigen::Vector3f& direction) const {
    const float denominator = direction.z() + xi_ * direction.norm();
    return {focal_px_.x() * direction.x() / denominator + centre_px_.x(),
            focal_px_.y() * direction.y() / denominator + centre_px_.y()};
  }
  /// The first of the four pixels around a position, within the image.
  cv::Point cornerOf(cv::Point2f position_px) const {
    return {std::clamp(cvFloor(position_px.x), 0, map_.range_m.cols - 2),
            std::clamp(cvFloor(position_px.y), 0, map_.range_m.rows - 2)};
  }
  /// Of the nearest pixel; 0, as if far away, where it is unknown.
  float inverseRangeNear(cv::Point2f position_px) const {
    const float range_m =
        map_.range_m.at<float>(std::clamp(cvRound(position_px.y), 0, map_.range_m.rows - 1),
                               std::clamp(cvRound(position_px.x), 0, map_.range_m.cols - 1));
    return range_m > 0.0F ? 1.0F / range_m : 0.0F;
  }
  /// Interpolated where the four pixels around the position are one surface.
  float inverseRangeAt(cv::Point2f position_px) const {
    const cv::Point corner = cornerOf(position_px);
    const auto* top = map_.range_m.ptr<float>(corner.y) + corner.x;
    const auto* bottom = map_.range_m.ptr<float>(corner.y + 1) + corner.x;
    const float nearest = std::min({top[0], top[1], bottom[0], bottom[1]});
    const float farthest = std::max({top[0], top[1], bottom[0], bottom[1]});
    const float sum = top[0] + top[1] + bottom[0] + bottom[1];
    if (!(sum == sum) || !(farthest <= (1.0F + kSameSurface) * nearest)) {  // NaN differs from itself
      return inverseRangeNear(position_px);
    }
    const float a = position_px.x - static_cast<float>(corner.x);
    const float b = position_px.y - static_cast<float>(corner.y);
    const float upper = (1.0F - a) / top[0] + a / top[1], lower = (1.0F - a) / bottom[0] + a / bottom[1];
    return upper + b * (lower - upper);
  }

  const RangeMap& map_;
  const ExposureTimes times_;
  const Eigen::Vector3f velocity_, turn_rate_;
  const float xi_;
  const Eigen::Vector2f focal_px_, centre_px_;
};

}  // namespace

RangeMap rectified(const RangeMap& map, const RayTable& rays, const Exposure& exposure) {
  const cv::Size size = map.range_m.size();
  const Rectification rectification(map, exposure);
  RangeMap result = map;
  result.range_m = pooledMat(size, CV_32FC1);
  result.standard_deviation_m = pooledMat(size, CV_32FC1);
  result.confidence = pooledMat(size, CV_32FC1);
  result.reference = map.reference.clone();
  forEachRow(size.height, [&](int y) {
    auto* range = result.range_m.ptr<float>(y);
    auto* deviation = result.standard_deviation_m.ptr<float>(y);
    auto* confidence = result.confidence.ptr<float>(y);
    auto* gray = result.reference.ptr<uint8_t>(y);
    for (int x = 0; x < size.width; ++x) {
      range[x] = deviation[x] = kNaN;
      confidence[x] = 0.0F;
      cv::Point at;
      if (!rays.valid(x, y)) {
        continue;
      }
      const Seen seen = rectification.find({x, y}, rays.ray(x, y));
      if (!rectification.nearest(seen, &at)) {
        continue;
      }
      gray[x] = rectification.gray(seen);
      if (map.range_m.at<float>(at) > 0.0F) {  // false for NaN
        range[x] = rectification.range(seen);
        deviation[x] = map.standard_deviation_m.at<float>(at);
        confidence[x] = map.confidence.at<float>(at);
      }
    }
  });
  return result;
}

}  // namespace vcharge
