#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <unordered_map>

#include <octomap/OcTreeKey.h>

namespace vcharge {

/// Values of voxels in cubes of 16 x 16 x 16 voxels. Most accesses along a ray hit the cube of the previous
/// access, which takes a tenth of the time of a descent in an octree. Each voxel also has marks that
/// startView() clears.
class VoxelBlocks {
 public:
  struct Voxel {
    float* value;  ///< NaN until it is set
    uint8_t* marks;
  };

  /// Clears all marks.
  void startView() { ++view_; }
  /// The marks are valid until the next call of startView().
  Voxel at(const octomap::OcTreeKey& key);
  /// Calls visit(key, value) for each voxel with a value, in an unspecified order.
  void forEach(const std::function<void(const octomap::OcTreeKey& key, float value)>& visit) const;

 private:
  static constexpr int kSideBits = 4;
  static constexpr size_t kVoxels = size_t{1} << (3 * kSideBits);

  struct Block {
    std::array<float, kVoxels> values;
    std::array<uint8_t, kVoxels> marks;
    uint64_t view;  // view that the marks belong to
  };

  std::unordered_map<uint64_t, std::unique_ptr<Block>> blocks_;
  uint64_t last_id_ = ~uint64_t{0};
  Block* last_ = nullptr;
  uint64_t view_ = 0;
};

}  // namespace vcharge
