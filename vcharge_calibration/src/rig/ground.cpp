#include "rig/ground.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "initialization/rig_initialization.h"
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

constexpr double kMaxRange_m = 5.0;  // maximum horizontal distance of ground points
// Bounds on the height of a camera above the ground.
constexpr double kMinBelow_m = 0.15;
constexpr double kMaxBelow_m = 4.0;
constexpr double kBin_m = 0.02;
// Landmarks whose height is imprecise are too high, by a third of their deviation: those behind the side
// cameras and behind the car would tilt it. The most precise ones count, and all within this deviation.
constexpr double kPreciseHeight_m = 0.003;
constexpr double kLeastPreciseRatio = 0.25;
// Neighbouring landmarks err alike: as many of them tell as much as one that is independent. Chosen on
// simulated drives in a lot, in a garage and at night, where the ground is seen in the light of the lamps
// only. Against the images, fewer hardly move the cameras.
constexpr double kAlike = 16.0;

/// Calls `use` with each observation whose landmark is near its camera, and the landmark in the vehicle's
/// frame.
template <class Use>
void forNearPoints(const ReconstructionData& data, const Use& use) {
  for (const Track& track : data.tracks) {
    if (!track.position_m) {
      continue;
    }
    for (const TrackObservation& observation : track.observations) {
      const RigidTransform& map_from_vehicle = data.keyframes[observation.keyframe].map_from_vehicle;
      const Eigen::Vector3d point = map_from_vehicle.inverse() * *track.position_m;
      const Eigen::Vector3d& camera =
          data.rig->cameras[observation.camera].vehicle_from_camera->translation();
      if ((point - camera).head<2>().norm() < kMaxRange_m) {
        use(observation, point);
      }
    }
  }
}

/// Standard deviation of a landmark's height above a keyframe; infinite where the landmark has not been
/// adjusted.
double heightSigma(const ReconstructionData& data, size_t track, int32_t keyframe) {
  const Eigen::Vector3d up = data.keyframes[keyframe].map_from_vehicle.rotationMatrix().col(2);
  const double variance_m2 = up.dot(data.tracks[track].covariance_m2 * up);
  return variance_m2 > 0.0 ? std::sqrt(variance_m2) : std::numeric_limits<double>::infinity();
}

std::vector<double> heightSigmas(const std::vector<GroundPoint>& points) {
  std::vector<double> sigmas_m;
  for (const GroundPoint& point : points) {
    sigmas_m.push_back(point.height_sigma_m);
  }
  return sigmas_m;
}

std::vector<GroundPoint> preciseOnes(const std::vector<GroundPoint>& points) {
  if (points.empty()) {
    return points;
  }
  const double limit_m = std::max(kPreciseHeight_m, quantile(heightSigmas(points), kLeastPreciseRatio));
  std::vector<GroundPoint> precise;
  std::copy_if(points.begin(), points.end(), std::back_inserter(precise),
               [&](const GroundPoint& point) { return point.height_sigma_m <= limit_m; });
  return precise;
}

}  // namespace

std::optional<double> findCameraHeight(const ReconstructionData& data, int32_t camera) {
  std::vector<double> histogram(static_cast<size_t>(kMaxBelow_m / kBin_m) + 1, 0.0);
  std::vector<double> depths_m;
  forNearPoints(data, [&](const TrackObservation& observation, const Eigen::Vector3d& point) {
    if (observation.camera == camera) {
      const double below_m = data.rig->cameras[camera].vehicle_from_camera->translation().z() - point.z();
      if (below_m > kMinBelow_m && below_m < kMaxBelow_m) {
        ++histogram[static_cast<size_t>(below_m / kBin_m)];
        depths_m.push_back(below_m);
      }
    }
  });
  if (depths_m.size() < 100) {
    return std::nullopt;
  }
  size_t best = 2;
  double best_count = 0.0;
  for (size_t i = 2; i + 2 < histogram.size(); ++i) {
    const double count = histogram[i - 2] + 2.0 * histogram[i - 1] + 3.0 * histogram[i] +
                         2.0 * histogram[i + 1] + histogram[i + 2];
    if (count > best_count) {
      best_count = count;
      best = i;
    }
  }
  // Mean of the points near the most frequent level.
  const double mode_m = (static_cast<double>(best) + 0.5) * kBin_m;
  double sum = 0.0, num = 0.0;
  for (const double depth_m : depths_m) {
    if (std::abs(depth_m - mode_m) < 3.0 * kBin_m) {
      sum += depth_m;
      ++num;
    }
  }
  return num < 30.0 ? std::nullopt : std::make_optional(sum / num);
}

