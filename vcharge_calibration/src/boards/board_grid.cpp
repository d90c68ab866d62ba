#include "boards/board_grid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "boards/board_pose.h"
#include "boards/corner_refinement.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {
namespace {

// Minimum correlation of the image around a corner with an ideal corner.
constexpr double kMinCorrelation = 0.75;
// Window and largest step for a predicted corner, relative to the squares' size.
constexpr double kGrowWindow = 0.3;
constexpr double kMaxGrowMove = 0.3;
constexpr int kMaxRounds = 20;
// A row or column outside of the board with a larger fraction of corners belongs to a larger board.
constexpr double kMaxFractionBeyond = 0.6;

/// Extends a detected part of a board, square by square, as long as corners are found.
class GridGrower {
 public:
  GridGrower(const cv::Mat& image, const CameraModel& model, CornerGrid grid)
      : image_(image), model_(model), grid_(std::move(grid)) {}

  /// Returns false if the corners are not on a plane.
  bool grow() {
    if (!locate()) {
      return false;
    }
    for (auto& [position, pixel] : grid_) {
      refine(position, &pixel);
    }
    for (int round = 0; round < kMaxRounds; ++round) {
      if (!locate()) {
        return false;
      }
      if (round == 0) {
        polarity_ = 0.0;
        for (const auto& [position, pixel] : grid_) {
          polarity_ += signedCorrelation(position, pixel);
        }
        polarity_ = polarity_ < 0.0 ? -1.0 : 1.0;
      }
      const CornerGrid found = neighbours();
      if (found.empty()) {
        return true;
      }
      grid_.insert(found.begin(), found.end());
    }
    return true;
  }

  CornerGrid takeGrid() { return std::move(grid_); }

 private:
  bool locate() {
    std::vector<BoardRay> rays;
    for (const auto& [position, pixel] : grid_) {
      Eigen::Vector3d ray;
      if (model_.unproject(pixel, &ray)) {
        rays.push_back({{static_cast<double>(position.first), static_cast<double>(position.second)}, ray});
      }
    }
    const auto pose = boardPoseFromRays(rays);
    if (!pose.has_value()) {
      return false;
    }
    camera_from_board_ = *pose;
    return true;
  }

  /// Predicted pixel of a grid position; false if the camera does not see it.
  bool predict(double column, double row, Eigen::Vector2d* pixel) const {
    return model_.project(camera_from_board_ * Eigen::Vector3d(column, row, 0.0), pixel);
  }

  // Moves the pixel to the nearby saddle point; false, with the pixel unchanged, if there is none.
  bool refine(const std::pair<int, int>& position, Eigen::Vector2d* pixel) const {
    Eigen::Vector2d right;
    Eigen::Vector2d below;
    Eigen::Vector2d here;
    if (!predict(position.first, position.second, &here) ||
        !predict(position.first + 0.5, position.second, &right) ||
        !predict(position.first, position.second + 0.5, &below)) {
      return false;
    }
    const double spacing_px = 2.0 * std::min((right - here).norm(), (below - here).norm());
    return refineCorner(image_, kGrowWindow * spacing_px, kMaxGrowMove * spacing_px, pixel);
  }

  // Correlation of the image around a pixel with a corner. Positive if the square towards +x, +y is bright
  // and (column + row) is even.
  double signedCorrelation(const std::pair<int, int>& position, const Eigen::Vector2d& at) const {
    Eigen::Vector2d predicted;
    if (!predict(position.first, position.second, &predicted)) {
      return 0.0;
    }
    const Eigen::Vector2d shift = at - predicted;
    constexpr int kSteps = 5;
    double sum = 0.0;
    double sum_squared = 0.0;
    double product = 0.0;
    int count = 0;
    for (int i = -kSteps; i <= kSteps; ++i) {
      for (int j = -kSteps; j <= kSteps; ++j) {
        if (i == 0 || j == 0) {
          continue;
        }
        Eigen::Vector2d pixel;
        if (!predict(position.first + 0.4 * i / kSteps, position.second + 0.4 * j / kSteps, &pixel)) {
          return 0.0;
        }
        pixel += shift;
        const int x = static_cast<int>(std::lround(pixel.x()));
        const int y = static_cast<int>(std::lround(pixel.y()));
        if (x < 0 || y < 0 || x >= image_.cols || y >= image_.rows) {
          return 0.0;
        }
        const double value = image_.at<uint8_t>(y, x);
        sum += value;
        sum_squared += value * value;
        product += (i > 0) == (j > 0) ? value : -value;
        ++count;
      }
    }
    const double variance = sum_squared / count - sum * sum / (count * count);
    if (variance < 9.0) {
      return 0.0;  // only noise
    }
    const double sign = (position.first + position.second) % 2 == 0 ? 1.0 : -1.0;
    return sign * product / count / std::sqrt(variance);
  }

