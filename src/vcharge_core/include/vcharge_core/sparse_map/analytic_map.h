#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// Size and seed of a synthetic map.
struct AnalyticMapOptions {
  int num_keyframes = 24;
  int num_landmarks = 300;
  int num_neighbours = 3;  ///< keyframes before and after a landmark's own from which it can be observed
  int descriptor_size = 61;
  bool float_descriptors = false;
  uint32_t seed = 1;
};

/// A sparse map in which every observation is the exact projection of its landmark, for tests and benchmarks:
/// a vehicle with a Mei camera at the front (with a mask) and a Kannala-Brandt camera on the left drives
/// counter-clockwise around a circle of 20 m radius through the origin, with a keyframe every 0.5 s. The
/// second loop edge is rejected. Landmarks without observations are left out.
inline SparseMapContents makeAnalyticMap(const AnalyticMapOptions& options = {}) {
  constexpr double kRadius_m = 20.0;
  constexpr double kTurn = 6.283185307179586;
  SparseMapContents contents;
  contents.rig = parseCameraRig(R"(cameras:
  front:
    image_size_px: [1280, 800]
    model: mei
    intrinsics: {xi: 1.15, gamma1: 895.5, gamma2: 894.7, u0: 649.6, v0: 398.7, k1: -0.33, k2: 0.0865, p1: -0.00067, p2: -0.00004}
    field_of_view_rad: 3.2289
    vehicle_from_camera: {translation_m: [3.6, 0.0, 0.6], rotation_xyzw: [0.5, -0.5, 0.5, -0.5]}
  left:
    image_size_px: [640, 480]
    model: kannala_brandt
    intrinsics: {fx: 190, fy: 191, cx: 320, cy: 240, k1: 0.01, k2: -0.002, k3: 0, k4: 0}
    vehicle_from_camera: {translation_m: [1.7, 1.0, 0.9], rotation_xyzw: [-0.70710678, 0, 0, 0.70710678]}
)",
                                "analytic map", "");
  contents.rig.cameras[0].mask = cv::Mat(800, 1280, CV_8UC1, cv::Scalar(255));
  contents.rig.cameras[0].mask.rowRange(780, 800) = cv::Scalar(0);

  for (int i = 0; i < options.num_keyframes; ++i) {
    const double angle = kTurn * i / options.num_keyframes;
    MapKeyframe keyframe;
    keyframe.stamp = Timestamp::fromNanoseconds(1342626148354042000 + int64_t{500000000} * i);
    keyframe.map_from_vehicle =
        RigidTransform::planar(kRadius_m * std::sin(angle), kRadius_m * (1.0 - std::cos(angle)), angle);
    keyframe.covariance.diagonal().setConstant(1e-6 * i);
    contents.keyframes.push_back(keyframe);
  }

  std::mt19937 generator(options.seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < options.num_landmarks; ++i) {
    const int own =
        std::min(options.num_keyframes - 1, static_cast<int>(unit(generator) * options.num_keyframes));
    const double angle = kTurn * unit(generator);
    const double distance_m = 5.0 + 10.0 * unit(generator);
    const double height_m = 3.0 * unit(generator);
    MapLandmark landmark;
    landmark.position_m =
        contents.keyframes[own].map_from_vehicle *
        Eigen::Vector3d(distance_m * std::cos(angle), distance_m * std::sin(angle), height_m);
    const double sigma_m = 0.001 * distance_m;
    landmark.covariance_m2.diagonal().setConstant(sigma_m * sigma_m);
    landmark.covariance_m2(0, 1) = landmark.covariance_m2(1, 0) = 0.3 * sigma_m * sigma_m;
    bool seen = false;
    const int first = std::max(0, own - options.num_neighbours);
    const int last = std::min(options.num_keyframes - 1, own + options.num_neighbours);
    for (int keyframe = first; keyframe <= last; ++keyframe) {
      const Eigen::Vector3d point_in_vehicle =
          contents.keyframes[keyframe].map_from_vehicle.inverse() * landmark.position_m;
      for (int camera = 0; camera < static_cast<int>(contents.rig.cameras.size()); ++camera) {
        const RigCamera& rig_camera = contents.rig.cameras[camera];
        const Eigen::Vector3d ray =
            (rig_camera.vehicle_from_camera->inverse() * point_in_vehicle).normalized();
        Eigen::Vector2d pixel;
        if (ray.z() < std::cos(0.5 * rig_camera.field_of_view_rad) ||
            !rig_camera.model.project(ray, &pixel) || pixel.x() < 0.0 ||
            pixel.x() > rig_camera.image_size_px.width - 1 || pixel.y() < 0.0 ||
            pixel.y() > rig_camera.image_size_px.height - 1) {
          continue;
        }
        seen = true;
        contents.observations.push_back(
            {keyframe, camera, static_cast<int32_t>(contents.landmarks.size()), pixel.cast<float>()});
      }
    }
    if (seen) {
      contents.landmarks.push_back(landmark);
    }
  }

  contents.descriptors.create(static_cast<int>(contents.observations.size()), options.descriptor_size,
                              options.float_descriptors ? CV_32FC1 : CV_8UC1);
  cv::RNG random(options.seed);
  random.fill(contents.descriptors, cv::RNG::UNIFORM, 0, 255);

  const int last = options.num_keyframes - 1;
  if (last > 0) {
    const RigidTransform measured = contents.keyframes[0].map_from_vehicle.inverse() *
                                    contents.keyframes[static_cast<size_t>(last)].map_from_vehicle;
    contents.loop_edges.push_back({0, last, measured, 57, true, ""});
    contents.loop_edges.push_back(
        {0, last / 2, RigidTransform::planar(1.0, 2.0, 3.0), 11, false, "outlier of the pose graph"});
  }
  contents.feature_options = "detector: analytic\n";
  contents.odometry_distance_scale = 1.0125;
  contents.odometry_turn_scale = 0.9921875;
  return contents;
}

}  // namespace vcharge
