#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/dense_maps/step_map.h"
#include "vcharge_evaluation/obstacle_truth.h"

namespace vcharge {

/// A point on the edge of a step of the scene, one per cell of the true height map along the edge.
struct TrueStep {
  Eigen::Vector2d world_m{0.0, 0.0};
  Eigen::Vector2d up{0.0, 0.0};  ///< unit vector along x or y, towards the upper side
  double rise_m = 0.0;
};

/// Steps of the ground in a true height map: heights that change by at least kMinStep_m within 0.1 m, more
/// steeply than kMaxSlope. Lower changes and ramps are drivable. Things taller than kTall_m are no steps;
/// their surroundings are left out.
class StepTruth {
 public:
  static constexpr double kMinStep_m = 0.05;
  static constexpr double kHighStep_m = 0.08;  ///< from this height on, a step counts as a high one
  static constexpr double kMaxSlope = 0.3;
  static constexpr double kTall_m = 0.5;
  /// Distance of a reported step from the true one.
  static constexpr double kTolerance_m = 0.15;

  explicit StepTruth(const TruthHeights& heights);

  const std::vector<TrueStep>& steps() const { return steps_; }
  double cellSize_m() const { return heights_.cell_size_m; }
  /// Whether a step reported here is false: no step of the truth, nor anything tall, is near, and the height
  /// of the ground is known.
  bool isEven(const Eigen::Vector2d& world_m) const;

 private:
  void findAlong(const Eigen::Vector2i& axis, const cv::Mat& tall);

  TruthHeights heights_;
  std::vector<TrueStep> steps_;
  cv::Mat even_;  // CV_32FC1: 1 where isEven()
};

/// Steps of one range of heights. Lengths are of the true edges.
struct StepClassErrors {
  double length_m = 0.0;             ///< length that was due at any time
  double found_length_m = 0.0;       ///< of that, reported in more than half of the maps in which it was due
  uint64_t num_due = 0;              ///< points of edges, over all maps in which they were due
  uint64_t num_found = 0;            ///< of those, reported ones
  double mean_height_error_m = 0.0;  ///< mean of reported minus true height

  double foundFraction() const;
};

struct StepErrors {
  uint64_t num_maps = 0;
  double driven_m = 0.0;
  StepClassErrors low, high;
  uint64_t num_false_cells = 0;                ///< cells of 10 cm of the world, over the whole drive
  uint64_t num_false_steps = 0;                ///< groups of neighbouring false cells
  std::vector<Eigen::Vector2d> false_cells_m;  ///< in the world
};

/// Judges step maps against the true heights of the scene. A step is due in a map if it is within kDistance_m
/// of the vehicle and both its sides have been visible for kViewTravel_m of driving. Maps must come in the
/// order of their stamps.
class StepEvaluator {
 public:
  static constexpr double kDistance_m = 3.0;
  static constexpr double kViewTravel_m = 2.0;

  explicit StepEvaluator(const TruthHeights& heights);

  /// `seen`: points visible to the cameras at this stamp. `movers`: moving objects of the last seconds,
  /// around which no reported step is false.
  void add(const StepMap& map, const std::vector<SeenPoint>& seen, const RigidTransform& world_from_vehicle,
           const std::vector<TruthObstacle>& movers);
  StepErrors errors() const;

 private:
  struct Progress {
    bool is_low_seen = false, is_high_seen = false;
    double seen_from_m = 0.0;  // travel when both sides had been seen
    uint64_t num_due = 0, num_found = 0;
    double sum_height_m = 0.0;
  };

  void noteSeen(const std::vector<SeenPoint>& seen);
  void judgeSteps(const StepMap& map, const RigidTransform& world_from_vehicle,
                  const RigidTransform& world_from_fixed);
  void judgeFalse(const StepMap& map, const RigidTransform& world_from_fixed,
                  const std::vector<TruthObstacle>& movers);

  const StepTruth truth_;
  std::vector<Progress> progress_;  // of the truth's steps
  std::set<int64_t> false_cells_;
  uint64_t num_maps_ = 0;
  double travel_m_ = 0.0;
  Eigen::Vector2d last_position_m_{0.0, 0.0};
};

}  // namespace vcharge
