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

// Ground points are looked for in every so many-th column and row of the pixels in use: they are plenty.
constexpr size_t kGroundStride = 7;

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

/// What pixels that look at the ground of a cell show.
struct GroundEvidence {
  explicit GroundEvidence(const PolarGrid& grid) : bare(grid), hidden(grid), unknown(grid) {}
  StripSum bare, hidden, unknown;
};

}  // namespace

struct ObstacleDetector::Implementation {
  Implementation(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                 const ObstacleDetectorOptions& detector_options)
      : options(detector_options),
        grid(options.grid),
        size(camera.size()),
        position(vehicle_from_camera.translation().cast<float>()),
        rays(camera, vehicle_from_camera, grid, options.pixel_step),
        expected(rays, grid, position.z(), options.min_height_m, options.reference_height_m),
        overseen_m(overseenRange(rays, grid, position.z())) {
    const Eigen::Vector3d axis = vehicle_from_camera.rotation() * Eigen::Vector3d::UnitZ();
    const double axis_rad = std::atan2(axis.y(), axis.x());
    for (int ray = 0; ray < grid.numRays(); ++ray) {
      const double off_axis_rad = std::abs(std::remainder(grid.angle_rad(ray) - axis_rad, 2.0 * M_PI));
      is_off_axis.push_back(off_axis_rad > options.max_off_axis_rad);
      free_to_m.push_back(is_off_axis.back() ? options.max_off_axis_free_m
                                             : std::numeric_limits<double>::infinity());
    }
  }

  bool usable(float range_m, float sigma_m, float confidence) const {
    return range_m > 0.0F && confidence >= static_cast<float>(options.min_confidence) &&
           sigma_m <= static_cast<float>(options.max_relative_sigma) * range_m;  // false for NaN
  }
  bool isOwnVehicle(float x_m, float y_m) const {
    return x_m < options.vehicle_front_m && x_m > options.vehicle_rear_m &&
           std::abs(y_m) < options.vehicle_half_width_m;
  }
  GroundCandidates collectGround(const RangeMap& map) const;
  PolarPoints collectPoints(const RangeMap& map, const GroundPlane& ground, GroundEvidence* evidence) const;
  void addGroundStrip(size_t i, const GroundPlane& ground, float weight, StripSum* sum) const;
  std::vector<float> shareOf(const std::vector<float>& weights) const;
  void dropOverhungGround(std::vector<float>* free_share) const;

  const ObstacleDetectorOptions options;
  const PolarGrid grid;
  const cv::Size size;
  const Eigen::Vector3f position;
  const PixelRays rays;
  const ExpectedPixels expected;
  const std::vector<double> overseen_m;  // by sector
  std::vector<bool> is_off_axis;         // by sector
  std::vector<double> free_to_m;         // by sector
};

void ObstacleDetectorOptions::validate() const {
  validateInner("grid", grid);
  validateInner("ground", ground);
  requireField(pixel_step >= 1 && pixel_step <= 8, "pixel_step", "must be in [1, 8]", pixel_step);
  requireField(min_height_m > 0.0, "min_height_m", "must be positive", min_height_m);
  requireField(reference_height_m > min_height_m, "reference_height_m", "must be above min_height_m",
               reference_height_m);
  requireField(max_height_m > reference_height_m, "max_height_m", "must be above reference_height_m",
               max_height_m);
  requireField(min_confidence >= 0.0 && min_confidence < 1.0, "min_confidence", "must be in [0, 1)",
               min_confidence);
  requireField(reference_confidence > 0.5 && reference_confidence < 1.0, "reference_confidence",
               "must be in (0.5, 1)", reference_confidence);
  requireField(max_relative_sigma > 0.0, "max_relative_sigma", "must be positive", max_relative_sigma);
  requireField(min_support > 0.0 && min_support <= 1.0, "min_support", "must be in (0, 1]", min_support);
  requireField(min_support_behind >= min_support, "min_support_behind", "must not be below min_support",
               min_support_behind);
  requireField(min_points > 0.0, "min_points", "must be positive", min_points);
  requireField(min_ratio > 0.0 && min_ratio < 1.0, "min_ratio", "must be in (0, 1)", min_ratio);
  requireField(min_separation_m > 0.0, "min_separation_m", "must be positive", min_separation_m);
  requireField(max_obstacles_per_ray >= 1, "max_obstacles_per_ray", "must be positive",
               max_obstacles_per_ray);
  requireField(max_off_axis_rad > 0.0, "max_off_axis_rad", "must be positive", max_off_axis_rad);
  requireField(max_off_axis_range_m >= 0.0, "max_off_axis_range_m", "must not be negative",
               max_off_axis_range_m);
  requireField(max_off_axis_free_m >= 0.0, "max_off_axis_free_m", "must not be negative",
               max_off_axis_free_m);
  requireField(max_ramp_height_m >= 0.0, "max_ramp_height_m", "must not be negative", max_ramp_height_m);
  requireField(max_ramp_length_m >= 0.0, "max_ramp_length_m", "must not be negative", max_ramp_length_m);
  requireField(ramp_weight >= 0.0 && ramp_weight <= 1.0, "ramp_weight", "must be in [0, 1]", ramp_weight);
  requireField(sure_ground_sigmas >= 0.0, "sure_ground_sigmas", "must not be negative", sure_ground_sigmas);
  requireField(below_ground_m > 0.0, "below_ground_m", "must be positive", below_ground_m);
  requireField(lost_ground_tilt_rad > ground.max_tilt_rad, "lost_ground_tilt_rad",
               "must be above ground.max_tilt_rad", lost_ground_tilt_rad);
  requireField(vehicle_front_m > vehicle_rear_m, "vehicle_front_m", "must be above vehicle_rear_m",
               vehicle_front_m);
  requireField(vehicle_half_width_m > 0.0, "vehicle_half_width_m", "must be positive", vehicle_half_width_m);
}

