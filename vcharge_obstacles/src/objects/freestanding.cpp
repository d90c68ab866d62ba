#include "objects/freestanding.h"

#include <cmath>
#include <optional>

namespace vcharge {
namespace {

constexpr int kNumDirections = 360;
// Contacts are searched from just below the horizon, up to this angle from the axis, in these distances.
constexpr double kSlope = -0.02, kMaxAngle_rad = 1.2, kMinRange_m = 0.8, kMaxRange_m = 9.0;
// Neighbouring directions see one thing if their ranges differ by less than this part.
constexpr double kSameThing = 0.12;
constexpr double kMinWidth_m = 0.15, kMaxWidth_m = 0.9;
// Distance behind a thing from which what is beside it stands apart, in this number of directions.
constexpr double kApart_m = 0.5;
constexpr int kNumApart = 2;
// A contact tells neither the height nor the velocity.
constexpr double kHeight_m = 1.5, kVelocity_m_per_s = 1.4;
constexpr double kAcross_m = 0.1;
// Where a camera moves across the view, edges of what is behind slide along what is in front, and take wrong
// contacts along at up to this multiple of its speed; along the view, less.
constexpr double kDriftAcross = 2.0, kDriftAlong = 0.35;

double azimuthOf(double direction) {
  return direction * 2.0 * M_PI / kNumDirections - M_PI;
}

class Profile {
 public:
  explicit Profile(const GroundContact& contact) {
    for (int i = 0; i < kNumDirections; ++i) {
      const double azimuth_rad = azimuthOf(i + 0.5);
      contacts_.push_back(
          contact.below(Eigen::Vector3d(std::cos(azimuth_rad), std::sin(azimuth_rad), kSlope)));
    }
  }
  const std::optional<Contact>& at(int direction) const {
    return contacts_[static_cast<size_t>((direction % kNumDirections + kNumDirections) % kNumDirections)];
  }
  bool isNear(int direction) const {
    return at(direction) && at(direction)->range_m > kMinRange_m && at(direction)->range_m < kMaxRange_m;
  }
  /// The direction after the last that sees the same thing.
  int endOf(int first) const {
    int end = first + 1;
    while (end < kNumDirections && at(end) &&
           std::abs(at(end)->range_m - at(end - 1)->range_m) < kSameThing * at(end - 1)->range_m) {
      ++end;
    }
    return end;
  }
  bool standsApart(int first, int end, double range_m) const {
    for (int i = 1; i <= kNumApart; ++i) {
      for (const int beside : {first - i, end - 1 + i}) {
        if (at(beside) && at(beside)->range_m < range_m + kApart_m) {
          return false;
        }
      }
    }
    return true;
  }

 private:
  std::vector<std::optional<Contact>> contacts_;
};

ObjectDetection detectionOf(double azimuth_rad, double range_m, double sigma_m, double width_m,
                            const CameraMotion& camera) {
  const Eigen::Vector2d along(std::cos(azimuth_rad), std::sin(azimuth_rad)), left(-along.y(), along.x());
  ObjectDetection found;
  found.has_velocity = false;
  found.away = along;
  found.position_m = camera.position_m.head<2>() + range_m * along;
  found.left_m = found.position_m + 0.5 * width_m * left;
  found.right_m = found.position_m - 0.5 * width_m * left;
  found.height_m = kHeight_m;
  found.covariance = kVelocity_m_per_s * kVelocity_m_per_s * Eigen::Matrix4d::Identity();
  found.covariance.topLeftCorner<2, 2>() =
      sigma_m * sigma_m * along * along.transpose() + kAcross_m * kAcross_m * left * left.transpose();
  found.drift_m_per_s = kDriftAcross * std::abs(camera.velocity_m_per_s.dot(left)) +
                        kDriftAlong * std::abs(camera.velocity_m_per_s.dot(along));
  return found;
}

}  // namespace

CameraMotion motionOf(const RigidTransform& vehicle_from_camera, const RigidTransform& now_from_before,
                      double duration_s) {
  const Eigen::Vector3d position_m = vehicle_from_camera.translation();
  const Eigen::Vector3d axis = vehicle_from_camera.rotation() * Eigen::Vector3d::UnitZ();
  CameraMotion motion{position_m, std::atan2(axis.y(), axis.x()), Eigen::Vector2d::Zero()};
  if (duration_s > 0.0) {
    motion.velocity_m_per_s = (position_m - now_from_before * position_m).head<2>() / duration_s;
  }
  return motion;
}

std::vector<ObjectDetection> findFreestanding(const GroundContact& contact, const CameraMotion& camera) {
  const Profile profile(contact);
  std::vector<ObjectDetection> found;
  for (int first = 0; first < kNumDirections;) {
    if (!profile.isNear(first)) {
      ++first;
      continue;
    }
    const int end = profile.endOf(first);
    double range_m = 0.0;
    for (int i = first; i < end; ++i) {
      range_m += profile.at(i)->range_m / (end - first);
    }
    const double width_m = (end - first) * 2.0 * M_PI / kNumDirections * range_m;
    const double azimuth_rad = azimuthOf(0.5 * (first + end));
    if (width_m > kMinWidth_m && width_m < kMaxWidth_m && profile.standsApart(first, end, range_m) &&
        std::abs(std::remainder(azimuth_rad - camera.axis_azimuth_rad, 2.0 * M_PI)) < kMaxAngle_rad) {
      found.push_back(
          detectionOf(azimuth_rad, range_m, profile.at((first + end) / 2)->sigma_m, width_m, camera));
    }
    first = end;
  }
  return found;
}

}  // namespace vcharge
