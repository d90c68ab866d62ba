#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <ros/node_handle.h>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_obstacles/obstacle_mapper.h"
#include "vcharge_ros/nodelet_support.h"

namespace vcharge {

/// Subscribes to the images of the cameras in use, raw or compressed, and tells their stamps and
/// fingerprints. Decodes nothing by itself: in the manager of the driver, a raw image arrives as a pointer.
class ImageListener {
 public:
  /// `pixels` decodes the image (CV_8UC1); InputError if it cannot be decoded.
  using Callback = std::function<void(size_t camera_index, Timestamp, uint64_t fingerprint,
                                      const std::function<cv::Mat()>& pixels)>;

  /// The guard must outlive this object. Images without a stamp are refused with an InputError.
  ImageListener(ros::NodeHandle* node, const CameraRig& rig, const std::vector<ObstacleCameraStatus>& cameras,
                uint32_t queue_size, CallbackGuard* guard, Callback callback);

 private:
  template <class Message>
  void subscribe(ros::NodeHandle* node, size_t camera_index, const std::string& topic, uint32_t queue_size);

  CallbackGuard* const guard_;
  const Callback callback_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace vcharge
