#include <cstdio>
#include <map>
#include <memory>

#include <nlohmann/json.hpp>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/dense_maps/obstacle_map_file.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_evaluation/obstacle_map_errors.h"
#include "vcharge_evaluation/obstacle_scan_errors.h"
#include "vcharge_evaluation/range_truth.h"
#include "vcharge_evaluation/report.h"

namespace {

using namespace vcharge;

struct Options {
  int frame_step = 1;  ///< every how many maps one is judged
  int pixel_step = 2;  ///< of the true ranges
  ObstacleScanEvaluationOptions scan;
  ObstacleMapEvaluationOptions map;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("frame_step", frame_step);
    visit("pixel_step", pixel_step);
    visit("scan", scan);
    visit("map", map);
  }
  void validate() const {
    requireField(frame_step > 0, "frame_step", "must be positive", frame_step);
    requireField(pixel_step > 0, "pixel_step", "must be positive", pixel_step);
    validateInner("scan", scan);
    validateInner("map", map);
  }
};

/// A simulated drive's truth.
class Truth {
 public:
  Truth(const std::string& folder, CameraRig rig)
      : folder_(folder), rig_(std::move(rig)), movers_(readTruthMovers(folder + "/movers.yaml")) {
    for (const StampedTransform& entry : readTrajectory(folder + "/trajectory.tum")) {
      poses_[entry.stamp] = entry.world_from_vehicle;
    }
    for (const RigCamera& camera : rig_.cameras) {
      rays_.push_back(nullptr);
      if (!camera.vehicle_from_camera) {
        throw InputError(folder + "/rig.yaml: cameras." + camera.name + ": vehicle_from_camera is missing");
      }
    }
  }

  const RigidTransform* poseAt(Timestamp stamp) const {
    const auto found = poses_.find(stamp);
    return found == poses_.end() ? nullptr : &found->second;
  }
  std::vector<RigidTransform> path() const {
    std::vector<RigidTransform> path;
    for (const auto& entry : poses_) {
      path.push_back(entry.second);
    }
    return path;
  }
  /// Of the camera at that index; empty without a true range image.
  std::vector<SeenPoint> pointsOf(size_t index, Timestamp stamp, int step) {
    const RigCamera& camera = rig_.cameras[index];
    const cv::Mat range_m = readRangeTruth(folder_ + "/range", camera.name, stamp);
    if (range_m.empty()) {
      return {};
    }
    checkImageSize(camera, range_m.size(), folder_ + "/range/" + camera.name);
    if (!rays_[index]) {
      rays_[index] = std::make_unique<RayTable>(camera.model, camera.image_size_px, camera.field_of_view_rad,
                                                camera.mask);
    }
    const RigidTransform& vehicle_from_camera = *camera.vehicle_from_camera;
    return makeSeenPoints(range_m, *rays_[index], poses_.at(stamp) * vehicle_from_camera,
                          travelAt(stamp, vehicle_from_camera), step);
  }
  std::vector<TruthObstacle> moversBetween(Timestamp from, Timestamp to) const {
    std::vector<TruthObstacle> all;
    for (auto entry = movers_.lower_bound(from); entry != movers_.end() && entry->first <= to; ++entry) {
      all.insert(all.end(), entry->second.begin(), entry->second.end());
    }
    return all;
  }
  const CameraRig& rig() const { return rig_; }

 private:
  /// Motion of a camera around a stamp; zero where it stands.
  Eigen::Vector2d travelAt(Timestamp stamp, const RigidTransform& vehicle_from_camera) const {
    const auto here = poses_.find(stamp);
    const auto next = std::next(here) == poses_.end() ? here : std::next(here);
    const auto previous = here == poses_.begin() ? here : std::prev(here);
    const Eigen::Vector2d motion = ((next->second * vehicle_from_camera).translation() -
                                    (previous->second * vehicle_from_camera).translation())
                                       .head<2>();
    return motion.norm() < 0.01 ? Eigen::Vector2d(0.0, 0.0) : Eigen::Vector2d(motion.normalized());
  }

