#include "occupancy/known_obstacles.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

// Nearer to a camera than this, the line is not searched: the vehicle's own outline is there.
constexpr double kNearest_m = 0.5;
// An obstacle hides an object if it is at least this far in front of it.
constexpr double kInFront_m = 0.1;

}  // namespace

void KnownObstacles::set(const ObstacleMap& map) {
  cv::dilate(map.state == kCellOccupied, occupied_, cv::Mat::ones(3, 3, CV_8U));
  origin_m_ = map.origin_m;
  cell_size_m_ = map.cell_size_m;
}

bool KnownObstacles::hideLine(const Eigen::Vector2d& camera_m, const Eigen::Vector2d& direction,
                              double distance_m) const {
  if (occupied_.empty()) {
    return false;
  }
  const cv::Rect map(cv::Point(), occupied_.size());
  const double step_m = 0.5 * cell_size_m_;
  for (double along_m = kNearest_m; along_m < distance_m; along_m += step_m) {
    const Eigen::Vector2d cell = (camera_m + along_m * direction - origin_m_) / cell_size_m_;
    const cv::Point at(static_cast<int>(std::floor(cell.x())), static_cast<int>(std::floor(cell.y())));
    if (map.contains(at) && occupied_.at<uint8_t>(at) != 0) {
      return true;
    }
  }
  return false;
}

bool KnownObstacles::hide(const TrackedObject& object,
                          const std::vector<RigidTransform>& fixed_from_cameras) const {
  bool is_hidden = false;
  for (const RigidTransform& fixed_from_camera : fixed_from_cameras) {
    const Eigen::Vector2d camera_m = fixed_from_camera.translation().head<2>();
    const Eigen::Vector2d axis = (fixed_from_camera.rotation() * Eigen::Vector3d::UnitZ()).head<2>();
    const Eigen::Vector2d offset_m = object.frame_from_object.translation().head<2>() - camera_m;
    if (offset_m.dot(axis) <= 0.0) {
      continue;
    }
    double nearest_m = offset_m.norm();
    for (const Eigen::Vector2d& corner_m : object.footprint_m) {
      nearest_m = std::min(nearest_m, (corner_m - camera_m).norm());
    }
    if (!hideLine(camera_m, offset_m.normalized(), nearest_m - kInFront_m)) {
      return false;
    }
    is_hidden = true;
  }
  return is_hidden;
}

void KnownObstacles::removeHidden(const std::vector<RigidTransform>& fixed_from_cameras,
                                  std::vector<TrackedObject>* objects) const {
  objects->erase(
      std::remove_if(objects->begin(), objects->end(),
                     [&](const TrackedObject& object) { return hide(object, fixed_from_cameras); }),
      objects->end());
}

}  // namespace vcharge
