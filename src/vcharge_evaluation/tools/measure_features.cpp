#include <ctime>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core/utility.hpp>

#include "features/epipolar_judge.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_features/patch_tracker.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using namespace vcharge;

constexpr double kMaxError_rad = 0.2 * 3.14159265358979 / 180.0;

struct Arguments {
  std::string bag, rig, camera = "left", options;
  std::vector<std::string> types = {"fast_brief", "root_sift"};
  std::vector<int> frames = {1, 5, 10, 20};
  int num_pairs = 5;
  double max_ratio = 0.8;
  bool track = false;
};

/// CPU time of this thread: what else runs on the machine counts less than in wall time.
double threadTime_ms() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

/// Keeps the images of one camera, and how far the vehicle had come at each.
class ImageCollector : public DriveConsumer {
 public:
  explicit ImageCollector(size_t camera_index) : camera_index_(camera_index) {}
  void addImage(size_t camera_index, Timestamp /*stamp*/, const Image& image) override {
    if (camera_index == camera_index_) {
      images.push_back(image);
      travelled_m.push_back(distance_m_);
    }
  }
  void addOdometry(const VehicleOdometry& odometry) override {
    const Eigen::Vector3d& position = odometry.odom_from_vehicle.translation();
    distance_m_ += last_position_ ? (position - *last_position_).norm() : 0.0;
    last_position_ = position;
  }

  std::vector<Image> images;
  std::vector<double> travelled_m;

 private:
  const size_t camera_index_;
  std::optional<Eigen::Vector3d> last_position_;
  double distance_m_ = 0.0;
};

/// What one pair of images gave, or the mean of many.
struct Figures {
  double distance_m = 0.0, matches = 0.0, right = 0.0, error_rad = 0.0;

  void add(const Figures& other) {
    distance_m += other.distance_m;
    matches += other.matches;
    right += other.right;
    error_rad += other.error_rad;
  }
  void scale(double factor) {
    distance_m *= factor;
    matches *= factor;
    right *= factor;
    error_rad *= factor;
  }
};

class Measurement {
 public:
  Measurement(const RigCamera& camera, const ImageCollector& drive, const Arguments& arguments,
              const FeatureExtractorOptions& options)
      : camera_(camera),
        drive_(drive),
        arguments_(arguments),
        mask_(makeFeatureMask(camera)),
        extractor_(makeFeatureExtractor(options)),
        features_(drive.images.size()) {}

  void print(const std::string& name) {
    for (const int gap : arguments_.frames) {
      std::vector<double> matching_ms;
      const Figures mean = measure(gap, &matching_ms);
      const double cost_ms = 2.0 * median(extraction_ms_) + median(matching_ms);
      printRow(name, gap, mean, median(extraction_ms_), median(matching_ms), mean.right / cost_ms);
    }
  }

  /// Features of the first image followed from frame to frame.
  void printTracking() {
    for (const int gap : arguments_.frames) {
      std::vector<double> tracking_ms;
      Figures sum;
      const int last = static_cast<int>(drive_.images.size()) - 1 - gap;
      const int count = std::min(arguments_.num_pairs, last + 1);
      for (int k = 0; k < count; ++k) {
        const int i = startOf(k, count, last);
        std::vector<cv::Point2f> start, found;
        for (const Keypoint& keypoint : featuresOf(static_cast<size_t>(i)).keypoints) {
          start.push_back(keypoint.position_px);
        }
        found = start;
        for (int j = i; j < i + gap; ++j) {
          follow(static_cast<size_t>(j), &start, &found, &tracking_ms);
        }
        const EpipolarJudgement judgement = judge(start, found);
        sum.add({drive_.travelled_m[i + gap] - drive_.travelled_m[i], static_cast<double>(start.size()),
                 static_cast<double>(judgement.right), judgement.median_error_rad});
      }
      sum.scale(1.0 / std::max(count, 1));
      printRow("tracked", gap, sum, median(tracking_ms), 0.0, sum.right / (gap * median(tracking_ms)));
    }
  }

 private:
  /// Pairs are spread over the drive.
  static int startOf(int k, int count, int last) { return count > 1 ? k * last / (count - 1) : last / 2; }

  static void printRow(const std::string& name, int gap, const Figures& mean, double image_ms,
                       double matching_ms, double right_per_ms) {
    std::printf("| %s | +%d | %.1f | %.0f | %.0f | %.2f | %.3f | %.1f | %.2f | %.1f |\n", name.c_str(), gap,
                mean.distance_m, mean.right, mean.matches, mean.right / std::max(mean.matches, 1.0),
                mean.error_rad * 180.0 / 3.14159265358979, image_ms, matching_ms, right_per_ms);
    std::fflush(stdout);
  }

  /// From image `index` to the next; points that are lost leave both lists.
  void follow(size_t index, std::vector<cv::Point2f>* start, std::vector<cv::Point2f>* found,
              std::vector<double>* tracking_ms) const {
    const ImagePyramid previous = tracker_.buildPyramid(drive_.images[index].pixels);
    const double start_ms = threadTime_ms();
    const std::vector<TrackedPoint> tracked =
        tracker_.track(previous, tracker_.buildPyramid(drive_.images[index + 1].pixels), *found, mask_);
    tracking_ms->push_back(threadTime_ms() - start_ms);
    size_t kept = 0;
    for (size_t i = 0; i < tracked.size(); ++i) {
      if (tracked[i].status == TrackStatus::kTracked) {
        (*start)[kept] = (*start)[i];
        (*found)[kept] = tracked[i].position_px;
        ++kept;
      }
    }
    start->resize(kept);
    found->resize(kept);
  }

