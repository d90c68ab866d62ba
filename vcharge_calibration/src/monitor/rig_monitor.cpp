#include "vcharge_calibration/monitor/rig_monitor.h"

#include <algorithm>
#include <optional>
#include <utility>

#include <opencv2/core.hpp>

#include "monitor/camera_sight.h"
#include "monitor/lens_dirt.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/motion/pose_step.h"
#include "vcharge_reconstruction/frame_follower.h"

namespace vcharge {

namespace {

/// Length of the parts of a drive: long enough to show rotations well, and two are 20 m after a knock.
constexpr double kPart_m = 10.0;
/// A camera that sees little for a shorter distance passes something without texture.
constexpr double kMinDim_m = 25.0;
/// Spots on a lens that hide this part of the ground are dirt if they are there after so many parts. On
/// simulated drives with clean lenses it is below 0.0001.
constexpr double kDirt = 0.005;
constexpr int kDirtyParts = 2;

const CameraRig& withExtrinsics(const std::shared_ptr<const CameraRig>& rig) {
  check(rig != nullptr, "RigMonitor: expected a rig");
  if (!rig->hasExtrinsics()) {
    throw InputError("rig: expected vehicle_from_camera of every camera, which extrinsic calibration gives");
  }
  return *rig;
}

}  // namespace

struct RigMonitor::Drive {
  ReconstructionState state;
  KeyframeImages images = KeyframeImages::ofAllKeyframes();
  std::vector<double> level_sums;  ///< of the keyframes' images, by camera
  std::vector<double> dirt;        ///< of the lenses at the end, by camera
  FrameFollower follower;

  Drive(const RigCalibratorOptions& options, const std::shared_ptr<const CameraRig>& rig,
        std::vector<LensDirt>* lenses)
      : state(stateOf(rig)),
        level_sums(rig->cameras.size(), 0.0),
        follower(options, std::nullopt, &state,
                 [this, lenses](int32_t keyframe, const std::vector<Image>& pictures) {
                   images.add(keyframe, pictures);
                   const RigidTransform& pose =
                       state.data.keyframes[static_cast<size_t>(keyframe)].odom_from_vehicle;
                   for (size_t i = 0; i < pictures.size(); ++i) {
                     if (!pictures[i].pixels.empty()) {
                       level_sums[i] += cv::mean(pictures[i].pixels)[0];
                       (*lenses)[i].add(pictures[i].pixels, pose);
                     }
                   }
                 }) {}

  static ReconstructionState stateOf(const std::shared_ptr<const CameraRig>& rig) {
    ReconstructionState state;
    state.data.rig = rig;
    return state;
  }

  double length_m() const {
    return state.data.keyframes.empty() ? 0.0 : state.data.keyframes.back().travelled_m;
  }
};

RigMonitor::RigMonitor(std::shared_ptr<const CameraRig> rig, const RigCalibratorOptions& calibration,
                       const RigMonitorOptions& options, PartCallback on_part)
    : rig_(std::move(rig)),
      calibration_(calibration),
      options_(options),
      on_part_(std::move(on_part)),
      detector_(withExtrinsics(rig_), options_.false_alarms_per_km),
      sight_(std::make_unique<CameraSight>(rig_->cameras.size())),
      lenses_(rig_->cameras.begin(), rig_->cameras.end()),
      dim_m_(rig_->cameras.size(), 0.0),
      dirty_parts_(rig_->cameras.size(), 0) {
  calibration_.validate();
  options_.validate();
  startPart();
}

RigMonitor::~RigMonitor() = default;

void RigMonitor::startPart() {
  drive_ = std::make_unique<Drive>(calibration_, rig_, &lenses_);
}

void RigMonitor::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  drive_->follower.addImage(camera_index, stamp, image);
  endPartIfDue();
}

void RigMonitor::addOdometry(const VehicleOdometry& odometry) {
  drive_->follower.addOdometry(odometry);
  endPartIfDue();
}

void RigMonitor::flush() {
  drive_->follower.flush();
  endPart();
  startPart();
  waitForEndedPart();
}

void RigMonitor::endPartIfDue() {
  if (drive_->length_m() >= kPart_m) {
    endPart();
    startPart();
  }
}

