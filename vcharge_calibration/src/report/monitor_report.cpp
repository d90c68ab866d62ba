#include "vcharge_calibration/report/monitor_report.h"

#include <algorithm>
#include <array>
#include <utility>
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

/// Draws vertical lines at driven distances.
void addMarks(const std::vector<double>& at_m, double range, const std::string& css, SvgPlot* plot) {
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> marks;
  for (const double m : at_m) {
    marks.push_back({{m, -range}, {m, range}});
  }
  plot->addSegments(marks, css);
}

std::string draw(const std::vector<MonitoredDrive>& drives, const RigMonitor& monitor, const Curves& curves) {
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
  std::vector<double> drives_m, versions_m;
  for (size_t i = 0; i + 1 < drives.size(); ++i) {
    drives_m.push_back(drives[i].end_m);
  }
  for (const RigAdoption& adoption : monitor.adoptions()) {
    versions_m.push_back(adoption.at_m);
  }
  addMarks(drives_m, range, "stroke=\"#aaa\" stroke-width=\"1\"", &plot);
  addMarks(versions_m, range, "stroke=\"#7d3c98\" stroke-width=\"2\"", &plot);
  for (size_t i = 0; i < 3; ++i) {
    const std::string colour = std::string("stroke=\"") + kColours[i] + "\"";
    plot.addLine(lines[i][0], colour + " stroke-width=\"2\"");
    plot.addLine(lines[i][1], colour + " stroke-width=\"0.5\"");
    plot.addLine(lines[i][2], colour + " stroke-width=\"0.5\"");
    plot.addLegend(kColours[i], curves.names[i]);
  }
  return plot.make();
}

/// A table of what happened, in order of the driven distance.
std::string eventsOf(const std::vector<MonitoredDrive>& drives, const RigMonitor& monitor) {
  std::vector<std::pair<double, std::string>> events;
  double begin_m = 0.0;
  for (const MonitoredDrive& drive : drives) {
    events.emplace_back(begin_m, "drive " + drive.name + ", " + toText(drive.end_m - begin_m, 0) + " m");
    begin_m = drive.end_m;
  }
  for (const RigChange& change : monitor.changes()) {
    events.emplace_back(change.found_m, describeChange(monitor.rig(), change));
  }
  for (const RigAdoption& adoption : monitor.adoptions()) {
    std::string text = "new version of the rig:";
    for (const size_t camera : adoption.cameras) {
      text += " " + monitor.rig().cameras[camera].name;
    }
    events.emplace_back(adoption.at_m, text);
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::string table = htmlRow({"driven (m)", "event"}, true);
  for (const auto& [at_m, text] : events) {
    table += htmlRow({toText(at_m, 0), text});
  }
  return "<table>" + table + "</table>";
}

}  // namespace

std::string makeMonitorReport(const std::vector<MonitoredDrive>& drives, const RigMonitor& monitor,
                              const MonitorVerdict& verdict) {
  const std::string title = drives.size() == 1 ? "Rig during " + drives.front().name
                                               : "Rig during " + std::to_string(drives.size()) + " drives";
  std::string body = htmlVerdict(toString(verdict.grade), verdict.remarks);
  if (monitor.parts().empty()) {
    return htmlPage(title, body);
  }
  body +=
      "<p>" + toText(monitor.parts().back().end_m, 0) +
      " m driven. Deviation from the rig, with one standard deviation on either side; yellow: when a "
      "change happened; gray: the next drive; violet: a new version of the rig, from which deviations are "
      "counted. Axes of the vehicle: x forwards, y to the left, z up.</p>" +
      eventsOf(drives, monitor);
  for (size_t i = 0; i < monitor.rig().cameras.size(); ++i) {
    const Eigen::Index row = RigDeviation::rowOf(i);
    const std::string& name = monitor.rig().cameras[i].name;
    body += "<h2>Camera " + escapeHtml(name) + "</h2><div class=\"row\">" +
            htmlFigure(draw(drives, monitor, {row + 3, kDegrees, 0.1, "degrees", {"roll", "pitch", "yaw"}}),
                       "Rotation of camera " + name + ".") +
            htmlFigure(draw(drives, monitor, {row, 100.0, 1.0, "cm", {"forwards", "sideways", "height"}}),
                       "Position of camera " + name + ".") +
            "</div>";
  }
  body += "<h2>Odometer</h2><div class=\"row\">" +
          htmlFigure(draw(drives, monitor,
                          {0, 100.0, 1.0, "%, 0.01 rad per metre", {"distance", "turn", "turn per metre"}}),
                     "True over counted distance and turn, less one, and turn that is not counted.") +
          "</div>";
  return htmlPage(title, body);
}

}  // namespace vcharge
