#include "steps/near_heights.h"

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"
#include "vcharge_core/camera/ray_table.h"

namespace vcharge {
namespace {

// Points between these heights are ground, kerbs or holes; higher ones belong to obstacles.
constexpr float kLowest_m = -0.3F;
constexpr float kHighest_m = 0.3F;
// Heights that are less certain say nothing about a step of some centimetres.
constexpr float kMaxHeightSigma_m = 0.03F;
constexpr float kMinConfidence = 0.8F;

}  // namespace

NearHeights::NearHeights(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                         const VehicleOutline& outline, double reach_m)
    : size_(camera.size()),
      position_m_(vehicle_from_camera.translation().cast<float>()),
      outline_(outline),
      reach_m_(static_cast<float>(reach_m)) {
  const RayTable table(camera.model(), size_, 2.0 * M_PI, camera.validMask());
  const Eigen::Matrix3f rotation = vehicle_from_camera.rotationMatrix().cast<float>();
  for (int row = 0; row < size_.height; ++row) {
    for (int column = 0; column < size_.width; ++column) {
      const Eigen::Vector3f direction = rotation * table.ray(column, row);
      if (table.valid(column, row) && direction.z() < 0.0F) {
        rays_.push_back({row * size_.width + column, direction});
      }
    }
  }
}

HeightPoints NearHeights::find(const RangeMap& map, const GroundPlane& ground) const {
  check(map.range_m.size() == size_ && map.standard_deviation_m.size() == size_ &&
            map.confidence.size() == size_ && map.range_m.isContinuous() &&
            map.standard_deviation_m.isContinuous() && map.confidence.isContinuous(),
        "NearHeights: expected a range map of the camera's size");
  HeightPoints points;
  if (ground.state != GroundState::kMeasured) {
    return points;
  }
  const Eigen::Vector2f slope = ground.slope.cast<float>();
  const auto offset_m = static_cast<float>(ground.offset_m);
  const auto front_m = static_cast<float>(outline_.front_m);
  const auto rear_m = static_cast<float>(outline_.rear_m);
  const auto half_width_m = static_cast<float>(outline_.half_width_m);
  const auto* range_m = map.range_m.ptr<float>();
  const auto* range_sigma_m = map.standard_deviation_m.ptr<float>();
  const auto* confidence = map.confidence.ptr<float>();
  for (const Ray& ray : rays_) {
    const float range = range_m[ray.pixel];
    if (!(range > 0.0F && confidence[ray.pixel] >= kMinConfidence)) {
      continue;
    }
    const Eigen::Vector3f point = position_m_ + range * ray.direction;
    const float height_m = point.z() - offset_m - slope.dot(point.head<2>());
    const float sigma_m = range_sigma_m[ray.pixel] * (slope.dot(ray.direction.head<2>()) - ray.direction.z());
    const float ahead_m = std::max({point.x() - front_m, rear_m - point.x(), 0.0F});
    const float aside_m = std::max(std::abs(point.y()) - half_width_m, 0.0F);
    const float outside_m = std::hypot(ahead_m, aside_m);
    if (sigma_m <= kMaxHeightSigma_m && height_m >= kLowest_m && height_m <= kHighest_m && outside_m > 0.0F &&
        outside_m <= reach_m_) {
      points.push_back({point.x(), point.y(), height_m, sigma_m * sigma_m});
    }
  }
  return points;
}

}  // namespace vcharge
