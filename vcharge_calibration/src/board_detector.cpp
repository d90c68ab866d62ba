#include "vcharge_calibration/board_detector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "board_pose.h"
#include "corner_refinement.h"
#include "vcharge_core/error.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kViewWidth_rad = 1.75;
constexpr int kViewSize_px = 720;
// A corner is there when the squares around it correlate at least so well with a perfect corner.
constexpr double kMinCorrelation = 0.75;
// Window and largest step of a corner that was predicted, over the squares' size.
constexpr double kGrowWindow = 0.3;
constexpr double kMaxGrowMove = 0.3;
constexpr int kMaxRounds = 20;
// An outermost row or column with fewer of its corners does not belong to the board.
constexpr double kMinRowShare = 0.3;
// Of a board completed by prediction, so many corners may be hidden.
constexpr double kMinShareSeen = 0.9;

std::optional<std::vector<cv::Point2f>> findGrid(const cv::Mat& image, int columns, int rows) {
  std::vector<cv::Point2f> corners;
  const int flags = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY;
  if (!cv::findChessboardCornersSB(image, cv::Size(columns, rows), corners, flags)) {
    return std::nullopt;
  }
  return corners;
}

/// A pinhole view into a direction: how its pixels lie in the fisheye image.
class View {
 public:
  View(const cv::Mat& image, const CameraModel& model, double angle_rad, double azimuth_rad)
      : model_(model), focal_px_(0.5 * kViewSize_px / std::tan(0.5 * kViewWidth_rad)) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(azimuth_rad, Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY()));
    camera_from_view_ = turn.toRotationMatrix();
    cv::Mat map(kViewSize_px, kViewSize_px, CV_32FC2, cv::Scalar(-1e4, -1e4));
    model.visit([&](const auto& concrete) {
      for (int y = 0; y < kViewSize_px; ++y) {
        for (int x = 0; x < kViewSize_px; ++x) {
          Eigen::Vector2d pixel;
          if (concrete.project(rayOf(x, y), &pixel)) {
            map.at<cv::Vec2f>(y, x) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
          }
        }
      }
    });
    cv::remap(image, pixels_, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(0));
  }

  const cv::Mat& pixels() const { return pixels_; }
  bool inImage(const cv::Point2f& point, Eigen::Vector2d* pixel) const {
    return model_.project(rayOf(point.x, point.y), pixel);
  }

 private:
  Eigen::Vector3d rayOf(double x, double y) const {
    const double middle = 0.5 * (kViewSize_px - 1);
    return camera_from_view_ * Eigen::Vector3d(x - middle, y - middle, focal_px_).normalized();
  }

  const CameraModel& model_;
  const double focal_px_;
  Eigen::Matrix3d camera_from_view_;
  cv::Mat pixels_;
};

/// Corners by their place on a grid whose origin is anywhere on the board.
using Grid = std::map<std::pair<int, int>, Eigen::Vector2d>;

/// Grows a part of a board, square by square, as far as there are corners.
class GridGrower {
 public:
  GridGrower(const cv::Mat& image, const CameraModel& model, Grid grid)
      : image_(image), model_(model), grid_(std::move(grid)) {}

  /// False when the corners do not lie on a plane.
  bool grow() {
    if (!locate()) {
      return false;
    }
    for (auto& [place, pixel] : grid_) {
      refine(place, &pixel);
    }
    for (int round = 0; round < kMaxRounds; ++round) {
      if (!locate()) {
        return false;
      }
      if (round == 0) {
        polarity_ = 0.0;
        for (const auto& [place, pixel] : grid_) {
          polarity_ += signedCorrelation(place, pixel);
        }
        polarity_ = polarity_ < 0.0 ? -1.0 : 1.0;
      }
      const Grid found = neighbours();
      if (found.empty()) {
        return true;
      }
      grid_.insert(found.begin(), found.end());
    }
    return true;
  }

  const Grid& grid() const { return grid_; }

 private:
  bool locate() {
    std::vector<BoardRay> rays;
    for (const auto& [place, pixel] : grid_) {
      Eigen::Vector3d ray;
      if (model_.unproject(pixel, &ray)) {
        rays.push_back({{static_cast<double>(place.first), static_cast<double>(place.second)}, ray});
      }
    }
    const auto pose = boardPoseFromRays(rays);
    if (!pose.has_value()) {
      return false;
    }
    camera_from_board_ = *pose;
    return true;
  }

