#include "vcharge_calibration/report/monitor_report.h"

#include <algorithm>
#include <array>
#include <vector>

#include "vcharge_core/base/text_format.h"
#include "vcharge_core/files/html.h"
#include "vcharge_core/files/svg_plot.h"

namespace vcharge {
namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr double kPlotHeight = 190.0;
const std::array<const char*, 3> kColours{"#c0392b", "#2471a3", "#1e8449"};

/// Three deviations over the driven distance.
struct Curves {
  Eigen::Index first = 0;  ///< in the order of RigDeviation
  double unit = 1.0;
  double min_range = 0.1;  ///< in units
  std::string label;
  std::array<std::string, 3> names;
};

bool isAbout(const RigChange& change, const Curves& curves) {
  if (change.part == RigPart::kCamera) {
    const Eigen::Index row = RigDeviation::rowOf(change.camera);
    return curves.first == row || curves.first == row + 3;
  }
  return (change.part == RigPart::kOdometer) == (curves.first == 0);
}

std::string draw(const RigMonitor& monitor, const Curves& curves) {
  double range = curves.min_range;
  std::array<std::array<std::vector<Eigen::Vector2d>, 3>, 3> lines;  // by curve: value, below, above
  for (const MonitoredPart& part : monitor.parts()) {
    for (size_t i = 0; i < 3; ++i) {
      const Eigen::Index row = curves.first + static_cast<Eigen::Index>(i);
      const double value = curves.unit * part.deviation[row], sigma = curves.unit * part.sigmas[row];
      lines[i][0].emplace_back(part.end_m, value);
      lines[i][1].emplace_back(part.end_m, value - sigma);
      lines[i][2].emplace_back(part.end_m, value + sigma);
      range = std::max({range, std::abs(value - sigma), std::abs(value + sigma)});
    }
  }
  SvgPlot plot({0.0, monitor.parts().back().end_m}, {-range, range}, kPlotHeight, false, "driven (m)",
               curves.label);
  for (const RigChange& change : monitor.changes()) {
    if (isAbout(change, curves)) {
      plot.addBand(change.earliest_m, change.latest_m, "#f9e79f");
    }
  }
  for (size_t i = 0; i < 3; ++i) {
    const std::string colour = std::string("stroke=\"") + kColours[i] + "\"";
    plot.addLine(lines[i][0], colour + " stroke-width=\"2\"");
    plot.addLine(lines[i][1], colour + " stroke-width=\"0.5\"");
    plot.addLine(lines[i][2], colour + " stroke-width=\"0.5\"");
    plot.addLegend(kColours[i], curves.names[i]);
  }
  return plot.make();
}

}  // namespace

std::string makeMonitorReport(const std::string& title, const RigMonitor& monitor,
                              const MonitorVerdict& verdict) {
  std::string body = htmlVerdict(toString(verdict.grade), verdict.remarks);
  if (monitor.parts().empty()) {
    return htmlPage(title, body);
  }
  body += "<p>" + toText(monitor.parts().back().end_m, 0) +
          " m driven. Deviation from the rig, with one standard deviation on either side; yellow: when a "
          "change "
          "happened. Axes of the vehicle: x forwards, y to the left, z up.</p>";
  for (size_t i = 0; i < monitor.rig().cameras.size(); ++i) {
    const Eigen::Index row = RigDeviation::rowOf(i);
    const std::string& name = monitor.rig().cameras[i].name;
    body += "<h2>Camera " + escapeHtml(name) + "</h2><div class=\"row\">" +
            htmlFigure(draw(monitor, {row + 3, kDegrees, 0.1, "degrees", {"roll", "pitch", "yaw"}}),
                       "Rotation of camera " + name + ".") +
            htmlFigure(draw(monitor, {row, 100.0, 1.0, "cm", {"forwards", "sideways", "height"}}),
                       "Position of camera " + name + ".") +
            "</div>";
  }
  body += "<h2>Odometer</h2><div class=\"row\">" +
          htmlFigure(
              draw(monitor, {0, 100.0, 1.0, "%, 0.01 rad per metre", {"distance", "turn", "turn per metre"}}),
              "True over counted distance and turn, less one, and turn that is not counted.") +
          "</div>";
  return htmlPage(title, body);
}

}  // namespace vcharge
