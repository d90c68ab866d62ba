#include "vcharge_localization/drive_localizer.h"

#include <cmath>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/sparse_map/map_tile.h"
#include "vcharge_reconstruction/testing/test_map.h"

namespace vcharge {
namespace {

constexpr double kPeriod_s = 0.08;
constexpr double kStep_m = 0.2;
constexpr double kRadius_m = 20.0;  // radius of the test map's circle

/// A drive along the test map's circle with an odometer that measures 1 % too much.
class DriveLocalizerTest : public ::testing::Test {
 protected:
  RigidTransform truthAt(double way_m) const {
    const double angle = way_m / kRadius_m;
    return RigidTransform::planar(kRadius_m * std::sin(angle), kRadius_m * (1.0 - std::cos(angle)), angle);
  }
  RigFeatures viewAt(double way_m) const {
    testing::TestViewOptions view;
    view.seed = static_cast<uint32_t>(1000.0 * way_m) + 1;
    return testing::makeTestView(*map_, truthAt(way_m), view);
  }
  static RigFeatures darkness() {
    RigFeatures features;
    features.images.resize(2);
    features.rays_in_camera.resize(2);
    return features;
  }
  /// The next frame, `way_m` further along the circle; the odometer measures one step.
  LocalizationResult next(double way_m, const RigFeatures& features) {
    return next(&localizer_, way_m, features);
  }
  LocalizationResult next(DriveLocalizer* localizer, double way_m, const RigFeatures& features) {
    ImageFrame frame;
    frame.stamp = Timestamp::fromNanoseconds(1'000'000'000'000LL + 80'000'000LL * num_frames_++);
    frame.images.resize(2);
    odom_from_vehicle_ =
        odom_from_vehicle_ * RigidTransform::planar(1.01 * kStep_m, 0.0, kStep_m / kRadius_m);
    if (has_odometry_) {
      frame.odom_from_vehicle = odom_from_vehicle_;
    }
    frame.num_resets = num_resets_;
    const LocalizationResult result = localizer->process(frame, features);
    error_m_ = result.pose
                   ? (result.pose->map_from_vehicle.translation() - truthAt(way_m).translation()).norm()
                   : INFINITY;
    return result;
  }
  LocalizationResult drive(int num_frames) {
    LocalizationResult result;
    for (int i = 0; i < num_frames; ++i) {
      way_m_ += kStep_m;
      result = next(way_m_, viewAt(way_m_));
    }
    return result;
  }

