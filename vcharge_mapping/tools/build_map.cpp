#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "stage_bars.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/frames/frame_counters_text.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/map_report.h"
#include "vcharge_mapping/sparse_mapper.h"
#include "vcharge_reconstruction/tiled_map.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using namespace vcharge;

struct Arguments {
  std::string bag, rig, options, output, trajectory, report;
  bool show_options = false;
};

/// Numbers of accepted loop edges, and of rejected ones by reason.
struct LoopCounts {
  int num_accepted = 0;
  std::map<std::string, int> num_rejected;
};

LoopCounts countLoops(const std::vector<LoopEdge>& edges) {
  LoopCounts counts;
  for (const LoopEdge& edge : edges) {
    ++(edge.accepted ? counts.num_accepted : counts.num_rejected[edge.reason]);
  }
  return counts;
}

void printReport(const ReconstructionReport& report, const SparseMap& map) {
  std::cout << describe(report.counters, map.rig())
            << "standing frames, not used: " << report.num_standing_frames << "\n";
  const std::vector<std::string> hypotheses = enumNames<MotionHypothesis>();
  std::cout << "motions:";
  for (size_t i = 0; i < hypotheses.size(); ++i) {
    std::cout << " " << hypotheses[i] << " " << report.num_motions[i];
  }
  const LoopCounts loops = countLoops(report.loop_edges);
  std::cout << "\nkeyframes: " << map.keyframes().size() << ", landmarks: " << map.landmarks().size()
            << ", observations: " << map.observations().size() << ", error: " << report.rms_px << " px RMS\n"
            << "loop edges: " << loops.num_accepted << " accepted";
  for (const auto& [reason, count] : loops.num_rejected) {
    std::cout << ", " << count << " rejected (" << reason << ")";
  }
  std::cout << "\nodometer: distance x " << map.contents().odometry_distance_scale << ", turn x "
            << map.contents().odometry_turn_scale << "\ntime:";
  for (const std::string& stage : report.stages) {
    const auto found = report.stage_s.find(stage);
    if (found != report.stage_s.end()) {
      std::cout << " " << stage << " " << found->second << " s;";
    }
  }
  std::cout << "\n";
}

nlohmann::json toJson(const ReconstructionReport& report, const SparseMap& map) {
  nlohmann::json motions = nlohmann::json::object();
  const std::vector<std::string> hypotheses = enumNames<MotionHypothesis>();
  for (size_t i = 0; i < hypotheses.size(); ++i) {
    motions[hypotheses[i]] = report.num_motions[i];
  }
  const LoopCounts loops = countLoops(report.loop_edges);
  nlohmann::json found = countersToJson(report.counters, map.rig());
  found.update({{"num_standing_frames", report.num_standing_frames},
                {"num_motions", motions},
                {"num_keyframes", map.keyframes().size()},
                {"num_landmarks", map.landmarks().size()},
                {"num_observations", map.observations().size()},
                {"rms_px", report.rms_px},
                {"num_loop_edges", loops.num_accepted},
                {"num_rejected_loop_edges", loops.num_rejected},
                {"odometry_distance_scale", map.contents().odometry_distance_scale},
                {"odometry_turn_scale", map.contents().odometry_turn_scale},
                {"stage_s", report.stage_s},
                {"content_hash", map.contentHash()}});
  return found;
}

/// Lists the frames as CSV.
std::string listFrames(const ReconstructionState& state) {
  const std::vector<std::string> motions = enumNames<MotionHypothesis>();
  std::string text = "time_s,motion,keyframe\n";
  for (const FramePose& frame : state.frames) {
    text += toString(frame.stamp) + "," + motions[static_cast<size_t>(frame.motion)] + "," +
            std::to_string(frame.keyframe) + "\n";
  }
  return text;
}

void buildMap(const Arguments& arguments, const SparseMapperOptions& options, nlohmann::json* found) {
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  SparseMapper mapper(rig, options);
  StageBars bars;
  BagDriveSourceOptions source_options;
  source_options.max_image_gap_s = INFINITY;  // frames that lack a camera are used, and counted
  BagDriveSource source(arguments.bag, rig, source_options);
  source.run(&mapper, [&](double fraction) {
    bars.show("following the drive", 1, SparseMapper::kNumStages + 1, fraction);
  });
  const std::shared_ptr<const SparseMap> map = mapper.finish([&](const StageProgress& progress) {
    bars.show(progress.stage, progress.number + 1, progress.num_stages + 1, progress.fraction);
  });
  bars.end();
  std::ostringstream option_text;
  option_text << writeFields(options);
  writeSparseMap(*map,
                 {{"bag", arguments.bag},
                  {"bag_hash", fileHash(arguments.bag)},
                  {"rig", arguments.rig},
                  {"mapper_options", option_text.str()},
                  {"program", "build_map 0.1.0"},
                  {"change", "built"}},
                 arguments.output, indexForTiles(*map));
  if (!arguments.trajectory.empty()) {
    writeTrajectory(mapper.trajectory(), arguments.trajectory);
  }
  if (!arguments.report.empty()) {
    createFolder(arguments.report);
    const std::filesystem::path folder(arguments.report);
    const std::string title = "Map " + std::filesystem::path(arguments.output).filename().string();
    writeTextFileAtomically((folder / "map_report.html").string(),
                            makeMapReport(title, *map, mapper.state()));
    writeTextFileAtomically((folder / "frames.csv").string(), listFrames(mapper.state()));
  }
  printReport(mapper.report(), *map);
  const MapVerdict verdict = judgeMap(*map, mapper.state());
  *found = toJson(mapper.report(), *map);
  (*found)["verdict"] = toString(verdict.grade);
  (*found)["remarks"] = verdict.remarks;
  std::cout << "verdict: " << toString(verdict.grade);
  for (const std::string& remark : verdict.remarks) {
    std::cout << "\n  " << remark;
  }
  std::cout << "\ncontent hash: " << map->contentHash() << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Builds a sparse map from a recorded drive: metric, loop-closed, with the pose of every frame.");
  Arguments arguments;
  app.addOption("--bag", &arguments.bag, "the drive").required();
  app.addOption("--rig", &arguments.rig, "rig.yaml with vehicle_from_camera").required();
  app.addOption("--output", &arguments.output, "map to write (*.vmap)").required().check(requireOutput);
  app.addOption("--trajectory", &arguments.trajectory, "TUM file to write: the pose of every frame")
      .check(requireOutput);
  app.addOption("--report", &arguments.report, "folder for map_report.html: pictures, numbers and a verdict")
      .check(requireOutputFolder);
  app.addOption("--options", &arguments.options, "YAML with overrides of SparseMapperOptions");
  addShowOptions(&app, &arguments.show_options);
  app.setFooter(std::string("Keys of --json: verdict (GOOD, CHECK, BAD), remarks, ") + kFrameCounterKeys +
                ", num_standing_frames, num_motions (by hypothesis), num_keyframes, num_landmarks, "
                "num_observations, rms_px, num_loop_edges, num_rejected_loop_edges (by reason), "
                "odometry_distance_scale, odometry_turn_scale, stage_s (wall time), content_hash.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    SparseMapperOptions options;
    if (!arguments.options.empty()) {
      readFieldsFromFile(arguments.options, &options);
    }
    if (arguments.show_options) {
      std::cout << showOptions(options);
      return;
    }
    buildMap(arguments, options, found);
  });
}
