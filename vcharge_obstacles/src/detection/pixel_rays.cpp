#include "detection/pixel_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vcharge_core/camera/ray_table.h"

namespace vcharge {

PixelRays::PixelRays(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                     const PolarGrid& grid) {
  const cv::Size size = camera.size();
  const RayTable table(camera.model(), size, 2.0 * M_PI, camera.validMask());
  const Eigen::Matrix3f rotation = vehicle_from_camera.rotationMatrix().cast<float>();
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      if (!table.valid(column, row)) {
        continue;
      }
      const Eigen::Vector3f ray = rotation * table.ray(column, row);
      pixel.push_back(row * size.width + column);
      x.push_back(ray.x());
      y.push_back(ray.y());
      z.push_back(ray.z());
      horizontal.push_back(std::hypot(ray.x(), ray.y()));
      polar_ray.push_back(static_cast<int16_t>(grid.rayOf(std::atan2(ray.y(), ray.x()))));
    }
  }
}

ExpectedPixels::ExpectedPixels(const PixelRays& rays, const PolarGrid& grid, double camera_height_m,
                               double low_m, double reference_m) {
  StripSum ground_sum(grid), obstacle_sum(grid);
  const auto height = static_cast<float>(camera_height_m);
  const float above_low = height - static_cast<float>(low_m);
  const float above_reference = height - static_cast<float>(reference_m);
  for (size_t i = 0; i < rays.size(); ++i) {
    if (rays.z[i] >= 0.0F) {
      continue;
    }
    const float fall = -rays.z[i] / rays.horizontal[i];  // fall per metre of range
    ground_sum.add(rays.polar_ray[i], fall / height, fall / above_low, 1.0F);
    obstacle_sum.add(rays.polar_ray[i], fall / above_low, fall / above_reference, 1.0F);
  }
  ground = ground_sum.finish();
  obstacle = obstacle_sum.finish();
}

std::vector<double> fullyVisibleRange(const PixelRays& rays, const PolarGrid& grid, double camera_height_m) {
  std::vector<double> least_fall(static_cast<size_t>(grid.numRays()),
                                 std::numeric_limits<double>::infinity());
  for (size_t i = 0; i < rays.size(); ++i) {
    double& fall = least_fall[static_cast<size_t>(rays.polar_ray[i])];
    fall = std::min(fall, static_cast<double>(-rays.z[i] / rays.horizontal[i]));
  }
  std::vector<double> range_m;
  for (const double fall : least_fall) {
    const double above_m = std::max(0.0, camera_height_m - kClearance_m);
    range_m.push_back(fall > 0.0 ? above_m / fall : std::numeric_limits<double>::infinity());
  }
  return range_m;
}

std::vector<float> StripSum::finish() const {
  std::vector<float> sums(grid_.size());
  for (int ray = 0; ray < grid_.numRays(); ++ray) {
    const float* row = &difference_[static_cast<size_t>(ray) * (grid_.numBins() + 1)];
    float sum = 0.0F;
    for (int bin = 0; bin < grid_.numBins(); ++bin) {
      sum += row[bin];
      sums[grid_.index(ray, bin)] = std::max(0.0F, sum);
    }
  }
  return sums;
}

}  // namespace vcharge
