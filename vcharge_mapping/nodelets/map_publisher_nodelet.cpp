#include <memory>
#include <string>
#include <vector>

#include <pluginlib/class_list_macros.hpp>

#include "map_change_markers.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/map_difference.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/sparse_map_conversions.h"

namespace vcharge {
namespace {

/// An adjustment moves all landmarks a little.
constexpr double kMinMove_m = 0.5;

}  // namespace

/// Publishes a saved map once, latched: /mapping/landmarks, /mapping/trajectory and /mapping/loop_edges, and
/// in /mapping/changes what differs from the version before it, in the frame `map`. Fails to load, with the
/// reason, if the map cannot be read. Parameters: ~map (path), ~version (0: the newest).
class MapPublisherNodelet : public Nodelet {
 public:
  MapPublisherNodelet() : Nodelet("map_publisher") {}

 private:
  void start() override {
    const std::string path = requireParameter("map", "the path of a map (*.vmap)");
    const std::vector<MapVersion> versions = readMapVersions(path);
    const int wanted = parameter("version", 0);
    const int64_t version = wanted == 0 ? versions.back().number : wanted;
    const auto map = readSparseMap(path, nullptr, version);
    landmarks_ = advertiseLatched<sensor_msgs::PointCloud2>("/mapping/landmarks");
    landmarks_.publish(makeLandmarkCloud(*map));
    trajectory_ = advertiseLatched<nav_msgs::Path>("/mapping/trajectory");
    trajectory_.publish(makePath(*map));
    loop_edges_ = advertiseLatched<visualization_msgs::MarkerArray>("/mapping/loop_edges");
    loop_edges_.publish(makeLoopEdgeMarkers(*map));
    changes_ = advertiseLatched<visualization_msgs::MarkerArray>("/mapping/changes");
    changes_.publish(makeChangeMarkers(
        version == versions.front().number
            ? MapDifference()
            : compareVersions(*readSparseMap(path, nullptr, version - 1), *map, kMinMove_m)));
    NODELET_INFO_STREAM(path << ", version " << version << ": " << map->keyframes().size() << " keyframes, "
                             << map->landmarks().size() << " landmarks, content hash " << map->contentHash());
  }

  // Kept as members because a latched message lives only as long as its publisher.
  ros::Publisher landmarks_, trajectory_, loop_edges_, changes_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::MapPublisherNodelet, nodelet::Nodelet)
