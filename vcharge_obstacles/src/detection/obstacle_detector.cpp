#include "vcharge_obstacles/obstacle_detector.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "detection/pixel_rays.h"
#include "detection/polar_obstacles.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Every n-th pixel is a candidate for the ground plane.
constexpr size_t kGroundStride = 7;
// Ranges with a larger relative standard deviation are not used.
constexpr float kMaxRelativeSigma = 0.3F;
// A ground point lies at least this number of standard deviations below min_height_m.
constexpr float kSureGroundSigmas = 1.0F;
// Points further below the ground have wrong ranges.
constexpr float kBelowGround_m = 0.08F;

/// The plane and its covariance in single precision, for the loop over pixels.
struct PlaneTerms {
  explicit PlaneTerms(const GroundPlane& plane)
      : slope_x(static_cast<float>(plane.slope.x())),
        slope_y(static_cast<float>(plane.slope.y())),
        offset(static_cast<float>(plane.offset_m)),
        covariance(plane.covariance.cast<float>()) {}
  float variance(float x, float y) const {
    return covariance(0, 0) + covariance(1, 1) * x * x + covariance(2, 2) * y * y +
           2.0F * (covariance(0, 1) * x + covariance(0, 2) * y + covariance(1, 2) * x * y);
  }
  float slope_x, slope_y, offset;
  Eigen::Matrix3f covariance;
};

/// Weights of the pixels that would show the ground of each cell, by what they actually show.
struct GroundEvidence {
  explicit GroundEvidence(const PolarGrid& grid) : bare(grid), hidden(grid), unknown(grid) {}
  StripSum bare, hidden, unknown;
};

}  // namespace

struct ObstacleDetector::Implementation {
  Implementation(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                 const VehicleOutline& outline, const ObstacleDetectorOptions& detector_options)
      : options(detector_options),
        vehicle(outline),
        grid(options.grid),
        size(camera.size()),
        position(vehicle_from_camera.translation().cast<float>()),
        rays(camera, vehicle_from_camera, grid),
        expected(rays, grid, position.z(), options.min_height_m, kReferenceHeight_m),
        overhung_from_m(fullyVisibleRange(rays, grid, position.z())) {
    for (double& from_m : overhung_from_m) {
      from_m = std::max(kMaxOffAxisRange_m, from_m);
    }
    const Eigen::Vector3d axis = vehicle_from_camera.rotation() * Eigen::Vector3d::UnitZ();
    const double axis_rad = std::atan2(axis.y(), axis.x());
    for (int ray = 0; ray < grid.numRays(); ++ray) {
      const double off_axis_rad = std::abs(std::remainder(grid.angle_rad(ray) - axis_rad, 2.0 * M_PI));
      is_off_axis.push_back(off_axis_rad > options.max_off_axis_rad);
      free_to_m.push_back(is_off_axis.back() ? kMaxOffAxisFree_m : std::numeric_limits<double>::infinity());
    }
  }

  bool usable(float range_m, float sigma_m, float confidence) const {
    return range_m > 0.0F && confidence >= static_cast<float>(options.min_confidence) &&
           sigma_m <= kMaxRelativeSigma * range_m;  // false for NaN
  }
  bool isOwnVehicle(float x_m, float y_m) const {
    return x_m < vehicle.front_m && x_m > vehicle.rear_m && std::abs(y_m) < vehicle.half_width_m;
  }
  GroundCandidates collectGround(const RangeMap& map) const;
  PolarPoints collectPoints(const RangeMap& map, const GroundPlane& ground, GroundEvidence* evidence) const;
  void addGroundStrip(size_t i, const GroundPlane& ground, float weight, StripSum* sum) const;
  std::vector<float> fractionOf(const std::vector<float>& weights) const;
  void dropOverhungGround(std::vector<float>* free_fraction) const;

  const ObstacleDetectorOptions options;
  const VehicleOutline vehicle;
  const PolarGrid grid;
  const cv::Size size;
  const Eigen::Vector3f position;
  const PixelRays rays;
  const ExpectedPixels expected;
  std::vector<double> overhung_from_m;  // one per sector, see fullyVisibleRange()
  std::vector<bool> is_off_axis;        // one per sector
  std::vector<double> free_to_m;        // one per sector
};

