#include <cmath>
#include <random>

#include <opencv2/imgproc.hpp>

#include "fusion/obstacle_mapper_fixture.h"

namespace vcharge {
namespace {

constexpr int kStopTick = 200;         // after 5 m
constexpr int kStandingTicks = 15000;  // 5 minutes
constexpr int kImageTicks = 40;
constexpr double kPersonX_m = 7.0, kPersonY_m = 2.6;

/// The vehicle drives, then stands, and gets images of its left camera only.
class StandingMapperTest : public ObstacleMapperTest {
 protected:
  StandingMapperTest() {
    stops_at_ = kStopTick;
    cv::Mat pattern(rig_->cameras[1].image_size_px, CV_8UC1);
    cv::randu(pattern, 0, 255);
    cv::GaussianBlur(pattern, pattern_, cv::Size(), 2.0);
    arrive();
  }
  void arrive() {
    tick_ = kStopTick;
    start();
    drive(0, kStopTick);
    before_ = stand(200);
  }

  /// Where the left camera at rest sees a point of the ground.
  Eigen::Vector2d pixelAt(double x_m, double y_m) const {
    const RigCamera& camera = rig_->cameras[1];
    const RigidTransform camera_from_world = (poseAt(kStopTick) * *camera.vehicle_from_camera).inverse();
    Eigen::Vector2d pixel;
    EXPECT_TRUE(camera.model.project(camera_from_world * Eigen::Vector3d(x_m, y_m, 0.0), &pixel));
    return pixel;
  }
  /// The image at a tick: the light changes slowly, and the sensor has noise.
  cv::Mat imageAt(int tick) {
    cv::Mat noise(pattern_.size(), CV_16SC1), image;
    random_.fill(noise, cv::RNG::NORMAL, 0.0, 2.0);
    pattern_.convertTo(image, CV_16SC1, 1.0 + 0.3 * std::sin(tick * 2e-3));
    image += noise;
    if (flat_) {  // around the person's place
      const Eigen::Vector2d foot = pixelAt(kPersonX_m, kPersonY_m);
      cv::rectangle(image, cv::Rect(cvRound(foot.x()) - 120, cvRound(foot.y()) - 60, 240, 120),
                    cv::Scalar(90), cv::FILLED);
    }
    if (tick >= person_from_ && tick < person_until_) {
      const Eigen::Vector2d foot = pixelAt(kPersonX_m, kPersonY_m);
      const Eigen::Vector2d right = pixelAt(kPersonX_m + 0.3, kPersonY_m);
      const int width = std::abs(cvRound(right.x() - foot.x()));
      cv::rectangle(image, cv::Rect(cvRound(foot.x()) - width / 2, 0, width, cvRound(foot.y()) + width / 4),
                    cv::Scalar(20), cv::FILLED);
    }
    image.convertTo(image, CV_8UC1);
    return image;
  }
  /// The last map after standing.
  const ObstacleFrame& stand(int ticks) {
    for (const int end = tick_ + ticks; tick_ < end; ++tick_) {
      const int tick = tick_;
      VehicleOdometry odometry;
      odometry.stamp = stampAt(tick);
      odometry.odom_from_vehicle = poseAt(kStopTick);
      mapper_->addOdometry(odometry);
      if (tick % kImageTicks == 0) {
        const cv::Mat image = imageAt(tick);
        mapper_->addImage(1, stampAt(tick), static_cast<uint64_t>(tick), [image] { return image; });
      } else if (tick % 8 == 0) {  // shows that the camera is alive
        mapper_->noteImage(1, stampAt(tick), static_cast<uint64_t>(tick));
      }
      if (frames_.size() > 1) {
        frames_.erase(frames_.begin(), frames_.end() - 1);
      }
    }
    return frames_.back();
  }
  /// Range maps of all cameras besides, measured at the pose where the vehicle stands.
  void standWithRangeMaps(int ticks) {
    for (int i = 0; i < ticks; i += 4) {
      addRangeMaps(tick_ - 1, {0.01, 0.1, static_cast<uint32_t>(tick_)});
      stand(4);
    }
  }

