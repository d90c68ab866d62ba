#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_reconstruction/mapping_data.h"

namespace vcharge {

/// Landmarks by the camera that saw them first, in the map.
using LandmarksByCamera = std::vector<std::vector<Eigen::Vector3d>>;

/// "#rrggbb", in which a camera is drawn in pages and in rviz.
std::string colourOfCamera(size_t camera);

/// The points that have a position, by the camera that saw them first.
LandmarksByCamera landmarksByCamera(const MappingData& data);

/// A rig, its way and what it saw, as known at some stage of a calibration: for pictures.
struct RigScene {
  std::shared_ptr<const CameraRig> rig;
  std::vector<RigidTransform> map_from_vehicle;  ///< at the keyframes
  LandmarksByCamera landmarks;
};

RigScene makeRigScene(const MappingData& data);

}  // namespace vcharge
