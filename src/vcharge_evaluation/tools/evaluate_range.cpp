#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include <nlohmann/json.hpp>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/dense_maps/range_map_file.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_evaluation/range_evaluator.h"
#include "vcharge_evaluation/range_truth.h"
#include "vcharge_evaluation/report.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using vcharge::RigidTransform;
using vcharge::Timestamp;

/// Judges every range map whose image passes by in the bag.
class Judge : public vcharge::DriveConsumer {
 public:
  Judge(const vcharge::CameraRig& rig, std::string range_folder, std::string truth_folder,
        const vcharge::Trajectory& truth, const vcharge::RangeEvaluationOptions& options)
      : rig_(rig),
        range_folder_(std::move(range_folder)),
        truth_folder_(std::move(truth_folder)),
        total_(options) {
    for (const auto& entry : truth) {
      truth_[entry.stamp] = entry.world_from_vehicle;
    }
    for (size_t i = 0; i < rig.cameras.size(); ++i) {
      cameras_.emplace_back(options);
      if (std::filesystem::is_directory(std::filesystem::path(range_folder_) / rig.cameras[i].name)) {
        const auto stamps = vcharge::listRangeMaps(range_folder_, rig.cameras[i].name);
        cameras_.back().stamps.insert(stamps.begin(), stamps.end());
      }
    }
  }

  void addImage(size_t camera_index, Timestamp stamp, const vcharge::Image& image) override {
    PerCamera& camera = cameras_[camera_index];
    const vcharge::RigCamera& rig_camera = rig_.cameras[camera_index];
    if (camera.stamps.count(stamp) == 0) {
      return;
    }
    const cv::Mat truth = vcharge::readRangeTruth(truth_folder_, rig_camera.name, stamp);
    if (truth.empty()) {
      ++num_without_truth_;
      return;
    }
    vcharge::checkImageSize(rig_camera, truth.size(), truth_folder_ + "/" + rig_camera.name);
    const vcharge::RangeMap map = vcharge::readRangeMap(range_folder_, rig_camera.name, stamp);
    if (!camera.working) {
      camera.working = vcharge::rebuildWorkingCamera(map.camera, map.range_m.size(), rig_camera);
    }
    const cv::Mat working_image = camera.working->undistort(image.pixels);
    const cv::Mat working_truth = vcharge::resampleRangeTruth(truth, *camera.working);
    const auto travel = travelDirection(rig_camera, stamp);
    for (vcharge::RangeEvaluator* evaluator : {&camera.evaluator, &total_}) {
      evaluator->add(map, working_image, working_truth, camera.working->validMask(), travel);
    }
  }
  void addOdometry(const vcharge::VehicleOdometry&) override {}

  const vcharge::RangeEvaluator& total() const { return total_; }
  const vcharge::RangeEvaluator& camera(size_t index) const { return cameras_[index].evaluator; }
  size_t numWithoutTruth() const { return num_without_truth_; }

 private:
  struct PerCamera {
    explicit PerCamera(const vcharge::RangeEvaluationOptions& options) : evaluator(options) {}
    std::set<Timestamp> stamps;
    std::optional<vcharge::WorkingCamera> working;
    vcharge::RangeEvaluator evaluator;
  };

