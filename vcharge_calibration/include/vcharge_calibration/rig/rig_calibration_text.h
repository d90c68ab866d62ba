#pragma once

#include <string>

#include "vcharge_calibration/rig/rig_calibration.h"

namespace vcharge {

/// The drive, every camera's degrees of freedom with their standard deviations, and what is known least, as
/// lines of text; without verdict and remarks.
std::string describeCalibration(const RigCalibration& result);

/// Place (x, y, z, cm) and angles (yaw, pitch, roll, degrees) of a camera turned forwards: angles are zero
/// for one that looks ahead, upright.
Eigen::Matrix<double, 6, 1> placeAndAngles(const RigidTransform& vehicle_from_camera);
/// Standard deviations in the same order and units, about the vehicle's axes, from the covariance over
/// [dt, dphi].
Eigen::Matrix<double, 6, 1> placeAndAngleSigmas(const Eigen::Matrix<double, 6, 6>& covariance);

}  // namespace vcharge
