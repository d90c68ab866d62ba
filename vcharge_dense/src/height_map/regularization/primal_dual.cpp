#include "height_map/regularization/primal_dual.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "height_map/regularization/primal_dual_kernel.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr int kBandRows = 128;  // rows per task, plus one more on both sides for each iteration
constexpr int kIterationsPerCheck = 48;

size_t strideFor(int columns) {
  const size_t padded = (static_cast<size_t>(columns) + kRowPadding - 1) / kRowPadding * kRowPadding;
  return padded + 2 * kRowPadding;
}

/// Copies an image into rows of `stride` elements that begin after kRowPadding elements, with one row before
/// and one after them.
AlignedArray<float> padded(const cv::Mat& image, size_t stride, int rows, float outside) {
  AlignedArray<float> array;
  array.assign(stride * static_cast<size_t>(rows + 2), outside);
  for (int row = 0; row < image.rows; ++row) {
    std::copy_n(image.ptr<float>(row), image.cols,
                array.data() + static_cast<size_t>(row + 1) * stride + kRowPadding);
  }
  return array;
}

}  // namespace

PrimalDualSolver::PrimalDualSolver(const VariationalProblem& problem, const cv::Mat& start, double step_ratio)
    : problem_(problem), rows_(start.rows), columns_(start.cols), stride_(strideFor(start.cols)) {
  check(start.type() == CV_32FC1 && problem.floor.size() == start.size() &&
            problem.ceiling.size() == start.size() &&
            (problem.slope.empty() || problem.slope.size() == start.size()) &&
            (problem.weight_below.empty() || problem.weight_below.size() == start.size()) &&
            (problem.weight_above.empty() || problem.weight_above.size() == start.size()),
        "PrimalDualSolver: expected CV_32FC1 images of one size");
  // The norm of the gradient is below sqrt(8), so the product of the steps must not exceed 1/8.
  primal_step_ = static_cast<float>(step_ratio / std::sqrt(8.0));
  dual_step_ = static_cast<float>(1.0 / (step_ratio * std::sqrt(8.0)));
  floor_ = padded(problem.floor, stride_, rows_, kNan);
  ceiling_ = padded(problem.ceiling, stride_, rows_, kNan);
  slope_ = padded(problem.slope, stride_, rows_, 0.0F);
  weight_below_ = padded(problem.weight_below, stride_, rows_, 1.0F);
  weight_above_ = padded(problem.weight_above, stride_, rows_, 1.0F);
  cv::Mat first = start.clone();
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      float& value = first.at<float>(row, column);
      const bool inside = !std::isnan(problem.floor.at<float>(row, column));
      num_cells_ += inside ? 1 : 0;
      value = inside ? std::clamp(std::isnan(value) ? problem.low : value, problem.low, problem.high) : kNan;
    }
  }
  for (Fields* fields : {&now_, &next_}) {
    fields->value = padded(first, stride_, rows_, kNan);
    fields->extrapolated = padded(first, stride_, rows_, kNan);
    fields->dual_x = padded(cv::Mat(), stride_, rows_, 0.0F);
    fields->dual_y = padded(cv::Mat(), stride_, rows_, 0.0F);
  }
}

void PrimalDualSolver::iterateBand(int first_row, int last_row, const Fields& from, Fields* to) const {
  // Each iteration makes one more row beside the band invalid; those rows are discarded.
  const int begin = std::max(0, first_row - kIterationsAtOnce);
  const int end = std::min(rows_, last_row + kIterationsAtOnce);
  thread_local Fields scratch;
  const size_t size = static_cast<size_t>(end - begin + 2) * stride_;
  const std::array<AlignedArray<float> Fields::*, 4> members = {&Fields::value, &Fields::extrapolated,
                                                                &Fields::dual_x, &Fields::dual_y};
  for (const auto member : members) {
    (scratch.*member).resize(size);
    std::copy_n((from.*member).data() + static_cast<size_t>(begin) * stride_, size, (scratch.*member).data());
  }
  const PrimalDualSteps steps{primal_step_,
                              dual_step_,
                              1.0F / (1.0F + dual_step_ * problem_.epsilon),
                              primal_step_ * problem_.below,
                              primal_step_ * problem_.above,
                              problem_.low,
                              problem_.high};
  static const IterateRow iterateRow = iterateRowKernel();
  const int count = end - begin;
  for (int front = 0; front < count + kIterationsAtOnce - 1; ++front) {
    // Each iteration follows one row behind the previous one.
    for (int behind = 0; behind < kIterationsAtOnce; ++behind) {
      const int row = front - behind;
      if (row < 0 || row >= count) {
        continue;
      }
      const size_t at = static_cast<size_t>(row + 1) * stride_ + kRowPadding;
      const size_t data = offset(begin + row) + kRowPadding;
      iterateRow({scratch.value.data() + at, scratch.extrapolated.data() + at,
                  scratch.extrapolated.data() + at + stride_, scratch.dual_x.data() + at,
                  scratch.dual_y.data() + at, scratch.dual_y.data() + at - stride_, floor_.data() + data,
                  ceiling_.data() + data, slope_.data() + data, weight_below_.data() + data,
                  weight_above_.data() + data, stride_ - 2 * kRowPadding},
                 steps);
    }
  }
  for (const auto member : members) {
    std::copy_n((scratch.*member).data() + static_cast<size_t>(first_row - begin + 1) * stride_,
                static_cast<size_t>(last_row - first_row) * stride_,
                (to->*member).data() + offset(first_row));
  }
}

