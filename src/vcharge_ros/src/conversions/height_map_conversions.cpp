#include "vcharge_ros/height_map_conversions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <sensor_msgs/point_cloud2_iterator.h>

#include "vcharge_core/base/error.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

std_msgs::Header headerOf(const HeightMap& map, Timestamp stamp) {
  std_msgs::Header header;
  header.frame_id = map.frame_id;
  header.stamp = fromTimestamp(stamp);
  return header;
}

float confidenceOf(const HeightMap& map, int row, int column) {
  if (!map.confidence.empty()) {
    return map.confidence.at<float>(row, column);
  }
  return std::isfinite(map.height_m.at<float>(row, column)) ? 1.0F : 0.0F;
}

float grayOf(const HeightMap& map, int row, int column) {
  return map.gray.empty() ? 255.0F : static_cast<float>(map.gray.at<uint8_t>(row, column));
}

geometry_msgs::Point pointOf(const HeightMap& map, int row, int column) {
  const Eigen::Vector2d centre = map.centreOf(column, row);
  geometry_msgs::Point point;
  point.x = centre.x();
  point.y = centre.y();
  point.z = map.height_m.at<float>(row, column);
  return point;
}

}  // namespace

vcharge_msgs::HeightMap toMessage(const HeightMap& map, Timestamp stamp) {
  vcharge_msgs::HeightMap message;
  message.header = headerOf(map, stamp);
  message.origin_x_m = map.origin_m.x();
  message.origin_y_m = map.origin_m.y();
  message.cell_size_m = map.cell_size_m;
  message.columns = static_cast<uint32_t>(map.height_m.cols);
  message.rows = static_cast<uint32_t>(map.height_m.rows);
  for (int row = 0; row < map.height_m.rows; ++row) {
    for (int column = 0; column < map.height_m.cols; ++column) {
      message.height_m.push_back(map.height_m.at<float>(row, column));
      message.confidence.push_back(confidenceOf(map, row, column));
      if (!map.solid.empty()) {
        message.solid.push_back(map.solid.at<uint8_t>(row, column) != 0 ? 1 : 0);
      }
    }
  }
  return message;
}

HeightMap fromMessage(const vcharge_msgs::HeightMap& message, const std::string& source) {
  const uint64_t cells = uint64_t{message.columns} * message.rows;
  if (cells == 0 || message.height_m.size() != cells || message.confidence.size() != cells) {
    throw InputError(source + ": height_m, confidence: expected " + std::to_string(message.columns) + " x " +
                     std::to_string(message.rows) + " cells, got " + std::to_string(message.height_m.size()) +
                     " and " + std::to_string(message.confidence.size()));
  }
  if (!message.solid.empty() && message.solid.size() != cells) {
    throw InputError(source + ": solid: expected no cell, or " + std::to_string(cells) + ", got " +
                     std::to_string(message.solid.size()));
  }
  if (!std::isfinite(message.origin_x_m) || !std::isfinite(message.origin_y_m) ||
      !std::isfinite(message.cell_size_m) || message.cell_size_m <= 0.0) {
    throw InputError(source +
                     ": origin_x_m, origin_y_m, cell_size_m: expected finite numbers and a positive size");
  }
  HeightMap map;
  map.frame_id = message.header.frame_id;
  map.origin_m = {message.origin_x_m, message.origin_y_m};
  map.cell_size_m = message.cell_size_m;
  map.height_m.create(static_cast<int>(message.rows), static_cast<int>(message.columns), CV_32FC1);
  map.confidence.create(map.height_m.size(), CV_32FC1);
  std::copy(message.height_m.begin(), message.height_m.end(), map.height_m.begin<float>());
  std::copy(message.confidence.begin(), message.confidence.end(), map.confidence.begin<float>());
  if (!message.solid.empty()) {
    map.solid.create(map.height_m.size(), CV_8UC1);
    std::copy(message.solid.begin(), message.solid.end(), map.solid.begin<uint8_t>());
  }
  return map;
}

