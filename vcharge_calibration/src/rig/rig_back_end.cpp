#include "rig/rig_back_end.h"

#include <algorithm>
#include <cmath>

#include "initialization/camera_motion.h"
#include "initialization/ground_normal.h"
#include "initialization/rig_initialization.h"
#include "matching/inter_camera_matching.h"
#include "matching/landmark_alignment.h"
#include "rig/ground.h"
#include "rig/rig_adjustment.h"
#include "rig/rig_judgement.h"
#include "vcharge_reconstruction/stage_runner.h"
#include "vcharge_core/base/text_format.h"

namespace vcharge {
namespace {

/// The first guess of the ground is wrong by so many times more.
constexpr double kFirstGround = 4.0;

class RigBackEnd {
 public:
  RigBackEnd(const RigCalibratorOptions& options, const KeyframeImages& all_images,
             const StageCallback& progress, MappingState* state)
      : options_(options),
        all_images_(all_images),
        stages_(7 + (options.inter_camera.enabled ? 1 : 0) + (options.landmark_alignment.enabled ? 1 : 0),
                progress, &state->report),
        state_(state),
        data_(&state->data),
        series_(*state) {}

  RigCalibration run() {
    try {
      describeDrive(*state_, &result_);
      countTracked();
      stages_.run("camera motions", [&] { initialize(); });
      stages_.run("first adjustment", [&] { adjustFirst(); });
      stages_.run("loops", [&] { closeAllLoops(); });
      stages_.run("landmark search", [&] {
        searchLandmarks(options_.search, data_);
        adjust(options_.adjustment);
      });
      correctTimeOffset(series_, state_, &result_);
      priors_.odometry = estimateOdometryNoise(options_.adjustment, *data_);
      if (options_.inter_camera.enabled) {
        stages_.run("between cameras", [&] {
          result_.num_inter_camera_matches = matchBetweenCameras(options_.inter_camera, all_images_, data_);
        });
      }
      stages_.run("last search", [&] {
        searchLandmarks(options_.search, data_);
        adjust(options_.adjustment);
        checkLoops(options_.loops, *data_, &state_->report.loop_edges);
      });
      if (options_.landmark_alignment.enabled) {
        stages_.run("landmark patches", [&] {
          result_.num_aligned_observations = alignLandmarks(options_.landmark_alignment, all_images_, data_);
          adjust(options_.adjustment);
        });
      }
      stages_.run("last adjustment", [&] { adjustFinely(); });
      stages_.run("judgement", [&] { judgeRig(options_.adjustment, priors_, *state_, &result_); });
    } catch (const NotCalibrated& failure) {
      result_.verdict = Verdict::kFail;
      result_.remarks = failure.remarks;
    }
    return std::move(result_);
  }

 private:
  void countTracked() {
    for (const Track& track : data_->tracks) {
      if (track.observations.size() >= 3) {
        result_.cameras[track.observations.front().camera].num_tracked +=
            static_cast<int64_t>(track.observations.size());
      }
    }
  }

