#pragma once

#include <string>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Height of the ground near the vehicle and the steps in it, on a regular grid. All images are CV_32FC1 of
/// the same size; the corner of column 0, row 0 is at origin_m; columns run along x, rows along y of the
/// fixed frame.
struct StepMap {
  Timestamp stamp;
  std::string frame_id;  ///< the fixed frame, "odom" or "map"
  RigidTransform fixed_from_vehicle;
  double cell_size_m = 0.0;
  Eigen::Vector2d origin_m{0.0, 0.0};  ///< corner of cell (0, 0) in the fixed frame
  cv::Mat ground_m;                    ///< height above the plane of the ground; NaN where unknown
  cv::Mat height_m;  ///< height of the step in the cell, up or down; 0 where even, NaN where unknown
  cv::Mat sigma_m;   ///< standard deviation of height_m, where even of ground_m; NaN where unknown

  /// A map whose cells are all unknown.
  static StepMap unknown(cv::Size size_cells, double cell_size_m);
};

/// Adds the whole content of a map; all NaNs are equal.
void addToHash(const StepMap& map, ContentHasher* hasher);

}  // namespace vcharge
