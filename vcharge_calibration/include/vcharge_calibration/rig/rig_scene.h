#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

/// Landmarks in the map, by the camera that observed them first.
using LandmarksByCamera = std::vector<std::vector<Eigen::Vector3d>>;

/// "#rrggbb", the colour of a camera in reports and in rviz.
std::string colourOfCamera(size_t camera);

/// Landmarks of a reconstruction, by the camera that observed them first.
LandmarksByCamera landmarksByCamera(const ReconstructionData& data);

/// Rig, path and landmarks at some stage of a calibration, for pictures.
struct RigScene {
  std::shared_ptr<const CameraRig> rig;
  std::vector<RigidTransform> map_from_vehicle;  ///< poses of the vehicle at the keyframes
  LandmarksByCamera landmarks;
};

RigScene makeRigScene(const ReconstructionData& data);

}  // namespace vcharge
