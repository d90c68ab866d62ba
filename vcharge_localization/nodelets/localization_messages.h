#pragma once

#include <string>

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <vcharge_msgs/LocalizationStatus.h>
#include <visualization_msgs/Marker.h>

#include "vcharge_localization/drive_localizer.h"

namespace vcharge {

/// result.pose must be there. Its covariance is row by row as ROS wants it: x, y, z and turns about the fixed
/// axes of the map, which is what the suite's [dt, dphi] is.
geometry_msgs::PoseWithCovarianceStamped toPoseMessage(const LocalizationResult& result,
                                                       const std::string& map_frame);
vcharge_msgs::LocalizationStatus toStatusMessage(const LocalizationResult& result, const CameraRig& rig,
                                                 const std::string& map_frame);
/// Lines from the cameras to the landmarks that fit the pose, a colour per camera.
visualization_msgs::Marker toSightingMarker(const LocalizationResult& result, const CameraRig& rig,
                                            const SparseMap& map, const std::string& map_frame);
/// Of a message in the map's frame. InputError "<source>: ..." for another frame, a pose that is none, or a
/// covariance that is not finite; a covariance without variances is taken as half a metre and 15 degrees.
PosePrior fromMessage(const geometry_msgs::PoseWithCovarianceStamped& message, const std::string& source,
                      const std::string& map_frame);

}  // namespace vcharge
