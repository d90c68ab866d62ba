#include "drive_recorder.h"

#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/error.h"
#include "vcharge_core/file_io.h"
#include "vcharge_core/options.h"
#include "vcharge_core/progress_bar.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_bag_writer.h"
#include "vcharge_ros/drive_topics.h"
#include "vcharge_ros/image_conversions.h"
#include "vcharge_simulation/golf_rig.h"
#include "vcharge_simulation/renderer.h"
#include "vcharge_simulation/scene_catalogue.h"
#include "vcharge_simulation/truth_maps.h"

namespace vcharge {

namespace {

// Poses of the same drive agree to the last bits that a message holds.
constexpr double kSamePose_m = 1e-9;

DrivePlan planDriveOf(const DriveScenario& scenario) {
  DrivePlan plan = planDrive(scenario.scene, scenario.drive);
  if (scenario.duration_s > 0.0) {
    plan.motion.duration_s = scenario.duration_s;
  }
  return plan;
}

struct SelectedCamera {
  RigCamera camera;
  int index;  ///< in the whole rig: noise does not depend on which cameras are selected
};

std::vector<SelectedCamera> selectCameras(const DriveScenario& scenario) {
  const CameraRig rig = makeGolfRig(static_cast<uint64_t>(scenario.rig_seed), scenario.image_scale);
  std::vector<SelectedCamera> selected;
  if (scenario.cameras.empty()) {
    for (const RigCamera& camera : rig.cameras) {
      selected.push_back({camera, static_cast<int>(selected.size())});
    }
  }
  for (const std::string& name : scenario.cameras) {
    const size_t index = rig.cameraIndex(name);
    selected.push_back({rig.cameras[index], static_cast<int>(index)});
  }
  return selected;
}

/// Hands out the noise-free images of a drive, frame by frame and camera by camera.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  virtual cv::Mat image(size_t camera, size_t frame) = 0;
};

class RenderedImages : public ImageSource {
 public:
  RenderedImages(const Renderer& renderer, const std::vector<CameraView>& views,
                 const CameraResponse& response, const Trajectory& world_from_vehicle,
                 const std::vector<double>& scene_times_s)
      : renderer_(renderer),
        views_(views),
        response_(response),
        world_from_vehicle_(world_from_vehicle),
        scene_times_s_(scene_times_s) {}
  cv::Mat image(size_t camera, size_t frame) override {
    return response_.develop(renderer_.renderLight(
        views_[camera], world_from_vehicle_[frame].world_from_vehicle, scene_times_s_[frame]));
  }

 private:
  const Renderer& renderer_;
  const std::vector<CameraView>& views_;
  const CameraResponse& response_;
  const Trajectory& world_from_vehicle_;
  const std::vector<double>& scene_times_s_;
};

class RecordedImages : public ImageSource {
 public:
  RecordedImages(const std::string& path, const CameraRig& rig, const SimulatedDrive& drive)
      : path_(path), rig_(rig), drive_(drive) {
    try {
      bag_.open(path, rosbag::bagmode::Read);
      checkPoses();
      std::vector<std::string> topics;
      for (const RigCamera& camera : rig.cameras) {
        topics.push_back(DriveTopics().imageTopic(camera.name));
        views_.push_back(std::make_unique<rosbag::View>(bag_, rosbag::TopicQuery(topics.back())));
        if (views_.back()->size() < drive.world_from_vehicle.size()) {
          throw InputError(path + ": " + topics.back() + ": expected " +
                           std::to_string(drive.world_from_vehicle.size()) + " images, got " +
                           std::to_string(views_.back()->size()));
        }
        next_.push_back(views_.back()->begin());
      }
    } catch (const rosbag::BagException& error) {
      throw InputError(path + ": cannot be read as a bag: " + error.what());
    }
  }

  cv::Mat image(size_t camera, size_t frame) override {
    const std::string source = path_ + ": " + next_[camera]->getTopic();
    const auto message = next_[camera]->instantiate<sensor_msgs::Image>();
    ++next_[camera];
    if (message == nullptr || toTimestamp(message->header.stamp) != drive_.world_from_vehicle[frame].stamp) {
      throw InputError(source + ": expected the images of the same drive, image " + std::to_string(frame) +
                       " has another stamp or type");
    }
    const Image image = toImage(message, source);
    checkImageSize(rig_.cameras[camera], image.pixels.size(), source);
    return image.pixels.clone();  // the view ends with its message
  }

 private:
  void checkPoses() {
    rosbag::View view(bag_, rosbag::TopicQuery("/ground_truth"));
    size_t i = 0;
    bool same = view.size() >= drive_.ground_truth.size();
    for (const rosbag::MessageInstance& item : view) {
      const auto message = item.instantiate<nav_msgs::Odometry>();
      if (!same || i == drive_.ground_truth.size()) {
        break;
      }
      const VehicleOdometry& truth = drive_.ground_truth[i++];
      same = message != nullptr && toTimestamp(message->header.stamp) == truth.stamp &&
             (fromMessage(message->pose.pose, path_).translation() - truth.odom_from_vehicle.translation())
                     .norm() < kSamePose_m;
    }
    if (!same) {
      throw InputError(path_ + ": /ground_truth: expected the poses of the same drive with the same seed");
    }
  }

