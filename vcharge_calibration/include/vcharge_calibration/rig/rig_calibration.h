#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"
#include "vcharge_calibration/rig/rig_scene.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Calibration of one camera.
struct CameraCalibration {
  std::string name;
  HandEye initial;  ///< from the motions of this camera alone
  /// Up in the camera's frame by the ground, for a drive without turns; zero: unknown.
  Eigen::Vector3d up_in_camera = Eigen::Vector3d::Zero();
  /// Covariance of vehicle_from_camera, [dt, dphi] in the vehicle's frame, for a fixed scale.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  /// Ratio of the deviations by a jackknife over the drive to those for independent errors; 1 or more.
  Eigen::Matrix<double, 6, 1> inflation = Eigen::Matrix<double, 6, 1>::Ones();
  /// Difference between the extrinsics from the odd and the even parts of the drive.
  Eigen::Matrix<double, 6, 1> half_difference = Eigen::Matrix<double, 6, 1>::Zero();
  int64_t num_tracked = 0;           ///< observations of tracks over three keyframes or more
  int64_t num_observations = 0;      ///< observations of adjusted landmarks
  int64_t num_shared_landmarks = 0;  ///< landmarks that another camera observes too
  double rms_px = 0.0;               ///< per coordinate
  double structure_px = 0.0;         ///< RMS over the image of the mean error of each cell
  std::string weakest_direction;     ///< least certain degree of freedom, as text
};

/// Extrinsics of a rig from a drive, or the reasons of a failure.
struct RigCalibration {
  Verdict verdict = Verdict::kFail;
  std::vector<std::string> remarks;      ///< reasons, and the missing manoeuvre
  std::shared_ptr<const CameraRig> rig;  ///< with covariances; null for kFail
  std::vector<CameraCalibration> cameras;
  double distance_m = 0.0;
  double left_turn_rad = 0.0, right_turn_rad = 0.0;  ///< both positive
  int num_keyframes = 0;
  int64_t num_landmarks = 0;
  int num_loop_edges = 0;                ///< accepted
  int64_t num_aligned_observations = 0;  ///< aligned with the patch of their landmark
  int64_t num_inter_camera_matches = 0;  ///< in rectified views of neighbouring cameras
  double rms_px = 0.0;
  double odometer_turn_scale = 1.0;
  double time_offset_s = 0.0;        ///< delay of the odometer's stamps, corrected
  double time_offset_sigma_s = 0.0;  ///< 0: unknown
  std::string height_source;
  /// The first guess, before any adjustment; null without one.
  std::shared_ptr<const RigScene> first_scene;
  bool is_from_map = false;  ///< the landmarks are those of a finished map, which defines the scale
};

}  // namespace vcharge