void PrimalDualSolver::iterate() {
  tbb::parallel_for(0, (rows_ + kBandRows - 1) / kBandRows, [&](int band) {
    iterateBand(band * kBandRows, std::min(rows_, (band + 1) * kBandRows), now_, &next_);
  });
  std::swap(now_, next_);
  iterations_ += kIterationsAtOnce;
}

double PrimalDualSolver::rowEnergy(int row, double* dual) const {
  const size_t at = offset(row) + kRowPadding;
  const float* value = now_.value.data() + at;
  const float* next_row = value + stride_;
  const float* dual_x = now_.dual_x.data() + at;
  const float* dual_y = now_.dual_y.data() + at;
  const double epsilon = problem_.epsilon, low = problem_.low, high = problem_.high;
  double primal = 0.0;
  *dual = 0.0;
  for (int i = 0; i < columns_; ++i) {
    const double floor = floor_[at + i], ceiling = ceiling_[at + i], slope = slope_[at + i];
    if (std::isnan(floor)) {
      continue;
    }
    const auto cost = [&](double u) {
      return weight_below_[at + i] * problem_.below * std::max(0.0, floor - u) +
             weight_above_[at + i] * problem_.above * std::max(0.0, u - ceiling) + slope * u;
    };
    const double by_x = std::isnan(value[i + 1]) ? 0.0 : value[i + 1] - value[i];
    const double by_y = std::isnan(next_row[i]) ? 0.0 : next_row[i] - value[i];
    const double norm = std::hypot(by_x, by_y);
    primal += (norm < epsilon ? norm * norm / (2.0 * epsilon) : norm - 0.5 * epsilon) + cost(value[i]);
    // Conjugate of the Huber norm, and minimum of the data cost plus the linear term of the divergence.
    const double line = -(static_cast<double>(dual_x[i]) - dual_x[i - 1] + dual_y[i] -
                          dual_y[static_cast<std::ptrdiff_t>(i) - static_cast<std::ptrdiff_t>(stride_)]);
    const auto lagrangian = [&](double u) { return cost(u) + line * u; };
    const double least =
        std::min({lagrangian(low), lagrangian(high), lagrangian(std::clamp(floor, low, high)),
                  lagrangian(std::clamp(ceiling, low, high))});
    *dual +=
        least - 0.5 * epsilon *
                    (static_cast<double>(dual_x[i]) * dual_x[i] + static_cast<double>(dual_y[i]) * dual_y[i]);
  }
  return primal;
}

PrimalDualReport PrimalDualSolver::evaluate() const {
  std::vector<double> primal(static_cast<size_t>(rows_)), dual(static_cast<size_t>(rows_));
  tbb::parallel_for(size_t{0}, primal.size(),
                    [&](size_t row) { primal[row] = rowEnergy(static_cast<int>(row), &dual[row]); });
  PrimalDualReport report;
  report.iterations = iterations_;
  for (size_t row = 0; row < primal.size(); ++row) {
    report.primal_energy += primal[row];
    report.gap += primal[row] - dual[row];
  }
  return report;
}

cv::Mat PrimalDualSolver::values() const {
  cv::Mat image(rows_, columns_, CV_32FC1);
  for (int row = 0; row < rows_; ++row) {
    std::copy_n(now_.value.data() + offset(row) + kRowPadding, columns_, image.ptr<float>(row));
  }
  return image;
}

cv::Mat solveVariational(const VariationalProblem& problem, const cv::Mat& start,
                         const PrimalDualSettings& settings, PrimalDualReport* report) {
  PrimalDualSolver solver(problem, start, settings.step_ratio);
  const double enough = settings.max_gap_per_cell * std::max(1, solver.numCells());
  *report = solver.evaluate();
  while (report->gap > enough && report->iterations < settings.max_iterations) {
    for (int i = 0; i < kIterationsPerCheck; i += PrimalDualSolver::kIterationsAtOnce) {
      solver.iterate();
    }
    *report = solver.evaluate();
  }
  report->converged = report->gap <= enough;
  return solver.values();
}

}  // namespace vcharge
