#pragma once

#include <cmath>
#include <vector>

#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

/// How far the body pitches when the vehicle speeds up or brakes: in each part of a drive, a linear function
/// of acceleration and distance is fitted to the pitch, so that a slope of the ground does not count. Parts
/// are weighted by their residuals.
class PitchResponse {
 public:
  /// Adds keyframes of a part of a drive with adjusted poses: the odometer counts too coarsely for
  /// accelerations.
  void add(const std::vector<Keyframe>& keyframes);
  PitchResponse& operator+=(const PitchResponse& other);

  /// Nose up per forward acceleration; 0 before anything is known.
  double radPerMetrePerS2() const { return information_ > 0.0 ? vector_ / information_ : 0.0; }
  /// Its standard deviation; infinite before anything is known.
  double sigma() const { return 1.0 / std::sqrt(information_); }
  /// Whether the body certainly pitches several times as far as a passenger car's, 0.002 to 0.005.
  bool isSoft() const;

 private:
  double information_ = 0.0, vector_ = 0.0;
};

}  // namespace vcharge
