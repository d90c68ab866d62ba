#include <memory>
#include <utility>

#include "vcharge_reconstruction/reconstruction_steps.h"

namespace vcharge {
namespace {

/// Gap between the travelled distances of sessions: any of their keyframes can make a loop.
constexpr double kSessionGap_m = 1e6;

KeyframeImage imageOf(const SparseMap& map, size_t keyframe, size_t camera) {
  KeyframeImage image;
  const auto [begin, end] = map.observationsOf(keyframe, camera);
  image.features.descriptors = map.descriptors().rowRange(static_cast<int>(begin), static_cast<int>(end));
  image.rays_in_camera.setZero(3, static_cast<Eigen::Index>(end - begin));
  for (size_t i = begin; i < end; ++i) {
    const MapObservation& observation = map.observations()[i];
    Keypoint keypoint;
    keypoint.position_px = {observation.position_px.x(), observation.position_px.y()};
    image.features.keypoints.push_back(keypoint);
    image.track_of_feature.push_back(observation.landmark);
    Eigen::Vector3d ray;
    if (map.rig().cameras[camera].model.unproject(observation.position_px.cast<double>(), &ray)) {
      image.rays_in_camera.col(static_cast<Eigen::Index>(i - begin)) = ray;
    }
  }
  return image;
}

}  // namespace

ReconstructionData reconstructionOf(const SparseMap& map, double observation_sigma_px) {
  ReconstructionData data;
  data.rig = std::make_shared<const CameraRig>(map.rig());
  data.sessions = map.sessions();
  data.next_keyframe_id = map.contents().next_keyframe_id;
  data.next_landmark_id = map.contents().next_landmark_id;
  for (const MapLandmark& landmark : map.landmarks()) {
    Track track;
    track.position_m = landmark.position_m;
    track.covariance_m2 = landmark.covariance_m2;
    track.map_id = landmark.id;
    track.presence_log_odds = landmark.presence_log_odds;
    data.tracks.push_back(std::move(track));
  }
  double travelled_m = 0.0;
  for (size_t i = 0; i < map.keyframes().size(); ++i) {
    const MapKeyframe& from = map.keyframes()[i];
    if (i > 0) {
      const MapKeyframe& previous = map.keyframes()[i - 1];
      travelled_m +=
          from.session != previous.session
              ? kSessionGap_m
              : (from.map_from_vehicle.translation() - previous.map_from_vehicle.translation()).norm();
    }
    Keyframe keyframe;
    keyframe.stamp = from.stamp;
    keyframe.odom_from_vehicle = keyframe.map_from_vehicle = from.map_from_vehicle;
    keyframe.travelled_m = travelled_m;
    keyframe.session = from.session;
    keyframe.map_id = from.id;
    for (size_t camera = 0; camera < map.rig().cameras.size(); ++camera) {
      keyframe.images.push_back(imageOf(map, i, camera));
      const auto [begin, end] = map.observationsOf(i, camera);
      for (size_t k = begin; k < end; ++k) {
        const MapObservation& observation = map.observations()[k];
        data.tracks[observation.landmark].observations.push_back(
            {static_cast<int32_t>(i), static_cast<int32_t>(camera), static_cast<int32_t>(k - begin),
             observation.position_px.cast<double>(), observation_sigma_px});
      }
    }
    data.keyframes.push_back(std::move(keyframe));
  }
  return data;
}

}  // namespace vcharge
