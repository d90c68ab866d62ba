#pragma once

#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/rig/rig_adjustment_options.h"
#include "vcharge_reconstruction/adjustment/odometry_noise.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

/// Length of parts of a drive whose errors are independent.
constexpr double kIndependent_m = 10.0;

/// Prior knowledge in addition to the images.
struct RigPriors {
  OdometryNoise odometry;
  /// For landmarks of a finished map: information on each track's position, 1/m^2 along the map's axes. They
  /// fix the map's frame, and all keyframes are free. Empty: the landmarks are unknown, and the first
  /// keyframe defines the map's frame.
  std::vector<Eigen::Matrix3d> landmark_information;
  /// Standard deviation of the cameras' mean height from its initial value; 0: no prior.
  double height_sigma_m = 0.0;
  /// Extrinsics known before, and the information on [dt, dphi] of each camera; empty: none.
  std::vector<RigidTransform> vehicle_from_camera;
  Eigen::MatrixXd extrinsics_information;

  /// Models known before, with the deviations of the cameras' images that their calibration states (0: none),
  /// and those that heat or a lens focused again may add. Empty: the rig's models are certain.
  std::vector<CameraModel> models;
  std::vector<ImageDeviation> stated_image_sigmas, possible_image_sigmas;
  std::vector<ImageTiming> timings;  ///< known before

  /// All ground counts, and not only where its height is precise: the cameras seem tilted by some hundredths
  /// of a degree, but a short part of a drive shows at all how the body stands.
  bool uses_all_ground = false;

  bool hasMap() const { return !landmark_information.empty(); }
};
/// Takes the models and the timing of a rig's cameras as known.
void addKnownCameras(const CameraRig& rig, RigPriors* priors);
/// How the images of a camera deviate from those of a model of the same kind.
ImageDeviation imageDeviation(const CameraModel& camera, const CameraModel& known);

/// Adjusts extrinsics, intrinsics and timing where the options and the priors say so, keyframes, landmarks
/// and the odometer's factors together (paper, equation joint_opt), and removes outliers; landmarks of a
/// finished map keep their positions. Landmarks on the ground fix heights and tilt, which planar motion
/// hardly determines.
BundleAdjustmentSummary adjustRig(const RigAdjustmentOptions& options, const RigPriors& priors,
                                  ReconstructionData* data);

/// Uncertainty of the adjusted extrinsics: rows and columns [dt, dphi] of each camera.
struct RigUncertainty {
  bool is_valid = false;
  Eigen::MatrixXd covariance;     ///< marginal, for independent errors
  Eigen::MatrixXd jackknife;      ///< estimated by leaving out parts of the drive
  Eigen::MatrixXd with_odometer;  ///< covariance that begins with the odometer's factors, distance and turn
  Eigen::MatrixXd by_intrinsics;  ///< by the stated deviations of intrinsics that were not adjusted
  // How the images deviate from the rig's models, three rows of each camera, if an adjustment of the
  // intrinsics went one step, with the covariances. Empty if intrinsics are certain.
  Eigen::VectorXd image_deviations;
  Eigen::MatrixXd image_covariance, image_jackknife;
};
RigUncertainty rigUncertainty(const RigAdjustmentOptions& options, const RigPriors& priors,
                              const ReconstructionData& data);

/// How the cameras' timing deviates from the rig's after one step of an adjustment of it, two rows of each
/// camera, with covariances as in RigUncertainty. Empty if the timing is not observable.
struct TimingUncertainty {
  Eigen::VectorXd deviations;
  Eigen::MatrixXd covariance, jackknife;
};
TimingUncertainty timingUncertainty(const RigAdjustmentOptions& options, const RigPriors& priors,
                                    const ReconstructionData& data);

}  // namespace vcharge
