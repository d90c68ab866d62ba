#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "parking_output.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/obstacle_map_file.h"
#include "vcharge_core/dense_maps/range_map_file.h"
#include "vcharge_core/dense_maps/step_map_file.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/motion/tracked_object_file.h"
#include "vcharge_dense/range_mapper.h"
#include "vcharge_obstacles/image_fingerprint.h"
#include "vcharge_obstacles/object_tracker.h"
#include "vcharge_obstacles/obstacle_mapper.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using namespace vcharge;

struct Arguments {
  std::string bag, rig, vehicle, bays, trajectory, options, range_options, object_options, range, output;
  std::vector<std::string> cameras;
  bool show_options = false, no_objects = false;
};

/// Overrides options by those of a file, if one is given.
template <class Options>
void readIfGiven(const std::string& path, Options* options) {
  if (!path.empty()) {
    readFieldsFromFile(path, options);
  }
}

/// Processor time of all threads of the process during parts of a run.
class ProcessorTime {
 public:
  /// Calls the function and adds its processor time.
  template <class Function>
  auto add(const Function& function) {
    const Count count{std::clock(), &ticks_};
    return function();
  }
  double seconds() const { return static_cast<double>(ticks_) / CLOCKS_PER_SEC; }

 private:
  struct Count {
    ~Count() { *sum += std::clock() - begin; }
    std::clock_t begin;
    std::clock_t* sum;
  };
  std::clock_t ticks_ = 0;
};

/// Passes odometry and images to the stages, and range maps from the first to the second. `objects` may be
/// null.
class Pipeline : public DriveConsumer {
 public:
  Pipeline(const std::shared_ptr<const CameraRig>& rig, const RangeMapperOptions& range_options,
           const std::string& range_folder, ObstacleMapper* obstacles, ObjectTracker* objects)
      : obstacles_(obstacles), objects_(objects) {
    if (range_folder.empty()) {
      ranges_ = std::make_unique<RangeMapper>(rig, range_options, [this](const RangeTask& task) {
        const RangeMap map = sweeping_.add([&] { return ranges_->sweep(task); });
        detecting_.add([&] { obstacles_->addRangeMap(map); });
        ++num_maps_;
      });
      return;
    }
    for (const std::string& camera : listRangeMapCameras(range_folder)) {
      const size_t index = rig->cameraIndex(camera);
      for (const Timestamp stamp : listRangeMaps(range_folder, camera)) {
        stored_[stamp][index] = camera;
      }
    }
    range_folder_ = range_folder;
  }

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    if (objects_ != nullptr) {
      tracking_.add([&] { objects_->addImage(camera_index, stamp, image); });
    }
    ++num_images_;
    detecting_.add([&] {
      obstacles_->addImage(camera_index, stamp, fingerprintOf(image.pixels),
                           [image] { return image.pixels; });
    });
    if (ranges_) {
      whole_.add([&] { ranges_->addImage(camera_index, stamp, image); });
    }
  }
  void addOdometry(const VehicleOdometry& odometry) override {
    if (objects_ != nullptr) {
      tracking_.add([&] { objects_->addOdometry(odometry); });
    }
    detecting_.add([&] { obstacles_->addOdometry(odometry); });
    if (ranges_) {
      whole_.add([&] { ranges_->addOdometry(odometry); });
      return;
    }
    while (!stored_.empty() && stored_.begin()->first <= odometry.stamp) {
      for (const auto& [index, camera] : stored_.begin()->second) {
        obstacles_->addRangeMap(readRangeMap(range_folder_, camera, stored_.begin()->first));
      }
      stored_.erase(stored_.begin());
    }
  }
  void finish() {
    if (ranges_) {
      ranges_->finish();
    }
    obstacles_->finish();
    if (objects_ != nullptr) {
      objects_->finish();
    }
  }
  /// Processor time without reading the bag and writing results; writing happens inside the detection.
  void reportTiming(double writing_s, nlohmann::json* found) const {
    const double objects_ms =
        1000.0 * tracking_.seconds() / static_cast<double>(std::max<uint64_t>(1, num_images_));
    std::cout << "processor time per image: objects " << toText(objects_ms, 1) << " ms\n";
    (*found)["processor_ms_per_image"] = {{"objects", objects_ms}};
    if (num_maps_ == 0) {
      return;
    }
    const double per_map_ms = 1000.0 / static_cast<double>(num_maps_);
    const double sweep_ms = per_map_ms * sweeping_.seconds();
    const double obstacles_ms = per_map_ms * (detecting_.seconds() - writing_s);
    const double images_ms =
        std::max(0.0, per_map_ms * (whole_.seconds() - writing_s) - sweep_ms - obstacles_ms);
    std::cout << "processor time per range map: " << toText(images_ms + sweep_ms + obstacles_ms, 1)
              << " ms (images " << toText(images_ms, 1) << ", ranges " << toText(sweep_ms, 1)
              << ", obstacles " << toText(obstacles_ms, 1) << ")\n";
    (*found)["processor_ms_per_range_map"] = {
        {"images", images_ms}, {"ranges", sweep_ms}, {"obstacles", obstacles_ms}};
  }

 private:
  ObstacleMapper* obstacles_;
  ObjectTracker* objects_;
  ProcessorTime tracking_;
  ProcessorTime whole_, sweeping_, detecting_;  // the last two are mostly included in the first
  uint64_t num_maps_ = 0, num_images_ = 0;
  std::unique_ptr<RangeMapper> ranges_;
  std::string range_folder_;
  std::map<Timestamp, std::map<size_t, std::string>> stored_;
};

