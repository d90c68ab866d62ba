#include "vcharge_core/motion/tracked_object_file.h"

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kFramesHeader = "stamp_ns,x_m,y_m,yaw_rad,num_objects";
constexpr std::string_view kObjectsHeader =
    "stamp_ns,id,class,class_probability,existence_probability,x_m,y_m,yaw_rad,vx_m_per_s,vy_m_per_s,is_"
    "standing,"
    "height_m,cov_x_x_m2,cov_x_y_m2,cov_x_vx_m2_per_s,cov_x_vy_m2_per_s,cov_y_y_m2,cov_y_vx_m2_per_s,"
    "cov_y_vy_m2_per_s,cov_vx_vx_m2_per_s2,cov_vx_vy_m2_per_s2,cov_vy_vy_m2_per_s2,footprint_m";
constexpr std::array<int, 4> kPlanar = {0, 1, 3, 4};  // rows of x, y, vx and vy in TrackedObject::covariance

std::string framesPath(const std::string& folder) {
  return (fs::path(folder) / "objects_frames.csv").string();
}

std::string objectsPath(const std::string& folder) {
  return (fs::path(folder) / "objects.csv").string();
}

// The shortest text from which the same number is read; -0 is written as 0.
std::string textOf(double value) {
  check(std::isfinite(value), "writeObjects: expected finite numbers");
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value + 0.0).ptr;
  return {text.data(), end};
}

std::string lineOf(Timestamp stamp, const TrackedObject& object) {
  check(object.footprint_m.size() >= 3, "writeObjects: expected footprints of three corners or more");
  std::string line = std::to_string(stamp.nanoseconds()) + "," + std::to_string(object.id) + "," +
                     nameOf(object.object_class);
  const Eigen::Vector3d& position_m = object.frame_from_object.translation();
  for (const double value :
       {object.class_probability, object.existence_probability, position_m.x(), position_m.y(),
        yawOfRotation(object.frame_from_object.rotation()), object.velocity_m_per_s.x(),
        object.velocity_m_per_s.y(), object.is_standing ? 1.0 : 0.0, object.height_m}) {
    line += "," + textOf(value);
  }
  for (size_t row = 0; row < kPlanar.size(); ++row) {
    for (size_t column = row; column < kPlanar.size(); ++column) {
      line += "," + textOf(object.covariance(kPlanar[row], kPlanar[column]));
    }
  }
  std::string corners;
  for (const Eigen::Vector2d& corner : object.footprint_m) {
    corners += (corners.empty() ? "" : ";") + textOf(corner.x()) + " " + textOf(corner.y());
  }
  return line + "," + corners + "\n";
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) {
      return parts;
    }
    text.remove_prefix(end + 1);
  }
}

template <class Number>
std::optional<Number> parse(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

// Reads a table line by line, column by column from the left.
class TableReader {
 public:
  TableReader(const std::string& path, std::string_view header)
      : path_(path), columns_(split(header, ',')), lines_(readTextFile(path)) {
    std::string line;
    std::getline(lines_, line);
    if (line != header) {
      throw InputError(path + ":1: expected the header " + std::string(header));
    }
  }

  bool nextLine() {
    if (!std::getline(lines_, line_)) {
      return false;
    }
    ++number_;
    column_ = 0;
    fields_ = split(line_, ',');
    if (fields_.size() != columns_.size()) {
      throw InputError(where() + ": expected " + std::to_string(columns_.size()) + " columns, got " +
                       std::to_string(fields_.size()));
    }
    return true;
  }

  template <class Integer>
  Integer integer() {
    const std::optional<Integer> value = parse<Integer>(fields_[column_]);
    if (!value) {
      fail("an integer");
    }
    ++column_;
    return *value;
  }
  double number(double min = -std::numeric_limits<double>::infinity(),
                double max = std::numeric_limits<double>::infinity()) {
    const std::optional<double> value = parse<double>(fields_[column_]);
    if (!value || !std::isfinite(*value) || *value < min || *value > max) {
      std::ostringstream range;
      range << "a finite number from " << min << " to " << max;
      fail(range.str());
    }
    ++column_;
    return *value;
  }
  std::string_view text() { return fields_[column_++]; }

  // Error in the column that was read last.
  [[noreturn]] void failBefore(const std::string& expected) {
    --column_;
    fail(expected);
  }
  // Error that concerns the line.
  [[noreturn]] void failLine(const std::string& message) const { throw InputError(where() + ": " + message); }

 private:
  std::string where() const { return path_ + ":" + std::to_string(number_); }
  [[noreturn]] void fail(const std::string& expected) const {
    throw InputError(where() + ": " + std::string(columns_[column_]) + ": expected " + expected + ", got '" +
                     std::string(fields_[column_]) + "'");
  }

  const std::string path_;
  const std::vector<std::string_view> columns_;
  std::istringstream lines_;
  std::string line_;
  std::vector<std::string_view> fields_;
  size_t number_ = 1, column_ = 0;
};

std::vector<Eigen::Vector2d> readFootprint(TableReader* table) {
  std::vector<Eigen::Vector2d> footprint_m;
  for (const std::string_view corner : split(table->text(), ';')) {
    const std::vector<std::string_view> parts = split(corner, ' ');
    const std::optional<double> x = parse<double>(parts.front()), y = parse<double>(parts.back());
    if (parts.size() != 2 || !x || !y || !std::isfinite(*x) || !std::isfinite(*y)) {
      table->failBefore("corners 'x y;x y;...'");
    }
    footprint_m.emplace_back(*x, *y);
  }
  if (footprint_m.size() < 3) {
    table->failBefore("three corners or more");
  }
  return footprint_m;
}

TrackedObject readObject(TableReader* table) {
  TrackedObject object;
  object.id = table->integer<uint32_t>();
  const std::optional<ObjectClass> object_class = objectClassOf(std::string(table->text()));
  if (!object_class) {
    table->failBefore("unknown, adult, child, car or bicycle");
  }
  object.object_class = *object_class;
  object.class_probability = table->number(0.0, 1.0);
  object.existence_probability = table->number(0.0, 1.0);
  const double x_m = table->number(), y_m = table->number(), yaw_rad = table->number();
  object.frame_from_object = RigidTransform::planar(x_m, y_m, yaw_rad);
  object.velocity_m_per_s.x() = table->number();
  object.velocity_m_per_s.y() = table->number();
  const int standing = table->integer<int>();
  if (standing != 0 && standing != 1) {
    table->failBefore("0 or 1");
  }
  object.is_standing = standing == 1;
  object.height_m = table->number(0.0);
  for (size_t row = 0; row < kPlanar.size(); ++row) {
    for (size_t column = row; column < kPlanar.size(); ++column) {
      const double entry = row == column ? table->number(0.0) : table->number();
      object.covariance(kPlanar[row], kPlanar[column]) = entry;
      object.covariance(kPlanar[column], kPlanar[row]) = entry;
    }
  }
  object.footprint_m = readFootprint(table);
  return object;
}

}  // namespace

