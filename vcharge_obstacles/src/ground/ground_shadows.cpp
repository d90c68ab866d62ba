#include "ground/ground_shadows.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vcharge {
namespace {

constexpr int kDirections = 720;
constexpr double kStep_rad = 2.0 * M_PI / kDirections;

}  // namespace

GroundShadows::GroundShadows(double camera_height_m)
    : camera_height_m_(camera_height_m), hidden_m_(kDirections) {}

int GroundShadows::directionOf(double angle_rad) {
  const int direction = static_cast<int>(std::floor(angle_rad / kStep_rad)) % kDirections;
  return direction < 0 ? direction + kDirections : direction;
}

void GroundShadows::add(const Eigen::Vector2d& offset_m, double cell_m, double height_m) {
  const double range_m = offset_m.norm();
  if (range_m < cell_m) {
    return;  // the camera is above the cell
  }
  // The cell itself is left out: ground may be visible in front of its obstacle.
  const double from_m = range_m + 0.75 * cell_m;
  const double to_m = height_m < camera_height_m_ ? range_m * camera_height_m_ / (camera_height_m_ - height_m)
                                                  : std::numeric_limits<double>::infinity();
  if (to_m <= from_m) {
    return;
  }
  const double middle_rad = std::atan2(offset_m.y(), offset_m.x());
  const double half_rad = std::atan2(0.5 * cell_m, range_m);
  const int first = static_cast<int>(std::floor((middle_rad - half_rad) / kStep_rad));
  const int last = static_cast<int>(std::floor((middle_rad + half_rad) / kStep_rad));
  for (int direction = first; direction <= last; ++direction) {
    hidden_m_[static_cast<size_t>(directionOf((direction + 0.5) * kStep_rad))].emplace_back(from_m, to_m);
  }
}

bool GroundShadows::hides(const Eigen::Vector2d& offset_m) const {
  const double range_m = offset_m.norm();
  const auto& intervals = hidden_m_[static_cast<size_t>(directionOf(std::atan2(offset_m.y(), offset_m.x())))];
  return std::any_of(intervals.begin(), intervals.end(), [&](const std::pair<double, double>& interval) {
    return range_m > interval.first && range_m < interval.second;
  });
}

}  // namespace vcharge
