#include "vcharge_ros/bag_images.h"

#include <map>
#include <set>

#include <rosbag/view.h>

#include "bag_access.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/image_conversions.h"

namespace vcharge {
namespace {

using internal::readingBag;

template <class Message>
StampedImage convert(const rosbag::MessageInstance& instance, const std::string& source) {
  const boost::shared_ptr<const Message> message = instance.instantiate<Message>();
  if (!message) {
    throw InputError(source + ": expected the message definition of " +
                     ros::message_traits::datatype<Message>() + " that this program was built with");
  }
  return {toTimestamp(message->header.stamp), toImage(message, source)};
}

// The topic that has the images: the given one or its compressed copy.
std::string findImageTopic(const rosbag::Bag& bag, const std::string& path, const std::string& topic) {
  std::map<std::string, std::string> types;
  for (const rosbag::ConnectionInfo* connection : rosbag::View(bag).getConnections()) {
    types[connection->topic] = connection->datatype;
  }
  for (const auto& [name, type] : {std::pair<std::string, std::string>{topic, "sensor_msgs/Image"},
                                   {topic, "sensor_msgs/CompressedImage"},
                                   {topic + "/compressed", "sensor_msgs/CompressedImage"}}) {
    const auto found = types.find(name);
    if (found != types.end() && found->second == type) {
      return name;
    }
  }
  std::string list;
  for (const auto& [name, type] : types) {
    list += (list.empty() ? "" : ", ") + name + " (" + type + ")";
  }
  throw InputError(path + ": expected images on " + topic + " or " + topic +
                   "/compressed; topics in the bag: " + (list.empty() ? "none" : list));
}

}  // namespace

std::vector<StampedImage> readBagImages(const std::string& bag_path, const std::string& topic, int max_images,
                                        const std::function<void(double)>& progress) {
  check(max_images > 0, "readBagImages: expected a positive number of images");
  const std::unique_ptr<rosbag::Bag> bag = internal::openBag(bag_path);
  std::vector<StampedImage> images;
  readingBag(bag_path, [&] {
    const std::string name = findImageTopic(*bag, bag_path, topic);
    const std::string source = bag_path + ": " + name;
    rosbag::View view(*bag, rosbag::TopicQuery(name));
    const auto count = static_cast<int64_t>(view.size());
    const int64_t wanted = std::min<int64_t>(count, max_images);
    int64_t index = 0;
    for (const rosbag::MessageInstance& instance : view) {
      // The k-th of `wanted` is the message at k * count / wanted.
      const auto next = static_cast<int64_t>(images.size());
      if (next < wanted && index == next * count / wanted) {
        images.push_back(instance.isType<sensor_msgs::Image>()
                             ? convert<sensor_msgs::Image>(instance, source)
                             : convert<sensor_msgs::CompressedImage>(instance, source));
        progress(static_cast<double>(images.size()) / static_cast<double>(wanted));
      }
      ++index;
    }
    if (images.empty()) {
      throw InputError(source + ": expected images, got none");
    }
  });
  return images;
}

}  // namespace vcharge
