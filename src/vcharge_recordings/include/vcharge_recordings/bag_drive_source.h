#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_ros/drive_topics.h"

namespace vcharge {

struct BagDriveSourceOptions {
  DriveTopics topics;
  std::vector<std::string> cameras;  ///< of the rig, by name; empty: all
  double sort_window_s = 0.5;        ///< messages later than this, by header stamp, are an error
  double max_image_gap_s = 2.0;      ///< a camera silent for longer, while images go on, is an error

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("topics", topics);
    visit("cameras", cameras);
    visit("sort_window_s", sort_window_s);
    visit("max_image_gap_s", max_image_gap_s);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Reads a recorded drive as fast as the consumer takes it, sorted by header stamp; at equal stamps odometry
/// comes before wheel ticks, and these before images in the rig's camera order. Reads the topics of the
/// options and no others.
///
/// run() throws InputError that names the bag, the topic and what was expected, for: a missing, truncated or
/// corrupt bag; a topic that is missing, empty or of another type (with the topics that are there); an image
/// that cannot be decoded or is unlike the rig; bad numbers; stamps that jump back; a camera that stops
/// before the others do, or pauses. Odometry may run on after all cameras have ended.
class BagDriveSource : public DriveSource {
 public:
  BagDriveSource(std::string bag_path, std::shared_ptr<const CameraRig> rig,
                 const BagDriveSourceOptions& options = BagDriveSourceOptions());
  /// May be called again: reads the bag anew.
  void run(DriveConsumer* consumer, const ProgressCallback& progress) override;

  /// When the first and the last message of the drive's topics were recorded, by the recorder's clock: about
  /// the stamps that run() will deliver. Reads the bag's index alone; errors of the bag and its topics are
  /// run()'s.
  std::pair<Timestamp, Timestamp> recordedSpan() const;

 private:
  const std::string bag_path_;
  const std::shared_ptr<const CameraRig> rig_;
  const BagDriveSourceOptions options_;
};

}  // namespace vcharge
