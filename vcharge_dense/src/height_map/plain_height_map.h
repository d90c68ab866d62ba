#pragma once

#include <opencv2/core.hpp>

#include "height_map/fusion/weight_kernel.h"
#include "height_map/regularization/primal_dual.h"

namespace vcharge {

/// The function AddColumnWeights voxel by voxel in plain C++, as a reference for tests and benchmarks.
void addColumnWeightsPlain(const PackedRangeMap& map, const WeightProfile& profile, const VoxelColumn& column,
                           float* weights);

/// The primal-dual algorithm as in its formulas, one pass over all duals and one over all values, as a
/// reference for tests and benchmarks.
class PlainPrimalDual {
 public:
  PlainPrimalDual(const VariationalProblem& problem, const cv::Mat& start, double step_ratio);
  void iterate();
  const cv::Mat& values() const { return value_; }

 private:
  const VariationalProblem problem_;
  const float primal_step_, dual_step_;
  cv::Mat value_, extrapolated_, dual_x_, dual_y_;
};

/// Energy of a solution.
double plainEnergy(const VariationalProblem& problem, const cv::Mat& values);

}  // namespace vcharge
