#pragma once

#include <memory>
#include <string>
#include <vector>

#include <ros/node_handle.h>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_ros/drive_monitor.h"
#include "vcharge_ros/drive_topics.h"

namespace vcharge {

/// Transport of images. kAuto: raw images, or compressed ones from cameras without raw images during
/// max_silence_s of the drive's time.
enum class ImageTransport { kAuto, kRaw, kCompressed };

template <>
inline std::vector<std::string> enumNames<ImageTransport>() {
  return {"auto", "raw", "compressed"};
}

/// A full queue drops its oldest message; a size of 0 drops nothing. With a sort window, messages come in the
/// order of a bag, delayed by the window; waiting messages are delivered when nothing has arrived for
/// idle_flush_s.
struct LiveDriveSourceOptions {
  VCHARGE_BEGIN_OPTIONS(LiveDriveSourceOptions);
  VCHARGE_OPTION_GROUP(DriveTopics, topics, {}, "Topics of the drive.");
  VCHARGE_OPTION(std::vector<std::string>, cameras, {}, anyValue(), "Cameras of the rig; empty: all.");
  VCHARGE_OPTION(ImageTransport, image_transport, ImageTransport::kAuto, anyValue(), "Raw or compressed.");
  VCHARGE_OPTION(int, image_queue_size, 4, atLeast(0), "Waiting images per camera; 0: all.");
  VCHARGE_OPTION(int, odometry_queue_size, 200, atLeast(0), "Waiting odometry messages; 0: all.");
  VCHARGE_OPTION(double, sort_window_s, 0.0, between(0.0, 60.0), "Drive time in which messages are sorted.");
  VCHARGE_OPTION(double, idle_flush_s, 1.0, positive(), "Wall time until waiting messages are delivered.");
  VCHARGE_OPTION(double, max_silence_s, 2.0, positive(), "Wall time until a silent topic is reported.");
  VCHARGE_END_OPTIONS();

  /// Settings for a replay without loss: no message is dropped, and messages come in the order of a bag.
  void takeEverything() {
    image_queue_size = 0;
    odometry_queue_size = 0;
    sort_window_s = 2.0;  // topics may be published faster than the drive
  }
};

/// Subscribes to a drive's topics and feeds a consumer. Bad messages and exceptions of the consumer are
/// logged once, counted, reported by report(), and skipped. Stamps that jump back are reported and passed on,
/// since a bag may be replayed. Callbacks run on the queue of the node handle and are serialized, even if the
/// queue has several threads.
class LiveDriveSource : public DriveSource {
 public:
  LiveDriveSource(const ros::NodeHandle& node, std::shared_ptr<const CameraRig> rig,
                  const LiveDriveSourceOptions& options = LiveDriveSourceOptions());
  ~LiveDriveSource() override;

  /// Subscribes and returns; `consumer` must outlive this object. `progress` is never called: a live drive
  /// has no known end.
  void run(DriveConsumer* consumer, const ProgressCallback& progress) override;

  /// Delivers the messages that are waiting in the sort window.
  void flush();

  /// State of the topics for /diagnostics. Thread safe; does not wait for a consumer that is working.
  DriveMonitor::Report report();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace vcharge
