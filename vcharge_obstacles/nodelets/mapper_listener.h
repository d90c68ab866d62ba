#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <ros/node_handle.h>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/tracked_object.h"
#include "vcharge_obstacles/obstacle_mapper.h"
#include "vcharge_ros/nodelet_support.h"

namespace vcharge {

/// Subscribes to the images of the cameras in use, raw or compressed, to object_nodelet's objects, and to the
/// cameras of which depth_nodelet announces range maps. Tells
/// the stamps and fingerprints of images, and decodes nothing by itself: in the manager of the driver, a raw
/// image arrives as a pointer.
class MapperListener {
 public:
  /// `pixels` decodes the image (CV_8UC1); InputError if it cannot be decoded.
  using ImageCallback = std::function<void(size_t camera_index, Timestamp, uint64_t fingerprint,
                                           const std::function<cv::Mat()>& pixels)>;

  using ObjectCallback = std::function<void(Timestamp, const std::vector<TrackedObject>& in_odom)>;

  /// `cameras`: one value per camera of the rig.
  using ScheduleCallback = std::function<void(Timestamp, const std::vector<bool>& cameras)>;

  /// The guard must outlive this object. Messages without a stamp are refused with an InputError.
  MapperListener(ros::NodeHandle* node, const CameraRig& rig,
                 const std::vector<ObstacleCameraStatus>& cameras, uint32_t queue_size, CallbackGuard* guard,
                 ImageCallback on_image, ObjectCallback on_objects, ScheduleCallback on_schedule);

 private:
  template <class Message>
  void subscribe(ros::NodeHandle* node, size_t camera_index, const std::string& topic, uint32_t queue_size);
  void subscribeObjects(ros::NodeHandle* node, uint32_t queue_size);
  void subscribeSchedule(ros::NodeHandle* node, const CameraRig& rig, uint32_t queue_size);

  CallbackGuard* const guard_;
  const ImageCallback on_image_;
  const ObjectCallback on_objects_;
  const ScheduleCallback on_schedule_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace vcharge
