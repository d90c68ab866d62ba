#include "vcharge_dense/bay_lanelets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include <tinyxml2.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/dense_maps/parking_bay_file.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// The plane that touches the ellipsoid at the datum.
class LocalPlane {
 public:
  explicit LocalPlane(const MapDatum& datum) : datum_(datum) {
    if (!(std::abs(datum.latitude_deg) <= 89.0 && std::abs(datum.longitude_deg) <= 180.0)) {
      throw InputError("datum: expected a latitude of -89 to 89 and a longitude of -180 to 180 degrees");
    }
    constexpr double kEquator_m = 6378137.0, kEccentricity2 = 6.69437999014e-3;  // WGS84
    const double sine = std::sin(datum.latitude_deg * kPi / 180.0);
    const double curve = 1.0 - kEccentricity2 * sine * sine;
    north_m_per_deg_ = kPi / 180.0 * kEquator_m * (1.0 - kEccentricity2) / std::pow(curve, 1.5);
    east_m_per_deg_ = kPi / 180.0 * kEquator_m / std::sqrt(curve) * std::sqrt(1.0 - sine * sine);
  }

  double latitude_deg(const Eigen::Vector2d& at_m) const {
    return datum_.latitude_deg + at_m.y() / north_m_per_deg_;
  }
  double longitude_deg(const Eigen::Vector2d& at_m) const {
    return datum_.longitude_deg + at_m.x() / east_m_per_deg_;
  }
  Eigen::Vector2d positionOf(double latitude_deg, double longitude_deg) const {
    return {(longitude_deg - datum_.longitude_deg) * east_m_per_deg_,
            (latitude_deg - datum_.latitude_deg) * north_m_per_deg_};
  }

 private:
  MapDatum datum_;
  double north_m_per_deg_ = 0.0, east_m_per_deg_ = 0.0;
};

void addTag(tinyxml2::XMLPrinter* xml, const char* key, const std::string& value) {
  xml->OpenElement("tag");
  xml->PushAttribute("k", key);
  xml->PushAttribute("v", value.c_str());
  xml->CloseElement();
}

std::string numberText(double value, const char* format) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

void addWay(tinyxml2::XMLPrinter* xml, int64_t id, const std::vector<int64_t>& nodes, const char* type) {
  xml->OpenElement("way");
  xml->PushAttribute("id", id);
  for (const int64_t node : nodes) {
    xml->OpenElement("nd");
    xml->PushAttribute("ref", node);
    xml->CloseElement();
  }
  addTag(xml, "type", type);
  xml->CloseElement();
}

void addMember(tinyxml2::XMLPrinter* xml, int64_t way) {
  xml->OpenElement("member");
  xml->PushAttribute("type", "way");
  xml->PushAttribute("ref", way);
  xml->PushAttribute("role", "outer");
  xml->CloseElement();
}

/// Reads areas of an OSM file.
class AreaReader {
 public:
  AreaReader(const std::string& path, const MapDatum& datum) : path_(path), plane_(datum) {
    if (file_.LoadFile(path.c_str()) != tinyxml2::XML_SUCCESS) {
      throw InputError(path + ": expected a map of Lanelet2 (OSM XML): " + file_.ErrorStr());
    }
    root_ = file_.FirstChildElement("osm");
    if (root_ == nullptr) {
      throw InputError(path + ": expected the element <osm>");
    }
    for (const auto* node = root_->FirstChildElement("node"); node != nullptr;
         node = node->NextSiblingElement("node")) {
      double latitude_deg = 0.0, longitude_deg = 0.0;
      int64_t id = 0;
      if (node->QueryAttribute("id", &id) == tinyxml2::XML_SUCCESS &&
          node->QueryAttribute("lat", &latitude_deg) == tinyxml2::XML_SUCCESS &&
          node->QueryAttribute("lon", &longitude_deg) == tinyxml2::XML_SUCCESS &&
          std::isfinite(latitude_deg) && std::isfinite(longitude_deg)) {
        nodes_[id] = plane_.positionOf(latitude_deg, longitude_deg);
      }
    }
    for (const auto* way = root_->FirstChildElement("way"); way != nullptr;
         way = way->NextSiblingElement("way")) {
      Way read;
      for (const auto* node = way->FirstChildElement("nd"); node != nullptr;
           node = node->NextSiblingElement("nd")) {
        read.nodes.push_back(node->Int64Attribute("ref"));
      }
      read.is_virtual = tagOf(*way, "type").value_or("") == "virtual";
      ways_[way->Int64Attribute("id")] = read;
    }
  }

