#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace vcharge {

/// Finds the points within a fixed radius of a position, using a grid with cells of that size. Immutable.
class RadiusSearch {
 public:
  /// Points that are not finite are never found. Throws std::logic_error unless the radius is finite and
  /// positive.
  RadiusSearch(const Eigen::Matrix3Xd& points, double radius);

  /// Indices of the points within the radius, ascending. None if `centre` is not finite.
  void find(const Eigen::Vector3d& centre, std::vector<int32_t>* indices) const;

 private:
  using Cell = Eigen::Matrix<int64_t, 3, 1>;
  Cell cellOf(const Eigen::Vector3d& point) const;
  static uint64_t keyOf(const Cell& cell);

  const Eigen::Matrix3Xd points_;
  const double radius_;
  Eigen::Vector3d min_ = Eigen::Vector3d::Zero(), max_ = Eigen::Vector3d::Zero();
  double cell_size_ = 1.0;
  std::vector<std::pair<uint64_t, int32_t>> sorted_;  // key of the cell and index of the point, sorted
};

}  // namespace vcharge
