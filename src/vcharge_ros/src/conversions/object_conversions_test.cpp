#include "vcharge_ros/obstacle_conversions.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

TEST(ObjectConversionsTest, MessageHasAllThatIsKnownAboutTheObjects) {
  TrackedObject car;
  car.id = 7;
  car.object_class = ObjectClass::kCar;
  car.class_probability = 0.75;
  car.existence_probability = 0.5;
  car.frame_from_object = RigidTransform::planar(1.0, 2.0, 0.5);
  car.velocity_m_per_s = {1.5, -0.5, 0.25};
  car.is_standing = true;
  car.covariance(1, 4) = 0.125;
  car.footprint_m = {{0.0, 1.0}, {2.0, 1.0}, {2.0, 3.0}};
  car.base_z_m = 0.5;
  car.height_m = 1.5;
  const Timestamp stamp = Timestamp::fromNanoseconds(1'500'000'000);
  const vcharge_msgs::TrackedObjects message = toMessage(std::vector<TrackedObject>{car}, stamp, "odom");
  EXPECT_EQ(message.header.frame_id, "odom");
  EXPECT_EQ(toTimestamp(message.header.stamp), stamp);
  ASSERT_EQ(message.objects.size(), 1U);
  const vcharge_msgs::TrackedObject& object = message.objects.front();
  EXPECT_EQ(object.id, 7U);
  EXPECT_EQ(object.object_class, vcharge_msgs::TrackedObject::CAR);
  EXPECT_EQ(object.class_probability, 0.75);
  EXPECT_EQ(object.existence_probability, 0.5);
  EXPECT_EQ(fromMessage(object.pose, "pose").matrix(), car.frame_from_object.matrix());
  EXPECT_EQ(object.velocity.x, 1.5);
  EXPECT_EQ(object.velocity.y, -0.5);
  EXPECT_EQ(object.velocity.z, 0.25);
  EXPECT_TRUE(object.is_standing);
  EXPECT_EQ(object.covariance[1 * 6 + 4], 0.125);
  EXPECT_EQ(object.covariance[4 * 6 + 1], 0.0);
  ASSERT_EQ(object.footprint.points.size(), 3U);
  EXPECT_EQ(object.footprint.points[2].y, 3.0F);
  EXPECT_EQ(object.footprint.points[2].z, 0.5F);
  EXPECT_EQ(object.height_m, 1.5);

  const std::vector<TrackedObject> back = fromMessage(message, "/objects");
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(back[0].id, car.id);
  EXPECT_EQ(back[0].object_class, car.object_class);
  EXPECT_EQ(back[0].existence_probability, car.existence_probability);
  EXPECT_EQ(back[0].frame_from_object.matrix(), car.frame_from_object.matrix());
  EXPECT_EQ(back[0].velocity_m_per_s, car.velocity_m_per_s);
  EXPECT_TRUE(back[0].is_standing);
  EXPECT_EQ(back[0].covariance, car.covariance);
  EXPECT_EQ(back[0].footprint_m, car.footprint_m);
  EXPECT_EQ(back[0].base_z_m, car.base_z_m);
  EXPECT_EQ(back[0].height_m, car.height_m);
}

TEST(ObjectConversionsTest, BadNumbersAndClassesAreErrorsThatNameTheObject) {
  TrackedObject person;
  person.id = 12;
  person.footprint_m = {{0.0, 1.0}};
  const vcharge_msgs::TrackedObjects good = toMessage({person}, Timestamp(), "odom");
  for (int kind = 0; kind < 3; ++kind) {
    vcharge_msgs::TrackedObjects bad = good;
    if (kind == 0) {
      bad.objects[0].velocity.x = NAN;
    } else if (kind == 1) {
      bad.objects[0].footprint.points[0].x = INFINITY;
    } else {
      bad.objects[0].object_class = 200;
    }
    try {
      fromMessage(bad, "/objects");
      FAIL() << kind;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind("/objects: object 12: expected", 0), 0U) << error.what();
    }
  }
}

}  // namespace
}  // namespace vcharge
