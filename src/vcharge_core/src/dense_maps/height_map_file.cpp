#include "vcharge_core/dense_maps/height_map_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <vector>

#include <yaml-cpp/yaml.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

constexpr uint8_t kFree = 254, kOccupied = 0, kUnknown = 205;  // values of map_server's trinary images
constexpr const char* kFloats = "a TIFF of 32-bit floats";

/// An optional image of a map beside its heights.
struct Layer {
  cv::Mat HeightMap::*image;
  const char *key, *ending;
  int type;
  const char* expected;
};
constexpr std::array<Layer, 3> kLayers{
    {{&HeightMap::confidence, "confidence_file", "_confidence.tiff", CV_32FC1, kFloats},
     {&HeightMap::gray, "gray_file", "_gray.png", CV_8UC1, "a gray image"},
     {&HeightMap::solid, "solid_file", "_solid.png", CV_8UC1, "a gray image"}}};

void writeImage(const cv::Mat& image, const std::string& path) {
  writeFileAtomically(path, [&](const std::string& temporary) {
    bool written = false;
    try {
      written = cv::imwrite(temporary, image);
    } catch (const cv::Exception&) {
      written = false;
    }
    // OpenCV may not report a full disk.
    if (!written || cv::imread(temporary, cv::IMREAD_UNCHANGED).size() != image.size()) {
      throw InputError(path + ": cannot be written (is the disk full?)");
    }
  });
}

cv::Mat readImage(const std::string& path, int type, cv::Size size, const char* what) {
  cv::Mat image = fs::is_regular_file(path) ? cv::imread(path, cv::IMREAD_UNCHANGED) : cv::Mat();
  if (image.empty() || image.type() != type || image.size() != size) {
    throw InputError(path + ": expected " + what + " of " + std::to_string(size.width) + " x " +
                     std::to_string(size.height) + " cells");
  }
  return image;
}

template <class T>
T required(const YAML::Node& node, const std::string& path, const char* key, const char* expected) {
  try {
    return node[key].as<T>();
  } catch (const YAML::Exception&) {
    throw InputError(path + ": " + key + ": expected " + expected);
  }
}

std::string nameOf(const std::string& path) {
  return fs::path(path).filename().string();
}

}  // namespace

void writeHeightMap(const HeightMap& map, const std::string& path_stem) {
  check(map.height_m.type() == CV_32FC1 && !map.height_m.empty(), "writeHeightMap: expected CV_32FC1");
  std::error_code ignored;
  fs::remove(path_stem + ".yaml", ignored);  // a partly replaced map then counts as incomplete
  writeImage(map.height_m, path_stem + ".tiff");
  std::string files = "file: " + nameOf(path_stem) + ".tiff\n";
  for (const Layer& layer : kLayers) {
    if (const cv::Mat& image = map.*layer.image; !image.empty()) {
      writeImage(image, path_stem + layer.ending);
      files += std::string(layer.key) + ": " + nameOf(path_stem) + layer.ending + "\n";
    }
  }
  ContentHasher hasher;
  addToHash(map, &hasher);
  std::array<char, 256> grid{};
  std::snprintf(grid.data(), grid.size(),
                "# centre of the cell in column 0, row 0; columns along x, rows along y\n"
                "origin_m: [%.17g, %.17g]\ncell_size_m: %.17g\nsize_cells: [%d, %d]\n",
                map.origin_m.x(), map.origin_m.y(), map.cell_size_m, map.height_m.cols, map.height_m.rows);
  writeTextFileAtomically(path_stem + ".yaml", files + "frame: " + map.frame_id + "\n" + grid.data() +
                                                   "content_hash: " + hasher.hex() + "\n");
}

HeightMap readHeightMap(const std::string& given_path) {
  const std::string path = fs::is_directory(given_path) ? given_path + "/height_map.yaml" : given_path;
  const YAML::Node node = loadYamlFile(path);
  if (!node.IsMap()) {
    throw InputError(path +
                     ": expected a height map's YAML (file, frame, origin_m, cell_size_m, size_cells)");
  }
  const auto origin = required<std::vector<double>>(node, path, "origin_m", "two numbers, in metres");
  const auto size = required<std::vector<int>>(node, path, "size_cells", "two numbers of cells");
  HeightMap map;
  map.frame_id = required<std::string>(node, path, "frame", "the name of a frame");
  map.cell_size_m = required<double>(node, path, "cell_size_m", "a positive number of metres");
  if (origin.size() != 2 || !std::isfinite(origin[0]) || !std::isfinite(origin[1])) {
    throw InputError(path + ": origin_m: expected two finite numbers");
  }
  if (size.size() != 2 || size[0] <= 0 || size[1] <= 0) {
    throw InputError(path + ": size_cells: expected two positive numbers");
  }
  if (!std::isfinite(map.cell_size_m) || map.cell_size_m <= 0.0) {
    throw InputError(path + ": cell_size_m: expected a positive number of metres");
  }
  map.origin_m = {origin[0], origin[1]};
  const std::string folder = fs::path(path).parent_path().string();
  const auto fileOf = [&](const char* key) {
    return (fs::path(folder) / required<std::string>(node, path, key, "the name of a file")).string();
  };
  const cv::Size cells(size[0], size[1]);
  map.height_m = readImage(fileOf("file"), CV_32FC1, cells, kFloats);
  for (const Layer& layer : kLayers) {
    if (node[layer.key]) {
      map.*layer.image = readImage(fileOf(layer.key), layer.type, cells, layer.expected);
    }
  }
  return map;
}

