#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// How long a frame waits for missing data, and which odometry is plausible. Waiting times are measured on
/// the drive's clock: the newest stamp of all images and odometry received.
struct FrameAssemblerOptions {
  VCHARGE_BEGIN_OPTIONS(FrameAssemblerOptions);
  VCHARGE_OPTION(double, max_camera_wait_s, 0.15, notNegative(),
                 "Time after which a frame goes on without a missing camera.");
  VCHARGE_OPTION(double, max_odometry_wait_s, 2.0, notNegative(),
                 "Time after which a frame goes on without odometry.");
  VCHARGE_OPTION(int, silent_after_frames, 3, atLeast(1),
                 "Missed frames after which a camera is not waited for.");
  VCHARGE_OPTION(double, max_odometry_gap_s, 0.25, positive(),
                 "Longest period between odometry messages to interpolate over.");
  VCHARGE_OPTION(double, max_speed_m_per_s, 25.0, positive(),
                 "Speed above which the odometry counts as reset.");
  VCHARGE_OPTION(double, max_step_m, kNoLimit, positive(),
                 "Change of the distance between two odometry messages that counts as a reset.");
  VCHARGE_OPTION(double, max_step_rad, kNoLimit, positive(),
                 "Change of the turn between two odometry messages that counts as a reset.");
  VCHARGE_END_OPTIONS();

  static constexpr double kNoLimit = std::numeric_limits<double>::infinity();

  /// For bags and replays without loss: waits for everything, however late it comes.
  void waitForEverything() { max_camera_wait_s = max_odometry_wait_s = kNoLimit; }
  bool waitsForEverything() const { return max_camera_wait_s == kNoLimit; }
  /// Options with other waiting times, as defaults of a stage.
  static FrameAssemblerOptions waiting(double max_camera_wait_s, double max_odometry_wait_s);
};

/// Counts of used, missing and dropped data of a drive, reported by every stage.
struct FrameCounters {
  explicit FrameCounters(size_t num_cameras = 0)
      : missing_images(num_cameras, 0), late_images(num_cameras, 0) {}

  int64_t frames = 0;
  int64_t incomplete_frames = 0;
  int64_t frames_without_odometry = 0;
  int64_t odometry_gaps = 0;
  int64_t odometry_resets = 0;
  int64_t ignored_odometry = 0;         ///< older than the newest, at a stamp without an entry
  int64_t odometry_corrections = 0;     ///< entries replaced by a later message with their stamp
  int64_t replays = 0;                  ///< stamps jumped back: the drive started again
  std::vector<int64_t> missing_images;  ///< per camera, in the frames that were handed out
  std::vector<int64_t> late_images;     ///< per camera: repeated, or came after their frame was handed out

  int64_t numLateImages() const;
  /// Names and values of all counters of the whole rig, for diagnostics and reports.
  std::vector<std::pair<std::string, int64_t>> named() const;
};

/// Reason why the data before and after a point of the drive cannot be joined.
enum class DriveBreak {
  kOdometryGap,    ///< no odometry for longer than max_odometry_gap_s
  kOdometryReset,  ///< the odometer's pose jumped
  kReplay,         ///< stamps jumped back: a bag is replayed
};

/// Description as part of a message, for example "gap in the odometry".
std::string describe(DriveBreak drive_break);

}  // namespace vcharge
