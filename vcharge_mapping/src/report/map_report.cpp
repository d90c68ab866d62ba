#include "vcharge_mapping/map_report.h"

#include <algorithm>
#include <map>
#include <sstream>

#include "report/map_pictures.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/files/html.h"
#include "vcharge_mapping/map_description.h"

namespace vcharge {
namespace {

constexpr size_t kMaxSkippedRows = 30;

std::string summaryOf(const SparseMap& map, const ReconstructionReport& report) {
  double length_m = 0.0;
  for (size_t k = 1; k < map.keyframes().size(); ++k) {
    length_m += (map.keyframes()[k].map_from_vehicle.translation() -
                 map.keyframes()[k - 1].map_from_vehicle.translation())
                    .norm();
  }
  const double duration_s = toSeconds(map.keyframes().back().stamp - map.keyframes().front().stamp);
  return "<table>" +
         htmlRow({"drive", toText(length_m, 1) + " m in " + toText(duration_s, 1) + " s, " +
                               std::to_string(report.counters.frames) + " frames"}) +
         htmlRow({"map", std::to_string(map.keyframes().size()) + " keyframes, " +
                             std::to_string(map.landmarks().size()) + " landmarks, " +
                             std::to_string(map.observations().size()) + " observations"}) +
         htmlRow({"error of reprojection, RMS per coordinate", toText(report.rms_px, 3) + " px"}) +
         htmlRow({"odometer: true over counted distance, and turn",
                  toText(map.contents().odometry_distance_scale, 5) + ", " +
                      toText(map.contents().odometry_turn_scale, 5)}) +
         htmlRow({"content hash", map.contentHash()}) + "</table>";
}

std::string loopsOf(const SparseMap& map) {
  std::map<std::string, int64_t> by_reason;
  for (const MapLoopEdge& edge : map.contents().loop_edges) {
    ++by_reason[edge.accepted ? std::string() : edge.reason];
  }
  std::string text = "<table>" + htmlRow({"pairs of similar keyframes", "edges"}, true) +
                     htmlRow({"accepted", std::to_string(by_reason[""])});
  for (const auto& [reason, count] : by_reason) {
    if (!reason.empty()) {
      text += htmlRow({"rejected: " + reason, std::to_string(count)});
    }
  }
  return text + "</table>";
}

std::string motionsOf(const ReconstructionReport& report) {
  static const char* const kMeanings[] = {
      "too few matches agree: the odometer's motion", "a circle about a point on the rear axle's line",
      "any motion in the plane: the wheels slipped", "six degrees of freedom: a ramp, a bump"};
  const std::vector<std::string> names = enumNames<MotionHypothesis>();
  std::string text = "<table>" + htmlRow({"motion between frames", "frames", "meaning"}, true);
  for (size_t i = 0; i < names.size(); ++i) {
    text += "<tr><td>" + names[i] + "</td><td>" + std::to_string(report.num_motions[i]) +
            "</td><td class=\"text\">" + kMeanings[i] + "</td></tr>";
  }
  return text + "</table>";
}

std::string camerasOf(const SparseMap& map, const ReconstructionReport& report) {
  std::string text =
      "<table>" + htmlRow({"camera", "observations", "error, RMS distance (px)", "images missing"}, true);
  for (size_t i = 0; i < map.rig().cameras.size(); ++i) {
    const ReprojectionErrors errors = measureReprojection(map, i);
    text += htmlRow({map.rig().cameras[i].name, std::to_string(errors.num_observations),
                     toText(errors.rms_px, 3), std::to_string(report.counters.missing_images[i])});
  }
  return text + "</table>";
}

std::string stagesOf(const ReconstructionReport& report) {
  double sum_s = 0.0;
  std::string text = "<table>" + htmlRow({"stage", "time (s)"}, true);
  for (const std::string& stage : report.stages) {
    const auto found = report.stage_s.find(stage);
    if (found != report.stage_s.end()) {
      sum_s += found->second;
      text += htmlRow({stage, toText(found->second, 2)});
    }
  }
  return text + htmlRow({"sum", toText(sum_s, 2)}) + "</table>";
}

std::string skippedOf(const ReconstructionReport& report, Timestamp start) {
  const auto count_row = [](const char* what, int64_t count) {
    return count > 0 ? htmlRow({what, std::to_string(count)}) : std::string();
  };
  std::string text =
      count_row("frames without odometry: not used", report.counters.frames_without_odometry) +
      count_row("frames that lack a camera: used with the others", report.counters.incomplete_frames) +
      count_row("standing frames: not used", report.num_standing_frames) +
      count_row("images that arrived too late: not used", report.counters.numLateImages()) +
      count_row("resets of the odometer", report.counters.odometry_resets);
  if (text.empty()) {
    return "<p>Nothing.</p>";
  }
  text = "<table>" + text + "</table>";
  std::vector<SkippedFrames> longest = report.skipped;
  std::stable_sort(longest.begin(), longest.end(), [](const SkippedFrames& a, const SkippedFrames& b) {
    return a.num_frames > b.num_frames;
  });
  if (longest.size() > kMaxSkippedRows) {
    longest.resize(kMaxSkippedRows);
  }
  std::stable_sort(longest.begin(), longest.end(),
                   [](const SkippedFrames& a, const SkippedFrames& b) { return a.first < b.first; });
  text += "<p>Longest, of " + std::to_string(report.skipped.size()) + ":</p><table>" +
          htmlRow({"reason", "from (s)", "to (s)", "frames"}, true);
  for (const SkippedFrames& skipped : longest) {
    text += htmlRow({skipped.reason, toText(toSeconds(skipped.first - start), 2),
                     toText(toSeconds(skipped.last - start), 2), std::to_string(skipped.num_frames)});
  }
  return text + "</table>";
}

}  // namespace

std::string makeMapReport(const std::string& title, const SparseMap& map, const ReconstructionState& state) {
  const ReconstructionReport& report = state.report;
  std::ostringstream out;
  const MapVerdict verdict = judgeMap(map, state);
  out << htmlVerdict(toString(verdict.grade), verdict.remarks) << summaryOf(map, report)
      << "<h2>From above</h2>" << htmlFigure(drawTopView(map), "Path and landmarks.") << "<h2>Loops</h2>"
      << loopsOf(map)
      << htmlFigure(drawLoops(map),
                    "Lines between the keyframes of each edge. Faint: similar pairs that did not pass "
                    "verification.")
      << "<h2>How the vehicle moved</h2>" << motionsOf(report)
      << htmlFigure(drawMotions(state), "By frame; rare motions are drawn on top.")
      << htmlFigure(drawHeights(state), "Height of the path in the map, in the same colours.")
      << "<h2>Landmarks in view</h2>"
      << htmlFigure(drawLandmarkCounts(map), "By keyframe. Relocalization is hard where there are few.")
      << "<h2>Errors</h2>" << camerasOf(map, report)
      << htmlFigure(drawErrors(map), "Distance between observations and projected landmarks.")
      << "<h2>Stages</h2>" << stagesOf(report) << "<h2>Skipped frames</h2>"
      << skippedOf(report, map.keyframes().front().stamp);
  return htmlPage(title, out.str());
}

}  // namespace vcharge
