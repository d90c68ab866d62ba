#include "vcharge_dense/octomap_builder.h"

#include <cmath>
#include <fstream>

#include <octomap/OcTree.h>

#include "vcharge_core/error.h"
#include "vcharge_core/file_io.h"
#include "vcharge_core/ray_table.h"

namespace vcharge {
namespace {

constexpr double kWholeSphere_rad = 6.2831853;

octomap::point3d toOctomap(const Eigen::Vector3d& point) {
  return {static_cast<float>(point.x()), static_cast<float>(point.y()), static_cast<float>(point.z())};
}

}  // namespace

OctomapBuilder::OctomapBuilder(const OctomapOptions& options, double farthest_m)
    : options_(options),
      farthest_m_(farthest_m),
      tree_(std::make_unique<octomap::OcTree>(options.resolution_m)) {
  options.validate();
}

OctomapBuilder::~OctomapBuilder() = default;

const RayTable& OctomapBuilder::raysOf(const RangeMap& map) {
  const MeiCamera::Parameters parameters = map.camera.parameters();
  std::vector<double> key(parameters.data(), parameters.data() + parameters.size());
  key.push_back(map.range_m.cols);
  key.push_back(map.range_m.rows);
  std::unique_ptr<RayTable>& rays = rays_[key];
  if (!rays) {
    rays = std::make_unique<RayTable>(map.camera, map.range_m.size(), kWholeSphere_rad);
  }
  return *rays;
}

void OctomapBuilder::add(const RangeMap& map, const RigidTransform& world_from_camera) {
  const RayTable& rays = raysOf(map);
  const Eigen::Vector3d origin = world_from_camera.translation();
  octomap::KeySet ends, free, occupied;
  octomap::KeyRay ray_keys;
  for (int y = 0; y < map.range_m.rows; y += options_.pixel_step) {
    for (int x = 0; x < map.range_m.cols; x += options_.pixel_step) {
      const float range = map.range_m.at<float>(y, x), sigma = map.standard_deviation_m.at<float>(y, x);
      if (!std::isfinite(range) || !std::isfinite(sigma) || range <= 0.0F || range >= farthest_m_ ||
          !rays.valid(x, y)) {
        continue;
      }
      const bool ends_here = range <= options_.max_range_m;
      const double length = ends_here ? range : options_.max_range_m;
      const Eigen::Vector3d end =
          origin + length * (world_from_camera.rotation() * rays.ray(x, y).cast<double>());
      octomap::OcTreeKey end_key;
      if (!tree_->coordToKeyChecked(toOctomap(end), end_key)) {
        continue;  // beyond what an octree holds
      }
      if (ends_here) {
        occupied.insert(end_key);
      }
      // Rays to one voxel clear much the same: the first one stands for all.
      if (ends.insert(end_key).second && tree_->computeRayKeys(toOctomap(origin), toOctomap(end), ray_keys)) {
        free.insert(ray_keys.begin(), ray_keys.end());
      }
    }
  }
  // Voxels on the surface are occupied although rays to the surface behind graze them.
  for (const octomap::OcTreeKey& key : free) {
    if (occupied.count(key) == 0) {
      tree_->updateNode(key, false, true);
    }
  }
  for (const octomap::OcTreeKey& key : occupied) {
    tree_->updateNode(key, true, true);
  }
}

void OctomapBuilder::write(const std::string& path) {
  tree_->updateInnerOccupancy();
  tree_->toMaxLikelihood();
  tree_->prune();
  writeFileAtomically(path, [&](const std::string& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    // As OcTree::writeBinary(), which tells standard error about it.
    file.precision(17);
    file << "# Octomap OcTree binary file\n# free, occupied and unknown space\nid " << tree_->getTreeType()
         << "\nsize " << tree_->size() << "\nres " << tree_->getResolution() << "\ndata\n";
    const bool written = static_cast<bool>(tree_->writeBinaryData(file));
    file.close();
    if (!written || !file) {
      throw InputError(path + ": cannot be written (is the disk full?)");
    }
  });
}

}  // namespace vcharge
