#include "vcharge_recordings/drive_check.h"

#include <cmath>
#include <functional>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "testing/weaving_drive.h"

namespace vcharge {
namespace {

using namespace weaving_drive;

/// A drive, and the faults that are added before it is checked.
struct Drive {
  CameraRig rig = twoCameras();
  /// Returns false for an image that was lost.
  std::function<bool(size_t camera, int frame, Timestamp* stamp, cv::Mat* pixels)> change_image =
      [](size_t, int, Timestamp*, cv::Mat*) { return true; };
  std::function<bool(VehicleOdometry*)> change_odometry = [](VehicleOdometry*) { return true; };
};

class DriveCheckerTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    images_ = new std::vector<std::vector<cv::Mat>>(renderImages());
    poses_ = new std::vector<RigidTransform>;
    for (int i = 0; i < 4 * kFrames; ++i) {
      poses_->push_back(worldFromVehicle(0.25 * kPeriod_s * i));
    }
  }
  static void TearDownTestSuite() {
    delete images_;
    delete poses_;
  }

  static std::vector<CheckFinding> check(const Drive& drive) {
    DriveChecker checker(std::make_shared<const CameraRig>(drive.rig));
    for (int i = 0; i < 4 * kFrames; ++i) {
      const Timestamp instant = kStart + durationFromSeconds(0.25 * kPeriod_s * i);
      VehicleOdometry odometry;
      odometry.stamp = instant;
      odometry.odom_from_vehicle = (*poses_)[static_cast<size_t>(i)];
      if (drive.change_odometry(&odometry)) {
        checker.addOdometry(instant, odometry);
      }
      for (size_t camera = 0; camera < 2 && i % 4 == 0; ++camera) {
        Timestamp stamp = instant;
        cv::Mat pixels = (*images_)[camera][static_cast<size_t>(i / 4)].clone();
        if (drive.change_image(camera, i / 4, &stamp, &pixels)) {
          checker.addImage(camera, stamp, instant + durationFromSeconds(0.01), {pixels, nullptr});
        }
      }
    }
    return checker.findings();
  }

  static std::vector<std::vector<cv::Mat>>* images_;
  static std::vector<RigidTransform>* poses_;
};

std::vector<std::vector<cv::Mat>>* DriveCheckerTest::images_ = nullptr;
std::vector<RigidTransform>* DriveCheckerTest::poses_ = nullptr;

/// The findings that did not pass, in order, for example "WARN left: rate; FAIL sync".
std::string notPassed(const std::vector<CheckFinding>& findings) {
  std::string text;
  for (const CheckFinding& finding : findings) {
    if (finding.grade != CheckGrade::kPass) {
      text += (text.empty() ? "" : "; ") + std::string(toString(finding.grade)) + " " + finding.subject;
    }
  }
  return text;
}

std::string whatOf(const std::vector<CheckFinding>& findings, const std::string& subject) {
  for (const CheckFinding& finding : findings) {
    if (finding.subject == subject) {
      return finding.what;
    }
  }
  return "no finding of " + subject;
}

TEST_F(DriveCheckerTest, PassesAHealthyDrive) {
  const std::vector<CheckFinding> findings = check(Drive());
  EXPECT_EQ(notPassed(findings), "");
  EXPECT_EQ(worstGrade(findings), CheckGrade::kPass);
  // No comparison was skipped.
  for (const char* subject : {"images and odometry: turns", "images and odometry: time", "left: direction",
                              "right: vertical", "left: mask", "sync"}) {
    EXPECT_EQ(whatOf(findings, subject).find("no finding"), std::string::npos) << subject;
  }
}

TEST_F(DriveCheckerTest, NeedsNoExtrinsics) {
  Drive drive;
  for (RigCamera& camera : drive.rig.cameras) {
    camera.vehicle_from_camera.reset();
  }
  const std::vector<CheckFinding> findings = check(drive);
  EXPECT_EQ(notPassed(findings), "");
  EXPECT_EQ(whatOf(findings, "images and odometry: turns").find("no finding"), std::string::npos);
}

TEST_F(DriveCheckerTest, MeasuresHowLateTheOdometryIs) {
  for (const double late_s : {-0.1, 0.06}) {
    Drive drive;
    drive.change_odometry = [&](VehicleOdometry* odometry) {
      odometry->stamp = odometry->stamp + durationFromSeconds(late_s);
      return true;
    };
    const std::vector<CheckFinding> findings = check(drive);
    EXPECT_EQ(notPassed(findings).find("FAIL images and odometry: time") == std::string::npos, false)
        << notPassed(findings);
    const std::string what = whatOf(findings, "images and odometry: time");
    double found_ms = 0.0;
    ASSERT_EQ(std::sscanf(what.c_str(), "the odometry's stamps are %lf ms", &found_ms), 1) << what;
    EXPECT_NEAR(found_ms, 1e3 * late_s, 5.0);
  }
}

