#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "height_map/fusion/packed_range_map.h"
#include "vcharge_dense/height_map_options.h"

namespace vcharge {

/// The voxel grid of a map.
struct VoxelGrid {
  Eigen::Vector2d origin_m{0, 0};  ///< centre of column 0, row 0
  double cell_size_m = 0.05;
  int columns = 0, rows = 0;
  double bottom_m = 0.0;  ///< lower face of the lowest voxels
  double height_step_m = 0.025;
  int num_voxels = 0;  ///< number of voxels per column

  double top_m() const { return bottom_m + num_voxels * height_step_m; }
};

/// Grid of all voxels within max_range_m of the cameras. `extent_m`: extent of the cameras in x and y and of
/// the vehicle's poses in z. Throws InputError with numbers if it would need more than max_memory_gb.
VoxelGrid makeVoxelGrid(const Eigen::AlignedBox3d& extent_m, const HeightFusionOptions& options);

/// Results of all columns, as images of the grid's size.
struct ColumnImages {
  cv::Mat best_height_m;  ///< CV_32FC1; NaN where no surface was observed
  cv::Mat occupied_gain;  ///< CV_32FC1, C^occ - C^min: evidence for free space
  /// CV_32FC1, 0 to 1: evidence that space just below the best height is occupied, and that space just above
  /// it is free. On the side of a car only one of them may be observed. 0 where no surface was observed.
  cv::Mat support_below, support_above;
  cv::Mat solid;  ///< CV_8UC1, 255 where a high run of voxels is occupied, regardless of the voxels above

  /// Confidence of the best height: the smaller one of both supports.
  cv::Mat confidence() const { return cv::min(support_below, support_above); }
};

/// Loads a view's range map. Called from several threads, at least once per view and block of the grid unless
/// the view is still in memory.
using LoadView = std::function<std::shared_ptr<const PackedRangeMap>(size_t view)>;

/// Adds the weights of all views to the voxels and finds the best height of every column (paper, equation
/// perColumnMin). Only the voxels of one block of columns are in memory at a time. Views are added in order,
/// so that the result does not depend on threads. `progress` (may be empty) receives the completed fraction.
ColumnImages fuseColumns(const VoxelGrid& grid, const std::vector<Eigen::Vector3d>& camera_positions_m,
                         const LoadView& load_view, const HeightFusionOptions& options,
                         const std::function<void(double)>& progress);

}  // namespace vcharge
