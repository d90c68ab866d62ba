#include "export/text_writer.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_mapping/map_export.h"

namespace vcharge {
namespace {

constexpr double kAxisLength_m = 0.5;
constexpr size_t kVerticesPerKeyframe = 4;  // the origin and the tips of the axes

void writeHeader(size_t num_vertices, size_t num_edges, TextWriter* file) {
  file->print(
      "ply\nformat ascii 1.0\ncomment landmarks, then per keyframe its origin and its axes; metres, map "
      "frame\n"
      "element vertex %zu\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element edge %zu\nproperty int vertex1\nproperty int vertex2\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
      num_vertices, num_edges);
}

const char* axisColour(int axis) {
  static const char* const kColours[] = {"255 0 0", "0 255 0", "0 0 255"};
  return kColours[axis];
}

void writeVertex(const Eigen::Vector3d& position_m, const char* colour, TextWriter* file) {
  file->print("%.6g %.6g %.6g %s\n", position_m.x(), position_m.y(), position_m.z(), colour);
}

}  // namespace

Trajectory trajectoryOf(const SparseMap& map) {
  Trajectory trajectory;
  for (const MapKeyframe& keyframe : map.keyframes()) {
    trajectory.push_back({keyframe.stamp, keyframe.map_from_vehicle});
  }
  return trajectory;
}

void exportPly(const SparseMap& map, const std::string& path) {
  const size_t num_keyframes = map.keyframes().size();
  const size_t num_landmarks = map.landmarks().size();
  const size_t num_steps = num_keyframes == 0 ? 0 : num_keyframes - 1;
  writeFileAtomically(path, [&](const std::string& temporary) {
    TextWriter file(temporary, path);
    writeHeader(num_landmarks + kVerticesPerKeyframe * num_keyframes, 3 * num_keyframes + num_steps, &file);
    for (const MapLandmark& landmark : map.landmarks()) {
      writeVertex(landmark.position_m, "160 160 160", &file);
    }
    for (const MapKeyframe& keyframe : map.keyframes()) {
      writeVertex(keyframe.map_from_vehicle.translation(), "255 255 0", &file);
      for (int axis = 0; axis < 3; ++axis) {
        writeVertex(keyframe.map_from_vehicle * (kAxisLength_m * Eigen::Vector3d::Unit(axis)),
                    axisColour(axis), &file);
      }
    }
    for (size_t i = 0; i < num_keyframes; ++i) {
      const size_t origin = num_landmarks + kVerticesPerKeyframe * i;
      for (int axis = 0; axis < 3; ++axis) {
        file.print("%zu %zu %s\n", origin, origin + 1 + static_cast<size_t>(axis), axisColour(axis));
      }
    }
    for (size_t i = 0; i < num_steps; ++i) {
      const size_t origin = num_landmarks + kVerticesPerKeyframe * i;
      file.print("%zu %zu 255 255 0\n", origin, origin + kVerticesPerKeyframe);
    }
    file.close();
  });
}

}  // namespace vcharge
