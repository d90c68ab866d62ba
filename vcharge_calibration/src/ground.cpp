#include "ground.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace vcharge {
namespace {

constexpr double kMaxRange_m = 6.0;       // of ground points, along the ground
constexpr double kMinBelow_m = 0.15;      // a camera is at least this high
constexpr double kMaxBelow_m = 4.0;
constexpr double kBin_m = 0.02;
constexpr int kMinPoints = 12;            // of a keyframe's plane
constexpr int kMinKeyframes = 10;
constexpr double kRoughness_m = 0.02;     // scale of the loss
constexpr int kNumSegments = 12;          // of the drive, for the covariance
constexpr int kIterations = 10;

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

/// Robust plane z = h + a x + b y of points; false where they do not determine it.
bool fitPlane(const std::vector<Eigen::Vector3d>& points, Eigen::Vector3d* plane) {
  plane->setZero();
  Eigen::Matrix3d information;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    information.setZero();
    Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& point : points) {
      const Eigen::Vector3d row(1.0, point.x(), point.y());
      const double error = point.z() - row.dot(*plane);
      const double weight = 1.0 / (1.0 + error * error / (kRoughness_m * kRoughness_m));
      information += weight * row * row.transpose();
      right_side += weight * point.z() * row;
    }
    *plane = information.ldlt().solve(right_side);
    if (!plane->allFinite()) {
      return false;
    }
  }
  // Points must lie around, not in a row: a slope of 1 cm per metre must be told.
  const Eigen::Matrix3d covariance = kRoughness_m * kRoughness_m * information.inverse();
  return std::sqrt(std::max(covariance(1, 1), covariance(2, 2))) < 0.01;
}

}  // namespace

std::optional<double> findCameraHeight(const MappingData& data, int32_t camera) {
  std::vector<double> histogram(static_cast<size_t>(kMaxBelow_m / kBin_m) + 1, 0.0);
  std::vector<double> depths_m;
  forNearPoints(data, [&](const TrackObservation& observation, const Eigen::Vector3d& point) {
    if (observation.camera == camera) {
      const double below_m =
          data.rig->cameras[camera].vehicle_from_camera->translation().z() - point.z();
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
    const double count = histogram[i - 2] + 2.0 * histogram[i - 1] + 3.0 * histogram[i] + 2.0 * histogram[i + 1] +
                         histogram[i + 2];
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

std::optional<GroundPlane> fitGround(const MappingData& data, double max_distance_m) {
  std::vector<std::vector<Eigen::Vector3d>> points(data.keyframes.size());
  forNearPoints(data, [&](const TrackObservation& observation, const Eigen::Vector3d& point) {
    if (std::abs(point.z()) < max_distance_m) {
      points[observation.keyframe].push_back(point);
    }
  });
  std::vector<Eigen::Vector3d> planes;
  GroundPlane ground;
  size_t num_points = 0;
  for (const std::vector<Eigen::Vector3d>& of_keyframe : points) {
    Eigen::Vector3d plane;
    if (static_cast<int>(of_keyframe.size()) >= kMinPoints && fitPlane(of_keyframe, &plane)) {
      planes.push_back(plane);
      num_points += of_keyframe.size();
    }
  }
  ground.num_keyframes = static_cast<int>(planes.size());
  if (ground.num_keyframes < kMinKeyframes) {
    return std::nullopt;
  }
  ground.num_points = static_cast<int>(num_points / planes.size());
  Eigen::Vector3d median;
  for (int i = 0; i < 3; ++i) {
    std::vector<double> values;
    for (const Eigen::Vector3d& plane : planes) {
      values.push_back(plane[i]);
    }
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                     values.end());
    median[i] = values[values.size() / 2];
  }
  // Means of consecutive parts of the drive, without keyframes that are far off.
  const Eigen::Vector3d far(0.1, 0.05, 0.05);
  std::vector<Eigen::Vector3d> segments;
  for (int s = 0; s < kNumSegments; ++s) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int num = 0;
    for (size_t i = planes.size() * s / kNumSegments; i < planes.size() * (s + 1) / kNumSegments; ++i) {
      if (((planes[i] - median).cwiseAbs().array() < far.array()).all()) {
        sum += planes[i];
        ++num;
      }
    }
    if (num > 0) {
      segments.emplace_back(sum / num);
      ground.height_and_slopes += sum / num;
    }
  }
  if (segments.size() < 3) {
    return std::nullopt;
  }
  const auto num_segments = static_cast<double>(segments.size());
  ground.height_and_slopes /= num_segments;
  for (const Eigen::Vector3d& segment : segments) {
    const Eigen::Vector3d difference = segment - ground.height_and_slopes;
    ground.covariance += difference * difference.transpose() / (num_segments * (num_segments - 1.0));
  }
  return ground;
}

RigidTransform levelFromVehicle(const GroundPlane& ground) {
  // A small turn w moves a point by w x p, in z by w_x y - w_y x.
  const Eigen::Vector3d& plane = ground.height_and_slopes;
  return RigidTransform(rotationFromVector(Eigen::Vector3d(-plane[2], plane[1], 0.0)),
                        Eigen::Vector3d(0.0, 0.0, -plane[0]));
}

void moveVehicleFrame(const RigidTransform& new_from_old, MappingData* data) {
  auto rig = std::make_shared<CameraRig>(*data->rig);
  for (RigCamera& camera : rig->cameras) {
    camera.vehicle_from_camera = new_from_old * *camera.vehicle_from_camera;
  }
  data->rig = rig;
  const RigidTransform old_from_new = new_from_old.inverse();
  for (Keyframe& keyframe : data->keyframes) {
    keyframe.map_from_vehicle = new_from_old * keyframe.map_from_vehicle * old_from_new;
  }
  for (Track& track : data->tracks) {
    if (track.position_m) {
      track.position_m = new_from_old * *track.position_m;
    }
  }
}

}  // namespace vcharge
