#include "height_map/cell_colours.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace vcharge {
namespace {

// A range belongs to a cell if it differs from the cell's distance by less than the sum of these two.
constexpr double kSameSurface = 0.05;  // relative to the distance
constexpr double kSameSurface_m = 0.1;

/// Projects a point, given by its offset from the camera in the world; returns false if it is not visible.
bool project(const PackedRangeMap& camera, const Eigen::Vector3f& offset, float distance, int* x, int* y) {
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> rotation(camera.rotation);
  const Eigen::Vector3f point = rotation * offset;
  const float denominator = point.z() + camera.xi * distance;
  if (point.z() <= camera.min_cosine * distance || denominator <= 1e-6F) {
    return false;
  }
  *x = static_cast<int>(std::lround(camera.fx * point.x() / denominator + camera.u0));
  *y = static_cast<int>(std::lround(camera.fy * point.y() / denominator + camera.v0));
  return *x >= 0 && *y >= 0 && *x < camera.width && *y < camera.height;
}

/// Adds a view to the sums of weights and of weighted gray levels of each cell.
void addView(const HeightMap& map, const PackedRangeMap& camera, const cv::Mat& image, double max_range_m,
             cv::Mat* sums) {
  const Eigen::Vector2d from = (camera.position_m.head<2>() - map.origin_m) / map.cell_size_m;
  const double reach = max_range_m / map.cell_size_m;
  const int first_row = std::max(0, static_cast<int>(from.y() - reach));
  const int last_row = std::min(map.height_m.rows - 1, static_cast<int>(from.y() + reach));
  const int first_column = std::max(0, static_cast<int>(from.x() - reach));
  const int last_column = std::min(map.height_m.cols - 1, static_cast<int>(from.x() + reach));
  tbb::parallel_for(first_row, last_row + 1, [&](int row) {
    for (int column = first_column; column <= last_column; ++column) {
      const float height = map.height_m.at<float>(row, column);
      if (!std::isfinite(height)) {
        continue;
      }
      const Eigen::Vector2d centre = map.centreOf(column, row);
      const Eigen::Vector3f offset =
          (Eigen::Vector3d(centre.x(), centre.y(), height) - camera.position_m).cast<float>();
      const float distance = offset.norm();
      int x = 0, y = 0;
      if (distance > max_range_m || !project(camera, offset, distance, &x, &y)) {
        continue;
      }
      const float inverse =
          camera.values[(static_cast<size_t>(y) * camera.width + x) * PackedRangeMap::kValues];
      const float tolerance = static_cast<float>(kSameSurface_m + kSameSurface * distance);
      if (inverse > 0.0F && std::abs(1.0F / inverse - distance) < tolerance) {
        const float weight = 1.0F / (0.25F + distance * distance);
        sums->at<cv::Vec2f>(row, column) += cv::Vec2f(weight, weight * image.at<uint8_t>(y, x));
      }
    }
  });
}

}  // namespace

cv::Mat colourCells(const HeightMap& map, size_t num_views,
                    const std::function<void(size_t view, PackedRangeMap* range, cv::Mat* image)>& load_view,
                    double max_range_m) {
  cv::Mat sums(map.height_m.size(), CV_32FC2, cv::Scalar::all(0));
  for (size_t view = 0; view < num_views; ++view) {
    PackedRangeMap range;
    cv::Mat image;
    load_view(view, &range, &image);
    addView(map, range, image, max_range_m, &sums);
  }
  cv::Mat gray(sums.size(), CV_8UC1, cv::Scalar(0));
  for (int row = 0; row < sums.rows; ++row) {
    for (int column = 0; column < sums.cols; ++column) {
      const cv::Vec2f sum = sums.at<cv::Vec2f>(row, column);
      gray.at<uint8_t>(row, column) = sum[0] > 0.0F ? cv::saturate_cast<uint8_t>(sum[1] / sum[0]) : 0;
    }
  }
  return gray;
}

}  // namespace vcharge
