#include "vcharge_evaluation/obstacle_scan_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vcharge_evaluation/travel_angle.h"

namespace vcharge {
namespace {

constexpr double kNear_m = 2.0;
constexpr double kMinRange_m = 0.5;
// Surfaces between these heights are obstacles.
constexpr double kMinHeight_m = 0.1;
constexpr double kMaxHeight_m = 2.0;
// What is seen above this height only hangs overhead: a pipe below a ceiling, a crown of a tree.
constexpr double kOverheadHeight_m = 1.7;
// An obstacle reaches the judged height within this distance behind its nearest point.
constexpr double kRiseDepth_m = 0.3;
// A reported range that differs by more belongs to another obstacle or to none.
constexpr double kGate_m = 0.5;
constexpr double kRight_m = 0.15;  // allowed error of a range

/// True obstacles in one sector.
struct SectorTruth {
  double range_m = std::numeric_limits<double>::infinity();           // nearest obstacle
  double judged_range_m = std::numeric_limits<double>::infinity();    // nearest one that is high enough
  double overhead_range_m = std::numeric_limits<double>::infinity();  // nearest surface overhead
  double from_travel_rad = 0.0;
};

std::vector<SectorTruth> collectTruth(const ObstacleScan& scan, const std::vector<SeenPoint>& points,
                                      const RigidTransform& world_from_vehicle,
                                      const ObstacleScanEvaluationOptions& options) {
  const double yaw_rad = yawOfRotation(world_from_vehicle.rotation());
  const RigidTransform level = RigidTransform::planar(world_from_vehicle.translation().x(),
                                                      world_from_vehicle.translation().y(), yaw_rad);
  const Eigen::Vector2f origin =
      (level * Eigen::Vector3d(scan.origin_m.x(), scan.origin_m.y(), 0.0)).head<2>().cast<float>();
  std::vector<SectorTruth> truth(scan.size());
  for (const SeenPoint& point : points) {
    const double height_m = point.world_m.z();
    if (height_m < kMinHeight_m || height_m > kMaxHeight_m) {
      continue;
    }
    const Eigen::Vector2f offset = point.world_m.head<2>() - origin;
    const double range_m = offset.norm();
    const double angle_rad =
        std::remainder(std::atan2(offset.y(), offset.x()) - yaw_rad - scan.angle_min_rad, 2.0 * M_PI);
    const auto count = static_cast<int64_t>(scan.size());
    const int64_t ray = (std::lround(angle_rad / scan.angle_increment_rad) % count + count) % count;
    SectorTruth& sector = truth[static_cast<size_t>(ray)];
    if (height_m > kOverheadHeight_m) {
      sector.overhead_range_m = std::min(sector.overhead_range_m, range_m);
      continue;
    }
    if (range_m < sector.range_m) {
      sector.range_m = range_m;
      sector.from_travel_rad = point.from_travel_rad;
    }
    if (height_m >= options.judged_height_m) {
      sector.judged_range_m = std::min(sector.judged_range_m, range_m);
    }
  }
  return truth;
}

}  // namespace

ObstacleScanEvaluator::ObstacleScanEvaluator(const ObstacleScanEvaluationOptions& options)
    : options_(options) {
  options_.validate();
}

void ObstacleScanEvaluator::addRay(double reported_m, double sigma_m, double truth_m, Rays* rays) {
  ++rays->judged;
  const double error_m = reported_m - truth_m;
  if (std::isfinite(reported_m)) {
    rays->calibration.add(probabilityWithin(kRight_m, sigma_m), std::abs(error_m) <= kRight_m);
  }
  if (!(error_m <= kGate_m)) {  // true for NaN, if nothing is reported
    ++rays->missed;
    rays->errors_m.push_back(kGate_m);
  } else if (error_m < -kGate_m) {
    ++rays->nearer;
    rays->errors_m.push_back(kGate_m);
  } else {
    rays->errors_m.push_back(std::abs(error_m));
    rays->sigmas.push_back(std::abs(error_m) / sigma_m);
    rays->signed_sum_m += error_m;
  }
}

void ObstacleScanEvaluator::add(const ObstacleScan& scan, const std::vector<SeenPoint>& points,
                                const RigidTransform& world_from_vehicle) {
  const std::vector<SectorTruth> truth = collectTruth(scan, points, world_from_vehicle, options_);
  for (size_t i = 0; i < scan.size(); ++i) {
    const double truth_m = truth[i].range_m, overhead_m = truth[i].overhead_range_m;
    if (overhead_m + kRiseDepth_m < truth_m) {
      if (overhead_m >= kMinRange_m && overhead_m <= options_.max_range_m) {
        addRay(scan.range_m[i], scan.range_sigma_m[i], overhead_m, &overhead_);
      }
      if (std::abs(scan.range_m[i] - overhead_m) <= kGate_m) {
        continue;  // it is reported in front of what stands behind it
      }
    }
    if (!(truth_m >= kMinRange_m && truth_m <= options_.max_range_m) ||
        truth[i].judged_range_m > truth_m + kRiseDepth_m) {
      continue;
    }
    const bool is_aside = truth[i].from_travel_rad >= kMinAngleFromTravel_rad;
    std::vector<Rays*> sets = {&all_, is_aside ? &aside_ : &ahead_};
    if (!is_aside && truth_m < kNear_m) {
      sets.push_back(&ahead_near_);
    }
    for (size_t bin = 0; bin < by_range_.size(); ++bin) {
      if (truth_m >= kRangeBounds_m[bin] && truth_m < kRangeBounds_m[bin + 1]) {
        sets.push_back(&by_range_[bin]);
      }
    }
    for (Rays* rays : sets) {
      addRay(scan.range_m[i], scan.range_sigma_m[i], truth_m, rays);
    }
  }
}

RayErrors ObstacleScanEvaluator::summarizeRays(const Rays& rays) {
  RayErrors errors;
  errors.num_judged = rays.judged;
  errors.num_missed = rays.missed;
  errors.num_nearer = rays.nearer;
  errors.error_m = summarize(rays.errors_m);
  errors.calibration = rays.calibration.bins();
  if (!rays.sigmas.empty()) {
    errors.mean_signed_m = rays.signed_sum_m / static_cast<double>(rays.sigmas.size());
    const auto count = static_cast<double>(rays.judged);
    const auto within = [&](double sigmas) {
      return static_cast<double>(std::count_if(rays.sigmas.begin(), rays.sigmas.end(),
                                               [&](double value) { return value <= sigmas; })) /
             count;
    };
    errors.fraction_within_one_sigma = within(1.0);
    errors.fraction_within_two_sigma = within(2.0);
  }
  return errors;
}

std::vector<std::tuple<double, double, RayErrors>> ObstacleScanEvaluator::byRange() const {
  std::vector<std::tuple<double, double, RayErrors>> bins;
  for (size_t i = 0; i < by_range_.size(); ++i) {
    bins.emplace_back(kRangeBounds_m[i], kRangeBounds_m[i + 1], summarizeRays(by_range_[i]));
  }
  return bins;
}

}  // namespace vcharge