ObstacleDetector::ObstacleDetector(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                                   const VehicleOutline& vehicle, const ObstacleDetectorOptions& options) {
  options.validate();
  const double height_m = vehicle_from_camera.translation().z();
  if (!(height_m > kReferenceHeight_m + 0.05)) {
    throw std::invalid_argument(
        "vehicle_from_camera: expected a camera more than 0.25 m above the ground, is at " +
        std::to_string(height_m) + " m");
  }
  implementation_ = std::make_shared<const Implementation>(camera, vehicle_from_camera, vehicle, options);
}

GroundCandidates ObstacleDetector::Implementation::collectGround(const RangeMap& map) const {
  GroundCandidates candidates;
  const auto* range_m = map.range_m.ptr<float>();
  const auto* sigma_m = map.standard_deviation_m.ptr<float>();
  const auto* confidence = map.confidence.ptr<float>();
  // Wider than the bounds, so that ground out of bounds is detected.
  const double steepest = 2.5 * options.ground.max_tilt_rad;
  for (size_t i = 0; i < rays.size(); i += kGroundStride) {
    const int pixel = rays.pixel[i];
    const float range = range_m[pixel];
    if (!usable(range, sigma_m[pixel], confidence[pixel])) {
      continue;
    }
    const Eigen::Vector3f point = position + range * Eigen::Vector3f(rays.x[i], rays.y[i], rays.z[i]);
    const float from_vehicle_m = point.head<2>().norm();
    if (range * rays.horizontal[i] > options.ground.max_distance_m || isOwnVehicle(point.x(), point.y()) ||
        std::abs(point.z()) > options.ground.max_offset_m + steepest * from_vehicle_m) {
      continue;
    }
    candidates.add(point, std::abs(rays.z[i]) * sigma_m[pixel], confidence[pixel]);
  }
  return candidates;
}

/// Adds the strip of ground that a pixel would show without obstacles.
void ObstacleDetector::Implementation::addGroundStrip(size_t i, const GroundPlane& ground, float weight,
                                                      StripSum* sum) const {
  if (rays.z[i] < 0.0F) {
    const float camera_height = position.z() - static_cast<float>(ground.offset_m);
    const float fall = -rays.z[i] / rays.horizontal[i];
    sum->add(rays.polar_ray[i], fall / camera_height,
             fall / (camera_height - static_cast<float>(options.min_height_m)), weight);
  }
}

PolarPoints ObstacleDetector::Implementation::collectPoints(const RangeMap& map, const GroundPlane& ground,
                                                            GroundEvidence* evidence) const {
  PolarPoints points(grid);
  const auto* range_m = map.range_m.ptr<float>();
  const auto* sigma_m = map.standard_deviation_m.ptr<float>();
  const auto* confidence = map.confidence.ptr<float>();
  const PlaneTerms plane(ground);
  const bool lost = ground.state == GroundState::kOutOfBounds;
  const auto lost_slope = static_cast<float>(kLostGroundTilt_rad);
  const auto min_height = static_cast<float>(options.min_height_m);
  const auto max_height = static_cast<float>(options.max_height_m);
  const auto roughness = static_cast<float>(options.ground.roughness_m * options.ground.roughness_m);
  for (size_t i = 0; i < rays.size(); ++i) {
    const int pixel = rays.pixel[i];
    const float range = range_m[pixel];
    if (!usable(range, sigma_m[pixel], confidence[pixel])) {
      addGroundStrip(i, ground, 1.0F, &evidence->unknown);
      continue;
    }
    const float x = position.x() + range * rays.x[i];
    const float y = position.y() + range * rays.y[i];
    const float z = position.z() + range * rays.z[i];
    const float distance = range * rays.horizontal[i];
    const int bin = grid.binOfInverse(1.0F / distance);
    if (isOwnVehicle(x, y) || bin >= grid.numBins()) {
      continue;
    }
    const float height = z - plane.offset - plane.slope_x * x - plane.slope_y * y;
    const float height_by_range = rays.z[i] - plane.slope_x * rays.x[i] - plane.slope_y * rays.y[i];
    const float height_sigma = std::sqrt(height_by_range * height_by_range * sigma_m[pixel] * sigma_m[pixel] +
                                         plane.variance(x, y) + roughness);
    const float threshold = min_height + (lost ? lost_slope * std::hypot(x, y) : 0.0F);
    if (height > threshold) {
      // Logistic approximation of the normal distribution.
      const float above = 1.0F / (1.0F + std::exp(-1.7F * (height - threshold) / height_sigma));
      if (bin >= 0 && height < max_height) {
        points.addObstacle({static_cast<int16_t>(rays.polar_ray[i]), static_cast<int16_t>(bin), distance,
                            sigma_m[pixel] * rays.horizontal[i], height, height_sigma, confidence[pixel],
                            above * confidence[pixel]});
      }
      addGroundStrip(i, ground, confidence[pixel], &evidence->hidden);
      continue;
    }
    const bool sure = height + kSureGroundSigmas * height_sigma < threshold &&
                      height > -kBelowGround_m - 2.0F * height_sigma;
    if (height < -kBelowGround_m - 2.0F * height_sigma) {
      addGroundStrip(i, ground, confidence[pixel], &evidence->hidden);
    }
    if (!sure || lost || ground.state == GroundState::kFewPoints) {
      continue;
    }
    if (bin >= 0) {
      points.addGround(rays.polar_ray[i], bin, confidence[pixel]);
    }
    const float camera_height = position.z() - plane.offset;
    evidence->bare.add(rays.polar_ray[i], 1.0F / distance,
                       camera_height / (distance * (camera_height - min_height)), confidence[pixel]);
  }
  points.sortByRay();
  return points;
}

