#include "obstacles/surface_visibility.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "obstacles/map_cells.h"

namespace vcharge {
namespace {

constexpr double kViewDistance_m = 0.3;  // travel between two views
constexpr double kClearance_m = 0.02;    // depth to which a line of sight may cut into the surface
constexpr double kMinFaceCosine =
    0.174;  // between a face's normal and the direction to the camera: 80 degrees

}  // namespace

SurfaceVisibility::SurfaceVisibility(const HeightMap& surface, const Trajectory& world_from_vehicle,
                                     const CameraRig& rig, double max_range_m)
    : surface_(surface), rig_(rig), max_range_m_(max_range_m) {
  const RigidTransform* last = nullptr;
  for (const StampedTransform& pose : world_from_vehicle) {
    if (last != nullptr &&
        (pose.world_from_vehicle.translation() - last->translation()).norm() < kViewDistance_m) {
      continue;
    }
    last = &pose.world_from_vehicle;
    for (size_t c = 0; c < rig.cameras.size(); ++c) {
      const RigidTransform world_from_camera =
          pose.world_from_vehicle * rig.cameras[c].vehicle_from_camera.value();
      views_.push_back({c, world_from_camera.inverse(), world_from_camera.translation()});
    }
  }
}

bool SurfaceVisibility::sees(const View& view, const Eigen::Vector3d& point_in_world) const {
  const Eigen::Vector3d to_camera = view.position_m - point_in_world;
  const double distance = to_camera.norm();
  // A height map describes upward surfaces, which are not visible from below.
  if (distance > max_range_m_ || to_camera.z() <= 0.0) {
    return false;
  }
  const RigCamera& camera = rig_.cameras[view.camera];
  const Eigen::Vector3d point = view.camera_from_world * point_in_world;
  Eigen::Vector2d pixel;
  if (point.z() < std::cos(0.5 * camera.field_of_view_rad) * distance ||
      !camera.model.project(point, &pixel)) {
    return false;
  }
  const long x = std::lround(pixel.x()), y = std::lround(pixel.y());
  if (x < 0 || y < 0 || x >= camera.image_size_px.width || y >= camera.image_size_px.height ||
      (!camera.mask.empty() && camera.mask.at<uint8_t>(static_cast<int>(y), static_cast<int>(x)) == 0)) {
    return false;
  }
  const int steps = static_cast<int>(std::ceil(to_camera.head<2>().norm() / (0.5 * surface_.cell_size_m)));
  for (int i = 2; i < steps; ++i) {
    const Eigen::Vector3d at = point_in_world + to_camera * (static_cast<double>(i) / steps);
    if (nearestHeight(surface_, at.head<2>()) > at.z() + kClearance_m) {
      return false;
    }
  }
  return true;
}

int SurfaceVisibility::countViews(const Eigen::Vector3d& point_in_world, int enough) const {
  int count = 0;
  for (const View& view : views_) {
    count += sees(view, point_in_world) ? 1 : 0;
    if (count >= enough) {
      break;
    }
  }
  return count;
}

int SurfaceVisibility::countFaceViews(const Eigen::Vector3d& point_in_world, const Eigen::Vector3d& normal,
                                      int enough) const {
  int count = 0;
  for (const View& view : views_) {
    const bool faces_camera = normal.dot((view.position_m - point_in_world).normalized()) >= kMinFaceCosine;
    count += faces_camera && sees(view, point_in_world) ? 1 : 0;
    if (count >= enough) {
      break;
    }
  }
  return count;
}

double SurfaceVisibility::nearestView(const Eigen::Vector3d& point_in_world) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const View& view : views_) {
    const double distance = (view.position_m - point_in_world).norm();
    if (distance < nearest && sees(view, point_in_world)) {
      nearest = distance;
    }
  }
  return nearest;
}

}  // namespace vcharge
