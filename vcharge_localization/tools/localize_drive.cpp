#include <chrono>
#include <cmath>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/frames/frame_counters_text.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_localization/drive_experiment.h"
#include "vcharge_localization/drive_localizer.h"
#include "vcharge_localization/localization_log.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using namespace vcharge;

struct Arguments {
  std::string bag, rig, map, options, output;
  std::vector<std::string> cameras;
  std::vector<double> cover_s, carry_s;
  int forget_every = 0;
  bool show_options = false;
};

DriveExperiment makeExperiment(const Arguments& arguments, const CameraRig& rig) {
  DriveExperimentOptions options;
  for (const std::string& name : arguments.cameras) {
    options.cameras.push_back(rig.cameraIndex(name));
  }
  if (!arguments.cover_s.empty()) {
    options.cover_s = {arguments.cover_s[0], arguments.cover_s[1]};
  }
  if (!arguments.carry_s.empty()) {
    options.carry_s = {arguments.carry_s[0], arguments.carry_s[1]};
  }
  return DriveExperiment(options);
}

void localizeDrive(const Arguments& arguments, const DriveLocalizerOptions& options, nlohmann::json* found) {
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  if (!rig->hasExtrinsics()) {
    throw InputError(arguments.rig + ": expected vehicle_from_camera of every camera");
  }
  const auto start = std::chrono::steady_clock::now();
  DriveLocalizer localizer(std::make_shared<const TiledMap>(arguments.map), rig, options);
  const double map_ready_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::cout << "map ready after " << map_ready_s << " s\n";
  DriveExperiment experiment = makeExperiment(arguments, *rig);
  Trajectory trajectory;
  std::ostringstream log;
  log << localizationHeader(*rig) << "\n";
  LocalizationSummary summary;
  ContentHasher hasher;
  ImageFrameAssembler assembler(rig->cameras.size(), options.frames, [&](ImageFrame frame) {
    if (!experiment.apply(&frame)) {
      return;
    }
    if (arguments.forget_every > 0 && summary.numFrames() % arguments.forget_every == 0) {
      localizer.forget();
    }
    const LocalizationResult result = localizer.process(frame);
    summary.add(result);
    log << localizationRow(result, *rig) << "\n";
    hasher.add(result.stamp.nanoseconds());
    hasher.add(static_cast<int64_t>(result.status));
    if (result.pose) {
      trajectory.push_back({result.stamp, result.pose->map_from_vehicle});
      const Eigen::Matrix<double, 3, 4> matrix = result.pose->map_from_vehicle.matrix();
      hasher.addBytes(matrix.data(), sizeof(double) * 12);
    }
  });
  assembler.joinStamps(rig->stamp_tolerance_s);
  BagDriveSourceOptions source_options;
  source_options.max_image_gap_s = INFINITY;  // a camera that stops is reported, but is no error
  BagDriveSource source(arguments.bag, rig, source_options);
  {
    ProgressBar progress("localizing");
    source.run(&assembler, [&](double fraction) { progress.update(fraction); });
    assembler.finish();
  }
  if (summary.numFrames() == 0) {
    throw InputError(arguments.bag + ": no images");
  }
  writeTrajectory(trajectory, arguments.output);
  writeTextFileAtomically(arguments.output + ".csv", log.str());
  nlohmann::json statuses = nlohmann::json::object();
  for (const auto& [status, count] : summary.numFramesByStatus()) {
    statuses[enumNames<LocalizationStatus>()[static_cast<size_t>(status)]] = count;
  }
  nlohmann::json warnings = nlohmann::json::array();
  for (const auto& [count, text] : summary.warnings()) {
    warnings.push_back({{"num_frames", count}, {"text", text}});
  }
  *found = countersToJson(assembler.counters(), *rig);
  found->update({{"num_frames", summary.numFrames()},  // without those that an experiment left out
                 {"num_frames_by_status", statuses},
                 {"map_ready_s", map_ready_s},
                 {"warnings", warnings},
                 {"content_hash", hasher.hex()}});
  std::cout << describe(assembler.counters(), *rig) << summary.text() << "content hash: " << hasher.hex()
            << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Localizes a recorded drive in a sparse map, frame by frame and causally. Writes the poses as TUM "
      "text, "
      "and status, covariance and matches of every frame beside it (.csv).");
  Arguments arguments;
  app.addOption("--bag", &arguments.bag, "the drive").required();
  app.addOption("--rig", &arguments.rig, "rig.yaml with vehicle_from_camera").required();
  app.addOption("--map", &arguments.map, "map of build_map (*.vmap)").required();
  app.addOption("--output", &arguments.output, "TUM file to write").required().check(requireOutput);
  app.addOption("--cameras", &arguments.cameras, "cameras of the rig by name (default: all)");
  app.addOption("--options", &arguments.options, "YAML with overrides of DriveLocalizerOptions");
  app.addOption("--cover-s", &arguments.cover_s,
                "cover all cameras, from and to, in seconds since the first frame")
      .expected(2);
  app.addOption("--carry-away-s", &arguments.carry_s,
                "leave a part of the drive out, unseen by the odometer too, from and to")
      .expected(2);
  app.addOption("--forget-every", &arguments.forget_every,
                "start from nothing again after so many frames, to see how soon a place is found; 0: never")
      .notNegative();
  addShowOptions(&app, &arguments.show_options);
  app.setFooter(std::string("Keys of --json: ") + kFrameCounterKeys +
                ", num_frames_by_status, map_ready_s (time to read and prepare the map), "
                "warnings (text, num_frames), content_hash.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    DriveLocalizerOptions options;
    options.frames.waitForEverything();
    if (!arguments.options.empty()) {
      readFieldsFromFile(arguments.options, &options);
    }
    if (arguments.show_options) {
      std::cout << showOptions(options);
      return;
    }
    localizeDrive(arguments, options, found);
  });
}
