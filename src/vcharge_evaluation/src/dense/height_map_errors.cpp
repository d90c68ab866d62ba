#include "vcharge_evaluation/height_map_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <tbb/parallel_for.h>

#include "dense/drivability_errors.h"
#include "dense/height_steps.h"
#include "obstacles/surface_visibility.h"
#include "poses/map_in_world.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/quantile.h"
#include "vcharge_evaluation/trajectory_errors.h"

namespace vcharge {
namespace {

constexpr double kLever_m = 5.0;           // of the points by which poses are laid over each other
constexpr double kAboveSurface_m = 0.005;  // of the point that is looked for
constexpr double kBeforeFoot_m = 0.05;     // where the foot of a face is looked for
constexpr double kFromPlants_m = 0.3;
constexpr double kCrownReach_m = 3.5;   // leaves of a tree, from its stem
constexpr double kUnderCrowns_m = 0.3;  // up to here above its foot there are none
constexpr double kOnFootprint_m = 0.1;
constexpr double kKerbTolerance_m = 0.03;
constexpr double kOverGrass_m = 0.4;
constexpr double kNotMapped = std::numeric_limits<double>::quiet_NaN();

/// Errors of all cells that are seen, apart from steps. Row by row, so that threads change nothing. CV_8UC1:
/// which are.
cv::Mat judgeCells(const HeightMap& map, const MapInWorld& in_world, const HeightMap& truth, double ground_m,
                   const SurfaceVisibility& visibility, const HeightMapErrorOptions& options,
                   HeightMapErrors* errors) {
  cv::Mat seen(map.height_m.size(), CV_8UC1, cv::Scalar(0));
  errors->error_m = cv::Mat(map.height_m.size(), CV_32FC1, cv::Scalar(kNotMapped));
  tbb::parallel_for(0, map.height_m.rows, [&](int row) {
    for (int column = 0; column < map.height_m.cols; ++column) {
      const Eigen::Vector3d cell = in_world.cell(column, row, ground_m);
      const double height = interpolateHeight(truth, cell.head<2>());
      if (!std::isfinite(height) ||
          !(spreadAround(truth, cell.head<2>(), map.cell_size_m) <= options.step_m) ||
          visibility.countViews({cell.x(), cell.y(), height + kAboveSurface_m}, options.min_views) <
              options.min_views) {
        continue;
      }
      seen.at<uint8_t>(row, column) = 1;
      if (std::isfinite(map.height_m.at<float>(row, column))) {
        errors->error_m.at<float>(row, column) = static_cast<float>(cell.z() - height);
      }
    }
  });
  std::vector<double> absolute;
  double sum = 0.0;
  size_t within = 0;
  for (int row = 0; row < seen.rows; ++row) {
    for (int column = 0; column < seen.cols; ++column) {
      errors->num_seen += seen.at<uint8_t>(row, column);
      const double error = errors->error_m.at<float>(row, column);
      if (std::isfinite(error)) {
        absolute.push_back(std::abs(error));
        sum += error;
        within += std::abs(error) <= 0.1 ? 1 : 0;
      }
    }
  }
  errors->num_mapped = absolute.size();
  if (!absolute.empty()) {
    errors->mean_signed_m = sum / static_cast<double>(absolute.size());
    errors->share_within_10_cm = static_cast<double>(within) / static_cast<double>(absolute.size());
  }
  errors->height_m = summarize(std::move(absolute));
  return seen;
}

/// Whether the map has heights on both sides.
bool isMapped(const MapInWorld& in_world, const HeightStep& step, double beside_m) {
  const Eigen::Vector2d beside = beside_m * step.direction;
  return std::isfinite(in_world.heightAt(step.place_m - beside, step.low_m)) &&
         std::isfinite(in_world.heightAt(step.place_m + beside, step.low_m));
}

bool isKerb(const HeightStep& step, const HeightMapErrorOptions& options) {
  const double rise = step.high_m - step.low_m;
  return step.both_sides_seen && rise >= options.kerb_low_m && rise <= options.kerb_high_m;
}

void judgeSteps(const MapInWorld& in_world, const SurfaceVisibility& visibility,
                const std::vector<HeightStep>& steps, const HeightMapErrorOptions& options,
                HeightMapErrors* errors) {
  std::vector<double> positions, kerbs;
  for (const HeightStep& step : steps) {
    const Eigen::Vector2d beside = options.plateau_m * step.direction;
    const double low = in_world.heightAt(step.place_m - beside, step.low_m);
    const double high = in_world.heightAt(step.place_m + beside, step.low_m);
    const auto crossing = findCrossing(in_world.heightsOver(step), step.place_m, step.direction,
                                       -options.search_m, options.search_m, step.low_m + stepLevel(step));
    if (crossing) {
      ++errors->num_steps_found;
      positions.push_back(std::abs(*crossing));
    }
    if (isKerb(step, options) && std::isfinite(high - low)) {
      const double error = high - low - (step.high_m - step.low_m);
      const Eigen::Vector2d top = step.place_m + beside;
      errors->kerbs.push_back(
          {step.place_m, error, visibility.nearestView({top.x(), top.y(), step.high_m + kAboveSurface_m})});
      kerbs.push_back(std::abs(error));
    }
  }
  errors->step_position_m = summarize(std::move(positions));
  errors->kerb_height_m = summarize(std::move(kerbs));
}

/// Where the map's ground, which is below a level, ends along a line, if it ends near 0 and no ground is
/// mapped for a hand beyond: behind the face of a wall or a pillar no camera sees free space, so that the map
/// has no height there. What is mapped above the level, as the roof of a car behind cells of its side without
/// a height, is no ground.
std::optional<double> findEnd(const HeightAt& height, const Eigen::Vector2d& start_m,
                              const Eigen::Vector2d& direction, double search_m, double level_m,
                              double cell_size_m) {
  constexpr double kSample_m = 0.01, kHand_m = 0.1;
  std::optional<double> end;
  for (double s = -search_m; s <= search_m + kHand_m; s += kSample_m) {
    if (height(start_m + s * direction) < level_m) {  // false for NaN
      end = s;
    }
  }
  // Heights are interpolated up to the middle of the last cell.
  return end && *end <= search_m ? std::optional<double>(*end + 0.5 * cell_size_m) : std::nullopt;
}

/// The edge near a true one as somebody reads it from the map, where it rises or else ends: the middle one of
/// five lines.
double readEdge(const MapInWorld& in_world, const HeightStep& step, double search_m, double cell_size_m) {
  const Eigen::Vector2d across(-step.direction.y(), step.direction.x());
  const HeightAt interpolated = [&](const Eigen::Vector2d& place_m) {
    return in_world.heightAt(place_m, step.low_m);
  };
  const double level_m = step.low_m + stepLevel(step);
  std::vector<double> crossings;
  for (const double aside : {-0.1, -0.05, 0.0, 0.05, 0.1}) {
    const Eigen::Vector2d start = step.place_m + aside * across;
    std::optional<double> crossing =
        findCrossing(in_world.heightsOver(step), start, step.direction, -search_m, search_m, level_m);
    if (!crossing) {
      crossing = findEnd(interpolated, start, step.direction, search_m, level_m, cell_size_m);
    }
    if (crossing) {
      crossings.push_back(*crossing);
    }
  }
  return crossings.size() < 3 ? kNotMapped : quantile(crossings, 0.5);
}

const HeightStep& stepAt(const std::vector<HeightStep>& steps, const Eigen::Vector2d& place_m) {
  return *std::find_if(steps.begin(), steps.end(),
                       [&](const HeightStep& step) { return step.place_m == place_m; });
}

void measure(const MapInWorld& in_world, double cell_size_m, const std::vector<HeightStep>& steps,
             const HeightMapErrorOptions& options, HeightMapErrors* errors) {
  double sum = 0.0;
  size_t shown = 0;
  for (TapeMeasurement& measurement : errors->measurements) {
    if (measurement.kind == TapeMeasurement::Kind::kHeight) {
      measurement.map_m =
          in_world.heightAt(measurement.to_m, 0.0) - in_world.heightAt(measurement.from_m, 0.0);
    } else {
      const HeightStep &a = stepAt(steps, measurement.from_m), &b = stepAt(steps, measurement.to_m);
      const Eigen::Vector2d from =
          a.place_m + readEdge(in_world, a, options.search_m, cell_size_m) * a.direction;
      const Eigen::Vector2d to =
          b.place_m + readEdge(in_world, b, options.search_m, cell_size_m) * b.direction;
      measurement.map_m = (to - from).norm();
    }
    const double error = std::abs(measurement.map_m - measurement.truth_m);
    if (std::isfinite(error)) {
      sum += error;
      ++shown;
      errors->max_measurement_m = std::max(errors->max_measurement_m, error);
    } else {
      ++errors->num_measurements_missing;
    }
  }
  errors->mean_measurement_m = shown > 0 ? sum / static_cast<double>(shown) : 0.0;
}

}  // namespace

void HeightMapErrorOptions::validate() const {
  requireField(view_distance_m > 0.0, "view_distance_m", "must be positive", view_distance_m);
  requireField(max_view_range_m > 0.0, "max_view_range_m", "must be positive", max_view_range_m);
  requireField(min_views > 0, "min_views", "must be positive", min_views);
  requireField(step_m > 0.0, "step_m", "must be positive", step_m);
  requireField(kerb_low_m > 0.0, "kerb_low_m", "must be positive", kerb_low_m);
  requireField(kerb_high_m > kerb_low_m, "kerb_high_m", "must be above kerb_low_m", kerb_high_m);
  requireField(search_m > 0.0, "search_m", "must be positive", search_m);
  requireField(plateau_m > 0.0, "plateau_m", "must be positive", plateau_m);
  requireField(num_measurements >= 0, "num_measurements", "must not be negative", num_measurements);
  requireField(min_length_m > 0.0, "min_length_m", "must be positive", min_length_m);
  requireField(max_length_m > min_length_m, "max_length_m", "must be above min_length_m", max_length_m);
}

IsRigid rigidBy(const std::vector<TruthObstacle>& obstacles) {
  const auto isPlant = [](const TruthObstacle& obstacle) {
    return obstacle.kind == "tree" || obstacle.kind == "bush" || obstacle.kind == "hedge";
  };
  return [obstacles, isPlant](const Eigen::Vector2d& place_m, double high_m) {
    const bool is_on_thing =
        std::any_of(obstacles.begin(), obstacles.end(), [&](const TruthObstacle& obstacle) {
          return !isPlant(obstacle) && obstacle.kind != "kerb" &&
                 distanceToPolygon(place_m, obstacle.footprint_m) < kOnFootprint_m;
        });
    return std::all_of(obstacles.begin(), obstacles.end(), [&](const TruthObstacle& obstacle) {
      const double distance = distanceToPolygon(place_m, obstacle.footprint_m);
      if (isPlant(obstacle)) {
        // The footprint is the stem's: leaves hang over what is around it.
        const bool is_crown = obstacle.kind == "tree" && !is_on_thing && distance < kCrownReach_m &&
                              high_m > obstacle.base_z_m + kUnderCrowns_m;
        return distance > kFromPlants_m && !is_crown;
      }
      // What is lower or a little higher than a kerb, on its island, is grass.
      const double over_kerb = high_m - obstacle.top_z_m;
      return obstacle.kind != "kerb" || distance > 0.0 || std::abs(over_kerb) < kKerbTolerance_m ||
             over_kerb > kOverGrass_m;
    });
  };
}

RigidTransform alignToTruth(const Trajectory& estimate, const Trajectory& truth) {
  const AssociatedTrajectories pairs = associateWithTruth(estimate, truth);
  if (pairs.estimate.size() < 2) {
    throw InputError("the trajectory and the true one share " + std::to_string(pairs.estimate.size()) +
                     " stamps, expected at least 2");
  }
  std::vector<Eigen::Vector3d> from, to;
  for (size_t i = 0; i < pairs.estimate.size(); ++i) {
    for (const Eigen::Vector3d& lever : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(kLever_m, 0, 0),
                                         Eigen::Vector3d(0, kLever_m, 0), Eigen::Vector3d(0, 0, kLever_m)}) {
      from.push_back(pairs.estimate[i].world_from_vehicle * lever);
      to.push_back(pairs.truth[i].world_from_vehicle * lever);
    }
  }
  return alignPoints(from, to);
}

