#include "vcharge_calibration/intrinsics/image_coverage.h"

#include <algorithm>
#include <array>
#include <set>

namespace vcharge {

size_t ImageCoverage::cellOf(const Eigen::Vector2d& pixel) const {
  const int column = static_cast<int>(pixel.x() * kColumns / size_.width);
  const int row = static_cast<int>(pixel.y() * kRows / size_.height);
  return static_cast<size_t>(std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1));
}

void ImageCoverage::add(const BoardView& view) {
  const Eigen::Vector2d middle(0.5 * (size_.width - 1), 0.5 * (size_.height - 1));
  for (const BoardCorner& corner : view.corners) {
    ++counts_[cellOf(corner.pixel)];
    reach_ = std::max(reach_, (corner.pixel - middle).norm() / (0.5 * std::max(size_.width, size_.height)));
  }
}

int ImageCoverage::numNewCells(const BoardView& view) const {
  std::set<size_t> cells;
  for (const BoardCorner& corner : view.corners) {
    const size_t cell = cellOf(corner.pixel);
    if (counts_[cell] == 0) {
      cells.insert(cell);
    }
  }
  return static_cast<int>(cells.size());
}

double ImageCoverage::coveredFraction() const {
  const auto covered = std::count_if(counts_.begin(), counts_.end(), [](int count) { return count > 0; });
  return static_cast<double>(covered) / static_cast<double>(counts_.size());
}

std::vector<std::string> ImageCoverage::missingParts() const {
  struct Part {
    const char* name;
    cv::Rect cells;
  };
  // Corners of fisheye images are often dark, so a part is the middle of a side, or the outer cells of a
  // quarter of the image.
  static const std::array<Part, 8> kParts = {{{"left", {0, 1, 2, 3}},
                                              {"right", {6, 1, 2, 3}},
                                              {"upper", {2, 0, 4, 1}},
                                              {"lower", {2, 4, 4, 1}},
                                              {"upper left", {0, 0, 3, 2}},
                                              {"upper right", {5, 0, 3, 2}},
                                              {"lower left", {0, 3, 3, 2}},
                                              {"lower right", {5, 3, 3, 2}}}};
  std::vector<std::string> missing;
  for (const Part& part : kParts) {
    int seen = 0;
    for (int row = part.cells.y; row < part.cells.br().y; ++row) {
      for (int column = part.cells.x; column < part.cells.br().x; ++column) {
        seen += count(column, row) > 0 ? 1 : 0;
      }
    }
    if (3 * seen < part.cells.area()) {
      missing.emplace_back(part.name);
    }
  }
  return missing;
}

}  // namespace vcharge
