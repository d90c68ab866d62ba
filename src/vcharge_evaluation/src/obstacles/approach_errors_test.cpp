#include "vcharge_evaluation/approach_errors.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kSpeed_m_per_s = 2.0;

/// A straight drive of 6 m along x past a box 0.5 m beside the car, and towards a person in its way.
class ApproachErrorsTest : public ::testing::Test {
 protected:
  ApproachErrorsTest() {
    box_.kind = "box";
    box_.footprint_m = {{6.0, 1.4}, {6.4, 1.4}, {6.4, 1.8}, {6.0, 1.8}};
    box_.top_z_m = 0.5;
    person_.kind = "pedestrian";
    person_.footprint_m = {{11.0, -0.3}, {11.6, -0.3}, {11.6, 0.3}, {11.0, 0.3}};
    person_.top_z_m = 1.8;
    heights_.height_m = cv::Mat(400, 400, CV_32FC1, cv::Scalar(0.0));
    heights_.origin_m = {-19.95, -19.95};
    heights_.height_m(cv::Rect(260, 214, 4, 4)).setTo(0.5F);
    for (int i = 0; i <= 30; ++i) {
      path_.push_back({Timestamp::fromNanoseconds(100'000'000LL * (i + 1)),
                       RigidTransform::planar(0.1 * kSpeed_m_per_s * i, 0.0, 0.0)});
    }
    for (const TruthObstacle* obstacle : {&box_, &person_}) {
      for (double z = 0.15; z < 0.45; z += 0.01) {
        points_.push_back(
            {Eigen::Vector3f(static_cast<float>(obstacle->footprint_m[0].x()),
                             static_cast<float>(obstacle->footprint_m[0].y() + 0.05), static_cast<float>(z)),
             1.0F});
      }
    }
  }
  /// Maps of a drive: free but for the box and the person from their frames on; -1: never.
  ApproachErrors judge(int box_from_frame, int person_from_frame, int8_t elsewhere = kCellFree) {
    ApproachEvaluator evaluator({box_}, heights_, path_);
    for (int i = 0; i <= 30; ++i) {
      ObstacleMap map = ObstacleMap::unobserved({400, 400}, 0.1);
      map.origin_m = {-20.0, -20.0};
      map.stamp = path_[static_cast<size_t>(i)].stamp;
      map.fixed_from_vehicle = path_[static_cast<size_t>(i)].world_from_vehicle;
      map.state.setTo(elsewhere);
      const auto mark = [&](const cv::Rect& cells, int from_frame) {
        map.state(cells).setTo(from_frame >= 0 && i >= from_frame ? kCellOccupied : elsewhere);
      };
      mark({260, 214, 4, 4}, box_from_frame);
      mark({310, 197, 6, 6}, person_from_frame);
      evaluator.add(map, points_, path_[static_cast<size_t>(i)].world_from_vehicle, {person_});
    }
    return evaluator.errors();
  }

  TruthObstacle box_, person_;
  TruthHeights heights_;
  Trajectory path_;
  std::vector<SeenPoint> points_;
};

TEST_F(ApproachErrorsTest, TellsDistanceAndTimeOfTheFirstReport) {
  const ApproachErrors errors = judge(0, 10);
  ASSERT_EQ(errors.reports.size(), 2u);
  const FirstReport& person = errors.reports[0];
  EXPECT_EQ(person.kind, "pedestrian");
  EXPECT_TRUE(person.moves);
  EXPECT_NEAR(person.first_visible_m, 11.0 - 3.46, 1e-6);
  ASSERT_TRUE(person.reported_m);
  EXPECT_NEAR(*person.reported_m, 9.0 - 3.46, 1e-6);
  EXPECT_NEAR(*person.contact_s, (9.0 - 3.46) / kSpeed_m_per_s, 1e-6);
  const FirstReport& box = errors.reports[1];
  EXPECT_FALSE(box.contact_s) << "reported before the vehicle's speed is known";
  EXPECT_NEAR(box.nearest_m, 1.4 - 0.89, 1e-6);
  EXPECT_NEAR(errors.driven_m, 6.0, 1e-6);
  EXPECT_NEAR(errors.duration_s, 3.0, 1e-6);
}