/// Cameras for the objects: those of the map, and the rig's others that have extrinsics and images in the
/// bag. Prints a warning that names the ones left out. Empty for a map of all cameras: all.
std::vector<std::string> findObjectCameras(const std::string& bag, const CameraRig& rig,
                                           const std::vector<std::string>& map_cameras) {
  std::vector<std::string> cameras = map_cameras;
  if (cameras.empty()) {
    return cameras;
  }
  const auto contains = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const std::vector<std::string> recorded = camerasWithImages(bag, rig);
  std::string left_out;
  for (const RigCamera& camera : rig.cameras) {
    if (contains(map_cameras, camera.name)) {
      continue;
    }
    if (camera.vehicle_from_camera && contains(recorded, camera.name)) {
      cameras.push_back(camera.name);
    } else {
      left_out += (left_out.empty() ? "" : ", ") + camera.name +
                  (camera.vehicle_from_camera ? " (no images in the bag)" : " (no vehicle_from_camera)");
    }
  }
  if (!left_out.empty()) {
    std::cout << "warning: objects are detected without " << left_out << "\n";
  }
  return cameras;
}

/// Writes each frame, and collects data for the summary.
class Recorder {
 public:
  explicit Recorder(std::string folder) : folder_(std::move(folder)) {
    corridors_ =
        "stamp_ns,direction,curvature_per_m,known_free_m,free_beyond_rim_m,occupied_m,unknown_fraction,"
        "oldest_age_s,"
        "crossing_id,crossing_time_s,crossing_travel_m\n";
    table_ = "stamp_ns,camera,state,known_fraction,pitch_rad,roll_rad,height_m,ground_state,ground_points\n";
  }

  void add(const ObstacleFrame& frame) {
    std::vector<ObstacleScan> scans = {frame.scan};
    for (const CameraObstacles& camera : frame.cameras) {
      scans.push_back(camera.scan);
    }
    writeObstacles(frame.map, scans, folder_);
    writeStepMap(frame.steps, folder_);
    gaps_ += gapRows(frame);
    addToHash(frame.map, &hasher_);
    addToHash(frame.steps, &hasher_);
    for (const ObstacleScan& scan : scans) {
      addToHash(scan, &hasher_);
    }
    for (const ObstacleCameraStatus& status : frame.status) {
      table_ += std::to_string(frame.map.stamp.nanoseconds()) + "," + status.camera_name + "," +
                toString(status.state) + "," + toText(status.known_fraction, 4) + "," +
                toText(status.ground.pitch_rad(), 5) + "," + toText(status.ground.roll_rad(), 5) + "," +
                toText(status.ground.height_m(), 4) + "," + toString(status.ground.state) + "," +
                std::to_string(status.ground.num_points) + "\n";
    }
    addCorridor(frame);
    ++num_frames_;
  }

