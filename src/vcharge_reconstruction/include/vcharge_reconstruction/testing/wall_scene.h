#pragma once

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include <opencv2/imgproc.hpp>

#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/reconstruction_data.h"
#include "vcharge_reconstruction/testing/test_camera.h"

namespace vcharge::testing {

inline constexpr double kWall_m = 6.0;  // ahead of the vehicle
inline constexpr double kMetresPerTexel = 0.01;
inline constexpr int kKeyframes = 3;

inline RigCamera makeWallCamera(const std::string& name, double yaw_rad, double side_m) {
  return makeFisheyeCamera(name, 250.0, makeExtrinsics(yaw_rad, 0.0, 0.0, {0.0, side_m, 1.0}));
}

/// A vehicle that approaches a wall, cameras that look half to the left and half to the right, and landmarks
/// on the wall with observations of the left camera only.
struct WallScene {
  ReconstructionData data;
  KeyframeImages images = KeyframeImages::ofAllKeyframes();
  cv::Mat texture;

  WallScene() : texture(1600, 3200, CV_8UC1) {
    auto rig = std::make_shared<CameraRig>();
    rig->cameras = {makeWallCamera("left", 0.7, 0.4), makeWallCamera("right", -0.7, -0.4)};
    data.rig = rig;
    cv::RNG random(4);
    random.fill(texture, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture, texture, cv::Size(), 4.0);
    cv::normalize(texture, texture, 20, 235, cv::NORM_MINMAX);
    for (int32_t k = 0; k < kKeyframes; ++k) {
      Keyframe keyframe;
      keyframe.map_from_vehicle = RigidTransform::planar(0.5 * k, 0.0, 0.02 * k);
      keyframe.travelled_m = 0.5 * k;
      data.keyframes.push_back(keyframe);
      std::vector<Image> views;
      for (size_t camera = 0; camera < 2; ++camera) {
        views.push_back(render(k, camera));
      }
      images.add(k, views);
    }
    std::mt19937 generator(2);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int i = 0; i < 300; ++i) {
      const double side = 4.0 * uniform(generator), up = 1.0 + 1.5 * uniform(generator);
      Track track;
      track.position_m = Eigen::Vector3d(kWall_m, side, up);
      Eigen::Vector2d pixel;
      if (see(*track.position_m, 0, 0, &pixel)) {
        track.observations.push_back({0, 0, -1, pixel, 0.3});
        data.tracks.push_back(track);
      }
    }
  }

  bool see(const Eigen::Vector3d& point, int32_t keyframe, size_t camera, Eigen::Vector2d* pixel) const {
    const RigCamera& rig_camera = data.rig->cameras[camera];
    const Eigen::Vector3d in_camera =
        (data.keyframes[keyframe].map_from_vehicle * *rig_camera.vehicle_from_camera).inverse() * point;
    return in_camera.z() > 0.1 * in_camera.norm() && rig_camera.model.project(in_camera, pixel) &&
           pixel->x() > 0.0 && pixel->y() > 0.0 && pixel->x() < 639.0 && pixel->y() < 399.0;
  }

  Image render(int32_t keyframe, size_t camera) const {
    const RigCamera& rig_camera = data.rig->cameras[camera];
    const RigidTransform map_from_camera =
        data.keyframes[keyframe].map_from_vehicle * *rig_camera.vehicle_from_camera;
    cv::Mat texel(rig_camera.image_size_px, CV_32FC2, cv::Scalar(-1.0, -1.0));
    for (int row = 0; row < texel.rows; ++row) {
      for (int column = 0; column < texel.cols; ++column) {
        Eigen::Vector3d ray;
        if (rig_camera.model.unproject(Eigen::Vector2d(column, row), &ray)) {
          const Eigen::Vector3d direction = map_from_camera.rotation() * ray;
          if (direction.x() > 0.05) {
            const Eigen::Vector3d hit =
                map_from_camera.translation() +
                (kWall_m - map_from_camera.translation().x()) / direction.x() * direction;
            texel.at<cv::Vec2f>(row, column) =
                cv::Vec2f(static_cast<float>(hit.y() / kMetresPerTexel + 1600.0),
                          static_cast<float>(hit.z() / kMetresPerTexel + 700.0));
          }
        }
      }
    }
    Image image;
    cv::remap(texture, image.pixels, texel, cv::Mat(), cv::INTER_LINEAR);
    return image;
  }
};

}  // namespace vcharge::testing
