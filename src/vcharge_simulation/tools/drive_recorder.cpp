#include "drive_recorder.h"

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "image_source.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/dense_maps/parking_bay_file.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_recordings/drive_bag_writer.h"
#include "vcharge_simulation/drive/truth_maps.h"
#include "vcharge_simulation/faults/fault_truth.h"
#include "vcharge_simulation/faults/image_faults.h"
#include "vcharge_simulation/faults/light_faults.h"
#include "vcharge_simulation/rendering/renderer.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"
#include "vcharge_simulation/sensors/recorded_cameras.h"
#include "wheel_can_log.h"

namespace vcharge {

namespace {

// The height map leaves out tree crowns and lamps above this height over the ground.
constexpr double kHeightLimit_m = 2.5;
// Surfaces this near to a lamp belong to it and do not hide it.
constexpr double kLampSize_m = 0.3;

DrivePlan planDriveOf(const DriveScenario& scenario) {
  DrivePlan plan = planDrive(scenario.scene, scenario.drive, static_cast<uint64_t>(scenario.layout_seed));
  if (scenario.duration_s > 0.0) {
    plan.motion.duration_s = scenario.duration_s;
  }
  return plan;
}

SceneOptions sceneOptionsOf(const DriveScenario& scenario, const DrivePlan& plan,
                            const SimulatedDrive& drive) {
  SceneOptions scene;
  scene.seed = static_cast<uint64_t>(scenario.scene_seed);
  scene.layout_seed = static_cast<uint64_t>(scenario.layout_seed);
  scene.surface_seed = static_cast<uint64_t>(scenario.surface_seed);
  scene.day = {scenario.day < 0 ? plan.day : scenario.day, scenario.exchanged_cars};
  scene.condition = scenario.condition;
  scene.image_scale = scenario.image_scale;
  scene.board = scenario.board;
  scene.rig = scenario.rig;
  scene.rig_seed = static_cast<uint64_t>(scenario.rig_seed);
  scene.movers = scenario.movers;
  scene.own_poses = ownPoses(drive);
  scene.start_s = plan.start_s;
  return scene;
}

// Keeps every step-th element.
template <class T>
void thin(int step, std::vector<T>* list) {
  std::vector<T> kept;
  for (size_t i = 0; i < list->size(); i += static_cast<size_t>(step)) {
    kept.push_back(std::move((*list)[i]));
  }
  *list = std::move(kept);
}

// These options change all images, so images rendered without them cannot be used.
void checkImagesCanBeReused(const DriveScenario& scenario, const std::string& images_from) {
  const FaultOptions& faults = scenario.faults;
  const bool lamps_in_world = faults.bright_lamps.isActive() && !faults.bright_lamps.positions_m.empty();
  for (const auto& [name, is_active] :
       {std::pair("faults.soft_suspension", faults.soft_suspension.isActive()),
        std::pair("faults.loaded_boot", faults.loaded_boot.isActive()),
        std::pair("faults.bright_lamps.positions_m", lamps_in_world),
        std::pair("condition", !scenario.condition.isNoon())}) {
    if (is_active) {
      throw InputError(std::string(name) + ": changes all images, so those of " + images_from +
                       " cannot be used");
    }
  }
}

// Whether a fault changes what is rendered for a camera at that time, or at any time.
bool changesRendering(const FaultOptions& faults, const std::string& camera, Duration since_start) {
  return faults.bumped_camera.actsOn(camera, since_start) ||
         faults.rolling_shutter.actsOn(camera, since_start) ||
         faults.motion_blur.actsOn(camera, since_start) ||
         faults.image_stamp_shift.exposureShiftOf(camera, since_start) != 0.0;
}
bool changesRendering(const FaultOptions& faults) {
  return faults.bumped_camera.isActive() || faults.rolling_shutter.isActive() ||
         faults.motion_blur.isActive() ||
         (faults.image_stamp_shift.isActive() && faults.image_stamp_shift.moves_exposure);
}

// `to` is a point or, if w is 0, a direction.
bool isVisible(const Renderer& renderer, const Eigen::Vector3d& from_m, const Eigen::Vector4d& to) {
  const Eigen::Vector3d offset = to.head<3>() - to.w() * from_m;
  const auto hit_m = renderer.castRay(from_m, offset.normalized());
  return !hit_m || (to.w() > 0.0 && *hit_m > offset.norm() - kLampSize_m);
}

std::vector<ImageFaults::Camera> faultyCameras(const RecordedCameras& cameras) {
  std::vector<ImageFaults::Camera> list;
  for (size_t i = 0; i < cameras.size(); ++i) {
    list.push_back({cameras.name(i), cameras.index(i)});
  }
  return list;
}

// Writes odometry and counters as they are received, and true poses at their stamps.
class MotionRecorder {
 public:
  MotionRecorder(const SimulatedDrive& drive, const OdometryStampShiftFault& shift, DriveBagWriter* writer)
      : drive_(drive), shift_(shift), writer_(writer) {}

