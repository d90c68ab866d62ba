#pragma once

#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A path with piecewise linear curvature in arc length: straight lines, circular arcs and clothoids, driven
/// forwards or backwards. Arc length increases in both directions of travel.
class DrivePath {
 public:
  struct Segment {
    double length_m;
    double start_curvature_per_m;  ///< steering curvature: positive to the left, also when driving backwards
    double end_curvature_per_m;
    bool backwards = false;
  };

  /// A standstill on the path.
  struct Stop {
    double at_m;
    double wait_s;
  };

  /// Path through `waypoints` with rounded corners: a clothoid of `transition_m`, an arc of `radius_m`, and
  /// another clothoid. A closed path starts and ends in the middle of the edge from the last to the first
  /// waypoint. Throws std::invalid_argument if an edge is too short for its corners.
  static DrivePath throughWaypoints(const std::vector<Eigen::Vector2d>& waypoints, bool closed,
                                    double radius_m, double transition_m);

  DrivePath(const RigidTransform& world_from_start, const std::vector<Segment>& segments);

  const RigidTransform& worldFromStart() const { return world_from_start_; }
  double length() const { return length_m_; }
  /// Curvature at arc length s; zero before the start and after the end.
  double curvature(double s_m) const;
  /// 1 when driving forwards, -1 backwards.
  double direction(double s_m) const;
  /// Heading relative to the start, the exact integral of the curvature.
  double heading(double s_m) const;
  /// In order of arc length, including a stop of kTurnaround_s wherever the direction of travel changes.
  const std::vector<Stop>& stops() const { return stops_; }
  void addStop(const Stop& stop);
  /// Appends another path, which then starts at the end of this one; adds a stop if the direction of travel
  /// changes.
  void append(const DrivePath& next);

  static constexpr double kTurnaround_s = 1.0;

 private:
  size_t segmentAt(double s_m) const;
  void appendSegment(const Segment& segment);

  RigidTransform world_from_start_;
  std::vector<Segment> segments_;
  std::vector<Stop> stops_;
  std::vector<double> start_m_, start_heading_rad_;  // per segment
  double length_m_ = 0.0;
  double end_heading_rad_ = 0.0;
};

}  // namespace vcharge
