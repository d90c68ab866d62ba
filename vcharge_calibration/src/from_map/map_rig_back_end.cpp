#include "from_map/map_rig_back_end.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <tbb/parallel_for.h>
#include <Eigen/LU>

#include "initialization/rig_initialization.h"
#include "rig/rig_adjustment.h"
#include "rig/rig_judgement.h"
#include "vcharge_reconstruction/stage_runner.h"
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

/// Of the keyframes, at which a camera must be found in the map.
constexpr double kMinFoundShare = 0.2;
/// A motion is no better known than this, whatever the poses' covariances say.
constexpr double kMinDirectionSigma_rad = 0.003;
constexpr double kMinRotationSigma_rad = 0.0003;
constexpr double kMaxDirectionSigma_rad = 0.3;
/// How each camera moved between keyframes one after the other at both of which it was found.
std::vector<MotionPair> motionsInMap(const std::vector<MapKeyframeView>& views,
                                     const std::vector<Keyframe>& keyframes, size_t camera) {
  std::vector<MotionPair> motions;
  for (size_t i = 1; i < views.size(); ++i) {
    const std::optional<PoseFix>& previous = views[i - 1].camera_fixes[camera];
    const std::optional<PoseFix>& current = views[i].camera_fixes[camera];
    if (!previous || !current) {
      continue;
    }
    const RigidTransform moved = previous->map_from_vehicle.inverse() * current->map_from_vehicle;
    const double distance_m = moved.translation().norm();
    const Eigen::Matrix<double, 6, 6> covariance = previous->covariance + current->covariance;
    MotionPair pair;
    pair.keyframe = static_cast<int32_t>(i) - 1;
    pair.vehicle = keyframes[i - 1].odom_from_vehicle.inverse() * keyframes[i].odom_from_vehicle;
    pair.camera_rotation = moved.rotation();
    pair.rotation_sigma_rad =
        std::hypot(std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3.0), kMinRotationSigma_rad);
    pair.direction_sigma_rad = std::hypot(
        std::sqrt(covariance.topLeftCorner<3, 3>().trace() / 3.0) / distance_m, kMinDirectionSigma_rad);
    pair.has_direction = pair.direction_sigma_rad < kMaxDirectionSigma_rad;
    pair.camera_direction =
        pair.has_direction ? moved.translation().normalized() : Eigen::Vector3d::UnitZ().eval();
    motions.push_back(pair);
  }
  return motions;
}

class MapRigBackEnd {
 public:
  MapRigBackEnd(const MapRigCalibratorOptions& options, const SparseMap& map, const MapLocalizer& localizer,
                const std::vector<MapKeyframeView>& views, const StageCallback& progress, MappingState* state,
                std::vector<int32_t>* landmark_of_track)
      : options_(options),
        map_(map),
        localizer_(localizer),
        views_(views),
        stages_(3, progress, &state->report),
        state_(state),
        data_(&state->data),
        series_(*state),
        landmark_of_track_(landmark_of_track) {}

  RigCalibration run() {
    result_.is_from_map = true;
    priors_.height_sigma_m = options_.height_sigma_m;
    try {
      describeDrive(*state_, &result_);
      stages_.run("first guess", [&] {
        guess();
        useFixesOfCameras();
        adjust();
      });
      stages_.run("joint adjustment", [&] {
        for (int i = 0; i < options_.num_searches; ++i) {
          correctTimeOffset(series_, state_, &result_);
          searchWithAllCameras();
          if (i + 1 == options_.num_searches) {
            priors_.odometry = estimateOdometryNoise(options_.adjustment, *data_);
          }
          adjust();
        }
      });
      stages_.run("judgement", [&] { judgeRig(options_.adjustment, priors_, *state_, &result_); });
    } catch (const NotCalibrated& failure) {
      result_.verdict = Verdict::kFail;
      result_.remarks = failure.remarks;
    }
    return std::move(result_);
  }

