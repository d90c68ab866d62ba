#include <cstdio>
#include <string>

#include <opencv2/imgcodecs.hpp>

#include "tool_arguments.h"
#include "vcharge_core/dense_maps/height_map_file.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_evaluation/height_map_errors.h"

namespace {

using namespace vcharge;

const char* nameOf(TapeMeasurement::Kind kind) {
  return kind == TapeMeasurement::Kind::kLength ? "length" : "height";
}

double percent(size_t part, size_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

void print(const HeightMapErrors& errors) {
  std::printf("visible cells away from steps: %zu, %.1f %% of them in the map\n", errors.num_seen,
              percent(errors.num_mapped, errors.num_seen));
  std::printf("height error: mean %.2f cm, 95 %% within %.2f cm, %.1f %% within 10 cm, signed mean %.2f cm\n",
              100.0 * errors.height_m.mean, 100.0 * errors.height_m.percentile_95,
              100.0 * errors.fraction_within_10_cm, 100.0 * errors.mean_signed_m);
  std::printf(
      "steps: %zu points, %.1f %% of them mapped on both sides, %.1f %% of these found; horizontal error: "
      "mean %.2f cm, 95 %% within %.2f cm\n",
      errors.num_steps, percent(errors.num_steps_mapped, errors.num_steps),
      percent(errors.num_steps_found, errors.num_steps_mapped), 100.0 * errors.step_position_m.mean,
      100.0 * errors.step_position_m.percentile_95);
  std::printf(
      "heights of kerbs: %zu points visible, %zu of them in the map, error mean %.2f cm, 95 %% within %.2f "
      "cm\n",
      errors.num_kerbs_seen, errors.kerbs.size(), 100.0 * errors.kerb_height_m.mean,
      100.0 * errors.kerb_height_m.percentile_95);
  std::printf(
      "tape measure: %zu distances on rigid objects, %zu not in the map, error of the others mean %.2f cm, "
      "largest %.2f cm\n",
      errors.measurements.size(), errors.num_measurements_missing, 100.0 * errors.mean_measurement_m,
      100.0 * errors.max_measurement_m);
  const DrivabilityErrors& drivability = errors.drivability;
  std::printf(
      "drivable grid: visible faces of rigid objects over 30 cm: %zu points, obstacles %.1f %%, open %.1f "
      "%%; "
      "visible open ground: drivable %.1f %%; drivable cells: inside objects over 30 cm %.1f %%; solid "
      "cells: %zu, on open ground %zu\n",
      drivability.num_faces, percent(drivability.num_faces_blocked, drivability.num_faces),
      percent(drivability.open_faces.size(), drivability.num_faces),
      percent(drivability.num_open_drivable, drivability.num_open_ground),
      percent(drivability.num_drivable_inside, drivability.num_drivable), drivability.num_solid,
      drivability.num_solid_on_ground);
  std::printf("  %3s %-7s %16s %16s %8s %8s %9s\n", "", "kind", "from x, y (m)", "to x, y (m)", "truth m",
              "map m", "error cm");
  int number = 0;
  for (const TapeMeasurement& m : errors.measurements) {
    std::printf("  %3d %-7s %7.2f, %7.2f %7.2f, %7.2f %8.3f %8.3f %9.1f\n", ++number, nameOf(m.kind),
                m.from_m.x(), m.from_m.y(), m.to_m.x(), m.to_m.y(), m.truth_m, m.map_m,
                100.0 * (m.map_m - m.truth_m));
  }
}

nlohmann::json toJson(const DrivabilityErrors& errors) {
  nlohmann::json open_faces = nlohmann::json::array();
  for (const HeightStep& face : errors.open_faces) {
    open_faces.push_back({{"position_m", {face.position_m.x(), face.position_m.y()}},
                          {"direction", {face.direction.x(), face.direction.y()}},
                          {"height_m", face.high_m - face.low_m}});
  }
  return {{"num_faces", errors.num_faces},
          {"num_faces_blocked", errors.num_faces_blocked},
          {"open_faces", open_faces},
          {"num_drivable", errors.num_drivable},
          {"num_drivable_inside", errors.num_drivable_inside},
          {"num_open_ground", errors.num_open_ground},
          {"num_open_drivable", errors.num_open_drivable},
          {"num_solid", errors.num_solid},
          {"num_solid_on_ground", errors.num_solid_on_ground}};
}

nlohmann::json toJson(const HeightMapErrors& errors) {
  nlohmann::json measurements = nlohmann::json::array(), kerbs = nlohmann::json::array();
  for (const KerbError& kerb : errors.kerbs) {
    kerbs.push_back({{"position_m", {kerb.position_m.x(), kerb.position_m.y()}},
                     {"error_m", kerb.error_m},
                     {"nearest_view_m", kerb.nearest_view_m}});
  }
  for (const TapeMeasurement& m : errors.measurements) {
    measurements.push_back({{"kind", nameOf(m.kind)},
                            {"from_m", {m.from_m.x(), m.from_m.y()}},
                            {"to_m", {m.to_m.x(), m.to_m.y()}},
                            {"truth_m", m.truth_m},
                            {"map_m", m.map_m}});
  }
  return {{"kind", "height_map"},
          {"num_seen", errors.num_seen},
          {"num_mapped", errors.num_mapped},
          {"height_m", errors.height_m},
          {"mean_signed_m", errors.mean_signed_m},
          {"fraction_within_10_cm", errors.fraction_within_10_cm},
          {"num_steps", errors.num_steps},
          {"num_steps_mapped", errors.num_steps_mapped},
          {"num_steps_found", errors.num_steps_found},
          {"step_position_m", errors.step_position_m},
          {"num_kerbs_seen", errors.num_kerbs_seen},
          {"num_kerbs", errors.kerbs.size()},
          {"kerbs", kerbs},
          {"kerb_height_m", errors.kerb_height_m},
          {"mean_measurement_m", errors.mean_measurement_m},
          {"max_measurement_m", errors.max_measurement_m},
          {"num_measurements_missing", errors.num_measurements_missing},
          {"drivability", toJson(errors.drivability)},
          {"measurements", measurements}};
}

/// Errors of -20 (blue) to 20 cm (red).
void writeErrorPicture(const HeightMap& map, const HeightMapErrors& errors, const std::string& folder) {
  HeightMap picture = map;
  picture.height_m = errors.error_m;
  const std::string path = folder + "/height_map_errors.png";
  writeFileAtomically(path, [&](const std::string& temporary) {
    if (!cv::imwrite(temporary, colourHeight(picture, -0.2, 0.2))) {
      throw InputError(path + ": cannot be written");
    }
  });
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Errors of a height map against the truth of a simulated drive: heights of the cells that were "
      "visible, positions "
      "of steps, heights of kerbs, tape-measure distances, and the drivable grid.");
  std::string map_path, truth_path, rig_path, trajectory_path;
  app.addOption("--map", &map_path, "folder of build_height_map").required().check(requireNotEmpty);
  app.addOption("--truth", &truth_path,
                "the drive's truth folder (height_map.yaml, obstacles.yaml, trajectory.tum)")
      .required();
  app.addOption("--rig", &rig_path, "rig.yaml of the drive").required();
  app.addOption(
      "--trajectory", &trajectory_path,
      "poses with which the map was made (TUM), to align it with the truth; without them the map must be in "
      "the world's frame");
  const OptionsArgument<HeightMapErrorOptions> options(&app);
  const ReportArgument report(&app, "height_map_errors");
  describeJson(&app, R"(kind: "height_map"; num_seen, num_mapped: cells; mean_signed_m; fraction_within_10_cm;
num_steps, num_steps_mapped, num_steps_found; num_kerbs_seen, num_kerbs; error distributions height_m,
step_position_m, kerb_height_m; kerbs: [{position_m [x, y], error_m, nearest_view_m}]; measurements:
[{kind, from_m, to_m, truth_m, map_m}]; mean_measurement_m, max_measurement_m, num_measurements_missing;
drivability: {num_faces, num_faces_blocked, open_faces [{position_m, direction, height_m}], num_drivable,
num_drivable_inside, num_open_ground, num_open_drivable, num_solid, num_solid_on_ground}.)");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (options.shown()) {
      return;
    }
    const HeightMapErrorOptions error_options = options.read();
    const HeightMap map = readHeightMap(map_path);
    const HeightMap truth = readHeightMap(truth_path);
    const Trajectory true_poses = readTrajectory(truth_path + "/trajectory.tum");
    const CameraRig rig = readCameraRig(rig_path);
    if (!rig.hasExtrinsics() || true_poses.empty()) {
      throw InputError(rig_path + ", " + truth_path +
                       ": expected vehicle_from_camera of every camera, and poses");
    }
    RigidTransform world_from_map;
    if (!trajectory_path.empty()) {
      try {
        world_from_map = alignToTruth(readTrajectory(trajectory_path), true_poses);
      } catch (const InputError& error) {
        throw InputError(trajectory_path + ": " + error.what());
      }
    }
    const IsRigid is_rigid = makeIsRigid(readTruthObstacles(truth_path + "/obstacles.yaml"));
    const HeightMapErrors errors =
        evaluateHeightMap(map, world_from_map, truth, true_poses, rig, is_rigid, error_options);
    if (errors.num_seen == 0) {
      throw InputError(map_path + ": none of its cells was visible in the drive of " + truth_path);
    }
    print(errors);
    *found = toJson(errors);
    report.write(*found);
    if (!report.folder().empty()) {
      writeErrorPicture(map, errors, report.folder());
    }
  });
}
