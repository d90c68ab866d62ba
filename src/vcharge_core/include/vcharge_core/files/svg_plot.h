#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace vcharge {

/// A plot with axes, as an <svg> element. Points are in the plot's units; y points up.
class SvgPlot {
 public:
  struct Range {
    double min = 0.0, max = 1.0;
  };
  /// With `is_metric`, x and y have the same scale and the height follows from it, within bounds.
  SvgPlot(Range x, Range y, double height, bool is_metric, const std::string& x_label,
          const std::string& y_label);

  /// `css`: presentation attributes, for example "stroke=\"#c00\" stroke-width=\"2\"".
  void addLine(const std::vector<Eigen::Vector2d>& points, const std::string& css);
  void addSegments(const std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>& segments,
                   const std::string& css);
  void addDots(const std::vector<Eigen::Vector2d>& points, double size, const std::string& colour);
  void addBand(double x_min, double x_max, const std::string& colour);
  void addLegend(const std::string& colour, const std::string& text);

  std::string make() const;

 private:
  std::string coordinates(const Eigen::Vector2d& point) const;
  double toX(double x) const;
  double toY(double y) const;
  std::string axes() const;

  Range x_, y_;
  double width_, height_;
  std::string x_label_, y_label_;
  std::string content_, legend_;
  double legend_x_;
  int num_legend_rows_ = 0;
};

}  // namespace vcharge
