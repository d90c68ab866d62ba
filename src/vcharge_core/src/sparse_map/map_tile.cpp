#include "vcharge_core/sparse_map/map_tile.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vcharge {
namespace {

int32_t tileCoordinate(double position_m) {
  constexpr double kMax = std::numeric_limits<int32_t>::max();
  return static_cast<int32_t>(std::clamp(std::floor(position_m / kTileSize_m), -kMax, kMax));
}

}  // namespace

MapTile tileAt(const Eigen::Vector3d& position_m) {
  return {tileCoordinate(position_m.x()), tileCoordinate(position_m.y())};
}

std::map<MapTile, std::vector<size_t>> tilesOf(const std::vector<MapKeyframe>& keyframes) {
  std::map<MapTile, std::vector<size_t>> tiles;
  for (size_t i = 0; i < keyframes.size(); ++i) {
    tiles[tileAt(keyframes[i].map_from_vehicle.translation())].push_back(i);
  }
  return tiles;
}

SparseMapContents headOf(const SparseMapContents& whole) {
  SparseMapContents head;
  head.rig = whole.rig;
  head.sessions = whole.sessions;
  head.feature_options = whole.feature_options;
  head.odometry_distance_scale = whole.odometry_distance_scale;
  head.odometry_turn_scale = whole.odometry_turn_scale;
  head.next_keyframe_id = whole.next_keyframe_id;
  head.next_landmark_id = whole.next_landmark_id;
  return head;
}

SparseMapContents overviewOf(const SparseMap& map) {
  SparseMapContents overview = headOf(map.contents());
  overview.keyframes = map.keyframes();
  for (MapKeyframe& keyframe : overview.keyframes) {
    keyframe.covariance.setZero();
  }
  overview.descriptors.create(0, map.descriptors().cols, map.descriptors().type());
  return overview;
}

std::shared_ptr<const SparseMap> partOf(const SparseMap& map, const std::vector<size_t>& keyframes) {
  const SparseMapContents& whole = map.contents();
  SparseMapContents part = headOf(whole);
  const size_t num_cameras = whole.rig.cameras.size();
  std::vector<size_t> rows;
  std::vector<int32_t> landmarks;
  for (const size_t keyframe : keyframes) {
    const auto index = static_cast<int32_t>(part.keyframes.size());
    part.keyframes.push_back(whole.keyframes[keyframe]);
    part.keyframes.back().covariance.setZero();
    // The images of a keyframe lie one after the other.
    const size_t begin = map.observationsOf(keyframe, 0).first;
    const size_t end = map.observationsOf(keyframe, num_cameras - 1).second;
    for (size_t i = begin; i < end; ++i) {
      rows.push_back(i);
      part.observations.push_back(whole.observations[i]);
      part.observations.back().keyframe = index;
      landmarks.push_back(whole.observations[i].landmark);
    }
  }
  std::sort(landmarks.begin(), landmarks.end());
  landmarks.erase(std::unique(landmarks.begin(), landmarks.end()), landmarks.end());
  for (const int32_t landmark : landmarks) {
    part.landmarks.push_back(whole.landmarks[static_cast<size_t>(landmark)]);
  }
  part.descriptors.create(static_cast<int>(rows.size()), whole.descriptors.cols, whole.descriptors.type());
  for (size_t i = 0; i < rows.size(); ++i) {
    MapObservation& observation = part.observations[i];
    observation.landmark = static_cast<int32_t>(
        std::lower_bound(landmarks.begin(), landmarks.end(), observation.landmark) - landmarks.begin());
    whole.descriptors.row(static_cast<int>(rows[i])).copyTo(part.descriptors.row(static_cast<int>(i)));
  }
  return std::make_shared<const SparseMap>(std::move(part));
}

}  // namespace vcharge
