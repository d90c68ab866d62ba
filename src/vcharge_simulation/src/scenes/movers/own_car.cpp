#include "scenes/movers/own_car.h"

#include <algorithm>
#include <cmath>

#include "scenes/scene_parts.h"
#include "vcharge_core/base/error.h"

namespace vcharge {

namespace {

constexpr double kMirror_m = 0.1;
// Poses that are nearer than this to the last one tested are skipped.
constexpr double kSamePlace_m = 0.3;

}  // namespace

OwnCar::OwnCar(const std::vector<RigidTransform>& world_from_vehicle) : poses_(world_from_vehicle) {
  check(!world_from_vehicle.empty(), "OwnCar: expected the poses of a drive");
  const CarShape& golf = carShapes().front();
  for (const RigidTransform& pose : world_from_vehicle) {
    footprints_.emplace_back(orientedRectangle(pose.translation().x(), pose.translation().y(),
                                               yawOfRotation(pose.rotation()), golf.rear(), golf.front(),
                                               0.5 * golf.width + kMirror_m));
  }
}

size_t OwnCar::indexAt(double time_s) const {
  const double index = std::round(std::max(0.0, time_s) / kPeriod_s);
  return std::min(static_cast<size_t>(index), footprints_.size() - 1);
}

double OwnCar::speedAt(double time_s) const {
  const size_t index = std::max<size_t>(1, indexAt(time_s));
  return index < poses_.size()
             ? (poses_[index].translation() - poses_[index - 1].translation()).norm() / kPeriod_s
             : 0.0;
}

bool OwnCar::keepsClearOf(const Footprint& outline, double time_s, double horizon_s,
                          double distance_m) const {
  const size_t last = indexAt(time_s + horizon_s);
  const Footprint* tested = nullptr;
  for (size_t i = indexAt(time_s); i <= last; ++i) {
    if (tested != nullptr && i < last && (footprints_[i].centre - tested->centre).norm() < kSamePlace_m) {
      continue;
    }
    if (isNearerThan(distance_m, outline, footprints_[i])) {
      return false;
    }
    tested = &footprints_[i];
  }
  return true;
}

}  // namespace vcharge
