#include "vcharge_core/dense_maps/height_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"

namespace vcharge {
namespace {

/// Smoothing spreads a step over cells up to this distance.
constexpr double kStepReach_m = 0.1;
/// Length over which the slope is measured.
constexpr double kSlopeReach_m = 0.3;
/// Cells with a lower confidence are interpolated from their neighbours, for example under a parked car.
constexpr double kMinConfidence = 0.01;

/// Difference between the largest and smallest known heights within `reach` cells, along rows and columns.
float spread(const cv::Mat& height_m, int row, int column, int reach) {
  float low = height_m.at<float>(row, column), high = low;
  const auto take = [&](int r, int c) {
    if (r >= 0 && r < height_m.rows && c >= 0 && c < height_m.cols) {
      const float height = height_m.at<float>(r, c);
      low = height < low ? height : low;  // ignores NaN
      high = height > high ? height : high;
    }
  };
  for (int i = -reach; i <= reach; ++i) {
    take(row, column + i);
    take(row + i, column);
  }
  return high - low;
}

/// Slope between the known cells `reach` before and after; 0 if one of them is unknown.
float slopeAlong(const cv::Mat& height_m, int row, int column, int row_step, int column_step, float run_m) {
  const int r0 = row - row_step, r1 = row + row_step, c0 = column - column_step, c1 = column + column_step;
  if (r0 < 0 || c0 < 0 || r1 >= height_m.rows || c1 >= height_m.cols) {
    return 0.0F;
  }
  const float rise = std::abs(height_m.at<float>(r1, c1) - height_m.at<float>(r0, c0));
  return std::isfinite(rise) ? rise / run_m : 0.0F;
}

}  // namespace

void addToHash(const HeightMap& map, ContentHasher* hasher) {
  hasher->add(map.frame_id);
  hasher->add(map.origin_m.x());
  hasher->add(map.origin_m.y());
  hasher->add(map.cell_size_m);
  hasher->add(static_cast<int64_t>(map.height_m.rows));
  hasher->add(static_cast<int64_t>(map.height_m.cols));
  for (const cv::Mat* image : {&map.height_m, &map.confidence}) {
    for (int row = 0; row < image->rows; ++row) {
      for (int column = 0; column < image->cols; ++column) {
        hasher->add(static_cast<double>(image->at<float>(row, column)));
      }
    }
  }
  for (const cv::Mat* image : {&map.gray, &map.solid}) {
    for (int row = 0; row < image->rows; ++row) {
      hasher->addBytes(image->ptr(row), static_cast<size_t>(image->cols));
    }
  }
}

double interpolateHeight(const HeightMap& map, const Eigen::Vector2d& position_m) {
  const Eigen::Vector2d cell = (position_m - map.origin_m) / map.cell_size_m;
  const double column = std::floor(cell.x()), row = std::floor(cell.y());
  if (!(column >= 0.0 && row >= 0.0 && column + 1.0 < map.height_m.cols && row + 1.0 < map.height_m.rows)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto c = static_cast<int>(column), r = static_cast<int>(row);
  const double x = cell.x() - column, y = cell.y() - row;
  const auto* low = map.height_m.ptr<float>(r) + c;
  const auto* high = map.height_m.ptr<float>(r + 1) + c;
  return (1.0 - y) * ((1.0 - x) * low[0] + x * low[1]) + y * ((1.0 - x) * high[0] + x * high[1]);
}

cv::Mat classifyCells(const HeightMap& map, const DrivabilityOptions& options) {
  options.validate();
  const int reach = std::max(1, static_cast<int>(std::lround(kStepReach_m / map.cell_size_m)));
  const int slope_reach = std::max(1, static_cast<int>(std::lround(0.5 * kSlopeReach_m / map.cell_size_m)));
  const auto run_m = static_cast<float>(2.0 * slope_reach * map.cell_size_m);
  cv::Mat states(map.height_m.size(), CV_8UC1);
  for (int row = 0; row < states.rows; ++row) {
    for (int column = 0; column < states.cols; ++column) {
      CellState state = CellState::kUnobserved;
      if (std::isfinite(map.height_m.at<float>(row, column))) {
        const float slope = std::hypot(slopeAlong(map.height_m, row, column, slope_reach, 0, run_m),
                                       slopeAlong(map.height_m, row, column, 0, slope_reach, run_m));
        const bool blocked =
            spread(map.height_m, row, column, reach) > options.max_step_m || slope > options.max_slope;
        const bool is_sure =
            map.confidence.empty() || map.confidence.at<float>(row, column) >= kMinConfidence;
        state = blocked ? CellState::kObstacle : is_sure ? CellState::kDrivable : CellState::kUnobserved;
      } else if (!map.solid.empty() && map.solid.at<uint8_t>(row, column) != 0) {
        state = CellState::kObstacle;
      }
      states.at<uint8_t>(row, column) = static_cast<uint8_t>(state);
    }
  }
  return states;
}

}  // namespace vcharge
