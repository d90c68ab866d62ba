#include "vcharge_recordings/bag_drive_source.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>

#include "drives/drive_message.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_recordings/bag_reader.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/stamp_sorter.h"

namespace vcharge {
namespace {

using internal::DriveItem;
using internal::expectedType;
using Kind = internal::DriveTopicKind;
using TopicRole = internal::DriveTopicRole;

std::string seconds(double value) {
  std::ostringstream text;
  text << value << " s";
  return text.str();
}

/// Reads a bag once from its first message to its last.
class BagReading {
 public:
  BagReading(const std::string& path, const CameraRig& rig, const BagDriveSourceOptions& options,
             DriveConsumer* consumer)
      : path_(path),
        rig_(rig),
        options_(options),
        consumer_(consumer),
        cameras_(internal::selectCameras(rig, options.cameras)),
        bag_(path),
        sorter_(durationFromSeconds(options.sort_window_s)),
        last_images_(rig.cameras.size()) {
    findTopics();
  }

  void run(const DriveSource::ProgressCallback& progress);
  std::pair<Timestamp, Timestamp> recordedSpan() const;

 private:
  std::vector<BagEntry> entries() const;
  void findTopics();
  void addRequiredTopic(const std::string& topic, TopicRole role);
  bool hasTopic(const std::string& topic) const { return bag_.topics().count(topic) > 0; }
  std::string listTopics() const;
  DriveItem convert(const BagMessage& message, const TopicRole& role, Timestamp* stamp) const;
  void push(const std::string& topic, Timestamp stamp, DriveItem item);
  void deliver(Timestamp stamp, const DriveItem& item);
  void checkCameras(Timestamp stamp) const;
  std::string topicName(size_t camera_index) const;

