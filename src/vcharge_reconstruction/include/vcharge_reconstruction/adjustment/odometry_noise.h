#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

/// Standard deviations of a motion between keyframes as counted by the odometer, along and about x, y, z of
/// the vehicle: forwards, sideways and from the plane of motion (m), roll, pitch and turn (rad). Wheels count
/// distances in steps but hardly slip sideways, and a body rolls more than it pitches.
using OdometrySigmas = Eigen::Matrix<double, 6, 1>;

/// Noise of the odometer's motions, by the later keyframe of a motion. Absent where it is not known, and for
/// all motions if it is empty.
using OdometryNoise = std::vector<std::optional<OdometrySigmas>>;

/// Estimates the noise in each session from its adjusted keyframes: an upper bound, since it contains their
/// own errors. A motion that has slipped stands out among those around it, and gets a large deviation. No
/// other motion gets more than `most`, which is assumed without an estimate. Not known in short sessions.
OdometryNoise estimateOdometryNoise(const ReconstructionData& data, const OdometrySigmas& most);

}  // namespace vcharge
