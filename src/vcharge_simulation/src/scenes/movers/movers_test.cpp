#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include <gtest/gtest.h>

#include "scenes/catalogue_cases.h"
#include "scenes/garage/garage_layout.h"
#include "scenes/lot/lot_ground.h"
#include "scenes/lot/lot_layout.h"
#include "scenes/movers/mover_planner.h"
#include "vcharge_simulation/drive/drive_simulator.h"
#include "vcharge_simulation/drive/truth_maps.h"
#include "vcharge_simulation/objects/car_model.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {
namespace {

constexpr int kSeeds = 20;

SimulatedDrive simulate(const std::string& scene, const std::string& drive) {
  const DrivePlan plan = planDrive(scene, drive);
  return simulateDrive(plan.path, plan.motion, WheelOdometerOptions(), 1, 1, FaultOptions(),
                       plan.ground_height);
}

MoverArea areaOf(const std::string& scene) {
  return scene == "garage" ? MoverArea{kGarageArea, kGarageLanes, makeGarageLayout(1, 0).bays}
                           : MoverArea{kLotArea, Lanes(), makeLotLayout(1, 0).bays};
}

MoverOptions someOfEach(int seed) {
  MoverOptions options;
  options.people = 5;
  options.children = 2;
  options.cars = 3;
  options.bicycles = 2;
  options.seed = seed;
  return options;
}

class MoversTest : public testing::TestWithParam<std::pair<const char*, const char*>> {
 protected:
  MoversTest()
      : scene_(rendererOf(GetParam().first).scene()),
        own_car_(ownPoses(simulate(GetParam().first, GetParam().second))) {}

  std::vector<PlannedMover> plan(const MoverOptions& options) const {
    return planMovers(options, areaOf(GetParam().first), scene_, own_car_, 0.0);
  }

  const Scene& scene_;
  const OwnCar own_car_;
};

INSTANTIATE_TEST_SUITE_P(Scenes, MoversTest,
                         testing::Values(std::pair("lot", "reverse_into_bay"),
                                         std::pair("lot", "stop_and_go"), std::pair("garage", "loop"),
                                         std::pair("obstacles", "creep")));

TEST_P(MoversTest, KeepClearOfTheOwnCarOfEachOtherAndOfAllThatStands) {
  std::vector<Footprint> standing;
  for (const Obstacle& obstacle : scene_.obstacles) {
    standing.emplace_back(obstacle.footprint_m);
  }
  std::map<ObjectClass, int> planned;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const std::vector<PlannedMover> movers = plan(someOfEach(seed));
    for (double time_s = 0.0; time_s <= own_car_.duration(); time_s += 0.1) {
      std::vector<Footprint> outlines;
      for (const PlannedMover& mover : movers) {
        outlines.emplace_back(mover.stateAt(time_s).obstacle.footprint_m);
        ASSERT_GE(distanceBetween(outlines.back(), own_car_.footprintAt(time_s)), kOwnClearance_m)
            << nameOf(mover.object_class) << " " << time_s << " s, seed " << seed;
        for (size_t i = 0; i + 1 < outlines.size(); ++i) {
          ASSERT_FALSE(isNearerThan(0.3, outlines.back(), outlines[i]))
              << nameOf(mover.object_class) << " " << time_s << " s, seed " << seed;
        }
      }
    }
    for (const PlannedMover& mover : movers) {
      ++planned[mover.object_class];
      for (double time_s = 0.0; time_s <= own_car_.duration(); time_s += 0.5) {
        const Footprint outline(mover.stateAt(time_s).obstacle.footprint_m);
        for (size_t i = 0; i < standing.size(); ++i) {
          const Obstacle& obstacle = scene_.obstacles[i];
          const bool is_under = obstacle.top_z_m <= mover.ground_z_m + 1e-9;
          ASSERT_FALSE(!is_under && isNearerThan(0.03, outline, standing[i]))
              << nameOf(mover.object_class) << " meets " << obstacle.kind << " at "
              << outline.centre.transpose() << ", seed " << seed;
        }
      }
    }
  }
  for (const auto& [object_class, number] : planned) {
    RecordProperty("planned_" + nameOf(object_class), number);
  }
  EXPECT_GE(planned[ObjectClass::kAdult], 4 * kSeeds);
  EXPECT_GE(planned[ObjectClass::kChild], kSeeds);
  EXPECT_GE(planned[ObjectClass::kCar] + planned[ObjectClass::kBicycle], kSeeds);
}

