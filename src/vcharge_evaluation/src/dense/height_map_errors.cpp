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

constexpr double kLever_m = 5.0;  // distance from the vehicle of the points by which poses are aligned
constexpr double kAboveSurface_m = 0.005;  // height over the surface of the point whose visibility is tested
constexpr double kBeforeFoot_m = 0.05;     // distance from a face at which its foot's visibility is tested
constexpr double kSearch_m = 0.4;          // distance within which a step is searched in the map
constexpr double kKerbLow_m = 0.1;         // heights of steps that are kerbs
constexpr double kKerbHigh_m = 0.14;
constexpr double kPlantMargin_m = 0.3;      // distance from plants at which surfaces are rigid
constexpr double kCrownRadius_m = 3.5;      // distance of a tree's leaves from its stem
constexpr double kCrownBase_m = 0.3;        // height above its foot up to which there are no leaves
constexpr double kFootprintMargin_m = 0.1;  // distance from an object within which a point belongs to it
constexpr double kKerbTolerance_m =
    0.03;                            // height above or below a kerb's top that still belongs to the kerb
constexpr double kMaxGrass_m = 0.4;  // height above a kerb's top up to which grass grows on its island
constexpr double kWithin_m = 0.1;    // see HeightMapErrors::fraction_within_10_cm
constexpr double kNotMapped = std::numeric_limits<double>::quiet_NaN();
// A surface is judged if it is visible in at least this many frames, 0.3 m apart.
constexpr int kMinViews = 3;

/// Errors of all visible cells away from steps, summed row by row for determinism. Returns a mask (CV_8UC1)
/// of these cells.
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
          visibility.countViews({cell.x(), cell.y(), height + kAboveSurface_m}, kMinViews) < kMinViews) {
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
        within += std::abs(error) <= kWithin_m ? 1 : 0;
      }
    }
  }
  errors->num_mapped = absolute.size();
  if (!absolute.empty()) {
    errors->mean_signed_m = sum / static_cast<double>(absolute.size());
    errors->fraction_within_10_cm = static_cast<double>(within) / static_cast<double>(absolute.size());
  }
  errors->height_m = summarize(std::move(absolute));
  return seen;
}

/// Whether the map has heights on both sides of a step.
bool isMapped(const MapInWorld& in_world, const HeightStep& step) {
  const Eigen::Vector2d beside = kPlateau_m * step.direction;
  return std::isfinite(in_world.heightAt(step.position_m - beside, step.low_m)) &&
         std::isfinite(in_world.heightAt(step.position_m + beside, step.low_m));
}

bool isKerb(const HeightStep& step) {
  const double rise = step.high_m - step.low_m;
  return step.both_sides_seen && rise >= kKerbLow_m && rise <= kKerbHigh_m;
}

void judgeSteps(const MapInWorld& in_world, const SurfaceVisibility& visibility,
                const std::vector<HeightStep>& steps, HeightMapErrors* errors) {
  std::vector<double> positions, kerbs;
  for (const HeightStep& step : steps) {
    const Eigen::Vector2d beside = kPlateau_m * step.direction;
    const double low = in_world.heightAt(step.position_m - beside, step.low_m);
    const double high = in_world.heightAt(step.position_m + beside, step.low_m);
    const auto crossing = findCrossing(in_world.heightsOver(step), step.position_m, step.direction,
                                       -kSearch_m, kSearch_m, step.low_m + stepLevel(step));
    if (crossing) {
      ++errors->num_steps_found;
      positions.push_back(std::abs(*crossing));
    }
    if (isKerb(step) && std::isfinite(high - low)) {
      const double error = high - low - (step.high_m - step.low_m);
      const Eigen::Vector2d top = step.position_m + beside;
      errors->kerbs.push_back({step.position_m, error,
                               visibility.nearestView({top.x(), top.y(), step.high_m + kAboveSurface_m})});
      kerbs.push_back(std::abs(error));
    }
  }
  errors->step_position_m = summarize(std::move(positions));
  errors->kerb_height_m = summarize(std::move(kerbs));
}

