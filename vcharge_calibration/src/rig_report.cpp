#include "vcharge_calibration/rig_report.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "vcharge_core/html.h"
#include "vcharge_core/text_format.h"
#include "vcharge_mapping/svg_plot.h"

namespace vcharge {
namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr size_t kMaxDrawnLandmarks = 20000;
constexpr double kMargin_m = 10.0;
using Points = std::vector<Eigen::Vector2d>;

std::string rowOf(const std::vector<std::string>& cells, bool is_head = false) {
  std::string text = "<tr>";
  for (const std::string& cell : cells) {
    text += is_head ? "<th>" + escapeHtml(cell) + "</th>" : "<td>" + escapeHtml(cell) + "</td>";
  }
  return text + "</tr>";
}

std::string verdictOf(const RigCalibration& result) {
  const std::string verdict = toString(result.verdict);
  std::string text = "<p class=\"verdict " + verdict + "\"><b>" + verdict + "</b>";
  for (const std::string& remark : result.remarks) {
    text += "<br>" + escapeHtml(remark);
  }
  return text + "</p>";
}

std::string summaryOf(const RigCalibration& result) {
  return "<table>" +
         rowOf({"drive", toText(result.distance_m, 1) + " m, " + toText(kDegrees * result.left_turn_rad, 0) +
                             " degrees to the left, " + toText(kDegrees * result.right_turn_rad, 0) +
                             " to the right"}) +
         rowOf({"map", std::to_string(result.num_keyframes) + " keyframes, " +
                           std::to_string(result.num_landmarks) + " landmarks, " +
                           std::to_string(result.num_loop_edges) + " loop edges"}) +
         rowOf({"error of reprojection, RMS per coordinate", toText(result.rms_px, 3) + " px"}) +
         rowOf({"odometer's turn, true over counted", toText(result.odometer_turn_scale, 5)}) +
         rowOf({"odometer's stamps late by", toText(1000.0 * result.time_offset_s, 1) + " ms"}) +
         rowOf({"height", result.height_source}) + "</table>";
}

std::string placesOf(const RigCalibration& result, const CameraRig& rig) {
  std::string text =
      "<h2>Places of the cameras</h2><p>Axes of the vehicle: x forwards, y to the left, z up. All lengths "
      "are the "
      "odometer's: an error of the wheels' size is in them.</p><table>" +
      rowOf({"camera", "x (cm)", "y (cm)", "z (cm)", "\u00b1 roll (degrees)", "\u00b1 pitch", "\u00b1 yaw",
             "least certain"},
            true);
  for (size_t i = 0; i < result.cameras.size(); ++i) {
    const CameraCalibration& camera = result.cameras[i];
    const Eigen::Matrix<double, 6, 1> sigma = camera.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    std::vector<std::string> cells{camera.name};
    for (int k = 0; k < 3; ++k) {
      cells.push_back(toText(100.0 * rig.cameras[i].vehicle_from_camera->translation()[k], 2) + " \u00b1 " +
                      toText(100.0 * sigma[k], 2));
    }
    for (int k = 3; k < 6; ++k) {
      cells.push_back(toText(kDegrees * sigma[k], 3));
    }
    cells.push_back(camera.weakest_direction);
    text += rowOf(cells);
  }
  text += "</table><h2>Checks</h2><table>" +
          rowOf({"camera", "observations followed", "that fit", "error (px RMS)",
                 "of it common to neighbours (px)", "landmarks shared with other cameras",
                 "halves of the drive differ by (cm)", "(degrees)", "jackknife over formula, largest"},
                true);
  for (const CameraCalibration& camera : result.cameras) {
    text += rowOf({camera.name, std::to_string(camera.num_tracked), std::to_string(camera.num_observations),
                   toText(camera.rms_px, 3), toText(camera.structure_px, 3),
                   std::to_string(camera.num_shared_landmarks),
                   toText(100.0 * camera.half_difference.head<3>().norm(), 2),
                   toText(kDegrees * camera.half_difference.tail<3>().norm(), 3),
                   toText(camera.inflation.maxCoeff(), 1)});
  }
  return text + "</table>";
}

std::string drawPath(const MappingState& state) {
  Points path, landmarks;
  Eigen::AlignedBox2d box;
  for (const Keyframe& keyframe : state.data.keyframes) {
    path.emplace_back(keyframe.map_from_vehicle.translation().head<2>());
    box.extend(path.back());
  }
  size_t num_landmarks = 0;
  for (const Track& track : state.data.tracks) {
    num_landmarks += track.position_m ? 1 : 0;
  }
  const size_t step = num_landmarks / kMaxDrawnLandmarks + 1;
  size_t next = 0;
  const Eigen::Vector2d margin(kMargin_m, kMargin_m);
  const Eigen::AlignedBox2d shown(box.min() - margin, box.max() + margin);
  for (const Track& track : state.data.tracks) {
    if (track.position_m && next++ % step == 0 && shown.contains(track.position_m->head<2>())) {
      landmarks.emplace_back(track.position_m->head<2>());
    }
  }
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> loops;
  for (const LoopEdge& edge : state.report.loop_edges) {
    if (edge.accepted) {
      loops.emplace_back(path[edge.first], path[edge.second]);
    }
  }
  SvgPlot plot({shown.min().x(), shown.max().x()}, {shown.min().y(), shown.max().y()}, 0.0, true, "x (m)",
               "y (m)");
  plot.addDots(landmarks, 0.8, "#9ab");
  plot.addSegments(loops, "stroke=\"#2ca02c\" stroke-width=\"1\"");
  plot.addLine(path, "stroke=\"#333\" stroke-width=\"1.5\" fill=\"none\"");
  return htmlFigure(plot.make(), "Path (black), loops (green) and landmarks from above.");
}

std::string drawRig(const CameraRig& rig) {
  constexpr double kAxis_m = 0.7;
  Points places;
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> axes;
  Eigen::AlignedBox2d box(Eigen::Vector2d(-1.5, -1.8), Eigen::Vector2d(4.5, 1.8));
  for (const RigCamera& camera : rig.cameras) {
    const Eigen::Vector2d place = camera.vehicle_from_camera->translation().head<2>();
    const Eigen::Vector3d axis = camera.vehicle_from_camera->rotation() * Eigen::Vector3d::UnitZ();
    places.push_back(place);
    axes.emplace_back(place, place + kAxis_m * axis.head<2>());
    box.extend(axes.back().first);
    box.extend(axes.back().second);
  }
  SvgPlot plot({box.min().x(), box.max().x()}, {box.min().y(), box.max().y()}, 0.0, true, "x (m)", "y (m)");
  plot.addSegments(axes, "stroke=\"#b3261e\" stroke-width=\"2\"");
  plot.addDots(places, 4.0, "#b3261e");
  return htmlFigure(plot.make(), "Cameras and their directions from above; the vehicle drives to the right.");
}

}  // namespace

std::string makeRigReport(const std::string& title, const RigCalibration& result, const MappingState& state) {
  std::string body = verdictOf(result) + summaryOf(result);
  if (result.rig != nullptr) {
    body += placesOf(result, *result.rig) + "<div class=\"row\">" + drawRig(*result.rig) + "</div>";
  }
  if (!state.data.keyframes.empty()) {
    body += "<h2>Drive</h2><div class=\"row\">" + drawPath(state) + "</div>";
  }
  body += "<h2>Times</h2><table>";
  for (const auto& [stage, seconds] : state.report.stage_s) {
    body += rowOf({stage, toText(seconds, 1) + " s"});
  }
  return htmlPage(title, body + "</table>");
}

}  // namespace vcharge