  Figures measure(int gap, std::vector<double>* matching_ms) {
    Figures sum;
    const int last = static_cast<int>(drive_.images.size()) - 1 - gap;
    const int count = std::min(arguments_.num_pairs, last + 1);
    for (int k = 0; k < count; ++k) {
      const int i = startOf(k, count, last);
      const ImageFeatures& first = featuresOf(static_cast<size_t>(i));
      const ImageFeatures& second = featuresOf(static_cast<size_t>(i + gap));
      MatchOptions options;
      options.max_ratio = arguments_.max_ratio;
      const double start_ms = threadTime_ms();
      const std::vector<FeatureMatch> matches =
          matchDescriptors(first.descriptors, second.descriptors, options);
      matching_ms->push_back(threadTime_ms() - start_ms);
      const EpipolarJudgement judgement = judge(first, second, matches);
      sum.add({drive_.travelled_m[i + gap] - drive_.travelled_m[i], static_cast<double>(matches.size()),
               static_cast<double>(judgement.right), judgement.median_error_rad});
    }
    sum.scale(1.0 / std::max(count, 1));
    return sum;
  }

  const ImageFeatures& featuresOf(size_t index) {
    std::optional<ImageFeatures>& features = features_[index];
    if (!features) {
      const double start_ms = threadTime_ms();
      features = extractor_->extract(drive_.images[index].pixels, mask_);
      extraction_ms_.push_back(threadTime_ms() - start_ms);
    }
    return *features;
  }

  EpipolarJudgement judge(const ImageFeatures& first, const ImageFeatures& second,
                          const std::vector<FeatureMatch>& matches) const {
    std::vector<cv::Point2f> first_px, second_px;
    for (const FeatureMatch& match : matches) {
      first_px.push_back(first.keypoints[match.first_index].position_px);
      second_px.push_back(second.keypoints[match.second_index].position_px);
    }
    return judge(first_px, second_px);
  }

  EpipolarJudgement judge(const std::vector<cv::Point2f>& first_px,
                          const std::vector<cv::Point2f>& second_px) const {
    return judgeMatches(raysOf(first_px), raysOf(second_px), kMaxError_rad, 1);
  }

  Eigen::Matrix3Xd raysOf(const std::vector<cv::Point2f>& pixels) const {
    Eigen::Matrix3Xd rays(3, static_cast<Eigen::Index>(pixels.size()));
    for (size_t i = 0; i < pixels.size(); ++i) {
      Eigen::Vector3d ray = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
      camera_.model.unproject(Eigen::Vector2d(pixels[i].x, pixels[i].y), &ray);
      rays.col(static_cast<Eigen::Index>(i)) = ray;
    }
    return rays;
  }

  const RigCamera& camera_;
  const ImageCollector& drive_;
  const Arguments& arguments_;
  const cv::Mat mask_;
  const std::unique_ptr<FeatureExtractor> extractor_;
  const PatchTracker tracker_;
  std::vector<std::optional<ImageFeatures>> features_;
  std::vector<double> extraction_ms_;
};

void measureFeatures(const Arguments& arguments) {
  cv::setNumThreads(1);
  FeatureExtractorOptions options;
  if (!arguments.options.empty()) {
    readFieldsFromFile(arguments.options, &options);
  }
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  const size_t camera_index = rig->cameraIndex(arguments.camera);
  ImageCollector drive(camera_index);
  BagDriveSourceOptions source_options;
  source_options.cameras = {arguments.camera};
  BagDriveSource(arguments.bag, rig, source_options).run(&drive, [](double) {});
  std::cout << "| features | frames | metres | right | matches | precision | error, degrees | ms per image | "
               "ms matching | "
               "right per core-ms |\n|---|---|---|---|---|---|---|---|---|---|\n";
  for (const std::string& type : arguments.types) {
    YAML::Node node;
    node["type"] = type;
    readFields(node, "--types", &options);
    Measurement measurement(rig->cameras[camera_index], drive, arguments, options);
    measurement.print(type);
    if (arguments.track) {
      measurement.printTracking();
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Measures features on a recorded drive: matches between images some frames apart, how many of them "
      "are right (within 0.2 degrees of the epipolar geometry that fits the pair best), their median error, "
      "and "
      "the CPU time of "
      "one thread; right per core-ms counts two extractions and one matching.");
  Arguments arguments;
  app.add_option("--bag", arguments.bag, "the drive")->required();
  app.add_option("--rig", arguments.rig, "rig.yaml")->required();
  app.add_option("--camera", arguments.camera, "camera of the rig")->capture_default_str();
  app.add_option("--types", arguments.types, "feature types")->capture_default_str();
  app.add_option("--options", arguments.options, "YAML with overrides of FeatureExtractorOptions");
  app.add_option("--frames", arguments.frames, "frames between the images of a pair")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--pairs", arguments.num_pairs, "pairs per distance, spread over the drive")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--max-ratio", arguments.max_ratio, "of the ratio test")->capture_default_str();
  app.add_flag("--track", arguments.track,
               "also follow each type's points by patches, frame by frame (ms per image: of one step)");
  return runTool(&app, argc, argv, [&] { measureFeatures(arguments); });
}
