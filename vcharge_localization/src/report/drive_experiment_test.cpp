#include "vcharge_localization/drive_experiment.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

ImageFrame frameAt(double seconds, double x_m) {
  ImageFrame frame;
  frame.stamp = Timestamp::fromNanoseconds(5'000'000'000LL + static_cast<int64_t>(seconds * 1e9));
  frame.images.assign(3, {cv::Mat(8, 8, CV_8UC1, cv::Scalar(90)), nullptr});
  frame.odom_from_vehicle = RigidTransform::planar(x_m, 1.0, 0.0);
  return frame;
}

TEST(DriveExperimentTest, ChangesNothingByDefault) {
  DriveExperiment experiment{DriveExperimentOptions()};
  ImageFrame frame = frameAt(0.0, 3.0);
  EXPECT_TRUE(experiment.apply(&frame));
  EXPECT_EQ(frame.images[2].pixels.at<uchar>(0, 0), 90);
  EXPECT_EQ(frame.odom_from_vehicle->translation().x(), 3.0);
}

TEST(DriveExperimentTest, UsesSomeCamerasAndCoversThem) {
  DriveExperimentOptions options;
  options.cameras = {0, 2};
  options.cover_s = {1.0, 2.0};
  DriveExperiment experiment(options);
  for (const double time_s : {0.0, 1.5, 2.0}) {
    ImageFrame frame = frameAt(time_s, 0.0);
    EXPECT_TRUE(experiment.apply(&frame));
    EXPECT_TRUE(frame.images[1].pixels.empty());
    EXPECT_EQ(frame.images[2].pixels.at<uchar>(3, 3), time_s == 1.5 ? 4 : 90);
  }
}

TEST(DriveExperimentTest, CarriesTheVehicleAwayUnseenByItsOdometer) {
  DriveExperimentOptions options;
  options.carry_s = {1.0, 3.0};
  DriveExperiment experiment(options);
  const auto shownAt = [&](double time_s, double x_m) -> std::optional<double> {
    ImageFrame frame = frameAt(time_s, x_m);
    return experiment.apply(&frame) ? std::make_optional(frame.odom_from_vehicle->translation().x())
                                    : std::nullopt;
  };
  EXPECT_EQ(shownAt(0.0, 10.0), 10.0);
  EXPECT_EQ(shownAt(0.9, 11.0), 11.0);
  EXPECT_EQ(shownAt(1.0, 11.2), std::nullopt);
  EXPECT_EQ(shownAt(2.9, 14.0), std::nullopt);
  EXPECT_EQ(shownAt(3.0, 14.5), 11.0);
  EXPECT_EQ(shownAt(3.1, 15.0), 11.5);
}

}  // namespace
}  // namespace vcharge
