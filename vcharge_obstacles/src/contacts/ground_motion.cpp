#include "contacts/ground_motion.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// Points on the ground are used up to this distance.
constexpr double kMaxRange_m = 8.0;
constexpr int kNumSteps = 8;
// The kernel narrows between these numbers of standard deviations.
constexpr double kFirstScale = 10.0, kLastScale = 2.0;
// Prior deviations: of the rotation, and of the translation at rest and with the travel.
constexpr double kRotation_rad = 0.004, kTranslation_m = 0.005, kTranslationPerTravel = 0.02;

}  // namespace

std::vector<RayPair> rayPairsSince(Timestamp before, const std::vector<PointTrack>& tracks,
                                   const Eigen::Quaterniond& vehicle_from_camera) {
  std::vector<RayPair> pairs;
  for (const PointTrack& track : tracks) {
    for (const PointObservation& observation : track) {
      if (observation.stamp == before) {
        pairs.push_back({vehicle_from_camera * track.back().ray_in_camera,
                         vehicle_from_camera * observation.ray_in_camera});
      }
    }
  }
  return pairs;
}

RigidTransform fitGroundMotion(const RigidTransform& before_from_now, const std::vector<RayPair>& points,
                               const Eigen::Vector3d& camera_in_vehicle_m, double sigma_rad) {
  const double translation_sigma_m =
      kTranslation_m + kTranslationPerTravel * before_from_now.translation().norm();
  Vector6 prior;
  prior << Eigen::Vector3d::Constant(1.0 / (kRotation_rad * kRotation_rad)),
      Eigen::Vector3d::Constant(1.0 / (translation_sigma_m * translation_sigma_m));
  Vector6 correction = Vector6::Zero();  // rotation vector and translation in the earlier vehicle's axes
  const auto corrected = [&] {
    return RigidTransform(rotationFromVector(correction.head<3>()) * before_from_now.rotation(),
                          before_from_now.translation() + correction.tail<3>());
  };
  for (int step = 0; step < kNumSteps; ++step) {
    const double scale =
        kFirstScale + (kLastScale - kFirstScale) * std::min(1.0, 1.5 * step / (kNumSteps - 1));
    const RigidTransform motion = corrected();
    Matrix6 information = prior.asDiagonal();
    Vector6 vector = -prior.cwiseProduct(correction);
    for (const RayPair& point : points) {
      if (!(-point.now.z() * kMaxRange_m > camera_in_vehicle_m.z())) {
        continue;
      }
      const Eigen::Vector3d ground =
          camera_in_vehicle_m - camera_in_vehicle_m.z() / point.now.z() * point.now;
      const Eigen::Vector3d turned = motion.rotation() * ground;
      const Eigen::Vector3d seen = turned + motion.translation() - camera_in_vehicle_m;
      const double depth_m = seen.dot(point.before);
      if (depth_m < 0.1) {
        continue;
      }
      const Eigen::Vector3d first = point.before.unitOrthogonal();
      Eigen::Matrix<double, 2, 3> tangents;
      tangents.row(0) = first.transpose() / depth_m;
      tangents.row(1) = point.before.cross(first).transpose() / depth_m;
      const Eigen::Vector2d residual = -tangents * seen;
      Eigen::Matrix<double, 2, 6> jacobian;
      jacobian << -tangents * crossMatrix(turned), tangents;
      const double squared = residual.squaredNorm() / (scale * scale * sigma_rad * sigma_rad);
      const double weight = 1.0 / ((1.0 + squared) * (1.0 + squared) * sigma_rad * sigma_rad);
      information += weight * jacobian.transpose() * jacobian;
      vector += weight * jacobian.transpose() * residual;
    }
    correction += information.ldlt().solve(vector);
  }
  return corrected();
}

}  // namespace vcharge
