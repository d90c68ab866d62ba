#pragma once

#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Corners of a polygon in order, in metres; everything inside belongs to it.
using Outline = std::vector<Eigen::Vector2d>;

/// Ends of the simulated car in its own frame, and half its width.
inline constexpr double kVehicleFront_m = 3.46;
inline constexpr double kVehicleRear_m = -0.74;
inline constexpr double kVehicleHalfWidth_m = 0.89;

/// Rectangle from `rear_m` to `front_m` of a vehicle, in the frame of the transform's target.
Outline vehicleOutline(const RigidTransform& frame_from_vehicle, double front_m, double rear_m,
                       double half_width_m);

/// The point of an outline nearest to a point: that point itself if it lies inside.
Eigen::Vector2d nearestPoint(const Outline& outline, const Eigen::Vector2d& point_m);

/// Distance of a point from an outline; 0 inside it.
double distanceToPolygon(const Eigen::Vector2d& point_m, const Outline& outline);

/// Least distance of two outlines; 0 if they overlap.
double distanceBetween(const Outline& a, const Outline& b);

/// The point of `outline` nearest to `other`; the first one found where several are.
Eigen::Vector2d nearestPoint(const Outline& outline, const Outline& other);

}  // namespace vcharge
