#include "vcharge_core/motion/tracked_object.h"

namespace vcharge {

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

}  // namespace vcharge
