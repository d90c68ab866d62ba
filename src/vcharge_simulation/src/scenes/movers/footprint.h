#pragma once

#include <vector>

#include <Eigen/Core>

namespace vcharge {

/// A convex outline on the ground with a circle around it; metres.
struct Footprint {
  explicit Footprint(std::vector<Eigen::Vector2d> corners);

  std::vector<Eigen::Vector2d> corners;
  Eigen::Vector2d centre;
  double radius;
};

/// Distance between two outlines; 0 if they touch or overlap.
double distanceBetween(const Footprint& a, const Footprint& b);
/// True if the distance is smaller than `distance_m`; quick for outlines far apart.
bool isNearerThan(double distance_m, const Footprint& a, const Footprint& b);

}  // namespace vcharge
