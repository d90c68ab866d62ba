#pragma once

#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/height_map.h"
#include "vcharge_core/motion/trajectory.h"

namespace vcharge {

/// Visibility of a surface, given by its heights, from the cameras of a drive.
class SurfaceVisibility {
 public:
  /// Takes a view from each camera every 0.3 m of travel.
  SurfaceVisibility(const HeightMap& surface, const Trajectory& world_from_vehicle, const CameraRig& rig,
                    double max_range_m);

  /// Number of views in which a point a little above the surface is visible: in the image, below the camera,
  /// not masked and not hidden. Counting ends at `enough`. Thread safe.
  int countViews(const Eigen::Vector3d& point_in_world, int enough) const;
  /// The same for views that are at least 10 degrees in front of an upright face. `normal`: unit, out of the
  /// face. Thread safe.
  int countFaceViews(const Eigen::Vector3d& point_in_world, const Eigen::Vector3d& normal, int enough) const;
  /// Distance of the nearest view in which the point is visible; infinite without one. Thread safe.
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
