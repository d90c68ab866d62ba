#include "vcharge_reconstruction/testing/test_map.h"

#include <cmath>
#include <random>
#include <vector>

#include "vcharge_core/sparse_map/analytic_map.h"

namespace vcharge::testing {
namespace {

constexpr int kDescriptorBytes = 32;
constexpr int kFlippedBits = 8;

cv::Mat randomDescriptors(int count, std::mt19937* random) {
  cv::Mat descriptors(count, kDescriptorBytes, CV_8UC1);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int row = 0; row < count; ++row) {
    for (int column = 0; column < kDescriptorBytes; ++column) {
      descriptors.at<uchar>(row, column) = static_cast<uchar>(byte(*random));
    }
  }
  return descriptors;
}

/// Descriptor of the landmark's first observation.
cv::Mat descriptorOf(const SparseMap& map, size_t landmark) {
  return map.descriptors().row(*map.observationsOfLandmark(landmark).first);
}

void addTwin(double offset_m, SparseMapContents* contents) {
  const size_t num_keyframes = contents->keyframes.size();
  const size_t num_landmarks = contents->landmarks.size();
  const size_t num_observations = contents->observations.size();
  const Duration later =
      contents->keyframes.back().stamp - contents->keyframes.front().stamp + durationFromSeconds(1.0);
  const RigidTransform moved = RigidTransform::planar(offset_m, 0.0, 0.0);
  for (size_t i = 0; i < num_keyframes; ++i) {
    MapKeyframe keyframe = contents->keyframes[i];
    keyframe.stamp = keyframe.stamp + later;
    keyframe.map_from_vehicle = moved * keyframe.map_from_vehicle;
    contents->keyframes.push_back(keyframe);
  }
  for (size_t i = 0; i < num_landmarks; ++i) {
    MapLandmark landmark = contents->landmarks[i];
    landmark.position_m = moved * landmark.position_m;
    contents->landmarks.push_back(landmark);
  }
  for (size_t i = 0; i < num_observations; ++i) {
    MapObservation observation = contents->observations[i];
    observation.keyframe += static_cast<int32_t>(num_keyframes);
    observation.landmark += static_cast<int32_t>(num_landmarks);
    contents->observations.push_back(observation);
  }
  cv::vconcat(contents->descriptors, contents->descriptors.clone(), contents->descriptors);
}

}  // namespace

std::shared_ptr<const SparseMap> makeTestMap(const TestMapOptions& options) {
  AnalyticMapOptions analytic;
  analytic.num_keyframes = options.num_keyframes;
  analytic.num_landmarks = options.num_landmarks;
  analytic.descriptor_size = kDescriptorBytes;
  analytic.seed = options.seed;
  SparseMapContents contents = makeAnalyticMap(analytic);
  contents.loop_edges.clear();
  contents.feature_options = "type: fast_brief\n";
  std::mt19937 random(options.seed);
  const cv::Mat of_landmarks = randomDescriptors(static_cast<int>(contents.landmarks.size()), &random);
  for (size_t i = 0; i < contents.observations.size(); ++i) {
    of_landmarks.row(contents.observations[i].landmark).copyTo(contents.descriptors.row(static_cast<int>(i)));
  }
  if (options.twin_offset_m != 0.0) {
    addTwin(options.twin_offset_m, &contents);
  }
  return std::make_shared<const SparseMap>(std::move(contents));
}

RigFeatures makeTestView(const SparseMap& map, const RigidTransform& map_from_vehicle,
                         const TestViewOptions& options) {
  std::mt19937 random(options.seed);
  std::normal_distribution<double> noise(0.0, options.noise_px);
  std::uniform_real_distribution<double> ratio(0.0, 1.0);
  std::uniform_int_distribution<int> bit(0, 8 * kDescriptorBytes - 1);
  std::uniform_int_distribution<size_t> any_landmark(0, map.landmarks().size() - 1);
  RigFeatures features;
  for (size_t camera = 0; camera < map.rig().cameras.size(); ++camera) {
    const RigCamera& rig_camera = map.rig().cameras[camera];
    const RigidTransform camera_from_map = (map_from_vehicle * *rig_camera.vehicle_from_camera).inverse();
    ImageFeatures image;
    std::vector<Eigen::Vector3d> rays;
    for (size_t i = 0; i < map.landmarks().size(); ++i) {
      const Eigen::Vector3d point = camera_from_map * map.landmarks()[i].position_m;
      Eigen::Vector2d pixel;
      if (point.norm() > options.max_range_m || point.z() < 0.1 * point.norm() ||
          !rig_camera.model.project(point, &pixel) || pixel.x() < 5.0 || pixel.y() < 5.0 ||
          pixel.x() > rig_camera.image_size_px.width - 6 || pixel.y() > rig_camera.image_size_px.height - 6) {
        continue;
      }
      pixel.x() += noise(random);
      pixel.y() += noise(random);
      Eigen::Vector3d ray;
      if (!rig_camera.model.unproject(pixel, &ray)) {
        continue;
      }
      const bool is_wrong = ratio(random) < options.wrong_ratio;
      cv::Mat descriptor = descriptorOf(map, is_wrong ? any_landmark(random) : i).clone();
      for (int k = 0; k < kFlippedBits; ++k) {
        const int flipped = bit(random);
        descriptor.at<uchar>(0, flipped / 8) ^= static_cast<uchar>(1 << (flipped % 8));
      }
      Keypoint keypoint;
      keypoint.position_px = cv::Point2f(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
      image.keypoints.push_back(keypoint);
      image.descriptors.push_back(descriptor);
      rays.push_back(ray);
    }
    if (static_cast<int>(camera) == options.camera_without_image) {
      image = ImageFeatures();
      rays.clear();
    }
    Eigen::Matrix3Xd ray_matrix(3, static_cast<Eigen::Index>(rays.size()));
    for (size_t i = 0; i < rays.size(); ++i) {
      ray_matrix.col(static_cast<Eigen::Index>(i)) = rays[i];
    }
    features.images.push_back(image);
    features.rays_in_camera.push_back(ray_matrix);
  }
  return features;
}

cv::Mat descriptorsAsNumbers(const cv::Mat& descriptors, float one) {
  constexpr int kNumbers = 128;
  cv::Mat numbers(descriptors.rows, kNumbers, CV_32FC1);
  for (int row = 0; row < descriptors.rows; ++row) {
    for (int i = 0; i < kNumbers; ++i) {
      numbers.at<float>(row, i) = ((descriptors.at<uchar>(row, i / 8) >> (i % 8)) & 1) != 0 ? one : 0.0F;
    }
  }
  return numbers;
}

RigFeatures makeForeignView(const SparseMap& map, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> ratio(0.2, 0.8);
  RigFeatures features;
  for (const RigCamera& camera : map.rig().cameras) {
    ImageFeatures image;
    image.descriptors = randomDescriptors(500, &random);
    Eigen::Matrix3Xd rays(3, 500);
    for (int i = 0; i < 500; ++i) {
      const double x = ratio(random) * camera.image_size_px.width;
      const double y = ratio(random) * camera.image_size_px.height;
      Eigen::Vector3d ray = Eigen::Vector3d::UnitZ();
      camera.model.unproject(Eigen::Vector2d(x, y), &ray);
      rays.col(i) = ray;
      Keypoint keypoint;
      keypoint.position_px = cv::Point2f(static_cast<float>(x), static_cast<float>(y));
      image.keypoints.push_back(keypoint);
    }
    features.images.push_back(image);
    features.rays_in_camera.push_back(rays);
  }
  return features;
}

}  // namespace vcharge::testing
