#include "vcharge_core/dense_maps/obstacle_map_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <sstream>

#include <yaml-cpp/yaml.h>
#include <opencv2/imgcodecs.hpp>

#include "files/float_tiff.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

constexpr uint8_t kGrayOccupied = 0;
constexpr uint8_t kGrayFree = 254;
constexpr uint8_t kGrayUnobserved = 205;
constexpr const char* kScanHeader =
    "name,origin_x_m,origin_y_m,max_range_m,angle_rad,range_m,free_m,range_sigma_m,height_m,height_sigma_m";
constexpr size_t kScanColumns = 10;

std::string stemOf(const std::string& folder, Timestamp stamp) {
  return (fs::path(folder) / std::to_string(stamp.nanoseconds())).string();
}

std::vector<std::pair<std::string, const cv::Mat*>> namedLayers(const ObstacleMap& map) {
  return {{"point_sigma", &map.point_sigma_m},
          {"height", &map.height_m},
          {"height_sigma", &map.height_sigma_m},
          {"age", &map.age_s}};
}

cv::Mat toGray(const cv::Mat& state) {
  cv::Mat gray(state.size(), CV_8UC1);
  for (int y = 0; y < state.rows; ++y) {
    for (int x = 0; x < state.cols; ++x) {
      const int8_t cell = state.at<int8_t>(y, x);
      gray.at<uint8_t>(state.rows - 1 - y, x) = cell == kCellOccupied ? kGrayOccupied
                                                : cell == kCellFree   ? kGrayFree
                                                                      : kGrayUnobserved;
    }
  }
  return gray;
}

cv::Mat fromGray(const cv::Mat& gray, const std::string& path) {
  cv::Mat state(gray.size(), CV_8SC1);
  for (int y = 0; y < gray.rows; ++y) {
    for (int x = 0; x < gray.cols; ++x) {
      const uint8_t value = gray.at<uint8_t>(gray.rows - 1 - y, x);
      if (value != kGrayOccupied && value != kGrayFree && value != kGrayUnobserved) {
        throw InputError(path + ": expected the gray levels 0, 205 and 254, got " + std::to_string(value));
      }
      state.at<int8_t>(y, x) = value == kGrayOccupied ? kCellOccupied
                               : value == kGrayFree   ? kCellFree
                                                      : kCellUnobserved;
    }
  }
  return state;
}

void writePgm(const cv::Mat& state, const std::string& path) {
  writeFileAtomically(path, [&](const std::string& temporary) {
    if (!cv::imwrite(temporary, toGray(state))) {
      throw InputError(path + ": cannot be written");
    }
  });
}

void emitSequence(YAML::Emitter* yaml, const char* key, const std::vector<double>& values) {
  *yaml << YAML::Key << key << YAML::Value << YAML::Flow << values;
}

std::string describeMap(const ObstacleMap& map, const std::string& image) {
  const Eigen::Vector3d translation = map.fixed_from_vehicle.translation();
  const Eigen::Quaterniond rotation = map.fixed_from_vehicle.rotation();
  YAML::Emitter yaml;
  yaml.SetDoublePrecision(17);
  yaml << YAML::BeginMap << YAML::Key << "image" << YAML::Value << image;
  yaml << YAML::Key << "resolution" << YAML::Value << map.cell_size_m;
  emitSequence(&yaml, "origin", {map.origin_m.x(), map.origin_m.y(), 0.0});
  yaml << YAML::Key << "negate" << YAML::Value << 0;
  yaml << YAML::Key << "occupied_thresh" << YAML::Value << 0.65;
  yaml << YAML::Key << "free_thresh" << YAML::Value << 0.196;
  yaml << YAML::Key << "stamp_ns" << YAML::Value << map.stamp.nanoseconds();
  yaml << YAML::Key << "frame_id" << YAML::Value << map.frame_id;
  emitSequence(&yaml, "fixed_from_vehicle_translation_m",
               {translation.x(), translation.y(), translation.z()});
  emitSequence(&yaml, "fixed_from_vehicle_rotation_xyzw",
               {rotation.x(), rotation.y(), rotation.z(), rotation.w()});
  yaml << YAML::EndMap;
  return std::string(yaml.c_str()) + "\n";
}

