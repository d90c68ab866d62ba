#pragma once

#include <cstdint>
#include <string>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/files/content_hash.h"

namespace vcharge {

/// Height of the surface seen from above, on a regular grid. The cell in column c, row r has its centre at
/// origin_m + cell_size_m * (c, r) in the map frame: columns along x, rows along y.
struct HeightMap {
  std::string frame_id = "map";
  Eigen::Vector2d origin_m{0.0, 0.0};  ///< centre of the cell in column 0, row 0
  double cell_size_m = 0.05;
  cv::Mat height_m;    ///< CV_32FC1, metres; NaN: not observed
  cv::Mat confidence;  ///< CV_32FC1 of the same size, 0 to 1, 0 where not observed; may be empty
  cv::Mat gray;        ///< CV_8UC1 of the same size, brightness seen by the cameras; may be empty
  /// CV_8UC1 of the same size, not 0 for obstacles without a known height, because no free space was observed
  /// above them (walls, pillars); may be empty.
  cv::Mat solid;

  Eigen::Vector2d centreOf(int column, int row) const {
    return origin_m + cell_size_m * Eigen::Vector2d(column, row);
  }
};

/// Adds frame, grid and all cells; all NaNs are equal.
void addToHash(const HeightMap& map, ContentHasher* hasher);

/// Height at a position by bilinear interpolation between the four surrounding cells. NaN if one of them is
/// outside or not observed.
double interpolateHeight(const HeightMap& map, const Eigen::Vector2d& place_m);

/// Whether a vehicle can drive over a cell.
enum class CellState : uint8_t { kDrivable, kObstacle, kUnobserved };

struct DrivabilityOptions {
  double max_step_m = 0.08;    ///< between neighbouring cells; a higher one is an obstacle
  double step_reach_m = 0.1;   ///< cells this near to a step belong to it: smoothing spreads it over some
  double max_slope = 0.25;     ///< rise over run across slope_reach_m
  double slope_reach_m = 0.3;  ///< over which the slope is taken
  /// Of a drivable cell: what is less sure is smoothed between its neighbours, as the ground under a car.
  double min_confidence = 0.01;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("max_step_m", max_step_m);
    visit("step_reach_m", step_reach_m);
    visit("max_slope", max_slope);
    visit("slope_reach_m", slope_reach_m);
    visit("min_confidence", min_confidence);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// CV_8UC1 of CellState. A cell is an obstacle if it is solid, if heights within step_reach_m differ by more
/// than max_step_m, or if the surface rises by more than max_slope over slope_reach_m; otherwise it is
/// unobserved if its height is unknown or its confidence too low.
cv::Mat classifyCells(const HeightMap& map, const DrivabilityOptions& options);

}  // namespace vcharge
