#include "vcharge_reconstruction/reconstruction_steps.h"

#include <memory>
#include <utility>
#include <vector>

#include "landmarks/track_observations.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

int32_t rootOf(const ReconstructionData& data, int32_t track) {
  while (track >= 0 && data.tracks[track].joined_to >= 0) {
    track = data.tracks[track].joined_to;
  }
  return track;
}

/// Adds the keyframes of `followed` that `adjusted` lacks, with features that show its tracks.
void addKeyframes(const ReconstructionData& followed, ReconstructionData* adjusted) {
  for (size_t i = adjusted->keyframes.size(); i < followed.keyframes.size(); ++i) {
    Keyframe keyframe = followed.keyframes[i];
    const RigidTransform step =
        followed.keyframes[i - 1].odom_from_vehicle.inverse() * keyframe.odom_from_vehicle;
    keyframe.map_from_vehicle = adjusted->keyframes[i - 1].map_from_vehicle * step;
    for (KeyframeImage& image : keyframe.images) {
      for (int32_t& track : image.track_of_feature) {
        track = rootOf(*adjusted, track);
      }
    }
    adjusted->keyframes.push_back(std::move(keyframe));
  }
}

}  // namespace

void extendReconstruction(const ReconstructionState& followed, ReconstructionState* adjusted) {
  ReconstructionData& data = adjusted->data;
  const auto first_of_new = static_cast<int32_t>(data.keyframes.size());
  check(first_of_new > 0 && first_of_new <= static_cast<int32_t>(followed.data.keyframes.size()) &&
            data.tracks.size() <= followed.data.tracks.size(),
        "extendReconstruction: expected a state that was a copy of the followed one");
  data.tracks.resize(followed.data.tracks.size());
  addKeyframes(followed.data, &data);
  for (int32_t i = 0; i < first_of_new; ++i) {
    data.keyframes[i].odom_from_vehicle = followed.data.keyframes[i].odom_from_vehicle;
  }
  for (size_t t = 0; t < data.tracks.size(); ++t) {
    Track& track = data.tracks[rootOf(data, static_cast<int32_t>(t))];
    for (const TrackObservation& observation : followed.data.tracks[t].observations) {
      if (observation.keyframe >= first_of_new) {
        track.observations.push_back(observation);
      }
    }
  }
  for (Track& track : data.tracks) {
    sortObservations(&track);
  }
  std::vector<LoopEdge> loop_edges = std::move(adjusted->report.loop_edges);
  adjusted->frames = followed.frames;
  adjusted->keyframe_from_next = followed.keyframe_from_next;
  adjusted->report = followed.report;
  adjusted->report.loop_edges = std::move(loop_edges);
}

void findAndCloseLoops(const ReconstructionOptions& options, const LoopProgress& progress,
                       ReconstructionState* state, int32_t first_of_new) {
  if (first_of_new == 0 || state->vocabulary == nullptr) {
    state->vocabulary = trainVocabulary(state->data);
  }
  std::vector<LoopEdge> edges =
      findLoops(options.loops, state->vocabulary, state->data, progress, first_of_new);
  closeLoops(&edges, &state->data, first_of_new);
  std::vector<LoopEdge>& all_edges = state->report.loop_edges;
  all_edges.insert(all_edges.end(), edges.begin(), edges.end());
  triangulateTracks(options.triangulation, &state->data);
}

void recordAdjustment(const BundleAdjustmentSummary& summary, ReconstructionReport* report) {
  report->num_observations = summary.num_observations;
  report->rms_px = summary.rms_px;
}

}  // namespace vcharge
