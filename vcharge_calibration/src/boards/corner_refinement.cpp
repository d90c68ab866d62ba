#include "boards/corner_refinement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <opencv2/imgproc.hpp>

namespace vcharge {

namespace {

constexpr double kWindowOverSpacing = 0.45;
constexpr int kMinHalfWindow_px = 2;
constexpr int kMaxHalfWindow_px = 20;
constexpr double kMaxMoveOverSpacing = 0.33;

}  // namespace

bool refineCorner(const cv::Mat& image, double half_window_px, double max_move_px, Eigen::Vector2d* pixel) {
  const int half = std::clamp(static_cast<int>(half_window_px), kMinHalfWindow_px, kMaxHalfWindow_px);
  const double margin_px = half + 2.0;
  if (!(pixel->x() >= margin_px && pixel->y() >= margin_px && pixel->x() <= image.cols - 1 - margin_px &&
        pixel->y() <= image.rows - 1 - margin_px)) {
    return false;
  }
  std::vector<cv::Point2f> point = {{static_cast<float>(pixel->x()), static_cast<float>(pixel->y())}};
  cv::cornerSubPix(image, point, cv::Size(half, half), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 60, 1e-4));
  const Eigen::Vector2d moved(point[0].x, point[0].y);
  if (!((moved - *pixel).norm() < max_move_px)) {
    return false;
  }
  *pixel = moved;
  return true;
}

void refineCorners(const cv::Mat& image, const CalibrationBoard& board, std::vector<BoardCorner>* corners) {
  std::map<int, Eigen::Vector2d> by_index;
  for (const BoardCorner& corner : *corners) {
    by_index[corner.index] = corner.pixel;
  }
  std::vector<BoardCorner> refined;
  for (const BoardCorner& corner : *corners) {
    const int column = corner.index % board.columns;
    double spacing_px = std::numeric_limits<double>::infinity();
    const auto compare = [&](int index, bool exists) {
      const auto neighbour = exists ? by_index.find(index) : by_index.end();
      if (neighbour != by_index.end()) {
        spacing_px = std::min(spacing_px, (neighbour->second - corner.pixel).norm());
      }
    };
    compare(corner.index - 1, column > 0);
    compare(corner.index + 1, column + 1 < board.columns);
    compare(corner.index - board.columns, true);
    compare(corner.index + board.columns, true);
    if (!std::isfinite(spacing_px)) {
      continue;
    }
    Eigen::Vector2d pixel = corner.pixel;
    if (refineCorner(image, kWindowOverSpacing * spacing_px, kMaxMoveOverSpacing * spacing_px, &pixel)) {
      refined.push_back({corner.index, pixel});
    }
  }
  *corners = refined;
}

}  // namespace vcharge