  void add(const ObjectFrame& frame) {
    addToHash(frame, &hasher_);
    object_frames_.push_back(frame);
  }

  void finish(const ObstacleMapper& mapper, nlohmann::json* found) const {
    if (!object_frames_.empty()) {
      writeObjects(object_frames_, folder_);
    }
    writeTextFileAtomically(folder_ + "/status.csv", table_);
    writeTextFileAtomically(folder_ + "/corridor.csv", corridors_);
    writeTextFileAtomically(folder_ + "/gaps.csv", gaps_);
    nlohmann::json cameras = nlohmann::json::array();
    for (const ObstacleCameraStatus& status : mapper.status()) {
      std::cout << status.camera_name << ": " << status.range_maps << " range maps (" << status.without_pose
                << " without pose, " << status.late << " late), " << status.message << "\n";
      cameras.push_back({{"name", status.camera_name},
                         {"num_range_maps", status.range_maps},
                         {"num_without_pose", status.without_pose},
                         {"num_late", status.late},
                         {"message", status.message}});
    }
    *found = {{"num_maps", num_frames_},
              {"num_odometry_jumps", mapper.numJumps()},
              {"cameras", cameras},
              {"content_hash", hasher_.hex()}};
    std::cout << "obstacle maps: " << num_frames_ << ", odometry jumps: " << mapper.numJumps() << "\n"
              << "content hash: " << hasher_.hex() << "\n";
  }
  uint64_t numFrames() const { return num_frames_ + object_frames_.size(); }

 private:
  void addCorridor(const ObstacleFrame& frame) {
    for (const bool is_forward : {true, false}) {
      const CorridorDirection& direction = is_forward ? frame.corridor.forward : frame.corridor.backward;
      corridors_ += std::to_string(frame.map.stamp.nanoseconds()) +
                    (is_forward ? ",forward," : ",backward,") + toText(frame.corridor.curvature_per_m, 5) +
                    "," + toText(direction.known_free_m, 3) + "," + toText(direction.free_beyond_rim_m, 3) +
                    "," + toText(direction.occupied_m, 3) + "," + toText(direction.unknown_fraction, 4) +
                    "," + toText(direction.oldest_age_s, 3) + ",";
      if (const std::optional<CrossingObject>& crossing = direction.crossing) {
        corridors_ += std::to_string(crossing->id) + "," + toText(crossing->time_s, 3) + "," +
                      toText(crossing->travel_m, 1);
      } else {
        corridors_ += ",,";
      }
      corridors_ += "\n";
    }
  }

  const std::string folder_;
  std::string table_, corridors_, gaps_ = kGapColumns;
  ContentHasher hasher_;
  uint64_t num_frames_ = 0;
  std::vector<ObjectFrame> object_frames_;
};