  const std::string path_;
  const CameraRig& rig_;
  const SimulatedDrive& drive_;
  rosbag::Bag bag_;
  std::vector<std::unique_ptr<rosbag::View>> views_;
  std::vector<rosbag::View::iterator> next_;
};

void writeRange(const cv::Mat& range_m, const std::string& folder, Timestamp stamp) {
  const std::string path = folder + "/" + std::to_string(stamp.nanoseconds()) + ".tiff";
  if (!cv::imwrite(path, range_m)) {
    throw InputError(path + ": cannot be written");
  }
}

}  // namespace

void RecordingOptions::validate() const {
  requireField(std::isfinite(height_cell_m) && height_cell_m >= 0.01, "height_cell_m",
               "must be at least 0.01", height_cell_m);
  requireField(std::isfinite(height_limit_m), "height_limit_m", "must be a number", height_limit_m);
}

void recordDrive(const DriveScenario& scenario, const RecordingOptions& recording) {
  scenario.validate();
  recording.validate();
  const DrivePlan plan = planDriveOf(scenario);
  const std::vector<SelectedCamera> selected = selectCameras(scenario);
  const SimulatedDrive drive =
      simulateDrive(plan.path, plan.motion, scenario.odometer, static_cast<uint64_t>(scenario.seed),
                    scenario.sensorSeed(), plan.ground_height);

  const std::filesystem::path bag(recording.bag);
  const std::string truth_name = bag.stem().string() + "_truth";
  const auto body = makeGolfBody();
  CameraRig rig;
  std::vector<CameraView> views;
  for (const SelectedCamera& entry : selected) {
    views.emplace_back(entry.camera, body, scenario.lens);
    rig.cameras.push_back(entry.camera);
    rig.cameras.back().mask = views.back().mask();
    rig.cameras.back().mask_file = truth_name + "/" + entry.camera.name + "_mask.png";
  }
  DriveBagWriter writer(recording.bag, rig);
  FolderTransaction truth((bag.parent_path() / truth_name).string());

  std::vector<Timestamp> stamps;
  std::vector<double> scene_times_s;
  for (const auto& [stamp, world_from_vehicle] : drive.world_from_vehicle) {
    stamps.push_back(stamp);
    scene_times_s.push_back(plan.start_s +
                            1e-9 * static_cast<double>((stamp - drive.ground_truth.front().stamp).count()));
  }
  const CameraResponse response(scenario.response);
  std::optional<Renderer> renderer;
  std::unique_ptr<ImageSource> images;
  writeTrajectory(drive.world_from_vehicle, truth.path() + "/trajectory.tum");
  if (recording.images_from.empty()) {
    SceneOptions scene;
    scene.seed = scenario.scene_seed;
    scene.day = plan.day;
    scene.image_scale = scenario.image_scale;
    renderer.emplace(buildScene(scenario.scene, scene));
    images =
        std::make_unique<RenderedImages>(*renderer, views, response, drive.world_from_vehicle, scene_times_s);
    writeHeightMap(computeHeightMap(*renderer, recording.height_cell_m, recording.height_limit_m),
                   truth.path() + "/height_map");
    writeObstacles(renderer->scene().obstacles, truth.path() + "/obstacles.yaml");
    if (!renderer->scene().movers.empty()) {
      writeMovers(renderer->scene().movers, stamps, scene_times_s, truth.path() + "/movers.yaml");
    }
  } else {
    images = std::make_unique<RecordedImages>(recording.images_from, rig, drive);
  }
  const bool truth_range = recording.truth_range && renderer.has_value();
  for (const RigCamera& camera : rig.cameras) {
    if (truth_range) {
      createFolder(truth.path() + "/range/" + camera.name);
    }
  }

  ProgressBar progress("simulating " + scenario.drive);
  size_t odometry = 0;
  size_t ticks = 0;
  const auto writeUntil = [&](std::optional<Timestamp> end) {
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
      cv::Mat image = images->image(camera, frame);
      if (scenario.noise) {
        image = response.addNoise(image, scenario.sensorSeed(), selected[camera].index,
                                  static_cast<int64_t>(frame), scenario.exposure_gain);
      }
      writer.writeImage(camera, stamp, image);
      if (truth_range) {
        writeRange(renderer->renderRange(views[camera], world_from_vehicle, scene_times_s[frame]),
                   truth.path() + "/range/" + rig.cameras[camera].name, stamp);
      }
    }
    progress.update(static_cast<double>(frame + 1) / static_cast<double>(drive.world_from_vehicle.size()));
  }
  writeUntil(std::nullopt);
  writer.close();
  truth.commit();
  writeCameraRig(rig, (bag.parent_path() / "rig_truth.yaml").string());
}

}  // namespace vcharge
