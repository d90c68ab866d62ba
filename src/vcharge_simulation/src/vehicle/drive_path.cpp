#include "vcharge_simulation/vehicle/drive_path.h"
#include "vcharge_core/motion/vehicle_rates.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
// Step of the numeric integration over a corner.
constexpr double kIntegrationStep_m = 1e-3;

double wrapAngle(double angle_rad) {
  return std::remainder(angle_rad, 2.0 * kPi);
}

std::vector<DrivePath::Segment> makeCorner(double turn_rad, double radius_m, double transition_m) {
  const double sign = turn_rad < 0.0 ? -1.0 : 1.0;
  // A clothoid turns by half the angle of an arc of its length.
  const double arc_m = std::abs(turn_rad) * radius_m - transition_m;
  if (arc_m < 0.0) {
    throw std::invalid_argument("DrivePath: transition_m is too long for a corner");
  }
  const double curvature = sign / radius_m;
  return {{transition_m, 0.0, curvature}, {arc_m, curvature, curvature}, {transition_m, curvature, 0.0}};
}

// Length of the straight edge before the vertex that is replaced by the corner.
double cornerTangent(const std::vector<DrivePath::Segment>& corner, double turn_rad) {
  const DrivePath path(RigidTransform(), corner);
  RigidTransform start_from_here;
  const int steps = static_cast<int>(std::ceil(path.length() / kIntegrationStep_m));
  for (int i = 0; i < steps; ++i) {
    const double from = path.length() * i / steps;
    const double to = path.length() * (i + 1) / steps;
    start_from_here = start_from_here * arcMotion(to - from, path.heading(to) - path.heading(from));
  }
  const Eigen::Vector3d& end = start_from_here.translation();
  return end.x() - end.y() * std::cos(turn_rad) / std::sin(turn_rad);
}

}  // namespace

DrivePath::DrivePath(const RigidTransform& world_from_start, const std::vector<Segment>& segments)
    : world_from_start_(world_from_start) {
  for (const Segment& segment : segments) {
    if (!(segment.length_m >= 0.0)) {
      throw std::invalid_argument("DrivePath: a segment has a negative length");
    }
    appendSegment(segment);
  }
}

void DrivePath::appendSegment(const Segment& segment) {
  if (!segments_.empty() && segment.backwards != segments_.back().backwards) {
    addStop({length_m_, kTurnaround_s});
  }
  segments_.push_back(segment);
  start_m_.push_back(length_m_);
  start_heading_rad_.push_back(end_heading_rad_);
  length_m_ += segment.length_m;
  end_heading_rad_ += (segment.backwards ? -0.5 : 0.5) *
                      (segment.start_curvature_per_m + segment.end_curvature_per_m) * segment.length_m;
}

void DrivePath::append(const DrivePath& next) {
  if (&next == this) {
    append(DrivePath(next));
    return;
  }
  const double joint_m = length_m_;
  for (const Segment& segment : next.segments_) {
    appendSegment(segment);
  }
  // appendSegment() has already added the stops at which the next path changes its direction of travel.
  for (const Stop& stop : next.stops_) {
    const Stop shifted{joint_m + stop.at_m, stop.wait_s};
    if (std::none_of(stops_.begin(), stops_.end(),
                     [&](const Stop& known) { return std::abs(known.at_m - shifted.at_m) < 1e-9; })) {
      addStop(shifted);
    }
  }
}

double DrivePath::curvature(double s_m) const {
  if (s_m < 0.0 || s_m >= length_m_) {
    return 0.0;
  }
  const size_t i = segmentAt(s_m);
  const Segment& segment = segments_[i];
  const double fraction = segment.length_m > 0.0 ? (s_m - start_m_[i]) / segment.length_m : 0.0;
  return segment.start_curvature_per_m +
         fraction * (segment.end_curvature_per_m - segment.start_curvature_per_m);
}

double DrivePath::heading(double s_m) const {
  if (s_m <= 0.0) {
    return 0.0;
  }
  if (s_m >= length_m_) {
    return end_heading_rad_;
  }
  const size_t i = segmentAt(s_m);
  const double along = s_m - start_m_[i];
  const double half = segments_[i].backwards ? -0.5 : 0.5;
  return start_heading_rad_[i] + half * (segments_[i].start_curvature_per_m + curvature(s_m)) * along;
}

double DrivePath::direction(double s_m) const {
  return !segments_.empty() && segments_[segmentAt(s_m)].backwards ? -1.0 : 1.0;
}

size_t DrivePath::segmentAt(double s_m) const {
  const auto after = std::upper_bound(start_m_.begin(), start_m_.end(), s_m) - start_m_.begin();
  return static_cast<size_t>(std::max<std::ptrdiff_t>(after - 1, 0));
}

void DrivePath::addStop(const Stop& stop) {
  const auto later = [](const Stop& a, const Stop& b) { return a.at_m < b.at_m; };
  stops_.insert(std::upper_bound(stops_.begin(), stops_.end(), stop, later), stop);
}

DrivePath DrivePath::throughWaypoints(const std::vector<Eigen::Vector2d>& waypoints, bool closed,
                                      double radius_m, double transition_m) {
  const size_t n = waypoints.size();
  if (n < (closed ? 3U : 2U)) {
    throw std::invalid_argument("DrivePath: too few waypoints");
  }
  std::vector<Eigen::Vector2d> points = waypoints;
  if (closed) {
    const Eigen::Vector2d middle = 0.5 * (waypoints.back() + waypoints.front());
    points.insert(points.begin(), middle);
    points.push_back(middle);
  }
  std::vector<Segment> segments;
  double used_m = 0.0;  // length of the current edge used by the corner before it
  for (size_t i = 0; i + 1 < points.size(); ++i) {
    const Eigen::Vector2d edge = points[i + 1] - points[i];
    std::vector<Segment> corner;
    double tangent_m = 0.0;
    if (i + 2 < points.size()) {
      const Eigen::Vector2d next = points[i + 2] - points[i + 1];
      const double turn_rad = wrapAngle(std::atan2(next.y(), next.x()) - std::atan2(edge.y(), edge.x()));
      if (std::abs(turn_rad) > 1e-9) {
        corner = makeCorner(turn_rad, radius_m, transition_m);
        tangent_m = cornerTangent(corner, turn_rad);
      }
    }
    const double straight_m = edge.norm() - used_m - tangent_m;
    if (straight_m < 0.0) {
      throw std::invalid_argument("DrivePath: an edge between waypoints is too short for its corners");
    }
    segments.push_back({straight_m, 0.0, 0.0});
    segments.insert(segments.end(), corner.begin(), corner.end());
    used_m = tangent_m;
  }
  const Eigen::Vector2d first = points[1] - points[0];
  return DrivePath(RigidTransform::planar(points[0].x(), points[0].y(), std::atan2(first.y(), first.x())),
                   segments);
}

}  // namespace vcharge
