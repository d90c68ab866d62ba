#pragma once

#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Pose after driving `distance_m` along a circular arc that turns by `turn_rad` (positive to the left), from
/// the origin along x; exact, also for straight lines. The point that moves along the arc is the centre of
/// the rear axle.
RigidTransform arcMotion(double distance_m, double turn_rad);

/// A path whose curvature is piecewise linear in arc length: straight lines, arcs, and clothoids between
/// them, as a car with a continuous steering angle drives it, forwards or backwards. Arc length grows either
/// way.
class DrivePath {
 public:
  struct Segment {
    double length_m;
    double start_curvature_per_m;  ///< of the steering: positive to the left, also when driving backwards
    double end_curvature_per_m;
    bool backwards = false;
  };

  /// Where the car stands for a while.
  struct Stop {
    double at_m;
    double wait_s;
  };

  /// Path through `waypoints` with rounded corners: clothoid, arc of `radius_m`, clothoid, the clothoids each
  /// `transition_m` long. A closed path starts and ends in the middle of the edge from the last to the first
  /// waypoint. std::invalid_argument when an edge is too short for its corners.
  static DrivePath throughWaypoints(const std::vector<Eigen::Vector2d>& waypoints, bool closed,
                                    double radius_m, double transition_m);

  DrivePath(const RigidTransform& world_from_start, std::vector<Segment> segments);

  const RigidTransform& worldFromStart() const { return world_from_start_; }
  double length() const { return length_m_; }
  /// Curvature at arc length s; before the start and after the end the path goes straight on.
  double curvature(double s_m) const;
  /// 1 forwards, -1 backwards.
  double direction(double s_m) const;
  /// Heading relative to the start: the exact integral of the curvature.
  double heading(double s_m) const;
  /// In order of arc length; the car also stops for kTurnaround_s wherever it changes its direction.
  const std::vector<Stop>& stops() const { return stops_; }
  void addStop(const Stop& stop);
  /// Goes on along another path from here, wherever that one starts; with a stop where the direction changes.
  void append(const DrivePath& next);

  static constexpr double kTurnaround_s = 1.0;

 private:
  size_t segmentAt(double s_m) const;
  void appendSegment(const Segment& segment);

  RigidTransform world_from_start_;
  std::vector<Segment> segments_;
  std::vector<Stop> stops_;
  std::vector<double> start_m_, start_heading_rad_;  // of each segment
  double length_m_ = 0.0;
  double end_heading_rad_ = 0.0;
};

}  // namespace vcharge
