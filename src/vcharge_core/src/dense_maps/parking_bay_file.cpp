#include "vcharge_core/dense_maps/parking_bay_file.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {

std::string nameOf(BayState state) {
  return enumNames<BayState>().at(static_cast<size_t>(state));
}

namespace {

/// Reads the values of one bay; errors name the file and the bay.
class BayReader {
 public:
  BayReader(const YAML::Node& node, std::string path, std::string bay)
      : node_(node), path_(std::move(path)), bay_(std::move(bay)) {
    if (!node.IsMap()) {
      throw InputError(path_ + ": " + bay_ + ": expected a bay (id, row, kind, state, corners_m, ...)");
    }
  }

  template <class T>
  T value(const char* key, const char* expected) const {
    try {
      return node_[key].as<T>();
    } catch (const YAML::Exception&) {
      fail(key, expected);
    }
  }

  double number(const char* key, double high, const char* expected) const {
    const auto found = value<double>(key, expected);
    if (!(found >= 0.0 && found <= high)) {
      fail(key, expected);
    }
    return found;
  }

  template <class Enum>
  Enum choice(const char* key) const {
    value<std::string>(key, "a word");  // the key may be missing
    return static_cast<Enum>(internal::readEnum(node_[key], path_, bay_ + "." + key, enumNames<Enum>()));
  }

  [[noreturn]] void fail(const char* key, const char* expected) const {
    throw InputError(path_ + ": " + bay_ + "." + key + ": expected " + expected);
  }

 private:
  const YAML::Node& node_;
  const std::string path_, bay_;
};

ParkingBay readBay(const YAML::Node& node, const std::string& path, const std::string& name) {
  constexpr const char* kCorners = "four corners [x, y], finite, in metres";
  constexpr double kLargest = 1e6;
  const BayReader reader(node, path, name);
  ParkingBay bay;
  bay.id = reader.value<uint32_t>("id", "a number from 0");
  bay.row = reader.value<uint32_t>("row", "a number from 0");
  bay.kind = reader.choice<BayKind>("kind");
  bay.state = reader.choice<BayState>("state");
  const auto corners = reader.value<std::vector<std::vector<double>>>("corners_m", kCorners);
  bool is_right = corners.size() == bay.corners_m.size();
  for (size_t i = 0; is_right && i < corners.size(); ++i) {
    is_right = corners[i].size() == 2 && std::isfinite(corners[i][0]) && std::isfinite(corners[i][1]);
    if (is_right) {
      bay.corners_m[i] = {corners[i][0], corners[i][1]};
    }
  }
  if (!is_right) {
    reader.fail("corners_m", kCorners);
  }
  bay.entry_sigma_m = reader.number("entry_sigma_m", kLargest, "a number of metres from 0");
  bay.end_sigma_m = reader.number("end_sigma_m", kLargest, "a number of metres from 0");
  bay.confidence = reader.number("confidence", 1.0, "a number from 0 to 1");
  return bay;
}

}  // namespace

void writeParkingBays(const ParkingBays& bays, const std::string& path) {
  ContentHasher hasher;
  addToHash(bays, &hasher);
  std::string text =
      "frame: " + bays.frame_id + "\ncontent_hash: " + hasher.hex() +
      "\n# corners counter-clockwise from above; the first two are the ends of the entry\nbays:" +
      (bays.bays.empty() ? " []\n" : "\n");
  std::array<char, 512> line{};
  for (const ParkingBay& bay : bays.bays) {
    const auto& c = bay.corners_m;
    std::snprintf(line.data(), line.size(),
                  "  - {id: %u, row: %u, kind: %s, state: %s, corners_m: [[%.9g, %.9g], [%.9g, %.9g], "
                  "[%.9g, %.9g], [%.9g, %.9g]], entry_sigma_m: %.4g, end_sigma_m: %.4g, confidence: %.3g}\n",
                  bay.id, bay.row, enumNames<BayKind>().at(static_cast<size_t>(bay.kind)).c_str(),
                  nameOf(bay.state).c_str(), c[0].x(), c[0].y(), c[1].x(), c[1].y(), c[2].x(), c[2].y(),
                  c[3].x(), c[3].y(), bay.entry_sigma_m, bay.end_sigma_m, bay.confidence);
    text += line.data();
  }
  writeTextFileAtomically(path, text);
}

ParkingBays readParkingBays(const std::string& path) {
  const YAML::Node node = loadYamlFile(path);
  if (!node.IsMap() || !node["frame"] || !node["frame"].IsScalar() || !node["bays"] ||
      !node["bays"].IsSequence()) {
    throw InputError(path + ": expected parking bays (frame, and bays as a list)");
  }
  ParkingBays bays;
  bays.frame_id = node["frame"].as<std::string>();
  for (size_t i = 0; i < node["bays"].size(); ++i) {
    bays.bays.push_back(readBay(node["bays"][i], path, "bays[" + std::to_string(i) + "]"));
  }
  return bays;
}

}  // namespace vcharge
