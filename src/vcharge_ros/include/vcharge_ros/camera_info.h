#pragma once

#include <sensor_msgs/CameraInfo.h>

#include "vcharge_core/camera_rig.h"
#include "vcharge_core/mei_camera.h"
#include "vcharge_core/timestamp.h"
#include "vcharge_ros/equidistant_fit.h"

namespace vcharge {

/// CameraInfo of a rig's camera. sensor_msgs has no Mei model: it carries an equidistant fit (ROS's name for
/// Kannala-Brandt), or plumb_bob for a pinhole camera, exactly. `fit`, if given, receives what the fit leaves
/// over (zero residual where the model is exact). The header's stamp is left to the caller.
sensor_msgs::CameraInfo makeCameraInfo(const RigCamera& camera, EquidistantFit* fit = nullptr);
/// Of any other camera, for instance the working camera of a range map.
sensor_msgs::CameraInfo makeCameraInfo(const CameraModel& model, cv::Size image_size_px,
                                       double field_of_view_rad, const std::string& frame_id,
                                       EquidistantFit* fit = nullptr);

}  // namespace vcharge
