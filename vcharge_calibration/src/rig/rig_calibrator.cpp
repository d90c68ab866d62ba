#include "vcharge_calibration/rig/rig_calibrator.h"

#include "vcharge_core/base/error.h"
#include "vcharge_reconstruction/reconstruction_steps.h"

namespace vcharge {
namespace {

/// Largest angle between a ray and its point for the initial rig and poses.
constexpr double kFirstMaxError_rad = 0.03;

std::shared_ptr<const CameraRig> withoutExtrinsics(const CameraRig& rig) {
  auto result = std::make_shared<CameraRig>(rig);
  for (RigCamera& camera : result->cameras) {
    camera.vehicle_from_camera.reset();
    camera.covariance.reset();
  }
  return result;
}

}  // namespace

RigAdjustmentOptions RigCalibratorOptions::defaultAdjustment() {
  RigAdjustmentOptions options;
  options.bundle.odometer_scale_sigma = 1e-7;
  return options;
}

TriangulationOptions RigCalibratorOptions::firstTriangulation() const {
  TriangulationOptions lenient = triangulation;
  lenient.max_error_rad = kFirstMaxError_rad;
  return lenient;
}

RigCalibrator::RigCalibrator(const std::shared_ptr<const CameraRig>& rig, const RigCalibratorOptions& options)
    : options_(options) {
  options_.validate();
  check(rig != nullptr, "RigCalibrator: expected a rig");
  if (rig->cameras.empty()) {
    throw InputError("rig: expected a camera");
  }
  state_.data.rig = withoutExtrinsics(*rig);
  follower_ = std::make_unique<FrameFollower>(options_, std::nullopt, &state_,
                                              [this](int32_t keyframe, const std::vector<Image>& images) {
                                                images_.add(keyframe, images);
                                                all_images_.add(keyframe, images);
                                              });
}

RigCalibrator::~RigCalibrator() = default;

void RigCalibrator::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  follower_->addImage(camera_index, stamp, image);
}

void RigCalibrator::addOdometry(const VehicleOdometry& odometry) {
  follower_->addOdometry(odometry);
}

void RigCalibrator::flush() {
  follower_->flush();
}

RigCalibration RigCalibrator::finish(const StageCallback& progress) {
  flush();
  return calibrateFollowedDrive(options_, all_images_, progress, &state_);
}

std::shared_ptr<const SparseMap> RigCalibrator::map() const {
  return mapOfCalibration(options_, state_);
}

std::shared_ptr<const SparseMap> mapOfCalibration(const RigCalibratorOptions& options,
                                                  const ReconstructionState& state) {
  return assembleMap(state, options.features);
}

}  // namespace vcharge
