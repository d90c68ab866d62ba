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

/// How images travel. kAuto: raw, and compressed from cameras that send nothing raw, or nothing any more for
/// max_silence_s of the drive's time.
enum class ImageTransport { kAuto, kRaw, kCompressed };

template <>
inline std::vector<std::string> enumNames<ImageTransport>() {
  return {"auto", "raw", "compressed"};
}

struct LiveDriveSourceOptions {
  DriveTopics topics;
  std::vector<std::string> cameras;  ///< of the rig, by name; empty: all
  ImageTransport image_transport = ImageTransport::kAuto;
  int image_queue_size = 4;       ///< per camera; the oldest is dropped; 0: none ever (replay without loss)
  int odometry_queue_size = 200;  ///< 0: none is ever dropped
  /// Messages are delivered in the order in which a bag's are, delayed by this much drive time, and whatever
  /// waits is delivered once nothing has come for idle_flush_s. 0: delivered as they arrive.
  double sort_window_s = 0.0;
  double idle_flush_s = 1.0;
  double max_silence_s = 2.0;  ///< wall time without data on a topic before it is reported

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("topics", topics);
    visit("cameras", cameras);
    visit("image_transport", image_transport);
    visit("image_queue_size", image_queue_size);
    visit("odometry_queue_size", odometry_queue_size);
    visit("sort_window_s", sort_window_s);
    visit("idle_flush_s", idle_flush_s);
    visit("max_silence_s", max_silence_s);
  }
  /// For a replay of which every message is taken, in the order in which a bag's are.
  void takeEverything() {
    image_queue_size = 0;
    odometry_queue_size = 0;
    sort_window_s = 0.5;
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Subscribes to a drive's topics and feeds a consumer. Bad messages (and whatever a consumer throws) are
/// logged once, counted, reported by report(), and skipped; stamps that jump back are passed on, after being
/// reported, since a replayed bag may start over. Callbacks run on the queue of the node handle and are
/// serialized here, also where that queue has several threads.
class LiveDriveSource : public DriveSource {
 public:
  LiveDriveSource(const ros::NodeHandle& node, std::shared_ptr<const CameraRig> rig,
                  const LiveDriveSourceOptions& options = LiveDriveSourceOptions());
  ~LiveDriveSource() override;

  /// Subscribes and returns; `consumer` must outlive this object. `progress` is never called: nobody knows
  /// the end.
  void run(DriveConsumer* consumer, const ProgressCallback& progress) override;

  /// Delivers what waits to be sorted: nothing more is to come for now.
  void flush();

  /// State of the topics for /diagnostics. Thread safe, and waits for no consumer that is at work.
  DriveMonitor::Report report();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace vcharge
