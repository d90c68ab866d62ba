#include "vcharge_mapping/sparse_mapper.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>
#include <vector>

#include "vcharge_core/base/error.h"
#include "vcharge_reconstruction/landmarks/landmark_alignment.h"
#include "vcharge_reconstruction/reconstruction_steps.h"
#include "vcharge_reconstruction/stage_runner.h"

namespace vcharge {
namespace {

/// Largest angle between a ray and its point before the first adjustment; large because odometry drifts.
constexpr double kFirstMaxError_rad = 0.02;

TriangulationOptions lenientTriangulation(const SparseMapperOptions& options) {
  TriangulationOptions lenient = options.triangulation;
  lenient.max_error_rad = kFirstMaxError_rad;
  return lenient;
}

std::shared_ptr<const SparseMap> assembleWithLandmarks(const SparseMapperOptions& options,
                                                       ReconstructionState* state) {
  const std::vector<Track>& tracks = state->data.tracks;
  state->report.num_landmarks = std::count_if(
      tracks.begin(), tracks.end(), [](const Track& track) { return track.position_m.has_value(); });
  if (state->report.num_landmarks == 0) {
    throw InputError("no map could be made: no point of the scene was seen from enough positions");
  }
  return assembleMap(*state, options.features);
}

}  // namespace

SparseMapper::SparseMapper(std::shared_ptr<const CameraRig> rig, const SparseMapperOptions& options)
    : options_(options) {
  options_.validate();
  check(rig != nullptr, "SparseMapper: expected a rig");
  if (!rig->hasExtrinsics()) {
    throw InputError("rig: expected vehicle_from_camera of every camera, which extrinsic calibration gives");
  }
  state_.data.rig = std::move(rig);
  follower_ = std::make_unique<FrameFollower>(
      options_, options_.ego_motion, &state_,
      [this](int32_t keyframe, const std::vector<Image>& images) { images_.add(keyframe, images); });
}

SparseMapper::~SparseMapper() = default;

void SparseMapper::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  follower_->addImage(camera_index, stamp, image);
}

void SparseMapper::addOdometry(const VehicleOdometry& odometry) {
  follower_->addOdometry(odometry);
}

std::shared_ptr<const SparseMap> SparseMapper::finish(const StageCallback& progress) {
  follower_->flush();
  requireKeyframes();
  ReconstructionData* const data = &state_.data;
  std::shared_ptr<const SparseMap> map;
  StageRunner stages(kNumStages, progress, &state_.report);
  stages.run("first adjustment", [&] { adjustFirst(); });
  stages.run("loops", [&] {
    findAndCloseLoops(
        options_, [&](double fraction) { stages.tell("loops", fraction); }, &state_);
  });
  stages.run("landmark search", [&] { searchLandmarks(options_.search, data); });
  stages.run("adjustment", [&] { adjust(options_.bundle); });
  stages.run("second landmark search", [&] { searchLandmarks(options_.search, data); });
  stages.run("landmark patches", [&] { alignLandmarks(options_.landmark_alignment, images_, data); });
  stages.run("last adjustment", [&] {
    adjust(options_.bundle, estimateOdometryNoise(options_.bundle, *data));
    checkLoops(*data, &state_.report.loop_edges);
  });
  stages.run("assembly", [&] { map = assembleWithLandmarks(options_, &state_); });
  return map;
}

void SparseMapper::requireKeyframes() const {
  if (state_.data.keyframes.size() < 2) {
    std::ostringstream text;
    text << "no map could be made: " << report().counters.frames << " frames, "
         << report().counters.frames_without_odometry << " without odometry, " << report().num_standing_frames
         << " standing";
    throw InputError(text.str());
  }
}

void SparseMapper::adjustFirst() {
  BundleAdjustmentOptions lenient_bundle = options_.bundle;
  lenient_bundle.outlier_sigmas = INFINITY;
  triangulateTracks(lenientTriangulation(options_), &state_.data);
  adjust(lenient_bundle);
  triangulateTracks(options_.triangulation, &state_.data);
  adjust(options_.bundle);
}

void SparseMapper::adjust(const BundleAdjustmentOptions& options, const OdometryNoise& odometry) {
  recordAdjustment(adjustBundle(options, &state_.data, odometry), &state_.report);
}

std::shared_ptr<const SparseMap> makeMapSoFar(ReconstructionState state, const SparseMapperOptions& options) {
  triangulateTracks(lenientTriangulation(options), &state.data);
  return assembleWithLandmarks(options, &state);
}

}  // namespace vcharge
