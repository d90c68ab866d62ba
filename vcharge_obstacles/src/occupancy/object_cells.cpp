#include "occupancy/object_cells.h"

#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

// Objects are known no better than this.
constexpr double kMargin_m = 0.2;
// Corners are drawn with this number of binary digits of a cell.
constexpr int kShift = 6;

}  // namespace

void forgetFreeUnder(const std::vector<TrackedObject>& objects, ObstacleMap* map) {
  if (objects.empty()) {
    return;
  }
  cv::Mat covered = cv::Mat::zeros(map->state.size(), CV_8UC1);
  for (const TrackedObject& object : objects) {
    std::vector<cv::Point> corners;
    for (const Eigen::Vector2d& corner_m : object.footprint_m) {
      // In cv::fillConvexPoly, whole numbers are the middles of pixels.
      const Eigen::Vector2d cell =
          (corner_m - map->origin_m) / map->cell_size_m - Eigen::Vector2d::Constant(0.5);
      corners.emplace_back(cvRound(cell.x() * (1 << kShift)), cvRound(cell.y() * (1 << kShift)));
    }
    if (corners.size() >= 3) {
      cv::fillConvexPoly(covered, corners, cv::Scalar(255), cv::LINE_8, kShift);
    }
  }
  const int margin = cvCeil(kMargin_m / map->cell_size_m - 1e-6);
  const cv::Size window(2 * margin + 1, 2 * margin + 1);
  cv::dilate(covered, covered, cv::getStructuringElement(cv::MORPH_ELLIPSE, window));
  map->state.setTo(kCellUnobserved, covered & (map->state == kCellFree));
}

}  // namespace vcharge
