#include "vcharge_calibration/from_map/map_rig_calibrator.h"

#include <utility>

#include <tbb/parallel_for.h>

#include "from_map/map_rig_back_end.h"
#include "report/rig_pictures.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/stage_timer.h"

namespace vcharge {
namespace {

std::shared_ptr<const CameraRig> withCamerasAtOrigin(const CameraRig& rig) {
  auto result = std::make_shared<CameraRig>(rig);
  for (RigCamera& camera : result->cameras) {
    camera.vehicle_from_camera = RigidTransform();
    camera.covariance.reset();
  }
  return result;
}

MapLocalizerOptions ofCamerasAlone(MapLocalizerOptions options) {
  options.stands_upright = false;
  return options;
}

RigFeatures onlyOf(const RigFeatures& features, size_t camera) {
  RigFeatures result;
  result.images.resize(features.images.size());
  result.rays_in_camera.resize(features.images.size());
  result.images[camera] = features.images[camera];
  result.rays_in_camera[camera] = features.rays_in_camera[camera];
  return result;
}

}  // namespace

RigAdjustmentOptions MapRigCalibratorOptions::defaultAdjustment() {
  RigAdjustmentOptions options;
  options.bundle.min_observations = 1;
  options.bundle.min_parallax_rad = 0.0;
  options.bundle.cost_tolerance = 1e-5;
  return options;
}

void MapRigCalibratorOptions::validate() const {
  requireField(keyframe_distance_m > 0.0, "keyframe_distance_m", "must be positive", keyframe_distance_m);
  requireField(keyframe_turn_rad > 0.0, "keyframe_turn_rad", "must be positive", keyframe_turn_rad);
  requireField(max_speed_m_per_s > 0.0, "max_speed_m_per_s", "must be positive", max_speed_m_per_s);
  requireField(prediction_sigma_m > 0.0, "prediction_sigma_m", "must be positive", prediction_sigma_m);
  requireField(prediction_sigma_rad > 0.0, "prediction_sigma_rad", "must be positive", prediction_sigma_rad);
  requireField(search_sigma_m > 0.0, "search_sigma_m", "must be positive", search_sigma_m);
  requireField(search_sigma_rad > 0.0, "search_sigma_rad", "must be positive", search_sigma_rad);
  requireField(num_searches >= 1, "num_searches", "must be 1 or more", num_searches);
  requireField(landmark_sigma_m > 0.0, "landmark_sigma_m", "must be positive", landmark_sigma_m);
  requireField(height_sigma_m > 0.0, "height_sigma_m", "must be positive", height_sigma_m);
  requireField(feature_sigma_px > 0.0, "feature_sigma_px", "must be positive", feature_sigma_px);
  validateInner("hand_eye", hand_eye);
  validateInner("localizer", localizer);
  validateInner("adjustment", adjustment);
}

MapRigCalibrator::MapRigCalibrator(std::shared_ptr<const SparseMap> map, const CameraRig& rig,
                                   const MapRigCalibratorOptions& options)
    : options_(options), map_(std::move(map)) {
  options_.validate();
  check(map_ != nullptr, "MapRigCalibrator: expected a map");
  if (rig.cameras.empty()) {
    throw InputError("rig: expected a camera");
  }
  rig_ = withCamerasAtOrigin(rig);
  localizer_ = std::make_unique<MapLocalizer>(map_, rig_, ofCamerasAlone(options_.localizer));
  state_.data.rig = rig_;
  gatherer_ = std::make_unique<FrameGatherer>(
      rig_, options_.max_speed_m_per_s, &state_.report,
      [this](Timestamp stamp, const std::vector<Image>& images, const RigidTransform& odom_from_vehicle) {
        processFrame(stamp, images, odom_from_vehicle);
      });
}

MapRigCalibrator::~MapRigCalibrator() = default;

void MapRigCalibrator::processFrame(Timestamp stamp, const std::vector<Image>& images,
                                    const RigidTransform& odom_from_vehicle) {
  const StageTimer timer("finding cameras", &state_.report.stage_s);
  const RigidTransform since =
      views_.empty() ? RigidTransform()
                     : state_.data.keyframes.back().odom_from_vehicle.inverse() * odom_from_vehicle;
  if (views_.empty() || since.translation().norm() >= options_.keyframe_distance_m ||
      angleOfRotation(since.rotation()) >= options_.keyframe_turn_rad) {
    images_.add(static_cast<int32_t>(views_.size()), images);
    addKeyframe(stamp, localizer_->extract(images), odom_from_vehicle);
  } else {
    state_.frames.push_back(
        {stamp, static_cast<int32_t>(views_.size()) - 1, since, MotionHypothesis::kOdometry});
  }
}

void MapRigCalibrator::addKeyframe(Timestamp stamp, RigFeatures features,
                                   const RigidTransform& odom_from_vehicle) {
  if (!views_.empty()) {
    travelled_m_ +=
        (state_.data.keyframes.back().odom_from_vehicle.inverse() * odom_from_vehicle).translation().norm();
  }
  MapKeyframeView view;
  view.features = std::move(features);
  view.camera_fixes.resize(rig_->cameras.size());
  tbb::parallel_for(size_t{0}, rig_->cameras.size(),
                    [&](size_t i) { view.camera_fixes[i] = findCamera(view.features, i); });
  Keyframe keyframe;
  keyframe.stamp = stamp;
  keyframe.odom_from_vehicle = odom_from_vehicle;
  keyframe.travelled_m = travelled_m_;
  keyframe.images.resize(rig_->cameras.size());
  state_.data.keyframes.push_back(std::move(keyframe));
  state_.frames.push_back(
      {stamp, static_cast<int32_t>(views_.size()), RigidTransform(), MotionHypothesis::kOdometry});
  views_.push_back(std::move(view));
}

std::optional<PoseFix> MapRigCalibrator::findCamera(const RigFeatures& features, size_t camera) const {
  if (features.images[camera].empty()) {
    return std::nullopt;
  }
  const RigFeatures alone = onlyOf(features, camera);
  PoseFix fix;
  const auto& last = views_.empty() ? std::nullopt : views_.back().camera_fixes[camera];
  if (last) {
    PosePrior prior;
    prior.map_from_vehicle = last->map_from_vehicle;
    const auto& before = views_.size() < 2 ? std::nullopt : views_[views_.size() - 2].camera_fixes[camera];
    if (before) {
      prior.map_from_vehicle =
          last->map_from_vehicle * (before->map_from_vehicle.inverse() * last->map_from_vehicle);
    }
    prior.covariance.diagonal().head<3>().setConstant(options_.prediction_sigma_m *
                                                      options_.prediction_sigma_m);
    prior.covariance.diagonal().tail<3>().setConstant(options_.prediction_sigma_rad *
                                                      options_.prediction_sigma_rad);
    fix = localizer_->localizeNear(alone, prior);
  }
  if (fix.status != LocalizationStatus::kLocalized) {
    fix = localizer_->localizeAnywhere(alone);
  }
  return fix.status == LocalizationStatus::kLocalized ? std::make_optional(fix) : std::nullopt;
}

RigCalibration MapRigCalibrator::finish(const StageCallback& progress) {
  gatherer_->finish();
  return runMapRigBackEnd(
      options_, *map_, *localizer_, views_, progress ? progress : [](const StageProgress&) {}, &state_,
      &landmark_of_track_);
}

std::string MapRigCalibrator::reportSection() const {
  if (landmark_of_track_.empty()) {
    return "";
  }
  std::vector<LandmarkSightings> sightings;
  for (size_t t = 0; t < state_.data.tracks.size(); ++t) {
    const Track& track = state_.data.tracks[t];
    if (!track.position_m) {
      continue;
    }
    const auto landmark = static_cast<size_t>(landmark_of_track_[t]);
    const auto first = static_cast<size_t>(*map_->observationsOfLandmark(landmark).first);
    sightings.push_back({*track.position_m, static_cast<size_t>(map_->observations()[first].camera), {}});
    for (const TrackObservation& observation : track.observations) {
      sightings.back().cameras_m.push_back(
          state_.data.keyframes[observation.keyframe].map_from_vehicle *
          state_.data.rig->cameras[observation.camera].vehicle_from_camera->translation());
    }
  }
  std::vector<Eigen::Vector3d> path_m;
  for (const Keyframe& keyframe : state_.data.keyframes) {
    path_m.push_back(keyframe.map_from_vehicle.translation());
  }
  std::vector<std::string> names;
  for (const RigCamera& camera : map_->rig().cameras) {
    names.push_back(camera.name);
  }
  return "<h2>Landmarks of the map that were seen</h2><p>In the colour of the map's camera that saw them "
         "first, "
         "with lines to the cameras that see them now.</p><div class=\"row\">" +
         drawSightings(sightings, path_m, names) + "</div>";
}

}  // namespace vcharge
