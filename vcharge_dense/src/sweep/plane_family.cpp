#include "vcharge_dense/plane_family.h"

#include <stdexcept>

namespace vcharge {
namespace {

// Maximum height of the planes parallel to the ground above and below it.
constexpr double kMaxGroundHeight_m = 0.3;

/// `count` inverse distances from 1 / far_m to 1 / near_m whose steps grow linearly, up to `growth` times the
/// first step.
std::vector<float> inverseDistances(double far_m, double near_m, int count, double growth) {
  const double linear = 2.0 / (1.0 + growth);
  std::vector<float> inverse(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double index = static_cast<double>(i) / (count - 1);
    const double fraction = index * (linear + (1.0 - linear) * index);
    inverse[static_cast<size_t>(i)] =
        static_cast<float>(1.0 / far_m + fraction * (1.0 / near_m - 1.0 / far_m));
  }
  return inverse;
}

}  // namespace

Plane groundInCamera(const RigidTransform& vehicle_from_camera) {
  const double height_m = vehicle_from_camera.translation().z();
  if (!(height_m > 0.0)) {
    throw std::invalid_argument("vehicle_from_camera: the camera must be above the ground (z > 0), is at " +
                                std::to_string(height_m) + " m");
  }
  return {vehicle_from_camera.rotation().conjugate() * Eigen::Vector3d::UnitZ(), height_m};
}

std::vector<PlaneFamily> makePlaneFamilies(const PlaneSweepOptions& options,
                                           const std::optional<Plane>& ground_in_camera,
                                           const PlaneAxes& axes) {
  std::vector<PlaneFamily> families;
  for (const Eigen::Vector3d& axis : axes) {
    families.push_back({-axis,
                        inverseDistances(options.max_distance_m, options.min_distance_m, options.num_planes,
                                         options.near_spacing),
                        options.near_spacing == 1.0});
  }
  if (options.num_ground_planes > 0) {
    if (!ground_in_camera) {
      throw std::invalid_argument(
          "num_ground_planes: planes parallel to the ground need the camera's pose on the vehicle");
    }
    const double far_m = ground_in_camera->distance_m + kMaxGroundHeight_m;
    const double near_m = ground_in_camera->distance_m - kMaxGroundHeight_m;
    if (!(near_m > 0.0)) {
      throw std::invalid_argument(
          "num_ground_planes: a camera must be more than 0.3 m above the ground, is at " +
          std::to_string(ground_in_camera->distance_m) + " m");
    }
    families.push_back({ground_in_camera->normal.normalized(),
                        inverseDistances(far_m, near_m, options.num_ground_planes, 1.0), true});
  }
  return families;
}

}  // namespace vcharge
