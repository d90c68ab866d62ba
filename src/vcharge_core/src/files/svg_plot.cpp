#include "vcharge_core/files/svg_plot.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vcharge_core/base/text_format.h"
#include "vcharge_core/files/html.h"

namespace vcharge {
namespace {

constexpr double kWidth = 1000.0;
constexpr double kLeft = 70.0, kRight = 15.0, kTop = 12.0, kBottom = 45.0;
constexpr double kLegendRow = 20.0, kLegendMark = 36.0, kLetter = 7.0;
constexpr double kMinHeight = 250.0, kMaxHeight = 900.0;

/// Step of 1, 2 or 5 times a power of ten, so that about `count` steps fit into the range.
double tickStep(double range, int count) {
  const double raw = range / count;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double digit = raw / power;
  return power * (digit < 1.5 ? 1.0 : digit < 3.5 ? 2.0 : digit < 7.5 ? 5.0 : 10.0);
}

SvgPlot::Range notEmpty(SvgPlot::Range range) {
  if (!(range.max - range.min > 1e-9)) {
    range.min -= 0.5;
    range.max += 0.5;
  }
  return range;
}

}  // namespace

SvgPlot::SvgPlot(Range x, Range y, double height, bool is_metric, const std::string& x_label,
                 const std::string& y_label)
    : x_(notEmpty(x)),
      y_(notEmpty(y)),
      width_(kWidth),
      height_(height),
      x_label_(x_label),
      y_label_(y_label),
      legend_x_(kLeft) {
  if (!is_metric) {
    return;
  }
  const double inner_width = width_ - kLeft - kRight;
  const double wanted = inner_width * (y_.max - y_.min) / (x_.max - x_.min) + kTop + kBottom;
  height_ = std::clamp(wanted, kMinHeight, kMaxHeight);
  // If the metric scale leaves room, one of the axes is extended on both sides.
  const double inner_height = height_ - kTop - kBottom;
  const double scale =
      std::max((x_.max - x_.min) / inner_width, (y_.max - y_.min) / inner_height);  // units per pixel
  const double more_x = 0.5 * (scale * inner_width - (x_.max - x_.min));
  const double more_y = 0.5 * (scale * inner_height - (y_.max - y_.min));
  x_ = {x_.min - more_x, x_.max + more_x};
  y_ = {y_.min - more_y, y_.max + more_y};
}

double SvgPlot::toX(double x) const {
  return kLeft + (x - x_.min) / (x_.max - x_.min) * (width_ - kLeft - kRight);
}

double SvgPlot::toY(double y) const {
  return height_ - kBottom - (y - y_.min) / (y_.max - y_.min) * (height_ - kTop - kBottom);
}

std::string SvgPlot::coordinates(const Eigen::Vector2d& point) const {
  return toText(toX(point.x()), 1) + " " + toText(toY(point.y()), 1);
}

void SvgPlot::addLine(const std::vector<Eigen::Vector2d>& points, const std::string& css) {
  content_ += "<polyline fill=\"none\" " + css + " points=\"";
  for (const Eigen::Vector2d& point : points) {
    content_ += coordinates(point) + " ";
  }
  content_ += "\"/>";
}

void SvgPlot::addSegments(const std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>& segments,
                          const std::string& css) {
  content_ += "<path fill=\"none\" " + css + " d=\"";
  for (const auto& [from, to] : segments) {
    content_ += "M" + coordinates(from) + "L" + coordinates(to);
  }
  content_ += "\"/>";
}

void SvgPlot::addDots(const std::vector<Eigen::Vector2d>& points, double size, const std::string& colour) {
  content_ += R"(<path fill="none" stroke-linecap="round" stroke=")" + colour + "\" stroke-width=\"" +
              toText(size, 1) + "\" d=\"";
  for (const Eigen::Vector2d& point : points) {
    if (point.x() >= x_.min && point.x() <= x_.max && point.y() >= y_.min && point.y() <= y_.max) {
      content_ += "M" + coordinates(point) + "h0";
    }
  }
  content_ += "\"/>";
}

