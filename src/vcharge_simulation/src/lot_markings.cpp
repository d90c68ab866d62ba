#include <cmath>

#include <opencv2/imgproc.hpp>

#include "lot_ground.h"
#include "vcharge_simulation/noise.h"

namespace vcharge {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;

// Draws in metres on an image whose row 0 is at min_y.
class MarkingPainter {
 public:
  explicit MarkingPainter(double texel_m)
      : texel_m_(texel_m),
        image_(cv::Mat::zeros(static_cast<int>(std::lround(kLotArea.depth() / texel_m)),
                              static_cast<int>(std::lround(kLotArea.width() / texel_m)), CV_8UC1)) {}

  cv::Point at(double x, double y) const {
    // Three fractional bits keep line ends off the texel grid.
    return {static_cast<int>(std::lround((x - kLotArea.min_x) / texel_m_ * 8.0)),
            static_cast<int>(std::lround((y - kLotArea.min_y) / texel_m_ * 8.0))};
  }
  void polygon(const std::vector<Eigen::Vector2d>& points, double value) {
    std::vector<cv::Point> corners;
    for (const Eigen::Vector2d& point : points) {
      corners.push_back(at(point.x(), point.y()));
    }
    cv::fillPoly(image_, std::vector<std::vector<cv::Point>>{corners}, cv::Scalar(value), cv::LINE_AA, 3);
  }
  void line(double x0, double y0, double x1, double y1, double width) {
    const Eigen::Vector2d from(x0, y0);
    const Eigen::Vector2d to(x1, y1);
    const Eigen::Vector2d along = (to - from).normalized();
    const Eigen::Vector2d across(-along.y() * 0.5 * width, along.x() * 0.5 * width);
    polygon({from - across, to - across, to + across, from + across}, 255);
  }
  void dashed(double x0, double y0, double x1, double y1, double width, double dash, double gap) {
    const Eigen::Vector2d from(x0, y0);
    const double length = std::hypot(x1 - x0, y1 - y0);
    const Eigen::Vector2d along(Eigen::Vector2d(x1 - x0, y1 - y0) / length);
    for (double s = 0.0; s + dash < length; s += dash + gap) {
      const Eigen::Vector2d a = from + s * along;
      const Eigen::Vector2d b = a + dash * along;
      line(a.x(), a.y(), b.x(), b.y(), width);
    }
  }
  void arrow(double x, double y, double yaw_rad) {
    const Eigen::Vector2d f(std::cos(yaw_rad), std::sin(yaw_rad));
    const Eigen::Vector2d l(-f.y(), f.x());
    const Eigen::Vector2d o(x, y);
    polygon({o - 1.2 * f - 0.08 * l, o + 0.3 * f - 0.08 * l, o + 0.3 * f + 0.08 * l, o - 1.2 * f + 0.08 * l},
            255);
    polygon({o + 0.3 * f - 0.3 * l, o + 1.2 * f, o + 0.3 * f + 0.3 * l}, 255);
  }
  // Text of the given height that reads from the side that `yaw_rad` points away from.
  void text(const std::string& text, double x, double y, double yaw_rad, double height_m) {
    const int font = cv::FONT_HERSHEY_SIMPLEX;
    int baseline = 0;
    const cv::Size size = cv::getTextSize(text, font, 2.0, 6, &baseline);
    cv::Mat glyphs = cv::Mat::zeros(size.height + 20, size.width + 20, CV_8UC1);
    cv::putText(glyphs, text, cv::Point(10, size.height + 8), font, 2.0, cv::Scalar(255), 6, cv::LINE_AA);
    const double scale = height_m / size.height / texel_m_;
    const double c = std::cos(yaw_rad) * scale;
    const double s = std::sin(yaw_rad) * scale;
    // Image x runs to the right of the reading direction, image y against it; rows of the ground count up
    // with y.
    const double cx = (x - kLotArea.min_x) / texel_m_;
    const double cy = (y - kLotArea.min_y) / texel_m_;
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
  void manhole(double x, double y, double radius) {
    const int shift = 3;
    const auto texels = [&](double metres) { return static_cast<int>(metres / texel_m_ * 8.0); };
    cv::circle(image_, at(x, y), texels(radius), cv::Scalar(128), cv::FILLED, cv::LINE_AA, shift);
    cv::circle(image_, at(x, y), texels(radius * 0.85), cv::Scalar(60), 2, cv::LINE_AA, shift);
    for (double offset = -0.6 * radius; offset <= 0.61 * radius; offset += 0.2 * radius) {
      cv::line(image_, at(x - 0.5 * radius, y + offset), at(x + 0.5 * radius, y + offset), cv::Scalar(40), 2,
               cv::LINE_AA, shift);
    }
  }
  const cv::Mat& image() const { return image_; }

 private:
  double texel_m_;
  cv::Mat image_;
};

}  // namespace

cv::Mat drawLotMarkings(const LotLayout& layout, double texel_m, uint64_t seed) {
  MarkingPainter painter(texel_m);
  constexpr double kLine_m = 0.12;
  for (const LotLayout::Bay& bay : layout.bays) {
    const double half_x = 0.5 * kBayWidth_m;
    const double half_y = 0.5 * kBayLength_m;
    painter.line(bay.x - half_x, bay.y - half_y, bay.x - half_x, bay.y + half_y, kLine_m);
    painter.line(bay.x + half_x, bay.y - half_y, bay.x + half_x, bay.y + half_y, kLine_m);
    const double mouth = bay.yaw_rad > 0.0 ? -1.0 : 1.0;
    painter.text(std::to_string(100 + bay.number), bay.x, bay.y + mouth * (half_y - 0.35), bay.yaw_rad, 0.35);
  }
  for (const double y : {-15.0, 15.0}) {
    painter.dashed(-22.0, y, 22.0, y, kLine_m, 2.0, 2.7);
    painter.arrow(-18.0, y - 1.5, 0.0);
    painter.arrow(6.0, y + 1.5, 2.0 * kHalfPi);
    painter.arrow(17.0, y - 1.5, 0.0);
  }
  for (const double x : {-26.0, 26.0}) {
    painter.dashed(x, -11.0, x, 11.0, kLine_m, 1.6, 2.2);
    painter.arrow(x + 1.5, -4.0, kHalfPi);
    painter.arrow(x - 1.5, 6.0, -kHalfPi);
  }
  painter.text("LANGSAM", 3.0, -16.4, 0.0, 1.1);
  painter.text("30", -12.0, 16.3, 2.0 * kHalfPi, 1.4);
  painter.text("P", 26.0, -13.2, kHalfPi, 1.5);
  painter.line(-22.8, -1.5, -22.8, 1.5, 0.4);
  painter.line(22.8, -1.5, 22.8, 1.5, 0.4);
  Random random(seed);
  for (int i = 0; i < 26; ++i) {
    const double x = random.uniform(-28.0, 28.0);
    const double lane = 15.0 * (random.index(3) - 1);
    painter.manhole(x, lane + random.uniform(-2.4, 2.4), random.chance(0.6) ? 0.32 : 0.2);
  }
  return painter.image();
}

}  // namespace vcharge
