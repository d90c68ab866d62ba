#include <cmath>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_evaluation/report.h"
#include "vcharge_evaluation/trajectory_errors.h"

namespace {

constexpr double kDegreesPerRadian = 57.29577951308232;

void printRow(const char* label, const vcharge::ErrorDistribution& d, double factor) {
  std::printf("  %-22s %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f\n", label, factor * d.mean,
              factor * d.root_mean_square, factor * d.percentile_50, factor * d.percentile_90,
              factor * d.percentile_95, factor * d.percentile_99, factor * d.max);
}

nlohmann::json evaluate(const vcharge::Trajectory& estimate, const vcharge::Trajectory& truth,
                        vcharge::TrajectoryAlignment alignment, const char* label) {
  const vcharge::TrajectoryErrors errors = vcharge::evaluateTrajectory(estimate, truth, alignment);
  std::printf("%s: %zu poses over %.1f m, %zu without truth\n", label, errors.poses.size(),
              errors.truth_length_m, errors.num_without_truth);
  std::printf("  %-22s %8s %8s %8s %8s %8s %8s %8s\n", "", "mean", "rms", "50 %", "90 %", "95 %", "99 %",
              "max");
  printRow("position (m)", errors.position_m, 1.0);
  printRow("along (m)", errors.longitudinal_m, 1.0);
  printRow("across (m)", errors.lateral_m, 1.0);
  printRow("rotation (deg)", errors.rotation_rad, kDegreesPerRadian);
  nlohmann::json poses = nlohmann::json::array();
  for (const vcharge::PoseError& pose : errors.poses) {
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

nlohmann::json pathOf(const vcharge::Trajectory& trajectory) {
  nlohmann::json path = nlohmann::json::array();
  for (const vcharge::StampedTransform& entry : trajectory) {
    path.push_back({entry.stamp.seconds(), entry.world_from_vehicle.translation().x(),
                    entry.world_from_vehicle.translation().y()});
  }
  return path;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Errors of a trajectory against truth (both TUM text): as it is, aligned at the first pose, aligned "
      "over all poses, and drift over distance.");
  std::string estimate_path, truth_path, report;
  app.add_option("--estimate", estimate_path, "trajectory to judge (.tum)")->required();
  app.add_option("--truth", truth_path, "true trajectory (.tum)")->required();
  app.add_option("--report", report, "folder for trajectory_errors.json and its plots")
      ->check(vcharge::requireNotEmpty);
  return vcharge::runTool(&app, argc, argv, [&] {
    const vcharge::Trajectory estimate = vcharge::readTrajectory(estimate_path);
    const vcharge::Trajectory truth = vcharge::readTrajectory(truth_path);
    nlohmann::json json = {{"kind", "trajectory"}};
    try {
      json["alignments"] = {
          evaluate(estimate, truth, vcharge::TrajectoryAlignment::kNone, "not aligned"),
          evaluate(estimate, truth, vcharge::TrajectoryAlignment::kFirstPose, "aligned at the first pose"),
          evaluate(estimate, truth, vcharge::TrajectoryAlignment::kSe3, "aligned over all poses"),
      };
      if (const auto scale_error = vcharge::evaluateScaleError(estimate, truth)) {
        std::printf("scale: %+.4f %%\n", 100.0 * *scale_error);
        json["scale_error"] = *scale_error;
      }
    } catch (const vcharge::InputError& error) {
      throw vcharge::InputError(estimate_path + " against " + truth_path + ": " + error.what());
    }
    json["drift"] = nlohmann::json::array();
    for (const double distance_m : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0}) {
      const vcharge::DriftErrors drift = vcharge::evaluateDrift(estimate, truth, distance_m);
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
    if (!report.empty()) {
      vcharge::writeReport(json, report, "trajectory_errors");
    }
  });
}
