#include <ctime>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core/utility.hpp>

#include "epipolar_judge.h"
#include "vcharge_core/camera_rig.h"
#include "vcharge_core/command_line.h"
#include "vcharge_core/error.h"
#include "vcharge_core/options.h"
#include "vcharge_core/progress_bar.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_ros/bag_drive_source.h"

namespace {

using namespace vcharge;

constexpr double kMaxError_rad = 0.2 * 3.14159265358979 / 180.0;

struct Arguments {
  std::string bag, rig, camera = "left", options;
  std::vector<std::string> types = {"fast_brief", "orb", "sift", "root_sift"};
  std::vector<int> frames = {1, 5, 10, 20};
  int num_pairs = 5;
  double max_ratio = 0.8;
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
      std::printf("| %s | +%d | %.1f | %.0f | %.0f | %.2f | %.3f | %.1f | %.2f | %.1f |\n", name.c_str(), gap,
                  mean.distance_m, mean.right, mean.matches, mean.right / std::max(mean.matches, 1.0),
                  mean.error_rad * 180.0 / 3.14159265358979, median(extraction_ms_), median(matching_ms),
                  mean.right / cost_ms);
      std::fflush(stdout);
    }
  }

 private:
  Figures measure(int gap, std::vector<double>* matching_ms) {
    Figures sum;
    const int last = static_cast<int>(drive_.images.size()) - 1 - gap;
    const int count = std::min(arguments_.num_pairs, last + 1);
    for (int k = 0; k < count; ++k) {
      const int i = count > 1 ? k * last / (count - 1) : last / 2;
      const ImageFeatures& first = featuresOf(static_cast<size_t>(i));
      const ImageFeatures& second = featuresOf(static_cast<size_t>(i + gap));
      MatchOptions options;
      options.max_ratio = arguments_.max_ratio;
      const double start_ms = threadTime_ms();
      const std::vector<FeatureMatch> matches =
          matchDescriptors(first.descriptors, second.descriptors, options);
      matching_ms->push_back(threadTime_ms() - start_ms);
      sum.matches += static_cast<double>(matches.size());
      const EpipolarJudgement judgement = judge(first, second, matches);
      sum.right += judgement.right;
      sum.error_rad += judgement.median_error_rad;
      sum.distance_m += drive_.travelled_m[i + gap] - drive_.travelled_m[i];
    }
    const double scale = 1.0 / std::max(count, 1);
    return {sum.distance_m * scale, sum.matches * scale, sum.right * scale, sum.error_rad * scale};
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
    const auto rayOf = [&](const Keypoint& keypoint) {
      Eigen::Vector3d ray = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
      camera_.model.unproject(Eigen::Vector2d(keypoint.position_px.x, keypoint.position_px.y), &ray);
      return ray;
    };
    Eigen::Matrix3Xd first_rays(3, static_cast<Eigen::Index>(matches.size()));
    Eigen::Matrix3Xd second_rays(3, static_cast<Eigen::Index>(matches.size()));
    for (size_t i = 0; i < matches.size(); ++i) {
      first_rays.col(static_cast<Eigen::Index>(i)) = rayOf(first.keypoints[matches[i].first_index]);
      second_rays.col(static_cast<Eigen::Index>(i)) = rayOf(second.keypoints[matches[i].second_index]);
    }
    return judgeMatches(first_rays, second_rays, kMaxError_rad, 1);
  }

  const RigCamera& camera_;
  const ImageCollector& drive_;
  const Arguments& arguments_;
  const cv::Mat mask_;
  const std::unique_ptr<FeatureExtractor> extractor_;
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
    Measurement(rig->cameras[camera_index], drive, arguments, options).print(type);
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
  return runTool(&app, argc, argv, [&] { measureFeatures(arguments); });
}
