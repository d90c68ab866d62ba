#include <algorithm>
#include <cmath>
#include <ctime>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/dense_maps/obstacle_map_file.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/frames/frame_counters_text.h"
#include "vcharge_dense/surround_view.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using namespace vcharge;

struct Arguments {
  std::string bag, rig, vehicle, options, obstacles, output;
  std::vector<std::string> cameras;
  double rate_hz = 12.5;
  bool labels = false, no_film = false, show_options = false;
};

/// Writes pictures, a film, and a table of gains.
class Recorder {
 public:
  Recorder(const Arguments& arguments, const CameraRig& rig, std::string folder)
      : arguments_(arguments), folder_(std::move(folder)), table_("stamp_ns") {
    for (const RigCamera& camera : rig.cameras) {
      table_ += ",gain_" + camera.name;
    }
    table_ += ",shading_1,shading_2\n";
  }

  void add(const SurroundFrame& frame) {
    const std::string stem = folder_ + "/" + std::to_string(frame.stamp.nanoseconds());
    write(stem + ".png", frame.image);
    if (arguments_.labels) {
      write(stem + "_labels.png", frame.labels);
    }
    if (!arguments_.no_film) {
      film(frame.image);
    }
    table_ += std::to_string(frame.stamp.nanoseconds());
    for (const double gain : frame.gains) {
      table_ += "," + toText(gain, 4);
    }
    table_ += "," + toText(frame.shading[0], 4) + "," + toText(frame.shading[1], 4) + "\n";
    hasher_.addBytes(frame.image.data, frame.image.total());
    hasher_.addBytes(frame.labels.data, frame.labels.total());
    unknown_ +=
        cv::countNonZero(frame.labels == kSurroundUnknown) / static_cast<double>(frame.labels.total());
    ++num_frames_;
  }
  void finish() {
    film_.release();
    writeTextFileAtomically(folder_ + "/gains.csv", table_);
  }
  uint64_t numFrames() const { return num_frames_; }
  double unknownRatio() const { return unknown_ / static_cast<double>(std::max<uint64_t>(1, num_frames_)); }
  std::string hash() const { return hasher_.hex(); }

 private:
  static void write(const std::string& path, const cv::Mat& image) {
    if (!cv::imwrite(path, image)) {
      throw InputError(path + ": cannot be written");
    }
  }
  void film(const cv::Mat& image) {
    if (!film_.isOpened()) {
      const std::string path = folder_ + "/film.webm";
      film_.open(path, cv::VideoWriter::fourcc('V', 'P', '8', '0'), arguments_.rate_hz, image.size());
      if (!film_.isOpened()) {
        throw InputError(path + ": cannot be written as a film; --no-film writes pictures only");
      }
    }
    cv::Mat coloured;
    cv::cvtColor(image, coloured, cv::COLOR_GRAY2BGR);
    film_.write(coloured);
  }

  const Arguments& arguments_;
  const std::string folder_;
  std::string table_;
  cv::VideoWriter film_;
  ContentHasher hasher_;
  uint64_t num_frames_ = 0;
  double unknown_ = 0.0;
};

/// Passes a drive to the view, with the obstacle maps of a folder, and counts the processor time.
class Feeder : public DriveConsumer {
 public:
  Feeder(SurroundView* view, const std::string& obstacles) : view_(view), folder_(obstacles) {
    if (!folder_.empty()) {
      stamps_ = listObstacles(folder_);
    }
  }
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    while (num_read_ < stamps_.size() && stamps_[num_read_] <= stamp) {
      view_->setObstacles(readObstacleMap(folder_, stamps_[num_read_++]));
    }
    const std::clock_t begin = std::clock();
    view_->addImage(camera_index, stamp, image);
    ticks_ += std::clock() - begin;
  }
  void addOdometry(const VehicleOdometry& odometry) override {
    const std::clock_t begin = std::clock();
    view_->addOdometry(odometry);
    ticks_ += std::clock() - begin;
  }
  double seconds() const { return static_cast<double>(ticks_) / CLOCKS_PER_SEC; }

 private:
  SurroundView* view_;
  const std::string folder_;
  std::vector<Timestamp> stamps_;
  size_t num_read_ = 0;
  std::clock_t ticks_ = 0;
};