void detectObstacles(const Arguments& arguments, const ObstacleMapperOptions& options,
                     const RangeMapperOptions& range_options, ObjectTrackerOptions object_options,
                     nlohmann::json* found) {
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  if (!std::filesystem::exists(arguments.bag)) {
    throw InputError(arguments.bag + ": no such file");  // before the output is created
  }
  if (arguments.no_objects) {
    object_options.cameras = options.cameras;
  } else if (object_options.cameras.empty()) {
    object_options.cameras = findObjectCameras(arguments.bag, *rig, options.cameras);
  }
  FolderTransaction output(arguments.output);
  Recorder recorder(output.path());
  ProcessorTime writing;
  std::unique_ptr<ObjectTracker> tracker;
  std::unique_ptr<BayRecorder> bays;
  if (!arguments.bays.empty()) {
    bays = std::make_unique<BayRecorder>(arguments.bays, arguments.trajectory);
  }
  ObstacleMapper mapper(rig, options, [&](const ObstacleFrame& frame) {
    if (bays) {
      bays->add(frame.map);
    }
    if (tracker) {
      tracker->setObstacles(frame.map);
    }
    writing.add([&] { recorder.add(frame); });
  });
  if (!arguments.no_objects) {
    tracker = std::make_unique<ObjectTracker>(rig, object_options, [&](const ObjectFrame& frame) {
      mapper.setObjects(frame.stamp, frame.objects);
      recorder.add(frame);
    });
  }
  Pipeline pipeline(rig, range_options, arguments.range, &mapper, tracker.get());
  BagDriveSourceOptions source_options;
  source_options.cameras = object_options.cameras;
  source_options.max_image_gap_s = INFINITY;  // a camera that stops is reported, not an error
  BagDriveSource source(arguments.bag, rig, source_options);
  {
    ProgressBar progress("obstacles");
    source.run(&pipeline, [&](double fraction) { progress.update(fraction); });
    pipeline.finish();
  }
  if (recorder.numFrames() == 0) {
    std::string reasons;
    for (const ObstacleCameraStatus& status : mapper.status()) {
      reasons += (reasons.empty() ? "" : "; ") + status.camera_name + ": " + status.message;
    }
    throw InputError(arguments.bag + ": no obstacle map could be made (" + reasons + ")");
  }
  recorder.finish(mapper, found);
  if (bays) {
    bays->finish(arguments.trajectory, output.path());
  }
  pipeline.reportTiming(writing.seconds(), found);
  output.commit();
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Detects obstacles and free ground around the vehicle in a recorded drive. Writes the fused map (PGM "
      "and "
      "YAML of map_server, float TIFFs) and all scans (CSV) per image stamp, the state of the cameras "
      "(status.csv), the free travel along the vehicle's arc (corridor.csv), gaps to park in (gaps.csv), "
      "what moves (objects.csv, "
      "objects_frames.csv), and with --bays which parking bays are free (bays.yaml, bays.csv).");
  Arguments arguments;
  app.addOption("--bag", &arguments.bag, "the drive").required();
  app.addOption("--rig", &arguments.rig, "rig.yaml with vehicle_from_camera").required();
  app.addOption("--vehicle", &arguments.vehicle, "YAML with the size of the vehicle (default: a Golf)");
  auto bays = app.addOption("--bays", &arguments.bays, "bays of map_bays: which are free");
  auto trajectory = app.addOption("--trajectory", &arguments.trajectory,
                                  "poses of localize_drive in the map of the bays (TUM)");
  bays.needs(trajectory);
  trajectory.needs(bays);
  app.addOption("--options", &arguments.options, "YAML with overrides of ObstacleMapperOptions");
  app.addOption("--range-options", &arguments.range_options, "YAML with overrides of RangeMapperOptions");
  app.addOption("--object-options", &arguments.object_options, "YAML with overrides of ObjectTrackerOptions");
  app.addOption("--range", &arguments.range,
                "folder that compute_range_maps wrote, instead of computing range maps");
  app.addOption("--cameras", &arguments.cameras,
                "cameras of the rig by name (default: those of --options; for objects also the rig's "
                "others that have extrinsics and images)");
  app.addOption("--output", &arguments.output, "folder to write").required().check(requireOutputFolder);
  app.addFlag("--no-objects", &arguments.no_objects, "do not follow what moves: faster");
  addShowOptions(&app, &arguments.show_options);
  app.setFooter(
      "Keys of --json: num_maps, num_odometry_jumps, cameras (name, num_range_maps, num_without_pose, "
      "num_late, "
      "message), processor_ms_per_image (objects), processor_ms_per_range_map (images, ranges, obstacles), "
      "content_hash.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    ObstacleMapperOptions options;
    RangeMapperOptions range_options;
    ObjectTrackerOptions object_options;
    readIfGiven(arguments.vehicle, &options);
    readIfGiven(arguments.options, &options);
    readIfGiven(arguments.range_options, &range_options);
    readIfGiven(arguments.object_options, &object_options);
    if (!arguments.cameras.empty()) {
      options.cameras = object_options.cameras = arguments.cameras;
    }
    range_options.cameras = options.cameras;
    object_options.frames.waitForEverything();
    if (arguments.show_options) {
      std::cout << "# For --options\n"
                << showOptions(options) << "\n# For --range-options\n"
                << showOptions(range_options) << "\n# For --object-options\n"
                << showOptions(object_options);
      return;
    }
    detectObstacles(arguments, options, range_options, object_options, found);
  });
}
