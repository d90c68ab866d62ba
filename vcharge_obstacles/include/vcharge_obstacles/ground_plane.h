#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace vcharge {

/// How much a ground plane that was looked for can be relied on.
enum class GroundState {
  kMeasured,     ///< fitted to ground points
  kFewPoints,    ///< too few: the nominal plane, with the prior's uncertainty
  kOutOfBounds,  ///< the fit needs more than the bounds allow: heights above the ground mean nothing
};
std::string toString(GroundState state);

/// The ground as the vehicle's body sees it: z = offset_m + slope.x() * x + slope.y() * y in the vehicle
/// frame. Zero where the body stands as it was calibrated; braking pitches the nose down, which is a positive
/// slope along x.
struct GroundPlane {
  GroundState state = GroundState::kFewPoints;
  double offset_m = 0.0;
  Eigen::Vector2d slope{0.0, 0.0};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of (offset_m, slope.x(), slope.y())
  int num_points = 0;                                    ///< that lie on it

  /// Attitude of the body over the ground (REP 103: nose down and left side up are positive), and how far it
  /// stands above where it was calibrated.
  double pitch_rad() const;
  double roll_rad() const;
  double height_m() const { return -offset_m; }
  /// Height of a point in the vehicle frame above the plane, measured along z.
  double heightOf(const Eigen::Vector3d& point_in_vehicle) const;
  /// Standard deviation of the plane's z at a place.
  double sigmaAt_m(double x_m, double y_m) const;
};

/// Options of fitGroundPlane.
struct GroundPlaneOptions {
  double max_tilt_rad = 0.0349;         ///< of pitch and of roll, 2 degrees: more is no suspension
  double max_offset_m = 0.08;           ///< of the height
  double prior_tilt_sigma_rad = 0.012;  ///< of the body on its suspension
  double prior_offset_sigma_m = 0.02;
  double max_distance_m = 6.0;      ///< from the camera; ground points further away say little
  double roughness_m = 0.01;        ///< of real ground, one sigma
  double noise_correlation = 0.02;  ///< share of the points that are independent (windows overlap)
  int min_points = 200;             ///< on the plane; fewer are no measurement

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("max_tilt_rad", max_tilt_rad);
    visit("max_offset_m", max_offset_m);
    visit("prior_tilt_sigma_rad", prior_tilt_sigma_rad);
    visit("prior_offset_sigma_m", prior_offset_sigma_m);
    visit("max_distance_m", max_distance_m);
    visit("roughness_m", roughness_m);
    visit("noise_correlation", noise_correlation);
    visit("min_points", min_points);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Points that may lie on the ground. Structure of arrays.
struct GroundCandidates {
  std::vector<float> x_m, y_m, z_m;  ///< in the vehicle frame
  std::vector<float> sigma_m;        ///< of z, from the range's
  std::vector<float> weight;         ///< 0 to 1

  size_t size() const { return x_m.size(); }
  void clear();
  void add(const Eigen::Vector3f& point_in_vehicle_m, float z_sigma_m, float point_weight);
};

/// The plane that most of the candidates support, by iteratively reweighted least squares with a Cauchy
/// kernel that narrows, and a prior around the nominal plane. Deterministic; from the candidates alone, so
/// that an error of one range map does not stay. Out of bounds the nominal plane is returned with that state.
GroundPlane fitGroundPlane(const GroundCandidates& candidates, const GroundPlaneOptions& options);

}  // namespace vcharge
