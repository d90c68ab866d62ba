#include "vcharge_ros/recorded_drive_reader.h"

#include <map>

#include "bag_access.h"
#include "drive_message.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

using internal::DriveTopicKind;
using internal::DriveTopicRole;
using internal::readingBag;

std::map<std::string, DriveTopicRole> rolesOf(const rosbag::Bag& bag, const CameraRig& rig,
                                              const DriveTopics& topics) {
  std::map<std::string, DriveTopicRole> wanted;
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    wanted[topics.imageTopic(rig.cameras[i].name)] = {DriveTopicKind::kImage, i};
    wanted[topics.compressedImageTopic(rig.cameras[i].name)] = {DriveTopicKind::kCompressedImage, i};
  }
  wanted[topics.odometry] = {DriveTopicKind::kOdometry};
  std::map<std::string, DriveTopicRole> roles;
  for (const rosbag::ConnectionInfo* connection : rosbag::View(bag).getConnections()) {
    const auto found = wanted.find(connection->topic);
    if (found != wanted.end()) {
      roles.insert(*found);
    }
  }
  // A topic that is there raw is not read a second time.
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
  const std::unique_ptr<rosbag::Bag> bag = internal::openBag(bag_path);
  const auto roles = readingBag(bag_path, [&] { return rolesOf(*bag, rig, topics); });
  if (roles.empty()) {
    return;
  }
  std::vector<std::string> names;
  for (const auto& entry : roles) {
    names.push_back(entry.first);
  }
  const auto view =
      readingBag(bag_path, [&] { return std::make_unique<rosbag::View>(*bag, rosbag::TopicQuery(names)); });
  const double num_messages = view->size();
  double num_read = 0;
  auto message = readingBag(bag_path, [&] { return view->begin(); });
  while (message != view->end()) {
    const std::string topic = message->getTopic();
    const DriveTopicRole& role = roles.at(topic);
    const Timestamp recorded = toTimestamp(message->getTime());
    try {
      Timestamp stamp;
      const internal::DriveItem item =
          internal::convertDriveMessage(*message, role, bag_path, rig.vehicle_frame, &stamp);
      if (const auto* image = std::get_if<internal::CameraImage>(&item)) {
        consumer->addImage(image->camera_index, stamp, recorded, image->image);
      } else {
        consumer->addOdometry(recorded, std::get<VehicleOdometry>(item));
      }
    } catch (const InputError& error) {
      consumer->addBroken(topic, error.what());
    }
    readingBag(bag_path, [&] { ++message; });
    ++num_read;
    if (progress) {
      progress(num_read / num_messages);
    }
  }
}

}  // namespace vcharge
