#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "vcharge_core/camera_rig.h"
#include "vcharge_core/command_line.h"
#include "vcharge_core/content_hash.h"
#include "vcharge_core/error.h"
#include "vcharge_core/options.h"
#include "vcharge_core/progress_bar.h"
#include "vcharge_core/sparse_map_file.h"
#include "vcharge_core/trajectory.h"
#include "vcharge_mapping/sparse_mapper.h"
#include "vcharge_ros/bag_drive_source.h"

namespace {

using namespace vcharge;

struct Arguments {
  std::string bag, rig, options, output, trajectory;
  bool show_options = false;
};

void printReport(const SparseMapperReport& report, const SparseMap& map) {
  std::cout << "frames: " << report.num_frames << " (" << report.num_incomplete_frames << " lack a camera, "
            << report.num_frames_without_odometry << " without odometry, " << report.num_standing_frames
            << " standing)\n";
  const std::vector<std::string> hypotheses = enumNames<MotionHypothesis>();
  std::cout << "motions:";
  for (size_t i = 0; i < hypotheses.size(); ++i) {
    std::cout << " " << hypotheses[i] << " " << report.num_motions[i];
  }
  std::map<std::string, int> rejected;
  int num_accepted = 0;
  for (const LoopEdge& edge : report.loop_edges) {
    num_accepted += edge.accepted ? 1 : 0;
    if (!edge.accepted) {
      ++rejected[edge.reason];
    }
  }
  std::cout << "\nkeyframes: " << map.keyframes().size() << ", landmarks: " << report.num_landmarks
            << ", observations: " << report.num_observations << ", error: " << report.rms_px << " px RMS\n"
            << "loop edges: " << num_accepted << " accepted";
  for (const auto& [reason, count] : rejected) {
    std::cout << ", " << count << " rejected (" << reason << ")";
  }
  std::cout << "\nodometer: distance x " << map.contents().odometry_distance_scale << ", turn x "
            << map.contents().odometry_turn_scale << "\ntime:";
  for (const auto& [stage, seconds] : report.stage_s) {
    std::cout << " " << stage << " " << seconds << " s;";
  }
  std::cout << "\ncontent hash: " << map.contentHash() << "\n";
}

/// Of the whole file: a map's provenance should tell two recordings of one name apart.
std::string hashOfFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  ContentHasher hasher;
  std::vector<char> buffer(1 << 20);
  while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || file.gcount() > 0) {
    hasher.addBytes(buffer.data(), static_cast<size_t>(file.gcount()));
  }
  return hasher.hex();
}

void buildMap(const Arguments& arguments, const SparseMapperOptions& options) {
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  SparseMapper mapper(rig, options);
  BagDriveSource source(arguments.bag, rig, BagDriveSourceOptions());
  {
    ProgressBar progress("following the drive");
    source.run(&mapper, [&](double fraction) { progress.update(fraction); });
  }
  std::unique_ptr<ProgressBar> bar;
  std::string shown;
  const std::shared_ptr<const SparseMap> map = mapper.finish([&](const std::string& stage, double fraction) {
    if (stage != shown) {
      bar.reset();
      bar = std::make_unique<ProgressBar>(stage);
      shown = stage;
    }
    bar->update(fraction);
  });
  bar.reset();
  std::ostringstream option_text;
  option_text << writeFields(options);
  writeSparseMap(*map,
                 {{"bag", arguments.bag},
                  {"bag_hash", hashOfFile(arguments.bag)},
                  {"rig", arguments.rig},
                  {"mapper_options", option_text.str()},
                  {"program", "build_map 0.1.0"}},
                 arguments.output);
  if (!arguments.trajectory.empty()) {
    writeTrajectory(mapper.trajectory(), arguments.trajectory);
  }
  printReport(mapper.report(), *map);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Builds a sparse map from a recorded drive: metric, loop-closed, with the pose of every frame.");
  Arguments arguments;
  app.add_option("--bag", arguments.bag, "the drive")->required();
  app.add_option("--rig", arguments.rig, "rig.yaml with vehicle_from_camera")->required();
  app.add_option("--output", arguments.output, "map to write (*.vmap)")->required()->check(requireNotEmpty);
  app.add_option("--trajectory", arguments.trajectory, "TUM file to write: the pose of every frame");
  app.add_option("--options", arguments.options, "YAML with overrides of SparseMapperOptions");
  app.add_flag("--show-options", arguments.show_options, "print all options with their values");
  return runTool(&app, argc, argv, [&] {
    SparseMapperOptions options;
    if (!arguments.options.empty()) {
      readFieldsFromFile(arguments.options, &options);
    }
    if (arguments.show_options) {
      std::cout << writeFields(options) << "\n";
    }
    buildMap(arguments, options);
  });
}