void RigMonitor::endPart() {
  if (drive_->state.data.keyframes.empty()) {
    return;
  }
  for (const LensDirt& lens : lenses_) {
    drive_->dirt.push_back(lens.part());
  }
  waitForEndedPart();
  ended_ = std::move(drive_);
  adjustment_ = std::async(std::launch::async, [this] { adjustEndedPart(); });
}

void RigMonitor::waitForEndedPart() {
  if (adjustment_.valid()) {
    adjustment_.get();
  }
}

void RigMonitor::adjustEndedPart() {
  const auto num_keyframes = static_cast<double>(ended_->state.data.keyframes.size());
  RigDeviation deviation = estimateDeviation(calibration_, ended_->images, std::move(ended_->state.data));
  MonitoredPart part;
  part.begin_m = travelled_m();
  part.end_m = part.begin_m + deviation.end_m;
  part.end = deviation.end;
  deviation.begin_m = part.begin_m;
  deviation.end_m = part.end_m;
  std::vector<CameraSight::Seen> seen;
  for (size_t i = 0; i < rig_->cameras.size(); ++i) {
    seen.push_back({deviation.num_observations[i], ended_->level_sums[i] / num_keyframes});
  }
  part.dirt = ended_->dirt;
  part.sight = sight_->add(seen, part.end_m - part.begin_m);
  for (size_t i = 0; i < part.sight.size(); ++i) {
    const bool is_dim = part.sight[i] < kMinSight;
    dim_m_[i] = is_dim ? dim_m_[i] + part.end_m - part.begin_m : 0.0;
    part.sees_little.push_back(dim_m_[i] >= kMinDim_m);
    if (is_dim) {
      forgetCamera(i, &deviation);
    }
    dirty_parts_[i] = ended_->dirt[i] >= kDirt ? dirty_parts_[i] + 1 : 0;
    part.is_dirty.push_back(dirty_parts_[i] >= kDirtyParts);
  }
  pitch_ += deviation.pitch;
  part.change = detector_.add(deviation);
  part.deviation = detector_.deviation();
  part.sigmas = detector_.covariance().diagonal().cwiseSqrt();
  parts_.push_back(part);
  ended_.reset();
  if (on_part_) {
    on_part_(part);
  }
}

void RigMonitor::adopt(std::shared_ptr<const CameraRig> rig) {
  const CameraRig& next = withExtrinsics(rig);
  if (!haveSameImages(next, *rig_)) {
    throw InputError("rig: expected the cameras and image sizes of the rig before");
  }
  RigAdoption adoption;
  adoption.at_m = travelled_m();
  Eigen::VectorXd deviation = Eigen::VectorXd::Zero(RigDeviation::rowOf(next.cameras.size()));
  for (size_t i = 0; i < next.cameras.size(); ++i) {
    const Eigen::Matrix<double, 6, 1> step =
        stepBetween(*rig_->cameras[i].vehicle_from_camera, *next.cameras[i].vehicle_from_camera);
    deviation.segment<6>(RigDeviation::rowOf(i)) = step;
    if (!step.isZero(0.0)) {
      adoption.cameras.push_back(i);
    }
  }
  detector_.countFrom(deviation);
  adoptions_.push_back(adoption);
  rig_ = std::move(rig);
  startPart();
}

std::vector<RigChange> RigMonitor::openChanges() const {
  std::vector<RigChange> open;
  for (const RigChange& change : changes()) {
    const bool is_accounted_for =
        change.part == RigPart::kCamera &&
        std::any_of(adoptions_.begin(), adoptions_.end(), [&](const RigAdoption& adoption) {
          return adoption.at_m >= change.found_m &&
                 std::count(adoption.cameras.begin(), adoption.cameras.end(), change.camera) > 0;
        });
    if (!is_accounted_for) {
      open.push_back(change);
    }
  }
  return open;
}

std::vector<RigChange> RigMonitor::changes() const {
  std::vector<RigChange> changes;
  for (const MonitoredPart& part : parts_) {
    if (part.change) {
      changes.push_back(*part.change);
    }
  }
  return changes;
}

}  // namespace vcharge
