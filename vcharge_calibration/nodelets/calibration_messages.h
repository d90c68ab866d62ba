#pragma once

#include <nav_msgs/Path.h>
#include <sensor_msgs/PointCloud2.h>
#include <vcharge_msgs/CalibrationStatus.h>
#include <visualization_msgs/MarkerArray.h>

#include "initialization/camera_landmarks.h"
#include "vcharge_calibration/live/rig_calibration_session.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A session's status; the caller sets the header's stamp. The cameras' standard deviations come from the
/// calibration once it is done, and before that from the prediction for hand-eye calibration.
vcharge_msgs::CalibrationStatus toStatusMessage(const RigCalibrationSession::Status& status);

/// Landmarks as x, y, z (metres, FLOAT32) and rgb, in their camera's colour.
sensor_msgs::PointCloud2 toCloud(const LandmarksByCamera& landmarks, const std::string& frame_id);

/// The cameras on a vehicle: a pyramid along each camera's view in its colour, and its name with the accuracy
/// of its extrinsics. Markers of cameras without extrinsics are deleted.
visualization_msgs::MarkerArray toCameraMarkers(const CameraRig& rig, const RigidTransform& map_from_vehicle,
                                                const vcharge_msgs::CalibrationStatus& status,
                                                const std::string& frame_id);

}  // namespace vcharge
