#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/frame_assembler_options.h"

namespace vcharge {

/// Keys of countersToJson(), for the help of tools.
constexpr char kFrameCounterKeys[] =
    "num_frames, num_incomplete_frames, num_missing_images (by camera), num_frames_without_odometry, "
    "num_odometry_resets, num_late_images";

/// Counts of a drive's frames for --json.
inline nlohmann::json countersToJson(const FrameCounters& counters, const CameraRig& rig) {
  nlohmann::json missing = nlohmann::json::object();
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    missing[rig.cameras[i].name] = counters.missing_images[i];
  }
  return {{"num_frames", counters.frames},
          {"num_incomplete_frames", counters.incomplete_frames},
          {"num_missing_images", missing},
          {"num_frames_without_odometry", counters.frames_without_odometry},
          {"num_odometry_resets", counters.odometry_resets},
          {"num_late_images", counters.numLateImages()}};
}

/// The same as lines of text; resets and late images only if there are any.
inline std::string describe(const FrameCounters& counters, const CameraRig& rig) {
  std::string text = "frames: " + std::to_string(counters.frames) + " (" +
                     std::to_string(counters.incomplete_frames) + " lack a camera";
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    if (counters.missing_images[i] > 0) {
      text += ", " + std::to_string(counters.missing_images[i]) + " of them " + rig.cameras[i].name;
    }
  }
  text += "; " + std::to_string(counters.frames_without_odometry) + " without odometry)\n";
  if (counters.odometry_resets > 0) {
    text += "odometer resets: " + std::to_string(counters.odometry_resets) + "\n";
  }
  if (counters.numLateImages() > 0) {
    text += "late images, not used: " + std::to_string(counters.numLateImages()) + "\n";
  }
  return text;
}

}  // namespace vcharge