  /// Motion of the camera between the neighbouring true poses, in its own frame; none below 1 cm.
  std::optional<Eigen::Vector3d> travelDirection(const vcharge::RigCamera& camera, Timestamp stamp) const {
    const auto here = truth_.find(stamp);
    if (here == truth_.end()) {
      throw vcharge::InputError(truth_folder_ + ": no true pose at " + vcharge::toString(stamp));
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

  const vcharge::CameraRig& rig_;
  std::string range_folder_;
  std::string truth_folder_;
  std::map<Timestamp, RigidTransform> truth_;
  std::vector<PerCamera> cameras_;
  vcharge::RangeEvaluator total_;
  size_t num_without_truth_ = 0;
};

nlohmann::json binsToJson(const std::vector<vcharge::RangeBin>& bins) {
  nlohmann::json json = nlohmann::json::array();
  for (const vcharge::RangeBin& bin : bins) {
    json.push_back({{"low", bin.low},
                    {"high", bin.high},
                    {"count", bin.count},
                    {"share_within_tolerance", bin.share_within_tolerance},
                    {"median_relative_error", bin.median_relative_error},
                    {"share_within_one_sigma", bin.share_within_one_sigma}});
  }
  return json;
}

nlohmann::json reportErrors(const std::string& label, const vcharge::RangeErrors& errors) {
  std::printf("%s: %llu frames, %llu pixels judged, %.1f %% with a range\n", label.c_str(),
              static_cast<unsigned long long>(errors.num_frames),
              static_cast<unsigned long long>(errors.num_judged),
              100.0 * static_cast<double>(errors.num_known) /
                  static_cast<double>(std::max<uint64_t>(1, errors.num_judged)));
  nlohmann::json accuracies = nlohmann::json::array();
  for (const vcharge::RangeAccuracy& accuracy : errors.accuracy) {
    std::printf("  %3.0f %% most confident: %5.1f %% right, median error %.2f %%\n", 100.0 * accuracy.density,
                100.0 * accuracy.share_within_tolerance, 100.0 * accuracy.median_relative_error);
    accuracies.push_back({{"density", accuracy.density},
                          {"share_within_tolerance", accuracy.share_within_tolerance},
                          {"median_relative_error", accuracy.median_relative_error},
                          {"share_known", accuracy.share_known}});
  }
  std::printf("  within one sigma: %.1f %% of the ranges, within two: %.1f %%\n",
              100.0 * errors.share_within_one_sigma, 100.0 * errors.share_within_two_sigma);
  return {{"label", label},
          {"num_frames", errors.num_frames},
          {"num_judged", errors.num_judged},
          {"num_known", errors.num_known},
          {"accuracy", accuracies},
          {"share_within_one_sigma", errors.share_within_one_sigma},
          {"share_within_two_sigma", errors.share_within_two_sigma},
          {"by_truth", binsToJson(errors.by_truth)},
          {"by_confidence", binsToJson(errors.by_confidence)}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Errors of range maps against the truth of a simulated drive, at fixed density.");
  std::string range_folder, truth_folder, bag, rig_path, options_path, report;
  app.add_option("--range", range_folder, "folder that compute_range_maps wrote")->required();
  app.add_option("--truth", truth_folder, "folder of the drive's truth (range/ and trajectory.tum)")
      ->required();
  app.add_option("--bag", bag, "the drive")->required();
  app.add_option("--rig", rig_path, "rig.yaml that the range maps were made with")->required();
  app.add_option("--options", options_path, "YAML with overrides of RangeEvaluationOptions");
  app.add_option("--report", report, "folder for range_errors.json and its plots")
      ->check(vcharge::requireNotEmpty);
  return vcharge::runTool(&app, argc, argv, [&] {
    vcharge::RangeEvaluationOptions options;
    if (!options_path.empty()) {
      vcharge::readFieldsFromFile(options_path, &options);
    }
    const auto rig = std::make_shared<const vcharge::CameraRig>(vcharge::readCameraRig(rig_path));
    if (!rig->hasExtrinsics()) {
      throw vcharge::InputError(rig_path + ": vehicle_from_camera: missing for at least one camera");
    }
    vcharge::BagDriveSourceOptions source_options;
    source_options.cameras = vcharge::listRangeMapCameras(range_folder);
    if (source_options.cameras.empty()) {
      throw vcharge::InputError(range_folder + ": no range maps in it");
    }
    const vcharge::Trajectory truth = vcharge::readTrajectory(truth_folder + "/trajectory.tum");
    Judge judge(*rig, range_folder, truth_folder + "/range", truth, options);
    {
      vcharge::ProgressBar progress("evaluating");
      vcharge::BagDriveSource(bag, rig, source_options).run(&judge, [&](double share) {
        progress.update(share);
      });
    }
    const vcharge::RangeErrors total = judge.total().errors();
    if (total.num_frames == 0) {
      throw vcharge::InputError(truth_folder + "/range: no truth for any of the range maps (" +
                                std::to_string(judge.numWithoutTruth()) + " looked for)");
    }
    nlohmann::json json = {{"kind", "range"}, {"tolerance", options.tolerance}};
    json["sets"] = nlohmann::json::array();
    json["sets"].push_back(reportErrors("all cameras", total));
    for (const std::string& name : source_options.cameras) {
      json["sets"].push_back(reportErrors(name, judge.camera(rig->cameraIndex(name)).errors()));
    }
    if (!report.empty()) {
      vcharge::writeReport(json, report, "range_errors");
    }
  });
}
