#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>

#include "vcharge_calibration/rig_calibrator.h"
#include "vcharge_calibration/rig_report.h"
#include "vcharge_core/camera_rig.h"
#include "vcharge_core/command_line.h"
#include "vcharge_core/content_hash.h"
#include "vcharge_core/error.h"
#include "vcharge_core/file_io.h"
#include "vcharge_core/options.h"
#include "vcharge_core/progress_bar.h"
#include "vcharge_core/sparse_map_file.h"
#include "vcharge_ros/bag_drive_source.h"

namespace {

using namespace vcharge;

constexpr double kDegrees = 57.29577951308232;

struct Arguments {
  std::string bag, rig, options, output, map, trajectory, report;
  bool show_options = false;
};

void print(const RigCalibration& result) {
  std::printf(
      "%.0f m, %.0f degrees of turn to the left, %.0f to the right; %d keyframes, %lld landmarks, %d loop "
      "edges, "
      "error %.3f px RMS per coordinate\n",
      result.distance_m, kDegrees * result.left_turn_rad, kDegrees * result.right_turn_rad,
      result.num_keyframes, static_cast<long long>(result.num_landmarks), result.num_loop_edges,
      result.rms_px);
  if (result.rig == nullptr) {
    for (const CameraCalibration& camera : result.cameras) {
      const Eigen::Vector3d& travel = camera.initial.travel_in_camera;
      if (travel.norm() > 0.0) {
        std::printf("camera '%s': straight ahead is (%.4f, %.4f, %.4f) in its frame\n", camera.name.c_str(),
                    travel.x(), travel.y(), travel.z());
      }
    }
    return;
  }
  std::printf("%-10s %9s %9s %9s   %9s %9s %9s   %8s %8s\n", "camera", "x (cm)", "y (cm)", "z (cm)",
              "yaw (deg)", "pitch", "roll", "points", "shared");
  for (size_t i = 0; i < result.cameras.size(); ++i) {
    const CameraCalibration& camera = result.cameras[i];
    const RigidTransform& place = *result.rig->cameras[i].vehicle_from_camera;
    // Yaw, pitch and roll of the camera turned forwards: zero for one that looks ahead, upright.
    Eigen::Matrix3d optical_from_body;
    optical_from_body << 0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0;
    const Eigen::Matrix3d body = place.rotationMatrix() * optical_from_body;
    const double yaw = std::atan2(body(1, 0), body(0, 0));
    const double pitch = std::asin(std::min(1.0, std::max(-1.0, -body(2, 0))));
    const double roll = std::atan2(body(2, 1), body(2, 2));
    std::printf("%-10s %9.2f %9.2f %9.2f   %9.3f %9.3f %9.3f   %8lld %8lld\n", camera.name.c_str(),
                100.0 * place.translation().x(), 100.0 * place.translation().y(),
                100.0 * place.translation().z(), kDegrees * yaw, kDegrees * pitch, kDegrees * roll,
                static_cast<long long>(camera.num_observations),
                static_cast<long long>(camera.num_shared_landmarks));
    const Eigen::Matrix<double, 6, 1> sigmas = camera.covariance.diagonal().cwiseSqrt();
    std::printf("  +-       %9.2f %9.2f %9.2f   %9.3f %9.3f %9.3f   about z, y, x of the vehicle\n",
                100.0 * sigmas[0], 100.0 * sigmas[1], 100.0 * sigmas[2], kDegrees * sigmas[5],
                kDegrees * sigmas[4], kDegrees * sigmas[3]);
    if (!camera.weakest_direction.empty()) {
      std::printf("  least certain: %s\n", camera.weakest_direction.c_str());
    }
  }
  std::printf("height: %s\n", result.height_source.c_str());
}

void calibrate(const Arguments& arguments, const RigCalibratorOptions& options) {
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  RigCalibrator calibrator(rig, options);
  {
    ProgressBar bar("following the drive");
    BagDriveSourceOptions source_options;
    source_options.max_image_gap_s = INFINITY;  // a camera that pauses is borne, and told of
    BagDriveSource source(arguments.bag, rig, source_options);
    source.run(&calibrator, [&](double fraction) { bar.update(fraction); });
  }
  RigCalibration result;
  {
    ProgressBar bar("calibrating");
    result = calibrator.finish([&](const StageProgress& progress) {
      bar.update((progress.number - 1 + progress.fraction) / progress.num_stages);
    });
  }
  print(result);
  for (const auto& [stage, seconds] : calibrator.state().report.stage_s) {
    std::printf("%s %.1f s; ", stage.c_str(), seconds);
  }
  std::printf("\n%s\n", toString(result.verdict).c_str());
  for (const std::string& remark : result.remarks) {
    std::printf("  %s\n", remark.c_str());
  }
  if (!arguments.report.empty()) {
    createFolder(arguments.report);
    writeTextFileAtomically(
        (std::filesystem::path(arguments.report) / "rig_report.html").string(),
        makeRigReport("Rig by " + std::filesystem::path(arguments.bag).filename().string(), result,
                      calibrator.state()));
  }
  if (result.verdict == Verdict::kFail) {
    throw InputError(arguments.bag + ": FAIL: " + result.remarks.front());
  }
  if (!arguments.map.empty()) {
    std::ostringstream option_text;
    option_text << writeFields(options);
    writeSparseMap(*calibrator.map(),
                   {{"bag", arguments.bag},
                    {"bag_hash", fileHash(arguments.bag)},
                    {"rig", arguments.rig},
                    {"calibrator_options", option_text.str()},
                    {"program", "calibrate_rig 0.1.0"}},
                   arguments.map);
  }
  if (!arguments.trajectory.empty()) {
    writeTrajectory(calibrator.trajectory(), arguments.trajectory);
  }
  const std::filesystem::path folder = std::filesystem::path(arguments.output).parent_path();
  for (const RigCamera& camera : result.rig->cameras) {
    if (!camera.mask_file.empty()) {
      createFolder((folder / camera.mask_file).parent_path().string());
    }
  }
  writeCameraRig(*result.rig, arguments.output);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Calibrates the places of a rig's cameras on the vehicle from a drive: images, /odom and the cameras' "
      "intrinsics, without a guess, overlap or a board. Drive 100 m or more with turns to both sides and "
      "come "
      "past the same places again, best a figure of eight. Prints every degree of freedom with its standard "
      "deviation and a verdict: PASS, WARN with what is missing, or FAIL, which writes no file.");
  Arguments arguments;
  app.add_option("--bag", arguments.bag, "drive with images and /odom");
  app.add_option("--rig", arguments.rig, "rig.yaml with intrinsics; extrinsics that it has are not used");
  app.add_option("--output", arguments.output, "rig.yaml to write")->check(requireNotEmpty);
  app.add_option("--map", arguments.map, "sparse map to write (.vmap)")->check(requireNotEmpty);
  app.add_option("--trajectory", arguments.trajectory, "poses of all frames to write (.tum)")
      ->check(requireNotEmpty);
  app.add_option("--report", arguments.report, "folder for rig_report.html")->check(requireNotEmpty);
  app.add_option("--options", arguments.options, "YAML with options of the calibration");
  app.add_flag("--show-options", arguments.show_options, "prints all options as YAML");
  return runTool(&app, argc, argv, [&] {
    RigCalibratorOptions options;
    if (!arguments.options.empty()) {
      readFieldsFromFile(arguments.options, &options);
    }
    if (arguments.show_options) {
      std::ostringstream text;
      text << writeFields(options);
      std::printf("%s\n", text.str().c_str());
      return;
    }
    if (arguments.bag.empty() || arguments.rig.empty() || arguments.output.empty()) {
      throw InputError("--bag, --rig and --output are required");
    }
    calibrate(arguments, options);
  });
}
