#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/mei_camera.h"
#include "vcharge_core/ray_table.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

/// A neighbour's image as the kernel samples it.
struct SweepNeighbour {
  /// Gray levels less the reference's mean, framed by one pixel of NaN and NaN where invalid: interpolation
  /// carries "not seen" along without a test per sample.
  std::vector<float> framed_pixels;
  Eigen::Matrix3f neighbour_from_reference;  ///< rotation
  Eigen::Vector3f translation_m;             ///< of the same transform
  bool after = false;                        ///< taken after the reference
};

/// What all tiles of one sweep share. The pointers outlive the tiles.
struct SweepInput {
  MeiCamera camera;
  const RayTable* rays;
  cv::Mat reference;  ///< CV_32FC1, gray levels less their mean, NaN where invalid
  std::vector<SweepNeighbour> neighbours;
  const PlaneSweepOptions* options;
};

/// A set of surfaces to score: pixel (x, y) on surface k has the inverse range base + offsets[k] * weight.
/// For planes base is 0 and the weight is -normal . ray.
struct Hypotheses {
  cv::Mat base;    ///< CV_32FC1
  cv::Mat weight;  ///< CV_32FC1, NaN where there is no surface
  std::vector<float> offsets;
};

/// Scores of one tile: [hypothesis][row][column], NaN where nobody votes.
struct TileScores {
  cv::Rect tile;
  std::vector<float> scores;
  std::vector<int> best;         ///< hypothesis with the highest score per pixel, -1 where none
  std::vector<uint32_t> voters;  ///< bit n: neighbour n took part in the best score

  size_t numPixels() const { return static_cast<size_t>(tile.area()); }
};

/// Correlates a tile of the reference with its neighbours warped over hypothetical surfaces. The inner loops
/// run over rows of plain floats, so that the compiler vectorizes them.
class TileScorer {
 public:
  TileScorer(const SweepInput& input, cv::Rect tile);
  void score(const Hypotheses& hypotheses, TileScores* result);

 private:
  void warp(const SweepNeighbour& neighbour, const std::vector<float>& rotated_rays);
  void correlate(float* scores);
  void aggregate(float* aggregated);

  const SweepInput& input_;
  cv::Rect tile_;
  int radius_;
  int halo_width_, halo_height_;
  std::vector<float> reference_;                    // with the halo
  std::vector<float> reference_sum_;                // per pixel of the tile
  std::vector<float> reference_inverse_deviation_;  // 1 / sqrt(sum of squares about the mean)
  std::vector<std::vector<float>> rotated_rays_;    // per neighbour: x, y, z planes with the halo
  std::vector<float> inverse_range_, warped_;       // with the halo
  std::vector<float> row_sums_;                     // three planes: halo rows x tile columns
  std::vector<float> position_x_, position_y_;      // of one row, in the framed neighbour
  std::vector<float> window_sums_;                  // of one row
  std::vector<std::vector<float>> neighbour_scores_;
  std::vector<float> votes_, other_side_;
  std::vector<uint32_t> voters_, other_voters_;
};

}  // namespace vcharge
