#include "vcharge_ros/octomap_conversions.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include <octomap/OcTree.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/quantile.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {

octomap_msgs::Octomap toMessage(const octomap::OcTree& tree, const std::string& frame_id, Timestamp stamp) {
  octomap_msgs::Octomap message;
  message.header.frame_id = frame_id;
  message.header.stamp = fromTimestamp(stamp);
  message.binary = true;
  message.id = tree.getTreeType();
  message.resolution = tree.getResolution();
  std::ostringstream stream(std::ios::binary);
  // Like writeBinaryData(), which also prints to standard error.
  if (const octomap::OcTreeNode* root = tree.getRoot(); root && !tree.writeBinaryNode(stream, root)) {
    throw std::runtime_error("octree: cannot be serialized");
  }
  const std::string bytes = stream.str();
  message.data.assign(bytes.begin(), bytes.end());
  return message;
}

void fromMessage(const octomap_msgs::Octomap& message, const std::string& source, octomap::OcTree* tree) {
  if (!message.binary || message.id != "OcTree" || !std::isfinite(message.resolution) ||
      message.resolution <= 0.0) {
    throw InputError(source + ": expected a binary OcTree of positive resolution, got id '" + message.id +
                     "', resolution " + std::to_string(message.resolution));
  }
  tree->clear();
  tree->setResolution(message.resolution);
  std::istringstream stream(std::string(message.data.begin(), message.data.end()), std::ios::binary);
  if (!message.data.empty() && !tree->readBinaryData(stream)) {
    throw InputError(source + ": data: expected a serialized octree");
  }
}

visualization_msgs::Marker makeOctomapMarker(const octomap::OcTree& tree, const std::string& frame_id,
                                             Timestamp stamp) {
  constexpr double kSpan_m = 2.5;  // span of the colours, from the height
  constexpr double kLowFraction =
      0.05;  // below which this fraction of the leaves lies: a few wrong ranges end deep in the ground
  visualization_msgs::Marker marker;
  marker.header.frame_id = frame_id;
  marker.header.stamp = fromTimestamp(stamp);
  marker.ns = "octomap";
  marker.type = visualization_msgs::Marker::CUBE_LIST;
  marker.pose.orientation.w = 1.0;
  const double edge = tree.getResolution();
  marker.scale.x = marker.scale.y = marker.scale.z = edge;
  marker.color.a = 1.0F;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    if (!tree.isNodeOccupied(*leaf)) {
      continue;
    }
    const auto cells = static_cast<int>(std::lround(leaf.getSize() / edge));
    const double first = -0.5 * (cells - 1) * edge;
    for (int i = 0; i < cells * cells * cells; ++i) {
      const int row = i / cells % cells, layer = i / (cells * cells);
      geometry_msgs::Point point;
      point.x = leaf.getX() + first + edge * (i % cells);
      point.y = leaf.getY() + first + edge * row;
      point.z = leaf.getZ() + first + edge * layer;
      marker.points.push_back(point);
    }
  }
  if (marker.points.empty()) {
    marker.action = visualization_msgs::Marker::DELETE;
    return marker;
  }
  std::vector<double> heights;
  heights.reserve(marker.points.size());
  for (const geometry_msgs::Point& point : marker.points) {
    heights.push_back(point.z);
  }
  const double low = quantile(std::move(heights), kLowFraction);
  for (const geometry_msgs::Point& point : marker.points) {
    const auto relative_height = static_cast<float>(std::clamp((point.z - low) / kSpan_m, 0.0, 1.0));
    std_msgs::ColorRGBA colour;
    colour.r = relative_height;
    colour.g = 1.0F - std::abs(2.0F * relative_height - 1.0F);
    colour.b = 1.0F - relative_height;
    colour.a = 1.0F;
    marker.colors.push_back(colour);
  }
  return marker;
}

}  // namespace vcharge
