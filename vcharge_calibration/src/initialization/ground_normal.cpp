#include "initialization/ground_normal.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace vcharge {
namespace {

constexpr double kMaxRange_m = 5.0;  // maximum distance between a point and the nearest camera
constexpr double kMinHeight_m = 0.15;
constexpr double kMaxHeight_m = 4.0;
constexpr double kThickness_m = 0.04;
constexpr double kMaxSlope = 0.1;  // maximum slope of the ground along the path
constexpr double kMinUprightness =
    0.5;  // minimum cosine between upwards and the mean of the image's up and backwards
constexpr size_t kMinPoints = 40;
constexpr int kNumSamples = 2000;
constexpr uint32_t kSeed = 5;

/// Path of the camera, from its rotations and directions and the odometer's distances, and points near it.
struct CameraPath {
  std::vector<Eigen::Vector3d> positions_m;
  std::vector<Eigen::Matrix3d> path_from_camera;
  std::vector<Eigen::Vector3d> points_m;  ///< points near the path
};

CameraPath followCamera(const ReconstructionData& data, int32_t camera,
                        const std::vector<MotionPair>& motions, const TriangulationOptions& options) {
  ReconstructionData alone;
  auto rig = std::make_shared<CameraRig>(*data.rig);
  rig->cameras[camera].vehicle_from_camera = RigidTransform();
  alone.rig = rig;
  alone.keyframes.resize(data.keyframes.size());
  size_t next = 0;
  for (size_t k = 0; k + 1 < data.keyframes.size(); ++k) {
    RigidTransform step;
    if (next < motions.size() && motions[next].keyframe == static_cast<int32_t>(k)) {
      const MotionPair& motion = motions[next++];
      step = RigidTransform(motion.camera_rotation,
                            motion.vehicle.translation().norm() * motion.camera_direction);
    }
    alone.keyframes[k + 1].map_from_vehicle = alone.keyframes[k].map_from_vehicle * step;
  }
  for (const Track& track : data.tracks) {
    if (!track.observations.empty() && track.observations.front().camera == camera) {
      alone.tracks.push_back(track);
      alone.tracks.back().position_m.reset();
    }
  }
  triangulateTracks(options, &alone);
  CameraPath path;
  for (const Keyframe& keyframe : alone.keyframes) {
    path.positions_m.push_back(keyframe.map_from_vehicle.translation());
    path.path_from_camera.push_back(keyframe.map_from_vehicle.rotationMatrix());
  }
  for (const Track& track : alone.tracks) {
    const bool is_near =
        track.position_m &&
        std::any_of(path.positions_m.begin(), path.positions_m.end(), [&](const Eigen::Vector3d& position) {
          return (position - *track.position_m).norm() < kMaxRange_m;
        });
    if (is_near) {
      path.points_m.push_back(*track.position_m);
    }
  }
  return path;
}

/// The plane n x = d with upward normal n.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset_m = 0.0;

  double height_m(const Eigen::Vector3d& point) const { return normal.dot(point) - offset_m; }
};

bool canBeGround(const CameraPath& path, const Plane& plane) {
  const Eigen::Vector3d travel = path.positions_m.back() - path.positions_m.front();
  const Eigen::Vector3d upright =
      path.path_from_camera.front() * Eigen::Vector3d(0.0, -1.0, -1.0).normalized();
  return std::abs(plane.normal.dot(travel)) < kMaxSlope * travel.norm() &&
         plane.normal.dot(upright) > kMinUprightness &&
         std::all_of(path.positions_m.begin(), path.positions_m.end(), [&](const Eigen::Vector3d& position) {
           return plane.height_m(position) > kMinHeight_m && plane.height_m(position) < kMaxHeight_m;
         });
}

std::vector<Eigen::Vector3d> pointsIn(const CameraPath& path, const Plane& plane) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& point : path.points_m) {
    if (std::abs(plane.height_m(point)) < kThickness_m) {
      points.push_back(point);
    }
  }
  return points;
}

Plane throughPoint(const Eigen::Vector3d& normal, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& above) {
  const Eigen::Vector3d up = normal.dot(above - point) < 0.0 ? Eigen::Vector3d(-normal) : normal;
  return {up, up.dot(point)};
}

/// Weight of a point's height; the height's error grows with the square of the range.
double weightOf(const CameraPath& path, const Eigen::Vector3d& point) {
  double square_m2 = kMaxRange_m * kMaxRange_m;
  for (const Eigen::Vector3d& position : path.positions_m) {
    square_m2 = std::min(square_m2, (position - point).squaredNorm());
  }
  return 1.0 / (square_m2 * square_m2);
}

Plane fitPlane(const CameraPath& path, const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double sum = 0.0;
  std::vector<double> weights;
  for (const Eigen::Vector3d& point : points) {
    weights.push_back(weightOf(path, point));
    mean += weights.back() * point;
    sum += weights.back();
  }
  mean /= sum;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < points.size(); ++i) {
    scatter += weights[i] * (points[i] - mean) * (points[i] - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
  return throughPoint(eigen.eigenvectors().col(0), mean, path.positions_m.front());
}

}  // namespace

std::optional<Eigen::Vector3d> findUpwards(const ReconstructionData& data, int32_t camera,
                                           const std::vector<MotionPair>& motions,
                                           const TriangulationOptions& options) {
  const CameraPath path = followCamera(data, camera, motions, options);
  if (path.points_m.size() < kMinPoints) {
    return std::nullopt;
  }
  std::mt19937 random(kSeed);
  const auto pick = [&]() -> const Eigen::Vector3d& {
    return path.points_m[random() % path.points_m.size()];
  };
  Plane best;
  size_t most = 0;
  for (int sample = 0; sample < kNumSamples; ++sample) {
    const Eigen::Vector3d &a = pick(), &b = pick(), &c = pick();
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (normal.norm() < 1e-3) {
      continue;
    }
    const Plane plane = throughPoint(normal.normalized(), a, path.positions_m.front());
    if (canBeGround(path, plane)) {
      const size_t count = pointsIn(path, plane).size();
      if (count > most) {
        most = count;
        best = plane;
      }
    }
  }
  if (most < kMinPoints) {
    return std::nullopt;
  }
  constexpr int kRefinements = 5;
  for (int i = 0; i < kRefinements; ++i) {
    best = fitPlane(path, pointsIn(path, best));
  }
  // The mean over the path is the vertical, because the vehicle tilts little.
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Matrix3d& path_from_camera : path.path_from_camera) {
    sum += path_from_camera.transpose() * best.normal;
  }
  return canBeGround(path, best) ? std::make_optional(sum.normalized().eval()) : std::nullopt;
}

}  // namespace vcharge
