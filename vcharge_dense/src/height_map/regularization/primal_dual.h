#pragma once

#include <functional>
#include <vector>

#include <opencv2/core.hpp>

#include "kernels/aligned_array.h"

namespace vcharge {

/// Minimizes  sum |grad u|_eps + sum of the data costs  over low <= u <= high on the cells of a domain.
/// Gradients are forward differences between neighbouring cells of the domain, |.|_eps is the Huber norm of
/// the paper (total variation for eps = 0). The data cost of a cell is
///   weight_below * below * [floor - u]_+  +  weight_above * above * [u - ceiling]_+  +  slope * u.
struct VariationalProblem {
  cv::Mat floor;         ///< CV_32FC1; NaN outside the domain, -inf: no cost below
  cv::Mat ceiling;       ///< CV_32FC1; +inf: no cost above
  cv::Mat slope;         ///< CV_32FC1, or empty: 0
  cv::Mat weight_below;  ///< CV_32FC1, not negative, or empty: 1
  cv::Mat weight_above;  ///< like weight_below
  float below = 0.0F, above = 0.0F;
  float epsilon = 0.0F;
  float low = 0.0F, high = 1.0F;
};

/// When the iterations stop, and their step.
struct PrimalDualSettings {
  double max_gap_per_cell = 2e-4;  ///< duality gap divided by the number of cells, in the energy's unit
  int max_iterations = 4000;
  double step_ratio = 0.1;  ///< ratio of primal to dual step: about the distance that values change by
};

/// Convergence of a solution.
struct PrimalDualReport {
  int iterations = 0;
  double primal_energy = 0.0;
  double gap = 0.0;  ///< duality gap: upper bound of the energy above the minimum
  bool converged = false;
};

/// First-order primal-dual algorithm (Chambolle and Pock 2011, algorithm 1) in bands of rows that do several
/// iterations while they are in the cache. Results do not depend on the number of threads.
class PrimalDualSolver {
 public:
  /// `start`: CV_32FC1, initial values, which are clamped to [low, high].
  PrimalDualSolver(const VariationalProblem& problem, const cv::Mat& start, double step_ratio);

  /// Does kIterationsAtOnce iterations.
  void iterate();
  static constexpr int kIterationsAtOnce = 8;

  /// Energy and duality gap of the current values.
  PrimalDualReport evaluate() const;
  /// Current values, CV_32FC1, NaN outside the domain.
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

/// Iterates until the duality gap is small enough or max_iterations are done.
cv::Mat solveVariational(const VariationalProblem& problem, const cv::Mat& start,
                         const PrimalDualSettings& settings, PrimalDualReport* report);

}  // namespace vcharge
