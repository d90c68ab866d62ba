#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Reliability of a fitted ground plane.
enum class GroundState {
  kMeasured,     ///< fitted to ground points
  kFewPoints,    ///< too few points: the nominal plane with the prior's uncertainty
  kOutOfBounds,  ///< the fit exceeds the bounds: heights above the ground are not known
};
std::string toString(GroundState state);

/// The ground in the vehicle frame: z = offset_m + slope.x() * x + slope.y() * y. All zero for the calibrated
/// attitude of the body; braking pitches the nose down, which is a positive slope along x.
struct GroundPlane {
  GroundState state = GroundState::kFewPoints;
  double offset_m = 0.0;
  Eigen::Vector2d slope{0.0, 0.0};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< covariance of (offset_m, slope.x(), slope.y())
  int num_points = 0;                                    ///< number of points on the plane

  /// Attitude of the body over the ground (REP 103: nose down and left side up are positive), and its height
  /// above the calibrated one.
  double pitch_rad() const;
  double roll_rad() const;
  double height_m() const { return -offset_m; }
  /// Height of a point in the vehicle frame above the plane, measured along z.
  double heightOf(const Eigen::Vector3d& point_in_vehicle) const;
  /// Standard deviation of the plane's z at a point.
  double sigmaAt_m(double x_m, double y_m) const;
};

/// Tilt assumed while the ground plane is out of bounds; an obstacle must then rise above such a ground.
constexpr double kLostGroundTilt_rad = 0.0873;

/// Options of fitGroundPlane.
struct GroundPlaneOptions {
  VCHARGE_BEGIN_OPTIONS(GroundPlaneOptions);
  VCHARGE_OPTION(double, max_tilt_rad, 0.0349, above(0.0).below(kLostGroundTilt_rad),
                 "Largest pitch or roll of the body that its suspension allows.");
  VCHARGE_OPTION(double, max_offset_m, 0.08, positive(), "Largest change of the body's height.");
  VCHARGE_OPTION(double, max_distance_m, 6.0, positive(), "Distance from the camera of ground points used.");
  VCHARGE_OPTION(double, roughness_m, 0.01, positive(), "Standard deviation of the ground's own height.");
  VCHARGE_END_OPTIONS();
};

/// Points that may lie on the ground, as a structure of arrays.
struct GroundCandidates {
  std::vector<float> x_m, y_m, z_m;  ///< in the vehicle frame
  std::vector<float> sigma_m;        ///< standard deviation of z
  std::vector<float> weight;         ///< 0 to 1

  size_t size() const { return x_m.size(); }
  void add(const Eigen::Vector3f& point_in_vehicle_m, float z_sigma_m, float point_weight);
};

/// Fits a plane by iteratively reweighted least squares with a narrowing Cauchy kernel and a prior around the
/// nominal plane. Deterministic. Uses only these candidates, so that an error of one range map does not
/// persist. If the fit is out of bounds, the nominal plane is returned with that state.
GroundPlane fitGroundPlane(const GroundCandidates& candidates, const GroundPlaneOptions& options);

}  // namespace vcharge
