#pragma once

#include <string>

#include <octomap_msgs/Octomap.h>
#include <visualization_msgs/Marker.h>

#include "vcharge_core/base/timestamp.h"

namespace octomap {
class OcTree;
}

namespace vcharge {

/// An octree as a message: binary (free and occupied leaves alone), in the tree's own frame, which is called
/// `frame_id`. std::runtime_error when octomap cannot serialize it.
octomap_msgs::Octomap toMessage(const octomap::OcTree& tree, const std::string& frame_id, Timestamp stamp);

/// The tree of a binary message. InputError "<source>: ..." for a message that holds no binary OcTree.
void fromMessage(const octomap_msgs::Octomap& message, const std::string& source, octomap::OcTree* tree);

/// The occupied leaves as cubes coloured by height, for viewers that know no octrees; leaves larger than the
/// resolution come as cubes of that size. DELETE where nothing is occupied.
visualization_msgs::Marker makeOctomapMarker(const octomap::OcTree& tree, const std::string& frame_id,
                                             Timestamp stamp);

}  // namespace vcharge
