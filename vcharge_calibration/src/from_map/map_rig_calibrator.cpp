#include "vcharge_calibration/from_map/map_rig_calibrator.h"

#include <utility>

#include <tbb/parallel_for.h>

#include "from_map/map_rig_steps.h"
#include "report/rig_pictures.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/stage_timer.h"

namespace vcharge {
namespace {

// Standard deviations of a camera's pose around the extrapolation of its last two poses.
constexpr double kPredictionSigma_m = 0.1;
constexpr double kPredictionSigma_rad = 0.03;

std::shared_ptr<const CameraRig> withCamerasAtOrigin(const CameraRig& rig) {
  auto result = std::make_shared<CameraRig>(rig);
  for (RigCamera& camera : result->cameras) {
    camera.vehicle_from_camera = RigidTransform();
    camera.covariance.reset();
  }
  return result;
}

MapLocalizerOptions withoutUprightVehicle(MapLocalizerOptions options) {
  options.stands_upright = false;
  return options;
}

RigFeatures onlyCamera(const RigFeatures& features, size_t camera) {
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

MapRigCalibrator::MapRigCalibrator(std::shared_ptr<const SparseMap> map, const CameraRig& rig,
                                   const MapRigCalibratorOptions& options)
    : options_(options), map_(std::move(map)), keyframes_(options, &state_) {
  options_.validate();
  check(map_ != nullptr, "MapRigCalibrator: expected a map");
  if (rig.cameras.empty()) {
    throw InputError("rig: expected a camera");
  }
  rig_ = withCamerasAtOrigin(rig);
  localizer_ = std::make_unique<MapLocalizer>(std::make_shared<const TiledMap>(map_), rig_,
                                              withoutUprightVehicle(options_.localizer));
  state_.data.rig = rig_;
  assembler_ =
      std::make_unique<FrameAssembler<Image>>(rig_->cameras.size(), options_.assemblerOptions(),
                                              [this](const ImageFrame& frame) { processFrame(frame); });
  assembler_->joinStamps(rig_->stamp_tolerance_s);
  state_.report.counters = assembler_->counters();
}

MapRigCalibrator::~MapRigCalibrator() = default;

void MapRigCalibrator::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  assembler_->addImage(camera_index, stamp, image);
  state_.report.counters = assembler_->counters();
}

void MapRigCalibrator::addOdometry(const VehicleOdometry& odometry) {
  assembler_->addOdometry(odometry);
  state_.report.counters = assembler_->counters();
}

void MapRigCalibrator::processFrame(const ImageFrame& frame) {
  state_.report.noteFrame(frame, *rig_, assembler_->counters());
  if (!frame.bridged_from_vehicle) {
    return;
  }
  const StageTimer timer("finding cameras", &state_.report.stage_s);
  keyframes_.correct(frame.corrections);
  const RigidTransform& odom_from_vehicle = *frame.bridged_from_vehicle;
  const RigidTransform since = motionSinceKeyframe(odom_from_vehicle);
  if (keyframes_.isDue(since)) {
    images_.add(static_cast<int32_t>(views_.size()), frame.images);
    addKeyframe(frame.stamp, localizer_->extract(frame.images, FrameMotion()), odom_from_vehicle,
                frame.motion);
  } else {
    keyframes_.addFrame(frame.stamp, since, MotionHypothesis::kOdometry);
  }
}

RigidTransform MapRigCalibrator::motionSinceKeyframe(const RigidTransform& odom_from_vehicle) const {
  return views_.empty() ? RigidTransform()
                        : state_.data.keyframes.back().odom_from_vehicle.inverse() * odom_from_vehicle;
}

void MapRigCalibrator::addKeyframe(Timestamp stamp, RigFeatures features,
                                   const RigidTransform& odom_from_vehicle, const FrameMotion& motion) {
  MapKeyframeView view;
  view.features = std::move(features);
  view.camera_fixes.resize(rig_->cameras.size());
  tbb::parallel_for(size_t{0}, rig_->cameras.size(),
                    [&](size_t i) { view.camera_fixes[i] = findCamera(view.features, i); });
  const RigidTransform since = motionSinceKeyframe(odom_from_vehicle);
  travelled_m_ += since.translation().norm();
  Keyframe keyframe;
  keyframe.stamp = stamp;
  keyframe.odom_from_vehicle = odom_from_vehicle;
  keyframe.motion = motion;
  keyframe.travelled_m = travelled_m_;
  keyframes_.addKeyframe(std::move(keyframe), since, MotionHypothesis::kOdometry);
  views_.push_back(std::move(view));
}

std::optional<PoseFix> MapRigCalibrator::findCamera(const RigFeatures& features, size_t camera) const {
  if (features.images[camera].empty()) {
    return std::nullopt;
  }
  const RigFeatures alone = onlyCamera(features, camera);
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
    prior.covariance.diagonal().head<3>().setConstant(kPredictionSigma_m * kPredictionSigma_m);
    prior.covariance.diagonal().tail<3>().setConstant(kPredictionSigma_rad * kPredictionSigma_rad);
    fix = localizer_->localizeNear(alone, prior);
  }
  if (fix.status != LocalizationStatus::kLocalized) {
    fix = localizer_->localizeAnywhere(alone);
  }
  return fix.status == LocalizationStatus::kLocalized ? std::make_optional(fix) : std::nullopt;
}

RigCalibration MapRigCalibrator::finish(const StageCallback& progress) {
  assembler_->finish();
  return calibrateInMap(options_, *map_, *localizer_, views_, progress, &state_, &landmark_of_track_);
}

std::string MapRigCalibrator::reportSection() const {
  if (landmark_of_track_.empty()) {
    return "";
  }
  std::vector<LandmarkViews> views;
  for (size_t t = 0; t < state_.data.tracks.size(); ++t) {
    const Track& track = state_.data.tracks[t];
    if (!track.position_m) {
      continue;
    }
    const auto landmark = static_cast<size_t>(landmark_of_track_[t]);
    const auto first = static_cast<size_t>(*map_->observationsOfLandmark(landmark).first);
    views.push_back({*track.position_m, static_cast<size_t>(map_->observations()[first].camera), {}});
    for (const TrackObservation& observation : track.observations) {
      views.back().cameras_m.push_back(
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
  return "<h2>Observed landmarks of the map</h2><p>In the colour of the map's camera that observed them "
         "first, "
         "with lines to the cameras that observe them now.</p><div class=\"row\">" +
         drawLandmarkViews(views, path_m, names) + "</div>";
}

}  // namespace vcharge
