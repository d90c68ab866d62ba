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
  VCHARGE_BEGIN_OPTIONS(BagDriveSourceOptions);
  VCHARGE_OPTION_GROUP(DriveTopics, topics, {}, "Topics of the drive.");
  VCHARGE_OPTION(std::vector<std::string>, cameras, {}, anyValue(), "Cameras of the rig; empty: all.");
  VCHARGE_OPTION(double, sort_window_s, 0.5, between(0.0, 60.0), "A message later than this is an error.");
  VCHARGE_OPTION(double, max_image_gap_s, 2.0, positive(), "A camera silent for longer is an error.");
  VCHARGE_END_OPTIONS();
};

/// Reads a recorded drive as fast as the consumer takes it, sorted by header stamp; at equal stamps odometry
/// comes before wheel ticks, and these before images in the rig's camera order. Reads only the topics of the
/// options.
///
/// run() throws InputError that names the bag, the topic and what was expected, for: a missing, truncated or
/// corrupt bag; a topic that is missing, empty or of another type (with the topics that the bag has); an
/// image that cannot be decoded or does not match the rig; invalid numbers; stamps that jump back; a camera
/// that pauses or ends before the others. Odometry may continue after all cameras have ended.
class BagDriveSource : public DriveSource {
 public:
  BagDriveSource(std::string bag_path, std::shared_ptr<const CameraRig> rig,
                 const BagDriveSourceOptions& options = BagDriveSourceOptions());
  /// May be called again, which reads the bag again.
  void run(DriveConsumer* consumer, const ProgressCallback& progress) override;

  /// Recording times of the first and the last message of the drive's topics, by the recorder's clock; close
  /// to the stamps that run() delivers. Reads only the bag's index; errors as run().
  std::pair<Timestamp, Timestamp> recordedSpan() const;

 private:
  const std::string bag_path_;
  const std::shared_ptr<const CameraRig> rig_;
  const BagDriveSourceOptions options_;
};

/// Names of the rig's cameras whose images a bag has, raw or compressed, in the rig's order. Reads only the
/// bag's index. InputError for a missing, truncated or corrupt bag.
std::vector<std::string> camerasWithImages(const std::string& bag_path, const CameraRig& rig,
                                           const DriveTopics& topics = DriveTopics());

}  // namespace vcharge
