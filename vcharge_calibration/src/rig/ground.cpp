#include "rig/ground.h"

#include <algorithm>
#include <cmath>

namespace vcharge {
namespace {

constexpr double kMaxRange_m = 5.0;   // of ground points, along the ground
constexpr double kMinBelow_m = 0.15;  // a camera is at least this high
constexpr double kMaxBelow_m = 4.0;
constexpr double kBin_m = 0.02;

/// Landmarks in the vehicle's frame of each keyframe that sees them, near it along the ground.
template <class Use>
void forNearPoints(const MappingData& data, const Use& use) {
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

}  // namespace

std::optional<double> findCameraHeight(const MappingData& data, int32_t camera) {
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
  // The mean of what lies about that level.
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

std::vector<GroundPoint> findGroundPoints(const MappingData& data, double max_distance_m) {
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
      points.push_back(*found);
    }
  }
  return points;
}

}  // namespace vcharge
