#include "vcharge_dense/bay_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "parking/bay_rows.h"
#include "parking/ground_image.h"
#include "parking/paint_lines.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

/// Corners of the bay after a divider, counter-clockwise from above.
Quadrangle cornersOf(const BayRow& row, size_t index) {
  const Eigen::Vector2d near_m = row.entry_m + static_cast<double>(index) * row.step_m;
  const Eigen::Vector2d next_m = near_m + row.step_m;
  const bool is_left = rightOf(row.step_m).dot(row.depth_m) < 0.0;
  return is_left ? Quadrangle{near_m, next_m, next_m + row.depth_m, near_m + row.depth_m}
                 : Quadrangle{next_m, near_m, near_m + row.depth_m, next_m + row.depth_m};
}

AreaCells cellsIn(const GroundImage& ground, Quadrangle corners_m) {
  for (Eigen::Vector2d& corner : corners_m) {
    corner = ground.cellOf(corner);
  }
  return cellsOf(corners_m, ground.isGround().size());
}

/// Height of the ground around a bay. NaN if none is seen.
double groundHeight(const HeightMap& map, const GroundImage& ground, cv::Rect box) {
  constexpr double kAround_m = 2.0;
  const int margin = static_cast<int>(kAround_m / map.cell_size_m);
  box = cv::Rect(box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin) &
        cv::Rect({0, 0}, map.height_m.size());
  std::vector<double> heights;
  for (int row = box.y; row < box.br().y; ++row) {
    for (int column = box.x; column < box.br().x; ++column) {
      if (ground.isGround().at<float>(row, column) > 0.0F) {
        heights.push_back(map.height_m.at<float>(row, column));
      }
    }
  }
  return heights.empty() ? std::numeric_limits<double>::quiet_NaN() : quantile(std::move(heights), 0.5);
}

/// What stands in a bay. Bare ground in its middle means that it is free.
BayState stateOf(const HeightMap& map, const GroundImage& ground, const ParkingBay& bay) {
  constexpr double kMinHeight_m = 0.25, kMaxHeight_m = 2.5, kMinCar_m2 = 0.6, kMinSeen = 0.5;
  const AreaCells inner = cellsIn(ground, bay.inside()), middle = cellsIn(ground, bay.middle());
  if (inner.box.empty() || middle.box.empty()) {
    return BayState::kUnknown;
  }
  const double ground_m = groundHeight(map, ground, inner.box);
  int num_raised = 0;
  for (int row = 0; row < inner.inside.rows; ++row) {
    for (int column = 0; column < inner.inside.cols; ++column) {
      const cv::Point cell(inner.box.x + column, inner.box.y + row);
      const double height_m = map.height_m.at<float>(cell) - ground_m;
      const bool is_solid = !map.solid.empty() && map.solid.at<uint8_t>(cell) != 0;
      num_raised += inner.inside.at<uint8_t>(row, column) != 0 &&
                            (is_solid || (height_m > kMinHeight_m && height_m < kMaxHeight_m))
                        ? 1
                        : 0;
    }
  }
  if (num_raised * map.cell_size_m * map.cell_size_m >= kMinCar_m2) {
    return BayState::kOccupied;
  }
  const double seen = cv::mean(ground.isGround()(middle.box), middle.inside)[0];
  return seen >= kMinSeen ? BayState::kFree : BayState::kUnknown;
}

}  // namespace

ParkingBays findBays(const HeightMap& map) {
  constexpr double kLargestCell_m = 0.1;
  if (map.gray.empty()) {
    throw InputError("gray_file: expected gray levels, in which lines are seen");
  }
  if (map.cell_size_m > kLargestCell_m) {
    throw InputError("cell_size_m: expected at most 0.1 m, the width of a painted line");
  }
  const GroundImage ground(map);
  ParkingBays result;
  result.frame_id = map.frame_id;
  uint32_t row_number = 0;
  for (const BayRow& row : findBayRows(ground, findPaintLines(ground))) {
    for (size_t i = 0; i + 1 < row.dividers.size(); ++i) {
      ParkingBay bay;
      bay.id = static_cast<uint32_t>(result.bays.size() + 1);
      bay.row = row_number;
      bay.kind = row.kind;
      bay.corners_m = cornersOf(row, i);
      bay.entry_sigma_m = row.entry_sigma_m;
      bay.end_sigma_m = row.end_sigma_m;
      const int num_seen = (row.dividers[i].is_seen ? 1 : 0) + (row.dividers[i + 1].is_seen ? 1 : 0);
      bay.confidence = 0.5 + 0.25 * num_seen;
      bay.state = stateOf(map, ground, bay);
      result.bays.push_back(bay);
    }
    ++row_number;
  }
  return result;
}

}  // namespace vcharge