  const std::shared_ptr<const SparseMap> map_ = testing::makeTestMap({});
  DriveLocalizer localizer_{std::make_shared<const TiledMap>(map_),
                            std::shared_ptr<const CameraRig>(map_, &map_->rig())};
  RigidTransform odom_from_vehicle_ = RigidTransform::planar(7.0, -3.0, 1.0);
  double way_m_ = 5.0;
  int64_t num_frames_ = 0, num_resets_ = 0;
  bool has_odometry_ = true;
  double error_m_ = INFINITY;
};

TEST_F(DriveLocalizerTest, ACameraThatMovedIsLeftOut) {
  drive(3);
  RigCondition condition(2);
  condition[0].has_moved = true;
  localizer_.setCondition(condition);
  const Eigen::Matrix3d knock = rotationFromVector({0.0, 0.0, 0.02}).toRotationMatrix();
  for (int i = 0; i < 10; ++i) {
    way_m_ += kStep_m;
    RigFeatures features = viewAt(way_m_);
    features.rays_in_camera[0] = knock * features.rays_in_camera[0];
    const LocalizationResult result = next(way_m_, features);
    ASSERT_EQ(result.status, LocalizationStatus::kLocalized);
    EXPECT_EQ(result.fix.inliers_of_camera[0], 0);
    EXPECT_GT(result.fix.inliers_of_camera[1], 0);
    EXPECT_LT(error_m_, 0.04);
    ASSERT_EQ(result.camera_warnings.size(), 1u);
  }
}

TEST_F(DriveLocalizerTest, StartsFromNothingOnceTwoFramesAgree) {
  const LocalizationResult first = drive(1);
  EXPECT_EQ(first.status, LocalizationStatus::kLost);
  EXPECT_FALSE(first.pose.has_value());
  EXPECT_TRUE(std::isinf(first.since_fix_s));
  const LocalizationResult second = drive(1);
  ASSERT_EQ(second.status, LocalizationStatus::kLocalized);
  // The error of a single fix exceeds its covariance; later ones are averaged.
  EXPECT_GT(second.pose->covariance(0, 0), 2.9 * second.fix.covariance(0, 0));
  for (int i = 0; i < 40; ++i) {
    const LocalizationResult result = drive(1);
    EXPECT_EQ(result.status, LocalizationStatus::kLocalized);
    EXPECT_FALSE(result.searched_whole_map);
    EXPECT_EQ(result.since_fix_s, 0.0);
    EXPECT_LT(error_m_, 0.03);
  }
}

TEST_F(DriveLocalizerTest, BridgesDarknessAsWellAsItsCovarianceTells) {
  drive(80);
  for (int i = 0; i < 125; ++i) {  // 10 s, 25 m
    way_m_ += kStep_m;
    const LocalizationResult result = next(way_m_, darkness());
    ASSERT_EQ(result.status, LocalizationStatus::kBridgedByOdometry);
    EXPECT_NEAR(result.since_fix_s, (i + 1) * kPeriod_s, 1e-6);
    EXPECT_LT(error_m_, 3.5 * std::sqrt(result.pose->covariance.topLeftCorner<2, 2>().trace()));
  }
  EXPECT_LT(error_m_, 0.2);
  EXPECT_EQ(drive(1).status, LocalizationStatus::kLocalized);
}

TEST_F(DriveLocalizerTest, GoesOnInAnotherVersionOfTheMap) {
  drive(40);
  DriveLocalizer newer(std::make_shared<const TiledMap>(map_),
                       std::shared_ptr<const CameraRig>(map_, &map_->rig()));
  newer.continueFrom(localizer_);
  way_m_ += kStep_m;
  const LocalizationResult result = next(&newer, way_m_, viewAt(way_m_));
  EXPECT_EQ(result.status, LocalizationStatus::kLocalized);
  EXPECT_FALSE(result.searched_whole_map);
  EXPECT_LT(error_m_, 0.03);
  DriveLocalizer fresh(std::make_shared<const TiledMap>(map_),
                       std::shared_ptr<const CameraRig>(map_, &map_->rig()));
  newer.continueFrom(fresh);  // nothing to take over
  way_m_ += kStep_m;
  EXPECT_EQ(next(&newer, way_m_, viewAt(way_m_)).status, LocalizationStatus::kLocalized);
  auto one_camera = std::make_shared<CameraRig>(map_->rig());
  one_camera->cameras.pop_back();
  DriveLocalizer other(std::make_shared<const TiledMap>(map_), one_camera);
  EXPECT_THROW(other.continueFrom(localizer_), InputError);
}

TEST_F(DriveLocalizerTest, FindsAVehicleThatWasCarriedAway) {
  drive(40);
  way_m_ += 40.0;
  int frames = 0;
  LocalizationResult result;
  do {
    result = drive(1);
    ++frames;
    if (result.status == LocalizationStatus::kLocalized) {
      EXPECT_LT(error_m_, 0.1) << "never a wrong pose";
    }
  } while (result.status != LocalizationStatus::kLocalized && frames < 50);
  EXPECT_LT(frames * kPeriod_s, 1.0);
}

TEST_F(DriveLocalizerTest, AnUnmappedPlaceIsNeverLocalized) {
  for (int i = 0; i < 20; ++i) {
    const LocalizationResult result = next(0.0, testing::makeForeignView(*map_, 50 + i));
    EXPECT_NE(result.status, LocalizationStatus::kLocalized);
    EXPECT_FALSE(result.pose.has_value());
  }
}

TEST_F(DriveLocalizerTest, GetsLostInTheEndWithoutImages) {
  drive(20);
  LocalizationResult result;
  int frames = 0;
  do {
    way_m_ += kStep_m;
    result = next(way_m_, darkness());
    ++frames;
  } while (result.status == LocalizationStatus::kBridgedByOdometry && frames < 20000);
  EXPECT_GT(frames * kStep_m, 20.0);
  EXPECT_NE(result.status, LocalizationStatus::kLocalized);
  EXPECT_FALSE(result.pose.has_value());
}

TEST_F(DriveLocalizerTest, GoesOnAfterAResetOfTheOdometerAndWithoutOne) {
  drive(30);
  odom_from_vehicle_ = RigidTransform();
  ++num_resets_;
  drive(3);
  EXPECT_EQ(drive(1).status, LocalizationStatus::kLocalized);
  EXPECT_LT(error_m_, 0.05);
  has_odometry_ = false;
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(drive(1).status, LocalizationStatus::kLocalized);
    EXPECT_LT(error_m_, 0.1);
  }
}

TEST_F(DriveLocalizerTest, TakesASeedAndChecksIt) {
  PosePrior prior;
  prior.map_from_vehicle = truthAt(way_m_) * RigidTransform::planar(0.2, -0.2, 0.03);
  prior.covariance.diagonal() << 0.1, 0.1, 0.001, 1e-5, 1e-5, 0.002;
  localizer_.seed(prior);
  const LocalizationResult result = drive(1);
  EXPECT_EQ(result.status, LocalizationStatus::kLocalized);
  EXPECT_FALSE(result.searched_whole_map);
  EXPECT_LT(error_m_, 0.05);
}

TEST_F(DriveLocalizerTest, TakesASeedThatIsLessCertainThanALostPose) {
  PosePrior prior;
  prior.map_from_vehicle = truthAt(way_m_) * RigidTransform::planar(0.3, -0.2, 0.03);
  prior.covariance.diagonal() << 0.25, 0.25, 0.25, 7e-4, 7e-4, 0.07;  // covariance sent by rviz
  localizer_.seed(prior);
  const LocalizationResult result = drive(1);
  EXPECT_EQ(result.status, LocalizationStatus::kLocalized);
  EXPECT_FALSE(result.searched_whole_map);
  EXPECT_LT(error_m_, 0.05);
}

TEST_F(DriveLocalizerTest, AWrongSeedIsNoPoseAndTheVehicleIsFoundElsewhere) {
  PosePrior prior;
  prior.map_from_vehicle = RigidTransform::planar(300.0, 0.0, 0.0);
  prior.covariance.diagonal() << 0.25, 0.25, 0.25, 7e-4, 7e-4, 0.07;
  localizer_.seed(prior);
  const int max_frames = DriveLocalizerOptions().max_frames_without_fix + 1;
  LocalizationResult result;
  for (int i = 0; i < max_frames; ++i) {
    result = drive(1);
    EXPECT_TRUE(!result.pose || error_m_ < 0.05) << "frame " << i;
  }
  EXPECT_EQ(result.status, LocalizationStatus::kLocalized);
}

TEST_F(DriveLocalizerTest, AReplayThatStartsOverStartsFromNothing) {
  drive(10);
  num_frames_ = 0;
  way_m_ = 30.0;
  const LocalizationResult result = drive(1);
  EXPECT_EQ(result.status, LocalizationStatus::kLost);
  EXPECT_EQ(drive(1).status, LocalizationStatus::kLocalized);
}

/// A map of a car park on two levels that look alike; of the second, only the first part was mapped.
class AlikeLevelsTest : public DriveLocalizerTest {
 protected:
  static std::shared_ptr<const TiledMap> makeLevels() {
    testing::TestMapOptions options;
    options.twin_offset_m = 100.0;
    const auto map = testing::makeTestMap(options);
    std::vector<size_t> kept;
    for (size_t i = 0; i < map->keyframes().size() - map->keyframes().size() / 4; ++i) {
      kept.push_back(i);
    }
    return std::make_shared<const TiledMap>(partOf(*map, kept));
  }