 private:
  void guess() {
    requireEnoughFound();
    std::vector<std::vector<MotionPair>> motions;
    for (size_t i = 0; i < data_->rig->cameras.size(); ++i) {
      motions.push_back(motionsInMap(views_, data_->keyframes, i));
    }
    const std::shared_ptr<CameraRig> rig = guessRig(series_, options_.hand_eye, motions, state_, &result_);
    for (size_t i = 0; i < rig->cameras.size(); ++i) {
      const RigidTransform& level = *rig->cameras[i].vehicle_from_camera;
      Eigen::Vector3d place_m = level.translation();
      place_m.z() = heightInMap(i);
      rig->cameras[i].vehicle_from_camera = RigidTransform(level.rotation(), place_m);
    }
    data_->rig = rig;
    placeKeyframes();
  }

  void requireEnoughFound() const {
    std::vector<std::string> failures;
    for (size_t i = 0; i < data_->rig->cameras.size(); ++i) {
      const auto found = std::count_if(views_.begin(), views_.end(), [&](const MapKeyframeView& view) {
        return view.camera_fixes[i].has_value();
      });
      if (static_cast<double>(found) < kMinFoundShare * static_cast<double>(views_.size())) {
        failures.push_back("camera '" + data_->rig->cameras[i].name + "' was found in the map at only " +
                           std::to_string(found) + " of " + std::to_string(views_.size()) +
                           " places: is it covered, or is this another place than the map's?");
      }
    }
    if (!failures.empty()) {
      throw NotCalibrated{failures};
    }
  }

  /// Of a camera above the ground on which the map's vehicle stood when it passed nearest.
  double heightInMap(size_t camera) const {
    std::vector<double> heights_m;
    for (const MapKeyframeView& view : views_) {
      if (!view.camera_fixes[camera]) {
        continue;
      }
      const Eigen::Vector3d& place_m = view.camera_fixes[camera]->map_from_vehicle.translation();
      const auto nearest = std::min_element(
          map_.keyframes().begin(), map_.keyframes().end(), [&](const MapKeyframe& a, const MapKeyframe& b) {
            return (a.map_from_vehicle.translation() - place_m).squaredNorm() <
                   (b.map_from_vehicle.translation() - place_m).squaredNorm();
          });
      heights_m.push_back((nearest->map_from_vehicle.inverse() * place_m).z());
    }
    return quantile(heights_m, 0.5);
  }

  /// Each by the camera that was found best there; the others by the odometer.
  void placeKeyframes() {
    std::vector<std::optional<RigidTransform>> found(views_.size());
    for (size_t k = 0; k < views_.size(); ++k) {
      int most = 0;
      for (size_t i = 0; i < data_->rig->cameras.size(); ++i) {
        const std::optional<PoseFix>& fix = views_[k].camera_fixes[i];
        if (fix && fix->numInliers() > most) {
          most = fix->numInliers();
          found[k] = fix->map_from_vehicle * data_->rig->cameras[i].vehicle_from_camera->inverse();
        }
      }
    }
    placeByNeighbours(&found);
    for (size_t k = 0; k < views_.size(); ++k) {
      data_->keyframes[k].map_from_vehicle = *found[k];
    }
  }

  void placeByNeighbours(std::vector<std::optional<RigidTransform>>* poses) const {
    const auto continueFrom = [&](size_t from, size_t to) {
      if ((*poses)[from] && !(*poses)[to]) {
        (*poses)[to] = *(*poses)[from] * (data_->keyframes[from].odom_from_vehicle.inverse() *
                                          data_->keyframes[to].odom_from_vehicle);
      }
    };
    for (size_t k = 1; k < poses->size(); ++k) {
      continueFrom(k - 1, k);
    }
    for (size_t k = poses->size() - 1; k > 0; --k) {
      continueFrom(k, k - 1);
    }
  }

