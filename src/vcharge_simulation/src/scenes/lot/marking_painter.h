#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "scenes/scene_things.h"

namespace vcharge {

/// Paints antialiased road markings, in metres, on an image (CV_8UC1, 255 is paint) whose row 0 is at the
/// area's min_y and column 0 at its min_x.
class MarkingPainter {
 public:
  MarkingPainter(const GroundRectangle& area, double texel_m);

  void polygon(const std::vector<Eigen::Vector2d>& points, double value);
  void line(double x0, double y0, double x1, double y1, double width);
  void dashed(double x0, double y0, double x1, double y1, double width, double dash, double gap);
  void arrow(double x, double y, double yaw_rad);
  /// Text of the given height whose upward direction is along `yaw_rad`.
  void text(const std::string& text, double x, double y, double yaw_rad, double height_m);
  void manhole(double x, double y, double radius);
  const cv::Mat& image() const { return image_; }

 private:
  cv::Point at(double x, double y) const;

  GroundRectangle area_;
  double texel_m_;
  cv::Mat image_;
};

}  // namespace vcharge
