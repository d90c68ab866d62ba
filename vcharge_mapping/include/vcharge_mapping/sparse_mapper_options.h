#pragma once

#include "vcharge_core/base/options.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_reconstruction/bundle_adjustment.h"
#include "vcharge_reconstruction/ego_motion.h"
#include "vcharge_reconstruction/frame_tracker.h"
#include "vcharge_reconstruction/landmark_search.h"
#include "vcharge_reconstruction/loop_closure.h"
#include "vcharge_reconstruction/triangulation.h"

namespace vcharge {

struct SparseMapperOptions {
  double frame_distance_m = 0.05;  ///< frames between which the vehicle moved less are left out
  double frame_turn_rad = 0.01;    ///< and turned less
  double keyframe_distance_m = 0.5;
  double keyframe_turn_rad = 0.1;
  double max_speed_m_per_s = 25.0;    ///< faster odometry is a reset of the counters
  double first_max_error_rad = 0.02;  ///< of rays to their point by poses that were not adjusted yet
  FeatureExtractorOptions features;
  FrameTrackerOptions tracker;
  EgoMotionOptions ego_motion;
  TriangulationOptions triangulation;
  LoopClosureOptions loops;
  LandmarkSearchOptions search;
  BundleAdjustmentOptions bundle;

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
    visit("ego_motion", ego_motion);
    visit("triangulation", triangulation);
    visit("loops", loops);
    visit("search", search);
    visit("bundle", bundle);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

}  // namespace vcharge
