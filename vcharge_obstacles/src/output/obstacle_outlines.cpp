#include "vcharge_obstacles/obstacle_outlines.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

// Contours run through pixel middles; with three pixels per cell they lie near the cells' borders.
constexpr int kPixelsPerCell = 3;

}  // namespace

std::vector<ObstacleOutline> findOutlines(const ObstacleMap& map) {
  const cv::Mat occupied = map.state == kCellOccupied;
  cv::Mat large;
  cv::resize(occupied, large, cv::Size(), kPixelsPerCell, kPixelsPerCell, cv::INTER_NEAREST);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(large, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_SIMPLE);
  cv::Mat labels;
  const int count = cv::connectedComponents(occupied, labels, 8);
  std::vector<double> heights_m(static_cast<size_t>(count), 0.0);
  for (int row = 0; row < labels.rows; ++row) {
    for (int column = 0; column < labels.cols; ++column) {
      double& height_m = heights_m[static_cast<size_t>(labels.at<int>(row, column))];
      const float here_m = map.height_m.at<float>(row, column);
      height_m = here_m > height_m ? here_m : height_m;
    }
  }
  std::vector<ObstacleOutline> outlines;
  for (const std::vector<cv::Point>& contour : contours) {
    ObstacleOutline outline;
    const cv::Rect box = cv::boundingRect(contour);
    const Eigen::Vector2d middle(box.x + 0.5 * (box.width - 1), box.y + 0.5 * (box.height - 1));
    for (const cv::Point& pixel : contour) {
      // Move from the pixel's middle to its outer corner, so that the outline encloses the cells.
      const Eigen::Vector2d outward((pixel.x > middle.x()) - (pixel.x < middle.x()),
                                    (pixel.y > middle.y()) - (pixel.y < middle.y()));
      const Eigen::Vector2d corner = Eigen::Vector2d(pixel.x + 0.5, pixel.y + 0.5) + 0.5 * outward;
      outline.corners_m.push_back(map.origin_m + map.cell_size_m / kPixelsPerCell * corner);
    }
    const int label = labels.at<int>(contour[0].y / kPixelsPerCell, contour[0].x / kPixelsPerCell);
    outline.height_m = heights_m[static_cast<size_t>(label)];
    outlines.push_back(outline);
  }
  return outlines;
}

}  // namespace vcharge
