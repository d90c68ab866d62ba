#include "report/map_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "vcharge_core/files/svg_plot.h"

namespace vcharge {
namespace {

using Points = std::vector<Eigen::Vector2d>;

constexpr size_t kMaxDrawnLandmarks = 30000;
constexpr double kMargin_m = 12.0;  // area shown around the path
constexpr const char* kPathCss = "stroke=\"#333\" stroke-width=\"1.5\"";
// Colours from the lowest to the highest landmark.
constexpr std::array<const char*, 6> kHeightColours = {"#3b4cc0", "#4f8fd0", "#35a79c",
                                                       "#8bbf3f", "#e0a030", "#c8402f"};
constexpr double kLowest_m = -0.5, kHeightStep_m = 0.75;
constexpr std::array<const char*, 6> kCameraColours = {"#1f77b4", "#d62728", "#2ca02c",
                                                       "#9467bd", "#8c564b", "#e377c2"};

Points pathOf(const SparseMap& map) {
  Points path;
  for (const MapKeyframe& keyframe : map.keyframes()) {
    path.emplace_back(keyframe.map_from_vehicle.translation().head<2>());
  }
  return path;
}

SvgPlot plotAround(const Points& path, double margin_m) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& point : path) {
    box.extend(point);
  }
  return SvgPlot({box.min().x() - margin_m, box.max().x() + margin_m},
                 {box.min().y() - margin_m, box.max().y() + margin_m}, 0.0, true, "x (m)", "y (m)");
}

/// Distance driven up to each keyframe.
std::vector<double> travelled(const SparseMap& map) {
  std::vector<double> way_m(map.keyframes().size(), 0.0);
  for (size_t k = 1; k < way_m.size(); ++k) {
    way_m[k] = way_m[k - 1] + (map.keyframes()[k].map_from_vehicle.translation() -
                               map.keyframes()[k - 1].map_from_vehicle.translation())
                                  .norm();
  }
  return way_m;
}

/// The frames, and the distance driven up to each.
struct FramePath {
  std::vector<Eigen::Vector3d> position_m;
  std::vector<double> way_m;
};

FramePath framePathOf(const ReconstructionState& state) {
  FramePath frame_path;
  for (const FramePose& frame : state.frames) {
    const RigidTransform map_from_vehicle =
        state.data.keyframes[frame.keyframe].map_from_vehicle * frame.keyframe_from_vehicle;
    const Eigen::Vector3d& position_m = map_from_vehicle.translation();
    frame_path.way_m.push_back(frame_path.way_m.empty()
                                   ? 0.0
                                   : frame_path.way_m.back() +
                                         (position_m - frame_path.position_m.back()).norm());
    frame_path.position_m.push_back(position_m);
  }
  return frame_path;
}

void addMotionLegend(SvgPlot* plot) {
  const std::vector<std::string> names = enumNames<MotionHypothesis>();
  for (size_t i = 0; i < names.size(); ++i) {
    plot->addLegend(colourOf(static_cast<MotionHypothesis>(i)), names[i]);
  }
}

}  // namespace

std::string colourOf(MotionHypothesis motion) {
  switch (motion) {
    case MotionHypothesis::kOdometry:
      return "#888888";
    case MotionHypothesis::kAckermann:
      return "#2c8c4a";
    case MotionHypothesis::kPlanar:
      return "#e0a030";
    case MotionHypothesis::kSpatial:
      return "#b3261e";
  }
  return "#000000";
}

std::string colourOfReason(const std::string& reason) {
  static const std::map<std::string, std::string> colours = {
      {"", "#2c8c4a"},
      {"contradicts the other edges", "#b3261e"},
      {"contradicts the adjusted map", "#7a1020"},
      {"neither confirmed nor contradicted", "#d0a020"},
      {"matches and landmarks disagree", "#e0701e"},
      {"too uncertain", "#a05fc0"},
      {"too few landmarks agree", "#8aa8d0"},
      {"no motion explains enough matches", "#c4c4c4"},
      {"too few matches", "#c4c4c4"}};
  const auto found = colours.find(reason);
  return found == colours.end() ? "#202020" : found->second;
}