  /// Writes everything up to and including `end`, or all that remains.
  void writeUntil(std::optional<Timestamp> end) {
    const auto isDue = [&](const auto& list, size_t i) {
      return i < list.size() && (!end || list[i].received <= *end);
    };
    for (; truth_ < drive_.ground_truth.size() && (!end || drive_.ground_truth[truth_].stamp <= *end);
         ++truth_) {
      writer_->writeGroundTruth(drive_.ground_truth[truth_]);
    }
    for (; isDue(drive_.odometry, odometry_); ++odometry_) {
      auto [odometry, received] = drive_.odometry[odometry_];
      odometry.stamp = shifted(odometry.stamp);
      writer_->writeOdometry(odometry, received);
    }
    for (; isDue(drive_.wheel_ticks, ticks_); ++ticks_) {
      auto [ticks, received] = drive_.wheel_ticks[ticks_];
      ticks.stamp = shifted(ticks.stamp);
      writer_->writeWheelTicks(ticks, received);
    }
  }

 private:
  Timestamp shifted(Timestamp stamp) const {
    return stamp + shift_.shiftAt(stamp - drive_.ground_truth.front().stamp);
  }

  const SimulatedDrive& drive_;
  const OdometryStampShiftFault shift_;
  DriveBagWriter* writer_;
  size_t odometry_ = 0, truth_ = 0, ticks_ = 0;
};

// Writes a rig with its masks beside it.
void writeTruthRig(CameraRig rig, const std::string& folder, const std::string& suffix) {
  for (RigCamera& camera : rig.cameras) {
    camera.mask_file = camera.name + "_mask" + suffix + ".png";
  }
  writeCameraRig(rig, folder + "/rig" + suffix + ".yaml");
}

void writeRange(const cv::Mat& range_m, const std::string& folder, Timestamp stamp) {
  const std::string path = folder + "/" + std::to_string(stamp.nanoseconds()) + ".tiff";
  if (!cv::imwrite(path, range_m)) {
    throw InputError(path + ": cannot be written");
  }
}

}  // namespace

void recordDrive(const DriveScenario& scenario, const RecordingOptions& recording) {
  scenario.validate();
  const DrivePlan plan = planDriveOf(scenario);
  const std::filesystem::path bag(recording.bag);
  const std::string truth_name = bag.stem().string() + "_truth";
  const RecordedCameras cameras(scenario, "rig_truth_masks");
  const CameraRig& rig = cameras.rig();
  const FaultOptions faults = scenario.activeFaults();
  SimulatedDrive drive =
      simulateDrive(plan.path, plan.motion, scenario.odometer, static_cast<uint64_t>(scenario.seed),
                    scenario.sensorSeed(), faults, plan.ground_height);
  thin(scenario.image_step, &drive.world_from_vehicle);
  thin(scenario.image_step, &drive.image_motion);
  const Timestamp start = drive.ground_truth.front().stamp;

  DriveBagWriter writer(recording.bag, rig);
  FolderTransaction truth((bag.parent_path() / truth_name).string());

  std::vector<Timestamp> stamps;
  std::vector<double> scene_times_s;
  for (const auto& [stamp, world_from_vehicle] : drive.world_from_vehicle) {
    stamps.push_back(stamp);
    scene_times_s.push_back(plan.start_s +
                            1e-9 * static_cast<double>((stamp - drive.ground_truth.front().stamp).count()));
  }
  const CameraResponse response;
  std::optional<Renderer> renderer;
  std::optional<LensGlare> glare;
  std::unique_ptr<ImageSource> images;
  writeTrajectory(drive.world_from_vehicle, truth.path() + "/trajectory.tum");
  const bool is_rendered = recording.images_from.empty();
  if (!is_rendered) {
    checkImagesCanBeReused(scenario, recording.images_from);
  }
  if (is_rendered || changesRendering(faults)) {
    renderer.emplace(buildScene(scenario.scene, sceneOptionsOf(scenario, plan, drive)));
    if (!scenario.condition.isNoon()) {
      glare.emplace(renderer->scene(), [&](const Eigen::Vector3d& from_m, const Eigen::Vector4d& to) {
        return isVisible(*renderer, from_m, to);
      });
    }
    images = renderImages(*renderer, cameras, response, drive, scene_times_s, faults.motion_blur,
                          glare ? &*glare : nullptr);
  }
  if (is_rendered) {
    writeHeightMap(computeHeightMap(*renderer, recording.height_cell_m, kHeightLimit_m),
                   truth.path() + "/height_map");
    writeObstacles(renderer->scene().obstacles, truth.path() + "/obstacles.yaml");
    if (!renderer->scene().bays.empty()) {
      writeParkingBays({"world", renderer->scene().bays}, truth.path() + "/bays.yaml");
    }
    if (!renderer->scene().movers.empty()) {
      writeMovers(renderer->scene().movers, stamps, scene_times_s, truth.path() + "/movers.yaml");
    }
  } else {
    images = readImages(
        recording.images_from, rig, drive,
        [&](size_t camera, size_t frame) {
          return changesRendering(faults, cameras.name(camera), stamps[frame] - start);
        },
        std::move(images));
  }
  if (scenario.scene == "chessboard") {
    writeTextFileAtomically(truth.path() + "/board.yaml", boardTarget(scenario.board));
  }
  const bool has_objects = is_rendered && !trueObjects(renderer->scene().movers, 0.0).empty();
  const bool truth_range = recording.truth_range && renderer.has_value();
  for (const RigCamera& camera : rig.cameras) {
    if (truth_range) {
      createFolder(truth.path() + "/range/" + camera.name);
    }
  }

  std::vector<std::string> names;
  for (const RigCamera& camera : rig.cameras) {
    names.push_back(camera.name);
  }
  LightFaults::IsVisible is_visible;
  if (renderer) {
    is_visible = [&](const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
      return isVisible(*renderer, from_m, to_m.homogeneous());
    };
  }
  const LightFaults light_faults(faults, cameras, response, start, is_visible);
  // Noise-free images are at the normal exposure, so that other drives can be made of them.
  ExposureFaults exposures(faults, names, response, start, scenario.noise ? scenario.exposure_gain : 1.0);
  ImageFaults image_faults(faults, faultyCameras(cameras), start, scenario.sensorSeed());
  MotionRecorder motion(drive, faults.odometry_stamp_shift, &writer);
  if (!drive.wheel_speeds.empty()) {
    std::vector<WheelSpeeds> speeds;
    for (const Received<WheelSpeeds>& each : drive.wheel_speeds) {
      speeds.push_back(each.message);
      speeds.back().stamp =
          each.message.stamp + faults.odometry_stamp_shift.shiftAt(each.message.stamp - start);
    }
    writeTextFileAtomically((bag.parent_path() / (bag.stem().string() + "_can.log")).string(),
                            wheelCanLog(speeds));
  }
  ProgressBar progress("simulating " + scenario.drive);
  for (size_t frame = 0; frame < drive.world_from_vehicle.size(); ++frame) {
    const Timestamp stamp = stamps[frame];
    motion.writeUntil(stamp);
    if (has_objects) {
      writer.writeTrueObjects(stamp, trueObjects(renderer->scene().movers, scene_times_s[frame]));
    }
    for (size_t camera = 0; camera < cameras.size(); ++camera) {
      const Readout readout = cameras.readout(camera, stamp - start, drive.image_motion[frame]);
      const cv::Mat light = light_faults.apply(camera, stamp, images->image(camera, frame), readout);
      const Exposure exposure = exposures.next(camera, stamp, light);
      const cv::Mat image = scenario.noise
                                ? response.addNoise(light, scenario.sensorSeed(), cameras.index(camera),
                                                    static_cast<int64_t>(frame), exposure)
                                : response.expose(light, exposure);
      exposures.observe(camera, image);
      const size_t plug = cameras.plug(camera, stamp - start);
      if (const std::optional<DeliveredImage> delivered = image_faults.deliver(camera, frame, stamp, image)) {
        writer.writeImage(plug, delivered->stamp, delivered->pixels, delivered->received);
      }
      if (truth_range) {
        writeRange(renderer->renderRange(cameras.view(camera, stamp - start), readout, scene_times_s[frame]),
                   truth.path() + "/range/" + cameras.name(plug), stamp);
      }
    }
    progress.update(static_cast<double>(frame + 1) / static_cast<double>(drive.world_from_vehicle.size()));
  }
  motion.writeUntil(std::nullopt);
  writeFaults(faults, start, names, image_faults.hits(), exposures.records(), truth.path() + "/faults.yaml");
  writeTruthRig(rig, truth.path(), "");
  if (cameras.isRigFaulty()) {
    writeTruthRig(rig, truth.path(), "_before");
    writeTruthRig(cameras.rigAfterFaults(), truth.path(), "_after");
  }
  writer.close();
  truth.commit();
  // Shared by all drives with this rig; it has its own copies of the masks, so it does not depend on the
  // truth folder.
  createFolder((bag.parent_path() / "rig_truth_masks").string());
  writeCameraRig(rig, (bag.parent_path() / "rig_truth.yaml").string());
}

}  // namespace vcharge