TEST_P(MoversTest, PositionVelocityAndYawAreContinuous) {
  constexpr double kStep_s = 0.01;
  constexpr double kMaxAcceleration_m_per_s2 = 5.0;
  double farthest_m = 0.0;
  for (const PlannedMover& mover : plan(someOfEach(7))) {
    MoverState last = mover.stateAt(0.0);
    const Eigen::Vector3d start = last.world_from_mover.translation();
    for (double time_s = kStep_s; time_s < own_car_.duration(); time_s += kStep_s) {
      const MoverState now = mover.stateAt(time_s);
      const Eigen::Vector3d mean_m_per_s = 0.5 * (last.velocity_m_per_s + now.velocity_m_per_s);
      const RigidTransform step = last.world_from_mover.inverse() * now.world_from_mover;
      ASSERT_LT(
          (now.world_from_mover.translation() - last.world_from_mover.translation() - kStep_s * mean_m_per_s)
              .norm(),
          1e-3 * kStep_s + 0.05 * kStep_s * mean_m_per_s.norm())
          << nameOf(mover.object_class) << " " << time_s;
      ASSERT_LT((now.velocity_m_per_s - last.velocity_m_per_s).norm(), kMaxAcceleration_m_per_s2 * kStep_s)
          << nameOf(mover.object_class) << " " << time_s;
      ASSERT_LT(std::abs(yawOfRotation(step.rotation())), 3.0 * kStep_s);
      ASSERT_EQ(now.is_standing, now.velocity_m_per_s.norm() == 0.0);
      farthest_m = std::max(farthest_m, (now.world_from_mover.translation() - start).norm());
      last = now;
    }
  }
  EXPECT_GT(farthest_m, 3.0);
}

TEST_P(MoversTest, AreTheSameForTheSameSeedAndDifferForAnother) {
  const auto placesOf = [&](int seed) {
    std::vector<Eigen::Vector3d> places;
    for (const PlannedMover& mover : plan(someOfEach(seed))) {
      places.push_back(mover.stateAt(2.0).world_from_mover.translation());
    }
    return places;
  };
  EXPECT_EQ(placesOf(3), placesOf(3));
  EXPECT_NE(placesOf(3), placesOf(4));
}

/// Seeds with which someone crosses the way of the own car, which could still stop.
int countCrossings(const OwnCar& own_car) {
  int crossings = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    MoverOptions options;
    options.crossing = true;
    options.seed = seed;
    const std::vector<PlannedMover> movers =
        planMovers(options, areaOf("lot"), rendererOf("lot").scene(), own_car, 0.0);
    bool crosses = false;
    for (const PlannedMover& mover : movers) {
      for (double time_s = 0.0; time_s <= own_car.duration(); time_s += 0.1) {
        const Footprint outline(mover.stateAt(time_s).obstacle.footprint_m);
        EXPECT_GE(distanceBetween(outline, own_car.footprintAt(time_s)), kOwnClearance_m);
        // Distance that the own car drives until it would touch the person who stood still.
        double to_person_m = 0.0;
        for (double later_s = time_s; later_s < time_s + 10.0; later_s += 0.1) {
          if (isNearerThan(0.01, outline, own_car.footprintAt(later_s))) {
            const double speed = own_car.speedAt(time_s);
            EXPECT_GT(to_person_m, 0.5 * speed * speed / kStop_m_per_s2) << seed << " " << time_s;
            crosses = true;
            break;
          }
          to_person_m += 0.1 * own_car.speedAt(later_s + 0.1);
        }
      }
    }
    crossings += crosses ? 1 : 0;
  }
  return crossings;
}

TEST(CrossingTest, PersonCrossesTheWayOfTheOwnCarWhichCouldStillStop) {
  EXPECT_GE(countCrossings(OwnCar(ownPoses(simulate("lot", "loop")))), kSeeds - 2);
}

TEST(CrossingTest, PersonCrossesTheWayOfAShortDriveToo) {
  std::vector<RigidTransform> poses = ownPoses(simulate("lot", "other_day"));
  const double duration_s = OwnCar(poses).duration();
  poses.resize(static_cast<size_t>(static_cast<double>(poses.size()) * 8.0 / duration_s));
  EXPECT_GE(countCrossings(OwnCar(poses)), kSeeds - 5);
}

TEST(ApproachTest, PeopleWalkUpToTheStandingCarButDoNotTouchIt) {
  const OwnCar own_car(ownPoses(simulate("lot", "standing")));
  int planned = 0, arrivals = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    MoverOptions options;
    options.approaching = 3;
    options.seed = seed;
    for (const PlannedMover& mover :
         planMovers(options, areaOf("lot"), rendererOf("lot").scene(), own_car, 0.0)) {
      double first_m = 0.0, nearest_m = INFINITY;
      for (double time_s = 0.0; time_s <= own_car.duration(); time_s += 0.1) {
        const Footprint outline(mover.stateAt(time_s).obstacle.footprint_m);
        nearest_m = std::min(nearest_m, distanceBetween(outline, own_car.footprintAt(time_s)));
        first_m = time_s == 0.0 ? nearest_m : first_m;
      }
      EXPECT_GE(nearest_m, kApproachClearance_m) << "seed " << seed;
      EXPECT_GT(first_m, 3.0) << "seed " << seed;
      ++planned;
      arrivals += nearest_m < 1.3 ? 1 : 0;  // the fastest stop early
    }
  }
  EXPECT_GE(planned, 2 * kSeeds);
  EXPECT_GE(arrivals, 2 * kSeeds);  // others start late, or are slow
}

