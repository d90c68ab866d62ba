#include "vcharge_reconstruction/reconstruction_steps.h"

#include <cstdlib>
#include <sstream>
#include <utility>

#include "vcharge_core/base/options.h"

namespace vcharge {
namespace {

/// The nearest observation in the drive that has a feature; null if there is none.
const TrackObservation* describedObservation(const Track& track, const TrackObservation& observation) {
  const TrackObservation* best = nullptr;
  for (const TrackObservation& other : track.observations) {
    if (other.feature >= 0 && (best == nullptr || std::abs(other.keyframe - observation.keyframe) <
                                                      std::abs(best->keyframe - observation.keyframe))) {
      best = &other;
    }
  }
  return best;
}

/// Where the camera would have seen a landmark at the keyframe's stamp, with the same error: maps know
/// nothing of lines and clocks.
Eigen::Vector2d positionAtStamp(const ReconstructionData& data, const Track& track,
                                const TrackObservation& observation) {
  const MovingCamera camera = cameraAt(data.keyframes[observation.keyframe], *data.rig, observation.camera);
  if (!camera.moves()) {
    return observation.position_px;
  }
  const CameraModel& model = data.rig->cameras[observation.camera].model;
  const RigidTransform exposed_from_map = camera.poseAt(observation.position_px).inverse();
  Eigen::Vector2d exposed_px, at_stamp_px;
  return model.project(exposed_from_map * *track.position_m, &exposed_px) &&
                 model.project(camera.mapFromCamera().inverse() * *track.position_m, &at_stamp_px)
             ? observation.position_px + (at_stamp_px - exposed_px)
             : observation.position_px;
}

}  // namespace

std::shared_ptr<const SparseMap> assembleMap(const ReconstructionState& state,
                                             const FeatureExtractorOptions& features) {
  std::ostringstream feature_options;
  feature_options << writeFields(features);
  return assembleMap(state, feature_options.str());
}

std::shared_ptr<const SparseMap> assembleMap(const ReconstructionState& state,
                                             const std::string& feature_options) {
  const ReconstructionData& data = state.data;
  SparseMapContents contents;
  contents.rig = *data.rig;
  contents.sessions = data.sessions;
  contents.next_keyframe_id = data.next_keyframe_id;
  contents.next_landmark_id = data.next_landmark_id;
  for (const Keyframe& keyframe : data.keyframes) {
    contents.keyframes.push_back({keyframe.stamp, keyframe.map_from_vehicle,
                                  Eigen::Matrix<double, 6, 6>::Zero(), keyframe.session, keyframe.map_id});
  }
  std::vector<cv::Mat> descriptors;
  for (const Track& track : data.tracks) {
    if (!track.position_m) {
      continue;
    }
    const auto landmark = static_cast<int32_t>(contents.landmarks.size());
    bool is_described = false;
    for (const TrackObservation& observation : track.observations) {
      const TrackObservation* described =
          observation.feature >= 0 ? &observation : describedObservation(track, observation);
      if (described == nullptr) {
        continue;
      }
      is_described = true;
      contents.observations.push_back({observation.keyframe, observation.camera, landmark,
                                       positionAtStamp(data, track, observation).cast<float>()});
      descriptors.push_back(
          data.keyframes[described->keyframe].images[described->camera].features.descriptors.row(
              described->feature));
    }
    if (is_described) {
      contents.landmarks.push_back(
          {*track.position_m, track.covariance_m2, track.map_id, track.presence_log_odds});
    }
  }
  cv::vconcat(descriptors, contents.descriptors);
  for (const LoopEdge& edge : state.report.loop_edges) {
    contents.loop_edges.push_back(
        {edge.first, edge.second, edge.first_from_second, edge.num_inliers, edge.accepted, edge.reason});
  }
  contents.feature_options = feature_options;
  contents.odometry_distance_scale = data.odometry_distance_scale;
  contents.odometry_turn_scale = data.odometry_turn_scale;
  return std::make_shared<const SparseMap>(std::move(contents));
}

}  // namespace vcharge
