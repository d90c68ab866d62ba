#pragma once

#include <memory>
#include <string>

#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/bundle_adjustment.h"
#include "vcharge_reconstruction/reconstruction_options.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

// Steps that the recipes of mapping and calibration share.

/// Adds what was followed since an adjustment to the adjusted state, which was a copy of `followed` then: its
/// keyframes, poses of frames, and observations. New keyframes continue the adjusted path by the odometer;
/// the odometer's poses of all keyframes are those of `followed`.
void extendReconstruction(const ReconstructionState& followed, ReconstructionState* adjusted);

/// Finds and verifies loops of keyframes from `first_of_new` on, adds them to the report, closes them by a
/// robust pose graph, and triangulates all tracks again.
void findAndCloseLoops(const ReconstructionOptions& options, const LoopProgress& progress,
                       ReconstructionState* state, int32_t first_of_new = 0);

/// Sets the number of observations and the errors of an adjustment in the report.
void recordAdjustment(const BundleAdjustmentSummary& summary, ReconstructionReport* report);

/// The map of an adjusted reconstruction: landmarks with a position, and their observations. An observation
/// without a feature takes the descriptor of the landmark's nearest keyframe that has one.
std::shared_ptr<const SparseMap> assembleMap(const ReconstructionState& state,
                                             const FeatureExtractorOptions& features);
/// The same with the text of the options, as a map has it.
std::shared_ptr<const SparseMap> assembleMap(const ReconstructionState& state,
                                             const std::string& feature_options);

/// The reconstruction that a map came from, as far as the map tells: features are the map's observations, all
/// of them with a track, and the odometry of a session is that of its adjusted poses. `observation_sigma_px`:
/// deviation of their positions.
ReconstructionData reconstructionOf(const SparseMap& map, double observation_sigma_px);

}  // namespace vcharge
