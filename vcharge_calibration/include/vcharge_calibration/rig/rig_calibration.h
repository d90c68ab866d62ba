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

/// What is known of one camera.
struct CameraCalibration {
  std::string name;
  HandEye initial;  ///< from the camera's own motions alone
  /// Upwards in the camera's frame by the ground that it saw, where there was no turn; zero: not known.
  Eigen::Vector3d up_in_camera = Eigen::Vector3d::Zero();
  /// Of vehicle_from_camera, [dt, dphi] in the vehicle's frame; beside the common scale, which is the
  /// odometer's.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  /// By how much a jackknife over the drive found each degree of freedom less certain than independent errors
  /// would leave it; 1 or more.
  Eigen::Matrix<double, 6, 1> inflation = Eigen::Matrix<double, 6, 1>::Ones();
  /// Between the extrinsics from the odd and from the even parts of the drive.
  Eigen::Matrix<double, 6, 1> half_difference = Eigen::Matrix<double, 6, 1>::Zero();
  int64_t num_tracked = 0;       ///< observations of points that were followed over three keyframes or more
  int64_t num_observations = 0;  ///< of these, and found later, that fit in the end
  int64_t num_shared_landmarks = 0;  ///< that another camera sees too
  double rms_px = 0.0;               ///< per coordinate
  double structure_px = 0.0;         ///< RMS over the image of what neighbouring errors have in common
  std::string weakest_direction;     ///< in words
};

/// A rig's extrinsics from a drive, or why there are none.
struct RigCalibration {
  Verdict verdict = Verdict::kFail;
  std::vector<std::string> remarks;      ///< reasons, and the manoeuvre that is missing
  std::shared_ptr<const CameraRig> rig;  ///< with covariances; null for kFail
  std::vector<CameraCalibration> cameras;
  double distance_m = 0.0;
  double left_turn_rad = 0.0, right_turn_rad = 0.0;  ///< both positive
  int num_keyframes = 0;
  int64_t num_landmarks = 0;
  int num_loop_edges = 0;                ///< accepted
  int64_t num_aligned_observations = 0;  ///< that were aligned with the patch of their landmark
  int64_t num_inter_camera_matches = 0;  ///< of landmarks found in rectified views of a neighbouring camera
  double rms_px = 0.0;
  double odometer_turn_scale = 1.0;
  double time_offset_s = 0.0;        ///< by which the odometer's stamps are late, which was corrected for
  double time_offset_sigma_s = 0.0;  ///< 0: not known
  std::string height_source;
  /// By the first guess, before anything was adjusted: null where there was none.
  std::shared_ptr<const RigScene> first_scene;
  bool is_from_map = false;  ///< the landmarks were those of a finished map, which is the measure of lengths
};

}  // namespace vcharge
