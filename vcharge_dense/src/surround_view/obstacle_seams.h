#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "surround_view/seam_weights.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Decides which camera shows obstacles, and the ground behind them, where two cameras see the ground. An
/// obstacle is projected onto everything behind it, seen from the camera. All pixels that lie on or behind
/// obstacles for either camera, and are connected, come from the one camera that sees the obstacles best. Its
/// choice is kept until the other one is clearly better.
class ObstacleSeams {
 public:
  ObstacleSeams(const ViewGrid& grid, const CameraRig& rig, const ViewLayers& layers);

  /// Replaces the obstacles: points in the vehicle frame, and the radius of the ground that each stands for.
  void update(const std::vector<Eigen::Vector2d>& obstacles_m, double radius_m,
              const std::vector<bool>& has_image);

  /// CV_8UC1, one per block of kSurroundBlock_px: index of the camera that alone shows it, or kNoCamera.
  const cv::Mat& cameras() const { return cameras_; }
  /// CV_8UC1, one per block: 255 where a camera does not see the ground, but an obstacle or what is behind
  /// it.
  const cv::Mat& isHidden() const { return is_hidden_; }

 private:
  static constexpr int kNumDirections = 1024;
  /// A block as one of its cameras sees it.
  struct Sight {
    uint8_t camera = kNoCamera;
    uint16_t direction = 0;   // index of the direction from the camera
    float distance_m = 0.0F;  // from the camera, on the ground
    float quality = 0.0F;     // inverse variance, relative to the sum of both cameras
  };
  struct Block {
    Sight first, second;
  };
  /// Distance of the nearest obstacle in each direction from a camera.
  using Horizon = std::array<float, kNumDirections>;

  bool isBehind(const Sight& sight) const {
    return sight.camera != kNoCamera && sight.distance_m > horizons_[sight.camera][sight.direction];
  }
  void addToHorizon(const Eigen::Vector2d& obstacle_m, double radius_m, size_t camera);
  void markFeet(const std::vector<Eigen::Vector2d>& obstacles_m, double radius_m);
  void chooseCameras(const std::vector<size_t>& pair, const std::vector<bool>& has_image);

  const ViewGrid grid_;
  std::vector<Eigen::Vector2d> camera_positions_m_;  // NaN for cameras that are not in use
  std::vector<Block> blocks_;                        // in row-major order
  std::vector<std::vector<size_t>> pairs_;           // blocks that two cameras see, by pair of cameras
  std::vector<Horizon> horizons_;                    // by camera
  cv::Mat cameras_, last_cameras_, is_hidden_, is_foot_, is_behind_, components_;
};

}  // namespace vcharge
