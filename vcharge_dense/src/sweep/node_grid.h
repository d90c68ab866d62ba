#pragma once

#include <opencv2/core.hpp>

#include "kernels/aligned_array.h"
#include "kernels/sweep_kernels.h"
#include "sweep/tile_layout.h"
#include "vcharge_core/camera/mei_camera.h"

namespace vcharge {

/// The warp of a tile over a plane: exact at nodes `spacing` pixels apart, and between them biquadratic over
/// cells of 3 x 3 nodes.
class NodeGrid {
 public:
  /// origin: image position of the tile's first pixel. near_valid: CV_8UC1; nodes where it is 0 are unseen.
  /// spacing: a power of two.
  NodeGrid(const MeiCamera& camera, const cv::Mat& near_valid, cv::Point origin, const TileLayout& layout,
           int spacing);

  /// Planes with this normal (see PlaneFamily) are warped over from now on.
  void setNormal(const Eigen::Vector3f& normal);
  /// Cells for the plane at this inverse distance; returns a bound on the interpolation's error in pixels,
  /// from the nodes' third differences, or infinity where the warp bends too much for one.
  float makeCells(const SweepKernels& kernels, const Projection& projection, float inverse_distance,
                  AlignedArray<float>* cells);

  int cellShift() const { return cell_shift_; }  ///< cells are 1 << cellShift() pixels wide and high
  /// Of the cells that the tile's row lies in.
  size_t cellOffset(int row) const;
  int rowInCell(int row) const { return row & ((1 << cell_shift_) - 1); }

 private:
  TileLayout layout_;
  int spacing_, cell_shift_;
  int nodes_, node_rows_;  // per strip; odd
  AlignedArray<float> x_, y_, z_, base_, weight_, u_, v_;
};

}  // namespace vcharge
