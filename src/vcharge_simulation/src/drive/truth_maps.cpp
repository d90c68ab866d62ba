#include "vcharge_simulation/drive/truth_maps.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include <tbb/parallel_for.h>
#include <yaml-cpp/yaml.h>
#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {

namespace {

constexpr double kTop_m = 60.0;
constexpr double kStep_m = 1e-3;

double heightAt(const Renderer& renderer, const Eigen::Vector2d& position_m, double max_height_m) {
  const GroundHeight& ground_height = renderer.scene().ground_height;
  max_height_m = std::min(max_height_m, renderer.scene().overhead_m);
  max_height_m += ground_height ? ground_height(position_m.x(), position_m.y()) : 0.0;
  double travelled_m = 0.0;
  for (;;) {
    SurfaceKind kind = SurfaceKind::kOther;
    const auto distance_m =
        renderer.castRay({position_m.x(), position_m.y(), kTop_m}, {0.0, 0.0, -1.0}, travelled_m, &kind);
    if (!distance_m) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    const double height_m = kTop_m - *distance_m;
    if (height_m <= max_height_m || kind == SurfaceKind::kBuilding) {
      return height_m;
    }
    travelled_m = *distance_m + kStep_m;
  }
}

// Writes the keys of an obstacle into an open YAML map.
void emitObstacle(const Obstacle& obstacle, YAML::Emitter* yaml) {
  *yaml << YAML::Key << "kind" << YAML::Value << obstacle.kind;
  *yaml << YAML::Key << "base_z_m" << YAML::Value << obstacle.base_z_m;
  *yaml << YAML::Key << "top_z_m" << YAML::Value << obstacle.top_z_m;
  *yaml << YAML::Key << "footprint_m" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const Eigen::Vector2d& corner : obstacle.footprint_m) {
    *yaml << YAML::Flow << YAML::BeginSeq << corner.x() << corner.y() << YAML::EndSeq;
  }
  *yaml << YAML::EndSeq;
}

}  // namespace

TruthHeightMap computeHeightMap(const Renderer& renderer, double cell_size_m, double max_height_m) {
  check(cell_size_m > 0.0, "computeHeightMap: cell_size_m must be positive");
  const Eigen::Vector2d min_m = renderer.scene().min_m;
  const Eigen::Vector2d size_m = renderer.scene().max_m - min_m;
  TruthHeightMap map;
  map.cell_size_m = cell_size_m;
  map.origin_m = min_m + Eigen::Vector2d::Constant(0.5 * cell_size_m);
  map.height_m.create(static_cast<int>(std::floor(size_m.y() / cell_size_m + 1e-9)),
                      static_cast<int>(std::floor(size_m.x() / cell_size_m + 1e-9)), CV_32FC1);
  tbb::parallel_for(0, map.height_m.rows, [&](int row) {
    for (int column = 0; column < map.height_m.cols; ++column) {
      const Eigen::Vector2d position_m = map.origin_m + cell_size_m * Eigen::Vector2d(column, row);
      map.height_m.at<float>(row, column) = static_cast<float>(heightAt(renderer, position_m, max_height_m));
    }
  });
  return map;
}

void writeHeightMap(const TruthHeightMap& map, const std::string& path_stem) {
  writeFileAtomically(path_stem + ".tiff", [&](const std::string& temporary) {
    if (!cv::imwrite(temporary, map.height_m)) {
      throw InputError(path_stem + ".tiff: cannot be written");
    }
  });
  YAML::Emitter yaml;
  yaml.SetDoublePrecision(17);
  yaml << YAML::BeginMap;
  yaml << YAML::Key << "file" << YAML::Value
       << std::filesystem::path(path_stem + ".tiff").filename().string();
  yaml << YAML::Key << "frame" << YAML::Value << "world";
  yaml << YAML::Key << "origin_m" << YAML::Value << YAML::Flow << YAML::BeginSeq << map.origin_m.x()
       << map.origin_m.y() << YAML::EndSeq
       << YAML::Comment("centre of the cell in column 0, row 0; columns along x, rows along y");
  yaml << YAML::Key << "cell_size_m" << YAML::Value << map.cell_size_m;
  yaml << YAML::Key << "size_cells" << YAML::Value << YAML::Flow << YAML::BeginSeq << map.height_m.cols
       << map.height_m.rows << YAML::EndSeq;
  yaml << YAML::EndMap;
  writeTextFileAtomically(path_stem + ".yaml", std::string(yaml.c_str()) + "\n");
}

