#include "vcharge_core/motion/tracked_object.h"

#include <algorithm>
#include <array>

namespace vcharge {
namespace {

constexpr std::array<ObjectClass, 5> kClasses = {ObjectClass::kUnknown, ObjectClass::kAdult,
                                                 ObjectClass::kChild, ObjectClass::kCar,
                                                 ObjectClass::kBicycle};

void addNumbers(const double* values, size_t count, ContentHasher* hasher) {
  for (size_t i = 0; i < count; ++i) {
    hasher->add(values[i]);
  }
}

void addTransform(const RigidTransform& transform, ContentHasher* hasher) {
  addNumbers(transform.translation().data(), 3, hasher);
  addNumbers(transform.rotation().coeffs().data(), 4, hasher);
}

}  // namespace

std::string nameOf(ObjectClass object_class) {
  switch (object_class) {
    case ObjectClass::kAdult:
      return "adult";
    case ObjectClass::kChild:
      return "child";
    case ObjectClass::kCar:
      return "car";
    case ObjectClass::kBicycle:
      return "bicycle";
    case ObjectClass::kUnknown:
      break;
  }
  return "unknown";
}

std::optional<ObjectClass> objectClassOf(const std::string& name) {
  const auto* const found =
      std::find_if(kClasses.begin(), kClasses.end(), [&](ObjectClass each) { return nameOf(each) == name; });
  return found == kClasses.end() ? std::nullopt : std::optional(*found);
}

void addToHash(const ObjectFrame& frame, ContentHasher* hasher) {
  hasher->add(frame.stamp.nanoseconds());
  addTransform(frame.odom_from_vehicle, hasher);
  hasher->add(static_cast<int64_t>(frame.objects.size()));
  for (const TrackedObject& object : frame.objects) {
    hasher->add(static_cast<int64_t>(object.id));
    hasher->add(static_cast<int64_t>(object.object_class));
    hasher->add(object.class_probability);
    hasher->add(object.existence_probability);
    addTransform(object.frame_from_object, hasher);
    addNumbers(object.velocity_m_per_s.data(), 3, hasher);
    hasher->add(static_cast<int64_t>(object.is_standing));
    addNumbers(object.covariance.data(), 36, hasher);
    hasher->add(static_cast<int64_t>(object.footprint_m.size()));
    for (const Eigen::Vector2d& corner : object.footprint_m) {
      addNumbers(corner.data(), 2, hasher);
    }
    hasher->add(object.base_z_m);
    hasher->add(object.height_m);
  }
}

}  // namespace vcharge