std::string drawTopView(const SparseMap& map) {
  const Points path = pathOf(map);
  SvgPlot plot = plotAround(path, kMargin_m);
  std::array<Points, kHeightColours.size()> by_height;
  const size_t step = map.landmarks().size() / kMaxDrawnLandmarks + 1;
  for (size_t i = 0; i < map.landmarks().size(); i += step) {
    const Eigen::Vector3d& position = map.landmarks()[i].position_m;
    const double level = std::floor((position.z() - kLowest_m) / kHeightStep_m);
    by_height[static_cast<size_t>(std::clamp(level, 0.0, kHeightColours.size() - 1.0))].emplace_back(
        position.head<2>());
  }
  for (size_t i = 0; i < by_height.size(); ++i) {
    plot.addDots(by_height[i], 1.6, kHeightColours[i]);
  }
  plot.addLine(path, kPathCss);
  plot.addDots({path.front()}, 9.0, "#000");
  plot.addLegend("#000", "path of the vehicle, from the dot on");
  plot.addLegend(kHeightColours.front(), "landmarks below 0.25 m, where the drive began");
  plot.addLegend(kHeightColours[3], "landmarks about 2 m up");
  plot.addLegend(kHeightColours.back(), "landmarks above 3.25 m");
  return plot.make();
}

std::string drawLoops(const SparseMap& map) {
  const Points path = pathOf(map);
  SvgPlot plot = plotAround(path, 2.0);
  std::map<std::string, std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>> by_reason;
  for (const MapLoopEdge& edge : map.contents().loop_edges) {
    by_reason[edge.reason].emplace_back(path[edge.first], path[edge.second]);
  }
  // Accepted edges are drawn last, unverified candidates faintly.
  std::vector<std::string> order;
  for (const auto& [reason, edges] : by_reason) {
    order.push_back(reason);
  }
  const auto is_faint = [](const std::string& reason) {
    return reason == "too few landmarks agree" || reason == "too few matches" ||
           reason == "no motion explains enough matches";
  };
  const auto rank = [&](const std::string& reason) { return reason.empty() ? 1 : is_faint(reason) ? 0 : 2; };
  std::stable_sort(order.begin(), order.end(),
                   [&](const std::string& a, const std::string& b) { return rank(a) < rank(b); });
  plot.addLine(path, kPathCss);
  for (const std::string& reason : order) {
    plot.addSegments(by_reason[reason],
                     "stroke=\"" + colourOfReason(reason) +
                         (is_faint(reason) ? "\" stroke-width=\"0.4\" stroke-opacity=\"0.5\""
                                           : "\" stroke-width=\"1.4\""));
  }
  for (auto reason = order.rbegin(); reason != order.rend(); ++reason) {
    plot.addLegend(colourOfReason(*reason), std::to_string(by_reason[*reason].size()) +
                                                (reason->empty() ? " accepted" : " rejected: " + *reason));
  }
  return plot.make();
}

std::string drawMotions(const ReconstructionState& state) {
  const FramePath frame_path = framePathOf(state);
  Points path;
  for (const Eigen::Vector3d& position_m : frame_path.position_m) {
    path.emplace_back(position_m.head<2>());
  }
  SvgPlot plot = plotAround(path, 2.0);
  plot.addLine(path, kPathCss);
  std::array<Points, 4> by_motion;
  for (size_t i = 1; i < path.size(); ++i) {
    by_motion[static_cast<size_t>(state.frames[i].motion)].push_back(path[i]);
  }
  // Rare motions are drawn on top.
  for (const MotionHypothesis motion : {MotionHypothesis::kAckermann, MotionHypothesis::kOdometry,
                                        MotionHypothesis::kPlanar, MotionHypothesis::kSpatial}) {
    plot.addDots(by_motion[static_cast<size_t>(motion)], motion == MotionHypothesis::kAckermann ? 4.0 : 6.0,
                 colourOf(motion));
  }
  addMotionLegend(&plot);
  return plot.make();
}

std::string drawHeights(const ReconstructionState& state) {
  const FramePath frame_path = framePathOf(state);
  Points line;
  double min_m = 0.0, max_m = 0.0;
  for (size_t i = 0; i < frame_path.way_m.size(); ++i) {
    line.emplace_back(frame_path.way_m[i], frame_path.position_m[i].z());
    min_m = std::min(min_m, frame_path.position_m[i].z());
    max_m = std::max(max_m, frame_path.position_m[i].z());
  }
  SvgPlot plot({0.0, frame_path.way_m.back()}, {min_m - 0.1, max_m + 0.1}, 300.0, false, "way (m)",
               "height (m)");
  for (size_t i = 1; i < frame_path.way_m.size();) {
    const MotionHypothesis motion = state.frames[i].motion;
    const size_t begin = i;
    while (i < frame_path.way_m.size() && state.frames[i].motion == motion) {
      ++i;
    }
    plot.addBand(frame_path.way_m[begin - 1], frame_path.way_m[i - 1],
                 colourOf(motion) + "\" fill-opacity=\"0.25");
  }
  plot.addLine(line, "stroke=\"#000\" stroke-width=\"1.5\"");
  return plot.make();
}