  const std::string folder_;
  const CameraRig rig_;
  std::map<Timestamp, RigidTransform> poses_;
  std::map<Timestamp, std::vector<TruthObstacle>> movers_;
  std::vector<std::unique_ptr<RayTable>> rays_;
};

nlohmann::json raysToJson(const char* what, const RayErrors& errors) {
  const auto judged = static_cast<double>(std::max<uint64_t>(1, errors.num_judged));
  std::printf(
      "  %-12s %6llu rays, missed %.1f %%, nearer %.1f %%; error mean %.1f cm (signed %+.1f), 95 %% %.1f cm; "
      "own ray mean %.1f cm, 95 %% %.1f cm; within 1, 2 sigma %.0f, %.0f %%\n",
      what, static_cast<unsigned long long>(errors.num_judged), 100.0 * errors.num_missed / judged,
      100.0 * errors.num_nearer / judged, 100.0 * errors.error_m.mean, 100.0 * errors.mean_signed_m,
      100.0 * errors.error_m.percentile_95, 100.0 * errors.error_own_ray_m.mean,
      100.0 * errors.error_own_ray_m.percentile_95, 100.0 * errors.share_within_one_sigma,
      100.0 * errors.share_within_two_sigma);
  return {{"rays", errors.num_judged},
          {"missed", errors.num_missed},
          {"nearer", errors.num_nearer},
          {"error_m", errors.error_m},
          {"error_own_ray_m", errors.error_own_ray_m},
          {"mean_signed_m", errors.mean_signed_m},
          {"share_within_one_sigma", errors.share_within_one_sigma},
          {"share_within_two_sigma", errors.share_within_two_sigma}};
}

nlohmann::json scanToJson(const std::string& name, const ObstacleScanEvaluator& evaluator) {
  std::printf("%s scan:\n", name.c_str());
  return {{"name", name},
          {"aside", raysToJson("aside", evaluator.aside())},
          {"ahead", raysToJson("ahead", evaluator.ahead())},
          {"ahead_within_2_m", raysToJson("ahead < 2 m", evaluator.aheadNear())}};
}

/// Missed obstacles by distance from the driven ground and by height.
void printObstacles(const ObstacleMapErrors& errors) {
  constexpr double kDistances_m[] = {0.0, 1.0, 2.0, 4.0};
  constexpr double kHeights_m[] = {0.3, 0.6, 1.2, 100.0};
  std::printf("obstacles missed / judged, by distance (rows) and height:\n%18s", "");
  for (int column = 0; column < 3; ++column) {
    std::printf("  %.1f-%.1f m", kHeights_m[column], kHeights_m[column + 1]);
  }
  std::printf("\n");
  for (int row = 0; row < 3; ++row) {
    std::printf("  %.0f to %.0f m        ", kDistances_m[row], kDistances_m[row + 1]);
    for (int column = 0; column < 3; ++column) {
      int judged = 0;
      int missed = 0;
      for (const ObstacleOutcome& outcome : errors.obstacles) {
        const bool here = outcome.distance_m >= kDistances_m[row] && outcome.height_m >= kHeights_m[column] &&
                          (outcome.distance_m < kDistances_m[row + 1] || row == 2) &&
                          outcome.height_m < kHeights_m[column + 1];
        judged += here ? 1 : 0;
        missed += here && !outcome.reported ? 1 : 0;
      }
      std::printf("  %4d / %-4d", missed, judged);
    }
    std::printf("\n");
  }
  for (const ObstacleOutcome& outcome : errors.obstacles) {
    if (!outcome.reported || outcome.frames_reported < outcome.frames) {
      std::printf(
          "  %s at (%.1f, %.1f), %.2f m high, %.2f m wide, %.1f m away: %s, then reported in %llu of %llu "
          "maps\n",
          outcome.kind.c_str(), outcome.middle_m.x(), outcome.middle_m.y(), outcome.height_m, outcome.width_m,
          outcome.distance_m, outcome.reported ? "reported" : "MISSED",
          static_cast<unsigned long long>(outcome.frames_reported),
          static_cast<unsigned long long>(outcome.frames));
    }
  }
}