ObstacleDetector::ObstacleDetector(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                                   const ObstacleDetectorOptions& options) {
  options.validate();
  const double height_m = vehicle_from_camera.translation().z();
  if (!(height_m > options.reference_height_m + 0.05)) {
    throw std::invalid_argument(
        "vehicle_from_camera: the camera must stand above reference_height_m, is at " +
        std::to_string(height_m) + " m");
  }
  implementation_ = std::make_shared<const Implementation>(camera, vehicle_from_camera, options);
}

const PolarGrid& ObstacleDetector::grid() const {
  return implementation_->grid;
}

GroundCandidates ObstacleDetector::Implementation::collectGround(const RangeMap& map) const {
  GroundCandidates candidates;
  const auto* range_m = map.range_m.ptr<float>();
  const auto* sigma_m = map.standard_deviation_m.ptr<float>();
  const auto* confidence = map.confidence.ptr<float>();
  // Wider than the bounds, so that a ground beyond them is found and told.
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

/// The ground that a pixel would show if nothing stood on it.
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
  const auto lost_slope = static_cast<float>(options.lost_ground_tilt_rad);
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
    const bool sure = height + static_cast<float>(options.sure_ground_sigmas) * height_sigma < threshold &&
                      height > -static_cast<float>(options.below_ground_m) - 2.0F * height_sigma;
    if (height < -static_cast<float>(options.below_ground_m) - 2.0F * height_sigma) {
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

std::vector<float> ObstacleDetector::Implementation::shareOf(const std::vector<float>& weights) const {
  std::vector<float> share(weights.size(), 0.0F);
  for (size_t i = 0; i < weights.size(); ++i) {
    // One pixel more: a cell that hardly any pixel shows is not free by one of them.
    share[i] = std::min(1.0F, weights[i] / (expected.ground[i] + 1.0F));
  }
  return share;
}

/// Ground over which the image ends too low is no evidence: the body under which it shows may lie outside.
void ObstacleDetector::Implementation::dropOverhungGround(std::vector<float>* free_share) const {
  for (int ray = 0; ray < grid.numRays(); ++ray) {
    const double from_m = std::max(options.max_off_axis_range_m, overseen_m[static_cast<size_t>(ray)]);
    for (int bin = 0; bin < grid.numBins() && grid.range_m(bin) > from_m; ++bin) {
      (*free_share)[grid.index(ray, bin)] = 0.0F;
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
  result.ground = fitGroundPlane(self.collectGround(map), self.options.ground);
  GroundEvidence evidence(self.grid);
  const PolarPoints points = self.collectPoints(map, result.ground, &evidence);
  result.free_share = self.shareOf(evidence.bare.finish());
  self.dropOverhungGround(&result.free_share);
  result.hidden_share = self.shareOf(evidence.hidden.finish());
  result.unknown_share = self.shareOf(evidence.unknown.finish());
  result.occupied_share = points.occupiedShare();
  result.obstacles = findPolarObstacles(points, self.expected.obstacle, self.options);
  for (PolarObstacle& obstacle : result.obstacles) {
    obstacle.is_off_axis = self.is_off_axis[static_cast<size_t>(obstacle.ray)] &&
                           obstacle.range_m > self.options.max_off_axis_range_m;
  }
  result.scan = makePolarScan(self.grid, result.obstacles, result.free_share, self.expected.ground);
  result.scan.stamp = map.stamp;
  result.scan.name = map.camera_name;
  result.scan.origin_m = result.origin_m;
  size_t known = 0;
  const auto* range_m = map.range_m.ptr<float>();
  for (const int pixel : self.rays.pixel) {
    known += std::isfinite(range_m[pixel]) ? 1 : 0;
  }
  result.known_share =
      static_cast<double>(known) / static_cast<double>(std::max<size_t>(1, self.rays.size()));
  return result;
}

}  // namespace vcharge
