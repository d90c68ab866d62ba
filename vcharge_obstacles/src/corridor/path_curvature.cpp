#include "corridor/path_curvature.h"

#include <cmath>

namespace vcharge {
namespace {

// Path over which the curvature is averaged: long enough for the resolution of wheel ticks, and short
// compared with the path on which a driver turns the wheel.
constexpr double kPath_m = 0.5;
// Least path: below it, ticks of 1 cm would give curvatures of 0.07 1/m.
constexpr double kLeastPath_m = 0.2;
constexpr double kStep_s = 0.05;
constexpr double kMaxTime_s = 5.0;
// Moves backwards that are no change of the direction, but noise of a standing vehicle.
constexpr double kBackwards_m = 0.02;

}  // namespace

double PathCurvature::update(Timestamp stamp, const PoseAt& fixed_from_vehicle_at) {
  const std::optional<RigidTransform> last = fixed_from_vehicle_at(stamp);
  if (!last) {
    return curvature_per_m_;
  }
  double chord_m = 0.0;  // negative after driving backwards
  double turned_rad = 0.0;
  const int steps = static_cast<int>(kMaxTime_s / kStep_s);
  for (int step = 1; step <= steps && std::abs(chord_m) < kPath_m; ++step) {
    const std::optional<RigidTransform> earlier =
        fixed_from_vehicle_at(stamp - durationFromSeconds(step * kStep_s));
    if (!earlier) {
      break;
    }
    const RigidTransform earlier_from_last = earlier->inverse() * *last;
    const double yaw_rad = yawOfRotation(earlier_from_last.rotation());
    // The chord of an arc points along the mean of the two headings.
    const double along_m = earlier_from_last.translation().head<2>().dot(
        Eigen::Vector2d(std::cos(0.5 * yaw_rad), std::sin(0.5 * yaw_rad)));
    if (std::abs(along_m) < std::abs(chord_m) - kBackwards_m) {
      break;  // before, the vehicle moved in the other direction
    }
    if (std::abs(along_m) > std::abs(chord_m)) {
      chord_m = along_m;
      turned_rad = yaw_rad;
    }
  }
  if (std::abs(chord_m) >= kLeastPath_m) {
    curvature_per_m_ = 2.0 * std::sin(0.5 * turned_rad) / chord_m;
  }
  return curvature_per_m_;
}

}  // namespace vcharge
