#include "vcharge_recordings/bag_images.h"

#include "vcharge_recordings/bag_reader.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/image_conversions.h"

namespace vcharge {
namespace {

constexpr const char *kRaw = "sensor_msgs/Image", *kCompressed = "sensor_msgs/CompressedImage";

template <class Message>
StampedImage convert(const BagMessage& recorded) {
  const boost::shared_ptr<const Message> message = recorded.instantiate<Message>();
  return {toTimestamp(message->header.stamp), toImage(message, recorded.source())};
}

// The topic with the images and its type: the given one or its compressed copy.
std::pair<std::string, std::string> findImageTopic(const BagReader& bag, const std::string& path,
                                                   const std::string& topic) {
  for (const auto& candidate : {std::pair<std::string, std::string>{topic, kRaw},
                                {topic, kCompressed},
                                {topic + "/compressed", kCompressed}}) {
    const auto found = bag.topics().find(candidate.first);
    if (found != bag.topics().end() && found->second.count(candidate.second) > 0) {
      return candidate;
    }
  }
  std::string list;
  for (const auto& [name, types] : bag.topics()) {
    list += (list.empty() ? "" : ", ") + name + " (" + *types.begin() + ")";
  }
  throw InputError(path + ": expected images on " + topic + " or " + topic +
                   "/compressed; topics in the bag: " + (list.empty() ? "none" : list));
}

}  // namespace

std::vector<StampedImage> readBagImages(const std::string& bag_path, const std::string& topic, int max_images,
                                        const std::function<void(double)>& progress) {
  check(max_images > 0, "readBagImages: expected a positive number of images");
  BagReader bag(bag_path);
  const auto [name, type] = findImageTopic(bag, bag_path, topic);
  const std::vector<BagEntry> entries = bag.entries({name});
  const size_t wanted = std::min(entries.size(), static_cast<size_t>(max_images));
  std::vector<StampedImage> images;
  for (size_t i = 0; i < wanted; ++i) {
    const BagMessage message = bag.read(entries[i * entries.size() / wanted]);
    images.push_back(type == kRaw ? convert<sensor_msgs::Image>(message)
                                  : convert<sensor_msgs::CompressedImage>(message));
    progress(static_cast<double>(i + 1) / static_cast<double>(wanted));
  }
  return images;
}

}  // namespace vcharge
