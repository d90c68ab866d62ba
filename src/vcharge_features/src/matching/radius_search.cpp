#include "matching/radius_search.h"

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr int kKeyBits = 21;
/// Maximum number of cells along the longest side: smaller cells would be empty, and cell numbers must fit a
/// key.
constexpr double kMaxCells = 1000.0;

}  // namespace

RadiusSearch::RadiusSearch(const Eigen::Matrix3Xd& points, double radius) : points_(points), radius_(radius) {
  check(std::isfinite(radius) && radius > 0.0, "RadiusSearch: the radius must be finite and positive");
  bool first = true;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (points.col(i).allFinite()) {
      min_ = first ? Eigen::Vector3d(points.col(i)) : Eigen::Vector3d(min_.cwiseMin(points.col(i)));
      max_ = first ? Eigen::Vector3d(points.col(i)) : Eigen::Vector3d(max_.cwiseMax(points.col(i)));
      first = false;
    }
  }
  cell_size_ = std::max(radius, (max_ - min_).maxCoeff() / kMaxCells);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (points.col(i).allFinite()) {
      sorted_.emplace_back(keyOf(cellOf(points.col(i))), static_cast<int32_t>(i));
    }
  }
  std::sort(sorted_.begin(), sorted_.end());
}

RadiusSearch::Cell RadiusSearch::cellOf(const Eigen::Vector3d& point) const {
  return ((point - min_) / cell_size_).array().floor().cast<int64_t>().matrix();
}

uint64_t RadiusSearch::keyOf(const Cell& cell) {
  uint64_t key = 0;
  for (int i = 0; i < 3; ++i) {
    key = (key << kKeyBits) | static_cast<uint64_t>(cell[i]);
  }
  return key;
}

void RadiusSearch::find(const Eigen::Vector3d& centre, std::vector<int32_t>* indices) const {
  indices->clear();
  // Cell numbers could overflow far outside.
  if (!centre.allFinite() || (centre - centre.cwiseMax(min_).cwiseMin(max_)).norm() > radius_) {
    return;
  }
  const Cell last = cellOf(max_);
  const Cell from = (cellOf(centre).array() - 1).max(0).matrix();
  const Cell to = (cellOf(centre).array() + 1).min(last.array()).matrix();
  for (int64_t x = from[0]; x <= to[0]; ++x) {
    for (int64_t y = from[1]; y <= to[1]; ++y) {
      // Cells along z have consecutive keys.
      const uint64_t last_key = keyOf(Cell(x, y, to[2]));
      auto entry = std::lower_bound(sorted_.begin(), sorted_.end(),
                                    std::make_pair(keyOf(Cell(x, y, from[2])), int32_t{0}));
      for (; entry != sorted_.end() && entry->first <= last_key; ++entry) {
        if ((points_.col(entry->second) - centre).squaredNorm() <= radius_ * radius_) {
          indices->push_back(entry->second);
        }
      }
    }
  }
  std::sort(indices->begin(), indices->end());
}

}  // namespace vcharge
