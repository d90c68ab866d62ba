#include <memory>

#include <pluginlib/class_list_macros.hpp>

#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/sparse_map_conversions.h"

namespace vcharge {

/// Publishes a saved map once, latched: /mapping/landmarks, /mapping/trajectory and /mapping/loop_edges, in
/// the frame `map`. Fails to load, with the reason, if the map cannot be read. Parameters: ~map (path).
class MapPublisherNodelet : public Nodelet {
 public:
  MapPublisherNodelet() : Nodelet("map_publisher") {}

 private:
  void start() override {
    const std::string path = requireParameter("map", "the path of a map (*.vmap)");
    const auto map = readSparseMap(path);
    landmarks_ = advertiseLatched<sensor_msgs::PointCloud2>("/mapping/landmarks");
    landmarks_.publish(makeLandmarkCloud(*map));
    trajectory_ = advertiseLatched<nav_msgs::Path>("/mapping/trajectory");
    trajectory_.publish(makePath(*map));
    loop_edges_ = advertiseLatched<visualization_msgs::MarkerArray>("/mapping/loop_edges");
    loop_edges_.publish(makeLoopEdgeMarkers(*map));
    NODELET_INFO_STREAM(path << ": " << map->keyframes().size() << " keyframes, " << map->landmarks().size()
                             << " landmarks, content hash " << map->contentHash());
  }

  // Kept as members because a latched message lives only as long as its publisher.
  ros::Publisher landmarks_, trajectory_, loop_edges_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::MapPublisherNodelet, nodelet::Nodelet)
