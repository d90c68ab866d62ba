#pragma once

#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/height_map.h"
#include "vcharge_core/motion/trajectory.h"

namespace vcharge {

/// Where the cameras of a drive stood, and what they could see of a surface given by its heights.
class SurfaceVisibility {
 public:
  /// A view each `view_distance_m` of travel, from each camera.
  SurfaceVisibility(const HeightMap& surface, const Trajectory& world_from_vehicle, const CameraRig& rig,
                    double view_distance_m, double max_range_m);

  /// In how many views a point a little above the surface is in the image, below the camera, not behind the
  /// own vehicle, and not hidden; counting ends at `enough`. Thread safe.
  int countViews(const Eigen::Vector3d& point_in_world, int enough) const;
  /// The same, of the views that look at an upright face there, by 10 degrees or more. `normal`: unit, out of
  /// the face. Thread safe.
  int countFaceViews(const Eigen::Vector3d& point_in_world, const Eigen::Vector3d& normal, int enough) const;
  /// Distance of the nearest of these views; infinite where there is none. Thread safe.
  double nearestView(const Eigen::Vector3d& point_in_world) const;

 private:
  struct View {
    size_t camera;
    RigidTransform camera_from_world;
    Eigen::Vector3d position_m;
  };
  bool sees(const View& view, const Eigen::Vector3d& point_in_world) const;

  const HeightMap& surface_;
  const CameraRig& rig_;
  const double max_range_m_;
  std::vector<View> views_;
};

}  // namespace vcharge
