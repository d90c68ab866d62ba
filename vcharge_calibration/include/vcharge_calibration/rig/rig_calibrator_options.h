#pragma once

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_calibration/matching/inter_camera_options.h"
#include "vcharge_calibration/matching/landmark_alignment_options.h"
#include "vcharge_calibration/rig/rig_adjustment_options.h"
#include "vcharge_core/base/options.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_geometry/robust/robust_options.h"
#include "vcharge_reconstruction/frame_tracker.h"
#include "vcharge_reconstruction/landmark_search.h"
#include "vcharge_reconstruction/loop_closure.h"
#include "vcharge_reconstruction/triangulation.h"

namespace vcharge {

/// Options of RigCalibrator.
struct RigCalibratorOptions {
  double frame_distance_m = 0.05;  ///< frames between which the vehicle moved less are left out
  double frame_turn_rad = 0.01;    ///< and turned less
  double keyframe_distance_m = 0.5;
  double keyframe_turn_rad = 0.1;
  double max_speed_m_per_s = 25.0;    ///< faster odometry is a reset of the counters
  double first_max_error_rad = 0.03;  ///< of rays to their point by the first guess of rig and poses
  FeatureExtractorOptions features;
  FrameTrackerOptions tracker;
  RobustOptions camera_motion = defaultCameraMotion();
  HandEyeOptions hand_eye;
  TriangulationOptions triangulation;
  LoopClosureOptions loops;
  LandmarkSearchOptions search;
  InterCameraOptions inter_camera;
  LandmarkAlignmentOptions landmark_alignment;
  RigAdjustmentOptions adjustment = defaultAdjustment();

  static RobustOptions defaultCameraMotion();
  /// The odometer's distance is the measure of all lengths here.
  static RigAdjustmentOptions defaultAdjustment();

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("frame_distance_m", frame_distance_m);
    visit("frame_turn_rad", frame_turn_rad);
    visit("keyframe_distance_m", keyframe_distance_m);
    visit("keyframe_turn_rad", keyframe_turn_rad);
    visit("max_speed_m_per_s", max_speed_m_per_s);
    visit("first_max_error_rad", first_max_error_rad);
    visit("features", features);
    visit("tracker", tracker);
    visit("camera_motion", camera_motion);
    visit("hand_eye", hand_eye);
    visit("triangulation", triangulation);
    visit("loops", loops);
    visit("search", search);
    visit("inter_camera", inter_camera);
    visit("landmark_alignment", landmark_alignment);
    visit("adjustment", adjustment);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

}  // namespace vcharge
