#include "fusion/hidden_ground.h"

#include <cmath>

#include "liveness/silent_cameras.h"

namespace vcharge {
namespace {

constexpr double kStep_m = 0.05;

}  // namespace

HiddenGround::HiddenGround(const CameraRig& rig, const std::vector<bool>& is_used,
                           const VehicleOutline& vehicle)
    : min_m_(vehicle.rear_m - kReach_m, -vehicle.half_width_m - kReach_m) {
  const auto count = [](double length_m) { return static_cast<int>(std::ceil(length_m / kStep_m)); };
  is_hidden_.create(count(2.0 * (vehicle.half_width_m + kReach_m)),
                    count(vehicle.front_m - vehicle.rear_m + 2.0 * kReach_m), CV_8UC1);
  for (int row = 0; row < is_hidden_.rows; ++row) {
    for (int column = 0; column < is_hidden_.cols; ++column) {
      const Eigen::Vector2d point_m = min_m_ + kStep_m * Eigen::Vector2d(column + 0.5, row + 0.5);
      bool is_seen = false;
      for (size_t camera = 0; camera < rig.cameras.size() && !is_seen; ++camera) {
        is_seen = is_used[camera] && seesGround(rig.cameras[camera], point_m);
      }
      is_hidden_.at<uint8_t>(row, column) = is_seen ? 0 : 1;
    }
  }
}

bool HiddenGround::contains(const Eigen::Vector2d& point_in_vehicle_m) const {
  const Eigen::Vector2d at = (point_in_vehicle_m - min_m_) / kStep_m;
  const int column = static_cast<int>(std::floor(at.x())), row = static_cast<int>(std::floor(at.y()));
  return column >= 0 && row >= 0 && column < is_hidden_.cols && row < is_hidden_.rows &&
         is_hidden_.at<uint8_t>(row, column) != 0;
}

}  // namespace vcharge
