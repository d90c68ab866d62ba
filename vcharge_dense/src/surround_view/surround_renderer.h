#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "surround_view/car_drawing.h"
#include "surround_view/exposure_balance.h"
#include "surround_view/ground_memory.h"
#include "surround_view/image_pyramid.h"
#include "surround_view/obstacle_seams.h"
#include "surround_view/seam_weights.h"

namespace vcharge {

/// Renders frames whose images and odometry have been joined. See SurroundView.
class SurroundRenderer {
 public:
  /// `is_used`: one per camera of the rig. InputError for a used camera without extrinsics, or if none sees
  /// the ground.
  SurroundRenderer(const CameraRig& rig, const SurroundViewOptions& options,
                   const std::vector<bool>& is_used);

  /// Images must be CV_8UC1 of the rig's sizes.
  void render(const ImageFrame& frame);
  void setObstacles(const ObstacleMap& map) { obstacles_ = map; }
  /// Forgets the ground and the obstacles: odometry begins anew.
  void clearMemory();

  const ViewGrid& grid() const { return grid_; }
  const cv::Mat& image() const { return image_; }
  const cv::Mat& labels() const { return labels_; }
  const std::vector<double>& gains() const { return exposure_.gains(); }
  std::array<double, 2> shading() const { return exposure_.shading(); }

 private:
  void placeObstacles(const ImageFrame& frame);
  void balanceExposure(const std::vector<bool>& has_image);
  void setScales();
  void composeRows(int begin, int end, const std::vector<bool>& has_image);

  const ViewGrid grid_;
  const ViewLayers layers_;
  ObstacleSeams seams_;
  ExposureBalance exposure_;
  GroundMemory memory_;
  const CarDrawing car_;
  std::vector<ImagePyramid> pyramids_;  // by camera
  std::vector<int> compared_pixels_;    // of the view, where exposures are compared
  std::vector<GrayPair> gray_pairs_;
  std::optional<ObstacleMap> obstacles_;
  std::vector<Eigen::Vector2d> obstacle_points_m_;  // in the vehicle frame
  /// Gray levels per unit of a sample, by camera and angle from its axis.
  std::vector<std::array<float, kAngleSteps + 1>> scales_;
  cv::Mat image_, labels_, background_;
};

}  // namespace vcharge
