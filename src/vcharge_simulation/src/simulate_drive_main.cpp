#include <algorithm>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include <tbb/global_control.h>
#include <CLI/CLI.hpp>
#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/error.h"
#include "vcharge_core/file_io.h"
#include "vcharge_core/progress_bar.h"
#include "vcharge_ros/drive_bag_writer.h"
#include "vcharge_simulation/camera_response.h"
#include "vcharge_simulation/drive_simulator.h"
#include "vcharge_simulation/golf_rig.h"
#include "vcharge_simulation/lot_scene.h"
#include "vcharge_simulation/renderer.h"
#include "vcharge_simulation/truth_maps.h"

namespace {

struct Arguments {
  std::string scene = "lot";
  std::string drive = "short";
  std::string output;
  std::string noise = "on";
  std::vector<std::string> cameras;
  uint64_t seed = 1;
  double image_scale = 1.0;
  double duration_s = 0.0;
  double height_cell_m = 0.1;
  double height_limit_m = 2.5;
  bool truth_range = false;
  int threads = 0;
};

vcharge::CameraRig selectCameras(const vcharge::CameraRig& rig, const std::vector<std::string>& names) {
  if (names.empty()) {
    return rig;
  }
  vcharge::CameraRig selected;
  selected.vehicle_frame = rig.vehicle_frame;
  for (const std::string& name : names) {
    selected.cameras.push_back(rig.cameras[rig.cameraIndex(name)]);
  }
  return selected;
}

void writeRange(const cv::Mat& range_m, const std::string& folder, vcharge::Timestamp stamp) {
  const std::string path = folder + "/" + std::to_string(stamp.nanoseconds()) + ".tiff";
  vcharge::writeFileAtomically(path, [&](const std::string& temporary) {
    if (!cv::imwrite(temporary, range_m)) {
      throw vcharge::InputError(path + ": cannot be written");
    }
  });
}

void simulate(const Arguments& arguments) {
  using vcharge::CameraView;
  if (arguments.scene != "lot") {
    throw vcharge::InputError("--scene: expected lot, got '" + arguments.scene + "'");
  }
  vcharge::LotDrive plan = vcharge::lotDrive(arguments.drive);
  if (arguments.duration_s > 0.0) {
    plan.motion.duration_s = arguments.duration_s;
  }
  const vcharge::SimulatedDrive drive =
      vcharge::simulateDrive(plan.path, plan.motion, vcharge::WheelOdometerOptions(), arguments.seed);
  vcharge::LotOptions lot;
  lot.day = plan.day;
  lot.ground_texel_m = std::max(lot.ground_texel_m, 0.0125 / arguments.image_scale);
  const vcharge::Renderer renderer(vcharge::buildLotScene(lot));
  const auto body = vcharge::makeGolfBody();
  vcharge::CameraRig rig = selectCameras(vcharge::makeGolfRig(1, arguments.image_scale), arguments.cameras);
  std::vector<CameraView> views;
  for (vcharge::RigCamera& camera : rig.cameras) {
    views.emplace_back(camera, body);
    camera.mask = views.back().mask();
    camera.mask_file = camera.name + "_mask.png";
  }

  const std::filesystem::path output(arguments.output);
  const std::string truth = (output.parent_path() / (output.stem().string() + "_truth")).string();
  vcharge::createFolder(truth);
  vcharge::writeCameraRig(rig, (output.parent_path() / "rig_truth.yaml").string());
  vcharge::writeTrajectory(drive.world_from_vehicle, truth + "/trajectory.tum");
  vcharge::writeHeightMap(
      vcharge::computeHeightMap(renderer, arguments.height_cell_m, arguments.height_limit_m),
      truth + "/height_map");
  vcharge::writeObstacles(renderer.scene().obstacles, truth + "/obstacles.yaml");
  if (arguments.truth_range) {
    for (const vcharge::RigCamera& camera : rig.cameras) {
      vcharge::createFolder(truth + "/range/" + camera.name);
    }
  }

  const vcharge::CameraResponse response;
  vcharge::DriveBagWriter writer(arguments.output, rig);
  vcharge::ProgressBar progress("simulating " + arguments.drive);
  size_t odometry = 0;
  size_t ticks = 0;
  const auto writeUntil = [&](std::optional<vcharge::Timestamp> end) {
    for (; odometry < drive.odometry.size() && (!end || drive.odometry[odometry].stamp <= *end); ++odometry) {
      writer.writeOdometry(drive.odometry[odometry]);
      writer.writeGroundTruth(drive.ground_truth[odometry]);
    }
    for (; ticks < drive.wheel_ticks.size() && (!end || drive.wheel_ticks[ticks].stamp <= *end); ++ticks) {
      writer.writeWheelTicks(drive.wheel_ticks[ticks]);
    }
  };
  for (size_t frame = 0; frame < drive.world_from_vehicle.size(); ++frame) {
    const auto& [stamp, world_from_vehicle] = drive.world_from_vehicle[frame];
    writeUntil(stamp);
    for (size_t camera = 0; camera < views.size(); ++camera) {
      cv::Mat image = response.develop(renderer.renderLight(views[camera], world_from_vehicle));
      if (arguments.noise == "on") {
        image =
            response.addNoise(image, arguments.seed, static_cast<int>(camera), static_cast<int64_t>(frame));
      }
      writer.writeImage(camera, stamp, image);
      if (arguments.truth_range) {
        writeRange(renderer.renderRange(views[camera], world_from_vehicle),
                   truth + "/range/" + rig.cameras[camera].name, stamp);
      }
    }
    progress.update(static_cast<double>(frame + 1) / static_cast<double>(drive.world_from_vehicle.size()));
  }
  writeUntil(std::nullopt);
  writer.close();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Simulates a drive of a car with four fisheye cameras and writes it as a bag, with rig_truth.yaml and "
      "its masks "
      "beside it, and the truth in a folder BAG_truth: trajectory.tum, height_map.tiff and .yaml, "
      "obstacles.yaml, and "
      "range/CAMERA/STAMP_NS.tiff.");
  Arguments arguments;
  app.add_option("--scene", arguments.scene, "lot")->capture_default_str();
  app.add_option("--drive", arguments.drive, "loop, figure_eight, short, other_day or approach")
      ->capture_default_str();
  app.add_option("--output", arguments.output, "bag to write")->required();
  app.add_option("--seed", arguments.seed, "of road, wheels and noise")->capture_default_str();
  app.add_option("--image-scale", arguments.image_scale, "image size over 1280x800")
      ->check(CLI::Range(0.05, 1.0))
      ->capture_default_str();
  app.add_option("--duration-s", arguments.duration_s, "end the drive early")->check(CLI::PositiveNumber);
  app.add_option("--cameras", arguments.cameras, "cameras to render, all by default")->delimiter(',');
  app.add_option("--noise", arguments.noise, "on or off")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app.add_flag("--truth-range", arguments.truth_range, "write the range of every pixel");
  app.add_option("--height-cell-m", arguments.height_cell_m, "cell of the height map")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--height-limit-m", arguments.height_limit_m, "crowns and lamps above this are left out")
      ->capture_default_str();
  app.add_option("--threads", arguments.threads, "0: one per core")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    std::optional<tbb::global_control> limit;
    if (arguments.threads > 0) {
      limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(arguments.threads));
    }
    simulate(arguments);
  } catch (const std::exception& error) {
    std::cerr << "simulate_drive: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
