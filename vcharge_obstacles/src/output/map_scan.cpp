#include "vcharge_obstacles/map_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Eigenvalues>

namespace vcharge {
namespace {

// Cells behind the first one are the top of an obstacle lower than this, or range noise of a higher obstacle.
constexpr float kLow_m = 0.2F;
// Cells within this distance behind the first one contribute to the range of a higher obstacle.
constexpr double kDepth_m = 0.2;
// A surface is a line through at least this number of cells this near, of which it is this long and, at most,
// this thick: standard deviations.
constexpr int kMinSurfaceCells = 3;
constexpr double kSurface_m = 0.3, kMinLength_m = 0.08, kMaxThickness_m = 0.035;

struct Hit {
  cv::Point cell;
  double range_m;
  double weight;
  float sigma_m, height_m, height_sigma_m;
};

/// The vehicle's pose on the ground.
struct Viewpoint {
  explicit Viewpoint(const ObstacleMap& map)
      : position_m(map.fixed_from_vehicle.translation().head<2>()),
        yaw_rad(yawOfRotation(map.fixed_from_vehicle.rotation())) {}
  Eigen::Vector2d position_m;
  double yaw_rad;
};

std::vector<std::vector<Hit>> collectHits(const ObstacleMap& map, const Viewpoint& viewpoint, int num_rays) {
  std::vector<std::vector<Hit>> hits(static_cast<size_t>(num_rays));
  const double per_rad = num_rays / (2.0 * M_PI);
  for (int row = 0; row < map.state.rows; ++row) {
    for (int column = 0; column < map.state.cols; ++column) {
      if (map.state.at<int8_t>(row, column) != kCellOccupied) {
        continue;
      }
      const auto point = map.point_m.at<cv::Vec2f>(row, column);
      const Eigen::Vector2d offset_m =
          map.origin_m + Eigen::Vector2d(point[0], point[1]) - viewpoint.position_m;
      const double range_m = std::max(offset_m.norm(), 0.5 * map.cell_size_m);
      const double angle_rad = std::atan2(offset_m.y(), offset_m.x()) - viewpoint.yaw_rad;
      const double half_width_rad = std::atan(0.5 * map.cell_size_m / range_m);
      const int first = static_cast<int>(std::floor((angle_rad - half_width_rad + M_PI) * per_rad));
      const int last = static_cast<int>(std::floor((angle_rad + half_width_rad + M_PI) * per_rad));
      const float sigma_m = map.point_sigma_m.at<float>(row, column);
      const Hit hit{{column, row},
                    range_m,
                    1.0 / (sigma_m * sigma_m + 1e-4),
                    sigma_m,
                    map.height_m.at<float>(row, column),
                    map.height_sigma_m.at<float>(row, column)};
      for (int ray = first; ray <= last; ++ray) {
        hits[static_cast<size_t>(((ray % num_rays) + num_rays) % num_rays)].push_back(hit);
      }
    }
  }
  return hits;
}

struct Crossing {
  double range_m, sigma_m;  // sigma_m: of the surface's points, along the sector
};

/// Where the surface around an occupied cell, as a line through the cells' points, is nearest in a sector of
/// this half width around an angle in the fixed frame. None if the cells form no line that crosses it.
std::optional<Crossing> crossSurface(const ObstacleMap& map, const Viewpoint& viewpoint,
                                     const cv::Point& cell, double angle_rad, double half_width_rad) {
  const int reach = static_cast<int>(kSurface_m / map.cell_size_m);
  std::vector<Eigen::Vector2d> points_m;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
  double sum = 0.0;
  const cv::Rect window = cv::Rect(cell.x - reach, cell.y - reach, 2 * reach + 1, 2 * reach + 1) &
                          cv::Rect(0, 0, map.state.cols, map.state.rows);
  for (int row = window.y; row < window.br().y; ++row) {
    for (int column = window.x; column < window.br().x; ++column) {
      if (map.state.at<int8_t>(row, column) == kCellOccupied) {
        const auto point = map.point_m.at<cv::Vec2f>(row, column);
        const float sigma_m = map.point_sigma_m.at<float>(row, column);
        const double weight = 1.0 / (sigma_m * sigma_m + 1e-4);
        points_m.emplace_back(map.origin_m + Eigen::Vector2d(point[0], point[1]) - viewpoint.position_m);
        mean += weight * points_m.back();
        square += weight * points_m.back() * points_m.back().transpose();
        sum += weight;
      }
    }
  }
  if (static_cast<int>(points_m.size()) < kMinSurfaceCells) {
    return std::nullopt;
  }
  mean /= sum;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(square / sum - mean * mean.transpose());
  const double thickness_m = std::sqrt(std::max(0.0, axes.eigenvalues()[0]));
  if (thickness_m > kMaxThickness_m || axes.eigenvalues()[1] < kMinLength_m * kMinLength_m) {
    return std::nullopt;
  }
  const Eigen::Vector2d normal = axes.eigenvectors().col(0), along = axes.eigenvectors().col(1);
  double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
  for (const Eigen::Vector2d& point_m : points_m) {
    low_m = std::min(low_m, along.dot(point_m) - 0.5 * map.cell_size_m);
    high_m = std::max(high_m, along.dot(point_m) + 0.5 * map.cell_size_m);
  }
  std::optional<Crossing> nearest;
  for (const double side_rad : {angle_rad - half_width_rad, angle_rad, angle_rad + half_width_rad}) {
    const Eigen::Vector2d direction(std::cos(side_rad), std::sin(side_rad));
    const double range_m = normal.dot(mean) / normal.dot(direction);
    const double at_m = along.dot(direction) * range_m;
    if (range_m > 0.0 && at_m >= low_m && at_m <= high_m && (!nearest || range_m < nearest->range_m)) {
      nearest = Crossing{range_m, thickness_m / std::abs(normal.dot(direction))};
    }
  }
  return nearest;
}

void setRay(const std::vector<Hit>& hits, const ObstacleMap& map, const Viewpoint& viewpoint, size_t ray,
            ObstacleScan* scan) {
  if (hits.empty()) {
    return;
  }
  const auto nearest = std::min_element(hits.begin(), hits.end(),
                                        [](const Hit& a, const Hit& b) { return a.range_m < b.range_m; });
  double weight = 0.0;
  double range_m = 0.0;
  double square_m2 = 0.0;
  const double furthest_m = nearest->range_m + (nearest->height_m < kLow_m ? 0.0 : kDepth_m);
  for (const Hit& hit : hits) {
    if (hit.range_m <= furthest_m) {
      weight += hit.weight;
      range_m += hit.weight * hit.range_m;
      square_m2 += hit.weight * hit.range_m * hit.range_m;
      // The obstacle's height is that of its highest cell.
      if (!(hit.height_m <= scan->height_m[ray])) {
        scan->height_m[ray] = hit.height_m;
        scan->height_sigma_m[ray] = hit.height_sigma_m;
      }
    }
  }
  const double mean_m = range_m / weight;
  scan->range_m[ray] = static_cast<float>(mean_m);
  // The position within a cell adds uncertainty.
  double spread_m2 =
      std::max(0.0, square_m2 / weight - mean_m * mean_m) + map.cell_size_m * map.cell_size_m / 12.0;
  const std::optional<Crossing> crossing =
      nearest->height_m < kLow_m
          ? std::nullopt
          : crossSurface(map, viewpoint, nearest->cell, viewpoint.yaw_rad + scan->angle_rad(ray),
                         0.5 * scan->angle_increment_rad);
  if (crossing) {
    scan->range_m[ray] = static_cast<float>(crossing->range_m);
    spread_m2 = crossing->sigma_m * crossing->sigma_m;
  }
  scan->range_sigma_m[ray] = static_cast<float>(std::sqrt(nearest->sigma_m * nearest->sigma_m + spread_m2));
}

/// End of the first run of free cells; skips cells under and beside the vehicle, which are never observed.
float freeRange(const ObstacleMap& map, const Viewpoint& viewpoint, double angle_in_fixed_rad, double max_m) {
  const Eigen::Vector2d direction(std::cos(angle_in_fixed_rad), std::sin(angle_in_fixed_rad));
  const double step_m = 0.5 * map.cell_size_m;
  double free_m = 0.0;
  for (double range_m = step_m; range_m < max_m; range_m += step_m) {
    const Eigen::Vector2d cell =
        (viewpoint.position_m + range_m * direction - map.origin_m) / map.cell_size_m;
    const int column = static_cast<int>(std::floor(cell.x()));
    const int row = static_cast<int>(std::floor(cell.y()));
    if (column < 0 || row < 0 || column >= map.state.cols || row >= map.state.rows) {
      break;
    }
    const int8_t state = map.state.at<int8_t>(row, column);
    if (state == kCellFree) {
      free_m = range_m;
    } else if (state == kCellOccupied || free_m > 0.0) {
      break;
    }
  }
  return static_cast<float>(free_m);
}

}  // namespace

ObstacleScan makeScan(const ObstacleMap& map, int num_rays) {
  const Viewpoint viewpoint(map);
  const double max_range_m = 0.5 * map.cell_size_m * std::min(map.state.cols, map.state.rows);
  ObstacleScan scan = ObstacleScan::unknown(static_cast<size_t>(num_rays), max_range_m);
  scan.stamp = map.stamp;
  scan.name = "fused";
  const auto hits = collectHits(map, viewpoint, num_rays);
  for (size_t ray = 0; ray < scan.size(); ++ray) {
    setRay(hits[ray], map, viewpoint, ray, &scan);
    scan.free_m[ray] = freeRange(map, viewpoint, viewpoint.yaw_rad + scan.angle_rad(ray), max_range_m);
  }
  return scan;
}

}  // namespace vcharge
