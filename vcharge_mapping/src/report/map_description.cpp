#include "vcharge_mapping/map_description.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <map>
#include <vector>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

constexpr double kDegreesPerRadian = 57.29577951308232;

/// Appends text, formatted as by printf.
__attribute__((format(printf, 2, 3))) void append(std::string* text, const char* format, ...) {
  va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, arguments);
  va_end(arguments);
  check(length >= 0, "append: bad format");
  const size_t old_size = text->size();
  text->resize(old_size + static_cast<size_t>(length) + 1);  // vsnprintf writes a terminating zero
  std::vsnprintf(&(*text)[old_size], static_cast<size_t>(length) + 1, format, again);
  va_end(again);
  text->pop_back();
}

void describeSize(const SparseMap& map, std::string* text) {
  const auto& keyframes = map.keyframes();
  append(text, "keyframes     %zu", keyframes.size());
  if (!keyframes.empty()) {
    append(text, " over %.1f m", lengthOf_m(map));
    if (map.sessions().size() == 1) {
      append(text, " and %.1f s", toSeconds(keyframes.back().stamp - keyframes.front().stamp));
    }
    append(text, ", from %s on", toString(keyframes.front().stamp).c_str());
  }
  if (map.sessions().size() > 1) {
    append(text, "\nsessions      %zu", map.sessions().size());
    for (const MapSession& session : map.sessions()) {
      append(text, "\n  component %d: %s", session.component, session.name.c_str());
    }
  }
  append(text, "\nlandmarks     %zu\nobservations  %zu, each with %d %s\n", map.landmarks().size(),
         map.observations().size(), map.descriptors().cols,
         map.descriptors().type() == CV_32FC1 ? "32-bit floats" : "bytes");
  if (map.landmarks().empty()) {
    return;
  }
  Eigen::AlignedBox3d landmarks, path;
  for (const MapLandmark& landmark : map.landmarks()) {
    landmarks.extend(landmark.position_m);
  }
  for (const MapKeyframe& keyframe : keyframes) {
    path.extend(keyframe.map_from_vehicle.translation());
  }
  append(text, "extent        %10s %10s %10s\n", "x (m)", "y (m)", "z (m)");
  for (const auto& [name, box] : {std::make_pair("landmarks", landmarks), std::make_pair("path", path)}) {
    for (const bool is_min : {true, false}) {
      const Eigen::Vector3d corner = is_min ? box.min() : box.max();
      append(text, "  %-9s %s %9.2f %10.2f %10.2f\n", name, is_min ? "min" : "max", corner.x(), corner.y(),
             corner.z());
    }
  }
}

void describeLandmarks(const SparseMap& map, std::string* text) {
  std::vector<double> counts, sigmas_m;
  for (size_t i = 0; i < map.landmarks().size(); ++i) {
    const auto [begin, end] = map.observationsOfLandmark(i);
    counts.push_back(static_cast<double>(end - begin));
    const double variance_m2 = map.landmarks()[i].covariance_m2.trace();
    if (variance_m2 > 0.0) {
      sigmas_m.push_back(std::sqrt(variance_m2));
    }
  }
  if (counts.empty()) {
    return;
  }
  append(text, "observations per landmark: mean %.2f, 10 %% %.0f, 50 %% %.0f, 90 %% %.0f, most %.0f\n",
         static_cast<double>(map.observations().size()) / static_cast<double>(counts.size()),
         quantile(counts, 0.1), quantile(counts, 0.5), quantile(counts, 0.9),
         *std::max_element(counts.begin(), counts.end()));
  if (sigmas_m.empty()) {
    append(text, "landmark sigma: unknown\n");
  } else {
    append(text, "landmark sigma: 50 %% %.4f m, 90 %% %.4f m, unknown for %zu\n", quantile(sigmas_m, 0.5),
           quantile(sigmas_m, 0.9), counts.size() - sigmas_m.size());
  }
}

void describeCameras(const SparseMap& map, std::string* text) {
  append(text, "%-10s %-15s %11s %10s %6s %13s %15s\n", "camera", "model", "size (px)", "view (deg)", "mask",
         "observations", "error rms (px)");
  for (size_t i = 0; i < map.rig().cameras.size(); ++i) {
    const RigCamera& camera = map.rig().cameras[i];
    const ReprojectionErrors errors = measureReprojection(map, i);
    append(text, "%-10s %-15s %6dx%-4d %10.1f %6s %13zu %15.3f", camera.name.c_str(),
           camera.model.name().c_str(), camera.image_size_px.width, camera.image_size_px.height,
           kDegreesPerRadian * camera.field_of_view_rad, camera.mask.empty() ? "no" : "yes",
           errors.num_observations, errors.rms_px);
    if (errors.num_invisible > 0) {
      append(text, "  (%zu observations are not seen by the model)", errors.num_invisible);
    }
    *text += "\n";
  }
}

