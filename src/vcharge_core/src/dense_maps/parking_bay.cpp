#include "vcharge_core/dense_maps/parking_bay.h"

#include <cmath>

#include <opencv2/imgproc.hpp>

namespace vcharge {

Quadrangle ParkingBay::part(double from_side, double to_side, double from_entry, double to_entry) const {
  const auto at = [&](double side, double in) -> Eigen::Vector2d {
    const Eigen::Vector2d entry_m = corners_m[0] + side * (corners_m[1] - corners_m[0]);
    const Eigen::Vector2d end_m = corners_m[3] + side * (corners_m[2] - corners_m[3]);
    return entry_m + in * (end_m - entry_m);
  };
  return {at(from_side, from_entry), at(to_side, from_entry), at(to_side, to_entry), at(from_side, to_entry)};
}

AreaCells cellsOf(const Quadrangle& corners_cells, cv::Size grid) {
  constexpr double kFarthest = 1e6;  // cells; beyond, numbers would not fit
  std::vector<cv::Point> outline;
  for (const Eigen::Vector2d& corner : corners_cells) {
    if (!(corner.cwiseAbs().maxCoeff() < kFarthest)) {
      return {};
    }
    outline.emplace_back(static_cast<int>(std::lround(corner.x())),
                         static_cast<int>(std::lround(corner.y())));
  }
  AreaCells cells;
  cells.box = cv::boundingRect(outline) & cv::Rect({0, 0}, grid);
  cells.inside = cv::Mat(cells.box.size(), CV_8UC1, cv::Scalar(0));
  if (!cells.box.empty()) {
    cv::fillPoly(cells.inside, std::vector<std::vector<cv::Point>>{outline}, cv::Scalar(1), cv::LINE_8, 0,
                 -cells.box.tl());
  }
  return cells;
}

void addToHash(const ParkingBays& bays, ContentHasher* hasher) {
  hasher->add(bays.frame_id);
  for (const ParkingBay& bay : bays.bays) {
    for (const int64_t value : {static_cast<int64_t>(bay.id), static_cast<int64_t>(bay.row),
                                static_cast<int64_t>(bay.kind), static_cast<int64_t>(bay.state)}) {
      hasher->add(value);
    }
    for (const Eigen::Vector2d& corner_m : bay.corners_m) {
      hasher->add(corner_m.x());
      hasher->add(corner_m.y());
    }
    for (const double value : {bay.entry_sigma_m, bay.end_sigma_m, bay.confidence}) {
      hasher->add(value);
    }
  }
}

}  // namespace vcharge
