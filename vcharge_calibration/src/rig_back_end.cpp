#include "rig_back_end.h"

#include <algorithm>
#include <cmath>

#include "camera_motion.h"
#include "ground.h"
#include "rig_adjustment.h"
#include "rig_judgement.h"
#include "vcharge_core/stage_timer.h"
#include "vcharge_core/text_format.h"

namespace vcharge {
namespace {

/// The first guess of the ground is wrong by so many times more.
constexpr double kFirstGround = 4.0;

/// Of the keyframes, at which a camera must see how it moves.
constexpr double kMinSeenShare = 0.2;

/// Thrown where nothing can be calibrated, with the verdict's reason.
struct NotCalibrated {
  std::vector<std::string> remarks;
};

class RigBackEnd {
 public:
  RigBackEnd(const RigCalibratorOptions& options, const StageCallback& progress, MappingState* state)
      : options_(options), progress_(progress), state_(state), data_(&state->data) {}

  RigCalibration run() {
    try {
      describeDrive();
      stage("camera motions", 1, [&] { initialize(); });
      stage("first adjustment", 2, [&] { adjustFirst(); });
      stage("loops", 3, [&] { closeAllLoops(); });
      stage("landmark search", 4, [&] {
        searchLandmarks(options_.search, data_);
        adjust(options_);
      });
      odometry_ = estimateOdometryNoise(options_, *data_);
      stage("last adjustment", 5, [&] {
        searchLandmarks(options_.search, data_);
        adjust(options_);
        checkLoops(options_.loops, *data_, &state_->report.loop_edges);
        adjustFinely();
      });
      stage("judgement", 6, [&] { judgeRig(options_, odometry_, *state_, &result_); });
    } catch (const NotCalibrated& failure) {
      result_.verdict = Verdict::kFail;
      result_.remarks = failure.remarks;
    }
    return std::move(result_);
  }

 private:
  template <class Work>
  void stage(const char* name, int number, const Work& work) {
    constexpr int kNumStages = 6;
    progress_({name, number, kNumStages, 0.0});
    {
      const StageTimer timer(name, &state_->report.stage_s);
      work();
    }
    progress_({name, number, kNumStages, 1.0});
  }

  void describeDrive() {
    for (const RigCamera& camera : data_->rig->cameras) {
      result_.cameras.emplace_back();
      result_.cameras.back().name = camera.name;
    }
    for (const Track& track : data_->tracks) {
      if (track.observations.size() >= 3) {
        result_.cameras[track.observations.front().camera].num_tracked +=
            static_cast<int64_t>(track.observations.size());
      }
    }
    const std::vector<Keyframe>& keyframes = data_->keyframes;
    result_.num_keyframes = static_cast<int>(keyframes.size());
    for (size_t i = 1; i < keyframes.size(); ++i) {
      const RigidTransform motion =
          keyframes[i - 1].odom_from_vehicle.inverse() * keyframes[i].odom_from_vehicle;
      const double turn_rad = yawOfRotation(motion.rotation());
      (turn_rad > 0.0 ? result_.left_turn_rad : result_.right_turn_rad) += std::abs(turn_rad);
    }
    if (!keyframes.empty()) {
      result_.distance_m = keyframes.back().travelled_m;
    }
    const SparseMapperReport& report = state_->report;
    if (report.num_frames == 0) {
      throw NotCalibrated{{"no images came with the drive"}};
    }
    if (2 * report.num_frames_without_odometry > report.num_frames) {
      throw NotCalibrated{
          {"most images have no odometry at their time: are the clocks of cameras and odometer the "
           "same?"}};
    }
    if (result_.distance_m < 5.0) {
      throw NotCalibrated{{"the vehicle stood: by the odometer it moved " + toText(result_.distance_m, 1) +
                           " m. Drive 100 m or more, with turns to both sides"}};
    }
  }

  void initialize() {
    auto rig = std::make_shared<CameraRig>(*data_->rig);
    std::vector<std::string> failures;
    std::vector<std::vector<MotionPair>> motions;
    std::vector<Eigen::Vector3d> up_in_camera;
    for (size_t i = 0; i < rig->cameras.size(); ++i) {
      HandEye& initial = result_.cameras[i].initial;
      motions.push_back(estimateCameraMotions(*data_, static_cast<int32_t>(i), options_.camera_motion));
      initial = solvePlanarHandEye(motions.back(), options_.hand_eye);
      if (kMinSeenShare * static_cast<double>(data_->keyframes.size()) >
          static_cast<double>(motions.back().size())) {
        initial.status = HandEyeStatus::kTooFewMotions;
      }
      up_in_camera.emplace_back(initial.vehicle_from_camera.rotation().conjugate() *
                                Eigen::Vector3d::UnitZ());
      if (initial.status != HandEyeStatus::kOk) {
        failures.push_back(describeFailure(rig->cameras[i].name, initial, result_));
      }
      rig->cameras[i].vehicle_from_camera = initial.vehicle_from_camera;
    }
    if (!failures.empty()) {
      throw NotCalibrated{failures};
    }
    const std::string wrong_sign = findWrongSign(*rig);
    if (!wrong_sign.empty()) {
      throw NotCalibrated{{wrong_sign}};
    }
    const TimeOffset offset = estimateTimeOffset(*state_, motions, up_in_camera);
    if (std::abs(offset.offset_s) > 3.0 * offset.sigma_s) {
      result_.time_offset_s = offset.offset_s;
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

  TriangulationOptions firstTriangulation() const {
    TriangulationOptions lenient = options_.triangulation;
    lenient.max_error_rad = options_.first_max_error_rad;
    return lenient;
  }

  void adjust(const RigCalibratorOptions& options) {
    const BundleAdjustmentSummary summary = adjustRig(options, odometry_, data_);
    state_->report.num_observations = summary.num_observations;
    state_->report.rms_px = summary.rms_px;
  }

  void adjustFirst() {
    RigCalibratorOptions lenient = options_;
    lenient.bundle.outlier_sigmas = INFINITY;
    lenient.max_ground_distance_m *= kFirstGround;
    triangulateTracks(firstTriangulation(), data_);
    adjust(lenient);
    lenient.bundle.outlier_sigmas = options_.bundle.outlier_sigmas;
    triangulateTracks(options_.triangulation, data_);
    adjust(lenient);
  }

  void closeAllLoops() {
    state_->vocabulary = trainVocabulary(options_.loops, *data_);
    state_->report.loop_edges = findLoops(options_.loops, state_->vocabulary, *data_, [&](double fraction) {
      progress_({"loops", 3, 6, fraction});
    });
    closeLoops(options_.loops, &state_->report.loop_edges, data_);
    triangulateTracks(options_.triangulation, data_);
    adjust(options_);
  }

  /// Extrinsics are a weak direction of the cost: the last iterations go further than a map needs.
  void adjustFinely() {
    RigCalibratorOptions fine = options_;
    fine.bundle.cost_tolerance *= 0.01;
    adjust(fine);
  }

  const RigCalibratorOptions& options_;
  const StageCallback& progress_;
  MappingState* const state_;
  MappingData* const data_;
  OdometryNoise odometry_;
  RigCalibration result_;
};

}  // namespace

RigCalibration runRigBackEnd(const RigCalibratorOptions& options, const StageCallback& progress,
                             MappingState* state) {
  return RigBackEnd(options, progress, state).run();
}

}  // namespace vcharge
