#pragma once

#include <cmath>
#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/dense_maps/height_map.h"

namespace vcharge {

/// How much brighter a place is than the ground on both sides. A side without ground (a car stands there) has
/// no value.
struct LineContrast {
  std::optional<double> to_left, to_right;

  double smaller() const;
  /// Whether both sides are alike, and no edge of a shadow is near.
  bool isEven(double tolerance) const {
    return to_left && to_right && std::abs(*to_left - *to_right) < tolerance;
  }
};

/// The brightness of the ground of a height map, without cars, kerbs and walls.
class GroundImage {
 public:
  /// The ground are the drivable cells that are connected over more than a car's roof.
  explicit GroundImage(const HeightMap& map);

  double cellSize_m() const { return cell_size_m_; }
  /// CV_32FC1, logarithm of the brightness, in which lamps and shade only add; 0 where there is no ground.
  const cv::Mat& brightness() const { return brightness_; }
  /// CV_32FC1, 1 on the ground, 0 elsewhere.
  const cv::Mat& isGround() const { return is_ground_; }

  Eigen::Vector2d cellOf(const Eigen::Vector2d& position_m) const {
    return (position_m - origin_m_) / cell_size_m_;
  }
  Eigen::Vector2d positionOf(const Eigen::Vector2d& cell) const { return origin_m_ + cell_size_m_ * cell; }

  /// Brightness at a position, interpolated between cells of the ground. Nothing if most of it is not ground.
  std::optional<double> at(const Eigen::Vector2d& position_m) const;

  /// Height of the surface in the cell of a position, ground or not. NaN if not observed.
  float height_m(const Eigen::Vector2d& position_m) const;

  /// How much brighter the ground is here than on both sides in the direction `across` (a unit vector): paint
  /// of a line along the other direction. Nothing if there is no ground here or on either side.
  std::optional<LineContrast> lineContrast(const Eigen::Vector2d& position_m,
                                           const Eigen::Vector2d& across) const;

 private:
  Eigen::Vector2d origin_m_;
  double cell_size_m_;
  cv::Mat height_m_, brightness_, is_ground_;
};

/// The direction at right angles to another, to its right.
inline Eigen::Vector2d rightOf(const Eigen::Vector2d& direction) {
  return {direction.y(), -direction.x()};
}

/// Distance of the middle of a line to the ground beside it that it is compared with. Lines are up to 0.2 m
/// wide.
inline constexpr double kBesideLine_m = 0.25;

}  // namespace vcharge