  CornerGrid neighbours() const {
    CornerGrid found;
    for (const auto& [position, pixel] : grid_) {
      for (const auto& step : std::array<std::pair<int, int>, 4>{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}}) {
        const std::pair<int, int> next(position.first + step.first, position.second + step.second);
        Eigen::Vector2d here;
        Eigen::Vector2d at;
        if (grid_.count(next) > 0 || found.count(next) > 0 ||
            !predict(position.first, position.second, &here) || !predict(next.first, next.second, &at)) {
          continue;
        }
        // The prediction has about the same error as at the neighbour, if the camera or board model is
        // inaccurate.
        at += pixel - here;
        if (refine(next, &at) && polarity_ * signedCorrelation(next, at) > kMinCorrelation) {
          found[next] = at;
        }
      }
    }
    return found;
  }

  const cv::Mat& image_;
  const CameraModel& model_;
  CornerGrid grid_;
  RigidTransform camera_from_board_;
  double polarity_ = 1.0;
};

/// A rectangle of grid positions.
struct Extent {
  int column, row, width, height;
  bool contains(const std::pair<int, int>& position) const {
    return position.first >= column && position.first < column + width && position.second >= row &&
           position.second < row + height;
  }
};

int countInside(const CornerGrid& grid, const Extent& extent) {
  return static_cast<int>(std::count_if(grid.begin(), grid.end(),
                                        [&](const auto& entry) { return extent.contains(entry.first); }));
}

/// Whether a line of corners continues outside of a rectangle, so that the board is larger.
bool goesOn(const CornerGrid& grid, const Extent& extent) {
  const std::array<Extent, 4> beyond = {{{extent.column - 1, extent.row, 1, extent.height},
                                         {extent.column + extent.width, extent.row, 1, extent.height},
                                         {extent.column, extent.row - 1, extent.width, 1},
                                         {extent.column, extent.row + extent.height, extent.width, 1}}};
  return std::any_of(beyond.begin(), beyond.end(), [&](const Extent& line) {
    return countInside(grid, line) > kMaxFractionBeyond * line.width * line.height;
  });
}

}  // namespace

bool growGrid(const cv::Mat& image, const CameraModel& model, CornerGrid* grid) {
  GridGrower grower(image, model, *grid);
  if (!grower.grow()) {
    return false;
  }
  *grid = grower.takeGrid();
  return true;
}

std::optional<std::vector<BoardCorner>> boardOnGrid(const CornerGrid& grid, const CalibrationBoard& board) {
  Extent low{0, 0, 0, 0};
  Extent high{0, 0, 0, 0};
  for (const auto& [position, pixel] : grid) {
    low = {std::min(low.column, position.first), std::min(low.row, position.second), 0, 0};
    high = {std::max(high.column, position.first), std::max(high.row, position.second), 0, 0};
  }
  std::optional<Extent> best;
  int best_count = 0;
  bool ambiguous = true;
  for (const auto& [width, height] :
       {std::pair<int, int>{board.columns, board.rows}, {board.rows, board.columns}}) {
    for (int column = low.column; column + width - 1 <= high.column; ++column) {
      for (int row = low.row; row + height - 1 <= high.row; ++row) {
        const Extent extent{column, row, width, height};
        const int count = countInside(grid, extent);
        if (count > best_count) {
          ambiguous = false;
          best_count = count;
          best = extent;
        } else if (count == best_count && !(best.has_value() && width == height)) {
          ambiguous = true;
        }
      }
    }
  }
  if (!best.has_value() || ambiguous || goesOn(grid, *best)) {
    return std::nullopt;
  }
  const bool upright = best->width == board.columns;
  std::vector<BoardCorner> corners;
  for (const auto& [position, pixel] : grid) {
    if (!best->contains(position)) {
      continue;
    }
    const int column = position.first - best->column;
    const int row = position.second - best->row;
    // A quarter turn preserves the board's handedness.
    const int index =
        upright ? row * board.columns + column : (best->width - 1 - column) * board.columns + row;
    corners.push_back({index, pixel});
  }
  std::sort(corners.begin(), corners.end(),
            [](const BoardCorner& a, const BoardCorner& b) { return a.index < b.index; });
  return corners;
}

}  // namespace vcharge
