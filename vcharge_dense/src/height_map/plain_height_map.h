#pragma once

#include <opencv2/core.hpp>

#include "height_map/fusion/weight_kernel.h"
#include "height_map/regularization/primal_dual.h"

namespace vcharge {

/// AddColumnWeights voxel by voxel in plain C++: the reference of tests and benchmark.
void addColumnWeightsPlain(const PackedRangeMap& map, const WeightProfile& profile, const VoxelColumn& column,
                           float* weights);

/// The primal-dual algorithm as the formulas say, one pass over all duals and one over all values: the
/// reference of tests and benchmark.
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

/// Energy of a solution, summed in the order of the cells.
double plainEnergy(const VariationalProblem& problem, const cv::Mat& values);

}  // namespace vcharge