std::shared_ptr<const CameraRig> withCameraHeights(const ReconstructionData& data) {
  std::vector<double> heights_m;
  std::vector<std::optional<double>> height_of_camera;
  for (size_t i = 0; i < data.rig->cameras.size(); ++i) {
    height_of_camera.push_back(findCameraHeight(data, static_cast<int32_t>(i)));
    if (height_of_camera.back()) {
      heights_m.push_back(*height_of_camera.back());
    }
  }
  if (heights_m.empty()) {
    throw NotCalibrated{{"no camera sees the ground near the vehicle: the cameras' heights are unknown"}};
  }
  std::sort(heights_m.begin(), heights_m.end());
  auto raised = std::make_shared<CameraRig>(*data.rig);
  for (size_t i = 0; i < raised->cameras.size(); ++i) {
    const RigidTransform& level = *data.rig->cameras[i].vehicle_from_camera;
    Eigen::Vector3d position_m = level.translation();
    position_m.z() = height_of_camera[i].value_or(heights_m[heights_m.size() / 2]);
    raised->cameras[i].vehicle_from_camera = RigidTransform(level.rotation(), position_m);
  }
  return raised;
}

std::vector<GroundPoint> findGroundPoints(const ReconstructionData& data, double max_distance_m) {
  std::vector<GroundPoint> points;
  for (size_t t = 0; t < data.tracks.size(); ++t) {
    const Track& track = data.tracks[t];
    if (!track.position_m) {
      continue;
    }
    double nearest_m = kMaxRange_m;
    std::optional<GroundPoint> found;
    for (const TrackObservation& observation : track.observations) {
      const Eigen::Vector3d point =
          data.keyframes[observation.keyframe].map_from_vehicle.inverse() * *track.position_m;
      const double range_m = point.head<2>().norm();
      if (range_m < nearest_m) {
        nearest_m = range_m;
        found.reset();
        if (std::abs(point.z()) < max_distance_m) {
          found = GroundPoint{static_cast<int32_t>(t), observation.keyframe};
        }
      }
    }
    if (found) {
      found->height_sigma_m = heightSigma(data, t, found->keyframe);
      points.push_back(*found);
    }
  }
  return points;
}

std::vector<GroundPoint> findPreciseGround(const ReconstructionData& data, double max_distance_m) {
  return preciseOnes(findGroundPoints(data, max_distance_m));
}

GroundBias findGroundBias(const ReconstructionData& data, const std::vector<GroundPoint>& points) {
  GroundBias bias;
  const double sigma_m = points.empty() ? 0.0 : quantile(heightSigmas(points), 0.5);
  if (!(sigma_m > 0.0 && std::isfinite(sigma_m))) {
    return bias;
  }
  Eigen::Array2d sum = Eigen::Array2d::Zero(), squares = Eigen::Array2d::Zero();
  for (const GroundPoint& point : points) {
    const RigidTransform vehicle_from_map = data.keyframes[point.keyframe].map_from_vehicle.inverse();
    const Eigen::Array2d position_m = (vehicle_from_map * *data.tracks[point.track].position_m).head<2>();
    sum += position_m;
    squares += position_m.square();
  }
  const auto count = static_cast<double>(points.size());
  const Eigen::Array2d spread_m = (squares / count - (sum / count).square()).max(1e-4).sqrt();
  bias.height_m = std::sqrt(kAlike * count) / (kAlike + count) * sigma_m;
  bias.roll_rad = bias.height_m / spread_m.y();
  bias.pitch_rad = bias.height_m / spread_m.x();
  return bias;
}

}  // namespace vcharge
