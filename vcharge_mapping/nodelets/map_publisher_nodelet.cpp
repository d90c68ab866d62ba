#include <exception>
#include <memory>

#include <pluginlib/class_list_macros.hpp>

#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/parameters.h"
#include "vcharge_ros/sparse_map_conversions.h"

namespace vcharge {

/// Publishes a saved map once, latched: /mapping/landmarks, /mapping/trajectory and /mapping/loop_edges, in
/// the frame `map`. Does not load where the map cannot be read, and says why. Parameters: ~map (path).
class MapPublisherNodelet : public Nodelet {
  void initialize() override {
    try {
      publishMap();
    } catch (const std::exception& error) {
      NODELET_FATAL_STREAM(error.what());  // the manager would only tell that it did not load
      throw;
    }
  }

  void publishMap() {
    const std::string path =
        requireStringParameter(getPrivateNodeHandle(), "map", "the path of a map (*.vmap)");
    const auto map = readSparseMap(path);
    ros::NodeHandle& node = getNodeHandle();
    landmarks_ = node.advertise<sensor_msgs::PointCloud2>("/mapping/landmarks", 1, true);
    landmarks_.publish(makeLandmarkCloud(*map));
    trajectory_ = node.advertise<nav_msgs::Path>("/mapping/trajectory", 1, true);
    trajectory_.publish(makePath(*map));
    loop_edges_ = node.advertise<visualization_msgs::MarkerArray>("/mapping/loop_edges", 1, true);
    loop_edges_.publish(makeLoopEdgeMarkers(*map));
    NODELET_INFO_STREAM(path << ": " << map->keyframes().size() << " keyframes, " << map->landmarks().size()
                             << " landmarks, content hash " << map->contentHash());
  }

  // A latched message lives as long as its publisher.
  ros::Publisher landmarks_, trajectory_, loop_edges_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::MapPublisherNodelet, nodelet::Nodelet)