TEST_F(ApproachErrorsTest, AnObstacleThatIsNeverReportedIsCounted) {
  const ApproachErrors errors = judge(-1, -1);
  ASSERT_EQ(errors.reports.size(), 2u);
  EXPECT_FALSE(errors.reports[0].reported_m);
  EXPECT_FALSE(errors.reports[1].reported_m);
}

TEST_F(ApproachErrorsTest, AReportOnceTheObstacleIsFartherAgainIsLate) {
  path_.back().world_from_vehicle = RigidTransform::planar(9.0, 0.0, 0.0);
  const FirstReport box = judge(30, -1).reports[1];
  ASSERT_TRUE(box.reported_m);
  EXPECT_NEAR(*box.reported_m, 1.4 - 0.89, 1e-6);
}

TEST_F(ApproachErrorsTest, TheCorridorIsFreeUnknownOrBlocked) {
  const ApproachErrors free = judge(0, 0);
  EXPECT_GT(free.corridor.free_as_free, 5000u);
  EXPECT_EQ(free.corridor.free_as_unknown + free.corridor.free_as_occupied, 0u);
  EXPECT_EQ(free.corridor.occupied_as_free, 0u) << "the box is outside, the person beyond the path";
  const ApproachErrors unknown = judge(0, 0, kCellUnobserved);
  EXPECT_EQ(unknown.corridor.free_as_free, 0u);
  EXPECT_EQ(unknown.corridor.free_as_unknown, free.corridor.free_as_free);
  const ApproachErrors blocked = judge(0, 0, kCellOccupied);
  EXPECT_EQ(blocked.corridor.free_as_occupied, free.corridor.free_as_free);
  EXPECT_GT(blocked.num_false_alarms, 1000u);
  EXPECT_LT(blocked.num_false_alarms, blocked.corridor.free_as_occupied) << "a cell that stays is one alarm";
}

TEST_F(ApproachErrorsTest, ThePathAheadAndBehindIsJudgedFromTwoMetresOn) {
  const ApproachErrors free = judge(0, 0);
  // Ten stamps of 0.2 m are not judged. Of the others, all have the 3.5 m behind that were driven, if so many
  // were; ahead, the path ends at 6 m.
  double ahead_m2 = 0.0, behind_m2 = 0.0;
  for (double driven_m = 2.0; driven_m < 6.01; driven_m += 0.2) {
    ahead_m2 += 1.78 * std::max(0.0, std::min(4.0, 6.0 - driven_m) - 0.5);
    behind_m2 += 1.78 * std::max(0.0, std::min(4.0, driven_m) - 0.5);
  }
  EXPECT_NEAR(0.01 * static_cast<double>(free.ahead.free_as_free), ahead_m2, 0.1 * ahead_m2);
  EXPECT_NEAR(0.01 * static_cast<double>(free.behind.free_as_free), behind_m2, 0.1 * behind_m2);
  EXPECT_EQ(free.ahead.free_as_unknown + free.behind.free_as_unknown, 0U);
  const ApproachErrors unknown = judge(0, 0, kCellUnobserved);
  EXPECT_EQ(unknown.ahead.free_as_unknown, free.ahead.free_as_free);
  EXPECT_EQ(unknown.behind.free_as_unknown, free.behind.free_as_free);
}

TEST_F(ApproachErrorsTest, APersonInTheCorridorMustNotBeFree) {
  person_.footprint_m = {{7.0, -0.3}, {7.6, -0.3}, {7.6, 0.3}, {7.0, 0.3}};
  const ApproachErrors errors = judge(0, -1);
  EXPECT_GT(errors.corridor.occupied_as_free, 100u);
}

}  // namespace
}  // namespace vcharge
