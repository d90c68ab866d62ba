#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "tool_arguments.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/dense_maps/range_map_file.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_evaluation/range_evaluator.h"
#include "vcharge_evaluation/range_gaps.h"
#include "vcharge_evaluation/range_truth.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using namespace vcharge;

/// A drive begins at standstill: gaps count from where a camera's own motion can give ranges.
constexpr double kFirstBaselineM = 1.0;

/// Judges every range map whose image is in the bag.
class Judge : public DriveConsumer {
 public:
  Judge(const CameraRig& rig, std::string range_folder, std::string truth_folder, const Trajectory& truth,
        const RangeEvaluationOptions& options)
      : rig_(rig),
        range_folder_(std::move(range_folder)),
        truth_folder_(std::move(truth_folder)),
        total_(options) {
    for (const auto& entry : truth) {
      truth_[entry.stamp] = entry.world_from_vehicle;
      const Eigen::Vector3d moved_m =
          entry.world_from_vehicle.translation() - truth.front().world_from_vehicle.translation();
      if (moved_m.norm() < kFirstBaselineM) {
        moved_since_ = entry.stamp;
      }
    }
    for (size_t i = 0; i < rig.cameras.size(); ++i) {
      cameras_.emplace_back(options);
      if (std::filesystem::is_directory(std::filesystem::path(range_folder_) / rig.cameras[i].name)) {
        const auto stamps = listRangeMaps(range_folder_, rig.cameras[i].name);
        cameras_.back().stamps.insert(stamps.begin(), stamps.end());
      }
    }
  }

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    PerCamera& camera = cameras_[camera_index];
    const RigCamera& rig_camera = rig_.cameras[camera_index];
    if (camera.stamps.count(stamp) == 0) {
      return;
    }
    const cv::Mat truth = readRangeTruth(truth_folder_, rig_camera.name, stamp);
    if (truth.empty()) {
      ++num_without_truth_;
      return;
    }
    checkImageSize(rig_camera, truth.size(), truth_folder_ + "/" + rig_camera.name);
    const RangeMap map = readRangeMap(range_folder_, rig_camera.name, stamp);
    if (!camera.working) {
      camera.working = rebuildWorkingCamera(map.camera, map.range_m.size(), rig_camera);
    }
    const cv::Mat working_image = camera.working->undistort(image.pixels);
    const cv::Mat working_truth = resampleRangeTruth(truth, *camera.working);
    const auto travel = travelDirection(rig_camera, stamp);
    for (RangeEvaluator* evaluator : {&camera.evaluator, &total_}) {
      evaluator->add(map, working_image, working_truth, camera.working->validMask(), travel);
    }
    if (stamp >= moved_since_) {
      camera.gaps.add(map.range_m, working_truth, camera.working->validMask());
    }
  }
  void addOdometry(const VehicleOdometry&) override {}

  const RangeEvaluator& total() const { return total_; }
  const RangeEvaluator& camera(size_t index) const { return cameras_[index].evaluator; }
  const RangeGaps& gaps(size_t index) const { return cameras_[index].gaps; }
  size_t numWithoutTruth() const { return num_without_truth_; }

 private:
  struct PerCamera {
    explicit PerCamera(const RangeEvaluationOptions& options) : evaluator(options) {}
    std::set<Timestamp> stamps;
    std::optional<WorkingCamera> working;
    RangeEvaluator evaluator;
    RangeGaps gaps;
  };

  /// Motion of the camera between the neighbouring true poses, in its own frame; absent below 1 cm.
  std::optional<Eigen::Vector3d> travelDirection(const RigCamera& camera, Timestamp stamp) const {
    const auto here = truth_.find(stamp);
    if (here == truth_.end()) {
      throw InputError(truth_folder_ + ": no true pose at " + toString(stamp));
    }
    const RigidTransform vehicle_from_camera = *camera.vehicle_from_camera;
    const auto next = std::next(here) == truth_.end() ? here : std::next(here);
    const auto previous = here == truth_.begin() ? here : std::prev(here);
    const Eigen::Vector3d motion_in_world = (next->second * vehicle_from_camera).translation() -
                                            (previous->second * vehicle_from_camera).translation();
    if (motion_in_world.norm() < 0.01) {
      return std::nullopt;
    }
    return (here->second * vehicle_from_camera).rotation().conjugate() * motion_in_world;
  }

  const CameraRig& rig_;
  std::string range_folder_;
  std::string truth_folder_;
  std::map<Timestamp, RigidTransform> truth_;
  Timestamp moved_since_;
  std::vector<PerCamera> cameras_;
  RangeEvaluator total_;
  size_t num_without_truth_ = 0;
};

nlohmann::json binsToJson(const std::vector<RangeBin>& bins) {
  nlohmann::json json = nlohmann::json::array();
  for (const RangeBin& bin : bins) {
    json.push_back({{"low", bin.low},
                    {"high", bin.high},
                    {"num_judged", bin.num_judged},
                    {"count", bin.count},
                    {"fraction_within_tolerance", bin.fraction_within_tolerance},
                    {"median_relative_error", bin.median_relative_error},
                    {"fraction_within_one_sigma", bin.fraction_within_one_sigma}});
  }
  return json;
}

