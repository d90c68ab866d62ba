#include <memory>
#include <string>

#include <octomap/OcTree.h>
#include <pluginlib/class_list_macros.hpp>

#include "height_map_publication.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/dense_maps/height_map_file.h"
#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Publishes a saved height map once, latched: /dense/height_map with /points, /grid and /mesh, and
/// /dense/octomap, in the map's frame. Fails to load, with the reason, if the map cannot be read. Parameters:
/// ~height_map (folder of build_height_map), ~drivability (DrivabilityOptions).
class HeightMapPublisherNodelet : public Nodelet {
 public:
  HeightMapPublisherNodelet() : Nodelet("height_map_publisher") {}

 private:
  void start() override {
    const std::string folder = requireParameter("height_map", "the folder of a height map");
    DrivabilityOptions options;
    readOptions("drivability", &options);
    const HeightMap map = readHeightMap(folder);
    octomap::OcTree tree(1.0);
    const std::string tree_path = folder + "/octomap.bt";
    if (!tree.readBinary(tree_path)) {
      throw InputError(tree_path + ": expected an OctoMap (.bt)");
    }
    publication_ = std::make_unique<HeightMapPublication>(&node());
    publication_->publish(map, classifyCells(map, options), tree);
    NODELET_INFO_STREAM(folder << ": " << map.height_m.cols << " x " << map.height_m.rows << " cells of "
                               << map.cell_size_m << " m");
  }

  std::unique_ptr<HeightMapPublication> publication_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::HeightMapPublisherNodelet, nodelet::Nodelet)
