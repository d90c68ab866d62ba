#pragma once

#include <string>

#include "vcharge_calibration/rig/rig_calibration.h"

namespace vcharge {

/// Describes the drive, and every degree of freedom of a camera with its standard deviation; without verdict
/// and remarks.
std::string describeCalibration(const RigCalibration& result);

/// Deviations of focal length and principal point with their standard deviations, and which ones the drive
/// hardly shows.
std::string describeIntrinsics(const IntrinsicsDeviation& found);

/// Readout and clock offset of a camera with their standard deviations, and what the rig says where that is
/// something else.
std::string describeTiming(const TimingEstimate& timing);

/// Position (x, y, z, cm) and angles (yaw, pitch, roll, degrees) of a camera; the angles are zero for an
/// upright camera that looks forward.
Eigen::Matrix<double, 6, 1> positionAndAngles(const RigidTransform& vehicle_from_camera);
/// Standard deviations in the order and units of positionAndAngles(), about the vehicle's axes, from the
/// covariance over [dt, dphi].
Eigen::Matrix<double, 6, 1> positionAndAngleSigmas(const Eigen::Matrix<double, 6, 6>& covariance);

}  // namespace vcharge
