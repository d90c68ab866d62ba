#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Options of CalibrationCoach: what a drive needs before it is enough.
struct CalibrationCoachOptions {
  double enough_distance_m = 100.0;
  double enough_turn_rad = 2.1;      ///< to each side, in sum
  double enough_revisited_m = 10.0;  ///< of the way, near where the vehicle was before
  double revisit_radius_m = 4.0;     ///< that is near
  double revisit_gap_m = 25.0;       ///< driven since: otherwise it is the same passage
  // Of every camera's place by hand-eye alone, which the joint adjustment betters several times.
  double enough_sigma_m = 0.08;
  double enough_sigma_rad = 0.008;
  double min_seen_share = 0.3;  ///< of the steps, in which a camera must see how it moves
  int min_steps = 20;           ///< before a camera is said not to see
  double segment_m = 5.0;       ///< parts of the drive whose errors are independent of each other
  int num_groups = 10;          ///< of such parts, each left out once by the jackknife

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("enough_distance_m", enough_distance_m);
    visit("enough_turn_rad", enough_turn_rad);
    visit("enough_revisited_m", enough_revisited_m);
    visit("revisit_radius_m", revisit_radius_m);
    visit("revisit_gap_m", revisit_gap_m);
    visit("enough_sigma_m", enough_sigma_m);
    visit("enough_sigma_rad", enough_sigma_rad);
    visit("min_seen_share", min_seen_share);
    visit("min_steps", min_steps);
    visit("segment_m", segment_m);
    visit("num_groups", num_groups);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// What the drive so far tells of one camera.
struct CameraOutlook {
  std::string name;
  HandEye hand_eye;
  /// Standard deviations of vehicle_from_camera, [dt, dphi] in the vehicle's frame (metres, radians), that
  /// hand-eye would have now: a prediction, and an upper bound of what the joint adjustment will leave. NaN
  /// for the height, which hand-eye does not see, and for all where nothing can be told yet.
  Eigen::Matrix<double, 6, 1> sigma;
  bool is_enough = false;
};

/// How far a drive is, and what to do next.
struct DriveOutlook {
  double distance_m = 0.0;
  double left_turn_rad = 0.0, right_turn_rad = 0.0;  ///< both positive
  double revisited_m = 0.0;                          ///< of the way, near where the vehicle was before
  std::vector<CameraOutlook> cameras;
  /// Of what is needed, the least share that is there, 0 to 1.
  double progress = 0.0;
  std::vector<std::string> missing;  ///< one line each, the first is `next`; empty where nothing is
  std::string next;                  ///< for the driver: a manoeuvre, or that he can stop
  bool isEnough() const { return missing.empty(); }
};

/// Tells during a drive what the calibration of a rig still needs: turns to both sides, way, a place that is
/// passed again, and for every camera motions that fix its place. The standard deviations are those of planar
/// hand-eye by the motions so far: the larger of its formula and of a jackknife over parts of the drive,
/// since errors of neighbouring motions go together. Cheap: the motions come one by one, a look at them takes
/// some ten milliseconds.
class CalibrationCoach {
 public:
  /// std::invalid_argument for bad options.
  CalibrationCoach(const std::vector<std::string>& camera_names, const HandEyeOptions& hand_eye,
                   const CalibrationCoachOptions& options);

  /// The next keyframe; `travelled_m` is the way since the drive's start.
  void addKeyframe(const RigidTransform& odom_from_vehicle, double travelled_m);
  /// A motion that a camera saw; MotionPair::keyframe is the index of the keyframe at which it began, of
  /// those that were added.
  void addMotion(size_t camera, const MotionPair& motion);

  size_t numKeyframes() const { return places_.size(); }
  /// Works on all that was added: call it when it is to be shown.
  DriveOutlook outlook() const;

 private:
  struct Place {
    RigidTransform odom_from_vehicle;
    double travelled_m = 0.0;
    bool is_revisited = false;
  };
  CameraOutlook cameraOutlook(size_t camera) const;
  double weakness(const CameraOutlook& camera, int* degree_of_freedom) const;
  void judgeSigmas(DriveOutlook* outlook, std::vector<double>* shares) const;
  void judge(DriveOutlook* outlook) const;

  const std::vector<std::string> names_;
  HandEyeOptions hand_eye_;
  const CalibrationCoachOptions options_;
  std::vector<Place> places_;
  std::vector<std::vector<MotionPair>> motions_;  // by camera
  double left_turn_rad_ = 0.0, right_turn_rad_ = 0.0, revisited_m_ = 0.0;
};

}  // namespace vcharge
