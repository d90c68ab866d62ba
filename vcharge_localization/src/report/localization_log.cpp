#include "vcharge_localization/localization_log.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace vcharge {
namespace {

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) {
    return 0.0;
  }
  const auto index = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + index, values.end());
  return values[static_cast<size_t>(index)];
}

double latencyOf(const LocalizationResult& result) {
  double sum_s = 0.0;
  for (const auto& [stage, seconds] : result.stage_s) {
    sum_s += seconds;
  }
  return sum_s;
}

/// Text of a warning without its numbers, which differ between frames.
std::string kindOf(std::string warning) {
  const auto isDigit = [](unsigned char letter) { return std::isdigit(letter) != 0; };
  warning.erase(std::remove_if(warning.begin(), warning.end(), isDigit), warning.end());
  return warning;
}

}  // namespace

std::string localizationHeader(const CameraRig& rig) {
  std::ostringstream text;
  text << "time_s,status,tx,ty,tz,qx,qy,qz,qw";
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      text << ",covariance_" << row << column;
    }
  }
  text << ",matches,inliers";
  for (const RigCamera& camera : rig.cameras) {
    text << ",inliers_" << camera.name;
  }
  text << ",second_best_ratio,fix_distance,since_fix_s,searched_whole_map,latency_s";
  return text.str();
}

std::string localizationRow(const LocalizationResult& result, const CameraRig& rig) {
  std::ostringstream text;
  text << toString(result.stamp) << ","
       << enumNames<LocalizationStatus>()[static_cast<size_t>(result.status)];
  text << std::setprecision(9);
  if (result.pose) {
    const Eigen::Vector3d& t = result.pose->map_from_vehicle.translation();
    const Eigen::Quaterniond& q = result.pose->map_from_vehicle.rotation();
    text << "," << t.x() << "," << t.y() << "," << t.z() << "," << q.x() << "," << q.y() << "," << q.z()
         << "," << q.w();
  } else {
    text << ",,,,,,,";
  }
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      text << ",";
      if (result.pose) {
        text << result.pose->covariance(row, column);
      }
    }
  }
  text << "," << result.fix.num_matches << "," << result.fix.numInliers();
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    text << "," << (i < result.fix.inliers_of_camera.size() ? result.fix.inliers_of_camera[i] : 0);
  }
  text << "," << result.fix.second_best_ratio << "," << result.fix_distance << "," << result.since_fix_s
       << "," << (result.searched_whole_map ? 1 : 0) << "," << latencyOf(result);
  return text.str();
}

void LocalizationSummary::add(const LocalizationResult& result) {
  ++num_frames_[result.status];
  if (result.status == LocalizationStatus::kLocalized) {
    inliers_.push_back(result.fix.numInliers());
  }
  latencies_s_.push_back(latencyOf(result));
  for (const auto& [stage, seconds] : result.stage_s) {
    stage_s_[stage].push_back(seconds);
  }
  for (const std::string& warning : result.camera_warnings) {
    Warning& known = warnings_[kindOf(warning)];
    ++known.num_frames;
    known.last_text = warning;
  }
}

int64_t LocalizationSummary::numFrames() const {
  return static_cast<int64_t>(latencies_s_.size());
}

std::vector<std::pair<int64_t, std::string>> LocalizationSummary::warnings() const {
  std::vector<std::pair<int64_t, std::string>> result;
  for (const auto& [kind, warning] : warnings_) {
    result.emplace_back(warning.num_frames, warning.last_text);
  }
  return result;
}

std::string LocalizationSummary::text() const {
  std::ostringstream text;
  text << "results: " << numFrames() << std::fixed << std::setprecision(1) << "\n";
  for (const auto& [status, count] : num_frames_) {
    text << "  " << enumNames<LocalizationStatus>()[static_cast<size_t>(status)] << ": " << count << " ("
         << 100.0 * static_cast<double>(count) / static_cast<double>(numFrames()) << " %)\n";
  }
  text << "inliers of a fix, 5 / 50 / 95 %: " << std::setprecision(0) << quantile(inliers_, 0.05) << " / "
       << quantile(inliers_, 0.5) << " / " << quantile(inliers_, 0.95) << "\n"
       << "time of a frame, 50 / 95 %: " << std::setprecision(1) << 1e3 * quantile(latencies_s_, 0.5) << " / "
       << 1e3 * quantile(latencies_s_, 0.95) << " ms";
  for (const auto& [stage, seconds] : stage_s_) {
    text << "; " << stage << " " << 1e3 * quantile(seconds, 0.5) << " ms";
  }
  text << "\n";
  for (const auto& [kind, warning] : warnings_) {
    text << "warning in " << warning.num_frames << " frames: " << warning.last_text << "\n";
  }
  return text.str();
}

}  // namespace vcharge
