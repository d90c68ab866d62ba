#include "steps/step_finder.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/wide_loops.h"

namespace vcharge {
namespace {

// Matching windows round off edges, so that a step is measured lower than it is.
constexpr float kMeasuredFraction = 0.8F;
// A difference of heights is real from this number of standard deviations on.
constexpr float kSureSigmas = 3.0F;
// Cells beside a step see part of its rise. Those within this distance that see less than this fraction are
// not marked, so that a step is where it is steepest.
constexpr int kThinningCells = 2;
constexpr float kThinningFraction = 0.67F;

/// Offset between two cells, one for each pair of opposite directions.
struct Offset {
  int columns, rows;
  float min_rise_m;  ///< rise over this distance that is a step
};

std::vector<Offset> offsetsWithin(double run_m, double cell_size_m, const StepMapperOptions& options) {
  std::vector<Offset> offsets;
  const int reach = static_cast<int>(std::floor(run_m / cell_size_m + 1e-6));
  for (int rows = 0; rows <= reach; ++rows) {
    for (int columns = -reach; columns <= reach; ++columns) {
      const double distance_m = cell_size_m * std::hypot(columns, rows);
      if ((rows > 0 || columns > 0) && distance_m <= run_m + 1e-6) {
        const double rise_m =
            std::max(kMeasuredFraction * options.min_step_m, options.max_slope * distance_m);
        offsets.push_back({columns, rows, static_cast<float>(rise_m)});
      }
    }
  }
  return offsets;
}

/// Whether two heights of a pair differ by at least this; not where one of them is unknown (NaN).
VCHARGE_WIDE_LOOPS bool anyRise(const float* here_m, const float* there_m, int count, float min_rise_m) {
  int rises = 0;
  for (int i = 0; i < count; ++i) {
    rises += std::abs(there_m[i] - here_m[i]) >= min_rise_m ? 1 : 0;
  }
  return rises > 0;
}

/// Sets the height of the cells halfway between the two sides of each step; the highest counts.
void markSteps(const StepMapperOptions& options, const cv::Mat& ground_m, const cv::Mat& ground_sigma_m,
               StepMap* map) {
  for (const Offset& offset : offsetsWithin(StepMapper::kMaxRun_m, map->cell_size_m, options)) {
    const int first_column = std::max(0, -offset.columns);
    const int end_column = std::min(ground_m.cols, ground_m.cols - offset.columns);
    for (int row = 0; row + offset.rows < ground_m.rows; ++row) {
      const auto* here_m = ground_m.ptr<float>(row);
      const auto* there_m = ground_m.ptr<float>(row + offset.rows);
      if (!anyRise(here_m + first_column, there_m + first_column + offset.columns, end_column - first_column,
                   offset.min_rise_m)) {
        continue;
      }
      for (int column = first_column; column < end_column; ++column) {
        const float rise_m = std::abs(there_m[column + offset.columns] - here_m[column]);
        if (!(rise_m >= offset.min_rise_m)) {  // also if one of them is not known
          continue;
        }
        const float sigma_m =
            std::hypot(ground_sigma_m.at<float>(row, column),
                       ground_sigma_m.at<float>(row + offset.rows, column + offset.columns));
        float& height_m = map->height_m.at<float>(row + offset.rows / 2, column + offset.columns / 2);
        if (rise_m >= kSureSigmas * sigma_m && !(height_m >= rise_m)) {
          height_m = rise_m;
          map->sigma_m.at<float>(row + offset.rows / 2, column + offset.columns / 2) = sigma_m;
        }
      }
    }
  }
}

/// True for marked cells that belong to too small a step, or to the flank of a higher one.
cv::Mat cellsToDrop(const cv::Mat& height_m) {
  const cv::Mat is_step = height_m > 0.0F;
  cv::Mat step_m = cv::Mat::zeros(height_m.size(), CV_32FC1);
  height_m.copyTo(step_m, is_step);
  cv::Mat highest_m;
  const int window = 2 * kThinningCells + 1;
  cv::dilate(step_m, highest_m, cv::getStructuringElement(cv::MORPH_RECT, {window, window}));
  cv::Mat drop = (step_m < kThinningFraction * highest_m) & is_step;
  cv::Mat labels, statistics, centroids;
  cv::connectedComponentsWithStats(is_step, labels, statistics, centroids, 8, CV_32S);
  for (int row = 0; row < labels.rows; ++row) {
    for (int column = 0; column < labels.cols; ++column) {
      const int label = labels.at<int>(row, column);
      if (label > 0 && statistics.at<int>(label, cv::CC_STAT_AREA) < StepMapper::kMinStepCells) {
        drop.at<uint8_t>(row, column) = 255;
      }
    }
  }
  return drop;
}

}  // namespace

void findSteps(const StepMapperOptions& options, StepMap* map) {
  const cv::Mat ground_sigma_m = map->sigma_m.clone();
  const cv::Mat even_m = cv::abs(map->ground_m) * 0.0F;  // NaN where the ground is unknown
  even_m.copyTo(map->height_m);
  markSteps(options, map->ground_m, ground_sigma_m, map);
  const cv::Mat drop = cellsToDrop(map->height_m);
  even_m.copyTo(map->height_m, drop);
  ground_sigma_m.copyTo(map->sigma_m, drop);
}

}  // namespace vcharge