/// By how near the vehicle's middle came: what is only seen from afar has few pixels on its face.
void printKerbs(const ObstacleMapErrors& errors) {
  std::printf("kerbs: %llu of %llu places reported, height error mean %.1f cm, 95 %% %.1f cm\n",
              static_cast<unsigned long long>(errors.num_kerb_reported),
              static_cast<unsigned long long>(errors.num_kerb_points),
              100.0 * errors.kerb_height_error_m.mean, 100.0 * errors.kerb_height_error_m.percentile_95);
  const double bands_m[] = {0.0, 2.5, 3.5, 100.0};
  for (int band = 0; band < 3; ++band) {
    int places = 0;
    int reported = 0;
    int ever = 0;
    for (const KerbOutcome& kerb : errors.kerbs) {
      const bool here = kerb.nearest_m >= bands_m[band] && kerb.nearest_m < bands_m[band + 1];
      places += here ? 1 : 0;
      reported += here && kerb.reported ? 1 : 0;
      ever += here && kerb.ever_reported ? 1 : 0;
    }
    std::printf("  nearest at %.1f to %.1f m: %d of %d, at any time %d\n", bands_m[band], bands_m[band + 1],
                reported, places, ever);
  }
}

nlohmann::json mapToJson(const ObstacleMapErrors& errors) {
  printObstacles(errors);
  nlohmann::json obstacles = nlohmann::json::array();
  for (const ObstacleOutcome& outcome : errors.obstacles) {
    obstacles.push_back({{"kind", outcome.kind},
                         {"height_m", outcome.height_m},
                         {"width_m", outcome.width_m},
                         {"distance_m", outcome.distance_m},
                         {"reported", outcome.reported},
                         {"maps", outcome.frames},
                         {"maps_reported", outcome.frames_reported}});
  }
  std::printf(
      "false: %llu cells over %.1f m, %.2f per 10 m; left occupied behind the vehicle: %llu, %.2f per 10 m; "
      "%.2f in a map; %llu more where no camera saw the ground\n",
      static_cast<unsigned long long>(errors.num_false_cells), errors.driven_m, errors.false_cells_per_10_m,
      static_cast<unsigned long long>(errors.num_false_left),
      10.0 * static_cast<double>(errors.num_false_left) / std::max(0.1, errors.driven_m),
      errors.false_cells_per_map, static_cast<unsigned long long>(errors.num_false_hidden));
  std::printf("inside true obstacles: %llu of %llu observed cells were ever free\n",
              static_cast<unsigned long long>(errors.num_free_inside),
              static_cast<unsigned long long>(errors.num_observed_inside));
  printKerbs(errors);
  std::printf("moving things: reported in %llu of %llu maps; %llu of %llu cells under them free\n",
              static_cast<unsigned long long>(errors.num_mover_reported),
              static_cast<unsigned long long>(errors.num_mover_frames),
              static_cast<unsigned long long>(errors.num_mover_free),
              static_cast<unsigned long long>(errors.num_mover_cells));
  nlohmann::json kerbs = nlohmann::json::array();
  for (const KerbOutcome& kerb : errors.kerbs) {
    kerbs.push_back({{"place_m", {kerb.place_m.x(), kerb.place_m.y()}},
                     {"nearest_m", kerb.nearest_m},
                     {"reported", kerb.reported},
                     {"ever_reported", kerb.ever_reported}});
  }
  nlohmann::json false_cells = nlohmann::json::array();
  for (const FalseCell& cell : errors.false_cells) {
    false_cells.push_back({{"x_m", cell.world_m.x()},
                           {"y_m", cell.world_m.y()},
                           {"first_seen_ns", cell.first_seen.nanoseconds()},
                           {"maps", cell.frames},
                           {"left", cell.is_left},
                           {"on_open_ground", cell.is_on_open}});
  }
  return {{"maps", errors.num_frames},
          {"driven_m", errors.driven_m},
          {"obstacles", obstacles},
          {"false_cells", errors.num_false_cells},
          {"false_cells_per_10_m", errors.false_cells_per_10_m},
          {"false_left", errors.num_false_left},
          {"false_cells_per_map", errors.false_cells_per_map},
          {"false_cells_hidden", errors.num_false_hidden},
          {"false_cell_list", false_cells},
          {"observed_inside", errors.num_observed_inside},
          {"free_inside", errors.num_free_inside},
          {"kerb_places", errors.num_kerb_points},
          {"kerb_reported", errors.num_kerb_reported},
          {"kerb_height_error_m", errors.kerb_height_error_m},
          {"kerbs", kerbs},
          {"mover_maps", errors.num_mover_frames},
          {"mover_reported", errors.num_mover_reported},
          {"mover_cells", errors.num_mover_cells},
          {"mover_free", errors.num_mover_free}};
}

