#include "boards/edge_width.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vcharge_core/base/quantile.h"

namespace vcharge {

namespace {

constexpr double kReach_px = 6.0;
constexpr double kStep_px = 0.5;
constexpr double kMinContrast = 20.0;

double sample(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  const int x = static_cast<int>(std::floor(pixel.x()));
  const int y = static_cast<int>(std::floor(pixel.y()));
  if (x < 0 || y < 0 || x + 1 >= image.cols || y + 1 >= image.rows) {
    return -1.0;
  }
  const double a = pixel.x() - x;
  const double b = pixel.y() - y;
  return (1 - b) * ((1 - a) * image.at<uint8_t>(y, x) + a * image.at<uint8_t>(y, x + 1)) +
         b * ((1 - a) * image.at<uint8_t>(y + 1, x) + a * image.at<uint8_t>(y + 1, x + 1));
}

}  // namespace

namespace {

// Width of the edge through `middle` (metres on the board) in the direction `along`; 0 if it cannot be
// measured.
double widthAt(const cv::Mat& image, const CalibrationBoard& board, const PosedBoard& posed,
               const CameraModel& model, const Eigen::Vector2d& middle, const Eigen::Vector2d& across_m) {
  Eigen::Vector2d at;
  Eigen::Vector2d towards;
  if (!model.project(posed.point(board, middle), &at) ||
      !model.project(posed.point(board, middle + across_m), &towards)) {
    return 0.0;
  }
  const double clearance_px = (towards - at).norm() * board.clearance_m() / across_m.norm();
  const double reach_px = std::min(kReach_px, 0.4 * clearance_px);
  if (reach_px < 2.0) {
    return 0.0;
  }
  const Eigen::Vector2d across = (towards - at).normalized();
  double sum = 0.0;
  double first = 0.0;
  double second = 0.0;
  double last_value = sample(image, at - reach_px * across);
  const double start = last_value;
  for (double s = -reach_px + kStep_px; s <= reach_px; s += kStep_px) {
    const double value = sample(image, at + s * across);
    if (value < 0.0 || last_value < 0.0) {
      return 0.0;
    }
    const double slope = value - last_value;
    const double position_px = s - 0.5 * kStep_px;
    sum += slope;
    first += slope * position_px;
    second += slope * position_px * position_px;
    last_value = value;
  }
  if (std::abs(last_value - start) < kMinContrast) {
    return 0.0;
  }
  const double variance = second / sum - (first / sum) * (first / sum);
  return variance > 0.0 ? 2.0 * std::sqrt(variance) : 0.0;
}

double medianOf(const std::vector<double>& values) {
  return values.empty() ? 0.0 : quantile(values, 0.5);
}

}  // namespace

double edgeWidth(const cv::Mat& image, const CalibrationBoard& board, const BoardView& view,
                 const PosedBoard& posed, const CameraModel& model) {
  // Motion blurs only edges of one direction.
  std::vector<double> along_rows;
  std::vector<double> along_columns;
  const double step_m = 0.1 * board.clearance_m();
  const auto add = [&](int index, int next, const Eigen::Vector2d& across_m, std::vector<double>* widths) {
    const Eigen::Vector2d middle = 0.5 * (board.corner(index) + board.corner(next)).head<2>();
    const double width_px = widthAt(image, board, posed, model, middle, across_m);
    if (width_px > 0.0) {
      widths->push_back(width_px);
    }
  };
  for (const BoardCorner& corner : view.corners) {
    if (corner.index % board.columns + 1 < board.columns) {
      add(corner.index, corner.index + 1, {0.0, step_m}, &along_rows);
    }
    if (corner.index + board.columns < board.numCorners()) {
      add(corner.index, corner.index + board.columns, {step_m, 0.0}, &along_columns);
    }
  }
  return std::max(medianOf(along_rows), medianOf(along_columns));
}

}  // namespace vcharge
