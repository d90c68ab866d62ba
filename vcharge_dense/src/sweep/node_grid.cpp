#include "sweep/node_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vcharge {

namespace {

// A quadratic through three nodes exceeds their range in each direction by at most an eighth of their second
// difference. With this limit positions stay in the packed image (see kInset_px in sweep_input.cpp).
constexpr float kMaxSecondDifference_px = 12.0f;

/// Number of nodes that cover `pixels` with whole cells, at least two cells for a third difference.
int countNodes(int pixels, int spacing) {
  return 2 * std::max(2, (pixels + 2 * spacing - 1) / (2 * spacing)) + 1;
}

/// Unit ray of a pixel of a camera without distortion (paper, Camera Model); NaN if there is none.
Eigen::Vector3d rayWithoutDistortion(const MeiCamera& camera, double u, double v) {
  const double x = (u - camera.u0()) / camera.gamma1();
  const double y = (v - camera.v0()) / camera.gamma2();
  const double squared_radius = x * x + y * y;
  const double xi = camera.xi();
  const double scale =
      (xi + std::sqrt(1.0 + (1.0 - xi * xi) * squared_radius)) / (squared_radius + 1.0);  // NaN beyond
  return Eigen::Vector3d(scale * x, scale * y, scale - xi);
}

}  // namespace

NodeGrid::NodeGrid(const MeiCamera& camera, const cv::Mat& near_valid, cv::Point origin,
                   const TileLayout& layout, int spacing)
    : layout_(layout), spacing_(spacing), cell_shift_(1) {
  while ((1 << cell_shift_) < 2 * spacing) {
    ++cell_shift_;
  }
  nodes_ = countNodes(layout.strip + layout.strip % 2, spacing);  // samples are computed in pairs
  node_rows_ = countNodes(layout.rows, spacing);
  const size_t size =
      static_cast<size_t>(node_rows_) * static_cast<size_t>(nodes_) * static_cast<size_t>(layout.lanes);
  for (AlignedArray<float>* array : {&x_, &y_, &z_}) {
    array->resize(size);
  }
  base_.assign(size, 0.0f);
  weight_.assign(size, 0.0f);
  u_.resize(size);
  v_.resize(size);
  size_t at = 0;
  for (int row = 0; row < node_rows_; ++row) {
    const int y = origin.y + row * spacing;
    for (int node = 0; node < nodes_; ++node) {
      for (int lane = 0; lane < layout.lanes; ++lane, ++at) {
        const int x = origin.x + lane * layout.strip + node * spacing;
        const bool needed = near_valid.at<uint8_t>(std::clamp(y, 0, near_valid.rows - 1),
                                                   std::clamp(x, 0, near_valid.cols - 1)) != 0;
        const Eigen::Vector3d ray = needed
                                        ? rayWithoutDistortion(camera, x, y)
                                        : Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
        x_[at] = static_cast<float>(ray.x());
        y_[at] = static_cast<float>(ray.y());
        z_[at] = static_cast<float>(ray.z());
      }
    }
  }
}

void NodeGrid::setNormal(const Eigen::Vector3f& normal) {
  for (size_t i = 0; i < weight_.size(); ++i) {
    weight_[i] = -(normal.x() * x_[i] + normal.y() * y_[i] + normal.z() * z_[i]);
  }
}

float NodeGrid::makeCells(const SweepKernels& kernels, const Projection& projection, float inverse_distance,
                          AlignedArray<float>* cells) {
  const RayRow rays{x_.data(), y_.data(), z_.data(), base_.data(), weight_.data(), inverse_distance};
  kernels.project(projection, rays, weight_.size(), u_.data(), v_.data());
  const size_t node_row = static_cast<size_t>(nodes_) * static_cast<size_t>(layout_.lanes);
  cells->resize(cellOffset((node_rows_ - 1) * spacing_));
  for (int row = 0; row + 2 < node_rows_; row += 2) {
    const float* u_rows[3];
    const float* v_rows[3];
    for (int i = 0; i < 3; ++i) {
      u_rows[i] = u_.data() + static_cast<size_t>(row + i) * node_row;
      v_rows[i] = v_.data() + static_cast<size_t>(row + i) * node_row;
    }
    kernels.makeCells(u_rows, v_rows, nodes_, spacing_, cells->data() + cellOffset(row * spacing_));
  }
  const NodeDifferences differences = kernels.nodeDifferences(u_.data(), v_.data(), node_rows_, nodes_);
  // |x (x - h) (x - 2 h)| / 6 is at most 0.0642 h^3, in each of two directions.
  return differences.second <= kMaxSecondDifference_px ? 2.0f * 0.0642f * differences.third
                                                       : std::numeric_limits<float>::infinity();
}

size_t NodeGrid::cellOffset(int row) const {
  return static_cast<size_t>(row >> cell_shift_) * static_cast<size_t>(nodes_ / 2) * kCellCoefficients *
         static_cast<size_t>(layout_.lanes);
}

}  // namespace vcharge
