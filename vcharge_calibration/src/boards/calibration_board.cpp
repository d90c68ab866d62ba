#include "vcharge_calibration/boards/calibration_board.h"

#include <algorithm>
#include <cmath>
#include <regex>
#include <stdexcept>

#include <yaml-cpp/yaml.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"

namespace vcharge {

namespace {

void requirePositive(const char* name, double value) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(std::string(name) + ": must be positive, is " + std::to_string(value));
  }
}

struct AprilGridFile {
  std::string target_type;
  int tag_columns = 0, tag_rows = 0;
  double tag_m = 0.0, tag_spacing = 0.0;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("target_type", target_type);
    visit("tagCols", tag_columns);
    visit("tagRows", tag_rows);
    visit("tagSize", tag_m);
    visit("tagSpacing", tag_spacing);
  }
  void validate() const { CalibrationBoard::aprilGrid(tag_columns, tag_rows, tag_m, tag_spacing); }
};

struct CheckerboardFile {
  std::string target_type;
  int columns = 0, rows = 0;
  double row_spacing_m = 0.0, column_spacing_m = 0.0;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("target_type", target_type);
    visit("targetCols", columns);
    visit("targetRows", rows);
    visit("rowSpacingMeters", row_spacing_m);
    visit("colSpacingMeters", column_spacing_m);
  }
  CalibrationBoard board() const {
    return CalibrationBoard::parse(std::to_string(columns) + "x" + std::to_string(rows), row_spacing_m);
  }
  void validate() const {
    board();
    if (row_spacing_m != column_spacing_m) {
      throw std::invalid_argument("colSpacingMeters: must equal rowSpacingMeters, is " +
                                  std::to_string(column_spacing_m));
    }
  }
};

}  // namespace

CalibrationBoard CalibrationBoard::parse(const std::string& size, double square_m) {
  std::smatch match;
  if (!std::regex_match(size, match, std::regex("([0-9]{1,3})x([0-9]{1,3})"))) {
    throw std::invalid_argument("board: expected COLUMNSxROWS of inner corners such as 9x6, got '" + size +
                                "'");
  }
  CalibrationBoard board;
  board.columns = std::stoi(match[1]);
  board.rows = std::stoi(match[2]);
  board.square_m = square_m;
  if (board.columns < 3 || board.rows < 3) {
    throw std::invalid_argument("board: expected at least 3x3 inner corners, got '" + size + "'");
  }
  requirePositive("square_m", square_m);
  return board;
}

CalibrationBoard CalibrationBoard::aprilGrid(int tag_columns, int tag_rows, double tag_m,
                                             double tag_spacing) {
  constexpr int kMaxTags = 587;  // size of the family 36h11
  if (tag_columns < 1 || tag_rows < 1 || tag_columns > kMaxTags || tag_rows > kMaxTags ||
      tag_columns * tag_rows < 4 || tag_columns * tag_rows > kMaxTags) {
    throw std::invalid_argument("tagCols, tagRows: expected 4 to " + std::to_string(kMaxTags) +
                                " tags, got " + std::to_string(tag_columns) + "x" + std::to_string(tag_rows));
  }
  requirePositive("tagSize", tag_m);
  requirePositive("tagSpacing", tag_spacing);
  CalibrationBoard board;
  board.pattern = BoardPattern::kAprilGrid;
  board.columns = 2 * tag_columns;
  board.rows = 2 * tag_rows;
  board.square_m = tag_m;
  board.tag_spacing = tag_spacing;
  return board;
}

std::string CalibrationBoard::description() const {
  return pattern == BoardPattern::kChessboard
             ? "chessboard of " + std::to_string(columns) + "x" + std::to_string(rows) + " inner corners"
             : "AprilGrid of " + std::to_string(columns / 2) + "x" + std::to_string(rows / 2) + " tags";
}

CalibrationBoard readCalibrationBoard(const std::string& path) {
  const YAML::Node node = loadYamlFile(path);
  const std::string type = node.IsMap() && node["target_type"].IsDefined() && node["target_type"].IsScalar()
                               ? node["target_type"].as<std::string>()
                               : "";
  if (type == "aprilgrid") {
    AprilGridFile file;
    readFields(node, path, &file);
    return CalibrationBoard::aprilGrid(file.tag_columns, file.tag_rows, file.tag_m, file.tag_spacing);
  }
  if (type == "checkerboard") {
    CheckerboardFile file;
    readFields(node, path, &file);
    return file.board();
  }
  throw InputError(path + ": target_type: expected aprilgrid or checkerboard, got '" + type + "'");
}

}  // namespace vcharge
