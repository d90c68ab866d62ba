#include "update/reduced_map.h"

#include <utility>

namespace vcharge {
namespace {

/// Removes records; returns the new index of each, or -1.
template <class Record>
std::vector<int32_t> removeRecords(const std::vector<bool>& keeps, std::vector<Record>* records) {
  std::vector<int32_t> index_of(records->size(), -1);
  std::vector<Record> kept;
  for (size_t i = 0; i < records->size(); ++i) {
    if (keeps[i]) {
      index_of[i] = static_cast<int32_t>(kept.size());
      kept.push_back((*records)[i]);
    }
  }
  *records = std::move(kept);
  return index_of;
}

}  // namespace

std::shared_ptr<const SparseMap> reducedMap(const SparseMap& map, const std::vector<bool>& keeps_keyframe,
                                            const std::vector<bool>& keeps_landmark) {
  SparseMapContents contents = map.contents();
  std::vector<bool> is_observed(contents.landmarks.size(), false);
  std::vector<bool> has_keyframe(contents.sessions.size(), false);
  for (const MapObservation& observation : contents.observations) {
    if (keeps_keyframe[observation.keyframe] && keeps_landmark[observation.landmark]) {
      is_observed[observation.landmark] = true;
    }
  }
  for (size_t i = 0; i < contents.keyframes.size(); ++i) {
    if (keeps_keyframe[i]) {
      has_keyframe[contents.keyframes[i].session] = true;
    }
  }
  const std::vector<int32_t> keyframe_of = removeRecords(keeps_keyframe, &contents.keyframes);
  const std::vector<int32_t> landmark_of = removeRecords(is_observed, &contents.landmarks);
  const std::vector<int32_t> session_of = removeRecords(has_keyframe, &contents.sessions);
  for (MapKeyframe& keyframe : contents.keyframes) {
    keyframe.session = session_of[keyframe.session];
  }
  std::vector<MapObservation> observations;
  std::vector<MapLoopEdge> edges;
  cv::Mat descriptors(0, contents.descriptors.cols, contents.descriptors.type());
  descriptors.reserve(contents.observations.size());
  for (size_t i = 0; i < contents.observations.size(); ++i) {
    MapObservation observation = contents.observations[i];
    observation.keyframe = keyframe_of[observation.keyframe];
    observation.landmark = landmark_of[observation.landmark];
    if (observation.keyframe >= 0 && observation.landmark >= 0) {
      observations.push_back(observation);
      descriptors.push_back(contents.descriptors.row(static_cast<int>(i)));
    }
  }
  for (MapLoopEdge edge : contents.loop_edges) {
    edge.first = keyframe_of[edge.first];
    edge.second = keyframe_of[edge.second];
    if (edge.first >= 0 && edge.second >= 0) {
      edges.push_back(edge);
    }
  }
  contents.observations = std::move(observations);
  contents.descriptors = descriptors;
  contents.loop_edges = std::move(edges);
  return std::make_shared<const SparseMap>(std::move(contents));
}

}  // namespace vcharge