std::vector<float> ObstacleDetector::Implementation::fractionOf(const std::vector<float>& weights) const {
  std::vector<float> fraction(weights.size(), 0.0F);
  for (size_t i = 0; i < weights.size(); ++i) {
    // The additional pixel prevents one pixel from freeing a cell that few pixels show.
    fraction[i] = std::min(1.0F, weights[i] / (expected.ground[i] + 1.0F));
  }
  return fraction;
}

/// Removes evidence for ground if a body above it would lie outside the image.
void ObstacleDetector::Implementation::dropOverhungGround(std::vector<float>* free_fraction) const {
  for (int ray = 0; ray < grid.numRays(); ++ray) {
    const double from_m = overhung_from_m[static_cast<size_t>(ray)];
    for (int bin = 0; bin < grid.numBins() && grid.range_m(bin) > from_m; ++bin) {
      (*free_fraction)[grid.index(ray, bin)] = 0.0F;
    }
  }
}

CameraObstacles ObstacleDetector::detect(const RangeMap& map) const {
  const Implementation& self = *implementation_;
  check(map.range_m.size() == self.size && map.standard_deviation_m.size() == self.size &&
            map.confidence.size() == self.size && map.range_m.isContinuous() &&
            map.standard_deviation_m.isContinuous() && map.confidence.isContinuous(),
        "ObstacleDetector: expected a range map of the camera's size");
  CameraObstacles result;
  result.stamp = map.stamp;
  result.camera_name = map.camera_name;
  result.origin_m = self.position.head<2>().cast<double>();
  result.camera_height_m = self.position.z();
  result.free_to_m = self.free_to_m;
  result.overhung_from_m = self.overhung_from_m;
  result.ground = fitGroundPlane(self.collectGround(map), self.options.ground);
  GroundEvidence evidence(self.grid);
  const PolarPoints points = self.collectPoints(map, result.ground, &evidence);
  result.free_fraction = self.fractionOf(evidence.bare.finish());
  self.dropOverhungGround(&result.free_fraction);
  result.hidden_fraction = self.fractionOf(evidence.hidden.finish());
  result.unknown_fraction = self.fractionOf(evidence.unknown.finish());
  result.expected_ground = self.expected.ground;
  result.obstacles = findPolarObstacles(points, self.expected.obstacle, self.options.min_support);
  for (PolarObstacle& obstacle : result.obstacles) {
    obstacle.is_off_axis =
        self.is_off_axis[static_cast<size_t>(obstacle.ray)] && obstacle.range_m > kMaxOffAxisRange_m;
  }
  result.scan = makePolarScan(self.grid, result.obstacles, result.free_fraction, self.expected.ground);
  result.scan.stamp = map.stamp;
  result.scan.name = map.camera_name;
  result.scan.origin_m = result.origin_m;
  size_t known = 0;
  const auto* range_m = map.range_m.ptr<float>();
  for (const int pixel : self.rays.pixel) {
    known += std::isfinite(range_m[pixel]) ? 1 : 0;
  }
  result.known_fraction =
      static_cast<double>(known) / static_cast<double>(std::max<size_t>(1, self.rays.size()));
  return result;
}

}  // namespace vcharge