struct Arguments {
  std::string obstacles, truth, options, report;
};

nlohmann::json evaluate(const Arguments& arguments, const Options& options) {
  Truth truth(arguments.truth, readCameraRig(arguments.truth + "/rig.yaml"));
  ObstacleMapEvaluator map_evaluator(readTruthObstacles(arguments.truth + "/obstacles.yaml"),
                                     readTruthHeights(arguments.truth + "/height_map.yaml"), truth.path(),
                                     options.map);
  std::map<std::string, ObstacleScanEvaluator> scan_evaluators;
  const std::vector<Timestamp> stamps = listObstacles(arguments.obstacles);
  uint64_t judged = 0;
  ProgressBar progress("evaluating");
  for (size_t i = 0; i < stamps.size(); i += static_cast<size_t>(options.frame_step)) {
    progress.update(static_cast<double>(i) / static_cast<double>(stamps.size()));
    const RigidTransform* pose = truth.poseAt(stamps[i]);
    if (pose == nullptr) {
      continue;  // a map from between two images
    }
    const std::vector<ObstacleScan> scans = readObstacleScans(arguments.obstacles, stamps[i]);
    std::vector<SeenPoint> all;
    for (const ObstacleScan& scan : scans) {
      const int camera = truth.rig().findCamera(scan.name);
      if (camera < 0) {
        continue;
      }
      const auto points = truth.pointsOf(static_cast<size_t>(camera), stamps[i], options.pixel_step);
      scan_evaluators.try_emplace(scan.name, options.scan).first->second.add(scan, points, *pose);
      all.insert(all.end(), points.begin(), points.end());
    }
    judged += all.empty() ? 0 : 1;
    for (const ObstacleScan& scan : scans) {
      if (scan.name == "fused") {
        scan_evaluators.try_emplace(scan.name, options.scan).first->second.add(scan, all, *pose);
      }
    }
    map_evaluator.add(readObstacleMap(arguments.obstacles, stamps[i]), all, *pose,
                      truth.moversBetween(stamps[i], stamps[i]),
                      truth.moversBetween(stamps[i] - durationFromSeconds(1.0), stamps[i]));
  }
  if (judged == 0) {
    throw InputError(arguments.truth + "/range: no true ranges for any of the obstacle maps (" +
                     std::to_string(stamps.size()) + " there; simulate the drive with --truth-range)");
  }
  nlohmann::json json = {{"kind", "obstacles"}, {"scans", nlohmann::json::array()}};
  for (const auto& [name, evaluator] : scan_evaluators) {
    json["scans"].push_back(scanToJson(name, evaluator));
  }
  json["map"] = mapToJson(map_evaluator.errors());
  return json;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Errors of obstacle maps against the truth of a simulated drive on level ground.");
  Arguments arguments;
  app.add_option("--obstacles", arguments.obstacles, "folder that detect_obstacles wrote")->required();
  app.add_option("--truth", arguments.truth,
                 "folder of the drive's truth (range/, rig.yaml, trajectory.tum, obstacles.yaml, ...)")
      ->required();
  app.add_option("--options", arguments.options, "YAML with overrides of the evaluation's options");
  app.add_option("--report", arguments.report, "folder for obstacle_errors.json")->check(requireNotEmpty);
  return runTool(&app, argc, argv, [&] {
    Options options;
    if (!arguments.options.empty()) {
      readFieldsFromFile(arguments.options, &options);
    }
    const nlohmann::json json = evaluate(arguments, options);
    if (!arguments.report.empty()) {
      writeReport(json, arguments.report, "obstacle_errors");
    }
  });
}