  void initialize() {
    std::vector<std::vector<MotionPair>> motions;
    for (size_t i = 0; i < data_->rig->cameras.size(); ++i) {
      motions.push_back(estimateCameraMotions(*data_, static_cast<int32_t>(i), options_.camera_motion));
    }
    std::shared_ptr<const CameraRig> rig;
    try {
      rig = guessRig(series_, options_.hand_eye, motions, state_, &result_);
    } catch (const NotCalibrated&) {
      tellWhatIsKnown(motions);
      throw;
    }
    for (size_t i = 1; i < data_->keyframes.size(); ++i) {
      const Keyframe& previous = data_->keyframes[i - 1];
      Keyframe& keyframe = data_->keyframes[i];
      keyframe.map_from_vehicle =
          previous.map_from_vehicle * (previous.odom_from_vehicle.inverse() * keyframe.odom_from_vehicle);
    }
    data_->rig = rig;
    // With rays from height zero each camera's points lie below it as far as the ground is.
    triangulateTracks(firstTriangulation(), data_);
    std::vector<double> heights_m;
    std::vector<std::optional<double>> height_of_camera;
    for (size_t i = 0; i < rig->cameras.size(); ++i) {
      height_of_camera.push_back(findCameraHeight(*data_, static_cast<int32_t>(i)));
      if (height_of_camera.back()) {
        heights_m.push_back(*height_of_camera.back());
      }
    }
    if (heights_m.empty()) {
      throw NotCalibrated{
          {"no camera sees the ground near the vehicle: the cameras' heights cannot be told"}};
    }
    std::sort(heights_m.begin(), heights_m.end());
    auto raised = std::make_shared<CameraRig>(*rig);
    for (size_t i = 0; i < rig->cameras.size(); ++i) {
      const RigidTransform& level = *rig->cameras[i].vehicle_from_camera;
      Eigen::Vector3d place_m = level.translation();
      place_m.z() = height_of_camera[i].value_or(heights_m[heights_m.size() / 2]);
      raised->cameras[i].vehicle_from_camera = RigidTransform(level.rotation(), place_m);
    }
    data_->rig = raised;
  }

  /// Without a turn the ground still tells which way is up.
  void tellWhatIsKnown(const std::vector<std::vector<MotionPair>>& motions) {
    for (size_t i = 0; i < motions.size(); ++i) {
      if (result_.cameras[i].initial.status == HandEyeStatus::kNoTurn) {
        result_.cameras[i].up_in_camera =
            findUpwards(*data_, static_cast<int32_t>(i), motions[i], options_.triangulation)
                .value_or(Eigen::Vector3d::Zero());
      }
    }
  }

  TriangulationOptions firstTriangulation() const {
    TriangulationOptions lenient = options_.triangulation;
    lenient.max_error_rad = options_.first_max_error_rad;
    return lenient;
  }

  void adjust(const RigAdjustmentOptions& options) {
    const BundleAdjustmentSummary summary = adjustRig(options, priors_, data_);
    state_->report.num_observations = summary.num_observations;
    state_->report.rms_px = summary.rms_px;
  }

  void adjustFirst() {
    RigAdjustmentOptions lenient = options_.adjustment;
    lenient.bundle.outlier_sigmas = INFINITY;
    lenient.max_ground_distance_m *= kFirstGround;
    triangulateTracks(firstTriangulation(), data_);
    result_.first_scene = std::make_shared<const RigScene>(makeRigScene(*data_));
    adjust(lenient);
    lenient.bundle.outlier_sigmas = options_.adjustment.bundle.outlier_sigmas;
    triangulateTracks(options_.triangulation, data_);
    correctTimeOffset(series_, state_, &result_);
    adjust(lenient);
  }

  void closeAllLoops() {
    state_->vocabulary = trainVocabulary(options_.loops, *data_);
    state_->report.loop_edges = findLoops(options_.loops, state_->vocabulary, *data_,
                                          [&](double fraction) { stages_.tell("loops", fraction); });
    closeLoops(options_.loops, &state_->report.loop_edges, data_);
    triangulateTracks(options_.triangulation, data_);
    adjust(options_.adjustment);
  }

  /// Extrinsics are a weak direction of the cost: the last iterations go further than a map needs.
  void adjustFinely() {
    RigAdjustmentOptions fine = options_.adjustment;
    fine.bundle.cost_tolerance *= 0.01;
    adjust(fine);
  }

  const RigCalibratorOptions& options_;
  const KeyframeImages& all_images_;
  StageRunner stages_;
  MappingState* const state_;
  MappingData* const data_;
  const OdometrySeries series_;
  RigPriors priors_;
  RigCalibration result_;
};

}  // namespace

RigCalibration runRigBackEnd(const RigCalibratorOptions& options, const KeyframeImages& all_images,
                             const StageCallback& progress, MappingState* state) {
  return RigBackEnd(options, all_images, progress, state).run();
}

}  // namespace vcharge
