#pragma once

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_calibration/rig/rig_adjustment_options.h"
#include "vcharge_core/base/options.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

/// Options of MapRigCalibrator.
struct MapRigCalibratorOptions {
  double keyframe_distance_m = 0.5;
  double keyframe_turn_rad = 0.1;
  double max_speed_m_per_s = 25.0;  ///< faster odometry is a reset of the counters
  // How far a camera may be from where it should be by its last two poses.
  double prediction_sigma_m = 0.1;
  double prediction_sigma_rad = 0.03;
  /// A keyframe's vehicle from where the cameras that were found say it is, in the search with all of them.
  double search_sigma_m = 0.05;
  double search_sigma_rad = 0.01;
  int num_searches = 2;             ///< with all cameras, each followed by an adjustment
  double landmark_sigma_m = 0.005;  ///< of a map's landmark, besides its covariance
  double height_sigma_m = 0.02;     ///< of the ground on which the map's vehicle stood
  double feature_sigma_px = 0.6;    ///< standard deviation of a feature's position
  HandEyeOptions hand_eye;
  MapLocalizerOptions localizer;
  RigAdjustmentOptions adjustment = defaultAdjustment();

  /// The map is the measure of all lengths here, not the odometer; its landmarks need be seen but once.
  static RigAdjustmentOptions defaultAdjustment();

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("keyframe_distance_m", keyframe_distance_m);
    visit("keyframe_turn_rad", keyframe_turn_rad);
    visit("max_speed_m_per_s", max_speed_m_per_s);
    visit("prediction_sigma_m", prediction_sigma_m);
    visit("prediction_sigma_rad", prediction_sigma_rad);
    visit("search_sigma_m", search_sigma_m);
    visit("search_sigma_rad", search_sigma_rad);
    visit("num_searches", num_searches);
    visit("landmark_sigma_m", landmark_sigma_m);
    visit("height_sigma_m", height_sigma_m);
    visit("feature_sigma_px", feature_sigma_px);
    visit("hand_eye", hand_eye);
    visit("localizer", localizer);
    visit("adjustment", adjustment);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

}  // namespace vcharge
