#include "vcharge_reconstruction/landmarks/triangulation.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>
#include <Eigen/Cholesky>

namespace vcharge {
namespace {

constexpr int kIterations = 3;
constexpr double kMinRange_m = 0.3;
/// Two rays often meet by chance, so a landmark needs more observations.
constexpr int kMinObservations = 3;

double largestParallax(const std::vector<Ray>& rays) {
  double min_cosine = 1.0;
  for (size_t i = 0; i < rays.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      min_cosine = std::min(min_cosine, rays[i].direction.dot(rays[j].direction));
    }
  }
  return std::acos(std::max(-1.0, min_cosine));
}

/// Least squares of the distances to the rays, each divided by its range: an approximation of the angles.
std::optional<Eigen::Vector3d> nearestPoint(const std::vector<Ray>& rays) {
  if (rays.size() < 2) {
    return std::nullopt;
  }
  std::vector<double> weights(rays.size(), 1.0);
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < rays.size(); ++i) {
      const Eigen::Matrix3d across =
          weights[i] * (Eigen::Matrix3d::Identity() - rays[i].direction * rays[i].direction.transpose());
      normal_matrix += across;
      right_side += across * rays[i].origin_m;
    }
    point = normal_matrix.ldlt().solve(right_side);
    if (!point.allFinite()) {
      return std::nullopt;
    }
    for (size_t i = 0; i < rays.size(); ++i) {
      weights[i] = 1.0 / std::max(1e-4, (point - rays[i].origin_m).squaredNorm());
    }
  }
  return point;
}

/// Sine of the angle between a ray and its point; infinite if the point is behind or out of range.
double angularError(const Ray& ray, const Eigen::Vector3d& point, const TriangulationOptions& options) {
  const Eigen::Vector3d to_point = point - ray.origin_m;
  const double range_m = to_point.norm();
  if (!(range_m >= kMinRange_m && range_m <= options.max_range_m) || to_point.dot(ray.direction) <= 0.0) {
    return INFINITY;
  }
  return to_point.cross(ray.direction).norm() / range_m;
}

/// Triangulates after removing the worst rays, as long as enough are left, since a tracked patch may have
/// slipped.
std::optional<Eigen::Vector3d> triangulateMostOf(std::vector<Ray>* rays,
                                                 const TriangulationOptions& options) {
  while (static_cast<int>(rays->size()) >= kMinObservations) {
    const std::optional<Eigen::Vector3d> point = nearestPoint(*rays);
    if (!point || largestParallax(*rays) < options.min_parallax_rad) {
      return std::nullopt;
    }
    size_t worst = 0;
    double worst_error = 0.0;
    for (size_t i = 0; i < rays->size(); ++i) {
      const double error = angularError((*rays)[i], *point, options);
      if (error > worst_error) {
        worst_error = error;
        worst = i;
      }
    }
    if (worst_error <= options.max_error_rad) {
      return point;
    }
    rays->erase(rays->begin() + static_cast<std::ptrdiff_t>(worst));
  }
  return std::nullopt;
}

}  // namespace

std::optional<Eigen::Vector3d> triangulate(const std::vector<Ray>& rays,
                                           const TriangulationOptions& options) {
  const std::optional<Eigen::Vector3d> point = nearestPoint(rays);
  if (!point || largestParallax(rays) < options.min_parallax_rad) {
    return std::nullopt;
  }
  for (const Ray& ray : rays) {
    if (angularError(ray, *point, options) > options.max_error_rad) {
      return std::nullopt;
    }
  }
  return point;
}

bool observationRay(const ReconstructionData& data, const TrackObservation& observation, Ray* ray_in_map) {
  const RigCamera& camera = data.rig->cameras[observation.camera];
  Eigen::Vector3d ray_in_camera;
  if (!camera.model.unproject(observation.position_px, &ray_in_camera)) {
    return false;
  }
  const RigidTransform map_from_camera =
      cameraAt(data.keyframes[observation.keyframe], *data.rig, observation.camera)
          .poseAt(observation.position_px);
  *ray_in_map = map_from_camera * Ray{Eigen::Vector3d::Zero(), ray_in_camera};
  return true;
}

void triangulateTracks(const TriangulationOptions& options, ReconstructionData* data) {
  tbb::parallel_for(size_t{0}, data->tracks.size(), [&](size_t i) {
    Track& track = data->tracks[i];
    track.position_m.reset();
    if (static_cast<int>(track.observations.size()) < kMinObservations) {
      return;
    }
    std::vector<Ray> rays;
    for (const TrackObservation& observation : track.observations) {
      Ray ray;
      if (observationRay(*data, observation, &ray)) {
        rays.push_back(ray);
      }
    }
    track.position_m = triangulateMostOf(&rays, options);
  });
}

}  // namespace vcharge