  void useFixesOfCameras() {
    std::vector<std::vector<LandmarkSighting>> sightings(views_.size());
    for (size_t k = 0; k < views_.size(); ++k) {
      for (size_t i = 0; i < views_[k].camera_fixes.size(); ++i) {
        if (views_[k].camera_fixes[i]) {
          const std::vector<LandmarkSighting>& inliers = views_[k].camera_fixes[i]->inliers;
          sightings[k].insert(sightings[k].end(), inliers.begin(), inliers.end());
        }
      }
    }
    useSightings(sightings);
  }

  void searchWithAllCameras() {
    const std::unique_ptr<MapLocalizer> localizer = localizer_.forRig(data_->rig);
    std::vector<std::vector<LandmarkSighting>> sightings(views_.size());
    tbb::parallel_for(size_t{0}, views_.size(), [&](size_t k) {
      PosePrior prior;
      prior.map_from_vehicle = data_->keyframes[k].map_from_vehicle;
      prior.covariance.diagonal().head<3>().setConstant(options_.search_sigma_m * options_.search_sigma_m);
      prior.covariance.diagonal().tail<3>().setConstant(options_.search_sigma_rad *
                                                        options_.search_sigma_rad);
      const PoseFix fix = localizer->localizeNear(views_[k].features, prior);
      if (fix.status == LocalizationStatus::kLocalized) {
        sightings[k] = fix.inliers;
        data_->keyframes[k].map_from_vehicle = fix.map_from_vehicle;
      }
    });
    useSightings(sightings);
  }

  /// One track per landmark that was seen, in the map's order.
  void useSightings(const std::vector<std::vector<LandmarkSighting>>& sightings) {
    std::map<int32_t, Track> tracks;
    for (CameraCalibration& camera : result_.cameras) {
      camera.num_tracked = 0;
    }
    for (size_t k = 0; k < sightings.size(); ++k) {
      for (const LandmarkSighting& sighting : sightings[k]) {
        tracks[sighting.landmark].observations.push_back(
            {static_cast<int32_t>(k), sighting.camera, -1,
             Eigen::Vector2d(sighting.position_px.x, sighting.position_px.y), options_.feature_sigma_px});
        ++result_.cameras[sighting.camera].num_tracked;
      }
    }
    data_->tracks.clear();
    landmark_of_track_->clear();
    priors_.landmark_information.clear();
    const Eigen::Matrix3d own_m2 =
        options_.landmark_sigma_m * options_.landmark_sigma_m * Eigen::Matrix3d::Identity();
    for (auto& [landmark, track] : tracks) {
      std::sort(track.observations.begin(), track.observations.end(),
                [](const TrackObservation& a, const TrackObservation& b) {
                  return std::make_pair(a.keyframe, a.camera) < std::make_pair(b.keyframe, b.camera);
                });
      const MapLandmark& in_map = map_.landmarks()[landmark];
      track.position_m = in_map.position_m;
      data_->tracks.push_back(std::move(track));
      landmark_of_track_->push_back(landmark);
      priors_.landmark_information.emplace_back((in_map.covariance_m2 + own_m2).inverse());
    }
  }

  void adjust() {
    const BundleAdjustmentSummary summary = adjustRig(options_.adjustment, priors_, data_);
    state_->report.num_observations = summary.num_observations;
    state_->report.rms_px = summary.rms_px;
  }

  const MapRigCalibratorOptions& options_;
  const SparseMap& map_;
  const MapLocalizer& localizer_;
  const std::vector<MapKeyframeView>& views_;
  StageRunner stages_;
  MappingState* const state_;
  MappingData* const data_;
  const OdometrySeries series_;
  std::vector<int32_t>* const landmark_of_track_;
  RigPriors priors_;
  RigCalibration result_;
};

}  // namespace

RigCalibration runMapRigBackEnd(const MapRigCalibratorOptions& options, const SparseMap& map,
                                const MapLocalizer& localizer, const std::vector<MapKeyframeView>& views,
                                const StageCallback& progress, MappingState* state,
                                std::vector<int32_t>* landmark_of_track) {
  return MapRigBackEnd(options, map, localizer, views, progress, state, landmark_of_track).run();
}

}  // namespace vcharge
