#pragma once

#include <string>
#include <vector>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_wheel_odometry/wheel_motion.h"

namespace vcharge {

/// A parameter of the car with its standard deviation. It is observable if the drive at least halves the
/// standard deviation that is known beforehand; otherwise its value is close to the nominal one.
struct CalibratedParameter {
  double value = 0.0;
  double sigma = 0.0;
  bool is_observable = false;
};

struct WheelCalibration {
  bool is_calibrated = false;
  std::string reason;            ///< why not
  WheelOdometryOptions options;  ///< the nominal ones with the scales and the track width found
  CalibratedParameter scale;     ///< true over measured distance, mean of the wheels, relative to nominal
  CalibratedParameter right_over_left;  ///< ratio of the wheels' scales, relative to nominal
  CalibratedParameter track_width_m;
  double distance_m = 0.0;  ///< of the reference's path that was used
};

/// Fits the scales of the rear wheels and the track width to a reference drive, such as GNSS poses: the
/// motion over sub-paths of up to 100 m, by least squares with robust weights. Both wheels' mean scale is
/// seen by distances, the wheels' ratio by the heading, the track width only by turns; a prior (3 %, 1 % and
/// 3 %) holds what the drive does not show. `reference` holds poses of the rear axle's centre that move
/// forwards; its heights, rolls and pitches are ignored. Fails as a value if less than 50 m overlap.
/// std::logic_error for measurements of two kinds.
WheelCalibration calibrateWheels(const std::vector<WheelMeasurement>& wheels, const Trajectory& reference,
                                 const WheelOdometryOptions& nominal);

struct StampedPosition {
  Timestamp stamp;
  double x_m = 0.0, y_m = 0.0;
};
/// Level poses of a car that drives forwards, with headings from the positions alone: the direction of a
/// cubic curve through those up to `reach_m` before and behind along the path, at least three each. A car
/// that stands keeps the heading of its place. Positions within reach of an end are left out.
Trajectory posesFromPositions(const std::vector<StampedPosition>& positions, double reach_m = 5.0);

}  // namespace vcharge
