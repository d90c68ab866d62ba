// The steps of the calibration from a recorded drive (paper, section SLAM-based Extrinsic
// Calibration).
#include <cmath>
#include <utility>

#include "initialization/camera_motion.h"
#include "initialization/ground_normal.h"
#include "initialization/rig_initialization.h"
#include "matching/inter_camera_matching.h"
#include "rig/ground.h"
#include "rig/rig_adjustment.h"
#include "rig/rig_judgement.h"
#include "vcharge_calibration/rig/rig_calibrator.h"
#include "vcharge_reconstruction/landmarks/landmark_alignment.h"
#include "vcharge_reconstruction/reconstruction_steps.h"
#include "vcharge_reconstruction/stage_runner.h"

namespace vcharge {
namespace {

constexpr int kNumStages = 9, kNumLaterStages = 8;
/// Factor on the tolerance of ground landmarks before the first adjustment.
constexpr double kFirstGroundFactor = 4.0;
/// Factor on the cost tolerance of the last adjustment: the cost depends only weakly on the extrinsics.
constexpr double kFineToleranceFactor = 0.1;

class RigSteps {
 public:
  RigSteps(const RigCalibratorOptions& options, const KeyframeImages& all_images,
           const StageCallback& progress, ReconstructionState* state,
           std::optional<RigCalibrationState> earlier)
      : options_(options),
        all_images_(all_images),
        earlier_(std::move(earlier)),
        stages_(earlier_ ? kNumLaterStages : kNumStages, progress, &state->report),
        state_(state),
        data_(&state->data),
        series_(*state) {}

  RigCalibration run() {
    try {
      describeDrive(*state_, &result_);
      countTracked();
      addKnownCameras(*data_->rig, &priors_);
      if (earlier_) {
        stages_.run("new keyframes", [&] { goOn(); });
      } else {
        stages_.run("camera motions", [&] { initialize(); });
        stages_.run("first adjustment", [&] { adjustFirst(); });
      }
      stages_.run("loops", [&] { closeAllLoops(); });
      stages_.run("landmark search", [&] { searchAndAdjust(); });
      correctTimeOffset(series_, state_, &result_);
      priors_.odometry = estimateOdometryNoise(options_.adjustment.bundle, *data_);
      stages_.run("between cameras", [&] {
        result_.num_inter_camera_matches += matchBetweenCameras(options_.inter_camera, all_images_, data_,
                                                                static_cast<size_t>(first_of_new_));
      });
      stages_.run("last search", [&] {
        searchLandmarks(options_.search, data_, first_of_new_);
        if (!earlier_) {  // otherwise few observations are new
          adjust(options_.adjustment);
        }
        checkLoops(*data_, &state_->report.loop_edges);
      });
      stages_.run("landmark patches", [&] {
        result_.num_aligned_observations +=
            alignLandmarks(options_.landmark_alignment, all_images_, data_, first_of_new_);
        adjust(options_.adjustment);
      });
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

  /// Computes extrinsics from each camera's motions and the ground that it sees; keyframes from the odometer.
  void initialize() {
    std::vector<std::vector<MotionPair>> motions;
    for (size_t i = 0; i < data_->rig->cameras.size(); ++i) {
      motions.push_back(estimateCameraMotions(*data_, static_cast<int32_t>(i)));
    }
    std::shared_ptr<const CameraRig> rig;
    try {
      rig = estimateInitialRig(series_, options_.hand_eye, motions, state_, &result_);
    } catch (const NotCalibrated&) {
      findUpDirections(motions);
      throw;
    }
    for (size_t i = 1; i < data_->keyframes.size(); ++i) {
      const Keyframe& previous = data_->keyframes[i - 1];
      Keyframe& keyframe = data_->keyframes[i];
      keyframe.map_from_vehicle =
          previous.map_from_vehicle * (previous.odom_from_vehicle.inverse() * keyframe.odom_from_vehicle);
    }
    data_->rig = rig;
    triangulateTracks(options_.firstTriangulation(), data_);
    data_->rig = withCameraHeights(*data_);
  }

  /// Adds what was followed since the earlier calibration to its state.
  void goOn() {
    first_of_new_ = static_cast<int32_t>(earlier_->state.data.keyframes.size());
    extendReconstruction(*state_, &earlier_->state);
    *state_ = std::move(earlier_->state);
    const RigCalibration& before = earlier_->result;
    result_.time_offset_s = before.time_offset_s;
    result_.num_inter_camera_matches = before.num_inter_camera_matches;
    result_.num_aligned_observations = before.num_aligned_observations;
    result_.first_scene = before.first_scene;
    for (size_t i = 0; i < result_.cameras.size(); ++i) {
      result_.cameras[i].initial = before.cameras[i].initial;
    }
    if (result_.time_offset_s != 0.0) {
      series_.shift(result_.time_offset_s, state_);
    }
    triangulateTracks(options_.triangulation, data_);
  }

  /// Finds the vertical in each camera from the ground, which needs no turn.
  void findUpDirections(const std::vector<std::vector<MotionPair>>& motions) {
    for (size_t i = 0; i < motions.size(); ++i) {
      if (result_.cameras[i].initial.status == HandEyeStatus::kNoTurn) {
        result_.cameras[i].up_in_camera =
            findUpwards(*data_, static_cast<int32_t>(i), motions[i], options_.triangulation)
                .value_or(Eigen::Vector3d::Zero());
      }
    }
  }

  void adjust(const RigAdjustmentOptions& options) {
    recordAdjustment(adjustRig(options, priors_, data_), &state_->report);
  }

  void adjustFirst() {
    RigAdjustmentOptions lenient = options_.adjustment;
    lenient.refine_intrinsics = false;  // the first landmarks are not good enough
    lenient.bundle.outlier_sigmas = INFINITY;
    lenient.max_ground_distance_m *= kFirstGroundFactor;
    triangulateTracks(options_.firstTriangulation(), data_);
    result_.first_scene = std::make_shared<const RigScene>(makeRigScene(*data_));
    adjust(lenient);
    lenient.bundle.outlier_sigmas = options_.adjustment.bundle.outlier_sigmas;
    triangulateTracks(options_.triangulation, data_);
    correctTimeOffset(series_, state_, &result_);
    adjust(lenient);
  }

  void closeAllLoops() {
    findAndCloseLoops(
        options_, [&](double fraction) { stages_.tell("loops", fraction); }, state_, first_of_new_);
    adjust(options_.adjustment);
  }

  void searchAndAdjust() {
    searchLandmarks(options_.search, data_, first_of_new_);
    adjust(options_.adjustment);
  }

  void adjustFinely() {
    RigAdjustmentOptions fine = options_.adjustment;
    fine.bundle.cost_tolerance *= kFineToleranceFactor;
    adjust(fine);
  }

  const RigCalibratorOptions& options_;
  const KeyframeImages& all_images_;
  std::optional<RigCalibrationState> earlier_;
  int32_t first_of_new_ = 0;  // keyframe from which on matches are searched
  StageRunner stages_;
  ReconstructionState* const state_;
  ReconstructionData* const data_;
  const OdometrySeries series_;
  RigPriors priors_;
  RigCalibration result_;
};

}  // namespace

RigCalibration calibrateFollowedDrive(const RigCalibratorOptions& options, const KeyframeImages& all_images,
                                      const StageCallback& progress, ReconstructionState* state,
                                      std::optional<RigCalibrationState> earlier) {
  return RigSteps(options, all_images, progress, state, std::move(earlier)).run();
}

}  // namespace vcharge
