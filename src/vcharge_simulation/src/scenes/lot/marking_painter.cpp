#include "scenes/lot/marking_painter.h"

#include <cmath>

#include <opencv2/imgproc.hpp>

namespace vcharge {

MarkingPainter::MarkingPainter(const GroundRectangle& area, double texel_m)
    : area_(area),
      texel_m_(texel_m),
      image_(cv::Mat::zeros(static_cast<int>(std::lround(area.depth() / texel_m)),
                            static_cast<int>(std::lround(area.width() / texel_m)), CV_8UC1)) {}

cv::Point MarkingPainter::at(double x, double y) const {
  // Three fractional bits allow line ends between texels.
  return {static_cast<int>(std::lround((x - area_.min_x) / texel_m_ * 8.0)),
          static_cast<int>(std::lround((y - area_.min_y) / texel_m_ * 8.0))};
}

void MarkingPainter::polygon(const std::vector<Eigen::Vector2d>& points, double value) {
  std::vector<cv::Point> corners;
  for (const Eigen::Vector2d& point : points) {
    corners.push_back(at(point.x(), point.y()));
  }
  cv::fillPoly(image_, std::vector<std::vector<cv::Point>>{corners}, cv::Scalar(value), cv::LINE_AA, 3);
}

void MarkingPainter::line(double x0, double y0, double x1, double y1, double width) {
  const Eigen::Vector2d from(x0, y0);
  const Eigen::Vector2d to(x1, y1);
  const Eigen::Vector2d along = (to - from).normalized();
  const Eigen::Vector2d across(-along.y() * 0.5 * width, along.x() * 0.5 * width);
  polygon({from - across, to - across, to + across, from + across}, 255);
}

void MarkingPainter::dashed(double x0, double y0, double x1, double y1, double width, double dash,
                            double gap) {
  const Eigen::Vector2d from(x0, y0);
  const double length = std::hypot(x1 - x0, y1 - y0);
  const Eigen::Vector2d along(Eigen::Vector2d(x1 - x0, y1 - y0) / length);
  for (double s = 0.0; s + dash < length; s += dash + gap) {
    const Eigen::Vector2d a = from + s * along;
    const Eigen::Vector2d b = a + dash * along;
    line(a.x(), a.y(), b.x(), b.y(), width);
  }
}

void MarkingPainter::arrow(double x, double y, double yaw_rad) {
  const Eigen::Vector2d f(std::cos(yaw_rad), std::sin(yaw_rad));
  const Eigen::Vector2d l(-f.y(), f.x());
  const Eigen::Vector2d o(x, y);
  polygon({o - 1.2 * f - 0.08 * l, o + 0.3 * f - 0.08 * l, o + 0.3 * f + 0.08 * l, o - 1.2 * f + 0.08 * l},
          255);
  polygon({o + 0.3 * f - 0.3 * l, o + 1.2 * f, o + 0.3 * f + 0.3 * l}, 255);
}

void MarkingPainter::text(const std::string& text, double x, double y, double yaw_rad, double height_m) {
  const int font = cv::FONT_HERSHEY_SIMPLEX;
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, font, 2.0, 6, &baseline);
  cv::Mat glyphs = cv::Mat::zeros(size.height + 20, size.width + 20, CV_8UC1);
  cv::putText(glyphs, text, cv::Point(10, size.height + 8), font, 2.0, cv::Scalar(255), 6, cv::LINE_AA);
  const double scale = height_m / size.height / texel_m_;
  const double c = std::cos(yaw_rad) * scale;
  const double s = std::sin(yaw_rad) * scale;
  // Image x runs to the right of the reading direction, image y against it; rows of the ground grow with y.
  const double cx = (x - area_.min_x) / texel_m_;
  const double cy = (y - area_.min_y) / texel_m_;
  const double gx = 0.5 * glyphs.cols;
  const double gy = 0.5 * glyphs.rows;
  const cv::Matx23d affine(s, -c, cx - s * gx + c * gy, -c, -s, cy + c * gx + s * gy);
  const int half = static_cast<int>(0.5 * std::hypot(glyphs.cols, glyphs.rows) * scale) + 2;
  const cv::Rect window =
      cv::Rect(static_cast<int>(cx) - half, static_cast<int>(cy) - half, 2 * half, 2 * half) &
      cv::Rect(0, 0, image_.cols, image_.rows);
  cv::Matx23d shifted = affine;
  shifted(0, 2) -= window.x;
  shifted(1, 2) -= window.y;
  cv::Mat warped;
  cv::warpAffine(glyphs, warped, shifted, window.size(), cv::INTER_AREA);
  cv::Mat target = image_(window);
  cv::max(target, warped, target);
}

void MarkingPainter::manhole(double x, double y, double radius) {
  const int shift = 3;
  const auto texels = [&](double metres) { return static_cast<int>(metres / texel_m_ * 8.0); };
  cv::circle(image_, at(x, y), texels(radius), cv::Scalar(128), cv::FILLED, cv::LINE_AA, shift);
  cv::circle(image_, at(x, y), texels(radius * 0.85), cv::Scalar(60), 2, cv::LINE_AA, shift);
  for (double offset = -0.6 * radius; offset <= 0.61 * radius; offset += 0.2 * radius) {
    cv::line(image_, at(x - 0.5 * radius, y + offset), at(x + 0.5 * radius, y + offset), cv::Scalar(40), 2,
             cv::LINE_AA, shift);
  }
}

}  // namespace vcharge
