#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_localization/drive_localizer.h"

namespace vcharge {

/// Names of the columns of localizationRow(), comma separated.
std::string localizationHeader(const CameraRig& rig);

/// A frame's result as comma separated values: time_s, status, the pose (empty if there is none), the
/// upper triangle of its covariance row by row, matches, inliers, inliers by camera, second_best_ratio,
/// fix_distance, since_fix_s, whether the whole map was searched, and the processing time.
std::string localizationRow(const LocalizationResult& result, const CameraRig& rig);

/// Readable summary: number of frames by status, statistics of the fixes, and warnings about cameras.
class LocalizationSummary {
 public:
  void add(const LocalizationResult& result);
  std::string text() const;
  int64_t numFrames() const;
  const std::map<LocalizationStatus, int64_t>& numFramesByStatus() const { return num_frames_; }
  /// For each kind of warning, the number of frames that had it, and its last text.
  std::vector<std::pair<int64_t, std::string>> warnings() const;

 private:
  std::map<LocalizationStatus, int64_t> num_frames_;
  std::vector<double> inliers_, latencies_s_;
  std::map<std::string, std::vector<double>> stage_s_;
  struct Warning {
    int64_t num_frames = 0;
    std::string last_text;
  };
  std::map<std::string, Warning> warnings_;  // indexed by the text without numbers
};

}  // namespace vcharge
