#include "report/rig_pictures.h"

#include <algorithm>
#include <map>

#include <Eigen/Geometry>

#include "vcharge_core/files/svg_plot.h"
#include "vcharge_reconstruction/bundle_adjustment.h"

namespace vcharge {
namespace {

constexpr size_t kMaxDrawnLandmarks = 20000;
constexpr size_t kMaxDrawnLines = 3000;
constexpr double kMargin_m = 10.0;
constexpr int kColumns = 16, kRows = 10, kMinPerCell = 10;
constexpr const char* kPathCss = "stroke=\"#333\" stroke-width=\"1.5\"";

using Points = std::vector<Eigen::Vector2d>;
using Segments = std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>;

SvgPlot plotAround(const Points& points, double margin_m) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& point : points) {
    box.extend(point);
  }
  return SvgPlot({box.min().x() - margin_m, box.max().x() + margin_m},
                 {box.min().y() - margin_m, box.max().y() + margin_m}, 0.0, true, "x (m)", "y (m)");
}

}  // namespace

std::string drawSparseMap(const RigScene& scene) {
  Points path;
  for (const RigidTransform& map_from_vehicle : scene.map_from_vehicle) {
    path.emplace_back(map_from_vehicle.translation().head<2>());
  }
  SvgPlot plot = plotAround(path, kMargin_m);
  size_t num_landmarks = 0;
  for (const auto& landmarks : scene.landmarks) {
    num_landmarks += landmarks.size();
  }
  const size_t step = num_landmarks / kMaxDrawnLandmarks + 1;
  for (size_t camera = 0; camera < scene.landmarks.size(); ++camera) {
    Points shown;
    for (size_t i = 0; i < scene.landmarks[camera].size(); i += step) {
      shown.emplace_back(scene.landmarks[camera][i].head<2>());
    }
    plot.addDots(shown, 2.0, colourOfCamera(camera));
    plot.addLegend(colourOfCamera(camera), scene.rig->cameras[camera].name);
  }
  plot.addLine(path, kPathCss);
  plot.addLegend("#333", "path of the vehicle");
  return plot.make();
}