/// Distance along a line at which the map's ground ends, if no ground is mapped for 0.1 m beyond. Behind the
/// face of a wall or pillar the map has no height, as no camera sees it. Heights above the level are not
/// ground, such as the roof of a car behind a side without heights.
std::optional<double> findEnd(const HeightAt& height, const Eigen::Vector2d& start_m,
                              const Eigen::Vector2d& direction, double level_m, double cell_size_m) {
  constexpr double kSample_m = 0.01, kBeyond_m = 0.1;
  std::optional<double> end;
  for (double s = -kSearch_m; s <= kSearch_m + kBeyond_m; s += kSample_m) {
    if (height(start_m + s * direction) < level_m) {  // false for NaN
      end = s;
    }
  }
  // Heights are interpolated up to the middle of the last cell.
  return end && *end <= kSearch_m ? std::optional<double>(*end + 0.5 * cell_size_m) : std::nullopt;
}

/// Distance of an edge in the map from the true one, where the map rises or ends: the median of five lines.
/// NaN if at most two lines show it.
double measureEdge(const MapInWorld& in_world, const HeightStep& step, double cell_size_m) {
  const Eigen::Vector2d across(-step.direction.y(), step.direction.x());
  const HeightAt interpolated = [&](const Eigen::Vector2d& position_m) {
    return in_world.heightAt(position_m, step.low_m);
  };
  const double level_m = step.low_m + stepLevel(step);
  std::vector<double> crossings;
  for (const double aside : {-0.1, -0.05, 0.0, 0.05, 0.1}) {
    const Eigen::Vector2d start = step.position_m + aside * across;
    std::optional<double> crossing =
        findCrossing(in_world.heightsOver(step), start, step.direction, -kSearch_m, kSearch_m, level_m);
    if (!crossing) {
      crossing = findEnd(interpolated, start, step.direction, level_m, cell_size_m);
    }
    if (crossing) {
      crossings.push_back(*crossing);
    }
  }
  return crossings.size() < 3 ? kNotMapped : quantile(crossings, 0.5);
}

const HeightStep& stepAt(const std::vector<HeightStep>& steps, const Eigen::Vector2d& position_m) {
  return *std::find_if(steps.begin(), steps.end(),
                       [&](const HeightStep& step) { return step.position_m == position_m; });
}

/// Takes the tape measurements in the map: between its edges, or between its heights.
void takeMeasurements(const MapInWorld& in_world, double cell_size_m, const std::vector<HeightStep>& steps,
                      HeightMapErrors* errors) {
  double sum = 0.0;
  size_t count = 0;
  for (TapeMeasurement& measurement : errors->measurements) {
    if (measurement.kind == TapeMeasurement::Kind::kHeight) {
      measurement.map_m =
          in_world.heightAt(measurement.to_m, 0.0) - in_world.heightAt(measurement.from_m, 0.0);
    } else {
      const HeightStep &a = stepAt(steps, measurement.from_m), &b = stepAt(steps, measurement.to_m);
      const Eigen::Vector2d from = a.position_m + measureEdge(in_world, a, cell_size_m) * a.direction;
      const Eigen::Vector2d to = b.position_m + measureEdge(in_world, b, cell_size_m) * b.direction;
      measurement.map_m = (to - from).norm();
    }
    const double error = std::abs(measurement.map_m - measurement.truth_m);
    if (std::isfinite(error)) {
      sum += error;
      ++count;
      errors->max_measurement_m = std::max(errors->max_measurement_m, error);
    } else {
      ++errors->num_measurements_missing;
    }
  }
  errors->mean_measurement_m = count > 0 ? sum / static_cast<double>(count) : 0.0;
}

}  // namespace