void describeLoops(const SparseMap& map, bool list_all, std::string* text) {
  const auto& edges = map.contents().loop_edges;
  std::map<std::string, size_t> rejected;
  size_t num_accepted = 0;
  for (const MapLoopEdge& edge : edges) {
    if (edge.accepted) {
      ++num_accepted;
    } else {
      ++rejected[edge.reason.empty() ? "no reason kept" : edge.reason];
    }
  }
  append(text, "loop edges    %zu accepted, %zu rejected\n", num_accepted, edges.size() - num_accepted);
  for (const auto& [reason, count] : rejected) {
    append(text, "  %6zu rejected: %s\n", count, reason.c_str());
  }
  if (!list_all) {
    return;
  }
  for (const MapLoopEdge& edge : edges) {
    const Eigen::Vector3d t = edge.first_from_second.translation();
    append(text, "  %d <- %d: %.3f %.3f %.3f m, %.2f deg, %d inliers, %s%s\n", edge.first, edge.second, t.x(),
           t.y(), t.z(), kDegreesPerRadian * angleOfRotation(edge.first_from_second.rotation()),
           edge.num_inliers, edge.accepted ? "accepted" : "rejected: ", edge.reason.c_str());
  }
}

void describeProvenance(const MapProvenance& provenance, std::string* text) {
  *text += provenance.empty() ? "provenance    none was kept\n" : "provenance\n";
  for (const auto& [key, value] : provenance) {
    *text += "  " + key + ": ";
    if (value.find('\n') == std::string::npos) {
      *text += value + "\n";
      continue;
    }
    *text += "\n    ";
    for (size_t i = 0; i < value.size(); ++i) {
      *text += value[i];
      if (value[i] == '\n' && i + 1 < value.size()) {
        *text += "    ";
      }
    }
    *text += value.back() == '\n' ? "" : "\n";
  }
}

}  // namespace

double lengthOf_m(const SparseMap& map) {
  double length_m = 0.0;
  for (size_t i = 1; i < map.keyframes().size(); ++i) {
    const MapKeyframe& previous = map.keyframes()[i - 1];
    const MapKeyframe& keyframe = map.keyframes()[i];
    if (keyframe.session == previous.session) {
      length_m += (keyframe.map_from_vehicle.translation() - previous.map_from_vehicle.translation()).norm();
    }
  }
  return length_m;
}

ReprojectionErrors measureReprojection(const SparseMap& map, size_t camera) {
  const RigCamera& rig_camera = map.rig().cameras.at(camera);
  const RigidTransform camera_from_vehicle = rig_camera.vehicle_from_camera->inverse();
  ReprojectionErrors errors;
  double sum_px2 = 0.0;
  rig_camera.model.visit([&](const auto& model) {
    for (size_t keyframe = 0; keyframe < map.keyframes().size(); ++keyframe) {
      const RigidTransform camera_from_map =
          camera_from_vehicle * map.keyframes()[keyframe].map_from_vehicle.inverse();
      const auto [begin, end] = map.observationsOf(keyframe, camera);
      for (size_t i = begin; i < end; ++i) {
        const MapObservation& observation = map.observations()[i];
        const Eigen::Vector3d& position_m =
            map.landmarks()[static_cast<size_t>(observation.landmark)].position_m;
        Eigen::Vector2d pixel;
        ++errors.num_observations;
        if (model.project(camera_from_map * position_m, &pixel)) {
          sum_px2 += (pixel - observation.position_px.cast<double>()).squaredNorm();
        } else {
          ++errors.num_invisible;
        }
      }
    }
  });
  const size_t num_visible = errors.num_observations - errors.num_invisible;
  errors.rms_px = num_visible == 0 ? 0.0 : std::sqrt(sum_px2 / static_cast<double>(num_visible));
  return errors;
}

std::string describeMap(const SparseMap& map, const MapProvenance& provenance, bool list_loop_edges) {
  std::string text = "content hash  " + map.contentHash() + "\n";
  describeSize(map, &text);
  describeLandmarks(map, &text);
  describeCameras(map, &text);
  describeLoops(map, list_loop_edges, &text);
  append(&text, "odometer      true over counted distance %.5f, true over counted turn %.5f\n",
         map.contents().odometry_distance_scale, map.contents().odometry_turn_scale);
  describeProvenance(provenance, &text);
  return text;
}

}  // namespace vcharge