void writeObstacles(const std::vector<Obstacle>& obstacles, const std::string& path) {
  YAML::Emitter yaml;
  yaml.SetDoublePrecision(9);
  yaml << YAML::BeginMap << YAML::Key << "frame" << YAML::Value << "world";
  yaml << YAML::Key << "obstacles" << YAML::Value << YAML::BeginSeq;
  for (const Obstacle& obstacle : obstacles) {
    yaml << YAML::BeginMap;
    emitObstacle(obstacle, &yaml);
    yaml << YAML::EndMap;
  }
  yaml << YAML::EndSeq << YAML::EndMap;
  writeTextFileAtomically(path, std::string(yaml.c_str()) + "\n");
}

std::vector<TrackedObject> trueObjects(const std::vector<Mover>& movers, double time_s) {
  std::vector<TrackedObject> objects;
  for (const Mover& mover : movers) {
    if (mover.object_class == ObjectClass::kUnknown) {
      continue;
    }
    const MoverState state = mover.stateAt(time_s);
    TrackedObject object;
    object.id = static_cast<uint32_t>(objects.size() + 1);
    object.object_class = mover.object_class;
    object.frame_from_object = state.world_from_mover;
    object.velocity_m_per_s = state.velocity_m_per_s;
    object.is_standing = state.is_standing;
    object.footprint_m = state.obstacle.footprint_m;
    object.base_z_m = state.obstacle.base_z_m;
    object.height_m = state.obstacle.top_z_m - state.obstacle.base_z_m;
    objects.push_back(object);
  }
  return objects;
}

void writeMovers(const std::vector<Mover>& movers, const std::vector<Timestamp>& stamps,
                 const std::vector<double>& times_s, const std::string& path) {
  check(stamps.size() == times_s.size(), "writeMovers: expected a time for each stamp");
  YAML::Emitter yaml;
  yaml.SetDoublePrecision(12);
  yaml << YAML::BeginMap << YAML::Key << "frame" << YAML::Value << "world";
  yaml << YAML::Key << "images" << YAML::Value << YAML::BeginSeq;
  for (size_t i = 0; i < stamps.size(); ++i) {
    yaml << YAML::BeginMap << YAML::Key << "stamp_ns" << YAML::Value << stamps[i].nanoseconds();
    yaml << YAML::Key << "movers" << YAML::Value << YAML::BeginSeq;
    for (const Mover& mover : movers) {
      const MoverState state = mover.stateAt(times_s[i]);
      const Eigen::Vector3d& translation = state.world_from_mover.translation();
      const Eigen::Quaterniond& rotation = state.world_from_mover.rotation();
      yaml << YAML::BeginMap << YAML::Key << "name" << YAML::Value << mover.name;
      emitObstacle(state.obstacle, &yaml);
      yaml << YAML::Key << "translation_m" << YAML::Value << YAML::Flow << YAML::BeginSeq << translation.x()
           << translation.y() << translation.z() << YAML::EndSeq;
      yaml << YAML::Key << "rotation_xyzw" << YAML::Value << YAML::Flow << YAML::BeginSeq << rotation.x()
           << rotation.y() << rotation.z() << rotation.w() << YAML::EndSeq;
      const Eigen::Vector3d& velocity = state.velocity_m_per_s;
      yaml << YAML::Key << "class" << YAML::Value << nameOf(mover.object_class);
      yaml << YAML::Key << "velocity_m_per_s" << YAML::Value << YAML::Flow << YAML::BeginSeq << velocity.x()
           << velocity.y() << velocity.z() << YAML::EndSeq;
      yaml << YAML::Key << "height_m" << YAML::Value << state.obstacle.top_z_m - state.obstacle.base_z_m;
      yaml << YAML::Key << "is_standing" << YAML::Value << state.is_standing << YAML::EndMap;
    }
    yaml << YAML::EndSeq << YAML::EndMap;
  }
  yaml << YAML::EndSeq << YAML::EndMap;
  writeTextFileAtomically(path, std::string(yaml.c_str()) + "\n");
}

}  // namespace vcharge