  /// Pixel where a place should be; false where the camera does not see it.
  bool predict(double column, double row, Eigen::Vector2d* pixel) const {
    return model_.project(camera_from_board_ * Eigen::Vector3d(column, row, 0.0), pixel);
  }

  // To the saddle point nearby; false, and the pixel stays, where there is none.
  bool refine(const std::pair<int, int>& place, Eigen::Vector2d* pixel) const {
    Eigen::Vector2d right;
    Eigen::Vector2d below;
    Eigen::Vector2d here;
    if (!predict(place.first, place.second, &here) || !predict(place.first + 0.5, place.second, &right) ||
        !predict(place.first, place.second + 0.5, &below)) {
      return false;
    }
    const double spacing_px = 2.0 * std::min((right - here).norm(), (below - here).norm());
    return refineCorner(image_, kGrowWindow * spacing_px, kMaxGrowMove * spacing_px, pixel);
  }

  // How well the image around a pixel fits a corner at this place. Positive where the square towards +x, +y
  // is bright and (column + row) is even.
  double signedCorrelation(const std::pair<int, int>& place, const Eigen::Vector2d& at) const {
    Eigen::Vector2d predicted;
    if (!predict(place.first, place.second, &predicted)) {
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
        if (!predict(place.first + 0.4 * i / kSteps, place.second + 0.4 * j / kSteps, &pixel)) {
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
      return 0.0;  // nothing but noise
    }
    const double sign = (place.first + place.second) % 2 == 0 ? 1.0 : -1.0;
    return sign * product / count / std::sqrt(variance);
  }

  Grid neighbours() const {
    Grid found;
    for (const auto& [place, pixel] : grid_) {
      for (const auto& step : std::array<std::pair<int, int>, 4>{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}}) {
        const std::pair<int, int> next(place.first + step.first, place.second + step.second);
        Eigen::Vector2d at;
        if (grid_.count(next) == 0 && found.count(next) == 0 && predict(next.first, next.second, &at) &&
            refine(next, &at) && polarity_ * signedCorrelation(next, at) > kMinCorrelation) {
          found[next] = at;
        }
      }
    }
    return found;
  }

  const cv::Mat& image_;
  const CameraModel& model_;
  Grid grid_;
  RigidTransform camera_from_board_;
  double polarity_ = 1.0;
};

struct Extent {
  int min_column, max_column, min_row, max_row;
  int width() const { return max_column - min_column + 1; }
  int height() const { return max_row - min_row + 1; }
  bool contains(const std::pair<int, int>& place) const {
    return place.first >= min_column && place.first <= max_column && place.second >= min_row &&
           place.second <= max_row;
  }
};

/// Extent of a grid without outermost rows and columns of which little was seen: a pattern beside the board.
Extent extentOf(const Grid& grid) {
  Extent extent{grid.begin()->first.first, grid.begin()->first.first, grid.begin()->first.second,
                grid.begin()->first.second};
  for (const auto& [place, pixel] : grid) {
    extent.min_column = std::min(extent.min_column, place.first);
    extent.max_column = std::max(extent.max_column, place.first);
    extent.min_row = std::min(extent.min_row, place.second);
    extent.max_row = std::max(extent.max_row, place.second);
  }
  const auto seen = [&](const Extent& part) {
    const auto count = std::count_if(grid.begin(), grid.end(),
                                     [&](const auto& entry) { return part.contains(entry.first); });
    return static_cast<double>(count) / (part.width() * part.height());
  };
  for (bool trimmed = true; trimmed && extent.width() > 2 && extent.height() > 2;) {
    trimmed = false;
    for (const auto& [edge, step] : {std::pair<int Extent::*, int>{&Extent::min_column, 1},
                                     {&Extent::max_column, -1},
                                     {&Extent::min_row, 1},
                                     {&Extent::max_row, -1}}) {
      Extent line = extent;
      const bool column = edge == &Extent::min_column || edge == &Extent::max_column;
      (column ? line.min_column : line.min_row) = extent.*edge;
      (column ? line.max_column : line.max_row) = extent.*edge;
      if (seen(line) < kMinRowShare) {
        extent.*edge += step;
        trimmed = true;
      }
    }
  }
  return extent;
}

