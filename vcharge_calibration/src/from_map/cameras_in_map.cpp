#include "from_map/cameras_in_map.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "initialization/rig_initialization.h"
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

/// Minimum ratio of keyframes at which a camera must be localized.
constexpr double kMinFixRatio = 0.2;
/// Minimum standard deviations of a motion, because covariances underestimate them.
constexpr double kMinDirectionSigma_rad = 0.003;
constexpr double kMinRotationSigma_rad = 0.0003;
/// Directions with a larger standard deviation are not used.
constexpr double kMaxDirectionSigma_rad = 0.3;

/// Extrapolates poses along the odometry to the keyframes before and after that have none.
void extendByOdometry(const std::vector<Keyframe>& keyframes,
                      std::vector<std::optional<RigidTransform>>* poses) {
  const auto extend = [&](size_t from, size_t to) {
    if ((*poses)[from] && !(*poses)[to]) {
      (*poses)[to] =
          *(*poses)[from] * (keyframes[from].odom_from_vehicle.inverse() * keyframes[to].odom_from_vehicle);
    }
  };
  for (size_t k = 1; k < poses->size(); ++k) {
    extend(k - 1, k);
  }
  for (size_t k = poses->size() - 1; k > 0; --k) {
    extend(k, k - 1);
  }
}

}  // namespace

void requireEnoughFixes(const std::vector<MapKeyframeView>& views, const CameraRig& rig) {
  std::vector<std::string> failures;
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    const auto found = std::count_if(views.begin(), views.end(), [&](const MapKeyframeView& view) {
      return view.camera_fixes[i].has_value();
    });
    if (static_cast<double>(found) < kMinFixRatio * static_cast<double>(views.size())) {
      failures.push_back("camera '" + rig.cameras[i].name + "' was found in the map at only " +
                         std::to_string(found) + " of " + std::to_string(views.size()) +
                         " keyframes: is it covered, or is this another place than the map's?");
    }
  }
  if (!failures.empty()) {
    throw NotCalibrated{failures};
  }
}

std::vector<MotionPair> motionsInMap(const std::vector<MapKeyframeView>& views,
                                     const std::vector<Keyframe>& keyframes, size_t camera) {
  std::vector<MotionPair> motions;
  for (size_t i = 1; i < views.size(); ++i) {
    const std::optional<PoseFix>& previous = views[i - 1].camera_fixes[camera];
    const std::optional<PoseFix>& current = views[i].camera_fixes[camera];
    if (!previous || !current) {
      continue;
    }
    const RigidTransform moved = previous->map_from_vehicle.inverse() * current->map_from_vehicle;
    const double distance_m = moved.translation().norm();
    const Eigen::Matrix<double, 6, 6> covariance = previous->covariance + current->covariance;
    MotionPair pair;
    pair.keyframe = static_cast<int32_t>(i) - 1;
    pair.vehicle = keyframes[i - 1].odom_from_vehicle.inverse() * keyframes[i].odom_from_vehicle;
    pair.camera_rotation = moved.rotation();
    pair.rotation_sigma_rad =
        std::hypot(std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3.0), kMinRotationSigma_rad);
    pair.direction_sigma_rad = std::hypot(
        std::sqrt(covariance.topLeftCorner<3, 3>().trace() / 3.0) / distance_m, kMinDirectionSigma_rad);
    pair.has_direction = pair.direction_sigma_rad < kMaxDirectionSigma_rad;
    pair.camera_direction =
        pair.has_direction ? moved.translation().normalized() : Eigen::Vector3d::UnitZ().eval();
    motions.push_back(pair);
  }
  return motions;
}

double heightInMap(const std::vector<MapKeyframeView>& views, const SparseMap& map, size_t camera) {
  std::vector<double> heights_m;
  for (const MapKeyframeView& view : views) {
    if (!view.camera_fixes[camera]) {
      continue;
    }
    const Eigen::Vector3d& position_m = view.camera_fixes[camera]->map_from_vehicle.translation();
    const auto nearest = std::min_element(
        map.keyframes().begin(), map.keyframes().end(), [&](const MapKeyframe& a, const MapKeyframe& b) {
          return (a.map_from_vehicle.translation() - position_m).squaredNorm() <
                 (b.map_from_vehicle.translation() - position_m).squaredNorm();
        });
    heights_m.push_back((nearest->map_from_vehicle.inverse() * position_m).z());
  }
  return quantile(heights_m, 0.5);
}

void setPosesByFixes(const std::vector<MapKeyframeView>& views, ReconstructionData* data) {
  std::vector<std::optional<RigidTransform>> poses(views.size());
  for (size_t k = 0; k < views.size(); ++k) {
    int most = 0;
    for (size_t i = 0; i < data->rig->cameras.size(); ++i) {
      const std::optional<PoseFix>& fix = views[k].camera_fixes[i];
      if (fix && fix->numInliers() > most) {
        most = fix->numInliers();
        poses[k] = fix->map_from_vehicle * data->rig->cameras[i].vehicle_from_camera->inverse();
      }
    }
  }
  extendByOdometry(data->keyframes, &poses);
  for (size_t k = 0; k < views.size(); ++k) {
    data->keyframes[k].map_from_vehicle = *poses[k];
  }
}

}  // namespace vcharge
