#include "check/odometry_check.h"

#include <algorithm>
#include <cmath>

namespace vcharge::internal {
namespace {

constexpr double kManyUncovered = 0.01;
constexpr double kTooManyUncovered = 0.2;
/// Speeds above that of a car in a car park, and above that of any car.
constexpr double kFast_m_per_s = 15.0;
constexpr double kTooFast_m_per_s = 60.0;
/// Sideways motion is implausible: the rear axle's centre moves along the vehicle's axis.
constexpr double kManySideways = 0.05;
constexpr double kTooManySideways = 0.3;
/// Noise of the yaw from image to image, beyond smooth motion.
constexpr double kYawJitter_deg = 0.06;
constexpr double kTooMuchYawJitter_deg = 0.5;
constexpr double kDistanceJitter_m = 0.02;
constexpr double kTooMuchDistanceJitter_m = 0.1;
constexpr double kUneven = 0.05;
constexpr double kMinDrive_m = 2.0;
constexpr double kManyStanding = 0.5;
constexpr double kStanding_m_per_s = 0.02;
constexpr double kLittleTurn_rad = 1.0;

std::string degrees(double rad, int digits = 0) {
  return toText(rad / kDegree, digits) + " degrees";
}

/// Root mean square of the noise of values at even times, from their third differences, which vanish for
/// constant acceleration. Uneven times are skipped.
double jitter(const std::vector<double>& times_s, const std::vector<double>& values) {
  std::vector<double> squares;
  for (size_t i = 3; i < values.size(); ++i) {
    const double period_s = (times_s[i] - times_s[i - 3]) / 3.0;
    if (std::abs(times_s[i] - times_s[i - 1] - period_s) > kUneven * period_s ||
        std::abs(times_s[i - 1] - times_s[i - 2] - period_s) > kUneven * period_s) {
      continue;
    }
    const double third = values[i] - 3.0 * values[i - 1] + 3.0 * values[i - 2] - values[i - 3];
    squares.push_back(third * third / 20.0);
  }
  // A tenth may be real jerks from starting and stopping.
  std::sort(squares.begin(), squares.end());
  squares.resize(squares.size() - squares.size() / 10);
  double sum = 0.0;
  for (const double square : squares) {
    sum += square;
  }
  return squares.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(squares.size()));
}

void judgePath(const OdometryPath& path, CheckFindings* findings) {
  double along = 0.0, sideways = 0.0, fastest = 0.0, fastest_at_s = 0.0;
  for (size_t i = 0; i < path.stepsInVehicle().size(); ++i) {
    const Eigen::Vector2d& step = path.stepsInVehicle()[i];
    along += std::abs(step.x());
    sideways += std::abs(step.y());
    const double speed = step.norm() / (path.stamp_s(i + 1) - path.stamp_s(i));
    if (speed > fastest) {
      fastest = speed;
      fastest_at_s = path.stamp_s(i + 1);
    }
  }
  findings->atMost("odometry: speed", fastest, kFast_m_per_s, kTooFast_m_per_s,
                   "up to " + toText(fastest, 1) + " m/s",
                   "at " + toText(fastest_at_s, 2) + " s: counters that jump, or a wrong scale?");
  const double fraction = along + sideways > kMinDrive_m ? sideways / (along + sideways) : 0.0;
  findings->atMost("odometry: sideways", fraction, kManySideways, kTooManySideways,
                   percentText(fraction) + " of the way lies across the vehicle's axis",
                   "is base_link at the centre of the rear axle, x forward?");
}

void judgeResolution(const OdometryPath& path, const std::vector<Timestamp>& image_stamps,
                     CheckFindings* findings) {
  std::vector<double> times_s, yaws, distances;
  for (const Timestamp stamp : image_stamps) {
    const double time_s = path.secondsOf(stamp);
    if (path.covers(time_s)) {
      times_s.push_back(time_s);
      yaws.push_back(path.yaw_rad(time_s));
      distances.push_back(path.distance_m(time_s));
    }
  }
  // The change from image to image has two of these errors.
  const double yaw_deg = std::sqrt(2.0) * jitter(times_s, yaws) / kDegree,
               distance_m = std::sqrt(2.0) * jitter(times_s, distances);
  const std::string advice =
      "counters too coarse, or odometry that is not interpolated to the images' stamps?";
  findings->atMost("odometry: yaw resolution", yaw_deg, kYawJitter_deg, kTooMuchYawJitter_deg,
                   toText(yaw_deg, 3) + " degrees of jitter from image to image", advice);
  findings->atMost("odometry: distance resolution", distance_m, kDistanceJitter_m, kTooMuchDistanceJitter_m,
                   toText(100.0 * distance_m, 2) + " cm of jitter from image to image", advice);
}

void judgeContent(const OdometryPath& path, CheckFindings* findings) {
  double driven = 0.0, left = 0.0, right = 0.0, standing_s = 0.0;
  for (size_t i = 0; i < path.stepsInVehicle().size(); ++i) {
    const double length = path.stepsInVehicle()[i].norm(), lasting_s = path.stamp_s(i + 1) - path.stamp_s(i);
    const double turn = path.yaw_rad(path.stamp_s(i + 1)) - path.yaw_rad(path.stamp_s(i));
    driven += length;
    (turn > 0.0 ? left : right) += std::abs(turn);
    standing_s += length < kStanding_m_per_s * lasting_s ? lasting_s : 0.0;
  }
  const double lasting_s = path.end_s() - path.begin_s();
  const std::string figure = toText(driven, 0) + " m in " + toText(lasting_s, 0) + " s, turns of " +
                             degrees(left) + " to the left and " + degrees(right) + " to the right";
  if (driven < kMinDrive_m) {
    findings->add("motion", CheckGrade::kFail,
                  figure + ": the vehicle stands; nothing can be learned from it");
  } else if (standing_s > kManyStanding * lasting_s) {
    findings->add("motion", CheckGrade::kWarn,
                  figure + ", but it stands " + percentText(standing_s / lasting_s) + " of the time");
  } else {
    const bool turns = left > kLittleTurn_rad && right > kLittleTurn_rad;
    findings->add(
        "motion", CheckGrade::kPass,
        turns ? figure : figure + " (enough for a map; calibrating extrinsics needs turns to both sides)");
  }
}

}  // namespace

