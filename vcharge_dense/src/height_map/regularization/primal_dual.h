#pragma once

#include <functional>
#include <vector>

#include <opencv2/core.hpp>

#include "kernels/aligned_array.h"
#include "vcharge_dense/height_map_options.h"

namespace vcharge {

/// min over u of  sum |grad u|_eps + sum of the data's cost,  low <= u <= high, on the cells of the domain;
/// gradients are forward differences between neighbours of the domain, |.|_eps is the Huber norm of the paper
/// (eps = 0: total variation). A cell's cost is
///   weight_below * below * [floor - u]_+  +  weight_above * above * [u - ceiling]_+  +  slope * u.
struct VariationalProblem {
  cv::Mat floor;         ///< CV_32FC1; NaN outside the domain, -inf where nothing pulls up
  cv::Mat ceiling;       ///< CV_32FC1; +inf where nothing pulls down
  cv::Mat slope;         ///< CV_32FC1, or empty: none
  cv::Mat weight_below;  ///< CV_32FC1, not negative, or empty: 1
  cv::Mat weight_above;  ///< the same
  float below = 0.0F, above = 0.0F;
  float epsilon = 0.0F;
  float low = 0.0F, high = 1.0F;
};

/// Convergence of a solution.
struct PrimalDualReport {
  int iterations = 0;
  double primal_energy = 0.0;
  double gap = 0.0;  ///< duality gap: the energy is no more than this above the least one
  bool converged = false;
};

/// First-order primal-dual algorithm (Chambolle and Pock 2011, algorithm 1) in blocks of rows that run
/// several iterations each while they are in the cache. The same result on any number of threads.
class PrimalDualSolver {
 public:
  /// `start`: CV_32FC1, the first values; those of the domain are clamped to [low, high].
  PrimalDualSolver(const VariationalProblem& problem, const cv::Mat& start, double step_ratio);

  /// kIterationsAtOnce iterations.
  void iterate();
  static constexpr int kIterationsAtOnce = 8;

  /// Energy and duality gap of the present values.
  PrimalDualReport evaluate() const;
  /// CV_32FC1: the present values, NaN outside the domain.
  cv::Mat values() const;
  int numCells() const { return num_cells_; }

 private:
  struct Fields {  // padded rows, see offset()
    AlignedArray<float> value, extrapolated, dual_x, dual_y;
  };
  size_t offset(int row) const { return static_cast<size_t>(row + 1) * stride_; }
  void iterateBand(int first_row, int last_row, const Fields& from, Fields* to) const;
  double rowEnergy(int row, double* dual) const;

  const VariationalProblem problem_;
  const int rows_, columns_;
  const size_t stride_;
  float primal_step_, dual_step_;
  int num_cells_ = 0;
  int iterations_ = 0;
  AlignedArray<float> floor_, ceiling_, slope_, weight_below_, weight_above_;
  Fields now_, next_;
};

/// Iterates until the duality gap is small enough, or max_iterations are done. `progress` (may be empty) is
/// called now and then.
cv::Mat solveVariational(const VariationalProblem& problem, const cv::Mat& start,
                         const PrimalDualOptions& options, PrimalDualReport* report);

}  // namespace vcharge