void SvgPlot::addBand(double x_min, double x_max, const std::string& colour) {
  content_ += "<rect x=\"" + toText(toX(x_min), 1) + "\" y=\"" + toText(kTop, 1) + "\" width=\"" +
              toText(std::max(0.5, toX(x_max) - toX(x_min)), 1) + "\" height=\"" +
              toText(height_ - kTop - kBottom, 1) + "\" fill=\"" + colour + "\"/>";
}

void SvgPlot::addLegend(const std::string& colour, const std::string& text) {
  // The legend stands in rows above the plot; make() reserves the height.
  const double width = kLegendMark + kLetter * static_cast<double>(text.size());
  if (legend_x_ > kLeft && legend_x_ + width > width_ - kRight) {
    legend_x_ = kLeft;
    ++num_legend_rows_;
  }
  num_legend_rows_ = std::max(1, num_legend_rows_);
  const double y = kLegendRow * num_legend_rows_;
  legend_ += "<rect x=\"" + toText(legend_x_, 0) + "\" y=\"" + toText(y - 10.0, 0) +
             "\" width=\"14\" height=\"9\" fill=\"" + colour + "\"/><text x=\"" +
             toText(legend_x_ + 19.0, 0) + "\" y=\"" + toText(y, 0) + "\">" + escapeHtml(text) + "</text>";
  legend_x_ += width;
}

std::string SvgPlot::axes() const {
  std::string text;
  const double step_x = tickStep(x_.max - x_.min, 9);
  const double step_y = tickStep(y_.max - y_.min, std::max(2, static_cast<int>(height_ / 70.0)));
  const auto digits = [](double step) {
    return step >= 1.0 ? 0 : static_cast<int>(std::ceil(-std::log10(step)));
  };
  for (double x = std::ceil(x_.min / step_x) * step_x; x <= x_.max; x += step_x) {
    const std::string at = toText(toX(x), 1);
    text += "<path stroke=\"#eee\" d=\"M" + at + " " + toText(kTop, 1) + "V" + toText(height_ - kBottom, 1) +
            "\"/><text text-anchor=\"middle\" x=\"" + at + "\" y=\"" + toText(height_ - kBottom + 17.0, 1) +
            "\">" + toText(std::abs(x) < 1e-9 * step_x ? 0.0 : x, digits(step_x)) + "</text>";
  }
  for (double y = std::ceil(y_.min / step_y) * step_y; y <= y_.max; y += step_y) {
    const std::string at = toText(toY(y), 1);
    text += "<path stroke=\"#eee\" d=\"M" + toText(kLeft, 1) + " " + at + "H" + toText(width_ - kRight, 1) +
            "\"/><text text-anchor=\"end\" x=\"" + toText(kLeft - 6.0, 1) + "\" y=\"" +
            toText(toY(y) + 4.0, 1) + "\">" + toText(std::abs(y) < 1e-9 * step_y ? 0.0 : y, digits(step_y)) +
            "</text>";
  }
  text += "<text text-anchor=\"middle\" x=\"" + toText(0.5 * (kLeft + width_ - kRight), 1) + "\" y=\"" +
          toText(height_ - 8.0, 1) + "\">" + escapeHtml(x_label_) + "</text>";
  const std::string middle = toText(0.5 * (kTop + height_ - kBottom), 1);
  text += "<text text-anchor=\"middle\" transform=\"rotate(-90 16 " + middle + ")\" x=\"16\" y=\"" + middle +
          "\">" + escapeHtml(y_label_) + "</text>";
  return text;
}

std::string SvgPlot::make() const {
  const std::string frame = "x=\"" + toText(kLeft, 1) + "\" y=\"" + toText(kTop, 1) + "\" width=\"" +
                            toText(width_ - kLeft - kRight, 1) + "\" height=\"" +
                            toText(height_ - kTop - kBottom, 1) + "\"";
  const double legend_height = kLegendRow * num_legend_rows_;
  return "<svg viewBox=\"0 0 " + toText(width_, 0) + " " + toText(height_ + legend_height, 0) +
         R"(" xmlns="http://www.w3.org/2000/svg" font-family="sans-serif" font-size="13">)"
         R"(<rect width="100%" height="100%" fill="#fff"/>)" +
         legend_ + "<g transform=\"translate(0 " + toText(legend_height, 0) + ")\">" + axes() + content_ +
         "<rect " + frame + " fill=\"none\" stroke=\"#888\"/></g></svg>";
}

}  // namespace vcharge