std::string formatScans(const std::vector<ObstacleScan>& scans) {
  std::ostringstream text;
  text.precision(9);
  text << kScanHeader << "\n";
  for (const ObstacleScan& scan : scans) {
    for (size_t i = 0; i < scan.size(); ++i) {
      text << scan.name << "," << scan.origin_m.x() << "," << scan.origin_m.y() << "," << scan.max_range_m
           << "," << scan.angle_rad(i) << "," << scan.range_m[i] << "," << scan.free_m[i] << ","
           << scan.range_sigma_m[i] << "," << scan.height_m[i] << "," << scan.height_sigma_m[i] << "\n";
    }
  }
  return text.str();
}

/// One line of the file of scans: the name, then numbers.
struct ScanLine {
  std::string name;
  std::array<double, kScanColumns - 1> numbers{};
};

ScanLine parseScanLine(const std::string& line, const std::string& where) {
  std::istringstream stream(line);
  ScanLine parsed;
  std::getline(stream, parsed.name, ',');
  for (double& number : parsed.numbers) {
    std::string field;
    char* end = nullptr;
    if (!std::getline(stream, field, ',') ||
        (number = std::strtod(field.c_str(), &end), end == field.c_str() || *end != '\0')) {
      throw InputError(where + ": expected " + std::to_string(kScanColumns) + " fields (" + kScanHeader +
                       ")");
    }
  }
  return parsed;
}

void finishScan(ObstacleScan* scan, const std::vector<double>& angles_rad) {
  scan->angle_min_rad = angles_rad.front();
  scan->angle_increment_rad = angles_rad.size() < 2 ? 2.0 * M_PI
                                                    : (angles_rad.back() - angles_rad.front()) /
                                                          static_cast<double>(angles_rad.size() - 1);
}

}  // namespace

void writeOccupancyGrid(const ObstacleMap& map, const std::string& path_stem) {
  writePgm(map.state, path_stem + ".pgm");
  writeTextFileAtomically(path_stem + ".yaml",
                          describeMap(map, fs::path(path_stem).filename().string() + ".pgm"));
}

void writeObstacles(const ObstacleMap& map, const std::vector<ObstacleScan>& scans,
                    const std::string& folder) {
  const std::string stem = stemOf(folder, map.stamp);
  createFolder(folder);
  std::error_code ignored;
  fs::remove(stem + ".yaml", ignored);  // a partly replaced stamp then counts as incomplete
  std::vector<cv::Mat> coordinates;
  cv::split(map.point_m, coordinates);
  writeFloatTiff(coordinates[0], stem + "_x.tiff");
  writeFloatTiff(coordinates[1], stem + "_y.tiff");
  for (const auto& [name, image] : namedLayers(map)) {
    writeFloatTiff(*image, stem + "_" + name + ".tiff");
  }
  writeTextFileAtomically(stem + "_scans.csv", formatScans(scans));
  writeOccupancyGrid(map, stem);
}

std::vector<Timestamp> listObstacles(const std::string& folder) {
  if (!fs::is_directory(folder)) {
    throw InputError(folder + ": expected a folder of obstacle maps");
  }
  std::vector<Timestamp> stamps;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string stem = entry.path().stem().string();
    if (entry.path().extension() == ".yaml" && !stem.empty() &&
        stem.find_first_not_of("0123456789") == std::string::npos && stem.size() <= 19) {
      stamps.push_back(Timestamp::fromNanoseconds(std::stoll(stem)));
    }
  }
  std::sort(stamps.begin(), stamps.end());
  return stamps;
}