TEST(MoverMeshTest, IsWhereTheTruthSays) {
  SceneOptions options;
  options.image_scale = 0.3;
  options.detail = 0.25;
  options.movers = someOfEach(5);
  options.own_poses = ownPoses(simulate("lot", "stop_and_go"));
  const std::shared_ptr<const Scene> scene = buildScene("lot", options);
  std::map<ObjectClass, int> seen;
  for (const Mover& mover : scene->movers) {
    for (const double time_s : {0.0, 7.3, 20.1}) {
      const MoverState state = mover.stateAt(time_s);
      Eigen::AlignedBox3d box;  // in the mover's frame
      for (const MeshVertex& vertex : mover.meshAt(time_s).vertices) {
        box.extend(state.world_from_mover.inverse() * vertex.position.cast<double>());
      }
      const double height_m = state.obstacle.top_z_m - state.obstacle.base_z_m;
      EXPECT_NEAR(box.min().z(), 0.0, 0.03) << mover.name;
      EXPECT_NEAR(box.max().z(), height_m, 0.07) << mover.name;
      const bool is_car = mover.object_class == ObjectClass::kCar;
      EXPECT_LT(std::abs(box.center().x()), is_car ? 0.05 : 0.3) << mover.name;
      EXPECT_LT(std::abs(box.center().y()), 0.05) << mover.name;
      if (is_car || mover.object_class == ObjectClass::kBicycle) {
        const double length_m = (state.obstacle.footprint_m[1] - state.obstacle.footprint_m[0]).norm();
        EXPECT_NEAR(box.sizes().x(), length_m, 0.08) << mover.name;
      }
    }
    ++seen[mover.object_class];
  }
  EXPECT_EQ(seen.size(), 4U);

  const std::vector<TrackedObject> objects = trueObjects(scene->movers, 7.3);
  ASSERT_EQ(objects.size(), scene->movers.size());
  for (size_t i = 0; i < objects.size(); ++i) {
    const MoverState state = scene->movers[i].stateAt(7.3);
    EXPECT_EQ(objects[i].id, i + 1);
    EXPECT_EQ(objects[i].object_class, scene->movers[i].object_class);
    EXPECT_EQ(objects[i].frame_from_object.matrix(), state.world_from_mover.matrix());
    EXPECT_EQ(objects[i].velocity_m_per_s, state.velocity_m_per_s);
    EXPECT_EQ(objects[i].is_standing, state.is_standing);
    EXPECT_EQ(objects[i].footprint_m, state.obstacle.footprint_m);
    EXPECT_TRUE(objects[i].covariance.isZero());
  }
  const std::string file = testing::TempDir() + "movers_test.yaml";
  writeMovers(scene->movers, {Timestamp::fromNanoseconds(5)}, {7.3}, file);
  std::stringstream written;
  written << std::ifstream(file).rdbuf();
  for (const char* key : {"class: adult", "class: child", "class: car", "class: bicycle",
                          "velocity_m_per_s: [", "height_m: ", "is_standing: "}) {
    EXPECT_NE(written.str().find(key), std::string::npos) << key;
  }
}

TEST(MoverMeshTest, ChildrenAreSmallerThanAdults) {
  const OwnCar own_car(ownPoses(simulate("lot", "standing")));
  for (const PlannedMover& mover :
       planMovers(someOfEach(2), areaOf("lot"), rendererOf("lot").scene(), own_car, 0.0)) {
    if (mover.object_class == ObjectClass::kChild) {
      EXPECT_LT(mover.height_m, 1.4);
      EXPECT_GT(mover.height_m, 0.9);
    } else if (mover.object_class == ObjectClass::kAdult) {
      EXPECT_GT(mover.height_m, 1.55);
    }
  }
}

TEST(MoverCatalogueTest, ScenesWithoutMoversSaySo) {
  SceneOptions options;
  options.movers.people = 1;
  EXPECT_THROW(buildScene("two_levels", options), std::invalid_argument);
  EXPECT_THROW(buildScene("chessboard", options), std::invalid_argument);
}

TEST(FootprintTest, DistanceFollowsGeometry) {
  const Footprint square({{0, 0}, {2, 0}, {2, 2}, {0, 2}});
  EXPECT_DOUBLE_EQ(distanceBetween(square, Footprint({{5, 0}, {6, 0}, {6, 2}, {5, 2}})), 3.0);
  EXPECT_DOUBLE_EQ(distanceBetween(square, Footprint({{5, 6}, {6, 6}, {6, 7}, {5, 7}})), 5.0);
  EXPECT_EQ(distanceBetween(square, Footprint({{1, 1}, {6, 1}, {6, 1.5}, {1, 1.5}})), 0.0);
  EXPECT_EQ(distanceBetween(square, Footprint({{0.5, 0.5}, {1, 0.5}, {1, 1}})), 0.0);
}

}  // namespace
}  // namespace vcharge