sensor_msgs::PointCloud2 makeHeightCloud(const HeightMap& map, Timestamp stamp) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header = headerOf(map, stamp);
  cloud.height = 1;
  cloud.is_dense = 1;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  const auto type = sensor_msgs::PointField::FLOAT32;
  modifier.setPointCloud2Fields(5, "x", 1, type, "y", 1, type, "z", 1, type, "intensity", 1, type,
                                "confidence", 1, type);
  modifier.resize(static_cast<size_t>(cv::countNonZero(map.height_m == map.height_m)));
  sensor_msgs::PointCloud2Iterator<float> value(cloud, "x");
  for (int row = 0; row < map.height_m.rows; ++row) {
    for (int column = 0; column < map.height_m.cols; ++column) {
      if (std::isnan(map.height_m.at<float>(row, column))) {
        continue;
      }
      const geometry_msgs::Point point = pointOf(map, row, column);
      value[0] = static_cast<float>(point.x);
      value[1] = static_cast<float>(point.y);
      value[2] = static_cast<float>(point.z);
      value[3] = grayOf(map, row, column);
      value[4] = confidenceOf(map, row, column);
      ++value;
    }
  }
  return cloud;
}

nav_msgs::OccupancyGrid makeOccupancyGrid(const HeightMap& map, const cv::Mat& states, Timestamp stamp) {
  check(states.type() == CV_8UC1 && states.size() == map.height_m.size(),
        "makeOccupancyGrid: expected a CV_8UC1 state for each cell");
  nav_msgs::OccupancyGrid grid;
  grid.header = headerOf(map, stamp);
  grid.info.map_load_time = grid.header.stamp;
  grid.info.resolution = static_cast<float>(map.cell_size_m);
  grid.info.width = static_cast<uint32_t>(states.cols);
  grid.info.height = static_cast<uint32_t>(states.rows);
  grid.info.origin.position.x = map.origin_m.x() - 0.5 * map.cell_size_m;
  grid.info.origin.position.y = map.origin_m.y() - 0.5 * map.cell_size_m;
  grid.info.origin.orientation.w = 1.0;
  for (int row = 0; row < states.rows; ++row) {
    for (int column = 0; column < states.cols; ++column) {
      const auto state = static_cast<CellState>(states.at<uint8_t>(row, column));
      grid.data.push_back(state == CellState::kDrivable ? 0 : state == CellState::kObstacle ? 100 : -1);
    }
  }
  return grid;
}

visualization_msgs::Marker makeHeightMesh(const HeightMap& map, Timestamp stamp, size_t max_triangles) {
  visualization_msgs::Marker mesh;
  mesh.header = headerOf(map, stamp);
  mesh.ns = "height_map";
  mesh.type = visualization_msgs::Marker::TRIANGLE_LIST;
  mesh.pose.orientation.w = 1.0;
  mesh.scale.x = mesh.scale.y = mesh.scale.z = 1.0;
  mesh.color.r = mesh.color.g = mesh.color.b = mesh.color.a = 1.0F;
  const auto known = static_cast<double>(cv::countNonZero(map.height_m == map.height_m));
  const int stride =
      std::max(1, static_cast<int>(std::ceil(std::sqrt(2.0 * known / static_cast<double>(max_triangles)))));
  const auto add = [&](int row, int column) {
    const float gray = grayOf(map, row, column) / 255.0F;
    std_msgs::ColorRGBA colour;
    colour.r = colour.g = colour.b = gray;
    colour.a = 1.0F;
    mesh.points.push_back(pointOf(map, row, column));
    mesh.colors.push_back(colour);
  };
  const auto isKnown = [&](int row, int column) { return !std::isnan(map.height_m.at<float>(row, column)); };
  for (int row = 0; row + stride < map.height_m.rows; row += stride) {
    for (int column = 0; column + stride < map.height_m.cols; column += stride) {
      const int next_row = row + stride, next_column = column + stride;
      if (!isKnown(row, column) || !isKnown(row, next_column) || !isKnown(next_row, column) ||
          !isKnown(next_row, next_column)) {
        continue;
      }
      add(row, column);
      add(row, next_column);
      add(next_row, next_column);
      add(row, column);
      add(next_row, next_column);
      add(next_row, column);
    }
  }
  if (mesh.points.empty()) {
    mesh.action = visualization_msgs::Marker::DELETE;
  }
  return mesh;
}

}  // namespace vcharge
