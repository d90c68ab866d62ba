#include "vcharge_calibration/boards/board_detector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "boards/april_grid.h"
#include "boards/board_grid.h"
#include "boards/corner_refinement.h"
#include "vcharge_core/base/error.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kViewWidth_rad = 1.75;
constexpr int kViewSize_px = 420;
// Fraction of corners that must be visible on a board completed by prediction.
constexpr double kMinVisibleFraction = 0.9;
// An AprilGrid may be partly visible: this many corners (four tags) determine its pose.
constexpr size_t kMinTagCorners = 16;
// Window at a tag's corner, relative to the distance to the next edges.
constexpr double kTagWindow = 0.7;

// Part of a board that is detected first if the whole is not found.
const cv::Size kPart(4, 3);
// The search is faster in reduced images and finds as many boards; corners are refined afterwards.
constexpr int kSearchWidth_px = 640;
// Smaller images are also searched at a larger scale.
constexpr int kSmallWidth_px = 500;

std::optional<std::vector<cv::Point2f>> findGrid(const cv::Mat& image, int columns, int rows) {
  std::vector<cv::Point2f> corners;
  const int flags = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE;
  if (!cv::findChessboardCornersSB(image, cv::Size(columns, rows), corners, flags)) {
    return std::nullopt;
  }
  return corners;
}

/// OpenCV's older detector: fast, and better for large squares that the lens distorts.
std::optional<std::vector<cv::Point2f>> findQuads(const cv::Mat& image, int columns, int rows) {
  std::vector<cv::Point2f> corners;
  const int flags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
  if (!cv::findChessboardCorners(image, cv::Size(columns, rows), corners, flags)) {
    return std::nullopt;
  }
  return corners;
}

/// camera_from_view of a pinhole view in the direction `angle_rad` from the axis, towards `azimuth_rad`.
Eigen::Matrix3d rotationOfView(double angle_rad, double azimuth_rad) {
  return (Eigen::AngleAxisd(azimuth_rad, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY()))
      .toRotationMatrix();
}

/// A pinhole view of the fisheye image in some direction.
class View {
 public:
  View(const cv::Mat& image, const CameraModel& model, double angle_rad, double azimuth_rad)
      : model_(model), focal_px_(0.5 * kViewSize_px / std::tan(0.5 * kViewWidth_rad)) {
    camera_from_view_ = rotationOfView(angle_rad, azimuth_rad);
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

using ToImage = std::function<bool(const cv::Point2f&, Eigen::Vector2d*)>;

bool isPixel(const cv::Point2f& point, Eigen::Vector2d* pixel) {
  *pixel = {point.x, point.y};
  return true;
}

/// Adds new tags, with corners refined in the image.
void addTags(const cv::Mat& image, const CalibrationBoard& board, const std::vector<SeenTag>& tags,
             const ToImage& toImage, std::map<int, Eigen::Vector2d>* corners) {
  for (const SeenTag& tag : tags) {
    const std::vector<int> indices = cornersOfTag(board, tag.id);
    std::array<Eigen::Vector2d, 4> pixels;
    bool inside = corners->count(indices[0]) == 0;
    for (size_t i = 0; i < 4 && inside; ++i) {
      inside = toImage(tag.corners[i], &pixels[i]);
    }
    if (!inside) {
      continue;
    }
    double side_px = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < 4; ++i) {
      side_px = std::min(side_px, (pixels[i] - pixels[(i + 1) % 4]).norm());
    }
    const double window_px = kTagWindow * board.clearance_m() / board.square_m * side_px;
    for (size_t i = 0; i < 4 && inside; ++i) {
      inside = refineCorner(image, window_px, 1.0 + window_px, &pixels[i]);
    }
    for (size_t i = 0; i < 4 && inside; ++i) {
      (*corners)[indices[i]] = pixels[i];
    }
  }
}

std::optional<BoardView> viewOfTags(const std::map<int, Eigen::Vector2d>& corners) {
  if (corners.size() < kMinTagCorners) {
    return std::nullopt;
  }
  BoardView view;
  for (const auto& [index, pixel] : corners) {
    view.corners.push_back({index, pixel});
  }
  return view;
}

bool isComplete(const std::vector<BoardCorner>& corners, const CalibrationBoard& board) {
  return static_cast<double>(corners.size()) >= kMinVisibleFraction * board.numCorners();
}

}  // namespace