ObstacleMap readObstacleMap(const std::string& folder, Timestamp stamp) {
  const std::string stem = stemOf(folder, stamp);
  const YAML::Node node = loadYamlFile(stem + ".yaml");
  ObstacleMap map;
  try {
    const auto origin = node["origin"].as<std::vector<double>>();
    const auto translation = node["fixed_from_vehicle_translation_m"].as<std::vector<double>>();
    const auto rotation = node["fixed_from_vehicle_rotation_xyzw"].as<std::vector<double>>();
    map.stamp = Timestamp::fromNanoseconds(node["stamp_ns"].as<int64_t>());
    map.frame_id = node["frame_id"].as<std::string>();
    map.cell_size_m = node["resolution"].as<double>();
    map.origin_m = Eigen::Vector2d(origin.at(0), origin.at(1));
    map.fixed_from_vehicle =
        RigidTransform(Eigen::Quaterniond(rotation.at(3), rotation.at(0), rotation.at(1), rotation.at(2)),
                       Eigen::Vector3d(translation.at(0), translation.at(1), translation.at(2)));
  } catch (const std::exception&) {  // from yaml-cpp, at() or RigidTransform
    throw InputError(stem + ".yaml: expected stamp_ns, frame_id, resolution, origin and the pose");
  }
  const cv::Mat gray =
      fs::is_regular_file(stem + ".pgm") ? cv::imread(stem + ".pgm", cv::IMREAD_UNCHANGED) : cv::Mat();
  if (gray.empty() || gray.type() != CV_8UC1) {
    throw InputError(stem + ".pgm: expected a gray image");
  }
  map.state = fromGray(gray, stem + ".pgm");
  std::vector<cv::Mat> coordinates = {readFloatTiff(stem + "_x.tiff"), readFloatTiff(stem + "_y.tiff")};
  map.point_sigma_m = readFloatTiff(stem + "_point_sigma.tiff");
  map.height_m = readFloatTiff(stem + "_height.tiff");
  map.height_sigma_m = readFloatTiff(stem + "_height_sigma.tiff");
  map.age_s = readFloatTiff(stem + "_age.tiff");
  for (const cv::Mat* image : {&coordinates[0], &coordinates[1], &map.point_sigma_m, &map.height_m,
                               &map.height_sigma_m, &map.age_s}) {
    if (image->size() != map.state.size()) {
      throw InputError(stem + "_*.tiff: expected images of the size of " + stem + ".pgm");
    }
  }
  cv::merge(coordinates, map.point_m);
  return map;
}

std::vector<ObstacleScan> readObstacleScans(const std::string& folder, Timestamp stamp) {
  const std::string path = stemOf(folder, stamp) + "_scans.csv";
  std::istringstream lines(readTextFile(path));
  std::string line;
  if (!std::getline(lines, line) || line != kScanHeader) {
    throw InputError(path + ": expected the header " + kScanHeader);
  }
  std::vector<ObstacleScan> scans;
  std::vector<double> angles_rad;
  for (size_t number = 2; std::getline(lines, line); ++number) {
    const ScanLine parsed = parseScanLine(line, path + ":" + std::to_string(number));
    const auto& [x, y, max_range, angle, range, free, sigma, height, height_sigma] = parsed.numbers;
    if (scans.empty() || scans.back().name != parsed.name) {
      if (!scans.empty()) {
        finishScan(&scans.back(), angles_rad);
      }
      scans.emplace_back();
      scans.back().stamp = stamp;
      scans.back().name = parsed.name;
      scans.back().origin_m = Eigen::Vector2d(x, y);
      scans.back().max_range_m = max_range;
      angles_rad.clear();
    }
    ObstacleScan& scan = scans.back();
    angles_rad.push_back(angle);
    scan.range_m.push_back(static_cast<float>(range));
    scan.free_m.push_back(static_cast<float>(free));
    scan.range_sigma_m.push_back(static_cast<float>(sigma));
    scan.height_m.push_back(static_cast<float>(height));
    scan.height_sigma_m.push_back(static_cast<float>(height_sigma));
  }
  if (!scans.empty()) {
    finishScan(&scans.back(), angles_rad);
  }
  return scans;
}

}  // namespace vcharge
