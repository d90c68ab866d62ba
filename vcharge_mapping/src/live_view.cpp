#include "vcharge_mapping/live_view.h"

#include <algorithm>

namespace vcharge {

Trajectory keyframePath(const MappingState& state) {
  Trajectory path;
  for (const Keyframe& keyframe : state.data.keyframes) {
    path.push_back({keyframe.stamp, keyframe.map_from_vehicle});
  }
  return path;
}

std::vector<Eigen::Vector3d> recentLandmarks(const MappingState& state, const TriangulationOptions& options,
                                             int num_keyframes) {
  const auto end = static_cast<int32_t>(state.data.keyframes.size());
  const int32_t begin = std::max(0, end - num_keyframes);
  MappingData recent;
  recent.rig = state.data.rig;
  for (int32_t k = begin; k < end; ++k) {
    Keyframe keyframe;  // without the images, which triangulation needs not
    keyframe.map_from_vehicle = state.data.keyframes[k].map_from_vehicle;
    recent.keyframes.push_back(keyframe);
  }
  for (const Track& track : state.data.tracks) {
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
    recent.tracks.push_back(std::move(seen));
  }
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
