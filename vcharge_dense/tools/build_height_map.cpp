#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_dense/height_map_output.h"
#include "vcharge_dense/height_mapper.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using namespace vcharge;

struct Arguments {
  std::string bag, rig, trajectory, map, options, output;
  bool keep_range_maps = false;
  bool show_options = false;
};

HeightMapOptions readOptions(const Arguments& arguments) {
  HeightMapOptions options;
  if (!arguments.trajectory.empty() || !arguments.map.empty()) {
    options.range_maps.plane_sweep.pose_noise = PoseNoiseOptions::trajectory();
  }
  if (!arguments.options.empty()) {
    readFieldsFromFile(arguments.options, &options);
  }
  return options;
}

/// Shows a progress bar for each step.
class Steps {
 public:
  void show(const std::string& step, double fraction) {
    if (step != step_) {
      bar_.reset();
      bar_.emplace(step);
      step_ = step;
    }
    bar_->update(fraction);
  }
  void end() { bar_.reset(); }

 private:
  std::string step_;
  std::optional<ProgressBar> bar_;
};

/// Prints a summary and returns it for --json.
nlohmann::json report(const HeightMapResult& result) {
  const HeightMapStatistics& statistics = result.statistics;
  ContentHasher hasher;
  addToHash(result.map, &hasher);
  std::printf("range maps: %zu (%zu of them from an earlier run)\n", statistics.num_views,
              statistics.num_reused);
  std::printf("grid: %d x %d cells of %g m in the frame %s, %zu observed, %zu solid\n",
              result.map.height_m.cols, result.map.height_m.rows, result.map.cell_size_m,
              result.map.frame_id.c_str(), statistics.num_observed, statistics.num_solid);
  std::printf("labelling: %d iterations, gap %.2g per cell; heights: %d iterations, gap %.2g m per cell%s\n",
              statistics.label_iterations, statistics.label_gap_per_cell, statistics.height_iterations,
              statistics.height_gap_per_cell, statistics.converged ? "" : " (not converged)");
  for (const auto& [stage, time_s] : statistics.times_s) {
    std::printf("%s: %.1f s\n", stage.c_str(), time_s);
  }
  std::printf("content hash: %s\n", hasher.hex().c_str());
  return {{"num_range_maps", statistics.num_views},
          {"num_reused_range_maps", statistics.num_reused},
          {"size_cells", {result.map.height_m.cols, result.map.height_m.rows}},
          {"cell_size_m", result.map.cell_size_m},
          {"num_observed_cells", statistics.num_observed},
          {"num_solid_cells", statistics.num_solid},
          {"converged", statistics.converged},
          {"stage_s", statistics.times_s},
          {"content_hash", hasher.hex()}};
}

/// The poses from --trajectory or --map, if given.
std::optional<Trajectory> readPoses(const Arguments& arguments) {
  if (!arguments.trajectory.empty()) {
    return readTrajectory(arguments.trajectory);
  }
  if (!arguments.map.empty()) {
    return trajectoryOf(*readSparseMap(arguments.map));
  }
  return std::nullopt;
}

/// Adds the names of the files to the errors of the stage.
template <class Work>
void nameFilesInErrors(const Arguments& arguments, const Work& work) {
  try {
    work();
  } catch (const InputError& error) {
    const std::string poses = !arguments.trajectory.empty() ? arguments.trajectory
                              : !arguments.map.empty()      ? arguments.map
                                                            : arguments.bag + ": /odom";
    throw InputError(arguments.bag + " with poses from " + poses + ": " + error.what());
  }
}

/// Passes a drive on to the stage.
class NamingConsumer : public DriveConsumer {
 public:
  NamingConsumer(const Arguments& arguments, HeightMapper* mapper) : arguments_(arguments), mapper_(mapper) {}
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    nameFilesInErrors(arguments_, [&] { mapper_->addImage(camera_index, stamp, image); });
  }
  void addOdometry(const VehicleOdometry& odometry) override {
    nameFilesInErrors(arguments_, [&] { mapper_->addOdometry(odometry); });
  }

 private:
  const Arguments& arguments_;
  HeightMapper* const mapper_;
};

void buildHeightMap(const Arguments& arguments, nlohmann::json* found) {
  if (!arguments.trajectory.empty() && !arguments.map.empty()) {
    throw InputError("--trajectory and --map: expected one of them");
  }
  const HeightMapOptions options = readOptions(arguments);
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  std::string work = arguments.output;
  while (work.size() > 1 && work.back() == '/') {
    work.pop_back();
  }
  work += ".range_maps";
  HeightMapper mapper(rig, options, work, fileHash(arguments.bag));
  BagDriveSourceOptions source_options;
  source_options.cameras = options.range_maps.cameras;
  BagDriveSource source(arguments.bag, rig, source_options);
  if (const std::optional<Trajectory> poses = readPoses(arguments)) {
    const auto [first, last] = source.recordedSpan();
    nameFilesInErrors(arguments, [&, first = first, last = last] { mapper.checkGrid(*poses, first, last); });
    mapper.setTrajectory(*poses);
  }
  Steps steps;
  NamingConsumer consumer(arguments, &mapper);
  source.run(&consumer, [&](double fraction) { steps.show("range maps", fraction); });
  HeightMapResult result;
  nameFilesInErrors(arguments, [&] {
    result = mapper.finish([&](const std::string& step, double fraction) { steps.show(step, fraction); });
  });
  steps.end();
  writeHeightMapFolder(&result, arguments.output);
  if (!arguments.keep_range_maps) {
    removeFolder(work);
  }
  *found = report(result);
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Builds a height map of a recorded drive by fusing range maps: heights with confidence, a grid of "
      "drivable cells, a mesh and an OctoMap. Range maps are kept in OUTPUT.range_maps until the end, so "
      "that "
      "an interrupted run can resume.");
  Arguments arguments;
  app.addOption("--bag", &arguments.bag, "bag of the drive").required();
  app.addOption("--rig", &arguments.rig, "rig.yaml with extrinsics").required();
  app.addOption("--trajectory", &arguments.trajectory,
                "TUM file, e.g. from build_map; without it poses come from the odometry");
  app.addOption("--map", &arguments.map, "sparse map of this drive (*.vmap), whose keyframe poses are used");
  app.addOption("--options", &arguments.options, "YAML with overrides of HeightMapOptions");
  app.addOption("--output", &arguments.output, "folder to write").required().check(requireOutputFolder);
  app.addFlag("--keep-range-maps", &arguments.keep_range_maps, "keep OUTPUT.range_maps at the end");
  addShowOptions(&app, &arguments.show_options);
  app.setFooter(
      "Keys of --json: num_range_maps, num_reused_range_maps, size_cells, cell_size_m, num_observed_cells, "
      "num_solid_cells, converged, stage_s (wall time), content_hash.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (arguments.show_options) {
      std::cout << showOptions(readOptions(arguments));
      return;
    }
    buildHeightMap(arguments, found);
  });
}
