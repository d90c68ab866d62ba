#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Where the lines of a camera's images are read out one after the other: the direction from the first line
/// to the last, in the image as it is stored.
enum class ReadoutDirection { kDown, kUp, kRight, kLeft };
template <>
inline std::vector<std::string> enumNames<ReadoutDirection>() {
  return {"down", "up", "right", "left"};
}

/// When the pixels of a camera's images are exposed. The stamp of an image is the middle of the exposure of
/// its middle line, on the camera's clock.
struct ImageTiming {
  double readout_s = 0.0;  ///< time per line times number of lines; 0: global shutter
  ReadoutDirection readout_direction = ReadoutDirection::kDown;
  double clock_offset_s = 0.0;  ///< the vehicle's clock minus the camera's

  /// Whether all pixels are exposed at the image's stamp.
  bool isInstant() const { return readout_s == 0.0 && clock_offset_s == 0.0; }
  /// The same timing with a readout time that is not negative.
  ImageTiming normalized() const;
  /// Place of a pixel's line in the readout: -0.5 at the border where it begins, 0.5 at the opposite one.
  double lineAt(const Eigen::Vector2d& position_px, cv::Size image_size_px) const;
  /// Exposure of a pixel after the image's stamp, on the vehicle's clock.
  double exposedAt(const Eigen::Vector2d& position_px, cv::Size image_size_px) const {
    return clock_offset_s + readout_s * lineAt(position_px, image_size_px);
  }
};

}  // namespace vcharge
