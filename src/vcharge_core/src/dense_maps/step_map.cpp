#include "vcharge_core/dense_maps/step_map.h"

#include <limits>

#include "files/pixel_hash.h"

namespace vcharge {

StepMap StepMap::unknown(cv::Size size_cells, double cell_size_m) {
  StepMap map;
  map.cell_size_m = cell_size_m;
  for (cv::Mat* image : {&map.ground_m, &map.height_m, &map.sigma_m}) {
    *image = cv::Mat(size_cells, CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  }
  return map;
}

void addToHash(const StepMap& map, ContentHasher* hasher) {
  hasher->add(map.stamp.nanoseconds());
  hasher->add(map.frame_id);
  const Eigen::Vector3d translation = map.fixed_from_vehicle.translation();
  const Eigen::Quaterniond rotation = map.fixed_from_vehicle.rotation();
  for (const double value :
       {translation.x(), translation.y(), translation.z(), rotation.x(), rotation.y(), rotation.z(),
        rotation.w(), map.cell_size_m, map.origin_m.x(), map.origin_m.y()}) {
    hasher->add(value);
  }
  for (const cv::Mat* image : {&map.ground_m, &map.height_m, &map.sigma_m}) {
    addPixelsToHash(*image, hasher);
  }
}

}  // namespace vcharge
