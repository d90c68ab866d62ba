#include "vcharge_dense/octomap_builder.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <octomap/OcTree.h>

#include "height_map/fusion/voxel_blocks.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/camera/ray_table.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

constexpr double kWholeSphere_rad = 6.2831853;

// Less confident ranges are left out: the octree assumes that a hit is right with a probability of 0.7.
constexpr float kMinConfidence = 0.7F;

// Marks of a voxel in the current view.
constexpr uint8_t kEnd = 1, kOccupied = 2, kFree = 4;

octomap::point3d toOctomap(const Eigen::Vector3d& point) {
  return {static_cast<float>(point.x()), static_cast<float>(point.y()), static_cast<float>(point.z())};
}

}  // namespace

OctomapBuilder::OctomapBuilder(const OctomapOptions& options, double max_range_m, double farthest_m)
    : options_(options),
      max_range_m_(max_range_m),
      farthest_m_(farthest_m),
      tree_(std::make_unique<octomap::OcTree>(options.resolution_m)),
      voxels_(std::make_unique<VoxelBlocks>()) {
  options.validate();
}

OctomapBuilder::~OctomapBuilder() = default;

struct OctomapBuilder::Ray {
  octomap::point3d end;
  octomap::OcTreeKey end_key;
};

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

std::vector<OctomapBuilder::Ray> OctomapBuilder::markEnds(const RangeMap& map,
                                                          const RigidTransform& world_from_camera) {
  const RayTable& table = raysOf(map);
  const Eigen::Vector3d& origin = world_from_camera.translation();
  std::vector<Ray> rays;
  for (int y = 0; y < map.range_m.rows; y += options_.pixel_step) {
    for (int x = 0; x < map.range_m.cols; x += options_.pixel_step) {
      const float range = map.range_m.at<float>(y, x), sigma = map.standard_deviation_m.at<float>(y, x);
      if (!std::isfinite(range) || !std::isfinite(sigma) || range <= 0.0F || range >= farthest_m_ ||
          map.confidence.at<float>(y, x) < kMinConfidence || !table.valid(x, y)) {
        continue;
      }
      const bool ends_here = range <= max_range_m_;
      const double length = ends_here ? range : max_range_m_;
      Ray ray;
      ray.end = toOctomap(origin + length * (world_from_camera.rotation() * table.ray(x, y).cast<double>()));
      if (!tree_->coordToKeyChecked(ray.end, ray.end_key)) {
        continue;  // outside the octree
      }
      uint8_t& marks = *voxels_->at(ray.end_key).marks;
      if ((marks & kEnd) == 0) {
        rays.push_back(ray);  // further rays to the same voxel would clear nearly the same voxels
      }
      marks |= ends_here ? kEnd | kOccupied : kEnd;
    }
  }
  return rays;
}

void OctomapBuilder::update(float* log_odds, float change) const {
  const float before = std::isnan(*log_odds) ? 0.0F : *log_odds;
  *log_odds = std::clamp(before + change, tree_->getClampingThresMinLog(), tree_->getClampingThresMaxLog());
}

void OctomapBuilder::add(const RangeMap& map, const RigidTransform& world_from_camera) {
  voxels_->startView();
  const std::vector<Ray> rays = markEnds(map, world_from_camera);
  const octomap::point3d origin = toOctomap(world_from_camera.translation());
  octomap::KeyRay passed;
  for (const Ray& ray : rays) {
    if (tree_->computeRayKeys(origin, ray.end, passed)) {
      for (const octomap::OcTreeKey& key : passed) {
        const VoxelBlocks::Voxel voxel = voxels_->at(key);
        // Voxels on a surface stay occupied even if rays to surfaces behind pass through them.
        if ((*voxel.marks & (kFree | kOccupied)) == 0) {
          *voxel.marks |= kFree;
          update(voxel.value, tree_->getProbMissLog());
        }
      }
    }
  }
  for (const Ray& ray : rays) {
    const VoxelBlocks::Voxel voxel = voxels_->at(ray.end_key);
    if ((*voxel.marks & kOccupied) != 0) {
      update(voxel.value, tree_->getProbHitLog());
    }
  }
  tree_is_current_ = false;
}

const octomap::OcTree& OctomapBuilder::tree() {
  if (!tree_is_current_) {
    voxels_->forEach(
        [&](const octomap::OcTreeKey& key, float log_odds) { tree_->setNodeValue(key, log_odds, true); });
    tree_->updateInnerOccupancy();
    tree_is_current_ = true;
  }
  return *tree_;
}

void OctomapBuilder::write(const std::string& path) {
  tree();
  tree_->toMaxLikelihood();
  tree_->prune();
  writeFileAtomically(path, [&](const std::string& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    // The format of OcTree::writeBinary(), which would also print to standard error.
    file.precision(17);
    file << "# Octomap OcTree binary file\n# free, occupied and unknown space\nid " << tree_->getTreeType()
         << "\nsize " << tree_->size() << "\nres " << tree_->getResolution() << "\ndata\n";
    if (const octomap::OcTreeNode* root = tree_->getRoot()) {
      tree_->writeBinaryNode(file, root);
    }
    file.close();
    if (!file) {
      throw InputError(path + ": cannot be written (is the disk full?)");
    }
  });
}

}  // namespace vcharge
