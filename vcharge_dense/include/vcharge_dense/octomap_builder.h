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

/// Builds an octree of free and occupied space from range maps (Hornung et al. 2013). A ray is cast for each
/// pixel whose range is confident and has a standard deviation: voxels in front of the surface are free, the
/// voxel at the surface is occupied. Ranges on the farthest plane are left out, because surfaces beyond it
/// are assigned to it. Not thread safe.
class OctomapBuilder {
 public:
  /// `max_range_m`: longer rays clear space up to here and mark no voxel as occupied. `farthest_m`: ranges
  /// from here on lie on the farthest plane.
  OctomapBuilder(const OctomapOptions& options, double max_range_m, double farthest_m);
  ~OctomapBuilder();

  void add(const RangeMap& map, const RigidTransform& world_from_camera);
  /// Octree of everything added so far, not pruned.
  const octomap::OcTree& tree();
  /// Writes a .bt file atomically; afterwards the octree only distinguishes free and occupied. Throws
  /// InputError that names a file that cannot be written.
  void write(const std::string& path);

 private:
  struct Ray;
  const RayTable& raysOf(const RangeMap& map);
  std::vector<Ray> markEnds(const RangeMap& map, const RigidTransform& world_from_camera);
  void update(float* log_odds, float change) const;

  const OctomapOptions options_;
  const double max_range_m_, farthest_m_;
  std::unique_ptr<octomap::OcTree> tree_;
  std::unique_ptr<VoxelBlocks> voxels_;  // log odds, copied into the octree by tree()
  bool tree_is_current_ = true;
  std::map<std::vector<double>, std::unique_ptr<RayTable>>
      rays_;  // indexed by camera parameters and image size
};

}  // namespace vcharge