void writeObjects(const std::vector<ObjectFrame>& frames, const std::string& folder) {
  std::string frame_lines = std::string(kFramesHeader) + "\n";
  std::string object_lines = std::string(kObjectsHeader) + "\n";
  for (size_t i = 0; i < frames.size(); ++i) {
    const ObjectFrame& frame = frames[i];
    check(i == 0 || frames[i - 1].stamp < frame.stamp, "writeObjects: expected increasing stamps");
    const Eigen::Vector3d& position_m = frame.odom_from_vehicle.translation();
    frame_lines += std::to_string(frame.stamp.nanoseconds()) + "," + textOf(position_m.x()) + "," +
                   textOf(position_m.y()) + "," + textOf(yawOfRotation(frame.odom_from_vehicle.rotation())) +
                   "," + std::to_string(frame.objects.size()) + "\n";
    std::set<uint32_t> ids;
    for (const TrackedObject& object : frame.objects) {
      check(ids.insert(object.id).second, "writeObjects: expected each id once at a stamp");
      object_lines += lineOf(frame.stamp, object);
    }
  }
  createFolder(folder);
  std::error_code ignored;
  fs::remove(framesPath(folder), ignored);  // partly replaced files then count as incomplete
  writeTextFileAtomically(objectsPath(folder), object_lines);
  writeTextFileAtomically(framesPath(folder), frame_lines);
}

std::vector<ObjectFrame> readObjects(const std::string& folder) {
  std::vector<ObjectFrame> frames;
  std::vector<size_t> num_objects;
  std::map<Timestamp, size_t> index_at;
  TableReader frame_table(framesPath(folder), kFramesHeader);
  while (frame_table.nextLine()) {
    ObjectFrame frame;
    frame.stamp = Timestamp::fromNanoseconds(frame_table.integer<int64_t>());
    if (!frames.empty() && frame.stamp <= frames.back().stamp) {
      frame_table.failBefore("increasing stamps");
    }
    const double x_m = frame_table.number(), y_m = frame_table.number(), yaw_rad = frame_table.number();
    frame.odom_from_vehicle = RigidTransform::planar(x_m, y_m, yaw_rad);
    num_objects.push_back(frame_table.integer<uint32_t>());
    index_at[frame.stamp] = frames.size();
    frames.push_back(frame);
  }
  TableReader table(objectsPath(folder), kObjectsHeader);
  std::set<std::pair<size_t, uint32_t>> ids;
  while (table.nextLine()) {
    const auto found = index_at.find(Timestamp::fromNanoseconds(table.integer<int64_t>()));
    if (found == index_at.end()) {
      table.failBefore("a stamp of objects_frames.csv");
    }
    const TrackedObject object = readObject(&table);
    if (!ids.emplace(found->second, object.id).second) {
      table.failLine("id: expected each id once at a stamp, got " + std::to_string(object.id) + " twice");
    }
    frames[found->second].objects.push_back(object);
  }
  for (size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].objects.size() != num_objects[i]) {
      throw InputError(framesPath(folder) + ":" + std::to_string(i + 2) + ": num_objects: expected the " +
                       std::to_string(frames[i].objects.size()) + " of objects.csv, got " +
                       std::to_string(num_objects[i]));
    }
  }
  return frames;
}

}  // namespace vcharge
