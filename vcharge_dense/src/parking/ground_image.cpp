#include "parking/ground_image.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kMinGround_m2 = 20.0;  // the largest roofs have 8
constexpr double kDarkest = 4.0;        // brightness below which sensor noise would count as contrast

}  // namespace

GroundImage::GroundImage(const HeightMap& map)
    : origin_m_(map.origin_m), cell_size_m_(map.cell_size_m), height_m_(map.height_m) {
  check(map.gray.type() == CV_8UC1 && map.gray.size() == map.height_m.size(),
        "GroundImage: expected a height map with gray levels");
  const cv::Mat drivable = classifyCells(map, DrivabilityOptions()) == static_cast<int>(CellState::kDrivable);
  cv::Mat labels, areas, centroids;
  const int num_labels = cv::connectedComponentsWithStats(drivable, labels, areas, centroids, 4, CV_32S);
  const double min_cells = kMinGround_m2 / (cell_size_m_ * cell_size_m_);
  std::vector<float> is_large(static_cast<size_t>(num_labels), 0.0F);
  for (int label = 1; label < num_labels; ++label) {
    is_large[static_cast<size_t>(label)] = areas.at<int>(label, cv::CC_STAT_AREA) >= min_cells ? 1.0F : 0.0F;
  }
  brightness_.create(map.gray.size(), CV_32FC1);
  is_ground_.create(map.gray.size(), CV_32FC1);
  for (int row = 0; row < labels.rows; ++row) {
    for (int column = 0; column < labels.cols; ++column) {
      const float ground = is_large[static_cast<size_t>(labels.at<int>(row, column))];
      is_ground_.at<float>(row, column) = ground;
      brightness_.at<float>(row, column) =
          ground * static_cast<float>(std::log(map.gray.at<uint8_t>(row, column) + kDarkest));
    }
  }
}

std::optional<double> GroundImage::at(const Eigen::Vector2d& position_m) const {
  const Eigen::Vector2d cell = cellOf(position_m);
  const int column = static_cast<int>(std::floor(cell.x())), row = static_cast<int>(std::floor(cell.y()));
  if (column < 0 || row < 0 || column + 1 >= is_ground_.cols || row + 1 >= is_ground_.rows) {
    return std::nullopt;
  }
  const double x = cell.x() - column, y = cell.y() - row;
  double weight = 0.0, sum = 0.0;
  for (const int down : {0, 1}) {
    for (const int right : {0, 1}) {
      const double area = (right != 0 ? x : 1.0 - x) * (down != 0 ? y : 1.0 - y);
      weight += area * is_ground_.at<float>(row + down, column + right);
      sum += area * brightness_.at<float>(row + down, column + right);
    }
  }
  return weight > 0.5 ? std::optional(sum / weight) : std::nullopt;
}

float GroundImage::height_m(const Eigen::Vector2d& position_m) const {
  const Eigen::Vector2d cell = cellOf(position_m);
  const cv::Point nearest(static_cast<int>(std::lround(cell.x())), static_cast<int>(std::lround(cell.y())));
  return cv::Rect({0, 0}, height_m_.size()).contains(nearest) ? height_m_.at<float>(nearest)
                                                              : std::numeric_limits<float>::quiet_NaN();
}

double LineContrast::smaller() const {
  return to_left && to_right ? std::min(*to_left, *to_right) : to_left ? *to_left : to_right.value_or(0.0);
}

std::optional<LineContrast> GroundImage::lineContrast(const Eigen::Vector2d& position_m,
                                                      const Eigen::Vector2d& across) const {
  const auto mean = [&](double offset_m) -> std::optional<double> {
    double sum = 0.0;
    int count = 0;
    for (const int step : {-1, 0, 1}) {
      if (const auto found = at(position_m + (offset_m + step * cell_size_m_) * across)) {
        sum += *found;
        ++count;
      }
    }
    return count >= 2 ? std::optional(sum / count) : std::nullopt;
  };
  const auto here = mean(0.0), left = mean(-kBesideLine_m), right = mean(kBesideLine_m);
  if (!here || (!left && !right)) {
    return std::nullopt;
  }
  LineContrast contrast;
  contrast.to_left = left ? std::optional(*here - *left) : std::nullopt;
  contrast.to_right = right ? std::optional(*here - *right) : std::nullopt;
  return contrast;
}

}  // namespace vcharge
