#pragma once

#include "vcharge_core/base/options.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_reconstruction/frame_tracker.h"
#include "vcharge_reconstruction/keyframe_builder.h"
#include "vcharge_reconstruction/landmarks/landmark_alignment.h"
#include "vcharge_reconstruction/landmarks/landmark_search.h"
#include "vcharge_reconstruction/landmarks/triangulation.h"
#include "vcharge_reconstruction/loop_closure.h"

namespace vcharge {

/// Options that mapping and extrinsic calibration from a drive share.
struct ReconstructionOptions : KeyframeOptions {
  VCHARGE_BEGIN_DERIVED_OPTIONS(ReconstructionOptions, KeyframeOptions);
  VCHARGE_OPTION_GROUP(FeatureExtractorOptions, features, {}, "Detection and description of features.");
  VCHARGE_OPTION_GROUP(FrameTrackerOptions, tracker, {}, "Tracks of points from frame to frame.");
  VCHARGE_OPTION_GROUP(TriangulationOptions, triangulation, {}, "Triangulation of tracks.");
  VCHARGE_OPTION_GROUP(LoopClosureOptions, loops, {}, "Detection and verification of loops.");
  VCHARGE_OPTION_GROUP(LandmarkSearchOptions, search, {}, "Search for landmarks in further images.");
  VCHARGE_OPTION_GROUP(LandmarkAlignmentOptions, landmark_alignment, {},
                       "Alignment of a landmark's patches.");
  VCHARGE_END_OPTIONS();
};

}  // namespace vcharge
