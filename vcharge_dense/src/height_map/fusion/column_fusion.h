#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "height_map/fusion/packed_range_map.h"

namespace vcharge {

/// The voxel grid of a map: which columns, and which heights.
struct VoxelGrid {
  Eigen::Vector2d origin_m{0, 0};  ///< centre of column 0, row 0
  double cell_size_m = 0.05;
  int columns = 0, rows = 0;
  double bottom_m = 0.0;  ///< lower face of the lowest voxels
  double height_step_m = 0.025;
  int num_voxels = 0;  ///< of a column

  double top_m() const { return bottom_m + num_voxels * height_step_m; }
};

/// The grid that voxels within max_range_m of the cameras fill. `extent_m`: in x and y of the cameras, in z
/// of the vehicle's poses. InputError with the numbers where it would take more than max_memory_gb.
VoxelGrid makeVoxelGrid(const Eigen::AlignedBox3d& extent_m, const HeightFusionOptions& options);

/// What is kept of all columns. All images have the grid's size.
struct ColumnImages {
  cv::Mat best_height_m;  ///< CV_32FC1; NaN where no surface was seen
  cv::Mat occupied_gain;  ///< CV_32FC1, C^occ - C^min: how strongly free space was seen
  /// CV_32FC1, 0 to 1: how surely what lies just below the best height is occupied, and what lies just above
  /// it free. Of a car's side the one is seen, and not the other; 0 where no surface was seen.
  cv::Mat support_below, support_above;
  cv::Mat solid;  ///< CV_8UC1, 255 where something high was seen occupied, whatever is above it

  /// Of the best height: as its weaker side.
  cv::Mat confidence() const { return cv::min(support_below, support_above); }
};

/// A camera's range map; called from many threads, each view once per block of the grid that it reaches and
/// that is not among those loaded last.
using LoadView = std::function<std::shared_ptr<const PackedRangeMap>(size_t view)>;

/// Adds all views' weights to the voxels and finds the best height of every column (paper, equation
/// perColumnMin). Voxels live for one block of columns at a time; the sums are made in the views' order, so
/// that threads do not change the result. `progress` (may be empty) takes the share done.
ColumnImages fuseColumns(const VoxelGrid& grid, const std::vector<Eigen::Vector3d>& camera_positions_m,
                         const LoadView& load_view, const HeightFusionOptions& options,
                         const std::function<void(double)>& progress);

}  // namespace vcharge
