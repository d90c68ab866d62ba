#include "vcharge_evaluation/object_errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "objects/object_errors_fixture.h"

namespace vcharge {
namespace {

class ObjectErrorsTest : public ObjectErrorsFixture {};

TEST_F(ObjectErrorsTest, ReportsEqualToTheTruthHaveNoErrors) {
  const ObjectErrors errors = judge();
  EXPECT_EQ(errors.num_frames, static_cast<size_t>(kNumFrames));
  EXPECT_NEAR(errors.duration_s, 3.0, 1e-9);
  EXPECT_EQ(errors.all.num_due, static_cast<size_t>(kNumFrames - kFirstDue));
  EXPECT_EQ(errors.all.num_found, errors.all.num_due);
  EXPECT_EQ(errors.all.num_good, errors.all.num_due);
  EXPECT_EQ(errors.all.num_right_class, errors.all.num_due);
  EXPECT_LT(errors.all.position_error_m.max, 1e-9);
  EXPECT_LT(errors.all.centre_error_m.max, 1e-9);
  EXPECT_LT(errors.all.velocity_error_m_per_s.max, 1e-9);
  EXPECT_LT(errors.normalized_error.max, 1e-9);
  ASSERT_EQ(errors.crossings.size(), 1U);
  EXPECT_TRUE(errors.crossings[0].kept());
  ASSERT_EQ(errors.first_reports.size(), 1U);
  EXPECT_TRUE(errors.first_reports[0].found);
  EXPECT_EQ(errors.first_reports[0].delay_s, 0.0);
  EXPECT_TRUE(errors.false_objects.empty());
}

TEST_F(ObjectErrorsTest, WithoutReportsEveryDueFrameIsMissed) {
  const ObjectErrors errors = judge([](int, Frame* frame) { frame->reports.clear(); });
  EXPECT_EQ(errors.all.num_due, static_cast<size_t>(kNumFrames - kFirstDue));
  EXPECT_EQ(errors.all.num_found, 0U);
  EXPECT_EQ(errors.all.num_good_position + errors.all.num_good_velocity, 0U);
  EXPECT_EQ(errors.all.position_error_m.percentile_50, 1.0);
  EXPECT_EQ(errors.all.velocity_error_m_per_s.mean, 1.0);
  EXPECT_EQ(errors.normalized_error.count, 0U);
  ASSERT_EQ(errors.crossings.size(), 1U);
  EXPECT_FALSE(errors.crossings[0].kept());
  ASSERT_EQ(errors.first_reports.size(), 1U);
  EXPECT_FALSE(errors.first_reports[0].found);
  EXPECT_NEAR(errors.first_reports[0].delay_s, 3.0, 1e-9) << "the whole drive";
}

TEST_F(ObjectErrorsTest, KnownOffsetsAreFound) {
  const ObjectErrors errors = judge([](int, Frame* frame) {
    frame->reports[0] = transformed(frame->reports[0], RigidTransform::planar(0.2, 0.0, 0.0));
    frame->reports[0].velocity_m_per_s += Eigen::Vector3d(0.3, 0.4, 0.0);
  });
  EXPECT_NEAR(errors.all.position_error_m.mean, 0.2, 1e-9);
  EXPECT_NEAR(errors.all.centre_error_m.max, 0.2, 1e-9);
  EXPECT_NEAR(errors.all.velocity_error_m_per_s.percentile_50, 0.5, 1e-9);
  EXPECT_EQ(errors.all.num_good_position, errors.all.num_due);
  EXPECT_EQ(errors.all.num_good_velocity, 0U);
  EXPECT_EQ(errors.all.num_good, 0U);
}

TEST_F(ObjectErrorsTest, PositionIsThatOfTheNearestPoint) {
  // A body that is 0.4 m too long away from the vehicle: the nearest point is right, the centre is not.
  const ObjectErrors errors = judge([](int index, Frame* frame) {
    const RigidTransform centre = RigidTransform::planar(0.2, 0.0, 0.0) * personAt(index);
    frame->reports[0] = objectAt(70, centre, {0.2, 1.0}, 0.5, 0.9);
  });
  EXPECT_LT(errors.all.position_error_m.max, 1e-9);
  EXPECT_NEAR(errors.all.centre_error_m.mean, 0.2, 1e-9);
}

TEST_F(ObjectErrorsTest, ASmallTurnOfALongBodyBesideTheVehicleIsASmallError) {
  const auto car = [](uint32_t id, double yaw_rad) {
    return objectAt(id, RigidTransform::planar(1.4, 1.0 + kVehicleHalfWidth_m + 2.0, yaw_rad), {1.0, 0.0},
                    4.5, 1.8);
  };
  const ObjectErrors errors = judge([&](int, Frame* frame) {
    frame->truth.world_from_vehicle = vehicleAt(0);
    frame->truth.objects = {car(1, 0.0)};
    frame->reports = {car(70, 0.01)};
  });
  EXPECT_EQ(errors.all.num_due, 0U) << "its centre does not move";
  const ObjectErrors moving = judge([&](int index, Frame* frame) {
    const RigidTransform moved = RigidTransform::planar(0.02 * index, 0.0, 0.0);
    frame->truth.objects = {transformed(car(1, 0.0), moved)};
    frame->reports = {transformed(car(70, 0.01), moved)};
  });
  EXPECT_GT(moving.all.num_found, 0U);
  EXPECT_LT(moving.all.position_error_m.max, 0.01 * 4.5);
}

TEST_F(ObjectErrorsTest, ReportsBeyondTheGateOrUnlikelyOnesDoNotCount) {
  for (const double offset_m : {0.99, 1.01}) {
    const ObjectErrors errors = judge([&](int, Frame* frame) {
      frame->reports[0] = transformed(frame->reports[0], RigidTransform::planar(offset_m, 0.0, 0.0));
    });
    EXPECT_EQ(errors.all.num_found, offset_m < 1.0 ? errors.all.num_due : 0U);
  }
  const ObjectErrors unlikely =
      judge([](int, Frame* frame) { frame->reports[0].existence_probability = 0.49; });
  EXPECT_EQ(unlikely.all.num_found, 0U);
}

TEST_F(ObjectErrorsTest, WhatStandsCreepsHidesOrIsFarAwayIsNotDue) {
  const std::vector<Change> changes = {
      [](int, Frame* frame) { frame->truth.objects[0].is_standing = true; },
      [](int index, Frame* frame) {
        frame->truth.objects = {objectAt(1, RigidTransform::planar(6.0, 0.014 * index, 0.0), {0.0, 0.14})};
      },
      [](int, Frame* frame) { frame->truth.visible_fraction[0] = 29.0 / (640 * 400); },
      [](int, Frame* frame) {
        frame->truth.objects[0] =
            transformed(frame->truth.objects[0], RigidTransform::planar(3.76, 0.0, 0.0));
      },
      [](int index, Frame* frame) { frame->truth.visible_fraction[0] = index % 5 == 4 ? 0.0 : 1.0; }};
  for (size_t i = 0; i < changes.size(); ++i) {
    EXPECT_EQ(judge(changes[i]).all.num_due, 0U) << i;
  }
}

TEST_F(ObjectErrorsTest, AfterAnInterruptionHalfASecondOfVisibilityIsDueAgain) {
  const ObjectErrors errors =
      judge([](int index, Frame* frame) { frame->truth.visible_fraction[0] = index == 20 ? 0.0 : 1.0; });
  EXPECT_EQ(errors.all.num_due, static_cast<size_t>((20 - kFirstDue) + (kNumFrames - 21 - kFirstDue)));
  ASSERT_EQ(errors.crossings.size(), 1U) << "the second one takes 0.4 s";
  EXPECT_EQ(errors.crossings[0].num_due, static_cast<size_t>(20 - kFirstDue));
}

TEST_F(ObjectErrorsTest, AnObjectThatLeavesTheTruthIsInterrupted) {
  const ObjectErrors errors = judge([](int index, Frame* frame) {
    if (index == 20) {
      frame->truth.objects.clear();
      frame->truth.visible_fraction.clear();
    }
  });
  EXPECT_EQ(errors.all.num_due, static_cast<size_t>((20 - kFirstDue) + (kNumFrames - 21 - kFirstDue)));
}

TEST_F(ObjectErrorsTest, AChangedIdOrTooFewReportsLoseTheIdentity) {
  const auto keptAfter = [&](const Change& change) {
    const ObjectErrors errors = judge(change);
    return errors.crossings.size() == 1 && errors.crossings[0].kept();
  };
  EXPECT_FALSE(keptAfter([](int index, Frame* frame) { frame->reports[0].id = index < 25 ? 70 : 71; }));
  EXPECT_TRUE(keptAfter([](int index, Frame* frame) { frame->reports[0].id = index < kFirstDue ? 70 : 71; }))
      << "before it is due";
  // 26 frames are due, of which 13 and 12 are found.
  for (const int from : {18, 19}) {
    EXPECT_EQ(keptAfter([&](int index, Frame* frame) {
                if (index < from) {
                  frame->reports.clear();
                }
              }),
              from == 18);
  }
}

TEST_F(ObjectErrorsTest, OneReportServesOneObject) {
  const ObjectErrors errors = judge([](int index, Frame* frame) {
    const RigidTransform beside = RigidTransform::planar(0.0, 0.8, 0.0) * personAt(index);
    frame->truth.objects.push_back(objectAt(2, beside, {0.2, 1.0}));
    frame->truth.visible_fraction.push_back(1.0);
  });
  EXPECT_EQ(errors.all.num_found * 2, errors.all.num_due);
  EXPECT_LT(errors.all.position_error_m.percentile_50, 0.51) << "the nearer one has the report";
}

TEST_F(ObjectErrorsTest, AReportOfAStandingNeighbourIsNotThatOfTheDueObject) {
  const ObjectErrors errors = judge([](int index, Frame* frame) {
    const RigidTransform beside = RigidTransform::planar(0.0, 0.8, 0.0) * personAt(index);
    TrackedObject neighbour = objectAt(2, beside, {0.0, 0.0});
    neighbour.is_standing = true;
    frame->truth.objects.push_back(neighbour);
    frame->truth.visible_fraction.push_back(1.0);
    neighbour.id = 80;
    frame->reports = {neighbour};
  });
  EXPECT_EQ(errors.all.num_found, 0U);
}

TEST_F(ObjectErrorsTest, FalseObjectsMoveNearbyWhereNoMoverIs) {
  const auto numFalse = [&](int num_frames, const Change& change = {}) {
    return judge([&](int index, Frame* frame) {
             if (index < num_frames) {
               frame->reports.push_back(
                   objectAt(90, RigidTransform::planar(1.0, -3.0, 0.0), Eigen::Vector2d(1.0, 0.0)));
               if (change) {
                 change(index, frame);
               }
             }
           })
        .false_objects.size();
  };
  EXPECT_EQ(numFalse(2), 0U);
  EXPECT_EQ(numFalse(3), 1U);
  EXPECT_EQ(numFalse(3, [](int index, Frame* frame) { frame->reports[1].id += index; }), 0U);
  EXPECT_EQ(numFalse(3, [](int, Frame* frame) { frame->reports[1].is_standing = true; }), 0U);
  EXPECT_EQ(numFalse(3, [](int, Frame* frame) { frame->reports[1].existence_probability = 0.4; }), 0U);
  const auto moveTo = [](double y_m) {
    return [y_m](int, Frame* frame) {
      frame->reports[1] = objectAt(90, RigidTransform::planar(1.0, y_m, 0.0), {1.0, 0.0});
    };
  };
  const double side_m = 1.0 - kVehicleHalfWidth_m - 0.25;
  EXPECT_EQ(numFalse(3, moveTo(side_m - 7.99)), 1U);
  EXPECT_EQ(numFalse(3, moveTo(side_m - 8.01)), 0U);
  for (const double gap_m : {0.99, 1.01}) {  // of a hidden mover that stands
    EXPECT_EQ(numFalse(3,
                       [&](int, Frame* frame) {
                         frame->truth.objects.push_back(
                             objectAt(2, RigidTransform::planar(1.0, -3.5 - gap_m, 0.0), {0.0, 0.0}));
                         frame->truth.objects.back().is_standing = true;
                         frame->truth.visible_fraction.push_back(0.0);
                       }),
              gap_m > 1.0 ? 1U : 0U);
  }
  ObjectErrors errors;
  errors.duration_s = 30.0;
  errors.false_objects.resize(2);
  EXPECT_NEAR(errors.false_per_minute(), 4.0, 1e-9);
}

TEST_F(ObjectErrorsTest, ErrorsAreComparedWithTheirCovariance) {
  const ObjectErrors errors = judge([](int, Frame* frame) {
    frame->reports[0] = transformed(frame->reports[0], RigidTransform::planar(0.2, 0.0, 0.0));
    frame->reports[0].covariance(0, 0) = 0.04 * 0.04;  // 5 standard deviations along x
    frame->reports[0].covariance(1, 1) = 1.0;
  });
  EXPECT_NEAR(errors.normalized_error.mean, 25.0, 1e-6);
  EXPECT_EQ(errors.num_normalized_within_95, 0U);
  const ObjectErrors along_y = judge([](int, Frame* frame) {
    frame->reports[0] = transformed(frame->reports[0], RigidTransform::planar(0.0, 0.2, 0.0));
    frame->reports[0].covariance(0, 0) = 0.04 * 0.04;
    frame->reports[0].covariance(1, 1) = 1.0;
  });
  EXPECT_NEAR(along_y.normalized_error.mean, 0.04, 1e-6);
  EXPECT_EQ(along_y.num_normalized_within_95, along_y.normalized_error.count);
  const ObjectErrors certain = judge([](int, Frame* frame) { frame->reports[0].covariance.setZero(); });
  EXPECT_EQ(certain.normalized_error.max, kMaxNormalizedError);
}

TEST_F(ObjectErrorsTest, FirstReportIsTimedFromTheFirstVisibleMove) {
  const ObjectErrors errors = judge([](int index, Frame* frame) {
    frame->truth.visible_fraction[0] = index < 4 ? 0.0 : 1.0;
    if (index < 12) {
      frame->reports.clear();
    }
  });
  ASSERT_EQ(errors.first_reports.size(), 1U);
  EXPECT_NEAR(errors.first_reports[0].delay_s, 0.8, 1e-9);
}

TEST_F(ObjectErrorsTest, FiguresAreSplitByClassAndDistance) {
  const ObjectErrors errors = judge([](int index, Frame* frame) {
    TrackedObject bicycle = objectAt(2, RigidTransform::planar(0.1 * index, -1.5, 0.0), {1.0, 0.0}, 1.8, 0.6);
    bicycle.object_class = ObjectClass::kBicycle;
    frame->truth.objects.push_back(bicycle);
    frame->truth.visible_fraction.push_back(1.0);
    frame->reports[0].object_class = ObjectClass::kChild;
  });
  ASSERT_EQ(errors.by_class.size(), 2U);
  EXPECT_EQ(errors.by_class.at(ObjectClass::kAdult).num_found, static_cast<size_t>(kNumFrames - kFirstDue));
  EXPECT_EQ(errors.by_class.at(ObjectClass::kAdult).num_right_class, 0U);
  EXPECT_EQ(errors.by_class.at(ObjectClass::kBicycle).num_found, 0U);
  ASSERT_EQ(errors.by_distance.size(), 3U);
  EXPECT_EQ(errors.by_distance[0].figures.num_due, errors.by_class.at(ObjectClass::kBicycle).num_due);
  EXPECT_EQ(errors.by_distance[1].figures.num_due, 0U);
  EXPECT_EQ(errors.by_distance[2].figures.num_due, errors.by_class.at(ObjectClass::kAdult).num_due);
  EXPECT_EQ(errors.by_distance[2].to_m, 8.0);
}

TEST_F(ObjectErrorsTest, TheWorstImageHasTheLargestSumOfErrors) {
  const ObjectErrors errors = judge([](int index, Frame* frame) {
    if (index == 17) {
      frame->reports.clear();
    }
  });
  EXPECT_EQ(errors.worst, frameAt(17).truth.stamp);
  EXPECT_FALSE(judge([](int, Frame* frame) { frame->truth.visible_fraction[0] = 0.0; }).worst);
}

TEST(ObjectEvaluatorTest, AnEmptyDriveHasNoErrorsAndStampsMustIncrease) {
  ObjectEvaluator evaluator;
  EXPECT_EQ(evaluator.errors().all.num_due, 0U);
  EXPECT_EQ(evaluator.errors().false_per_minute(), 0.0);
  TrueObjectFrame truth;
  ObjectFrame reported;
  evaluator.add(truth, reported);
  EXPECT_THROW(evaluator.add(truth, reported), std::logic_error);
  truth.stamp = Timestamp::fromNanoseconds(1);
  EXPECT_THROW(evaluator.add(truth, reported), std::logic_error);
}

TEST(CountPointsOnTest, GroundCeilingAndNeighboursDoNotShowAnObject) {
  TrackedObject object = objectAt(1, RigidTransform::planar(2.0, 0.0, 0.0), {0.0, 0.0});
  object.base_z_m = 0.5;
  const auto count = [&](const Eigen::Vector3d& point_m) {
    return countPointsOn({object}, {SeenPoint{point_m.cast<float>(), 0.0F}})[0];
  };
  EXPECT_EQ(count({2.0, 0.0, 1.0}), 1U);
  EXPECT_EQ(count({2.29, 0.0, 1.0}), 1U) << "within 5 cm of the footprint";
  EXPECT_EQ(count({2.31, 0.0, 1.0}), 0U);
  EXPECT_EQ(count({2.29, 0.29, 1.0}), 0U) << "farther than 5 cm from the corner";
  EXPECT_EQ(count({2.0, 0.0, 0.54}), 0U) << "the ground";
  EXPECT_EQ(count({2.0, 0.0, 2.24}), 1U);
  EXPECT_EQ(count({2.0, 0.0, 2.26}), 0U) << "the ceiling";
}

}  // namespace
}  // namespace vcharge
