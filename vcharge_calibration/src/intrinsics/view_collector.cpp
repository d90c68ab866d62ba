#include "vcharge_calibration/intrinsics/view_collector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "intrinsics/intrinsic_optimizer.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/text_format.h"

namespace vcharge {

namespace {

// Opposite sides of a board parallel to the image are equally long, and so are its diagonals.
constexpr double kMinTiltRatio = 1.15;
// An approximate camera is fitted each time this number of views has been added.
constexpr size_t kFitEvery = 8;
// Largest motion of the board's corners between images of a static board, relative to the image's longer
// side.
constexpr double kMaxMotion = 0.004;
// Smallest difference of the corners from those of every collected view, unless the view covers a new part.
constexpr double kMinDifference = 0.06;
// Collection stops at this multiple of enough_views.
constexpr int kMaxViewsRatio = 4;

}  // namespace

ViewCollector::ViewCollector(const CalibrationBoard& board, std::string model_name,
                             const ViewCollectorOptions& options)
    : board_(board), model_name_(std::move(model_name)), options_(options), detector_(board) {
  options_.validate();
  CameraModel::parameterNames(model_name_);
}

std::optional<BoardView> ViewCollector::detect(const CalibrationImage& image) const {
  auto view = detector_.detect(image.pixels);
  if (!view.has_value() && rough_model_.has_value()) {
    view = detector_.detectQuickly(image.pixels, *rough_model_);
  }
  if (view.has_value()) {
    view->image = image.name;
  }
  return view;
}

// RMS distance of common corners relative to the image's longer side; infinite if there are none. A
// chessboard may be numbered from either end.
double ViewCollector::difference(const BoardView& a, const BoardView& b) const {
  std::map<int, Eigen::Vector2d> in_b;
  for (const BoardCorner& corner : b.corners) {
    in_b[corner.index] = corner.pixel;
  }
  double best = std::numeric_limits<double>::infinity();
  for (const bool reversed : {false, true}) {
    double sum = 0.0;
    int count = 0;
    for (const BoardCorner& corner : a.corners) {
      const auto found = in_b.find(reversed ? board_.numCorners() - 1 - corner.index : corner.index);
      if (found != in_b.end()) {
        sum += (corner.pixel - found->second).squaredNorm();
        ++count;
      }
    }
    if (count > 0) {
      best = std::min(best, std::sqrt(sum / count) / std::max(size_.width, size_.height));
    }
  }
  return best;
}

// Without a camera, tilt is measured by the lengths of opposite sides of the outline.
bool ViewCollector::isTilted(const BoardView& view) const {
  std::map<int, Eigen::Vector2d> pixels;
  for (const BoardCorner& corner : view.corners) {
    pixels[corner.index] = corner.pixel;
  }
  const int last = board_.numCorners() - 1;
  const std::array<int, 4> outline = {0, board_.columns - 1, last, last - (board_.columns - 1)};
  std::array<Eigen::Vector2d, 4> p;
  for (size_t i = 0; i < 4; ++i) {
    const auto found = pixels.find(outline[i]);
    if (found == pixels.end()) {
      return false;
    }
    p[i] = found->second;
  }
  const auto ratio = [](double a, double b) { return std::max(a, b) / std::max(1e-9, std::min(a, b)); };
  return std::max(ratio((p[1] - p[0]).norm(), (p[2] - p[3]).norm()),
                  ratio((p[3] - p[0]).norm(), (p[2] - p[1]).norm())) > kMinTiltRatio;
}

ViewCollector::Outcome ViewCollector::add(const CalibrationImage& image) {
  if (!coverage_.has_value()) {
    size_ = image.pixels.size();
    coverage_.emplace(size_);
  }
  if (image.pixels.size() != size_) {
    throw InputError(image.name + ": expected an image of " + std::to_string(size_.width) + "x" +
                     std::to_string(size_.height) + " px as before, got " +
                     std::to_string(image.pixels.cols) + "x" + std::to_string(image.pixels.rows));
  }
  const std::optional<BoardView> before = std::exchange(last_view_, detect(image));
  if (!last_view_.has_value()) {
    return Outcome::kNoBoard;
  }
  if (!before.has_value() || difference(*before, *last_view_) > kMaxMotion) {
    return Outcome::kMoving;
  }
  if (static_cast<int>(views_.size()) >= kMaxViewsRatio * options_.enough_views) {
    return Outcome::kFull;
  }
  const bool differs = std::all_of(views_.begin(), views_.end(), [this](const BoardView& view) {
    return difference(view, *last_view_) > kMinDifference;
  });
  if (!differs && coverage_->numNewCells(*last_view_) == 0) {
    return Outcome::kNothingNew;
  }
  images_.push_back({image.name, image.pixels.clone()});
  views_.push_back(*last_view_);
  coverage_->add(*last_view_);
  if (views_.size() % kFitEvery == 0) {
    const auto fit = fitFromScratch(model_name_, size_, board_, views_);
    rough_model_ = fit.has_value() ? std::optional<CameraModel>(fit->model) : std::nullopt;
  }
  return Outcome::kTaken;
}

std::vector<std::string> ViewCollector::missing() const {
  std::vector<std::string> missing;
  const int more = options_.enough_views - static_cast<int>(views_.size());
  if (more > 0) {
    missing.push_back(std::to_string(more) + " more images");
  }
  if (coveredFraction() < options_.enough_coverage) {
    std::string parts;
    if (coverage_.has_value()) {
      for (const std::string& part : coverage_->missingParts()) {
        parts += (parts.empty() ? "" : ", ") + part;
      }
    }
    missing.push_back("the board in other parts of the image" + (parts.empty() ? "" : ": " + parts));
  }
  const auto tilted =
      std::count_if(views_.begin(), views_.end(), [this](const BoardView& view) { return isTilted(view); });
  if (tilted < options_.enough_tilted) {
    missing.push_back(std::to_string(options_.enough_tilted - tilted) + " images of the tilted board");
  }
  return missing;
}

std::string toString(ViewCollector::Outcome outcome) {
  switch (outcome) {
    case ViewCollector::Outcome::kTaken:
      return "taken";
    case ViewCollector::Outcome::kNoBoard:
      return "the board is not visible";
    case ViewCollector::Outcome::kMoving:
      return "the board moves: hold it still";
    case ViewCollector::Outcome::kNothingNew:
      return "the board was here before: move or tilt it";
    default:
      return "enough images: no more are collected";
  }
}

}  // namespace vcharge
