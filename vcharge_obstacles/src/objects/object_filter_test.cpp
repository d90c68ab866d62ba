#include "objects/object_filter.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kPeriod_s = 0.08;

Timestamp stampAt(int frame) {
  return Timestamp::fromNanoseconds(1'000'000'000) + durationFromSeconds(kPeriod_s * frame);
}

/// A detection of a person by a camera at the vehicle's origin; the contact lies a radius before the middle.
ObjectDetection detect(const Eigen::Vector2d& middle_m, const Eigen::Vector2d& velocity) {
  ObjectDetection detection;
  detection.away = middle_m.normalized();
  detection.position_m = middle_m - 0.25 * detection.away;
  detection.velocity_m_per_s = velocity;
  detection.covariance = 0.04 * Eigen::Matrix4d::Identity();
  detection.left_m = detection.position_m + Eigen::Vector2d(0.0, 0.2);
  detection.right_m = detection.position_m - Eigen::Vector2d(0.0, 0.2);
  detection.height_m = 1.7;
  detection.num_points = 8;
  return detection;
}

TEST(ObjectFilterTest, NoiseIsAveragedAndCovarianceIsTrue) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.2);
  double normalized = 0.0;
  constexpr int kNumRuns = 40;
  for (int run = 0; run < kNumRuns; ++run) {
    ObjectFilter filter;
    Eigen::Vector2d truth;
    for (int frame = 0; frame < 20; ++frame) {
      truth = Eigen::Vector2d(5.0, -1.0 + 1.2 * kPeriod_s * frame);
      filter.predict(stampAt(frame));
      filter.update({detect(truth + Eigen::Vector2d(noise(random), noise(random)),
                            Eigen::Vector2d(noise(random), 1.2 + noise(random)))},
                    RigidTransform());
      filter.finish();
    }
    ASSERT_EQ(filter.objects().size(), 1U);
    const TrackedObject object = filter.objects().front();
    const Eigen::Vector2d error = object.frame_from_object.translation().head<2>() - truth;
    EXPECT_LT(error.norm(), 0.3);
    EXPECT_NEAR(object.velocity_m_per_s.y(), 1.2, 4.0 * std::sqrt(object.covariance(4, 4)));
    EXPECT_EQ(object.object_class, ObjectClass::kAdult);
    normalized += error.dot(object.covariance.topLeftCorner<2, 2>().inverse() * error) / kNumRuns;
  }
  EXPECT_NEAR(normalized, 2.0, 1.0);
}

TEST(ObjectFilterTest, CommonErrorsLieAlongTheViewOfTheNearestCamera) {
  ObjectFilter filter;
  for (int frame = 0; frame < 20; ++frame) {
    filter.predict(stampAt(frame));
    filter.update({detect({5.0, 1.2 * kPeriod_s * frame}, {0.0, 1.2})}, RigidTransform());
    filter.finish();
  }
  ASSERT_EQ(filter.objects().size(), 1U);
  const TrackedObject own = filter.objects().front();
  const Eigen::Vector2d here = own.frame_from_object.translation().head<2>();
  const TrackedObject object = filter
                                   .objects({RigidTransform::planar(here.x() - 4.0, here.y(), 0.0),
                                             RigidTransform::planar(0.0, 50.0, 0.0)})
                                   .front();
  const Eigen::Matrix2d common = (object.covariance - own.covariance).topLeftCorner<2, 2>();
  EXPECT_GT(common(0, 0), 4.0 * common(1, 1));
  EXPECT_GT(common(1, 1), 0.0);
  EXPECT_NEAR(common(0, 1), 0.0, 1e-9);
  EXPECT_GT(object.covariance(3, 3), own.covariance(3, 3));
}

/// A person five metres ahead who was detected five times, crossing at 1.2 m/s, and is undetected since one
/// stamp.
ObjectFilter filterOfUndetected() {
  ObjectFilter filter;
  for (int frame = 0; frame < 6; ++frame) {
    filter.predict(stampAt(frame));
    if (frame < 5) {
      filter.update({detect({5.0, 1.2 * kPeriod_s * frame}, {0.0, 1.2})}, RigidTransform());
      filter.finish();
    }
  }
  return filter;
}