std::string drawLoopGraph(const ReconstructionState& state) {
  struct Kind {
    std::string name, css, colour;
    Segments edges;
  };
  // Accepted edges are drawn last.
  Kind kinds[] = {{"not verified", R"(stroke="#bbb" stroke-width="0.4" stroke-opacity="0.5")", "#bbb", {}},
                  {"accepted", R"(stroke="#2c8c4a" stroke-width="1.2")", "#2c8c4a", {}},
                  {"contradicting", R"(stroke="#b3261e" stroke-width="1.4")", "#b3261e", {}}};
  Points path;
  for (const Keyframe& keyframe : state.data.keyframes) {
    path.emplace_back(keyframe.map_from_vehicle.translation().head<2>());
  }
  for (const LoopEdge& edge : state.report.loop_edges) {
    const size_t kind = edge.accepted ? 1 : edge.reason.rfind("contradict", 0) == 0 ? 2 : 0;
    kinds[kind].edges.emplace_back(path[static_cast<size_t>(edge.first)],
                                   path[static_cast<size_t>(edge.second)]);
  }
  SvgPlot plot = plotAround(path, 2.0);
  plot.addLine(path, kPathCss);
  for (const Kind& kind : kinds) {
    plot.addSegments(kind.edges, kind.css);
    plot.addLegend(kind.colour, std::to_string(kind.edges.size()) + " " + kind.name);
  }
  return plot.make();
}

std::string drawCameras(const CameraRig& rig) {
  constexpr double kAxis_m = 0.7;
  const Points corners{{-1.5, -1.8}, {4.5, 1.8}};
  Points ends = corners;
  for (const RigCamera& camera : rig.cameras) {
    const Eigen::Vector2d position_m = camera.vehicle_from_camera->translation().head<2>();
    ends.push_back(position_m);
    ends.emplace_back(
        position_m + kAxis_m * (camera.vehicle_from_camera->rotation() * Eigen::Vector3d::UnitZ()).head<2>());
  }
  SvgPlot plot = plotAround(ends, 0.0);
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    const size_t at = corners.size() + 2 * i;
    const std::string colour = colourOfCamera(i);
    plot.addSegments({{ends[at], ends[at + 1]}}, "stroke=\"" + colour + "\" stroke-width=\"2\"");
    plot.addDots({ends[at]}, 8.0, colour);
    plot.addLegend(colour, rig.cameras[i].name);
  }
  return plot.make();
}

std::vector<std::vector<CornerError>> errorsByCamera(const ReconstructionData& data) {
  std::vector<std::vector<CornerError>> errors(data.rig->cameras.size());
  for (const Track& track : data.tracks) {
    if (!track.position_m) {
      continue;
    }
    for (const TrackObservation& observation : track.observations) {
      Eigen::Vector2d error_px;
      if (reprojectionError(data, track, observation, &error_px)) {
        errors[static_cast<size_t>(observation.camera)].push_back({observation.position_px, error_px});
      }
    }
  }
  return errors;
}

std::vector<CornerError> meanErrors(cv::Size image_size_px, const std::vector<CornerError>& errors) {
  struct Cell {
    Eigen::Vector2d sum_px = Eigen::Vector2d::Zero();
    int count = 0;
  };
  std::vector<Cell> cells(static_cast<size_t>(kColumns) * kRows);
  const double width = static_cast<double>(image_size_px.width) / kColumns;
  const double height = static_cast<double>(image_size_px.height) / kRows;
  for (const CornerError& error : errors) {
    const int column = std::clamp(static_cast<int>(error.pixel.x() / width), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(error.pixel.y() / height), 0, kRows - 1);
    Cell& cell = cells[static_cast<size_t>(row) * kColumns + static_cast<size_t>(column)];
    cell.sum_px += error.error_px;
    ++cell.count;
  }
  std::vector<CornerError> means;
  for (size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].count >= kMinPerCell) {
      const size_t column = i % kColumns, row = i / kColumns;
      means.push_back(
          {{width * (static_cast<double>(column) + 0.5), height * (static_cast<double>(row) + 0.5)},
           cells[i].sum_px / cells[i].count});
    }
  }
  return means;
}

std::string drawLandmarkViews(const std::vector<LandmarkViews>& landmarks,
                              const std::vector<Eigen::Vector3d>& path_m,
                              const std::vector<std::string>& camera_names) {
  Points path;
  for (const Eigen::Vector3d& position_m : path_m) {
    path.emplace_back(position_m.head<2>());
  }
  SvgPlot plot = plotAround(path, kMargin_m);
  std::map<size_t, Segments> lines;
  std::map<size_t, Points> dots;
  size_t num_lines = 0;
  for (const LandmarkViews& landmark : landmarks) {
    num_lines += landmark.cameras_m.size();
  }
  const size_t line_step = num_lines / kMaxDrawnLines + 1,
               dot_step = landmarks.size() / kMaxDrawnLandmarks + 1;
  size_t line = 0;
  for (size_t i = 0; i < landmarks.size(); ++i) {
    const LandmarkViews& landmark = landmarks[i];
    if (i % dot_step == 0) {
      dots[landmark.first_camera].emplace_back(landmark.position_m.head<2>());
    }
    for (const Eigen::Vector3d& camera_m : landmark.cameras_m) {
      if (line++ % line_step == 0) {
        lines[landmark.first_camera].emplace_back(landmark.position_m.head<2>(), camera_m.head<2>());
      }
    }
  }
  for (const auto& [camera, segments] : lines) {
    plot.addSegments(segments,
                     "stroke=\"" + colourOfCamera(camera) + "\" stroke-width=\"0.4\" stroke-opacity=\"0.4\"");
  }
  for (const auto& [camera, points] : dots) {
    plot.addDots(points, 1.6, colourOfCamera(camera));
  }
  plot.addLine(path, kPathCss);
  for (size_t camera = 0; camera < camera_names.size(); ++camera) {
    plot.addLegend(colourOfCamera(camera), camera_names[camera]);
  }
  return plot.make();
}

}  // namespace vcharge
