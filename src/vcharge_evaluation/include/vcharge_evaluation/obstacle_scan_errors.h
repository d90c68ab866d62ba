#pragma once

#include <cstdint>
#include <vector>

#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_evaluation/error_distribution.h"
#include "vcharge_evaluation/obstacle_truth.h"

namespace vcharge {

/// Which rays of a scan are judged, and how.
struct ObstacleScanEvaluationOptions {
  double min_height_m = 0.1;     ///< surfaces from here up are obstacles, as the nearest one on a ray
  double judged_height_m = 0.2;  ///< and an obstacle is judged when it rises so high ...
  double rise_depth_m = 0.3;     ///< ... within this distance behind its nearest point
  double max_height_m = 2.0;     ///< what hangs higher is none
  double min_range_m = 0.5;
  double max_range_m = 5.0;
  double min_angle_from_travel_rad = 0.3490658503988659;  ///< 20 degrees
  double gate_m = 0.5;  ///< a reported range further off means another obstacle or none

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("min_height_m", min_height_m);
    visit("judged_height_m", judged_height_m);
    visit("rise_depth_m", rise_depth_m);
    visit("max_height_m", max_height_m);
    visit("min_range_m", min_range_m);
    visit("max_range_m", max_range_m);
    visit("min_angle_from_travel_rad", min_angle_from_travel_rad);
    visit("gate_m", gate_m);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Errors of the reported ranges of a set of rays.
struct RayErrors {
  uint64_t num_judged = 0;            ///< rays with a true obstacle that is to be judged
  uint64_t num_missed = 0;            ///< nothing reported, or something more than the gate behind it
  uint64_t num_nearer = 0;            ///< something reported more than the gate before it
  ErrorDistribution error_m;          ///< of all others, absolute
  ErrorDistribution error_own_ray_m;  ///< the same against the truth of the very ray
  double mean_signed_m = 0.0;
  double share_within_one_sigma = 0.0;
  double share_within_two_sigma = 0.0;
};

/// Collects scans with the surface points that cameras saw at the same time.
class ObstacleScanEvaluator {
 public:
  explicit ObstacleScanEvaluator(const ObstacleScanEvaluationOptions& options = {});

  /// The pose is the true one. A reported range is compared with the truth of its own sector and of the two
  /// beside it, whichever is nearest to it: a sector has a width, and an obstacle's edge lies in one of two.
  void add(const ObstacleScan& scan, const std::vector<SeenPoint>& points,
           const RigidTransform& world_from_vehicle);

  RayErrors aside() const { return summarizeRays(aside_); }           ///< away from the direction of travel
  RayErrors ahead() const { return summarizeRays(ahead_); }           ///< near it
  RayErrors aheadNear() const { return summarizeRays(ahead_near_); }  ///< near it and nearer than 2 m

 private:
  struct Rays {
    uint64_t judged = 0, missed = 0, nearer = 0;
    std::vector<double> errors_m, own_errors_m, sigmas;
    double signed_sum_m = 0.0;
  };
  static void addRay(double reported_m, double sigma_m, double truth_m, double nearest_truth_m, double gate_m,
                     Rays* rays);
  static RayErrors summarizeRays(const Rays& rays);

  ObstacleScanEvaluationOptions options_;
  Rays aside_, ahead_, ahead_near_;
};

}  // namespace vcharge
