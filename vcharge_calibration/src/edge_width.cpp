#include "edge_width.h"

#include <algorithm>
#include <cmath>
#include <vector>

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

double edgeWidth(const cv::Mat& image, const CalibrationBoard& board, const BoardView& view,
                 const PlacedBoard& placed, const CameraModel& model) {
  std::vector<double> widths_px;
  for (const BoardCorner& corner : view.corners) {
    const bool last = corner.index % board.columns + 1 == board.columns;
    if (last) {
      continue;
    }
    // Across the edge between this corner and the next in its row.
    const Eigen::Vector2d middle =
        0.5 * (board.corner(corner.index) + board.corner(corner.index + 1)).head<2>();
    const Eigen::Vector2d beside = middle + Eigen::Vector2d(0.0, 0.1 * board.square_m);
    Eigen::Vector2d at;
    Eigen::Vector2d towards;
    if (!model.project(placed.point(board, middle), &at) ||
        !model.project(placed.point(board, beside), &towards)) {
      continue;
    }
    const double square_px = 10.0 * (towards - at).norm();
    const double reach_px = std::min(kReach_px, 0.4 * square_px * board.clearance_m() / board.square_m);
    if (reach_px < 2.0) {
      continue;
    }
    const Eigen::Vector2d across = (towards - at).normalized();
    double sum = 0.0;
    double first = 0.0;
    double second = 0.0;
    bool inside = true;
    double last_value = sample(image, at - reach_px * across);
    const double start = last_value;
    for (double s = -reach_px + kStep_px; s <= reach_px && inside; s += kStep_px) {
      const double value = sample(image, at + s * across);
      inside = value >= 0.0 && last_value >= 0.0;
      const double slope = value - last_value;
      const double place = s - 0.5 * kStep_px;
      sum += slope;
      first += slope * place;
      second += slope * place * place;
      last_value = value;
    }
    if (!inside || std::abs(last_value - start) < kMinContrast) {
      continue;
    }
    const double variance = second / sum - (first / sum) * (first / sum);
    if (variance > 0.0) {
      widths_px.push_back(2.0 * std::sqrt(variance));
    }
  }
  if (widths_px.empty()) {
    return 0.0;
  }
  const auto middle = widths_px.begin() + static_cast<std::ptrdiff_t>(widths_px.size() / 2);
  std::nth_element(widths_px.begin(), middle, widths_px.end());
  return *middle;
}

}  // namespace vcharge