/// The grid as corners of the board, when its extent is exactly the board's.
std::optional<std::vector<BoardCorner>> asBoard(const Grid& grid, const CalibrationBoard& board) {
  const Extent extent = extentOf(grid);
  const bool upright = extent.width() == board.columns && extent.height() == board.rows;
  const bool lying = extent.width() == board.rows && extent.height() == board.columns;
  if (!upright && !lying) {
    return std::nullopt;
  }
  std::vector<BoardCorner> corners;
  for (const auto& [place, pixel] : grid) {
    if (!extent.contains(place)) {
      continue;
    }
    const int column = place.first - extent.min_column;
    const int row = place.second - extent.min_row;
    // A quarter turn keeps the board's handedness.
    const int index =
        upright ? row * board.columns + column : (extent.width() - 1 - column) * board.columns + row;
    corners.push_back({index, pixel});
  }
  std::sort(corners.begin(), corners.end(),
            [](const BoardCorner& a, const BoardCorner& b) { return a.index < b.index; });
  return corners;
}

bool isComplete(const std::vector<BoardCorner>& corners, const CalibrationBoard& board) {
  return static_cast<double>(corners.size()) >= kMinShareSeen * board.numCorners();
}

}  // namespace

std::optional<BoardView> BoardDetector::detect(const cv::Mat& image) const {
  check(image.type() == CV_8UC1, "BoardDetector::detect: expected a CV_8UC1 image");
  for (const double scale : {1.0, 0.5, 2.0}) {
    cv::Mat scaled;
    cv::resize(image, scaled, cv::Size(), scale, scale, scale < 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR);
    const auto points = findGrid(scaled, board_.columns, board_.rows);
    if (!points.has_value()) {
      continue;
    }
    BoardView view;
    for (size_t i = 0; i < points->size(); ++i) {
      // Pixel centres are whole numbers: coordinates scale about half a pixel outside the image.
      const auto unscaled = [&](float value) { return (static_cast<double>(value) + 0.5) / scale - 0.5; };
      view.corners.push_back({static_cast<int>(i), {unscaled((*points)[i].x), unscaled((*points)[i].y)}});
    }
    refineCorners(image, board_, &view.corners);
    if (view.corners.size() == points->size()) {
      return view;
    }
  }
  return std::nullopt;
}

std::optional<BoardView> BoardDetector::detect(const cv::Mat& image, const CameraModel& model) const {
  check(image.type() == CV_8UC1, "BoardDetector::detect: expected a CV_8UC1 image");
  struct Direction {
    double angle_rad, azimuth_rad;
  };
  std::vector<Direction> directions = {{0.0, 0.0}};
  for (const auto& [angle_rad, count] : {std::pair<double, int>{0.6, 6}, {1.15, 10}}) {
    for (int i = 0; i < count; ++i) {
      directions.push_back({angle_rad, 2.0 * kPi * i / count});
    }
  }
  const std::array<cv::Size, 3> parts = {
      cv::Size(board_.columns, board_.rows),
      cv::Size(std::max(3, board_.columns - 2), std::max(3, board_.rows - 2)), cv::Size(4, 3)};
  for (const cv::Size& part : parts) {
    for (const Direction& direction : directions) {
      const View view(image, model, direction.angle_rad, direction.azimuth_rad);
      const auto points = findGrid(view.pixels(), part.width, part.height);
      if (!points.has_value()) {
        continue;
      }
      Grid grid;
      bool seen = true;
      for (size_t i = 0; i < points->size(); ++i) {
        Eigen::Vector2d pixel;
        seen = seen && view.inImage((*points)[i], &pixel);
        grid[{static_cast<int>(i) % part.width, static_cast<int>(i) / part.width}] = pixel;
      }
      GridGrower grower(image, model, grid);
      if (!seen || !grower.grow()) {
        continue;
      }
      auto corners = asBoard(grower.grid(), board_);
      if (!corners.has_value()) {
        continue;
      }
      BoardView result;
      result.corners = *corners;
      refineCorners(image, board_, &result.corners);
      if (isComplete(result.corners, board_)) {
        return result;
      }
    }
  }
  return std::nullopt;
}

std::string BoardDetector::describeOther(const cv::Mat& image) const {
  const int flags = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_LARGER;
  std::vector<cv::Point2f> corners;
  cv::Mat meta;
  if (!cv::findChessboardCornersSB(image, cv::Size(3, 3), corners, flags, meta) || meta.empty()) {
    return "";
  }
  return "a chessboard of " + std::to_string(meta.cols) + "x" + std::to_string(meta.rows) + " inner corners";
}

}  // namespace vcharge