nlohmann::json reportErrors(const std::string& label, const RangeErrors& errors) {
  std::printf("%s: %zu frames, %zu pixels judged, %.1f %% with a range\n", label.c_str(), errors.num_frames,
              errors.num_judged,
              100.0 * static_cast<double>(errors.num_known) /
                  static_cast<double>(std::max<size_t>(1, errors.num_judged)));
  nlohmann::json accuracies = nlohmann::json::array();
  for (const RangeAccuracy& accuracy : errors.accuracy) {
    std::printf("  %3.0f %% most confident: %5.1f %% right, median error %.2f %%\n", 100.0 * accuracy.density,
                100.0 * accuracy.fraction_within_tolerance, 100.0 * accuracy.median_relative_error);
    accuracies.push_back({{"density", accuracy.density},
                          {"fraction_within_tolerance", accuracy.fraction_within_tolerance},
                          {"median_relative_error", accuracy.median_relative_error},
                          {"fraction_known", accuracy.fraction_known}});
  }
  std::printf("  within one sigma: %.1f %% of the ranges, within two: %.1f %%\n",
              100.0 * errors.fraction_within_one_sigma, 100.0 * errors.fraction_within_two_sigma);
  return {{"label", label},
          {"num_frames", errors.num_frames},
          {"num_judged", errors.num_judged},
          {"num_known", errors.num_known},
          {"accuracy", accuracies},
          {"fraction_within_one_sigma", errors.fraction_within_one_sigma},
          {"fraction_within_two_sigma", errors.fraction_within_two_sigma},
          {"by_truth", binsToJson(errors.by_truth)},
          {"by_confidence", binsToJson(errors.by_confidence)},
          {"bounded_relative_error", errors.bounded_relative_error},
          {"calibration", calibrationToJson(errors.calibration)}};
}

nlohmann::json reportGaps(const RangeGapCounts& counts) {
  std::printf(
      "  nearer than %g m: %.1f %% known; %zu of %zu cells unknown for over %d range maps, at most %d\n",
      RangeGaps::kNearM, 100.0 * counts.fraction_known, counts.num_gap_cells, counts.num_cells,
      RangeGaps::kLongestGap, counts.longest_gap);
  return {{"fraction_known", counts.fraction_known},
          {"num_cells", counts.num_cells},
          {"num_gap_cells", counts.num_gap_cells},
          {"longest_gap", counts.longest_gap}};
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app("Errors of range maps against the truth of a simulated drive, at fixed density.");
  std::string range_folder, truth_folder, bag, rig_path;
  app.addOption("--range", &range_folder, "folder that compute_range_maps wrote").required();
  app.addOption("--truth", &truth_folder, "folder of the drive's truth (range/ and trajectory.tum)")
      .required();
  app.addOption("--bag", &bag, "the drive").required();
  app.addOption("--rig", &rig_path, "rig.yaml that the range maps were made with").required();
  const OptionsArgument<RangeEvaluationOptions> options(&app);
  const ReportArgument report(&app, "range_errors");
  describeJson(&app, R"(kind: "range"; tolerance: relative; sets: for all cameras and for each one {label,
num_frames, num_judged, num_known, fraction_within_one_sigma, fraction_within_two_sigma, accuracy [{density,
fraction_within_tolerance, median_relative_error, fraction_known}] of the most confident fraction, and by_truth
(m) and by_confidence [{low, high, num_judged, and of the known ranges count, fraction_within_tolerance,
median_relative_error, fraction_within_one_sigma}]; error distribution bounded_relative_error, in which unknown ranges
count as 0.5; calibration {expected_calibration_error, bins [{count, mean_confidence, fraction_right}]} of the
confidence, where ranges within 10 % are right; and for each camera near {fraction_known, num_cells, num_gap_cells,
longest_gap} over blocks of 8 x 8 pixels nearer than 4 m, where gap cells are unknown in more than 5 range maps on end,
counted once the vehicle has moved by 1 m.)");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (options.shown()) {
      return;
    }
    const RangeEvaluationOptions evaluation_options = options.read();
    const auto rig = std::make_shared<const CameraRig>(readCameraRig(rig_path));
    if (!rig->hasExtrinsics()) {
      throw InputError(rig_path + ": vehicle_from_camera: missing for at least one camera");
    }
    BagDriveSourceOptions source_options;
    source_options.cameras = listRangeMapCameras(range_folder);
    if (source_options.cameras.empty()) {
      throw InputError(range_folder + ": expected range maps in it");
    }
    const Trajectory truth = readTrajectory(truth_folder + "/trajectory.tum");
    Judge judge(*rig, range_folder, truth_folder + "/range", truth, evaluation_options);
    {
      ProgressBar progress("evaluating");
      BagDriveSource(bag, rig, source_options).run(&judge, [&](double fraction) {
        progress.update(fraction);
      });
    }
    const RangeErrors total = judge.total().errors();
    if (total.num_frames == 0) {
      throw InputError(truth_folder + "/range: no truth for any of the " +
                       std::to_string(judge.numWithoutTruth()) + " range maps");
    }
    nlohmann::json json = {{"kind", "range"}, {"tolerance", evaluation_options.tolerance}};
    json["sets"] = nlohmann::json::array();
    json["sets"].push_back(reportErrors("all cameras", total));
    for (const std::string& name : source_options.cameras) {
      const size_t camera = rig->cameraIndex(name);
      json["sets"].push_back(reportErrors(name, judge.camera(camera).errors()));
      json["sets"].back()["near"] = reportGaps(judge.gaps(camera).counts());
    }
    *found = json;
    report.write(*found);
  });
}
