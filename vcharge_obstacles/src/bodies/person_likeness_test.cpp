#include "bodies/person_likeness.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "objects/moving_world.h"

namespace vcharge {
namespace {

constexpr double kCameraHeight_m = 0.8, kRange_m = 4.0;

class PersonLikenessTest : public testing::Test {
 protected:
  PersonLikenessTest()
      : camera_(makeFrontRig(kCameraHeight_m).cameras.front()),
        panorama_(camera_),
        image_(panorama_.validMask().size(), CV_8UC1, cv::Scalar(150)) {}

  cv::Point at(double across_m, double height_m) const {
    return {cvRound(panorama_.columnOf(0.0) + across_m / kRange_m / panorama_.pixel_rad()),
            cvRound(panorama_.rowOf((height_m - kCameraHeight_m) / kRange_m))};
  }
  void limb(double x0, double z0, double x1, double z1, double width_m) {
    cv::line(image_, at(x0, z0), at(x1, z1), cv::Scalar(40),
             std::max(1, cvRound(width_m / kRange_m / panorama_.pixel_rad())), cv::LINE_AA);
  }
  void drawPerson(double x) {
    limb(x, 1.62, x, 1.60, 0.2);
    limb(x, 1.35, x, 0.9, 0.36);
    limb(x - 0.25, 1.35, x - 0.3, 0.85, 0.1);
    limb(x + 0.25, 1.35, x + 0.3, 0.85, 0.1);
    limb(x - 0.09, 0.8, x - 0.15, 0.08, 0.14);
    limb(x + 0.09, 0.8, x + 0.15, 0.08, 0.14);
  }
  std::optional<PersonMatch> find(double azimuth_rad = 0.0, double range_m = kRange_m) const {
    return PersonLikeness().find(panorama_, image_, {azimuth_rad, range_m}, kCameraHeight_m);
  }

  const RigCamera camera_;
  const Panorama panorama_;
  cv::Mat image_;
};

TEST_F(PersonLikenessTest, AFigureIsMoreLikeAPersonThanAPostOrNothing) {
  const double nothing = find()->score;
  drawPerson(0.0);
  const double person = find()->score;
  image_.setTo(150);
  limb(0.0, 1.7, 0.0, 0.0, 0.4);
  const double post = find()->score;
  EXPECT_GT(person, nothing + 0.5);
  EXPECT_GT(person, post + 0.3);
}

TEST_F(PersonLikenessTest, ShiftTellsWhereThePersonIs) {
  drawPerson(0.3);  // to the right
  const std::optional<PersonMatch> found = find();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->shift_rad, -0.3 / kRange_m, 0.12 / kRange_m);
}

TEST_F(PersonLikenessTest, NothingIsFoundTooNearTooFarOrOutsideTheView) {
  EXPECT_FALSE(find(0.0, 0.5));
  EXPECT_FALSE(find(0.0, 20.0));
  EXPECT_FALSE(find(3.0));
}

}  // namespace
}  // namespace vcharge