IsRigid makeIsRigid(const std::vector<TruthObstacle>& obstacles) {
  const auto isPlant = [](const TruthObstacle& obstacle) {
    return obstacle.kind == "tree" || obstacle.kind == "bush" || obstacle.kind == "hedge";
  };
  return [obstacles, isPlant](const Eigen::Vector2d& position_m, double high_m) {
    const bool is_on_object =
        std::any_of(obstacles.begin(), obstacles.end(), [&](const TruthObstacle& obstacle) {
          return !isPlant(obstacle) && obstacle.kind != "kerb" &&
                 distanceToPolygon(position_m, obstacle.footprint_m) < kFootprintMargin_m;
        });
    return std::all_of(obstacles.begin(), obstacles.end(), [&](const TruthObstacle& obstacle) {
      const double distance = distanceToPolygon(position_m, obstacle.footprint_m);
      if (isPlant(obstacle)) {
        // The footprint is that of the stem; leaves hang over its surroundings.
        const bool is_crown = obstacle.kind == "tree" && !is_on_object && distance < kCrownRadius_m &&
                              high_m > obstacle.base_z_m + kCrownBase_m;
        return distance > kPlantMargin_m && !is_crown;
      }
      // A surface on a kerb's island that is lower or a little higher than the kerb is grass.
      const double over_kerb = high_m - obstacle.top_z_m;
      return obstacle.kind != "kerb" || distance > 0.0 || std::abs(over_kerb) < kKerbTolerance_m ||
             over_kerb > kMaxGrass_m;
    });
  };
}

RigidTransform alignToTruth(const Trajectory& estimate, const Trajectory& truth) {
  const AssociatedTrajectories pairs = associateWithTruth(estimate, truth);
  if (pairs.estimate.size() < 2) {
    throw InputError("the trajectory and the true one have " + std::to_string(pairs.estimate.size()) +
                     " common stamps, expected at least 2");
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
  const SurfaceVisibility visibility(truth, world_from_vehicle, rig, options.max_view_range_m);
  const MapInWorld in_world(map, world_from_map);
  HeightMapErrors errors;
  const double ground_m =
      (world_from_map.inverse() * world_from_vehicle.front().world_from_vehicle.translation()).z();
  const cv::Mat seen = judgeCells(map, in_world, truth, ground_m, visibility, options, &errors);
  std::vector<HeightStep> steps = findHeightSteps(truth, options, [&](const Eigen::Vector2d& position_m) {
    const double height = interpolateHeight(truth, position_m);
    return std::isfinite(height) &&
           visibility.countViews({position_m.x(), position_m.y(), height + kAboveSurface_m}, kMinViews) >=
               kMinViews;
  });
  for (HeightStep& step : steps) {
    const Eigen::Vector2d foot = step.position_m - kBeforeFoot_m * step.direction;
    step.foot_seen =
        visibility.countFaceViews({foot.x(), foot.y(), step.low_m + kAboveSurface_m},
                                  {-step.direction.x(), -step.direction.y(), 0.0}, kMinViews) >= kMinViews;
  }
  errors.num_steps = steps.size();
  errors.num_kerbs_seen = static_cast<size_t>(
      std::count_if(steps.begin(), steps.end(), [&](const HeightStep& step) { return isKerb(step); }));
  errors.drivability =
      judgeDrivability(map, in_world, truth, world_from_vehicle, seen, steps, is_rigid, options.step_m);
  errors.measurements = pickMeasurements(truth, steps, is_rigid, options);
  takeMeasurements(in_world, map.cell_size_m, steps, &errors);
  steps.erase(std::remove_if(steps.begin(), steps.end(),
                             [&](const HeightStep& step) { return !isMapped(in_world, step); }),
              steps.end());
  errors.num_steps_mapped = steps.size();
  judgeSteps(in_world, visibility, steps, &errors);
  return errors;
}

}  // namespace vcharge
