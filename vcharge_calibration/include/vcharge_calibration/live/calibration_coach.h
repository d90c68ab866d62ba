#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Options of CalibrationCoach: requirements on a drive.
struct CalibrationCoachOptions {
  VCHARGE_BEGIN_OPTIONS(CalibrationCoachOptions);
  VCHARGE_OPTION(double, enough_distance_m, 100.0, positive(), "Sufficient distance.");
  VCHARGE_OPTION(double, enough_turn_rad, 2.1, positive(), "Sufficient sum of turns to each side.");
  VCHARGE_OPTION(double, enough_revisited_m, 10.0, notNegative(), "Sufficient distance along earlier parts.");
  VCHARGE_OPTION(double, enough_sigma_m, 0.08, positive(), "Sufficient deviation of positions by hand-eye.");
  VCHARGE_OPTION(double, enough_sigma_rad, 0.008, positive(),
                 "Sufficient deviation of rotations by hand-eye.");
  VCHARGE_OPTION(int, min_steps, 20, atLeast(1), "Keyframes before a camera counts as blind.");
  VCHARGE_END_OPTIONS();
};

/// Expected calibration of one camera from the drive so far.
struct CameraOutlook {
  std::string name;
  HandEye hand_eye;
  /// Predicted standard deviations of vehicle_from_camera, [dt, dphi] in the vehicle's frame (m, rad), by
  /// hand-eye calibration: an upper bound for the joint adjustment. NaN for the height, which hand-eye does
  /// not observe, and for all components while unknown.
  Eigen::Matrix<double, 6, 1> sigma;
  bool is_enough = false;
};

/// Progress of a drive, and the next manoeuvre.
struct DriveOutlook {
  double distance_m = 0.0;
  double left_turn_rad = 0.0, right_turn_rad = 0.0;  ///< both positive
  double revisited_m = 0.0;                          ///< distance driven near earlier parts of the drive
  std::vector<CameraOutlook> cameras;
  /// Smallest fulfilled fraction of the requirements, 0 to 1.
  double progress = 0.0;
  std::vector<std::string> missing;  ///< one line each; the first equals `next`
  std::string next;                  ///< advice for the driver: a manoeuvre, or that the drive suffices
  bool isEnough() const { return missing.empty(); }
};

/// Finds during a drive what the calibration of a rig still needs: turns to both sides, distance, revisits,
/// and motions that fix the extrinsics of every camera. Standard deviations are those of planar hand-eye
/// calibration from the motions so far: the larger of its formula and of a jackknife over parts of the drive,
/// since errors of neighbouring motions correlate. outlook() takes some ten milliseconds.
class CalibrationCoach {
 public:
  /// std::invalid_argument for bad options.
  CalibrationCoach(const std::vector<std::string>& camera_names, const HandEyeOptions& hand_eye,
                   const CalibrationCoachOptions& options);

  /// Adds the next keyframe; `travelled_m` is the distance since the start of the drive.
  void addKeyframe(const RigidTransform& odom_from_vehicle, double travelled_m);
  /// Adds a motion of a camera; MotionPair::keyframe is the index of its first keyframe.
  void addMotion(size_t camera, const MotionPair& motion);

  size_t numKeyframes() const { return visited_.size(); }
  /// Computed from all keyframes and motions.
  DriveOutlook outlook() const;

 private:
  struct VisitedPose {
    RigidTransform odom_from_vehicle;
    double travelled_m = 0.0;
    bool is_revisited = false;
  };
  CameraOutlook cameraOutlook(size_t camera) const;
  double weakness(const CameraOutlook& camera, int* degree_of_freedom) const;
  void judgeSigmas(DriveOutlook* outlook, std::vector<double>* fulfilled) const;
  void judge(DriveOutlook* outlook) const;

  const std::vector<std::string> names_;
  HandEyeOptions hand_eye_;
  const CalibrationCoachOptions options_;
  std::vector<VisitedPose> visited_;
  std::vector<std::vector<MotionPair>> motions_;  // motions of each camera
  double left_turn_rad_ = 0.0, right_turn_rad_ = 0.0, revisited_m_ = 0.0;
};

}  // namespace vcharge