  std::vector<ParkingBay> bays() const {
    std::vector<ParkingBay> bays;
    for (const auto* area = root_->FirstChildElement("relation"); area != nullptr;
         area = area->NextSiblingElement("relation")) {
      if (tagOf(*area, "type").value_or("") == "multipolygon" &&
          tagOf(*area, "subtype").value_or("") == "parking") {
        bays.push_back(bayOf(*area));
      }
    }
    return bays;
  }

 private:
  struct Way {
    std::vector<int64_t> nodes;
    bool is_virtual = false;
  };

  static std::optional<std::string> tagOf(const tinyxml2::XMLElement& element, const char* key) {
    for (const auto* tag = element.FirstChildElement("tag"); tag != nullptr;
         tag = tag->NextSiblingElement("tag")) {
      if (tag->Attribute("k", key) != nullptr && tag->Attribute("v") != nullptr) {
        return tag->Attribute("v");
      }
    }
    return std::nullopt;
  }

  [[noreturn]] void fail(int64_t area, const std::string& expected) const {
    throw InputError(path_ + ": area " + std::to_string(area) + ": expected " + expected);
  }

  double numberOf(const tinyxml2::XMLElement& area, int64_t id, const char* key, double usual,
                  double most) const {
    const std::optional<std::string> text = tagOf(area, key);
    double value = usual;
    if (text && (!tinyxml2::XMLUtil::ToDouble(text->c_str(), &value) || !(value >= 0.0 && value <= most))) {
      fail(id, std::string("a number from 0 in the tag ") + key);
    }
    return value;
  }

  size_t choiceOf(const tinyxml2::XMLElement& area, int64_t id, const char* key,
                  const std::vector<std::string>& names, size_t usual) const {
    const std::optional<std::string> text = tagOf(area, key);
    if (!text) {
      return usual;
    }
    const auto name = std::find(names.begin(), names.end(), *text);
    if (name == names.end()) {
      fail(id, names[0] + ", " + names[1] + " or " + names[2] + " in the tag " + key);
    }
    return static_cast<size_t>(name - names.begin());
  }

  ParkingBay bayOf(const tinyxml2::XMLElement& area) const {
    constexpr double kLargestNumber = 4294967295.0, kLargestSigma_m = 1e6;
    const int64_t id = area.Int64Attribute("id");
    ParkingBay bay;
    bay.corners_m = cornersOf(area, id);
    const double usual_id = static_cast<double>(std::clamp<int64_t>(id, 0, 4294967295));
    bay.id = static_cast<uint32_t>(numberOf(area, id, "bay", usual_id, kLargestNumber));
    bay.row = static_cast<uint32_t>(numberOf(area, id, "row", 0.0, kLargestNumber));
    bay.kind = static_cast<BayKind>(choiceOf(area, id, "kind", enumNames<BayKind>(), 0));
    bay.state = static_cast<BayState>(choiceOf(area, id, "state", enumNames<BayState>(), 2));
    bay.entry_sigma_m = numberOf(area, id, "entry_sigma", 0.0, kLargestSigma_m);
    bay.end_sigma_m = numberOf(area, id, "end_sigma", 0.0, kLargestSigma_m);
    bay.confidence = numberOf(area, id, "confidence", 1.0, 1.0);
    return bay;
  }