std::string drawLandmarkCounts(const SparseMap& map) {
  const std::vector<double> way_m = travelled(map);
  const size_t num_cameras = map.rig().cameras.size();
  std::vector<Points> lines(num_cameras + 1);
  double most = 1.0;
  for (size_t k = 0; k < way_m.size(); ++k) {
    double all = 0.0;
    for (size_t camera = 0; camera < num_cameras; ++camera) {
      const auto [begin, end] = map.observationsOf(k, camera);
      lines[camera].emplace_back(way_m[k], static_cast<double>(end - begin));
      all += static_cast<double>(end - begin);
    }
    lines[num_cameras].emplace_back(way_m[k], all);
    most = std::max(most, all);
  }
  SvgPlot plot({0.0, way_m.back()}, {0.0, 1.05 * most}, 300.0, false, "way (m)", "landmarks in view");
  for (size_t camera = 0; camera < num_cameras; ++camera) {
    const std::string colour = kCameraColours[camera % kCameraColours.size()];
    plot.addLine(lines[camera], "stroke=\"" + colour + "\" stroke-width=\"1\"");
    plot.addLegend(colour, map.rig().cameras[camera].name);
  }
  plot.addLine(lines[num_cameras], "stroke=\"#000\" stroke-width=\"1.8\"");
  plot.addLegend("#000", "all cameras");
  return plot.make();
}

std::string drawErrors(const SparseMap& map) {
  constexpr int kBins = 40;
  constexpr double kBinsPerSigma = 10.0;  // bins per RMS error per coordinate over all cameras
  std::vector<std::vector<double>> errors_of(map.rig().cameras.size());
  double sum_px2 = 0.0;
  size_t count = 0;
  for (size_t camera = 0; camera < errors_of.size(); ++camera) {
    const RigCamera& rig_camera = map.rig().cameras[camera];
    rig_camera.model.visit([&](const auto& model) {
      for (size_t k = 0; k < map.keyframes().size(); ++k) {
        const RigidTransform camera_from_map =
            (map.keyframes()[k].map_from_vehicle * *rig_camera.vehicle_from_camera).inverse();
        const auto [begin, end] = map.observationsOf(k, camera);
        for (size_t i = begin; i < end; ++i) {
          const MapObservation& seen = map.observations()[i];
          Eigen::Vector2d pixel;
          if (model.project(camera_from_map * map.landmarks()[seen.landmark].position_m, &pixel)) {
            const double squared_px2 = (pixel - seen.position_px.cast<double>()).squaredNorm();
            errors_of[camera].push_back(std::sqrt(squared_px2));
            sum_px2 += squared_px2;
            ++count;
          }
        }
      }
    });
  }
  const double sigma_px =
      std::max(1e-3, std::sqrt(0.5 * sum_px2 / static_cast<double>(std::max<size_t>(1, count))));
  const double bin_px = sigma_px / kBinsPerSigma;
  std::vector<Points> lines;
  double most = 1e-6;
  for (const std::vector<double>& errors : errors_of) {
    std::array<double, kBins> percent{};
    for (const double error : errors) {
      const auto bin = static_cast<int>(std::min(error / bin_px, 1e6));
      if (bin < kBins) {
        percent[bin] += 100.0 / static_cast<double>(errors.size());
      }
    }
    Points line;
    for (int bin = 0; bin < kBins; ++bin) {
      line.emplace_back(bin * bin_px, percent[bin]);
      line.emplace_back((bin + 1) * bin_px, percent[bin]);
      most = std::max(most, percent[bin]);
    }
    lines.push_back(line);
  }
  SvgPlot plot({0.0, kBins * bin_px}, {0.0, 1.05 * most}, 300.0, false, "error of reprojection (px)",
               "observations (%)");
  for (size_t camera = 0; camera < lines.size(); ++camera) {
    const std::string colour = kCameraColours[camera % kCameraColours.size()];
    plot.addLine(lines[camera], "stroke=\"" + colour + "\" stroke-width=\"1.5\"");
    plot.addLegend(colour, map.rig().cameras[camera].name);
  }
  return plot.make();
}

}  // namespace vcharge
