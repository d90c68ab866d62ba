#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"
#include "vcharge_calibration/rig/rig_scene.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_reconstruction/bundle_problem.h"

namespace vcharge {

/// How a camera's image deviates from that of its known model. The drive shows it where a sigma is well below
/// its prior.
struct IntrinsicsDeviation {
  ImageDeviation deviation, sigmas, prior_sigmas;
  bool is_corrected = false;  ///< the rig has the corrected model
};

/// When a camera exposes its images, as the rig says and as the drive shows.
struct TimingEstimate {
  ImageTiming known, found;
  TimingDeviation sigmas = TimingDeviation::Zero();
  bool is_corrected = false;  ///< the rig has the timing that was found

  /// Found minus known readout time, in the direction that the rig says, and clock offset.
  TimingDeviation deviation() const {
    return {found.readout_s - known.readout_s, found.clock_offset_s - known.clock_offset_s};
  }
};

/// Calibration of one camera.
struct CameraCalibration {
  std::string name;
  HandEye initial;  ///< hand-eye calibration from the motions of this camera alone
  /// Upward direction in the camera's frame from the ground, for a drive without turns; zero: unknown.
  Eigen::Vector3d up_in_camera = Eigen::Vector3d::Zero();
  /// Covariance of vehicle_from_camera, [dt, dphi] in the vehicle's frame, for a fixed scale.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  /// Ratio of the standard deviations, by a jackknife over the drive, to those for independent errors.
  Eigen::Matrix<double, 6, 1> inflation = Eigen::Matrix<double, 6, 1>::Ones();
  /// Difference between the extrinsics from the odd and the even parts of the drive.
  Eigen::Matrix<double, 6, 1> half_difference = Eigen::Matrix<double, 6, 1>::Zero();
  int64_t num_tracked = 0;           ///< observations in tracks of three keyframes or more
  int64_t num_observations = 0;      ///< observations of adjusted landmarks
  int64_t num_common_landmarks = 0;  ///< landmarks that another camera observes too
  double rms_px = 0.0;               ///< RMS error per coordinate
  double structure_px = 0.0;         ///< RMS over the image's cells of their mean error
  std::string weakest_direction;     ///< the least certain degree of freedom, as text
  std::optional<IntrinsicsDeviation> intrinsics;
  std::optional<TimingEstimate> timing;
};

/// Extrinsics of a rig from a drive, or the reasons of a failure.
struct RigCalibration {
  Verdict verdict = Verdict::kFail;
  std::vector<std::string> remarks;      ///< reasons of the verdict, and the missing manoeuvre
  std::shared_ptr<const CameraRig> rig;  ///< with covariances; null for kFail
  std::vector<CameraCalibration> cameras;
  double distance_m = 0.0;
  double left_turn_rad = 0.0, right_turn_rad = 0.0;  ///< both positive
  int num_keyframes = 0;
  int64_t num_landmarks = 0;
  int num_loop_edges = 0;                ///< number of accepted edges
  int64_t num_aligned_observations = 0;  ///< number of observations aligned with their landmark's patch
  int64_t num_inter_camera_matches = 0;  ///< matches in rectified views of neighbouring cameras
  double rms_px = 0.0;
  double odometer_turn_scale = 1.0;
  double time_offset_s = 0.0;        ///< delay of the odometer's stamps, which was corrected
  double time_offset_sigma_s = 0.0;  ///< 0: unknown
  std::string height_source;
  /// The initial rig and path before any adjustment; null if there is none.
  std::shared_ptr<const RigScene> first_scene;
  bool is_from_map = false;  ///< the landmarks are those of a finished map, which defines the scale
};

}  // namespace vcharge
