#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_localization/frame_assembler.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

struct CameraHealthOptions {
  int min_features = 50;        ///< fewer on average: dark, blinded or covered
  double min_agreement = 0.5;   ///< share of its matches that fit the pose, over that of all other cameras
  double min_found = 0.1;       ///< share of its features that fit the map and pose, over that of all others
  double memory_frames = 12.0;  ///< of the averages
  int frozen_after_frames = 3;  ///< equal images in a row while the odometer moves

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("min_features", min_features);
    visit("min_agreement", min_agreement);
    visit("min_found", min_found);
    visit("memory_frames", memory_frames);
    visit("frozen_after_frames", frozen_after_frames);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Says which cameras do not contribute, and why that may be. What fits a pose by chance differs from place
/// to place and with the images' size, so a camera that contradicts the pose is told by comparing it with the
/// others. Not thread safe.
class CameraHealth {
 public:
  CameraHealth(std::shared_ptr<const CameraRig> rig, const CameraHealthOptions& options);

  /// The frame without the images of cameras that send the same one again and again while the vehicle moves.
  std::vector<Image> withoutFrozen(const LocalizationFrame& frame);

  void addFeatures(const RigFeatures& features);
  /// Matches and inliers of a fix.
  void addFix(const PoseFix& fix);

  /// One line per camera that is silent, frozen, blind, or contradicts the others; empty for good ones.
  std::vector<std::string> warnings() const;

 private:
  struct Camera {
    cv::Mat sample;  // a part of the last image's pixels
    int equal_images = 0;
    int frames = 0, fixes = 0;
    bool is_missing = false;
    double features = 0.0;  // averages
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
