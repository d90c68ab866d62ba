#include "vcharge_calibration/chessboard.h"

#include <cmath>
#include <regex>
#include <stdexcept>

namespace vcharge {

Chessboard Chessboard::parse(const std::string& size, double square_m) {
  std::smatch match;
  if (!std::regex_match(size, match, std::regex("([0-9]{1,3})x([0-9]{1,3})"))) {
    throw std::invalid_argument("board: expected COLUMNSxROWS of inner corners such as 9x6, got '" + size +
                                "'");
  }
  Chessboard board;
  board.columns = std::stoi(match[1]);
  board.rows = std::stoi(match[2]);
  board.square_m = square_m;
  if (board.columns < 3 || board.rows < 3) {
    throw std::invalid_argument("board: expected at least 3x3 inner corners, got '" + size + "'");
  }
  if (!(square_m > 0.0) || !std::isfinite(square_m)) {
    throw std::invalid_argument("square_m: must be positive, is " + std::to_string(square_m));
  }
  return board;
}

}  // namespace vcharge
