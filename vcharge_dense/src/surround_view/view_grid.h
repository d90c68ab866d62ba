#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_dense/surround_view.h"

namespace vcharge {

/// Side length in pixels of the blocks for which it is decided together what comes from one camera only.
inline constexpr int kSurroundBlock_px = 4;

/// The pixels of a surround view: where they lie in the vehicle frame, and how high the surface is there.
class ViewGrid {
 public:
  explicit ViewGrid(const SurroundViewOptions& options)
      : outline_(options.vehicle.outline()),
        pixel_m_(options.pixel_m),
        reach_m_(options.reach_m),
        is_bowl_(options.view == SurroundSurface::kBowl) {
    size_ = {wholeBlocks(2.0 * (outline_.half_width_m + reach_m_)),
             wholeBlocks(outline_.front_m - outline_.rear_m + 2.0 * reach_m_)};
    const double middle_m = 0.5 * (outline_.front_m + outline_.rear_m);
    corner_m_ = {middle_m + 0.5 * size_.height * pixel_m_, 0.5 * size_.width * pixel_m_};
  }

  cv::Size size() const { return size_; }
  cv::Size sizeBlocks() const { return {size_.width / kSurroundBlock_px, size_.height / kSurroundBlock_px}; }
  double pixel_m() const { return pixel_m_; }
  const VehicleOutline& outline() const { return outline_; }

  /// Position of a pixel (column, row) in the vehicle frame; pixel centres have integer coordinates.
  Eigen::Vector2d positionOf(const Eigen::Vector2d& pixel) const {
    return {corner_m_.x() - (pixel.y() + 0.5) * pixel_m_, corner_m_.y() - (pixel.x() + 0.5) * pixel_m_};
  }
  Eigen::Vector2d pixelOf(const Eigen::Vector2d& position_m) const {
    return {(corner_m_.y() - position_m.y()) / pixel_m_ - 0.5,
            (corner_m_.x() - position_m.x()) / pixel_m_ - 0.5};
  }
  /// Position of the middle of a block (column, row).
  Eigen::Vector2d positionOfBlock(int column, int row) const {
    constexpr double kMiddle = 0.5 * (kSurroundBlock_px - 1);
    return positionOf({kSurroundBlock_px * column + kMiddle, kSurroundBlock_px * row + kMiddle});
  }

  /// Distance outside the vehicle's outline; 0 inside.
  double distanceToVehicle_m(const Eigen::Vector2d& position_m) const {
    const double x = std::max({0.0, position_m.x() - outline_.front_m, outline_.rear_m - position_m.x()});
    const double y = std::max(0.0, std::abs(position_m.y()) - outline_.half_width_m);
    return std::hypot(x, y);
  }
  /// Height of the surface above the ground.
  double height_m(const Eigen::Vector2d& position_m) const {
    const double rise_m = distanceToVehicle_m(position_m) - kFlatPart * reach_m_;
    return is_bowl_ && rise_m > 0.0 ? 0.5 * kRimSlope * rise_m * rise_m / ((1.0 - kFlatPart) * reach_m_)
                                    : 0.0;
  }
  /// The pixels within this distance of the vehicle's outline, to the front, back and sides.
  cv::Rect around(double margin_m) const {
    const Eigen::Vector2d first = pixelOf({outline_.front_m + margin_m, outline_.half_width_m + margin_m});
    const Eigen::Vector2d last = pixelOf({outline_.rear_m - margin_m, -outline_.half_width_m - margin_m});
    const cv::Point begin(static_cast<int>(std::ceil(first.x())), static_cast<int>(std::ceil(first.y())));
    const cv::Point end(static_cast<int>(std::floor(last.x())) + 1,
                        static_cast<int>(std::floor(last.y())) + 1);
    return cv::Rect(begin, end) & cv::Rect({0, 0}, size_);
  }

 private:
  static constexpr double kFlatPart = 0.35;  // part of the reach over which the bowl is flat
  static constexpr double kRimSlope = 0.9;   // slope of the bowl at its rim

  int wholeBlocks(double length_m) const {
    return kSurroundBlock_px * static_cast<int>(std::ceil(length_m / (kSurroundBlock_px * pixel_m_) - 1e-9));
  }

  const VehicleOutline outline_;
  const double pixel_m_, reach_m_;
  const bool is_bowl_;
  cv::Size size_;
  Eigen::Vector2d corner_m_;  // the upper left corner of the view
};

}  // namespace vcharge
