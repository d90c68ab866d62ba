#include <optional>
#include <string>

#include <tbb/global_control.h>

#include "drive_recorder.h"
#include "vcharge_core/command_line.h"
#include "vcharge_core/options.h"

int main(int argc, char** argv) {
  CLI::App app(
      "Simulates a drive of a car with four fisheye cameras and writes it as a bag, with rig_truth.yaml "
      "beside it and "
      "the truth in a folder BAG_truth: masks, trajectory.tum, height_map.tiff and .yaml, obstacles.yaml, "
      "and "
      "range/CAMERA/STAMP_NS.tiff.");
  vcharge::DriveScenario scenario;
  vcharge::RecordingOptions recording;
  std::string noise = "on";
  int threads = 0;
  app.add_option("--scene", scenario.scene, "lot")->capture_default_str();
  app.add_option("--drive", scenario.drive, "loop, figure_eight, short, other_day or approach")
      ->capture_default_str();
  app.add_option("--rig", scenario.rig, "golf or random")->capture_default_str();
  app.add_option("--output", recording.bag, "bag to write")->required()->check(vcharge::requireNotEmpty);
  app.add_option("--scene-seed", scenario.scene_seed, "of the scene")->capture_default_str();
  app.add_option("--rig-seed", scenario.rig_seed, "of the lenses and how they are mounted")
      ->capture_default_str();
  app.add_option("--seed", scenario.seed, "of the road, and of wheels and noise too")->capture_default_str();
  app.add_option("--sensor-seed", scenario.sensor_seed, "of wheels and noise, where it is not --seed");
  app.add_option(
      "--images-from", recording.images_from,
      "bag of the same drive with the same --seed and --noise off: its images get noise, exposure and ticks "
      "instead of being rendered again");
  app.add_option("--exposure-gain", scenario.exposure_gain, "of the images")->capture_default_str();
  app.add_option("--image-scale", scenario.image_scale, "image size over 1280x800")->capture_default_str();
  app.add_option("--duration-s", scenario.duration_s, "end the drive early; 0: at the end of its path")
      ->capture_default_str();
  app.add_option("--cameras", scenario.cameras, "cameras to render, all by default")->delimiter(',');
  app.add_option("--noise", noise, "on or off")->check(CLI::IsMember({"on", "off"}))->capture_default_str();
  app.add_flag("--truth-range", recording.truth_range, "write the range of every pixel");
  app.add_option("--height-cell-m", recording.height_cell_m, "cell of the height map")->capture_default_str();
  app.add_option("--height-limit-m", recording.height_limit_m, "crowns and lamps above this are left out")
      ->capture_default_str();
  app.add_option("--threads", threads, "0: one per core")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  return vcharge::runTool(&app, argc, argv, [&] {
    std::optional<tbb::global_control> limit;
    if (threads > 0) {
      limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
    }
    scenario.noise = noise == "on";
    vcharge::recordDrive(scenario, recording);
  });
}
