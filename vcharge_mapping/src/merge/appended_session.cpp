#include "merge/appended_session.h"

#include <algorithm>

#include <Eigen/Geometry>

namespace vcharge {
namespace {

/// Landmarks are not seen over a larger distance.
constexpr double kGap_m = 300.0;

Eigen::AlignedBox3d boundsOf(const SparseMap& map) {
  Eigen::AlignedBox3d bounds;
  for (const MapKeyframe& keyframe : map.keyframes()) {
    bounds.extend(keyframe.map_from_vehicle.translation());
  }
  return bounds;
}

/// Puts the session beside the map.
RigidTransform mapFromSession(const SparseMap& map, const SparseMap& session) {
  if (map.keyframes().empty() || session.keyframes().empty()) {
    return {};
  }
  const double shift_m = boundsOf(map).max().x() + kGap_m - boundsOf(session).min().x();
  return RigidTransform::planar(shift_m, 0.0, 0.0);
}

std::vector<MapLoopEdge> acceptedEdges(const SparseMap& map, int32_t first_keyframe) {
  std::vector<MapLoopEdge> edges;
  for (MapLoopEdge edge : map.contents().loop_edges) {
    if (edge.accepted) {
      edge.first += first_keyframe;
      edge.second += first_keyframe;
      edges.push_back(edge);
    }
  }
  return edges;
}

}  // namespace

SparseMapContents appendSession(const SparseMap& map, const SparseMap& session) {
  const RigidTransform map_from_session = mapFromSession(map, session);
  const auto num_sessions = static_cast<int32_t>(map.sessions().size());
  const auto num_keyframes = static_cast<int32_t>(map.keyframes().size());
  const auto num_landmarks = static_cast<int32_t>(map.landmarks().size());
  int32_t num_components = 0;
  for (const MapSession& of_map : map.sessions()) {
    num_components = std::max(num_components, of_map.component + 1);
  }
  SparseMapContents contents = map.contents();
  for (MapSession added : session.sessions()) {
    added.component += num_components;
    contents.sessions.push_back(added);
  }
  for (MapKeyframe keyframe : session.keyframes()) {
    keyframe.map_from_vehicle = map_from_session * keyframe.map_from_vehicle;
    keyframe.session += num_sessions;
    keyframe.id = kNoId;
    contents.keyframes.push_back(keyframe);
  }
  for (MapLandmark landmark : session.landmarks()) {
    landmark.position_m = map_from_session * landmark.position_m;
    landmark.id = kNoId;
    contents.landmarks.push_back(landmark);
  }
  for (MapObservation observation : session.observations()) {
    observation.keyframe += num_keyframes;
    observation.landmark += num_landmarks;
    contents.observations.push_back(observation);
  }
  if (contents.descriptors.empty()) {
    contents.descriptors = session.descriptors();
  } else if (!session.descriptors().empty()) {
    cv::vconcat(contents.descriptors, session.descriptors(), contents.descriptors);
  }
  contents.loop_edges = acceptedEdges(map, 0);
  const std::vector<MapLoopEdge> added = acceptedEdges(session, num_keyframes);
  contents.loop_edges.insert(contents.loop_edges.end(), added.begin(), added.end());
  return contents;
}

void joinComponents(const std::vector<std::pair<int32_t, int32_t>>& joined,
                    std::vector<MapSession>* sessions) {
  for (const auto& [a, b] : joined) {
    const int32_t from = std::max((*sessions)[a].component, (*sessions)[b].component);
    const int32_t to = std::min((*sessions)[a].component, (*sessions)[b].component);
    for (MapSession& session : *sessions) {
      session.component = session.component == from ? to : session.component;
    }
  }
}

}  // namespace vcharge
