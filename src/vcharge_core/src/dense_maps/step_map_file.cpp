#include "vcharge_core/dense_maps/step_map_file.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <yaml-cpp/yaml.h>

#include "files/float_tiff.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

constexpr const char* kEnding = "_steps.yaml";

std::string stemOf(const std::string& folder, Timestamp stamp) {
  return (fs::path(folder) / (std::to_string(stamp.nanoseconds()) + "_steps")).string();
}

std::vector<std::pair<std::string, cv::Mat*>> namedLayers(StepMap* map) {
  return {{"ground", &map->ground_m}, {"height", &map->height_m}, {"sigma", &map->sigma_m}};
}

void emitSequence(YAML::Emitter* yaml, const char* key, const std::vector<double>& values) {
  *yaml << YAML::Key << key << YAML::Value << YAML::Flow << values;
}

}  // namespace

void writeStepMap(const StepMap& map, const std::string& folder) {
  const std::string stem = stemOf(folder, map.stamp);
  createFolder(folder);
  std::error_code ignored;
  fs::remove(stem + ".yaml", ignored);  // a partly replaced stamp then counts as incomplete
  StepMap layers = map;
  for (const auto& [name, image] : namedLayers(&layers)) {
    writeFloatTiff(*image, stem + "_" + name + ".tiff");
  }
  const Eigen::Vector3d translation = map.fixed_from_vehicle.translation();
  const Eigen::Quaterniond rotation = map.fixed_from_vehicle.rotation();
  YAML::Emitter yaml;
  yaml.SetDoublePrecision(17);
  yaml << YAML::BeginMap << YAML::Key << "stamp_ns" << YAML::Value << map.stamp.nanoseconds();
  yaml << YAML::Key << "frame_id" << YAML::Value << map.frame_id;
  yaml << YAML::Key << "cell_size_m" << YAML::Value << map.cell_size_m;
  emitSequence(&yaml, "origin_m", {map.origin_m.x(), map.origin_m.y()});
  emitSequence(&yaml, "fixed_from_vehicle_translation_m",
               {translation.x(), translation.y(), translation.z()});
  emitSequence(&yaml, "fixed_from_vehicle_rotation_xyzw",
               {rotation.x(), rotation.y(), rotation.z(), rotation.w()});
  yaml << YAML::EndMap;
  writeTextFileAtomically(stem + ".yaml", std::string(yaml.c_str()) + "\n");
}

std::vector<Timestamp> listStepMaps(const std::string& folder) {
  if (!fs::is_directory(folder)) {
    throw InputError(folder + ": expected a folder of step maps");
  }
  std::vector<Timestamp> stamps;
  const std::string ending = kEnding;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const std::string digits = name.substr(0, name.find('_'));
    if (name == digits + ending && !digits.empty() &&
        digits.find_first_not_of("0123456789") == std::string::npos && digits.size() <= 19) {
      stamps.push_back(Timestamp::fromNanoseconds(std::stoll(digits)));
    }
  }
  std::sort(stamps.begin(), stamps.end());
  return stamps;
}

StepMap readStepMap(const std::string& folder, Timestamp stamp) {
  const std::string stem = stemOf(folder, stamp);
  const YAML::Node node = loadYamlFile(stem + ".yaml");
  StepMap map;
  try {
    const auto origin = node["origin_m"].as<std::vector<double>>();
    const auto translation = node["fixed_from_vehicle_translation_m"].as<std::vector<double>>();
    const auto rotation = node["fixed_from_vehicle_rotation_xyzw"].as<std::vector<double>>();
    map.stamp = Timestamp::fromNanoseconds(node["stamp_ns"].as<int64_t>());
    map.frame_id = node["frame_id"].as<std::string>();
    map.cell_size_m = node["cell_size_m"].as<double>();
    map.origin_m = Eigen::Vector2d(origin.at(0), origin.at(1));
    map.fixed_from_vehicle =
        RigidTransform(Eigen::Quaterniond(rotation.at(3), rotation.at(0), rotation.at(1), rotation.at(2)),
                       Eigen::Vector3d(translation.at(0), translation.at(1), translation.at(2)));
  } catch (const std::exception&) {  // from yaml-cpp, at() or RigidTransform
    throw InputError(stem + ".yaml: expected stamp_ns, frame_id, cell_size_m, origin_m and the pose");
  }
  for (const auto& [name, image] : namedLayers(&map)) {
    *image = readFloatTiff(stem + "_" + name + ".tiff");
    if (image->size() != map.ground_m.size()) {
      throw InputError(stem + "_" + name + ".tiff: expected the size of " + stem + "_ground.tiff");
    }
  }
  return map;
}

}  // namespace vcharge
