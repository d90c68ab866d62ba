#pragma once

#include <string>

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <vcharge_msgs/LocalizationStatus.h>
#include <visualization_msgs/Marker.h>

#include "vcharge_localization/drive_localizer.h"

namespace vcharge {

/// The result must have a pose. The covariance is row-major as in ROS: x, y, z and rotations about the fixed
/// axes of the map, which equals this project's [dt, dphi].
geometry_msgs::PoseWithCovarianceStamped toPoseMessage(const LocalizationResult& result,
                                                       const std::string& map_frame);
vcharge_msgs::LocalizationStatus toStatusMessage(const LocalizationResult& result, const CameraRig& rig,
                                                 const std::string& map_frame);
/// Lines from the cameras to the landmarks that fit the pose, in one colour per camera.
visualization_msgs::Marker toObservationMarker(const LocalizationResult& result, const CameraRig& rig,
                                               const std::string& map_frame);
/// Converts a message in the map's frame to a prior. InputError "<source>: ..." for another frame, an invalid
/// pose or a covariance that is not finite. Zero variances are replaced by those of 0.5 m and 15 degrees.
PosePrior fromMessage(const geometry_msgs::PoseWithCovarianceStamped& message, const std::string& source,
                      const std::string& map_frame);

}  // namespace vcharge
