#pragma once

#include <opencv2/core.hpp>

#include "kernels/aligned_array.h"
#include "kernels/sweep_kernels.h"
#include "sweep/tile_layout.h"
#include "vcharge_core/camera/mei_camera.h"

namespace vcharge {

/// The warp of a tile over a plane: exact at nodes `spacing` pixels apart, biquadratic in cells of 3 x 3
/// nodes between them.
class NodeGrid {
 public:
  /// `origin`: image position of the tile's first pixel. `near_valid`: CV_8UC1; nodes where it is 0 are
  /// unseen. `spacing`: a power of two.
  NodeGrid(const MeiCamera& camera, const cv::Mat& near_valid, cv::Point origin, const TileLayout& layout,
           int spacing);

  /// Sets the planes' normal, see PlaneFamily.
  void setNormal(const Eigen::Vector3f& normal);
  /// Computes the cells for the plane at this inverse distance. Returns an upper bound of the interpolation
  /// error in pixels, from the nodes' third differences, or infinity where the warp is too curved for a
  /// bound.
  float makeCells(const SweepKernels& kernels, const Projection& projection, float inverse_distance,
                  AlignedArray<float>* cells);

  int cellShift() const { return cell_shift_; }  ///< cells are 1 << cellShift() pixels wide and high
  /// Index in `cells` of the first value for this row of the tile.
  size_t cellOffset(int row) const;
  int rowInCell(int row) const { return row & ((1 << cell_shift_) - 1); }

 private:
  TileLayout layout_;
  int spacing_, cell_shift_;
  int nodes_, node_rows_;  // nodes per strip and rows of nodes; odd
  AlignedArray<float> x_, y_, z_, base_, weight_, u_, v_;
};

}  // namespace vcharge