HeightMapErrors evaluateHeightMap(const HeightMap& map, const RigidTransform& world_from_map,
                                  const HeightMap& truth, const Trajectory& world_from_vehicle,
                                  const CameraRig& rig, const IsRigid& is_rigid,
                                  const HeightMapErrorOptions& options) {
  options.validate();
  check(rig.hasExtrinsics(), "evaluateHeightMap: expected vehicle_from_camera of every camera");
  check(!world_from_vehicle.empty(), "evaluateHeightMap: expected poses");
  const SurfaceVisibility visibility(truth, world_from_vehicle, rig, options.view_distance_m,
                                     options.max_view_range_m);
  const MapInWorld in_world(map, world_from_map);
  HeightMapErrors errors;
  const double ground_m =
      (world_from_map.inverse() * world_from_vehicle.front().world_from_vehicle.translation()).z();
  const cv::Mat seen = judgeCells(map, in_world, truth, ground_m, visibility, options, &errors);
  std::vector<HeightStep> steps = findHeightSteps(truth, options, [&](const Eigen::Vector2d& place_m) {
    const double height = interpolateHeight(truth, place_m);
    return std::isfinite(height) &&
           visibility.countViews({place_m.x(), place_m.y(), height + kAboveSurface_m}, options.min_views) >=
               options.min_views;
  });
  for (HeightStep& step : steps) {
    const Eigen::Vector2d foot = step.place_m - kBeforeFoot_m * step.direction;
    step.foot_seen = visibility.countFaceViews({foot.x(), foot.y(), step.low_m + kAboveSurface_m},
                                               {-step.direction.x(), -step.direction.y(), 0.0},
                                               options.min_views) >= options.min_views;
  }
  errors.num_steps = steps.size();
  errors.num_kerbs_seen = static_cast<size_t>(std::count_if(
      steps.begin(), steps.end(), [&](const HeightStep& step) { return isKerb(step, options); }));
  errors.drivability =
      judgeDrivability(map, in_world, truth, world_from_vehicle, seen, steps, is_rigid, options.step_m);
  errors.measurements = pickMeasurements(truth, steps, is_rigid, options);
  measure(in_world, map.cell_size_m, steps, options, &errors);
  steps.erase(
      std::remove_if(steps.begin(), steps.end(),
                     [&](const HeightStep& step) { return !isMapped(in_world, step, options.plateau_m); }),
      steps.end());
  errors.num_steps_mapped = steps.size();
  judgeSteps(in_world, visibility, steps, options, &errors);
  return errors;
}

}  // namespace vcharge
