#include "vcharge_obstacles/ground_plane.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "vcharge_core/base/options.h"

namespace vcharge {
namespace {

// Widths of the kernel. The first spans what a tilt at the bounds does to far points, so that no start value
// is needed; the last is that of what ground points scatter by.
constexpr double kKernelWidths_m[] = {0.15, 0.10, 0.07, 0.05, 0.035, 0.025, 0.025, 0.025};
// Of the last width: what lies within counts as ground.
constexpr double kInlierWidths = 2.0;

struct NormalEquations {
  Eigen::Matrix3d information;
  Eigen::Vector3d vector;
};

Eigen::Vector3d priorInformation(const GroundPlaneOptions& options) {
  const double tilt = 1.0 / (options.prior_tilt_sigma_rad * options.prior_tilt_sigma_rad);
  return {1.0 / (options.prior_offset_sigma_m * options.prior_offset_sigma_m), tilt, tilt};
}

NormalEquations accumulate(const GroundCandidates& points, const GroundPlaneOptions& options,
                           const Eigen::Vector3d& plane, double kernel_m) {
  NormalEquations equations{priorInformation(options).asDiagonal(), Eigen::Vector3d::Zero()};
  const double inverse_square = 1.0 / (kernel_m * kernel_m);
  const double roughness = options.roughness_m * options.roughness_m;
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d row(1.0, points.x_m[i], points.y_m[i]);
    const double error_m = points.z_m[i] - row.dot(plane);
    const double variance = points.sigma_m[i] * points.sigma_m[i] + roughness;
    const double weight = options.noise_correlation * points.weight[i] /
                          (variance * (1.0 + error_m * error_m * inverse_square));
    equations.information.noalias() += weight * row * row.transpose();
    equations.vector += weight * points.z_m[i] * row;
  }
  return equations;
}

int countInliers(const GroundCandidates& points, const Eigen::Vector3d& plane, double kernel_m) {
  int count = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const double error_m = points.z_m[i] - (plane[0] + plane[1] * points.x_m[i] + plane[2] * points.y_m[i]);
    count += std::abs(error_m) < kInlierWidths * kernel_m ? 1 : 0;
  }
  return count;
}

GroundPlane nominalPlane(GroundState state, int num_points, const GroundPlaneOptions& options) {
  GroundPlane plane;
  plane.state = state;
  plane.num_points = num_points;
  plane.covariance = priorInformation(options).cwiseInverse().asDiagonal();
  return plane;
}

}  // namespace

std::string toString(GroundState state) {
  switch (state) {
    case GroundState::kMeasured:
      return "measured";
    case GroundState::kFewPoints:
      return "few ground points";
    case GroundState::kOutOfBounds:
      break;
  }
  return "out of bounds";
}

double GroundPlane::pitch_rad() const {
  return std::atan(slope.x());
}

double GroundPlane::roll_rad() const {
  return -std::atan(slope.y());
}

double GroundPlane::heightOf(const Eigen::Vector3d& point_in_vehicle) const {
  return point_in_vehicle.z() - offset_m - slope.dot(point_in_vehicle.head<2>());
}

double GroundPlane::sigmaAt_m(double x_m, double y_m) const {
  const Eigen::Vector3d row(1.0, x_m, y_m);
  return std::sqrt(std::max(0.0, row.dot(covariance * row)));
}

void GroundPlaneOptions::validate() const {
  requireField(max_tilt_rad > 0.0 && max_tilt_rad < 0.2, "max_tilt_rad", "must be in (0, 0.2)", max_tilt_rad);
  requireField(max_offset_m > 0.0, "max_offset_m", "must be positive", max_offset_m);
  requireField(prior_tilt_sigma_rad > 0.0, "prior_tilt_sigma_rad", "must be positive", prior_tilt_sigma_rad);
  requireField(prior_offset_sigma_m > 0.0, "prior_offset_sigma_m", "must be positive", prior_offset_sigma_m);
  requireField(max_distance_m > 0.0, "max_distance_m", "must be positive", max_distance_m);
  requireField(roughness_m > 0.0, "roughness_m", "must be positive", roughness_m);
  requireField(noise_correlation > 0.0 && noise_correlation <= 1.0, "noise_correlation", "must be in (0, 1]",
               noise_correlation);
  requireField(min_points > 0, "min_points", "must be positive", min_points);
}

void GroundCandidates::clear() {
  for (std::vector<float>* values : {&x_m, &y_m, &z_m, &sigma_m, &weight}) {
    values->clear();
  }
}

void GroundCandidates::add(const Eigen::Vector3f& point_in_vehicle_m, float z_sigma_m, float point_weight) {
  x_m.push_back(point_in_vehicle_m.x());
  y_m.push_back(point_in_vehicle_m.y());
  z_m.push_back(point_in_vehicle_m.z());
  sigma_m.push_back(z_sigma_m);
  weight.push_back(point_weight);
}

GroundPlane fitGroundPlane(const GroundCandidates& candidates, const GroundPlaneOptions& options) {
  Eigen::Vector3d parameters = Eigen::Vector3d::Zero();
  double kernel_m = 0.0;
  NormalEquations equations;
  for (const double width_m : kKernelWidths_m) {
    kernel_m = width_m;
    equations = accumulate(candidates, options, parameters, kernel_m);
    parameters = equations.information.ldlt().solve(equations.vector);
  }
  const int num_points = countInliers(candidates, parameters, kernel_m);
  if (num_points < options.min_points) {
    return nominalPlane(GroundState::kFewPoints, num_points, options);
  }
  GroundPlane plane;
  plane.offset_m = parameters[0];
  plane.slope = parameters.tail<2>();
  if (std::abs(plane.pitch_rad()) > options.max_tilt_rad ||
      std::abs(plane.roll_rad()) > options.max_tilt_rad || std::abs(plane.offset_m) > options.max_offset_m) {
    return nominalPlane(GroundState::kOutOfBounds, num_points, options);
  }
  plane.state = GroundState::kMeasured;
  plane.num_points = num_points;
  plane.covariance = equations.information.inverse();
  return plane;
}

}  // namespace vcharge
