#include <cmath>
#include <cstdio>

#include "tool_arguments.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/dense_maps/step_map_file.h"
#include "vcharge_evaluation/drive_truth.h"
#include "vcharge_evaluation/step_errors.h"

namespace {

using namespace vcharge;

// Moving objects leave steps behind for as long as their ground is not measured again.
constexpr double kMoverTrace_s = 2.0;
// Every how many columns and rows a true range is used.
constexpr int kPixelStep = 2;

struct Arguments {
  std::string steps, truth;
};

nlohmann::json classToJson(const char* name, const StepClassErrors& errors) {
  const double fraction = errors.foundFraction();
  std::printf(
      "%s steps: %.1f m due, %.1f m found, %.1f %% of the length over all maps; height error %+.1f cm\n",
      name, errors.length_m, errors.found_length_m, 100.0 * fraction, 100.0 * errors.mean_height_error_m);
  return {{"length_m", errors.length_m},
          {"found_length_m", errors.found_length_m},
          {"found_fraction", std::isfinite(fraction) ? nlohmann::json(fraction) : nlohmann::json()},
          {"mean_height_error_m", errors.mean_height_error_m}};
}

nlohmann::json evaluate(const Arguments& arguments) {
  DriveTruth truth(arguments.truth);
  StepEvaluator evaluator(readTruthHeights(arguments.truth + "/height_map.yaml"));
  const std::vector<Timestamp> stamps = listStepMaps(arguments.steps);
  size_t judged = 0;
  ProgressBar progress("evaluating");
  for (size_t i = 0; i < stamps.size(); ++i) {
    progress.update(static_cast<double>(i) / static_cast<double>(stamps.size()));
    const RigidTransform* pose = truth.poseAt(stamps[i]);
    if (pose == nullptr) {
      continue;  // no image has this stamp
    }
    std::vector<SeenPoint> seen;
    for (size_t camera = 0; camera < truth.rig().cameras.size(); ++camera) {
      const auto points = truth.pointsOf(camera, stamps[i], kPixelStep);
      seen.insert(seen.end(), points.begin(), points.end());
    }
    judged += seen.empty() ? 0 : 1;
    evaluator.add(readStepMap(arguments.steps, stamps[i]), seen, *pose,
                  truth.moversBetween(stamps[i] - durationFromSeconds(kMoverTrace_s), stamps[i]));
  }
  if (judged == 0) {
    throw InputError(arguments.truth + "/range: no true ranges for any of the " +
                     std::to_string(stamps.size()) + " step maps (simulate the drive with --truth-range)");
  }
  const StepErrors errors = evaluator.errors();
  nlohmann::json json = {{"kind", "steps"}, {"maps", errors.num_maps}, {"driven_m", errors.driven_m}};
  json["low"] = classToJson("low", errors.low);
  json["high"] = classToJson("high", errors.high);
  const double per_10_m = 10.0 / std::max(0.1, errors.driven_m);
  std::printf("false: %zu steps, %zu cells over %.1f m, %.2f steps per 10 m\n",
              static_cast<size_t>(errors.num_false_steps), static_cast<size_t>(errors.num_false_cells),
              errors.driven_m, per_10_m * static_cast<double>(errors.num_false_steps));
  json["false_steps"] = errors.num_false_steps;
  json["false_cells"] = errors.num_false_cells;
  json["false_steps_per_10_m"] = per_10_m * static_cast<double>(errors.num_false_steps);
  json["false_cell_list"] = nlohmann::json::array();
  for (const Eigen::Vector2d& cell : errors.false_cells_m) {
    json["false_cell_list"].push_back({cell.x(), cell.y()});
  }
  return json;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app("Errors of step maps against the true heights of a simulated drive.");
  Arguments arguments;
  app.addOption("--steps", &arguments.steps, "folder that detect_obstacles wrote").required();
  app.addOption("--truth", &arguments.truth,
                "folder of the drive's truth (range/, rig.yaml, trajectory.tum, height_map.yaml, ...)")
      .required();
  const ReportArgument report(&app, "step_errors");
  describeJson(&app, R"(kind: "steps"; maps, driven_m; low (5 to 8 cm) and high: {length_m: true
length that was due, found_length_m: found in most of the maps, found_fraction: mean over all maps, null without any,
mean_height_error_m}; false_steps, false_cells of 10 cm, false_steps_per_10_m, false_cell_list [[x_m, y_m]].)");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    *found = evaluate(arguments);
    report.write(*found);
  });
}
