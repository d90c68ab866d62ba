#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/monitor/pitch_response.h"
#include "vcharge_calibration/rig/rig_calibrator_options.h"
#include "vcharge_core/base/timestamp.h"
#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

/// What a part of a drive says about how the car deviates from its rig. The unknowns are those of the
/// odometer (its factors for distance and turn, less 1, and radians that it does not count per metre, because
/// one wheel is smaller than the other), then [dt, dphi] of each camera in the vehicle's frame. Directions
/// that the part does not show have no information.
struct RigDeviation {
  Timestamp begin, end;
  double begin_m = 0.0, end_m = 0.0;      ///< driven since the start
  Eigen::VectorXd information_vector;     ///< information times the most likely deviation
  Eigen::MatrixXd information;            ///< inverse covariance
  std::vector<int64_t> num_observations;  ///< of landmarks, by camera
  PitchResponse pitch;                    ///< in this part

  static constexpr Eigen::Index kOdometerSize = 3;
  static Eigen::Index rowOf(size_t camera) { return kOdometerSize + 6 * static_cast<Eigen::Index>(camera); }
  Eigen::Index size() const { return information_vector.size(); }
};

/// Leaves out what a part says about a camera, and keeps what it says about the rest.
void forgetCamera(size_t camera, RigDeviation* deviation);

/// Adjusts the keyframes, landmarks, odometer and extrinsics of a part of a drive, from the rig and the
/// odometer's poses, and returns what the images alone say about the extrinsics: the prior that keeps the
/// adjustment near the rig is subtracted. `part` is used up. Data parallel, deterministic. No information
/// where the part is too short or shows too little.
RigDeviation estimateDeviation(const RigCalibratorOptions& options, const KeyframeImages& images,
                               ReconstructionData part);

}  // namespace vcharge