void writeOccupancyMap(const HeightMap& map, const cv::Mat& states, const std::string& path_stem) {
  check(states.type() == CV_8UC1 && states.size() == map.height_m.size(),
        "writeOccupancyMap: expected a CV_8UC1 state for each cell");
  cv::Mat picture(states.size(), CV_8UC1);
  for (int row = 0; row < states.rows; ++row) {
    for (int column = 0; column < states.cols; ++column) {
      const auto state = static_cast<CellState>(states.at<uint8_t>(row, column));
      picture.at<uint8_t>(states.rows - 1 - row, column) = state == CellState::kDrivable   ? kFree
                                                           : state == CellState::kObstacle ? kOccupied
                                                                                           : kUnknown;
    }
  }
  writeImage(picture, path_stem + ".pgm");
  const Eigen::Vector2d corner_m = map.origin_m - Eigen::Vector2d::Constant(0.5 * map.cell_size_m);
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(),
                "resolution: %.17g\norigin: [%.17g, %.17g, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n"
                "free_thresh: 0.196\n",
                map.cell_size_m, corner_m.x(), corner_m.y());
  writeTextFileAtomically(path_stem + ".yaml", "image: " + nameOf(path_stem) + ".pgm\n" + text.data());
}

void writeHeightMapMesh(const HeightMap& map, const std::string& path) {
  const int columns = map.height_m.cols, rows = map.height_m.rows;
  std::vector<int32_t> vertex_of(map.height_m.total(), -1);
  std::string vertices, faces;
  const auto append = [](std::string* bytes, const auto& value) {
    bytes->append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  int32_t num_vertices = 0, num_faces = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const float height = map.height_m.at<float>(row, column);
      if (!std::isfinite(height)) {
        continue;
      }
      const Eigen::Vector2f centre = map.centreOf(column, row).cast<float>();
      append(&vertices, centre.x());
      append(&vertices, centre.y());
      append(&vertices, height);
      const char gray = map.gray.empty() ? static_cast<char>(255) : map.gray.at<char>(row, column);
      vertices.append(3, gray);
      vertex_of[static_cast<size_t>(row) * columns + column] = num_vertices++;
    }
  }
  const auto addTriangle = [&](int32_t a, int32_t b, int32_t c) {
    append(&faces, uint8_t{3});
    append(&faces, a);
    append(&faces, b);
    append(&faces, c);
    ++num_faces;
  };
  for (int row = 0; row + 1 < rows; ++row) {
    for (int column = 0; column + 1 < columns; ++column) {
      const int32_t* low = &vertex_of[static_cast<size_t>(row) * columns + column];
      const int32_t* high = low + columns;
      if (low[0] >= 0 && low[1] >= 0 && high[0] >= 0 && high[1] >= 0) {
        addTriangle(low[0], low[1], high[1]);
        addTriangle(low[0], high[1], high[0]);
      }
    }
  }
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(num_vertices) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nelement face " +
      std::to_string(num_faces) + "\nproperty list uchar int vertex_indices\nend_header\n";
  writeTextFileAtomically(path, header + vertices + faces);
}

cv::Mat colourHeight(const HeightMap& map, double low_m, double high_m) {
  cv::Mat level(map.height_m.size(), CV_8UC1, cv::Scalar(0));
  cv::Mat shade(map.height_m.size(), CV_32FC1, cv::Scalar(0));
  for (int row = 0; row < level.rows; ++row) {
    for (int column = 0; column < level.cols; ++column) {
      const float height = map.height_m.at<float>(row, column);
      if (!std::isfinite(height)) {
        continue;
      }
      const double fraction = (height - low_m) / (high_m - low_m);
      level.at<uint8_t>(row, column) = cv::saturate_cast<uint8_t>(255.0 * std::clamp(fraction, 0.0, 1.0));
      // The light comes from the lower left.
      const float beside = row > 0 && column > 0 ? map.height_m.at<float>(row - 1, column - 1) : height;
      const double slope = std::isfinite(beside) ? (height - beside) / map.cell_size_m : 0.0;
      shade.at<float>(row, column) = static_cast<float>(std::clamp(0.85 + 0.3 * slope, 0.4, 1.0));
    }
  }
  cv::Mat coloured;
  cv::applyColorMap(level, coloured, cv::COLORMAP_JET);
  for (int row = 0; row < level.rows; ++row) {
    for (int column = 0; column < level.cols; ++column) {
      coloured.at<cv::Vec3b>(row, column) =
          cv::Vec3b(cv::Vec3f(coloured.at<cv::Vec3b>(row, column)) * shade.at<float>(row, column));
    }
  }
  cv::flip(coloured, coloured, 0);
  return coloured;
}

}  // namespace vcharge