TEST_F(DriveCheckerTest, TellsWhichCameraHasAnotherClock) {
  Drive drive;
  drive.rig.stamp_tolerance_s = 0.04;
  drive.change_image = [](size_t camera, int, Timestamp* stamp, cv::Mat*) {
    *stamp = *stamp + durationFromSeconds(camera == 1 ? -0.03 : 0.0);
    return true;
  };
  const std::vector<CheckFinding> findings = check(drive);
  EXPECT_NE(notPassed(findings).find("WARN right: time"), std::string::npos) << notPassed(findings);
  drive.rig.cameras[1].timing.clock_offset_s = 0.03;
  EXPECT_EQ(notPassed(check(drive)), "");
}

TEST_F(DriveCheckerTest, FindsOdometryThatTurnsOtherwise) {
  Drive drive;
  double factor = -1.0;
  drive.change_odometry = [&](VehicleOdometry* odometry) {
    const double yaw = factor * yawOfRotation(odometry->odom_from_vehicle.rotation());
    odometry->odom_from_vehicle =
        RigidTransform(rotationFromYawPitchRoll(yaw, 0.0, 0.0), odometry->odom_from_vehicle.translation());
    return true;
  };
  EXPECT_NE(notPassed(check(drive)).find("FAIL images and odometry: turns"), std::string::npos);
  factor = 1.15;
  EXPECT_NE(notPassed(check(drive)).find("WARN images and odometry: turns"), std::string::npos);
}

TEST_F(DriveCheckerTest, FindsOdometryThatStandsWhileTheImagesMove) {
  Drive drive;
  drive.change_odometry = [](VehicleOdometry* odometry) {
    odometry->odom_from_vehicle = RigidTransform();
    return true;
  };
  const std::string found = notPassed(check(drive));
  EXPECT_NE(found.find("FAIL motion"), std::string::npos) << found;
  EXPECT_NE(found.find("FAIL images and odometry: standing"), std::string::npos) << found;
}

TEST_F(DriveCheckerTest, FindsOdometryThatIsCoarseSidewaysOrEndsEarly) {
  Drive drive;
  drive.change_odometry = [](VehicleOdometry* odometry) {
    const double tick_rad = 0.02, yaw = yawOfRotation(odometry->odom_from_vehicle.rotation());
    odometry->odom_from_vehicle =
        RigidTransform(rotationFromYawPitchRoll(tick_rad * std::floor(yaw / tick_rad), 0.0, 0.0),
                       odometry->odom_from_vehicle.translation());
    return true;
  };
  std::string found = notPassed(check(drive));
  EXPECT_NE(found.find("odometry: yaw resolution"), std::string::npos) << found;

  drive.change_odometry = [](VehicleOdometry* odometry) {
    odometry->odom_from_vehicle = odometry->odom_from_vehicle * RigidTransform::planar(0.0, 0.0, 1.5708);
    return true;
  };
  found = notPassed(check(drive));
  EXPECT_NE(found.find("FAIL odometry: sideways"), std::string::npos) << found;

  drive.change_odometry = [](VehicleOdometry* odometry) {
    return odometry->stamp < kStart + durationFromSeconds(0.5 * kFrames * kPeriod_s);
  };
  found = notPassed(check(drive));
  EXPECT_NE(found.find("FAIL odometry: coverage"), std::string::npos) << found;

  drive.change_odometry = [](VehicleOdometry*) { return false; };
  EXPECT_EQ(notPassed(check(drive)), "FAIL odometry");
}

TEST_F(DriveCheckerTest, FindsStampsThatDifferAndImagesThatAreLost) {
  Drive drive;
  drive.change_image = [](size_t camera, int, Timestamp* stamp, cv::Mat*) {
    *stamp = *stamp + durationFromSeconds(camera == 1 ? 0.005 : 0.0);
    return true;
  };
  EXPECT_EQ(notPassed(check(drive)), "FAIL sync");
  drive.rig.stamp_tolerance_s = 0.01;
  EXPECT_EQ(notPassed(check(drive)), "");
  drive.rig.stamp_tolerance_s = 0.0;

  drive.change_image = [](size_t camera, int frame, Timestamp*, cv::Mat*) {
    return camera == 0 || frame % 15 != 3;
  };
  EXPECT_EQ(notPassed(check(drive)), "WARN right: rate; WARN sync");

  drive.change_image = [](size_t camera, int frame, Timestamp*, cv::Mat*) {
    return camera == 0 || frame < 60 || frame > 95;
  };
  EXPECT_EQ(notPassed(check(drive)), "FAIL right: rate; WARN sync");

  drive.change_image = [](size_t camera, int, Timestamp*, cv::Mat*) { return camera == 0; };
  EXPECT_EQ(notPassed(check(drive)), "FAIL right");

  drive.change_image = [](size_t camera, int frame, Timestamp* stamp, cv::Mat*) {
    if (camera == 1 && frame == 50) {
      *stamp = kStart;
    }
    return true;
  };
  const std::string found = notPassed(check(drive));
  EXPECT_NE(found.find("WARN right: stamp order"), std::string::npos) << found;
}

