#include "vcharge_ros/octomap_conversions.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include <octomap/OcTree.h>

#include "vcharge_core/error.h"
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
  if (!tree.writeBinaryData(stream)) {
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

}  // namespace vcharge
