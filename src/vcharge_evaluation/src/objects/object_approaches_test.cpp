#include "vcharge_evaluation/object_errors.h"

#include <gtest/gtest.h>

#include "objects/object_errors_fixture.h"

namespace vcharge {
namespace {

class ObjectApproachesTest : public ObjectErrorsFixture {};

/// The vehicle stands, and the person comes straight up to its front at 1 m/s, from 3.5 m to 0.5 m.
void approach(int index, TrueObjectFrame* truth) {
  truth->world_from_vehicle = RigidTransform();
  const double x_m = kVehicleFront_m + 0.25 + 3.5 - 0.1 * index;
  truth->objects = {objectAt(1, RigidTransform::planar(x_m, 0.0, M_PI), {-1.0, 0.0})};
}

TEST_F(ObjectApproachesTest, ApproachesToTheStandingVehicleAreCounted) {
  constexpr int kFirstBelow = 21;  // 1.4 m
  for (const int last_report : {kNumFrames, 17, 12, -1}) {
    const ObjectErrors errors = judge([&](int index, Frame* frame) {
      approach(index, &frame->truth);
      frame->reports.clear();
      if (index >= 8 && index <= last_report) {
        frame->reports = frame->truth.objects;
      }
    });
    ASSERT_EQ(errors.approaches.size(), 1U);
    const ObjectApproach& found = errors.approaches[0];
    EXPECT_NEAR(toSeconds(found.stamp - Timestamp::fromNanoseconds(1'000'000'000)), 0.1 * kFirstBelow, 0.11);
    // A report of 0.9 s before is none.
    EXPECT_EQ(found.reported, last_report >= 17);
    EXPECT_NEAR(found.first_reported_m, last_report > 0 ? 2.7 : 0.0, 0.05);
  }
}

TEST_F(ObjectApproachesTest, OnlyTheStandingVehicleIsApproached) {
  EXPECT_TRUE(judge().approaches.empty());
  const ObjectErrors errors = judge([](int index, Frame* frame) {
    approach(index, &frame->truth);
    frame->truth.world_from_vehicle = RigidTransform::planar(0.0, 0.05 * index, 0.0);
  });
  EXPECT_TRUE(errors.approaches.empty());
}

}  // namespace
}  // namespace vcharge
