#pragma once

#include <string>

#include <octomap_msgs/Octomap.h>
#include <visualization_msgs/Marker.h>

#include "vcharge_core/base/timestamp.h"

namespace octomap {
class OcTree;
}

namespace vcharge {

/// Converts an octree to a binary message (leaves are free or occupied) in the tree's own frame, named
/// `frame_id`. std::runtime_error if octomap cannot serialize it.
octomap_msgs::Octomap toMessage(const octomap::OcTree& tree, const std::string& frame_id, Timestamp stamp);

/// Converts a binary message to a tree. InputError "<source>: ..." if the message holds no binary OcTree.
void fromMessage(const octomap_msgs::Octomap& message, const std::string& source, octomap::OcTree* tree);

/// The occupied leaves as cubes coloured by height, for viewers without support for octrees; leaves larger
/// than the resolution become larger cubes. The action is DELETE if nothing is occupied.
visualization_msgs::Marker makeOctomapMarker(const octomap::OcTree& tree, const std::string& frame_id,
                                             Timestamp stamp);

}  // namespace vcharge
