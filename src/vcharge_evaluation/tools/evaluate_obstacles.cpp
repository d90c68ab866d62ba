#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>

#include "tool_arguments.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/dense_maps/obstacle_map_file.h"
#include "vcharge_evaluation/approach_errors.h"
#include "vcharge_evaluation/drive_truth.h"
#include "vcharge_evaluation/obstacle_map_errors.h"
#include "vcharge_evaluation/obstacle_scan_errors.h"

namespace {

using namespace vcharge;

struct Options {
  VCHARGE_BEGIN_OPTIONS(Options);
  VCHARGE_OPTION(int, frame_step, 1, positive(), "Every how many maps one is judged.");
  VCHARGE_OPTION(int, pixel_step, 2, positive(), "Every how many columns and rows a true range is used.");
  VCHARGE_OPTION_GROUP(ObstacleScanEvaluationOptions, scan, {}, "Ranges of the scans.");
  VCHARGE_OPTION_GROUP(ObstacleMapEvaluationOptions, map, {}, "Cells of the fused map.");
  VCHARGE_OPTION_GROUP(ApproachEvaluationOptions, approach, {}, "First reports and the driving corridor.");
  VCHARGE_END_OPTIONS();
};

nlohmann::json raysToJson(const char* what, const RayErrors& errors) {
  const auto judged = static_cast<double>(std::max<size_t>(1, errors.num_judged));
  std::printf(
      "  %-12s %6zu rays, missed %.1f %%, nearer %.1f %%; error mean %.1f cm (signed %+.1f), 95 %% %.1f cm; "
      "within 1, 2 sigma %.0f, %.0f %%\n",
      what, errors.num_judged, 100.0 * errors.num_missed / judged, 100.0 * errors.num_nearer / judged,
      100.0 * errors.error_m.mean, 100.0 * errors.mean_signed_m, 100.0 * errors.error_m.percentile_95,
      100.0 * errors.fraction_within_one_sigma, 100.0 * errors.fraction_within_two_sigma);
  return {{"rays", errors.num_judged},
          {"missed", errors.num_missed},
          {"nearer", errors.num_nearer},
          {"error_m", errors.error_m},
          {"mean_signed_m", errors.mean_signed_m},
          {"fraction_within_one_sigma", errors.fraction_within_one_sigma},
          {"fraction_within_two_sigma", errors.fraction_within_two_sigma},
          {"calibration", calibrationToJson(errors.calibration)}};
}

nlohmann::json scanToJson(const std::string& name, const ObstacleScanEvaluator& evaluator) {
  std::printf("%s scan:\n", name.c_str());
  nlohmann::json by_range = nlohmann::json::array();
  for (const auto& [from_m, to_m, errors] : evaluator.byRange()) {
    char label[32];
    std::snprintf(label, sizeof(label), "%.1f-%.1f m", from_m, to_m);
    nlohmann::json bin = raysToJson(label, errors);
    bin["from_m"] = from_m;
    bin["to_m"] = to_m;
    by_range.push_back(bin);
  }
  return {{"name", name},
          {"by_range", by_range},
          {"all", raysToJson("all", evaluator.all())},
          {"aside", raysToJson("aside", evaluator.aside())},
          {"ahead", raysToJson("ahead", evaluator.ahead())},
          {"ahead_within_2_m", raysToJson("ahead < 2 m", evaluator.aheadNear())},
          {"overhead", raysToJson("overhead", evaluator.overhead())}};
}

/// Prints how many obstacles were missed, and those that were not reported in all maps.
void printObstacles(const std::vector<ObstacleOutcome>& outcomes) {
  const auto missed = std::count_if(outcomes.begin(), outcomes.end(),
                                    [](const ObstacleOutcome& outcome) { return !outcome.reported; });
  std::printf("obstacles missed: %d of %zu\n", static_cast<int>(missed), outcomes.size());
  for (const ObstacleOutcome& outcome : outcomes) {
    if (!outcome.reported || outcome.frames_reported < outcome.frames) {
      std::printf(
          "  %s at (%.1f, %.1f), %.2f m high, %.2f m wide, %.1f m away: %s, then reported in %zu of %zu "
          "maps\n",
          outcome.kind.c_str(), outcome.middle_m.x(), outcome.middle_m.y(), outcome.height_m, outcome.width_m,
          outcome.distance_m, outcome.reported ? "reported" : "MISSED", outcome.frames_reported,
          outcome.frames);
    }
  }
}

nlohmann::json mapToJson(const ObstacleMapErrors& errors) {
  printObstacles(errors.obstacles);
  nlohmann::json obstacles = nlohmann::json::array();
  for (const ObstacleOutcome& outcome : errors.obstacles) {
    obstacles.push_back({{"kind", outcome.kind},
                         {"height_m", outcome.height_m},
                         {"width_m", outcome.width_m},
                         {"distance_m", outcome.distance_m},
                         {"reported", outcome.reported},
                         {"maps", outcome.frames},
                         {"maps_reported", outcome.frames_reported}});
  }
  std::printf(
      "false: %zu cells over %.1f m, %.2f per 10 m; left occupied behind the vehicle: %zu, %.2f per 10 m; "
      "%.2f in a map; %zu more on ground that was never visible\n",
      errors.num_false_cells, errors.driven_m, errors.false_cells_per_10_m, errors.num_false_left,
      10.0 * static_cast<double>(errors.num_false_left) / std::max(0.1, errors.driven_m),
      errors.false_cells_per_map, errors.num_false_hidden);
  std::printf("inside true obstacles: %zu of %zu observed cells were ever free\n", errors.num_free_inside,
              errors.num_observed_inside);
  std::printf("kerbs: %zu of %zu points reported, height error mean %.1f cm, 95 %% %.1f cm\n",
              errors.num_kerb_reported, errors.num_kerb_points, 100.0 * errors.kerb_height_error_m.mean,
              100.0 * errors.kerb_height_error_m.percentile_95);
  nlohmann::json movers = nlohmann::json::array();
  for (const auto& [kind, counts] : errors.movers) {
    std::printf("moving: %s reported in %zu of %zu maps\n", kind.c_str(), counts.frames_reported,
                counts.frames);
    movers.push_back({{"kind", kind}, {"maps", counts.frames}, {"maps_reported", counts.frames_reported}});
  }
  std::printf("%zu of %zu cells under moving objects free\n", errors.num_mover_free, errors.num_mover_cells);
  nlohmann::json kerbs = nlohmann::json::array();
  for (const KerbOutcome& kerb : errors.kerbs) {
    kerbs.push_back({{"position_m", {kerb.position_m.x(), kerb.position_m.y()}},
                     {"nearest_m", kerb.nearest_m},
                     {"reported", kerb.reported},
                     {"ever_reported", kerb.ever_reported}});
  }
  nlohmann::json false_cells = nlohmann::json::array();
  for (const FalseCell& cell : errors.false_cells) {
    false_cells.push_back({{"x_m", cell.world_m.x()},
                           {"y_m", cell.world_m.y()},
                           {"first_seen_ns", cell.first_seen.nanoseconds()},
                           {"maps", cell.frames},
                           {"left", cell.is_left},
                           {"on_open_ground", cell.is_on_open}});
  }
  return {{"maps", errors.num_frames},
          {"driven_m", errors.driven_m},
          {"obstacles", obstacles},
          {"false_cells", errors.num_false_cells},
          {"false_cells_per_10_m", errors.false_cells_per_10_m},
          {"false_left", errors.num_false_left},
          {"false_cells_per_map", errors.false_cells_per_map},
          {"false_cells_hidden", errors.num_false_hidden},
          {"false_cell_list", false_cells},
          {"observed_inside", errors.num_observed_inside},
          {"free_inside", errors.num_free_inside},
          {"kerb_points", errors.num_kerb_points},
          {"kerb_reported", errors.num_kerb_reported},
          {"kerb_height_error_m", errors.kerb_height_error_m},
          {"kerbs", kerbs},
          {"movers", movers},
          {"mover_cells", errors.num_mover_cells},
          {"mover_free", errors.num_mover_free}};
}

nlohmann::json toJson(const CorridorCounts& cells) {
  return {{"free_as_free", cells.free_as_free},
          {"free_as_unknown", cells.free_as_unknown},
          {"free_as_occupied", cells.free_as_occupied},
          {"occupied_as_free", cells.occupied_as_free},
          {"occupied_as_unknown", cells.occupied_as_unknown},
          {"occupied_as_occupied", cells.occupied_as_occupied}};
}

nlohmann::json approachToJson(const ApproachErrors& errors) {
  nlohmann::json reports = nlohmann::json::array();
  for (const FirstReport& report : errors.reports) {
    const auto orNull = [](const std::optional<double>& value) {
      return value ? nlohmann::json(*value) : nlohmann::json();
    };
    reports.push_back({{"kind", report.kind},
                       {"moves", report.moves},
                       {"first_visible_m", report.first_visible_m},
                       {"nearest_m", report.nearest_m},
                       {"first_reported_m", orNull(report.reported_m)},
                       {"contact_s", orNull(report.contact_s)}});
  }
  const CorridorCounts& cells = errors.corridor;
  const size_t num_free = cells.free_as_free + cells.free_as_unknown + cells.free_as_occupied;
  std::printf(
      "corridor: %zu free cells, of which %.1f %% free, %.1f %% unknown, %.2f %% occupied; "
      "%zu occupied ones, of which %zu free; %zu false alarms in %.1f s, %.1f m\n",
      num_free, 100.0 * static_cast<double>(cells.free_as_free) / std::max<size_t>(1, num_free),
      100.0 * static_cast<double>(cells.free_as_unknown) / std::max<size_t>(1, num_free),
      100.0 * static_cast<double>(cells.free_as_occupied) / std::max<size_t>(1, num_free),
      cells.occupied_as_free + cells.occupied_as_unknown + cells.occupied_as_occupied, cells.occupied_as_free,
      errors.num_false_alarms, errors.duration_s, errors.driven_m);
  return {{"reports", reports},
          {"corridor", toJson(cells)},
          {"ahead", toJson(errors.ahead)},
          {"behind", toJson(errors.behind)},
          {"false_alarms", errors.num_false_alarms},
          {"duration_s", errors.duration_s},
          {"driven_m", errors.driven_m}};
}

struct Arguments {
  std::string obstacles, truth;
};

nlohmann::json evaluate(const Arguments& arguments, const Options& options) {
  DriveTruth truth(arguments.truth);
  const std::vector<TruthObstacle> obstacles = readTruthObstacles(arguments.truth + "/obstacles.yaml");
  const TruthHeights heights = readTruthHeights(arguments.truth + "/height_map.yaml");
  ObstacleMapEvaluator map_evaluator(obstacles, heights, truth.path(), options.map);
  ApproachEvaluator approach_evaluator(obstacles, heights, truth.trajectory(), options.approach);
  std::map<std::string, ObstacleScanEvaluator> scan_evaluators;
  ObstacleScanEvaluator in_motion(options.scan);
  const std::vector<Timestamp> stamps = listObstacles(arguments.obstacles);
  size_t judged = 0;
  ProgressBar progress("evaluating");
  for (size_t i = 0; i < stamps.size(); i += static_cast<size_t>(options.frame_step)) {
    progress.update(static_cast<double>(i) / static_cast<double>(stamps.size()));
    const RigidTransform* pose = truth.poseAt(stamps[i]);
    if (pose == nullptr) {
      continue;  // no image has this stamp
    }
    const std::vector<ObstacleScan> scans = readObstacleScans(arguments.obstacles, stamps[i]);
    std::vector<SeenPoint> all;
    for (const ObstacleScan& scan : scans) {
      const int camera = truth.rig().findCamera(scan.name);
      if (camera < 0) {
        continue;
      }
      const auto points = truth.pointsOf(static_cast<size_t>(camera), stamps[i], options.pixel_step);
      scan_evaluators.try_emplace(scan.name, options.scan).first->second.add(scan, points, *pose);
      all.insert(all.end(), points.begin(), points.end());
    }
    judged += all.empty() ? 0 : 1;
    const ObstacleMap map = readObstacleMap(arguments.obstacles, stamps[i]);
    const std::vector<TruthObstacle> movers = truth.moversBetween(stamps[i], stamps[i]);
    map_evaluator.add(map, all, *pose, movers,
                      truth.moversBetween(stamps[i] - durationFromSeconds(1.0), stamps[i]));
    approach_evaluator.add(map, all, *pose, movers);
    for (const ObstacleScan& scan : scans) {
      if (scan.name == "fused") {
        scan_evaluators.try_emplace(scan.name, options.scan).first->second.add(scan, all, *pose);
        if (approach_evaluator.hasDriven()) {
          in_motion.add(scan, all, *pose);
        }
      }
    }
  }
  if (judged == 0) {
    throw InputError(arguments.truth + "/range: no true ranges for any of the " +
                     std::to_string(stamps.size()) +
                     " obstacle maps (simulate the drive with --truth-range)");
  }
  nlohmann::json json = {{"kind", "obstacles"}, {"scans", nlohmann::json::array()}};
  for (const auto& [name, evaluator] : scan_evaluators) {
    json["scans"].push_back(scanToJson(name, evaluator));
  }
  json["fused_after_2_m"] = scanToJson("fused, after 2 m,", in_motion);
  json["map"] = mapToJson(map_evaluator.errors());
  json["approach"] = approachToJson(approach_evaluator.errors());
  return json;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app("Errors of obstacle maps against the truth of a simulated drive on level ground.");
  Arguments arguments;
  app.addOption("--obstacles", &arguments.obstacles, "folder that detect_obstacles wrote").required();
  app.addOption("--truth", &arguments.truth,
                "folder of the drive's truth (range/, rig.yaml, trajectory.tum, obstacles.yaml, ...)")
      .required();
  const OptionsArgument<Options> options(&app);
  const ReportArgument report(&app, "obstacle_errors");
  describeJson(&app,
               R"(kind: "obstacles"; scans: per scan {name, and for all rays (all), those off the direction of
travel (aside), along it (ahead) and along it within 2 m (ahead_within_2_m), those to what only hangs above 1.7 m
(overhead), and by_range (with from_m, to_m) {rays,
missed, nearer, mean_signed_m, fraction_within_one_sigma, fraction_within_two_sigma, error distribution error_m, in
which missed and nearer rays count as 0.5 m, calibration {expected_calibration_error, bins [{count, mean_confidence,
fraction_right}]} of the probability, by the reported sigma, of an error within 0.15 m}};
fused_after_2_m: the same for the fused scan, once the vehicle has driven 2 m;
map: {maps, driven_m, obstacles [{kind, height_m, width_m, distance_m, reported, maps,
maps_reported}], false_cells, false_cells_per_10_m, false_left, false_cells_per_map, false_cells_hidden,
false_cell_list [{x_m, y_m, first_seen_ns, maps, left, on_open_ground}], observed_inside, free_inside:
cells inside obstacles, kerb_points, kerb_reported, error distribution kerb_height_error_m, kerbs
[{position_m, nearest_m, reported, ever_reported}], movers [{kind, maps, maps_reported}], mover_cells, mover_free}; approach: {reports [{kind, moves, first_visible_m, nearest_m,
first_reported_m (least distance until then), contact_s: null if never}], corridor, ahead and behind {TRUTH_as_MAP: cells}, false_alarms, duration_s, driven_m}.)");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (options.shown()) {
      return;
    }
    *found = evaluate(arguments, options.read());
    report.write(*found);
  });
}