  DriveLocalizer in_levels_{makeLevels(), std::shared_ptr<const CameraRig>(map_, &map_->rig())};
};

TEST_F(AlikeLevelsTest, NoPoseIsGivenUntilOnePlaceRemains) {
  int num_ambiguous = 0, num_localized = 0;
  while (way_m_ < 2.0 * 3.14159 * kRadius_m - 8.0) {
    way_m_ += kStep_m;
    ImageFrame frame;
    frame.stamp = Timestamp::fromNanoseconds(1'000'000'000'000LL + 80'000'000LL * num_frames_++);
    frame.images.resize(2);
    odom_from_vehicle_ = odom_from_vehicle_ * RigidTransform::planar(kStep_m, 0.0, kStep_m / kRadius_m);
    frame.odom_from_vehicle = odom_from_vehicle_;
    const LocalizationResult result = in_levels_.process(frame, viewAt(way_m_));
    if (result.pose) {
      ++num_localized;
      EXPECT_LT((result.pose->map_from_vehicle.translation() - truthAt(way_m_).translation()).norm(), 0.1);
    } else if (result.status == LocalizationStatus::kAmbiguous) {
      ++num_ambiguous;
      EXPECT_EQ(num_localized, 0) << "later there is one place";
      EXPECT_EQ(result.message, "2 places of the map look alike");
    }
  }
  EXPECT_GT(num_ambiguous, 100);
  EXPECT_GT(num_localized, 50);
}

}  // namespace
}  // namespace vcharge
