#pragma once

#include <cstdint>
#include <string>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"
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
double interpolateHeight(const HeightMap& map, const Eigen::Vector2d& position_m);

/// Whether a vehicle can drive over a cell.
enum class CellState : uint8_t { kDrivable, kObstacle, kUnobserved };

struct DrivabilityOptions {
  VCHARGE_BEGIN_OPTIONS(DrivabilityOptions);
  VCHARGE_OPTION(double, max_step_m, 0.08, positive(), "Highest step that the vehicle can drive over.");
  VCHARGE_OPTION(double, max_slope, 0.25, positive(),
                 "Steepest slope that the vehicle can drive, rise over run.");
  VCHARGE_END_OPTIONS();
};

/// CV_8UC1 of CellState. A cell is an obstacle if it is solid, if heights near it differ by more than
/// max_step_m, or if the surface rises by more than max_slope; otherwise it is unobserved if its height is
/// unknown or its confidence too low.
cv::Mat classifyCells(const HeightMap& map, const DrivabilityOptions& options);

}  // namespace vcharge
