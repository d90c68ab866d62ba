#pragma once

#include <array>
#include <cstdint>
#include <tuple>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_evaluation/confidence_calibration.h"
#include "vcharge_evaluation/error_distribution.h"
#include "vcharge_evaluation/obstacle_truth.h"

namespace vcharge {

/// Options of ObstacleScanEvaluator.
struct ObstacleScanEvaluationOptions {
  VCHARGE_BEGIN_OPTIONS(ObstacleScanEvaluationOptions);
  VCHARGE_OPTION(double, judged_height_m, 0.2, atLeast(0.1).below(2.0), "Least height of a judged obstacle.");
  VCHARGE_OPTION(double, max_range_m, 5.0, above(0.5), "Largest true range that is judged.");
  VCHARGE_END_OPTIONS();
};

/// Errors of the reported ranges of a set of rays.
struct RayErrors {
  size_t num_judged = 0;       ///< rays with a true obstacle in bounds
  size_t num_missed = 0;       ///< rays without a reported range up to 0.5 m behind it
  size_t num_nearer = 0;       ///< rays with a reported range over 0.5 m in front of it
  ErrorDistribution error_m;   ///< absolute errors of all judged rays; missed and nearer ones count as 0.5 m
  double mean_signed_m = 0.0;  ///< of the rays that are neither missed nor nearer
  double fraction_within_one_sigma = 0.0;  ///< fraction of all judged rays
  double fraction_within_two_sigma = 0.0;
  /// A reported range is right within 0.15 m; its confidence is the probability of this by its sigma.
  std::vector<ConfidenceBin> calibration;
};

/// Compares scans with the surface points that were visible to the cameras at the same time.
class ObstacleScanEvaluator {
 public:
  explicit ObstacleScanEvaluator(const ObstacleScanEvaluationOptions& options = {});

  /// world_from_vehicle is the true pose. A reported range is compared with the nearest surface in its own
  /// sector. A surface seen above 1.7 m only, in front of what stands on the ground, is judged by itself: a
  /// vehicle may pass below it.
  void add(const ObstacleScan& scan, const std::vector<SeenPoint>& points,
           const RigidTransform& world_from_vehicle);

  RayErrors all() const { return summarizeRays(all_); }
  RayErrors aside() const { return summarizeRays(aside_); }           ///< rays off the direction of travel
  RayErrors ahead() const { return summarizeRays(ahead_); }           ///< rays along it
  RayErrors aheadNear() const { return summarizeRays(ahead_near_); }  ///< rays along it, nearer than 2 m
  RayErrors overhead() const { return summarizeRays(overhead_); }     ///< what hangs, judged by itself
  /// Bounds of the true range, from and to, with the errors of the rays between them.
  std::vector<std::tuple<double, double, RayErrors>> byRange() const;

 private:
  struct Rays {
    size_t judged = 0, missed = 0, nearer = 0;
    std::vector<double> errors_m, sigmas;
    double signed_sum_m = 0.0;
    ConfidenceCalibration calibration;
  };
  static constexpr std::array<double, 5> kRangeBounds_m = {0.5, 1.0, 2.0, 3.5, 5.0};

  static void addRay(double reported_m, double sigma_m, double truth_m, Rays* rays);
  static RayErrors summarizeRays(const Rays& rays);

  ObstacleScanEvaluationOptions options_;
  Rays all_, aside_, ahead_, ahead_near_, overhead_;
  std::array<Rays, kRangeBounds_m.size() - 1> by_range_;
};

}  // namespace vcharge
