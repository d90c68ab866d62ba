#include "vcharge_obstacles/ground_plane.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace vcharge {
namespace {

// Widths of the kernel. The first covers the residuals of far points at the largest tilt, so that no initial
// value is needed; the last is the scatter of ground points.
constexpr double kKernelWidths_m[] = {0.15, 0.10, 0.07, 0.05, 0.035, 0.025, 0.025, 0.025};
// Points within this multiple of the last width are inliers.
constexpr double kInlierWidths = 2.0;
// A fit with fewer inliers is not a measurement.
constexpr int kMinInliers = 200;
// Standard deviations of the attitude and height of a car body on its suspension.
constexpr double kPriorTiltSigma_rad = 0.012;
constexpr double kPriorOffsetSigma_m = 0.02;
// Fraction of the points that are independent, because matching windows overlap.
constexpr double kIndependentFraction = 0.02;

struct NormalEquations {
  Eigen::Matrix3d information;
  Eigen::Vector3d vector;
};

Eigen::Vector3d priorInformation() {
  const double tilt = 1.0 / (kPriorTiltSigma_rad * kPriorTiltSigma_rad);
  return {1.0 / (kPriorOffsetSigma_m * kPriorOffsetSigma_m), tilt, tilt};
}

NormalEquations accumulate(const GroundCandidates& points, const GroundPlaneOptions& options,
                           const Eigen::Vector3d& plane, double kernel_m) {
  NormalEquations equations{priorInformation().asDiagonal(), Eigen::Vector3d::Zero()};
  const double inverse_square = 1.0 / (kernel_m * kernel_m);
  const double roughness = options.roughness_m * options.roughness_m;
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d row(1.0, points.x_m[i], points.y_m[i]);
    const double error_m = points.z_m[i] - row.dot(plane);
    const double variance = points.sigma_m[i] * points.sigma_m[i] + roughness;
    const double weight =
        kIndependentFraction * points.weight[i] / (variance * (1.0 + error_m * error_m * inverse_square));
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

GroundPlane nominalPlane(GroundState state, int num_points) {
  GroundPlane plane;
  plane.state = state;
  plane.num_points = num_points;
  plane.covariance = priorInformation().cwiseInverse().asDiagonal();
  return plane;
}

}  // namespace

std::string toString(GroundState state) {
  constexpr const char* kNames[] = {"measured", "few ground points", "out of bounds"};
  return kNames[static_cast<size_t>(state)];
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
  if (num_points < kMinInliers) {
    return nominalPlane(GroundState::kFewPoints, num_points);
  }
  GroundPlane plane;
  plane.offset_m = parameters[0];
  plane.slope = parameters.tail<2>();
  if (std::abs(plane.pitch_rad()) > options.max_tilt_rad ||
      std::abs(plane.roll_rad()) > options.max_tilt_rad || std::abs(plane.offset_m) > options.max_offset_m) {
    return nominalPlane(GroundState::kOutOfBounds, num_points);
  }
  plane.state = GroundState::kMeasured;
  plane.num_points = num_points;
  plane.covariance = equations.information.inverse();
  return plane;
}

}  // namespace vcharge
