#pragma once

#include <opencv2/core.hpp>

#include "kernels/aligned_array.h"
#include "kernels/sweep_kernels.h"
#include "sweep/tile_layout.h"
#include "vcharge_core/camera/mei_camera.h"

namespace vcharge {

/// Maps the pixels of a reference tile over a plane to positions in a neighbour's image, which would be
/// costly to project one by one: exact at nodes `spacing` pixels apart, biquadratic in cells of 3 x 3 nodes
/// between them.
class NodeGrid {
 public:
  /// `camera`: the reference, without distortion. `near_valid`: CV_8UC1 of the image's size, 0 at pixels
  /// whose nodes no valid pixel needs. `origin`: image position of the tile's first pixel. `spacing`: a power
  /// of two.
  NodeGrid(const MeiCamera& camera, const cv::Mat& near_valid, cv::Point origin, const TileLayout& layout,
           int spacing);

  /// Sets the unit normal of the planes, in the reference camera's frame.
  void setNormal(const Eigen::Vector3f& normal);
  /// Computes the cells for the plane at this inverse distance (1/m), as SweepKernels::makeCells lays them
  /// out. Returns an upper bound of the interpolation error in pixels, from the nodes' third differences, or
  /// infinity where the mapping is too curved for a bound.
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
  // Per node: unit ray, factors of its inverse range (see RayRow), and position in the neighbour's image.
  AlignedArray<float> x_, y_, z_, base_, weight_, u_, v_;
};

}  // namespace vcharge