  cv::RNG random_{7};
  cv::Mat pattern_;
  ObstacleFrame before_;
  int tick_ = kStopTick, person_from_ = 0, person_until_ = 0;
  bool flat_ = false;
};

TEST_F(StandingMapperTest, FiveMinutesWithoutChangeLoseNothing) {
  const ObstacleFrame& after = stand(kStandingTicks);
  EXPECT_GT(toSeconds(after.map.stamp - before_.map.stamp), 298.0);
  EXPECT_GT(count(before_, kCellFree), 1000);
  EXPECT_EQ(count(after, kCellFree), count(before_, kCellFree));
  EXPECT_EQ(count(after, kCellOccupied), count(before_, kCellOccupied));
}

TEST_F(StandingMapperTest, WhereSomebodyStandsIsUnknownUntilHeHasLeft) {
  person_from_ = kStopTick + 400;
  person_until_ = kStopTick + 2000;
  ASSERT_EQ(stateAt(before_, kPersonX_m, kPersonY_m), kCellFree);
  EXPECT_EQ(stateAt(stand(180), kPersonX_m, kPersonY_m), kCellFree);
  for (int i = 0; i < 16; ++i) {  // also when the images of some seconds show no change
    const ObstacleFrame& during = stand(100);
    EXPECT_EQ(stateAt(during, kPersonX_m, kPersonY_m), kCellUnobserved) << i;
    EXPECT_GT(count(during, kCellFree), 8 * count(before_, kCellFree) / 10);
  }
  const ObstacleFrame& after = stand(400);
  EXPECT_EQ(stateAt(after, kPersonX_m, kPersonY_m), kCellFree);
  EXPECT_GT(count(after, kCellFree), 98 * count(before_, kCellFree) / 100);
  EXPECT_EQ(newlyFree(before_, after, -100.0), 0);
  EXPECT_EQ(count(after, kCellOccupied), count(before_, kCellOccupied));
}

TEST_F(StandingMapperTest, WhereSomebodyStoodAtFirstStaysUnknown) {
  person_from_ = 0;
  person_until_ = kStopTick + 400;
  arrive();
  stand(200);
  EXPECT_EQ(stateAt(stand(60), kPersonX_m, kPersonY_m), kCellUnobserved);  // he leaves
  EXPECT_EQ(stateAt(stand(1000), kPersonX_m, kPersonY_m), kCellUnobserved);
}

TEST_F(StandingMapperTest, GroundWithoutTextureStaysUnknownOnceItHasChanged) {
  flat_ = true;
  arrive();
  ASSERT_EQ(stateAt(before_, kPersonX_m, kPersonY_m), kCellFree);
  person_from_ = kStopTick + 400;
  person_until_ = kStopTick + 600;
  EXPECT_EQ(stateAt(stand(400), kPersonX_m, kPersonY_m), kCellUnobserved);
  EXPECT_EQ(stateAt(stand(1000), kPersonX_m, kPersonY_m), kCellUnobserved);
}

TEST_F(StandingMapperTest, WhatTheNextDriveLeftUnknownIsNotRestored) {
  person_from_ = kStopTick + 400;
  person_until_ = kStopTick + 600;
  EXPECT_EQ(stateAt(stand(300), kPersonX_m, kPersonY_m), kCellUnobserved);
  for (int i = 0; i < 10; ++i, ++tick_) {  // moves a little, and nothing is measured
    VehicleOdometry odometry;
    odometry.stamp = stampAt(tick_);
    odometry.odom_from_vehicle = poseAt(kStopTick);
    odometry.forward_speed_m_per_s = 0.1;
    mapper_->addOdometry(odometry);
    mapper_->addImage(1, stampAt(tick_), static_cast<uint64_t>(tick_), [this] { return imageAt(tick_); });
  }
  EXPECT_EQ(stateAt(stand(1000), kPersonX_m, kPersonY_m), kCellUnobserved);
}

TEST_F(StandingMapperTest, RangeMapsAtRestShowWhatCameAndThatItLeft) {
  ASSERT_EQ(stateAt(before_, kPersonX_m, kPersonY_m), kCellFree);
  world_.boxes.push_back({{kPersonX_m - 0.2, kPersonY_m, 0.0}, {kPersonX_m + 0.2, kPersonY_m + 0.4, 1.7}});
  standWithRangeMaps(40);
  EXPECT_EQ(stateAt(frames_.back(), kPersonX_m, kPersonY_m + 0.05), kCellOccupied);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kStanding);
  EXPECT_NE(statusOf("left").message.find("only the overlap of cameras is measured"), std::string::npos);
  world_.boxes.pop_back();
  standWithRangeMaps(100);
  EXPECT_EQ(stateAt(frames_.back(), kPersonX_m, kPersonY_m + 0.05), kCellFree);
}

TEST_F(StandingMapperTest, FiveMinutesOfRangeMapsAtRestLoseNothing) {
  for (int minute = 0; minute < 5; ++minute) {
    standWithRangeMaps(100);
    stand(kStandingTicks / 5 - 100);
  }
  const ObstacleFrame& after = frames_.back();
  EXPECT_GE(count(after, kCellFree), 98 * count(before_, kCellFree) / 100);
  EXPECT_EQ(newlyFree(before_, after, -100.0), 0);
  EXPECT_GE(count(after, kCellOccupied), count(before_, kCellOccupied));
}

}  // namespace
}  // namespace vcharge