OdometryPath::OdometryPath(std::vector<VehicleOdometry> odometry) {
  std::stable_sort(odometry.begin(), odometry.end(),
                   [](const VehicleOdometry& a, const VehicleOdometry& b) { return a.stamp < b.stamp; });
  const VehicleOdometry* last = nullptr;
  for (const VehicleOdometry& entry : odometry) {
    if (last == nullptr) {
      origin_ = entry.stamp;
      yaws_rad_.push_back(yawOfRotation(entry.odom_from_vehicle.rotation()));
      distances_m_.push_back(0.0);
    } else if (entry.stamp == last->stamp) {
      continue;
    } else {
      const RigidTransform last_from_entry = last->odom_from_vehicle.inverse() * entry.odom_from_vehicle;
      const double turn = yawOfRotation(last_from_entry.rotation());
      const Eigen::Vector2d step = Eigen::Rotation2Dd(-0.5 * turn) * last_from_entry.translation().head<2>();
      steps_.push_back(step);
      yaws_rad_.push_back(yaws_rad_.back() + turn);
      distances_m_.push_back(distances_m_.back() + step.x());
    }
    stamps_s_.push_back(toSeconds(entry.stamp - origin_));
    last = &entry;
  }
}

double OdometryPath::at(const std::vector<double>& values, double time_s) const {
  const auto next = std::lower_bound(stamps_s_.begin(), stamps_s_.end(), time_s);
  if (next == stamps_s_.begin()) {
    return values.front();
  }
  if (next == stamps_s_.end()) {
    return values.back();
  }
  const auto i = static_cast<size_t>(next - stamps_s_.begin());
  const double fraction = (time_s - stamps_s_[i - 1]) / (stamps_s_[i] - stamps_s_[i - 1]);
  return values[i - 1] + fraction * (values[i] - values[i - 1]);
}

void judgeOdometry(const OdometryPath& path, const std::vector<Timestamp>& image_stamps,
                   CheckFindings* findings) {
  int64_t num_uncovered = 0;
  for (const Timestamp stamp : image_stamps) {
    num_uncovered += path.covers(path.secondsOf(stamp)) ? 0 : 1;
  }
  const double fraction = image_stamps.empty()
                              ? 0.0
                              : static_cast<double>(num_uncovered) / static_cast<double>(image_stamps.size());
  findings->atMost("odometry: coverage", fraction, kManyUncovered, kTooManyUncovered,
                   std::to_string(num_uncovered) + " of " + std::to_string(image_stamps.size()) +
                       " images before its begin or after its end",
                   "expected odometry for as long as there are images");
  judgePath(path, findings);
  judgeResolution(path, image_stamps, findings);
  judgeContent(path, findings);
}

}  // namespace vcharge::internal
