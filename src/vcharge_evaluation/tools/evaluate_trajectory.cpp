#include <cstdio>

#include "tool_arguments.h"
#include "vcharge_evaluation/trajectory_errors.h"

namespace {

using namespace vcharge;

constexpr double kDegreesPerRadian = 57.29577951308232;

void printRow(const char* label, const ErrorDistribution& d, double factor) {
  std::printf("  %-22s %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f\n", label, factor * d.mean,
              factor * d.root_mean_square, factor * d.percentile_50, factor * d.percentile_90,
              factor * d.percentile_95, factor * d.percentile_99, factor * d.max);
}

nlohmann::json evaluate(const Trajectory& estimate, const Trajectory& truth, TrajectoryAlignment alignment,
                        const char* label) {
  const TrajectoryErrors errors = evaluateTrajectory(estimate, truth, alignment);
  std::printf("%s: %zu poses over %.1f m, %zu without truth\n", label, errors.poses.size(),
              errors.truth_length_m, errors.num_without_truth);
  std::printf("  %-22s %8s %8s %8s %8s %8s %8s %8s\n", "", "mean", "rms", "50 %", "90 %", "95 %", "99 %",
              "max");
  printRow("position (m)", errors.position_m, 1.0);
  printRow("along (m)", errors.longitudinal_m, 1.0);
  printRow("across (m)", errors.lateral_m, 1.0);
  printRow("rotation (deg)", errors.rotation_rad, kDegreesPerRadian);
  nlohmann::json poses = nlohmann::json::array();
  for (const PoseError& pose : errors.poses) {
    poses.push_back({pose.stamp.seconds(), pose.translation_in_vehicle_m.x(),
                     pose.translation_in_vehicle_m.y(), pose.translation_in_vehicle_m.z(),
                     pose.rotation_rad});
  }
  return {{"label", label},
          {"num_poses", errors.poses.size()},
          {"num_without_truth", errors.num_without_truth},
          {"truth_length_m", errors.truth_length_m},
          {"position_m", errors.position_m},
          {"longitudinal_m", errors.longitudinal_m},
          {"lateral_m", errors.lateral_m},
          {"rotation_rad", errors.rotation_rad},
          {"poses", poses}};
}

nlohmann::json pathOf(const Trajectory& trajectory) {
  nlohmann::json path = nlohmann::json::array();
  for (const StampedTransform& entry : trajectory) {
    path.push_back({entry.stamp.seconds(), entry.world_from_vehicle.translation().x(),
                    entry.world_from_vehicle.translation().y()});
  }
  return path;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Errors of a trajectory against the true one (both TUM text): not aligned, aligned at the first pose, "
      "aligned "
      "over all poses, and drift over distance.");
  std::string estimate_path, truth_path;
  app.addOption("--estimate", &estimate_path, "trajectory to judge (.tum)").required();
  app.addOption("--truth", &truth_path, "true trajectory (.tum)").required();
  const ReportArgument report(&app, "trajectory_errors");
  describeJson(&app, R"(kind: "trajectory"; alignments: of the three kinds above {label, num_poses,
num_without_truth, truth_length_m, poses [[time_s, forward_m, left_m, up_m, rotation_rad]], and error
distributions position_m, longitudinal_m, lateral_m, rotation_rad}; scale_error: 0.01 for 1 % too long;
drift: [{distance_m, error distributions translation_percent, rotation_rad}]; estimate_path, truth_path:
[[time_s, x_m, y_m]].)");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    const Trajectory estimate = readTrajectory(estimate_path);
    const Trajectory truth = readTrajectory(truth_path);
    nlohmann::json json = {{"kind", "trajectory"}};
    try {
      json["alignments"] = {
          evaluate(estimate, truth, TrajectoryAlignment::kNone, "not aligned"),
          evaluate(estimate, truth, TrajectoryAlignment::kFirstPose, "aligned at the first pose"),
          evaluate(estimate, truth, TrajectoryAlignment::kSe3, "aligned over all poses"),
      };
      if (const auto scale_error = evaluateScaleError(estimate, truth)) {
        std::printf("scale: %+.4f %%\n", 100.0 * *scale_error);
        json["scale_error"] = *scale_error;
      }
    } catch (const InputError& error) {
      throw InputError(estimate_path + " against " + truth_path + ": " + error.what());
    }
    json["drift"] = nlohmann::json::array();
    for (const double distance_m : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0}) {
      const DriftErrors drift = evaluateDrift(estimate, truth, distance_m);
      if (drift.translation_percent.count == 0) {
        continue;
      }
      std::printf("drift over %5.1f m: %.3f %% and %.4f degrees (median of %zu)\n", distance_m,
                  drift.translation_percent.percentile_50,
                  kDegreesPerRadian * drift.rotation_rad.percentile_50, drift.translation_percent.count);
      json["drift"].push_back({{"distance_m", distance_m},
                               {"translation_percent", drift.translation_percent},
                               {"rotation_rad", drift.rotation_rad}});
    }
    json["estimate_path"] = pathOf(estimate);
    json["truth_path"] = pathOf(truth);
    *found = json;
    report.write(*found);
  });
}
