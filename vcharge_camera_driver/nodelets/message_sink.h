#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include <sensor_msgs/Image.h>

#include "vcharge_camera_driver/frame_source.h"
#include "vcharge_camera_driver/image_pool.h"
#include "vcharge_camera_driver/trigger_grouper.h"

namespace vcharge {

/// Groups frames whose pixels are in pooled messages, and passes the groups on. Cameras without a common
/// trigger have groups of one image, each with its own stamp.
class MessageSink : public FrameSink {
 public:
  using GroupCallback = std::function<void(const MultiFrame&)>;

  MessageSink(size_t num_cameras, const TriggerGrouperOptions& options, bool has_trigger,
              double stamp_offset_s, GroupCallback callback);

  Image acquire(cv::Size size_px) override;
  void add(const CapturedFrame& frame) override;
  Duration idle() override;
  TriggerGrouperCounts counts() const;  ///< thread safe, like the next
  /// Counts of one camera; nothing without a trigger.
  std::optional<TriggerCameraCounts> countsOf(size_t camera) const;

  /// The message with the pixels of a group's image: mono8, complete except for its header, to be published
  /// once.
  static sensor_msgs::ImagePtr messageOf(const Image& image);

 private:
  void pass(const TriggerGrouper::Groups& groups);

  const size_t num_cameras_;
  const bool has_trigger_;
  const Duration stamp_offset_;
  const GroupCallback callback_;
  BufferPool<sensor_msgs::Image> pool_;
  mutable std::mutex mutex_;
  TriggerGrouper grouper_;
};

}  // namespace vcharge
