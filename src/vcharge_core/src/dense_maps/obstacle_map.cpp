#include "vcharge_core/dense_maps/obstacle_map.h"

#include <cmath>
#include <limits>

#include "files/pixel_hash.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

void addFloats(const std::vector<float>& values, ContentHasher* hasher) {
  hasher->add(static_cast<int64_t>(values.size()));
  for (const float value : values) {
    hasher->add(static_cast<double>(value));
  }
}

}  // namespace

ObstacleScan ObstacleScan::unknown(size_t count, double max_range_m) {
  ObstacleScan scan;
  scan.angle_increment_rad = 2.0 * M_PI / static_cast<double>(count);
  scan.angle_min_rad = -M_PI + 0.5 * scan.angle_increment_rad;
  scan.max_range_m = max_range_m;
  scan.range_m.assign(count, kNaN);
  scan.range_sigma_m.assign(count, kNaN);
  scan.height_m.assign(count, kNaN);
  scan.height_sigma_m.assign(count, kNaN);
  scan.free_m.assign(count, 0.0F);
  return scan;
}

ObstacleMap ObstacleMap::unobserved(cv::Size size_cells, double cell_size_m) {
  ObstacleMap map;
  map.cell_size_m = cell_size_m;
  map.state = cv::Mat(size_cells, CV_8SC1, cv::Scalar(kCellUnobserved));
  map.point_m = cv::Mat(size_cells, CV_32FC2, cv::Scalar::all(kNaN));
  for (cv::Mat* image : {&map.point_sigma_m, &map.height_m, &map.height_sigma_m, &map.age_s}) {
    *image = cv::Mat(size_cells, CV_32FC1, cv::Scalar(kNaN));
  }
  return map;
}

void addToHash(const ObstacleScan& scan, ContentHasher* hasher) {
  hasher->add(scan.stamp.nanoseconds());
  hasher->add(scan.name);
  for (const double value : {scan.origin_m.x(), scan.origin_m.y(), scan.angle_min_rad,
                             scan.angle_increment_rad, scan.max_range_m}) {
    hasher->add(value);
  }
  for (const std::vector<float>* values :
       {&scan.range_m, &scan.range_sigma_m, &scan.height_m, &scan.height_sigma_m, &scan.free_m}) {
    addFloats(*values, hasher);
  }
}

void addToHash(const ObstacleMap& map, ContentHasher* hasher) {
  hasher->add(map.stamp.nanoseconds());
  hasher->add(map.frame_id);
  const Eigen::Vector3d translation = map.fixed_from_vehicle.translation();
  const Eigen::Quaterniond rotation = map.fixed_from_vehicle.rotation();
  for (const double value :
       {translation.x(), translation.y(), translation.z(), rotation.x(), rotation.y(), rotation.z(),
        rotation.w(), map.cell_size_m, map.origin_m.x(), map.origin_m.y()}) {
    hasher->add(value);
  }
  for (int y = 0; y < map.state.rows; ++y) {
    hasher->addBytes(map.state.ptr(y), static_cast<size_t>(map.state.cols));
  }
  for (const cv::Mat* image :
       {&map.point_m, &map.point_sigma_m, &map.height_m, &map.height_sigma_m, &map.age_s}) {
    addPixelsToHash(*image, hasher);
  }
}

}  // namespace vcharge
