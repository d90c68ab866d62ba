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
  VCHARGE_BEGIN_OPTIONS(AprilGridFile);
  VCHARGE_OPTION(std::string, target_type, "", anyValue(), "Always aprilgrid.");
  VCHARGE_OPTION(int, tagCols, 0, anyValue(), "Columns of tags.");
  VCHARGE_OPTION(int, tagRows, 0, anyValue(), "Rows of tags.");
  VCHARGE_OPTION(double, tagSize, 0.0, anyValue(), "Side of a tag in metres.");
  VCHARGE_OPTION(double, tagSpacing, 0.0, anyValue(), "Ratio of the gap between tags to their side.");
  VCHARGE_END_OPTIONS();
  void checkFields() const { board(); }
  CalibrationBoard board() const {
    return CalibrationBoard::aprilGrid(tagCols, tagRows, tagSize, tagSpacing);
  }
};

struct CheckerboardFile {
  VCHARGE_BEGIN_OPTIONS(CheckerboardFile);
  VCHARGE_OPTION(std::string, target_type, "", anyValue(), "Always checkerboard.");
  VCHARGE_OPTION(int, targetCols, 0, anyValue(), "Columns of inner corners.");
  VCHARGE_OPTION(int, targetRows, 0, anyValue(), "Rows of inner corners.");
  VCHARGE_OPTION(double, rowSpacingMeters, 0.0, anyValue(), "Distance between rows.");
  VCHARGE_OPTION(double, colSpacingMeters, 0.0, anyValue(), "Distance between columns.");
  VCHARGE_END_OPTIONS();
  CalibrationBoard board() const {
    return CalibrationBoard::parse(std::to_string(targetCols) + "x" + std::to_string(targetRows),
                                   rowSpacingMeters);
  }
  void checkFields() const {
    board();
    if (rowSpacingMeters != colSpacingMeters) {
      throw std::invalid_argument("colSpacingMeters: must equal rowSpacingMeters, is " +
                                  std::to_string(colSpacingMeters));
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
  constexpr int kMaxTags = 587;  // number of tags in the family 36h11
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
    return file.board();
  }
  if (type == "checkerboard") {
    CheckerboardFile file;
    readFields(node, path, &file);
    return file.board();
  }
  throw InputError(path + ": target_type: expected aprilgrid or checkerboard, got '" + type + "'");
}

}  // namespace vcharge
