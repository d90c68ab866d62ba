// The steps of the calibration from a drive in a map (paper, section Structure-based Calibration).
#include "from_map/map_rig_steps.h"

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include <tbb/parallel_for.h>
#include <Eigen/LU>

#include "from_map/cameras_in_map.h"
#include "initialization/rig_initialization.h"
#include "rig/rig_adjustment.h"
#include "rig/rig_judgement.h"
#include "vcharge_reconstruction/reconstruction_steps.h"
#include "vcharge_reconstruction/stage_runner.h"

namespace vcharge {
namespace {

constexpr int kNumStages = 3;
/// Number of searches with all cameras; each is followed by an adjustment.
constexpr int kNumSearches = 2;
// Standard deviations of a keyframe's pose in the search with all cameras.
constexpr double kSearchSigma_m = 0.05;
constexpr double kSearchSigma_rad = 0.01;

class MapRigSteps {
 public:
  MapRigSteps(const MapRigCalibratorOptions& options, const SparseMap& map, const MapLocalizer& localizer,
              const std::vector<MapKeyframeView>& views, const StageCallback& progress,
              ReconstructionState* state, std::vector<int32_t>* landmark_of_track)
      : options_(options),
        map_(map),
        localizer_(localizer),
        views_(views),
        stages_(kNumStages, progress, &state->report),
        state_(state),
        data_(&state->data),
        series_(*state),
        landmark_of_track_(landmark_of_track) {}

  RigCalibration run() {
    result_.is_from_map = true;
    priors_.height_sigma_m = options_.height_sigma_m;
    addKnownCameras(*data_->rig, &priors_);
    try {
      describeDrive(*state_, &result_);
      stages_.run("initial estimate", [&] {
        initialize();
        useFixesOfCameras();
        adjust();
      });
      stages_.run("joint adjustment", [&] {
        for (int i = 0; i < kNumSearches; ++i) {
          correctTimeOffset(series_, state_, &result_);
          searchWithAllCameras();
          if (i + 1 == kNumSearches) {
            priors_.odometry = estimateOdometryNoise(options_.adjustment.bundle, *data_);
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
  /// Computes extrinsics from each camera's motions in the map, and keyframe poses from the cameras' poses.
  void initialize() {
    requireEnoughFixes(views_, *data_->rig);
    std::vector<std::vector<MotionPair>> motions;
    for (size_t i = 0; i < data_->rig->cameras.size(); ++i) {
      motions.push_back(motionsInMap(views_, data_->keyframes, i));
    }
    const std::shared_ptr<CameraRig> rig =
        estimateInitialRig(series_, options_.hand_eye, motions, state_, &result_);
    for (size_t i = 0; i < rig->cameras.size(); ++i) {
      const RigidTransform& level = *rig->cameras[i].vehicle_from_camera;
      Eigen::Vector3d position_m = level.translation();
      position_m.z() = heightInMap(views_, map_, i);
      rig->cameras[i].vehicle_from_camera = RigidTransform(level.rotation(), position_m);
    }
    data_->rig = rig;
    setPosesByFixes(views_, data_);
  }

  void useFixesOfCameras() {
    std::vector<std::vector<LandmarkObservation>> observations(views_.size());
    for (size_t k = 0; k < views_.size(); ++k) {
      for (const std::optional<PoseFix>& fix : views_[k].camera_fixes) {
        if (fix) {
          observations[k].insert(observations[k].end(), fix->inliers.begin(), fix->inliers.end());
        }
      }
    }
    makeTracks(observations);
  }

  void searchWithAllCameras() {
    const MapLocalizer localizer(localizer_.map(), data_->rig, options_.localizer);
    std::vector<std::vector<LandmarkObservation>> observations(views_.size());
    tbb::parallel_for(size_t{0}, views_.size(), [&](size_t k) {
      PosePrior prior;
      prior.map_from_vehicle = data_->keyframes[k].map_from_vehicle;
      prior.covariance.diagonal().head<3>().setConstant(kSearchSigma_m * kSearchSigma_m);
      prior.covariance.diagonal().tail<3>().setConstant(kSearchSigma_rad * kSearchSigma_rad);
      const PoseFix fix = localizer.localizeNear(views_[k].features, prior);
      if (fix.status == LocalizationStatus::kLocalized) {
        observations[k] = fix.inliers;
        data_->keyframes[k].map_from_vehicle = fix.map_from_vehicle;
      }
    });
    makeTracks(observations);
  }

  int32_t indexOf(int32_t landmark_id) const {
    const auto found =
        std::lower_bound(map_.landmarks().begin(), map_.landmarks().end(), landmark_id,
                         [](const MapLandmark& landmark, int32_t id) { return landmark.id < id; });
    return static_cast<int32_t>(found - map_.landmarks().begin());
  }

  /// Replaces the tracks by one per observed landmark, in the map's order.
  void makeTracks(const std::vector<std::vector<LandmarkObservation>>& observations) {
    std::map<int32_t, Track> tracks;
    for (CameraCalibration& camera : result_.cameras) {
      camera.num_tracked = 0;
    }
    for (size_t k = 0; k < observations.size(); ++k) {
      for (const LandmarkObservation& observed : observations[k]) {
        tracks[indexOf(observed.landmark_id)].observations.push_back(
            {static_cast<int32_t>(k), observed.camera, -1,
             Eigen::Vector2d(observed.position_px.x, observed.position_px.y), options_.feature_sigma_px});
        ++result_.cameras[observed.camera].num_tracked;
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

  void adjust() { recordAdjustment(adjustRig(options_.adjustment, priors_, data_), &state_->report); }

  const MapRigCalibratorOptions& options_;
  const SparseMap& map_;
  const MapLocalizer& localizer_;
  const std::vector<MapKeyframeView>& views_;
  StageRunner stages_;
  ReconstructionState* const state_;
  ReconstructionData* const data_;
  const OdometrySeries series_;
  std::vector<int32_t>* const landmark_of_track_;
  RigPriors priors_;
  RigCalibration result_;
};

}  // namespace

RigCalibration calibrateInMap(const MapRigCalibratorOptions& options, const SparseMap& map,
                              const MapLocalizer& localizer, const std::vector<MapKeyframeView>& views,
                              const StageCallback& progress, ReconstructionState* state,
                              std::vector<int32_t>* landmark_of_track) {
  return MapRigSteps(options, map, localizer, views, progress, state, landmark_of_track).run();
}

}  // namespace vcharge