TEST(ObjectFilterTest, OneNumberCorrectsAnUndetectedObject) {
  ObjectFilter filter = filterOfUndetected();
  ASSERT_EQ(filter.expected().size(), 1U);
  const ObjectFilter::Expected before = filter.expected().front();
  EXPECT_FALSE(before.is_detected);
  EXPECT_NEAR(before.position_m.y(), 1.2 * kPeriod_s * 5, 0.05);
  const Eigen::Vector4d along_y(0.0, 1.0, 0.0, 0.0);
  EXPECT_TRUE(filter.correct(before.index, 0.1, along_y, 0.001));
  EXPECT_NEAR(filter.expected().front().position_m.y(), before.position_m.y() + 0.1, 0.005);
  EXPECT_NEAR(filter.expected().front().position_m.x(), before.position_m.x(), 0.01);
  // What is far from all that is expected is no measurement of this object.
  EXPECT_FALSE(filter.correct(before.index, 3.0, along_y, 0.05));
  EXPECT_NEAR(filter.expected().front().position_m.y(), before.position_m.y() + 0.1, 0.005);
}

TEST(ObjectFilterTest, VotesKeepAnUndetectedObjectOrEndIt) {
  for (const double votes : {0.4, -0.1}) {
    ObjectFilter filter = filterOfUndetected();
    for (int frame = 6; frame < 30; ++frame) {
      for (const ObjectFilter::Expected& object : filter.expected()) {
        filter.vote(object.index, votes);
      }
      filter.finish();
      filter.predict(stampAt(frame));
    }
    EXPECT_EQ(filter.objects().empty(), votes < 0.0) << votes;
  }
}

TEST(ObjectFilterTest, CrossingPeopleKeepTheirNumbers) {
  ObjectFilter filter;
  uint32_t first_id = 0;
  for (int frame = 0; frame < 40; ++frame) {
    const double time_s = kPeriod_s * frame;
    filter.predict(stampAt(frame));
    filter.update(
        {detect({5.0, -2.0 + 1.2 * time_s}, {0.0, 1.2}), detect({5.3, 2.0 - 1.2 * time_s}, {0.0, -1.2})},
        RigidTransform());
    filter.finish();
    for (const TrackedObject& object : filter.objects()) {
      if (object.velocity_m_per_s.y() > 0.0) {
        first_id = first_id == 0 ? object.id : first_id;
        EXPECT_EQ(object.id, first_id);
      }
    }
  }
  EXPECT_EQ(filter.objects().size(), 2U);
}

TEST(ObjectFilterTest, DetectionsAreTurnedIntoTheFixedFrame) {
  const RigidTransform fixed_from_vehicle = RigidTransform::planar(10.0, 5.0, M_PI / 2.0);
  ObjectFilter filter;
  for (int frame = 0; frame < 12; ++frame) {
    filter.predict(stampAt(frame));
    filter.update({detect({4.0, 0.0}, {0.0, 1.0})}, fixed_from_vehicle);
    filter.finish();
  }
  const TrackedObject object = filter.objects().at(0);
  EXPECT_NEAR(object.velocity_m_per_s.x(), -1.0, 0.05);
  EXPECT_NEAR(object.frame_from_object.translation().y(), 9.0, 0.1);
}

TEST(ObjectFilterTest, OneDetectionIsNoObjectAndALostOneEnds) {
  ObjectFilter filter;
  filter.predict(stampAt(0));
  filter.update({detect({4.0, 0.0}, {0.0, 1.0})}, RigidTransform());
  filter.finish();
  EXPECT_TRUE(filter.objects().empty());
  for (int frame = 1; frame < 6; ++frame) {
    filter.predict(stampAt(frame));
    filter.update({detect({4.0, kPeriod_s * frame}, {0.0, 1.0})}, RigidTransform());
    filter.finish();
  }
  EXPECT_EQ(filter.objects().size(), 1U);
  for (int frame = 6; frame < 30; ++frame) {
    filter.predict(stampAt(frame));
    filter.finish();
  }
  EXPECT_TRUE(filter.objects().empty());
}

}  // namespace
}  // namespace vcharge
