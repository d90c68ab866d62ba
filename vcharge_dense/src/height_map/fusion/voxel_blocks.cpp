#include "height_map/fusion/voxel_blocks.h"

#include <cmath>
#include <limits>

namespace vcharge {
namespace {

constexpr int kKeyBits = 16;  // bits per axis of an octree's key

}  // namespace

VoxelBlocks::Voxel VoxelBlocks::at(const octomap::OcTreeKey& key) {
  uint64_t id = 0;
  size_t voxel = 0;
  for (unsigned int axis = 0; axis < 3; ++axis) {
    id = (id << kKeyBits) | (key[axis] >> kSideBits);
    voxel = (voxel << kSideBits) | (key[axis] & ((1U << kSideBits) - 1U));
  }
  if (id != last_id_) {
    std::unique_ptr<Block>& block = blocks_[id];
    if (!block) {
      block = std::make_unique<Block>();
      block->values.fill(std::numeric_limits<float>::quiet_NaN());
      block->view = view_;
    }
    last_id_ = id;
    last_ = block.get();
  }
  if (last_->view != view_) {
    last_->marks.fill(0);
    last_->view = view_;
  }
  return {&last_->values[voxel], &last_->marks[voxel]};
}

void VoxelBlocks::forEach(const std::function<void(const octomap::OcTreeKey&, float)>& visit) const {
  constexpr uint64_t kAxisMask = (uint64_t{1} << kKeyBits) - 1;
  constexpr size_t kSideMask = (size_t{1} << kSideBits) - 1;
  for (const auto& [id, block] : blocks_) {
    for (size_t voxel = 0; voxel < kVoxels; ++voxel) {
      if (std::isnan(block->values[voxel])) {
        continue;
      }
      octomap::OcTreeKey key;
      for (unsigned int axis = 0; axis < 3; ++axis) {
        const uint64_t side = (id >> (kKeyBits * (2 - axis))) & kAxisMask;
        const size_t inside = (voxel >> (kSideBits * (2 - axis))) & kSideMask;
        key[axis] = static_cast<octomap::key_type>((side << kSideBits) | inside);
      }
      visit(key, block->values[voxel]);
    }
  }
}

}  // namespace vcharge
