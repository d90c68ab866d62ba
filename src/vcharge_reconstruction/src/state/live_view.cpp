#include "vcharge_reconstruction/live_view.h"

#include <algorithm>
#include <utility>

namespace vcharge {

Trajectory keyframePath(const ReconstructionState& state) {
  Trajectory path;
  for (const Keyframe& keyframe : state.data.keyframes) {
    path.push_back({keyframe.stamp, keyframe.map_from_vehicle});
  }
  return path;
}

ReconstructionData lastPart(const ReconstructionData& data, int32_t begin) {
  ReconstructionData part;
  part.rig = data.rig;
  for (auto k = static_cast<size_t>(begin); k < data.keyframes.size(); ++k) {
    part.keyframes.emplace_back();
    part.keyframes.back().odom_from_vehicle = data.keyframes[k].odom_from_vehicle;
    part.keyframes.back().map_from_vehicle = data.keyframes[k].map_from_vehicle;
  }
  for (const Track& track : data.tracks) {
    if (track.observations.empty() || track.observations.back().keyframe < begin) {
      continue;
    }
    Track seen;
    for (TrackObservation observation : track.observations) {
      if (observation.keyframe >= begin) {
        observation.keyframe -= begin;
        seen.observations.push_back(observation);
      }
    }
    part.tracks.push_back(std::move(seen));
  }
  return part;
}

std::vector<Eigen::Vector3d> recentLandmarks(const ReconstructionState& state,
                                             const TriangulationOptions& options, int num_keyframes) {
  const auto end = static_cast<int32_t>(state.data.keyframes.size());
  ReconstructionData recent = lastPart(state.data, std::max(0, end - num_keyframes));
  triangulateTracks(options, &recent);
  std::vector<Eigen::Vector3d> points;
  for (const Track& track : recent.tracks) {
    if (track.position_m) {
      points.push_back(*track.position_m);
    }
  }
  return points;
}

}  // namespace vcharge
