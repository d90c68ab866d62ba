#include "vcharge_mapping/session_merger.h"

#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/world_drives.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

MergedMap merge(const SparseMap& map, const SparseMap& session) {
  return mergeSession(map, session, MergeOptions(), nullptr);
}

/// Largest error of the keyframes' positions relative to the first one.
double worstError_m(const SparseMap& map, const std::vector<RigidTransform>& world_from_vehicle) {
  const RigidTransform world_from_map =
      world_from_vehicle.front() * map.keyframes().front().map_from_vehicle.inverse();
  double worst_m = 0.0;
  for (size_t i = 0; i < map.keyframes().size(); ++i) {
    worst_m = std::max(worst_m, (world_from_map * map.keyframes()[i].map_from_vehicle.translation() -
                                 world_from_vehicle[i].translation())
                                    .norm());
  }
  return worst_m;
}

class SessionMergerTest : public ::testing::Test {
 protected:
  std::vector<RigidTransform> truthOf(const std::vector<std::function<bool(int)>>& drives) const {
    std::vector<RigidTransform> truth;
    for (const auto& has_keyframe : drives) {
      for (int i = 0; i < testing::kNumKeyframes; ++i) {
        if (has_keyframe(i)) {
          truth.push_back(world_->keyframes()[static_cast<size_t>(i)].map_from_vehicle);
        }
      }
    }
    return truth;
  }

  const std::shared_ptr<const SparseMap> world_ = testing::makeWorld(1);
  const RigidTransform elsewhere_ = RigidTransform::planar(-40.0, 17.0, 2.0);
  const std::function<bool(int)> even_ = [](int i) { return i % 2 == 0; };
  const std::function<bool(int)> odd_ = [](int i) { return i % 2 == 1; };
};

TEST_F(SessionMergerTest, JoinsTwoDrives) {
  const auto first = testing::driveThrough(*world_, "a.bag", 0, RigidTransform(), even_);
  const auto second = testing::driveThrough(*world_, "b.bag", 1, elsewhere_, odd_);
  const MergedMap merged = merge(*first, *second);
  EXPECT_TRUE(merged.report.joined) << merged.report.remark;
  EXPECT_GT(merged.report.num_accepted_loops, 50);
  EXPECT_GT(merged.report.common_ratio, 0.8);
  ASSERT_EQ(merged.map->sessions().size(), 2U);
  EXPECT_EQ(merged.map->sessions()[1].name, "b.bag");
  EXPECT_EQ(merged.map->sessions()[1].component, 0);
  EXPECT_LT(worstError_m(*merged.map, truthOf({even_, odd_})), 0.01);
  // Common landmarks are one, and keep their ids.
  EXPECT_LT(merged.map->landmarks().size(), 11 * world_->landmarks().size() / 10);
  for (const MapLandmark& landmark : merged.map->landmarks()) {
    if (landmark.id < first->contents().next_landmark_id) {
      EXPECT_LT((landmark.position_m - first->landmarks()[landmark.id].position_m).norm(), 0.1);
    }
  }
  EXPECT_EQ(merged.map->keyframes()[10].id, first->keyframes()[10].id);
  EXPECT_EQ(merge(*first, *second).map->contentHash(), merged.map->contentHash());
}

TEST_F(SessionMergerTest, KeepsAnotherCarParkApart) {
  const auto first = testing::driveThrough(*world_, "a.bag", 0, RigidTransform(), even_);
  const auto other = testing::driveThrough(*testing::makeWorld(2), "b.bag", 1, RigidTransform(), even_);
  const MergedMap merged = merge(*first, *other);
  EXPECT_FALSE(merged.report.joined);
  EXPECT_THAT(merged.report.remark, HasSubstr("no common places"));
  EXPECT_EQ(merged.map->sessions()[1].component, 1);
  EXPECT_EQ(merged.map->landmarks().size(), first->landmarks().size() + other->landmarks().size());
  for (size_t i = 0; i < first->keyframes().size(); ++i) {
    EXPECT_EQ(merged.map->keyframes()[i].map_from_vehicle.translation(),
              first->keyframes()[i].map_from_vehicle.translation());
  }
  const double distance_m = (merged.map->keyframes().back().map_from_vehicle.translation() -
                             merged.map->keyframes().front().map_from_vehicle.translation())
                                .norm();
  EXPECT_GT(distance_m, 200.0);
}

TEST_F(SessionMergerTest, ADriveJoinsComponents) {
  const std::function<bool(int)> begin = [](int i) { return i < 60; };
  const std::function<bool(int)> end = [](int i) { return i >= 80 && i < 140; };
  const std::function<bool(int)> across = [](int i) { return i >= 10 && i < 130; };
  const auto first = testing::driveThrough(*world_, "a.bag", 0, RigidTransform(), begin);
  const MergedMap apart = merge(*first, *testing::driveThrough(*world_, "b.bag", 1, elsewhere_, end));
  ASSERT_FALSE(apart.report.joined);
  const MergedMap joined = merge(*apart.map, *testing::driveThrough(*world_, "c.bag", 2, elsewhere_, across));
  EXPECT_TRUE(joined.report.joined) << joined.report.remark;
  for (const MapSession& session : joined.map->sessions()) {
    EXPECT_EQ(session.component, 0) << session.name;
  }
  EXPECT_LT(worstError_m(*joined.map, truthOf({begin, end, across})), 0.02);
}

TEST_F(SessionMergerTest, RefusesAnotherRig) {
  const auto first = testing::driveThrough(*world_, "a.bag", 0, RigidTransform(), even_);
  const auto errorOf = [&](const std::function<void(SparseMapContents*)>& change) {
    SparseMapContents contents = testing::driveThrough(*world_, "b.bag", 1, elsewhere_, odd_)->contents();
    change(&contents);
    try {
      merge(*first, SparseMap(std::move(contents)));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(errorOf([](SparseMapContents* contents) {
                RigidTransform& pose = *contents->rig.cameras[1].vehicle_from_camera;
                pose = RigidTransform(pose.rotation(), pose.translation() + Eigen::Vector3d(0.0, 0.1, 0.0));
              }),
              AllOf(HasSubstr("another rig"), HasSubstr("camera left is 10 cm")));
  EXPECT_THAT(errorOf([](SparseMapContents* contents) { contents->rig.cameras[0].name = "roof"; }),
              HasSubstr("camera roof, expected front"));
  EXPECT_THAT(errorOf([](SparseMapContents* contents) { contents->feature_options = "detector: other\n"; }),
              HasSubstr("features are of another kind"));
}

}  // namespace
}  // namespace vcharge
