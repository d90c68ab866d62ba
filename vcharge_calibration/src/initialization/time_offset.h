#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "rig/rig_adjustment.h"
#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Delay of the odometer's stamps relative to the images, and its standard deviation.
struct TimeOffset {
  double offset_s = 0.0;
  double sigma_s = INFINITY;

  bool isSignificant() const { return std::abs(offset_s) > 3.0 * sigma_s; }
};

/// The odometer's poses at the stamps of the frames, and interpolated between them.
class OdometrySeries {
 public:
  /// Takes the poses of all frames of the state.
  explicit OdometrySeries(const ReconstructionState& state);

  /// The odometer's pose `offset_s` after a stamp, at constant speed and turn rate between frames and beyond
  /// the ends of the drive.
  RigidTransform at(Timestamp stamp, double offset_s) const;

  /// Replaces the odometer's poses of keyframes and frames by those `offset_s` after their stamps.
  void shift(double offset_s, ReconstructionState* state) const;

 private:
  std::vector<double> time_s_;  ///< stamps relative to the first frame
  std::vector<RigidTransform> odom_from_vehicle_;
  Timestamp first_;
};

/// Estimates the time offset from the starts and ends of turns, using the cameras' motions and an initial
/// vertical in each camera's frame.
TimeOffset estimateTimeOffset(const ReconstructionState& state,
                              const std::vector<std::vector<MotionPair>>& motions_of_camera,
                              const std::vector<Eigen::Vector3d>& up_in_camera);

/// Refines the time offset from adjusted keyframes: returns the offset, in addition to `offset_s` by which
/// `data`'s odometry is already shifted, that fits distances and turns best. A step of robust least squares.
TimeOffset refineTimeOffset(const OdometrySeries& series, double offset_s, const ReconstructionData& data);

}  // namespace vcharge