TEST_F(DriveCheckerTest, FindsBadExposureAndFrozenImages) {
  Drive drive;
  drive.change_image = [](size_t camera, int, Timestamp*, cv::Mat* pixels) {
    if (camera == 0) {
      *pixels *= 0.02;
    }
    return true;
  };
  EXPECT_NE(notPassed(check(drive)).find("FAIL left: exposure"), std::string::npos);

  drive.change_image = [](size_t camera, int, Timestamp*, cv::Mat* pixels) {
    if (camera == 0) {
      *pixels *= 2.5;
    }
    return true;
  };
  EXPECT_NE(notPassed(check(drive)).find("left: exposure"), std::string::npos);

  drive.change_image = [](size_t camera, int frame, Timestamp*, cv::Mat* pixels) {
    if (camera == 0) {
      *pixels *= frame < 70 ? 1.0 : 0.5;
    }
    return true;
  };
  EXPECT_NE(notPassed(check(drive)).find("WARN left: exposure"), std::string::npos);

  drive.change_image = [](size_t camera, int frame, Timestamp*, cv::Mat* pixels) {
    if (camera == 1 && frame > 80) {
      *pixels = (*images_)[1][80].clone();
    }
    return true;
  };
  const std::string found = notPassed(check(drive));
  EXPECT_NE(found.find("FAIL right: frozen"), std::string::npos) << found;
  EXPECT_EQ(found.find("left: "), std::string::npos) << found;
}

TEST_F(DriveCheckerTest, FindsTheVehicleInImagesUnlessAMaskHidesIt) {
  // The bonnet: stripes at the lower edge of the image.
  Drive drive;
  drive.change_image = [](size_t camera, int, Timestamp*, cv::Mat* pixels) {
    for (int y = 150; camera == 0 && y < pixels->rows; ++y) {
      for (int x = 0; x < pixels->cols; ++x) {
        pixels->at<uint8_t>(y, x) =
            cv::saturate_cast<uint8_t>(60 + 60 * ((x / 6 + y / 9) % 2) + pixels->at<uint8_t>(y, x) % 3);
      }
    }
    return true;
  };
  const std::string found = notPassed(check(drive));
  EXPECT_NE(found.find("left: mask"), std::string::npos) << found;
  EXPECT_EQ(found.find("right: mask"), std::string::npos) << found;

  drive.rig.cameras[0].mask = cv::Mat(200, 320, CV_8UC1, cv::Scalar(255));
  drive.rig.cameras[0].mask.rowRange(148, 200) = 0;
  EXPECT_EQ(notPassed(check(drive)), "");
}

TEST_F(DriveCheckerTest, FindsSwappedCamerasByTheirDirection) {
  Drive drive;
  std::swap(drive.rig.cameras[0].vehicle_from_camera, drive.rig.cameras[1].vehicle_from_camera);
  EXPECT_EQ(notPassed(check(drive)), "FAIL left: direction; FAIL right: direction");
}

TEST_F(DriveCheckerTest, NamesImagesOfAnotherSizeAndMessagesThatAreBroken) {
  Drive drive;
  drive.change_image = [](size_t camera, int, Timestamp*, cv::Mat* pixels) {
    if (camera == 1) {
      cv::resize(*pixels, *pixels, cv::Size(160, 100));
    }
    return true;
  };
  const std::vector<CheckFinding> findings = check(drive);
  EXPECT_EQ(notPassed(findings), "FAIL right: size");
  EXPECT_EQ(whatOf(findings, "right: size"), "130 of 130 images are 160x100; the rig says 320x200");

  DriveChecker checker(std::make_shared<const CameraRig>(twoCameras()));
  checker.addBroken("/camera/left/image_raw", "x.bag: no image");
  checker.addBroken("/camera/left/image_raw", "x.bag: no image either");
  const std::vector<CheckFinding> broken = checker.findings();
  EXPECT_EQ(notPassed(broken), "FAIL /camera/left/image_raw; FAIL left; FAIL right; FAIL odometry");
  EXPECT_EQ(broken[0].what, "2 messages cannot be understood, the first: x.bag: no image");
}

TEST_F(DriveCheckerTest, SurvivesEmptyAndSingleImages) {
  DriveChecker checker(std::make_shared<const CameraRig>(twoCameras()));
  EXPECT_EQ(worstGrade(checker.findings()), CheckGrade::kFail);
  checker.addImage(0, kStart, kStart, {cv::Mat(200, 320, CV_8UC1, cv::Scalar(0)), nullptr});
  checker.addImage(1, Timestamp(), kStart, {cv::Mat(), nullptr});
  checker.addOdometry(kStart, {kStart, RigidTransform(), 0.0, 0.0});
  EXPECT_EQ(worstGrade(checker.findings()), CheckGrade::kFail);
}

}  // namespace
}  // namespace vcharge
