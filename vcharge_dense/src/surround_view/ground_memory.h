#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "surround_view/view_grid.h"
#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Remembers the ground around the vehicle, on a grid that is fixed in the odometry's frame, so that each
/// gray level is interpolated twice however far the vehicle drives. Follows common changes of the brightness.
class GroundMemory {
 public:
  explicit GroundMemory(const ViewGrid& grid);

  void clear();

  /// Stores the ground around the vehicle that the cameras show. What was seen within the last seconds stays
  /// as it was: the vehicle's shadow may have come over it. `labels` as in SurroundFrame; `is_hidden`, one
  /// per block of kSurroundBlock_px: not 0 where obstacles are shown instead.
  void store(Timestamp stamp, const cv::Mat& image, const cv::Mat& labels, const cv::Mat& is_hidden,
             const RigidTransform& odom_from_vehicle);

  /// Fills unknown pixels around the vehicle with ground that was stored, and labels them.
  void fill(const RigidTransform& odom_from_vehicle, cv::Mat* image, cv::Mat* labels) const;

 private:
  struct Cell {
    uint16_t gray = 0;  // in 256ths of a gray level, divided by the memory's brightness; 0: unknown
    uint16_t tile = 0;  // tile of the plane that the cell is in: cells repeat in every tile
    Timestamp stamp;    // of the image
  };
  /// Cell of an integer position on the plane, in units of pixels.
  Cell& at(int x, int y) {
    return cells_[static_cast<size_t>(y & mask_) * static_cast<size_t>(mask_ + 1) +
                  static_cast<size_t>(x & mask_)];
  }
  const Cell& at(int x, int y) const { return const_cast<GroundMemory*>(this)->at(x, y); }
  uint16_t tileOf(int x, int y) const {
    return static_cast<uint16_t>(((x >> tile_bits_) & 0xff) << 8 | ((y >> tile_bits_) & 0xff));
  }

  const ViewGrid grid_;
  const cv::Rect region_;  // pixels of the view that are stored and filled
  int tile_bits_ = 0, mask_ = 0;
  std::vector<Cell> cells_;
  float brightness_ = 1.0F;  // of the last image, over that of what is stored
  std::vector<float>
      ratios_;  // of the brightness of an image over that of the memory; kept to avoid allocations
};

}  // namespace vcharge
