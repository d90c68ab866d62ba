#pragma once

#include <optional>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

struct PoseFilterOptions {
  // What the odometer's motion is good for.
  double scale_sigma = 0.02;      ///< of true over counted distance, before the drive
  double turn_sigma = 0.02;       ///< of true over counted turn
  double scale_walk = 0.001;      ///< how much either changes in a metre of way, per square root
  double distance_sigma = 0.01;   ///< metres in a metre of way, per square root
  double yaw_sigma_rad = 0.0012;  ///< in a metre of way, per square root
  double yaw_turn_sigma = 0.01;   ///< in a radian of turn, per square root
  double height_sigma_m = 0.01;   ///< in a metre of way, per square root
  double tilt_sigma_rad = 0.003;  ///< roll and pitch in a metre of way, per square root
  double time_sigma_m = 0.002;    ///< in a second, per square root, also of a vehicle that stands
  double time_sigma_rad = 0.0005;
  /// What a fix is good for: its own covariance takes all inliers to be right, and their errors to be
  /// independent.
  double fix_covariance_factor = 3.0;
  // Errors of the map itself, which stay the same while the same landmarks are seen: of maps made of images
  // whose pixels are map_pixel_rad wide in their middle. Those of coarser and finer images err by as much
  // more and less; those of pixels less than half as wide, of which nothing was measured, as those of half.
  double map_sigma_m = 0.005;
  double map_sigma_rad = 0.0004;
  double map_pixel_rad = 0.005;
  double gate = 30.0;  ///< squared Mahalanobis distance (6 degrees of freedom) of a likely fix

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("scale_sigma", scale_sigma);
    visit("turn_sigma", turn_sigma);
    visit("scale_walk", scale_walk);
    visit("distance_sigma", distance_sigma);
    visit("yaw_sigma_rad", yaw_sigma_rad);
    visit("yaw_turn_sigma", yaw_turn_sigma);
    visit("height_sigma_m", height_sigma_m);
    visit("tilt_sigma_rad", tilt_sigma_rad);
    visit("time_sigma_m", time_sigma_m);
    visit("time_sigma_rad", time_sigma_rad);
    visit("fix_covariance_factor", fix_covariance_factor);
    visit("map_sigma_m", map_sigma_m);
    visit("map_sigma_rad", map_sigma_rad);
    visit("map_pixel_rad", map_pixel_rad);
    visit("gate", gate);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// The same with the errors of a map that was made of a rig's images: in proportion to its pixels' width.
PoseFilterOptions optionsForMapOf(const CameraRig& rig, const PoseFilterOptions& options);

/// Fuses fixes with the odometer: an error-state Kalman filter over the vehicle's pose in the map and the
/// odometer's factors, so that a bridged way is known as well as the odometer was while there were fixes.
///
/// Errors of fixes in a row have a part in common, which no averaging lessens: that of the map. It is added
/// to what pose() tells.
class PoseFilter {
 public:
  explicit PoseFilter(const PoseFilterOptions& options = PoseFilterOptions());

  bool hasPose() const { return has_pose_; }
  /// std::logic_error before the first reset().
  PosePrior pose() const;
  double distanceScale() const { return factors_[0]; }
  double turnScale() const { return factors_[1]; }

  /// Takes a pose as it is, whatever was known. The odometer's factors stay.
  void reset(const PosePrior& pose);
  void forget() { has_pose_ = false; }

  /// The vehicle moved as the odometer counted.
  void predict(const RigidTransform& previous_from_current, double period_s);

  /// The vehicle may have moved by this much in a way that nothing counted.
  void addNoise(double sigma_m, double sigma_rad);

  /// Squared Mahalanobis distance of a fix to what is expected.
  double distanceOf(const PoseFix& fix) const;
  /// False, and nothing else, for a fix beyond the gate.
  bool update(const PoseFix& fix);

 private:
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  using Matrix8d = Eigen::Matrix<double, 8, 8>;

  Matrix6d noiseOf(const PoseFix& fix) const;
  Eigen::Matrix<double, 6, 1> differenceTo(const RigidTransform& map_from_vehicle) const;
  Matrix6d mapCovariance() const;

  PoseFilterOptions options_;
  bool has_pose_ = false;
  RigidTransform map_from_vehicle_;
  Eigen::Vector2d factors_ = Eigen::Vector2d::Ones();  ///< true over counted distance, and turn
  Matrix8d covariance_ = Matrix8d::Zero();             ///< [dt, dphi] in the map's frame, factors
};

}  // namespace vcharge