void renderSurroundView(const Arguments& arguments, const SurroundViewOptions& options,
                        nlohmann::json* found) {
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  std::clock_t writing = 0;
  FolderTransaction output(arguments.output);
  Recorder recorder(arguments, *rig, output.path());
  SurroundView view(
      rig, options,
      [&](const SurroundFrame& frame) {
        const std::clock_t begin = std::clock();
        recorder.add(frame);
        writing += std::clock() - begin;
      },
      arguments.cameras);
  Feeder feeder(&view, arguments.obstacles);
  BagDriveSourceOptions source_options;
  source_options.cameras = arguments.cameras;
  source_options.max_image_gap_s = INFINITY;  // the others are shown without a camera that stops
  BagDriveSource source(arguments.bag, rig, source_options);
  {
    ProgressBar progress("surround view");
    source.run(&feeder, [&](double fraction) { progress.update(fraction); });
    view.finish();
  }
  recorder.finish();
  output.commit();
  const double num_frames = std::max(1.0, static_cast<double>(recorder.numFrames()));
  const double ms = 1000.0 * (feeder.seconds() - static_cast<double>(writing) / CLOCKS_PER_SEC) / num_frames;
  *found = countersToJson(view.counters(), *rig);
  (*found)["processor_ms_per_frame"] = ms;
  (*found)["unknown_ratio"] = recorder.unknownRatio();
  (*found)["content_hash"] = recorder.hash();
  std::cout << describe(view.counters(), *rig)
            << "unknown pixels: " << toText(100.0 * recorder.unknownRatio(), 1)
            << " %\nprocessor time per frame: " << toText(ms, 1) << " ms\ncontent hash: " << recorder.hash()
            << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Renders a recorded drive from above, seamless between the cameras. Writes a picture per stamp, "
      "film.webm, and the gains of the cameras and the darkening of their lenses (gains.csv).");
  Arguments arguments;
  app.addOption("--bag", &arguments.bag, "bag of the drive").required();
  app.addOption("--rig", &arguments.rig, "rig.yaml with extrinsics").required();
  app.addOption("--vehicle", &arguments.vehicle, "YAML with the size of the vehicle (default: a Golf)");
  app.addOption("--options", &arguments.options, "YAML with overrides of SurroundViewOptions");
  app.addOption("--obstacles", &arguments.obstacles,
                "folder that detect_obstacles wrote (default: obstacles are not known)");
  app.addOption("--cameras", &arguments.cameras, "cameras of the rig by name (default: all)");
  app.addOption("--rate-hz", &arguments.rate_hz, "pictures per second of the film").positive().showDefault();
  app.addOption("--output", &arguments.output, "folder to write").required().check(requireOutputFolder);
  app.addFlag(
      "--labels", &arguments.labels,
      "write what each pixel shows: the camera's index, 253 two cameras, 254 remembered, 255 unknown");
  app.addFlag("--no-film", &arguments.no_film, "write no film");
  addShowOptions(&app, &arguments.show_options);
  app.setFooter("Keys of --json: " + std::string(kFrameCounterKeys) +
                ", processor_ms_per_frame (without reading and writing), unknown_ratio (of the pixels), "
                "content_hash.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    SurroundViewOptions options;
    options.frames.waitForEverything();
    for (const std::string& path : {arguments.vehicle, arguments.options}) {
      if (!path.empty()) {
        readFieldsFromFile(path, &options);
      }
    }
    if (arguments.show_options) {
      std::cout << showOptions(options);
      return;
    }
    renderSurroundView(arguments, options, found);
  });
}
