#include "vcharge_calibration/intrinsics/collector_picture.h"

#include <opencv2/imgproc.hpp>

namespace vcharge {

cv::Mat drawCollected(const cv::Mat& image, const ViewCollector& collector) {
  cv::Mat picture = image.clone();
  ImageCoverage coverage(image.size());
  for (const BoardView& view : collector.views()) {
    coverage.add(view);
  }
  for (int row = 0; row < ImageCoverage::kRows; ++row) {
    for (int column = 0; column < ImageCoverage::kColumns; ++column) {
      if (coverage.count(column, row) == 0) {
        const int x = column * image.cols / ImageCoverage::kColumns;
        const int y = row * image.rows / ImageCoverage::kRows;
        cv::Mat cell = picture(cv::Rect(x, y, (column + 1) * image.cols / ImageCoverage::kColumns - x,
                                        (row + 1) * image.rows / ImageCoverage::kRows - y));
        cell.convertTo(cell, CV_8U, 0.5);
      }
    }
  }
  const auto draw = [&](const BoardCorner& corner, int radius, int thickness) {
    constexpr int kShift = 4;
    const cv::Point at(static_cast<int>(std::lround(corner.pixel.x() * (1 << kShift))),
                       static_cast<int>(std::lround(corner.pixel.y() * (1 << kShift))));
    cv::circle(picture, at, radius << kShift, cv::Scalar(255), thickness, cv::LINE_AA, kShift);
  };
  for (const BoardView& view : collector.views()) {
    for (const BoardCorner& corner : view.corners) {
      draw(corner, 1, cv::FILLED);
    }
  }
  if (collector.lastView().has_value()) {
    for (const BoardCorner& corner : collector.lastView()->corners) {
      draw(corner, 6, 2);
    }
  }
  return picture;
}

}  // namespace vcharge