  const std::string& path_;
  const CameraRig& rig_;
  const BagDriveSourceOptions& options_;
  DriveConsumer* const consumer_;
  const std::vector<size_t> cameras_;
  BagReader bag_;
  std::map<std::string, TopicRole> roles_;  // key: topic
  StampSorter<DriveItem> sorter_;
  internal::ItemRanks ranks_;
  std::vector<std::optional<Timestamp>> last_images_;  // last delivered image of each camera
  std::optional<Timestamp> first_image_;
};

std::string BagReading::listTopics() const {
  std::string list;
  for (const auto& [topic, types] : bag_.topics()) {
    list += (list.empty() ? "" : ", ") + topic + " (" + *types.begin() + ")";
  }
  return list.empty() ? "none" : list;
}

void BagReading::addRequiredTopic(const std::string& topic, TopicRole role) {
  const std::string expected = expectedType(role.kind);
  for (const std::string& type : bag_.topics().at(topic)) {
    if (type != expected) {
      throw InputError(path_ + ": " + topic + ": expected messages of type " + expected + ", got " + type);
    }
  }
  roles_[topic] = role;
}

void BagReading::findTopics() {
  const DriveTopics& topics = options_.topics;
  for (const size_t camera : cameras_) {
    const std::string& name = rig_.cameras[camera].name;
    if (hasTopic(topics.imageTopic(name))) {
      addRequiredTopic(topics.imageTopic(name), {Kind::kImage, camera});
    } else if (hasTopic(topics.compressedImageTopic(name))) {
      addRequiredTopic(topics.compressedImageTopic(name), {Kind::kCompressedImage, camera});
    } else {
      throw InputError(path_ + ": expected images of camera '" + name + "' on " + topics.imageTopic(name) +
                       " (or .../compressed); topics in the bag: " + listTopics());
    }
  }
  if (!hasTopic(topics.odometry)) {
    throw InputError(path_ + ": expected odometry on " + topics.odometry + " (" +
                     expectedType(Kind::kOdometry) + "); topics in the bag: " + listTopics());
  }
  addRequiredTopic(topics.odometry, {Kind::kOdometry});
  if (!topics.wheel_ticks.empty() && hasTopic(topics.wheel_ticks)) {
    addRequiredTopic(topics.wheel_ticks, {Kind::kWheelTicks});
  }
}

DriveItem BagReading::convert(const BagMessage& message, const TopicRole& role, Timestamp* stamp) const {
  DriveItem item = internal::convertDriveMessage(message, role, rig_.vehicle_frame, stamp);
  if (const auto* image = std::get_if<internal::CameraImage>(&item)) {
    checkImageSize(rig_.cameras[image->camera_index], image->image.pixels.size(), message.source());
  }
  return item;
}

void BagReading::push(const std::string& topic, Timestamp stamp, DriveItem item) {
  if (stamp == Timestamp()) {
    throw InputError(path_ + ": " + topic + ": expected a stamp in the message's header, got 0");
  }
  if (sorter_.isTooLate(stamp)) {
    throw InputError(path_ + ": " + topic + ": stamp " + toString(stamp) + " jumps back by " +
                     seconds(toSeconds(sorter_.newest() - stamp)) +
                     "; expected stamps that increase, within " +
                     "sort_window_s = " + seconds(options_.sort_window_s));
  }
  const int rank = ranks_.rankOf(stamp, item);
  sorter_.push(stamp, rank, std::move(item));
}

std::string BagReading::topicName(size_t camera_index) const {
  for (const auto& [topic, role] : roles_) {
    if ((role.kind == Kind::kImage || role.kind == Kind::kCompressedImage) &&
        role.camera_index == camera_index) {
      return topic;
    }
  }
  return options_.topics.imageTopic(rig_.cameras[camera_index].name);
}

// A camera is silent since its last image, or since the first image of any camera. This is checked when an
// image comes: if all cameras end together and only odometry continues, the drive's images are complete.
void BagReading::checkCameras(Timestamp stamp) const {
  if (!first_image_) {
    return;
  }
  for (const size_t camera : cameras_) {
    const Timestamp last = last_images_[camera].value_or(*first_image_);
    if (toSeconds(stamp - last) > options_.max_image_gap_s) {
      throw InputError(path_ + ": " + topicName(camera) + ": no image between " + toString(last) + " and " +
                       toString(stamp) + " while images go on; expected one at least every " +
                       "max_image_gap_s = " + seconds(options_.max_image_gap_s));
    }
  }
}

void BagReading::deliver(Timestamp stamp, const DriveItem& item) {
  if (const auto* image = std::get_if<internal::CameraImage>(&item)) {
    checkCameras(stamp);
    last_images_[image->camera_index] = stamp;
    first_image_ = first_image_.value_or(stamp);
  }
  internal::deliver(stamp, item, consumer_);
}

std::vector<BagEntry> BagReading::entries() const {
  std::set<std::string> topics;
  for (const auto& entry : roles_) {
    topics.insert(entry.first);
  }
  return bag_.entries(topics);
}

std::pair<Timestamp, Timestamp> BagReading::recordedSpan() const {
  const std::vector<BagEntry> all = entries();
  return {toTimestamp(all.front().time), toTimestamp(all.back().time)};
}

void BagReading::run(const DriveSource::ProgressCallback& progress) {
  const std::vector<BagEntry> all = entries();
  const auto deliver_item = [&](Timestamp stamp, const DriveItem& item) { deliver(stamp, item); };
  double num_read = 0;
  for (const BagEntry& entry : all) {
    const std::string& topic = bag_.topicOf(entry);
    Timestamp stamp;
    DriveItem item = convert(bag_.read(entry), roles_.at(topic), &stamp);
    push(topic, stamp, std::move(item));
    sorter_.release(deliver_item);
    ++num_read;
    if (progress) {
      progress(num_read / static_cast<double>(all.size()));
    }
  }
  sorter_.flush(deliver_item);
}

}  // namespace

BagDriveSource::BagDriveSource(std::string bag_path, std::shared_ptr<const CameraRig> rig,
                               const BagDriveSourceOptions& options)
    : bag_path_(std::move(bag_path)), rig_(std::move(rig)), options_(options) {
  check(rig_ != nullptr, "BagDriveSource: expected a rig");
  options_.validate();
}

void BagDriveSource::run(DriveConsumer* consumer, const ProgressCallback& progress) {
  check(consumer != nullptr, "BagDriveSource::run: expected a consumer");
  BagReading(bag_path_, *rig_, options_, consumer).run(progress);
}

std::pair<Timestamp, Timestamp> BagDriveSource::recordedSpan() const {
  return BagReading(bag_path_, *rig_, options_, nullptr).recordedSpan();
}

std::vector<std::string> camerasWithImages(const std::string& bag_path, const CameraRig& rig,
                                           const DriveTopics& topics) {
  const BagReader bag(bag_path);
  std::vector<std::string> names;
  for (const RigCamera& camera : rig.cameras) {
    if (bag.topics().count(topics.imageTopic(camera.name)) > 0 ||
        bag.topics().count(topics.compressedImageTopic(camera.name)) > 0) {
      names.push_back(camera.name);
    }
  }
  return names;
}

}  // namespace vcharge
