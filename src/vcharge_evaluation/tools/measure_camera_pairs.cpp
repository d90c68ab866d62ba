#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "features/epipolar_judge.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_features/rectified_view.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using namespace vcharge;

constexpr double kDegree = 3.14159265358979 / 180.0;
constexpr double kMaxError_rad = 0.2 * kDegree;

struct Arguments {
  std::string bag, rig, trajectory, options;
  std::vector<std::string> cameras = {"front", "left"};
  double spacing_m = 0.5;
  double history_m = 3.0;
};

struct Frame {
  Timestamp stamp;
  double travelled_m = 0.0;
  Image image;
};

/// Images of two cameras, about every spacing_m.
class ImageCollector : public DriveConsumer {
 public:
  ImageCollector(size_t first, size_t second, double spacing_m)
      : camera_indices_{first, second}, spacing_m_(spacing_m) {}
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    auto& of_camera = frames[camera_index == camera_indices_[0] ? 0 : 1];
    if (of_camera.empty() || travelled_m_ >= of_camera.back().travelled_m + spacing_m_) {
      of_camera.push_back({stamp, travelled_m_, image});
    }
  }
  void addOdometry(const VehicleOdometry& odometry) override {
    const Eigen::Vector3d& position = odometry.odom_from_vehicle.translation();
    travelled_m_ += last_position_ ? (position - *last_position_).norm() : 0.0;
    last_position_ = position;
  }
  std::vector<Frame> frames[2];

 private:
  const size_t camera_indices_[2];
  const double spacing_m_;
  std::optional<Eigen::Vector3d> last_position_;
  double travelled_m_ = 0.0;
};

RigidTransform poseAt(const Trajectory& trajectory, Timestamp stamp, const std::string& path) {
  for (const StampedTransform& stamped : trajectory) {
    if (stamped.stamp == stamp) {
      return stamped.world_from_vehicle;
    }
  }
  throw InputError(path + ": expected a pose at each image, there is none at " + toString(stamp));
}

Eigen::Matrix3Xd raysOf(const CameraModel& camera, const ImageFeatures& features,
                        const std::vector<FeatureMatch>& matches, bool first) {
  Eigen::Matrix3Xd rays(3, static_cast<Eigen::Index>(matches.size()));
  for (size_t i = 0; i < matches.size(); ++i) {
    const cv::Point2f pixel =
        features.keypoints[first ? matches[i].first_index : matches[i].second_index].position_px;
    Eigen::Vector3d ray = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    camera.unproject(Eigen::Vector2d(pixel.x, pixel.y), &ray);
    rays.col(static_cast<Eigen::Index>(i)) = ray;
  }
  return rays;
}

/// Over all first frames: matches with the whole history, and with the frame of it that gives most.
struct Sums {
  double frames = 0.0, matches = 0.0, right = 0.0, best_right = 0.0;

  void print(const char* name) const {
    const double scale = 1.0 / std::max(frames, 1.0);
    std::printf("| %s | %.1f | %.1f | %.2f | %.1f |\n", name, right * scale, matches * scale,
                right / std::max(matches, 1.0), best_right * scale);
  }
};

void measureCameraPairs(const Arguments& arguments) {
  FeatureExtractorOptions options;
  if (!arguments.options.empty()) {
    readFieldsFromFile(arguments.options, &options);
  }
  const auto extractor = makeFeatureExtractor(options);
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  if (!rig->hasExtrinsics()) {
    throw InputError(arguments.rig + ": expected vehicle_from_camera of every camera");
  }
  const size_t indices[2] = {rig->cameraIndex(arguments.cameras.at(0)),
                             rig->cameraIndex(arguments.cameras.at(1))};
  const RigCamera* cameras[2] = {&rig->cameras[indices[0]], &rig->cameras[indices[1]]};
  const cv::Mat masks[2] = {makeFeatureMask(*cameras[0]), makeFeatureMask(*cameras[1])};
  const Trajectory trajectory = readTrajectory(arguments.trajectory);
  ImageCollector drive(indices[0], indices[1], arguments.spacing_m);
  BagDriveSourceOptions source_options;
  source_options.cameras = arguments.cameras;
  BagDriveSource(arguments.bag, rig, source_options).run(&drive, [](double) {});

  RectifiedViewCache cache(rig);
  Sums in_images, in_views;
  for (const Frame& first : drive.frames[0]) {
    const RigidTransform world_from_first = poseAt(trajectory, first.stamp, arguments.trajectory);
    const ImageFeatures first_features = extractor->extract(first.image.pixels, masks[0]);
    double best_in_images = 0.0, best_in_views = 0.0;
    for (const Frame& second : drive.frames[1]) {
      if (std::abs(first.travelled_m - second.travelled_m) > arguments.history_m) {
        continue;
      }
      const RigidTransform world_from_second = poseAt(trajectory, second.stamp, arguments.trajectory);
      const RigidTransform second_from_first =
          (world_from_second * *cameras[1]->vehicle_from_camera).inverse() *
          (world_from_first * *cameras[0]->vehicle_from_camera);
      const auto count = [&](const ImageFeatures& a, const ImageFeatures& b, Sums* sums, double* best) {
        const std::vector<FeatureMatch> matches = matchDescriptors(a.descriptors, b.descriptors);
        const double right =
            judgeMatches(raysOf(cameras[0]->model, a, matches, true),
                         raysOf(cameras[1]->model, b, matches, false), kMaxError_rad, second_from_first)
                .right;
        sums->matches += static_cast<double>(matches.size());
        sums->right += right;
        *best = std::max(*best, right);
      };
      count(first_features, extractor->extract(second.image.pixels, masks[1]), &in_images, &best_in_images);
      const double yaw_rad =
          yawOfRotation(world_from_first.rotation().conjugate() * world_from_second.rotation());
      const auto pair = cache.pair(indices[0], indices[1], yaw_rad);
      if (pair) {
        const auto inView = [&](const RectifiedView& view, const cv::Mat& image) {
          return view.toSensor(extractor->extract(view.rectify(image), view.validMask()));
        };
        count(inView(*pair->first, first.image.pixels), inView(*pair->second, second.image.pixels), &in_views,
              &best_in_views);
      }
    }
    in_images.frames += 1.0;
    in_views.frames += 1.0;
    in_images.best_right += best_in_images;
    in_views.best_right += best_in_views;
  }
  std::cout
      << "| matched in | right | matches | precision | right with the best frame |\n|---|---|---|---|---|\n"
      << std::flush;
  in_images.print("fisheye images");
  in_views.print("rectified views");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Matches each image of one camera with a second camera's local history, in the fisheye images and in "
      "views rectified on a common plane; right: within 0.2 degrees of the epipolar planes of the true "
      "poses. Prints means per image of the first camera.");
  Arguments arguments;
  app.add_option("--bag", arguments.bag, "the drive")->required();
  app.add_option("--rig", arguments.rig, "rig.yaml with vehicle_from_camera")->required();
  app.add_option("--trajectory", arguments.trajectory, "true poses at the images (TUM)")->required();
  app.add_option("--cameras", arguments.cameras, "two cameras of the rig")
      ->expected(2)
      ->capture_default_str();
  app.add_option("--options", arguments.options, "YAML with overrides of FeatureExtractorOptions");
  app.add_option("--spacing-m", arguments.spacing_m, "between frames")->capture_default_str();
  app.add_option("--history-m", arguments.history_m, "of the second camera, before and after")
      ->capture_default_str();
  return runTool(&app, argc, argv, [&] { measureCameraPairs(arguments); });
}
