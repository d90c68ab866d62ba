#include "vcharge_core/dense_maps/range_map_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>

#include <yaml-cpp/yaml.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "files/float_tiff.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

/// The stamp in a file name that consists of nothing else.
std::optional<Timestamp> stampOfName(const std::string& name) {
  int64_t nanoseconds = 0;
  const char* end = name.data() + name.size();
  const auto result = std::from_chars(name.data(), end, nanoseconds);
  if (result.ec != std::errc() || result.ptr != end || nanoseconds < 0) {
    return std::nullopt;
  }
  return Timestamp::fromNanoseconds(nanoseconds);
}

std::string stemOf(const std::string& folder, const std::string& camera_name, Timestamp stamp) {
  return (fs::path(folder) / camera_name / std::to_string(stamp.nanoseconds())).string();
}

}  // namespace

void writeRangeMap(const RangeMap& map, const std::string& folder) {
  check(map.range_m.type() == CV_32FC1 && map.standard_deviation_m.type() == CV_32FC1 &&
            map.confidence.type() == CV_32FC1 && map.standard_deviation_m.size() == map.range_m.size() &&
            map.confidence.size() == map.range_m.size(),
        "writeRangeMap: expected three CV_32FC1 images of one size");
  const std::string stem = stemOf(folder, map.camera_name, map.stamp);
  createFolder(fs::path(stem).parent_path().string());
  std::error_code ignored;
  fs::remove(stem + ".yaml", ignored);  // a partly replaced map then counts as incomplete
  writeFloatTiff(map.range_m, stem + "_range.tiff");
  writeFloatTiff(map.standard_deviation_m, stem + "_sigma.tiff");
  writeFloatTiff(map.confidence, stem + "_confidence.tiff");
  const std::string reference = stem + "_reference.png";
  fs::remove(reference, ignored);
  if (!map.reference.empty()) {
    check(map.reference.type() == CV_8UC1 && map.reference.size() == map.range_m.size(),
          "writeRangeMap: expected a CV_8UC1 reference of the ranges' size");
    if (!cv::imwrite(reference, map.reference)) {
      throw InputError(reference + ": cannot be written");
    }
  }

  ContentHasher hasher;
  addToHash(map, &hasher);
  std::string text = "stamp_ns: " + std::to_string(map.stamp.nanoseconds()) + "\ncamera: " + map.camera_name +
                     "\nframe_id: " + map.frame_id + "\ncontent_hash: " + hasher.hex() + "\nmei:\n";
  const auto names = MeiCamera::parameterNames();
  const MeiCamera::Parameters parameters = map.camera.parameters();
  for (int i = 0; i < MeiCamera::kNumParameters; ++i) {
    char line[64];
    std::snprintf(line, sizeof(line), "  %s: %.17g\n", names[i], parameters[i]);
    text += line;
  }
  writeTextFileAtomically(stem + ".yaml", text);
}

std::vector<std::string> listRangeMapCameras(const std::string& folder) {
  if (!fs::is_directory(folder)) {
    throw InputError(folder + ": expected a folder of range maps");
  }
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory() && !listRangeMaps(folder, entry.path().filename().string()).empty()) {
      names.push_back(entry.path().filename().string());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<Timestamp> listRangeMaps(const std::string& folder, const std::string& camera_name) {
  const fs::path camera_folder = fs::path(folder) / camera_name;
  if (!fs::is_directory(camera_folder)) {
    throw InputError(camera_folder.string() + ": expected a folder of range maps");
  }
  std::vector<Timestamp> stamps;
  for (const auto& entry : fs::directory_iterator(camera_folder)) {
    const std::optional<Timestamp> stamp = stampOfName(entry.path().stem().string());
    if (stamp && entry.path().extension() == ".yaml") {
      stamps.push_back(*stamp);
    }
  }
  std::sort(stamps.begin(), stamps.end());
  return stamps;
}

RangeMap readRangeMap(const std::string& folder, const std::string& camera_name, Timestamp stamp) {
  const std::string stem = stemOf(folder, camera_name, stamp);
  const YAML::Node node = loadYamlFile(stem + ".yaml");
  MeiCamera::Parameters parameters;
  const auto names = MeiCamera::parameterNames();
  std::string frame_id;
  try {
    frame_id = node["frame_id"].as<std::string>();
    for (int i = 0; i < MeiCamera::kNumParameters; ++i) {
      parameters[i] = node["mei"][names[i]].as<double>();
    }
  } catch (const YAML::Exception&) {
    throw InputError(stem + ".yaml: expected the keys frame_id and mei (" + std::to_string(names.size()) +
                     " parameters)");
  }
  RangeMap map{stamp,
               camera_name,
               frame_id,
               MeiCamera(parameters),
               readFloatTiff(stem + "_range.tiff"),
               readFloatTiff(stem + "_sigma.tiff"),
               readFloatTiff(stem + "_confidence.tiff"),
               {}};
  if (map.standard_deviation_m.size() != map.range_m.size() || map.confidence.size() != map.range_m.size()) {
    throw InputError(stem + "_{range,sigma,confidence}.tiff: expected images of one size");
  }
  const std::string reference = stem + "_reference.png";
  if (fs::exists(reference)) {
    map.reference = cv::imread(reference, cv::IMREAD_UNCHANGED);
    if (map.reference.type() != CV_8UC1 || map.reference.size() != map.range_m.size()) {
      throw InputError(reference + ": expected an 8-bit gray image of the ranges' size");
    }
  }
  return map;
}

cv::Mat colourRange(const cv::Mat& range_m, double min_range_m, double max_range_m) {
  check(range_m.type() == CV_32FC1, "colourRange: expected CV_32FC1");
  cv::Mat level(range_m.size(), CV_8UC1);
  cv::Mat unknown(range_m.size(), CV_8UC1);
  const double far = 1.0 / max_range_m;
  const double near = 1.0 / min_range_m;
  for (int y = 0; y < range_m.rows; ++y) {
    for (int x = 0; x < range_m.cols; ++x) {
      const float range = range_m.at<float>(y, x);
      const bool known = std::isfinite(range) && range > 0.0F;
      unknown.at<uint8_t>(y, x) = known ? 0 : 255;
      const double fraction = known ? (1.0 / range - far) / (near - far) : 0.0;
      // The square root spreads far ranges, which inverse range compresses.
      level.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(255.0 * std::sqrt(std::clamp(fraction, 0.0, 1.0)));
    }
  }
  cv::Mat coloured;
  cv::applyColorMap(level, coloured, cv::COLORMAP_JET);
  coloured.setTo(cv::Scalar::all(0), unknown);
  return coloured;
}

}  // namespace vcharge
