#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/rig_condition.h"
#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

struct CameraHealthOptions {
  VCHARGE_BEGIN_OPTIONS(CameraHealthOptions);
  VCHARGE_OPTION(int, min_features, 50, atLeast(0), "Features of a camera that is not dark or covered.");
  VCHARGE_OPTION(double, min_agreement, 0.5, between(0.0, 1.0), "Inlier ratio over that of the others.");
  VCHARGE_OPTION(int, frozen_after_frames, 3, atLeast(1), "Equal images of a frozen camera in motion.");
  VCHARGE_END_OPTIONS();
};

/// Finds cameras that do not contribute, and the likely reason. The number of matches that fit by chance
/// depends on scene and image size, so cameras that contradict the pose are found by comparing them with the
/// others. Not thread safe.
class CameraHealth {
 public:
  CameraHealth(std::shared_ptr<const CameraRig> rig, const CameraHealthOptions& options);

  /// From now on cameras that moved are left out.
  void setCondition(const RigCondition& condition);

  /// Returns the images of the frame without those of cameras that moved, or that repeat one image while the
  /// vehicle moves.
  std::vector<Image> usableImages(const ImageFrame& frame);
  /// Returns the features without those of cameras that moved.
  RigFeatures usableFeatures(RigFeatures features) const;

  void addFeatures(const RigFeatures& features);
  /// Adds the matches and inliers of a fix.
  void addFix(const PoseFix& fix);

  /// One line per camera that moved, is silent, frozen, blind, or contradicts the others.
  std::vector<std::string> warnings() const;

 private:
  struct Camera {
    cv::Mat sample;  // some pixels of the last image
    int equal_images = 0;
    int frames = 0, fixes = 0;
    bool is_missing = false, has_moved = false;
    double features = 0.0;  // means over the last frames
    double matches = 0.0, inliers = 0.0;
  };
  void average(double value, double* mean) const;
  std::string contradictionOf(size_t index) const;

  const std::shared_ptr<const CameraRig> rig_;
  const CameraHealthOptions options_;
  std::vector<Camera> cameras_;
  std::optional<RigidTransform> last_odom_from_vehicle_;
};

}  // namespace vcharge