  /// Corners from the entry on, counter-clockwise whatever the direction of the ways.
  Quadrangle cornersOf(const tinyxml2::XMLElement& area, int64_t id) const {
    std::vector<int64_t> entry, others;
    for (const auto* member = area.FirstChildElement("member"); member != nullptr;
         member = member->NextSiblingElement("member")) {
      const auto way = ways_.find(member->Int64Attribute("ref"));
      if (way == ways_.end()) {
        fail(id, "the ways that it refers to");
      }
      const std::vector<int64_t>& nodes = way->second.nodes;
      if (way->second.is_virtual && nodes.size() == 2 && entry.empty()) {
        entry = nodes;
      } else {
        others.insert(others.end(), nodes.begin(), nodes.end());
      }
    }
    std::vector<int64_t> far;
    for (const int64_t node : others) {
      if (!entry.empty() && node != entry[0] && node != entry[1] &&
          std::find(far.begin(), far.end(), node) == far.end()) {
        far.push_back(node);
      }
    }
    if (entry.size() != 2 || far.size() != 2) {
      fail(id, "four corners, and a way of two nodes and type virtual across the entry");
    }
    Quadrangle corners;
    for (const auto& [index, node] : {std::pair(0U, entry[0]), {1U, entry[1]}, {2U, far[0]}, {3U, far[1]}}) {
      const auto found = nodes_.find(node);
      if (found == nodes_.end()) {
        fail(id, "nodes with a latitude and a longitude");
      }
      corners[index] = found->second;
    }
    // The sides must not cross, and the corners run counter-clockwise.
    const auto turn = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
      return (b - a).x() * (c - b).y() - (b - a).y() * (c - b).x();
    };
    if (turn(corners[1], corners[2], corners[3]) * turn(corners[0], corners[1], corners[2]) < 0.0) {
      std::swap(corners[2], corners[3]);
    }
    if (turn(corners[0], corners[1], corners[2]) < 0.0) {
      std::swap(corners[0], corners[1]);
      std::swap(corners[2], corners[3]);
    }
    return corners;
  }

  const std::string path_;
  const LocalPlane plane_;
  tinyxml2::XMLDocument file_;
  const tinyxml2::XMLElement* root_ = nullptr;
  std::map<int64_t, Eigen::Vector2d> nodes_;
  std::map<int64_t, Way> ways_;
};

}  // namespace

void writeBayLanelets(const ParkingBays& bays, const MapDatum& datum, const std::string& path) {
  const LocalPlane plane(datum);
  tinyxml2::XMLPrinter xml;
  xml.PushHeader(false, true);
  xml.OpenElement("osm");
  xml.PushAttribute("version", "0.6");
  xml.PushAttribute("generator", "vcharge");
  // Nodes come before ways, and these before areas; a bay has the numbers from 10 times its place on.
  const auto idOf = [](size_t bay, int part) {
    return 10 * static_cast<int64_t>(bay + 1) + static_cast<int64_t>(part);
  };
  constexpr int kSides = 4, kEntry = 5, kArea = 6;
  for (size_t i = 0; i < bays.bays.size(); ++i) {
    for (int corner = 0; corner < 4; ++corner) {
      const Eigen::Vector2d& at_m = bays.bays[i].corners_m[static_cast<size_t>(corner)];
      xml.OpenElement("node");
      xml.PushAttribute("id", idOf(i, corner));
      xml.PushAttribute("lat", numberText(plane.latitude_deg(at_m), "%.12f").c_str());
      xml.PushAttribute("lon", numberText(plane.longitude_deg(at_m), "%.12f").c_str());
      xml.CloseElement();
    }
  }
  for (size_t i = 0; i < bays.bays.size(); ++i) {
    addWay(&xml, idOf(i, kSides), {idOf(i, 0), idOf(i, 3), idOf(i, 2), idOf(i, 1)}, "line_thin");
    addWay(&xml, idOf(i, kEntry), {idOf(i, 1), idOf(i, 0)}, "virtual");
  }
  for (size_t i = 0; i < bays.bays.size(); ++i) {
    const ParkingBay& bay = bays.bays[i];
    xml.OpenElement("relation");
    xml.PushAttribute("id", idOf(i, kArea));
    addMember(&xml, idOf(i, kSides));
    addMember(&xml, idOf(i, kEntry));
    addTag(&xml, "type", "multipolygon");
    addTag(&xml, "subtype", "parking");
    addTag(&xml, "location", "urban");
    addTag(&xml, "participant:vehicle", "yes");
    addTag(&xml, "bay", std::to_string(bay.id));
    addTag(&xml, "row", std::to_string(bay.row));
    addTag(&xml, "kind", enumNames<BayKind>().at(static_cast<size_t>(bay.kind)));
    addTag(&xml, "state", nameOf(bay.state));
    addTag(&xml, "entry_sigma", numberText(bay.entry_sigma_m, "%.4g"));
    addTag(&xml, "end_sigma", numberText(bay.end_sigma_m, "%.4g"));
    addTag(&xml, "confidence", numberText(bay.confidence, "%.3g"));
    xml.CloseElement();
  }
  xml.CloseElement();
  writeTextFileAtomically(path, xml.CStr());
}

ParkingBays readBayLanelets(const std::string& path, const MapDatum& datum) {
  ParkingBays bays;
  bays.bays = AreaReader(path, datum).bays();
  return bays;
}

}  // namespace vcharge
