#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_model.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_dense/plane_family.h"

namespace vcharge {

/// Published images of the V-Charge car's left camera, see SOURCE.txt in their folder.
struct RealImages {
  CameraModel camera;
  RigidTransform vehicle_from_camera;  ///< the origin of this vehicle frame is above the ground
  Plane ground_in_vehicle;             ///< fitted to the ground around the reference image
  std::vector<Timestamp> stamps;
  std::vector<cv::Mat> pixels;
  std::vector<RigidTransform> world_from_camera;
  std::string folder;

  Plane groundInCamera() const;
};

/// Reads $VCHARGE_DATA/vcharge_left; returns nothing if the variable is not set. Throws InputError for
/// files that cannot be read.
std::optional<RealImages> readRealImages();

}  // namespace vcharge
