#pragma once

#include <vector>

#include "check/check_findings.h"
#include "check/image_motion.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge::internal {

/// The path of the odometry, interpolated at any time.
class OdometryPath {
 public:
  /// `odometry` may be in any order; of equal stamps the first is used.
  explicit OdometryPath(std::vector<VehicleOdometry> odometry);

  bool empty() const { return stamps_s_.empty(); }
  double begin_s() const { return stamps_s_.front(); }
  double end_s() const { return stamps_s_.back(); }
  size_t size() const { return stamps_s_.size(); }
  double stamp_s(size_t i) const { return stamps_s_[i]; }
  /// Seconds since the first stamp, the argument of the functions below.
  double secondsOf(Timestamp stamp) const { return toSeconds(stamp - origin_); }
  bool covers(double time_s) const { return begin_s() <= time_s && time_s <= end_s(); }
  /// Yaw, continuous over half turns; linear between the stamps, constant beyond the ends.
  double yaw_rad(double time_s) const { return at(yaws_rad_, time_s); }
  /// Metres driven forwards minus metres driven backwards.
  double distance_m(double time_s) const { return at(distances_m_, time_s); }
  const std::vector<Eigen::Vector2d>& stepsInVehicle() const { return steps_; }

 private:
  double at(const std::vector<double>& values, double time_s) const;

  Timestamp origin_;
  std::vector<double> stamps_s_, yaws_rad_, distances_m_;
  std::vector<Eigen::Vector2d> steps_;  // motion from the previous entry, in the frame half way between both
};

/// Checks the odometry alone: coverage of the images, jumps, sideways motion, resolution; and what motion the
/// drive contains. `image_stamps`: stamps of one camera, in increasing order.
void judgeOdometry(const OdometryPath& path, const std::vector<Timestamp>& image_stamps,
                   CheckFindings* findings);

/// Checks whether odometry and images agree on the motion. `motions`: one list per camera of the rig.
void judgeAgreement(const OdometryPath& path, const CameraRig& rig,
                    const std::vector<std::vector<ImageMotion>>& motions, CheckFindings* findings);

}  // namespace vcharge::internal
