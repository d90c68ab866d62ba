#include "vcharge_recordings/recorded_drive_reader.h"

#include <map>

#include "drives/drive_message.h"
#include "vcharge_recordings/bag_reader.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

using internal::DriveTopicKind;
using internal::DriveTopicRole;

std::map<std::string, DriveTopicRole> rolesOf(const BagReader& bag, const CameraRig& rig,
                                              const DriveTopics& topics) {
  std::map<std::string, DriveTopicRole> wanted;
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    wanted[topics.imageTopic(rig.cameras[i].name)] = {DriveTopicKind::kImage, i};
    wanted[topics.compressedImageTopic(rig.cameras[i].name)] = {DriveTopicKind::kCompressedImage, i};
  }
  wanted[topics.odometry] = {DriveTopicKind::kOdometry};
  std::map<std::string, DriveTopicRole> roles;
  for (const auto& topic : bag.topics()) {
    const auto found = wanted.find(topic.first);
    if (found != wanted.end()) {
      roles.insert(*found);
    }
  }
  // If a camera has raw images, its compressed topic is not read.
  for (const RigCamera& camera : rig.cameras) {
    if (roles.count(topics.imageTopic(camera.name)) > 0) {
      roles.erase(topics.compressedImageTopic(camera.name));
    }
  }
  return roles;
}

}  // namespace

void readRecordedDrive(const std::string& bag_path, const CameraRig& rig, const DriveTopics& topics,
                       RecordedDriveConsumer* consumer, const std::function<void(double)>& progress) {
  check(consumer != nullptr, "readRecordedDrive: expected a consumer");
  BagReader bag(bag_path);
  const auto roles = rolesOf(bag, rig, topics);
  std::set<std::string> names;
  for (const auto& entry : roles) {
    names.insert(entry.first);
  }
  const std::vector<BagEntry> entries = bag.entries(names);
  double num_read = 0;
  for (const BagEntry& entry : entries) {
    const std::string& topic = bag.topicOf(entry);
    const Timestamp recorded = toTimestamp(entry.time);
    try {
      Timestamp stamp;
      const internal::DriveItem item =
          internal::convertDriveMessage(bag.read(entry), roles.at(topic), rig.vehicle_frame, &stamp);
      if (const auto* image = std::get_if<internal::CameraImage>(&item)) {
        consumer->addImage(image->camera_index, stamp, recorded, image->image);
      } else {
        consumer->addOdometry(recorded, std::get<VehicleOdometry>(item));
      }
    } catch (const InputError& error) {
      consumer->addBroken(topic, error.what());
    }
    ++num_read;
    if (progress) {
      progress(num_read / static_cast<double>(entries.size()));
    }
  }
}

}  // namespace vcharge
