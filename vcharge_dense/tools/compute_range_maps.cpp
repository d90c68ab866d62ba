#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/range_map_file.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_dense/range_mapper.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using namespace vcharge;

struct Arguments {
  std::string bag, rig, trajectory, options, output;
  std::string preset = "default";
  std::vector<std::string> cameras;
  bool online = false;
  bool no_pictures = false;
  bool show_options = false;
};

void writePicture(const RangeMap& map, const PlaneSweepOptions& options, const std::string& output) {
  const std::string path =
      output + "/" + map.camera_name + "/" + std::to_string(map.stamp.nanoseconds()) + "_range.png";
  const cv::Mat picture = colourRange(map.range_m, options.min_distance_m, options.max_distance_m);
  writeFileAtomically(path, [&](const std::string& temporary) {
    if (!cv::imwrite(temporary, picture)) {
      throw InputError(path + ": cannot be written");
    }
  });
}

RangeMapperOptions readOptions(const Arguments& arguments) {
  RangeMapperOptions options = arguments.online ? RangeMapperOptions() : RangeMapperOptions::offline();
  if (!arguments.trajectory.empty()) {
    options.plane_sweep.pose_noise = PoseNoiseOptions::trajectory();
  }
  const std::vector<std::string> presets = enumNames<RangePreset>();
  const auto preset = std::find(presets.begin(), presets.end(), arguments.preset);
  options.usePreset(static_cast<RangePreset>(preset - presets.begin()));
  if (!arguments.options.empty()) {
    readFieldsFromFile(arguments.options, &options);
  }
  if (!arguments.cameras.empty()) {
    options.cameras = arguments.cameras;
  }
  return options;
}

/// Prints a summary and returns it for --json.
nlohmann::json report(const RangeMapper& mapper, const std::vector<uint64_t>& maps,
                      const std::vector<double>& known, const ContentHasher& hasher) {
  nlohmann::json cameras = nlohmann::json::array();
  for (const RangeMapperStatus& status : mapper.status()) {
    cameras.push_back({{"name", status.camera_name},
                       {"num_range_maps", status.references},
                       {"num_inter_camera", status.inter_camera},
                       {"num_images", status.images},
                       {"num_standing", status.standing},
                       {"num_without_pose", status.without_pose},
                       {"num_without_neighbours", status.without_neighbours},
                       {"num_resets", status.resets},
                       {"message", status.message}});
    std::cout << status.camera_name << ": " << status.references << " range maps from " << status.images
              << " images (" << status.standing << " standing, " << status.without_pose << " without pose, "
              << status.without_neighbours << " without neighbours, " << status.resets << " restarts)\n";
  }
  uint64_t num_maps = 0;
  double sum_known = 0.0;
  for (size_t i = 0; i < maps.size(); ++i) {
    num_maps += maps[i];
    sum_known += known[i];
  }
  const double known_ratio = num_maps > 0 ? sum_known / static_cast<double>(num_maps) : 0.0;
  std::cout << "range maps: " << num_maps << ", known pixels: " << 100.0 * known_ratio << " %\n"
            << "content hash: " << hasher.hex() << "\n";
  return {{"num_range_maps", num_maps},
          {"known_ratio", known_ratio},
          {"cameras", cameras},
          {"content_hash", hasher.hex()}};
}

void computeRangeMaps(const Arguments& arguments, nlohmann::json* found) {
  const RangeMapperOptions options = readOptions(arguments);
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  ContentHasher hasher;
  std::vector<uint64_t> maps(rig->cameras.size(), 0);
  std::vector<double> known(rig->cameras.size(), 0.0);
  RangeMapper* sweeper = nullptr;
  RangeMapper mapper(rig, options, [&](const RangeTask& task) {
    const RangeMap map = sweeper->sweep(task);
    writeRangeMap(map, arguments.output);
    if (!arguments.no_pictures) {
      writePicture(map, options.plane_sweep, arguments.output);
    }
    addToHash(map, &hasher);
    ++maps[task.camera_index];
    known[task.camera_index] +=
        cv::countNonZero(map.range_m == map.range_m) / static_cast<double>(map.range_m.total());
  });
  sweeper = &mapper;
  if (!arguments.trajectory.empty()) {
    mapper.setTrajectory(readTrajectory(arguments.trajectory));
  }
  BagDriveSourceOptions source_options;
  source_options.cameras = options.cameras;
  BagDriveSource source(arguments.bag, rig, source_options);
  {
    ProgressBar progress("range maps");
    source.run(&mapper, [&](double fraction) { progress.update(fraction); });
    mapper.finish();
  }
  *found = report(mapper, maps, known, hasher);
  if ((*found)["num_range_maps"] == 0) {
    std::string reasons;
    for (const RangeMapperStatus& status : mapper.status()) {
      reasons += (reasons.empty() ? "" : "; ") + status.camera_name + ": " + status.message;
    }
    throw InputError(arguments.bag + ": no range map could be made (" + reasons + ")");
  }
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Computes range maps of a recorded drive by plane sweep on the fisheye images. Writes for each camera "
      "and image range, standard deviation and confidence as float TIFF, and the range in colours as PNG.");
  Arguments arguments;
  app.addOption("--bag", &arguments.bag, "bag of the drive").required();
  app.addOption("--rig", &arguments.rig, "rig.yaml with extrinsics").required();
  app.addOption("--trajectory", &arguments.trajectory, "TUM file; without it poses come from the odometry");
  app.addOption("--options", &arguments.options, "YAML with overrides of RangeMapperOptions");
  app.addOption("--preset", &arguments.preset, "speed or accuracy; --options overrides it")
      .oneOf(enumNames<RangePreset>())
      .showDefault();
  app.addOption("--cameras", &arguments.cameras, "cameras of the rig by name (default: all)");
  app.addOption("--output", &arguments.output, "folder to write").required().check(requireOutputFolder);
  app.addFlag("--online", &arguments.online,
              "like the nodelet: only images before the reference (default: before and after it)");
  app.addFlag("--no-pictures", &arguments.no_pictures, "write no PNG");
  addShowOptions(&app, &arguments.show_options);
  app.setFooter(
      "Keys of --json: num_range_maps, known_ratio (of their pixels), cameras (name, num_range_maps, "
      "num_inter_camera, num_images, num_standing, num_without_pose, num_without_neighbours, num_resets, "
      "message), "
      "content_hash.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (arguments.show_options) {
      std::cout << showOptions(readOptions(arguments));
      return;
    }
    computeRangeMaps(arguments, found);
  });
}
