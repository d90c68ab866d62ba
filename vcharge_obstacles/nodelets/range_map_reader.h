#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_ros/nodelet_support.h"

namespace vcharge {

/// The messages of depth_nodelet for one camera and stamp.
struct RangeMapParts {
  sensor_msgs::ImageConstPtr range, standard_deviation, confidence, reference;
  sensor_msgs::CameraInfoConstPtr camera_info;
  bool complete() const { return range && standard_deviation && confidence && reference && camera_info; }
};

/// Converts the messages of one camera to range maps; the working camera is built once per image size. Not
/// thread safe.
class RangeMapReader {
 public:
  /// `topic`: the common prefix of the parts' topics, used in error texts.
  RangeMapReader(const RigCamera& camera, std::string topic);

  /// The range map refers to the messages' pixels, which must outlive it. InputError "<topic>/...: ..."
  /// for another encoding, images of different sizes, or a camera that differs from the rig's at that size.
  RangeMap read(const RangeMapParts& parts);

 private:
  void prepare(cv::Size size);

  const RigCamera camera_;
  const std::string topic_;
  cv::Size size_;  // image size of the two members below
  std::optional<MeiCamera> model_;
  sensor_msgs::CameraInfo expected_;
};

/// Subscribes to the topics of one camera and calls back when all parts of a stamp have arrived. A stamp is
/// dropped if a later one is complete before it, or, with a limited queue, if too many later ones wait too:
/// a busy receiver reads some topics far ahead of others.
class RangeMapSubscriber {
 public:
  using Callback = std::function<void(const RangeMapParts&)>;

  /// `topic`: the common prefix of the parts' topics. With queue_size = 0 any number of stamps waits. The
  /// guard must outlive this object.
  RangeMapSubscriber(ros::NodeHandle* node, const std::string& topic, uint32_t queue_size,
                     CallbackGuard* guard, Callback callback);

 private:
  template <class Message>
  void subscribe(ros::NodeHandle* node, const std::string& topic, uint32_t queue_size,
                 boost::shared_ptr<const Message> RangeMapParts::*part);

  CallbackGuard* const guard_;
  const Callback callback_;
  const size_t max_incomplete_;
  std::map<ros::Time, RangeMapParts> incomplete_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace vcharge
