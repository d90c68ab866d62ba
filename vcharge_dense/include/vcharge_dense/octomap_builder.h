#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/camera/ray_table.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_dense/height_map_options.h"

namespace octomap {
class OcTree;
}

namespace vcharge {

class VoxelBlocks;

/// An octree of free and occupied space from range maps, by casting a ray for each pixel whose range has a
/// sigma and is sure enough: free up to the surface, occupied there. Others say nothing, and neither do
/// ranges at the farthest plane, where everything ends up that lies beyond it.
class OctomapBuilder {
 public:
  /// `farthest_m`: range from which on a range counts as that of the farthest plane.
  OctomapBuilder(const OctomapOptions& options, double farthest_m);
  ~OctomapBuilder();

  void add(const RangeMap& map, const RigidTransform& world_from_camera);
  /// Of what was added so far, not pruned.
  const octomap::OcTree& tree();
  /// Writes a .bt file, whole or not at all; the tree then knows free and occupied alone. InputError naming
  /// the file.
  void write(const std::string& path);

 private:
  struct Ray;
  const RayTable& raysOf(const RangeMap& map);
  std::vector<Ray> markEnds(const RangeMap& map, const RigidTransform& world_from_camera);
  void update(float* log_odds, float change) const;

  const OctomapOptions options_;
  const double farthest_m_;
  std::unique_ptr<octomap::OcTree> tree_;
  std::unique_ptr<VoxelBlocks> voxels_;  // log odds, which the tree gets all at once
  bool tree_is_current_ = true;
  std::map<std::vector<double>, std::unique_ptr<RayTable>> rays_;  // by camera model and size
};

}  // namespace vcharge
