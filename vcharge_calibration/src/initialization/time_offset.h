#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "rig/rig_adjustment.h"
#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// By how much the odometer's stamps are late against the images, and its standard deviation.
struct TimeOffset {
  double offset_s = 0.0;
  double sigma_s = INFINITY;

  bool isSignificant() const { return std::abs(offset_s) > 3.0 * sigma_s; }
};

/// What the odometer counted at the images' stamps, kept to be read at other instants.
class OdometrySeries {
 public:
  /// Of the frames that were followed, as they are in the state.
  explicit OdometrySeries(const MappingState& state);

  /// The vehicle by the odometer `offset_s` after a stamp of the drive; with constant speed and turn between
  /// frames, and beyond the ends of the drive.
  RigidTransform at(Timestamp stamp, double offset_s) const;

  /// Puts the odometer's poses of keyframes and frames to what it counted `offset_s` after their stamps.
  void shift(double offset_s, MappingState* state) const;

 private:
  std::vector<double> time_s_;  ///< since the first frame
  std::vector<RigidTransform> odom_from_vehicle_;
  Timestamp first_;
};

/// From when the turns begin and end: motions of cameras, at first guesses of the vertical in each camera's
/// frame.
TimeOffset estimateTimeOffset(const MappingState& state,
                              const std::vector<std::vector<MotionPair>>& motions_of_camera,
                              const std::vector<Eigen::Vector3d>& up_in_camera);

/// From adjusted keyframes: the offset, beside `offset_s` by which the state's odometry is shifted already,
/// with which the odometer's distances and turns fit best. One step of robust least squares.
TimeOffset refineTimeOffset(const OdometrySeries& series, double offset_s, const MappingData& data);

}  // namespace vcharge