std::optional<BoardView> BoardDetector::detect(const cv::Mat& image) const {
  check(image.type() == CV_8UC1, "BoardDetector::detect: expected a CV_8UC1 image");
  if (board_.pattern == BoardPattern::kAprilGrid) {
    std::map<int, Eigen::Vector2d> corners;
    addTags(image, board_, findTags(image, board_), isPixel, &corners);
    return viewOfTags(corners);
  }
  struct Search {
    decltype(&findGrid) find;
    double scale;
  };
  std::vector<Search> searches = {{findQuads, 1.0}, {findGrid, 1.0}};
  if (image.cols > kSearchWidth_px) {
    searches.insert(searches.begin(), {findGrid, static_cast<double>(kSearchWidth_px) / image.cols});
  }
  if (image.cols < kSmallWidth_px) {
    searches.push_back({findGrid, 2.0});
  }
  for (const auto& [find, scale] : searches) {
    cv::Mat scaled = image;
    if (scale != 1.0) {
      cv::resize(image, scaled, cv::Size(), scale, scale, scale < 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR);
    }
    const auto points = find(scaled, board_.columns, board_.rows);
    if (!points.has_value()) {
      continue;
    }
    BoardView view;
    for (size_t i = 0; i < points->size(); ++i) {
      // Pixel centres have integer coordinates, so scaling is relative to half a pixel outside the image.
      const double across = static_cast<double>(scaled.cols) / image.cols;
      const double down = static_cast<double>(scaled.rows) / image.rows;
      view.corners.push_back({static_cast<int>(i),
                              {((*points)[i].x + 0.5) / across - 0.5, ((*points)[i].y + 0.5) / down - 0.5}});
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
  if (board_.pattern == BoardPattern::kChessboard) {
    if (auto found = detectQuickly(image, model)) {
      return found;
    }
  }
  struct Direction {
    double angle_rad, azimuth_rad;
  };
  std::vector<Direction> directions = {{0.0, 0.0}};
  for (const auto& [angle_rad, count] : {std::pair<double, int>{0.6, 6}, {1.15, 10}}) {
    for (int i = 0; i < count; ++i) {
      directions.push_back({angle_rad, 2.0 * kPi * i / count});
    }
  }
  std::vector<View> views;
  views.reserve(directions.size());
  for (const Direction& direction : directions) {
    const Eigen::Vector3d middle =
        rotationOfView(direction.angle_rad, direction.azimuth_rad) * Eigen::Vector3d::UnitZ();
    Eigen::Vector2d pixel;
    if (model.project(middle, &pixel) && pixel.x() > 0 && pixel.y() > 0 && pixel.x() < image.cols - 1 &&
        pixel.y() < image.rows - 1) {
      views.emplace_back(image, model, direction.angle_rad, direction.azimuth_rad);
    }
  }
  if (board_.pattern == BoardPattern::kAprilGrid) {
    // Combines parts of the grid from all views, and the least distorted tags of the image itself.
    std::map<int, Eigen::Vector2d> corners;
    addTags(image, board_, findTags(image, board_), isPixel, &corners);
    for (const View& view : views) {
      addTags(
          image, board_, findTags(view.pixels(), board_),
          [&view](const cv::Point2f& point, Eigen::Vector2d* pixel) { return view.inImage(point, pixel); },
          &corners);
    }
    return viewOfTags(corners);
  }
  for (const View& view : views) {
    if (auto found = growPart(image, model, kPart, findGrid(view.pixels(), kPart.width, kPart.height),
                              [&view](const cv::Point2f& point, Eigen::Vector2d* pixel) {
                                return view.inImage(point, pixel);
                              })) {
      return found;
    }
  }
  return std::nullopt;
}

std::optional<BoardView> BoardDetector::detectQuickly(const cv::Mat& image, const CameraModel& model) const {
  check(image.type() == CV_8UC1, "BoardDetector::detectQuickly: expected a CV_8UC1 image");
  if (board_.pattern == BoardPattern::kAprilGrid) {
    return detect(image);
  }
  cv::Mat reduced;
  const double scale = std::min(1.0, static_cast<double>(kSearchWidth_px) / image.cols);
  cv::resize(image, reduced, cv::Size(), scale, scale, cv::INTER_AREA);
  return growPart(image, model, kPart, findGrid(reduced, kPart.width, kPart.height),
                  [scale](const cv::Point2f& point, Eigen::Vector2d* pixel) {
                    *pixel = Eigen::Vector2d((point.x + 0.5) / scale - 0.5, (point.y + 0.5) / scale - 0.5);
                    return true;
                  });
}

std::optional<BoardView> BoardDetector::growPart(
    const cv::Mat& image, const CameraModel& model, cv::Size part,
    const std::optional<std::vector<cv::Point2f>>& points,
    const std::function<bool(const cv::Point2f&, Eigen::Vector2d*)>& toImage) const {
  if (!points.has_value()) {
    return std::nullopt;
  }
  CornerGrid grid;
  for (size_t i = 0; i < points->size(); ++i) {
    Eigen::Vector2d pixel;
    if (!toImage((*points)[i], &pixel)) {
      return std::nullopt;
    }
    grid[{static_cast<int>(i) % part.width, static_cast<int>(i) / part.width}] = pixel;
  }
  const auto corners = growGrid(image, model, &grid) ? boardOnGrid(grid, board_) : std::nullopt;
  if (!corners.has_value()) {
    return std::nullopt;
  }
  BoardView view;
  view.corners = *corners;
  refineCorners(image, board_, &view.corners);
  return isComplete(view.corners, board_) ? std::optional<BoardView>(view) : std::nullopt;
}

std::string BoardDetector::describeOther(const cv::Mat& image) const {
  if (board_.pattern == BoardPattern::kAprilGrid) {
    cv::Mat mirrored;
    cv::flip(image, mirrored, 1);
    if (!findTags(mirrored, board_).empty()) {
      return "it mirrored";
    }
  }
  const int flags = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_LARGER;
  std::vector<cv::Point2f> corners;
  cv::Mat meta;
  if (!cv::findChessboardCornersSB(image, cv::Size(3, 3), corners, flags, meta) || meta.empty()) {
    return "";
  }
  // The orientation of a board does not tell which side is called columns.
  return "a chessboard of " + std::to_string(std::max(meta.cols, meta.rows)) + "x" +
         std::to_string(std::min(meta.cols, meta.rows)) + " inner corners";
}

}  // namespace vcharge
