#include "vcharge_ros/obstacle_conversions.h"

#include <cmath>

#include "vcharge_core/base/error.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {

using Message = vcharge_msgs::TrackedObject;
static_assert(static_cast<int>(ObjectClass::kUnknown) == static_cast<int>(Message::UNKNOWN) &&
                  static_cast<int>(ObjectClass::kAdult) == static_cast<int>(Message::ADULT) &&
                  static_cast<int>(ObjectClass::kChild) == static_cast<int>(Message::CHILD) &&
                  static_cast<int>(ObjectClass::kCar) == static_cast<int>(Message::CAR) &&
                  static_cast<int>(ObjectClass::kBicycle) == static_cast<int>(Message::BICYCLE),
              "classes have the numbers of the message");

vcharge_msgs::TrackedObjects toMessage(const std::vector<TrackedObject>& objects, Timestamp stamp,
                                       const std::string& frame_id) {
  vcharge_msgs::TrackedObjects list;
  list.header.stamp = fromTimestamp(stamp);
  list.header.frame_id = frame_id;
  for (const TrackedObject& object : objects) {
    Message message;
    message.id = object.id;
    message.object_class = static_cast<uint8_t>(object.object_class);
    message.class_probability = object.class_probability;
    message.existence_probability = object.existence_probability;
    message.pose = toPoseMessage(object.frame_from_object);
    message.velocity.x = object.velocity_m_per_s.x();
    message.velocity.y = object.velocity_m_per_s.y();
    message.velocity.z = object.velocity_m_per_s.z();
    message.is_standing = object.is_standing ? 1 : 0;
    Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(message.covariance.data()) = object.covariance;
    for (const Eigen::Vector2d& corner : object.footprint_m) {
      geometry_msgs::Point32 point;
      point.x = static_cast<float>(corner.x());
      point.y = static_cast<float>(corner.y());
      point.z = static_cast<float>(object.base_z_m);
      message.footprint.points.push_back(point);
    }
    message.height_m = object.height_m;
    list.objects.push_back(message);
  }
  return list;
}

std::vector<TrackedObject> fromMessage(const vcharge_msgs::TrackedObjects& message,
                                       const std::string& source) {
  std::vector<TrackedObject> objects;
  for (const Message& from : message.objects) {
    const std::string name = source + ": object " + std::to_string(from.id);
    if (from.object_class > Message::BICYCLE) {
      throw InputError(name + ": expected a class up to " + std::to_string(Message::BICYCLE) + ", got " +
                       std::to_string(from.object_class));
    }
    TrackedObject object;
    object.id = from.id;
    object.object_class = static_cast<ObjectClass>(from.object_class);
    object.class_probability = from.class_probability;
    object.existence_probability = from.existence_probability;
    object.frame_from_object = fromMessage(from.pose, name);
    object.velocity_m_per_s = {from.velocity.x, from.velocity.y, from.velocity.z};
    object.is_standing = from.is_standing != 0;
    object.covariance =
        Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(from.covariance.data());
    bool is_finite =
        object.velocity_m_per_s.allFinite() && object.covariance.allFinite() && std::isfinite(from.height_m);
    for (const geometry_msgs::Point32& corner : from.footprint.points) {
      object.footprint_m.emplace_back(corner.x, corner.y);
      object.base_z_m = corner.z;
      is_finite = is_finite && object.footprint_m.back().allFinite() && std::isfinite(corner.z);
    }
    if (!is_finite) {
      throw InputError(name + ": expected finite numbers");
    }
    object.height_m = from.height_m;
    objects.push_back(object);
  }
  return objects;
}

}  // namespace vcharge
