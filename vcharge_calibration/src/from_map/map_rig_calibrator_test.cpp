// Calibration of a front and a left camera in an analytic map, on a car that weaves along the map's circle.
#include "vcharge_calibration/from_map/map_rig_calibrator.h"

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "vcharge_core/base/error.h"
#include "vcharge_reconstruction/testing/test_map.h"

namespace vcharge {
namespace {

using ::testing::HasSubstr;
constexpr double kDegree = 0.017453292519943295;

struct TestDrive {
  int num_keyframes = 110;
  double weave_rad = 0.5;       ///< amplitude of the heading's oscillation
  double odometry_scale = 1.0;  ///< measured divided by true distance
  int covered_camera = -1;
  bool is_elsewhere = false;
};

class MapRigCalibratorTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    testing::TestMapOptions options;
    options.num_keyframes = 48;
    options.num_landmarks = 6000;
    map_ = new std::shared_ptr<const SparseMap>(testing::makeTestMap(options));
  }
  static void TearDownTestSuite() { delete map_; }

  /// The map's rig without extrinsics.
  static CameraRig bareRig() {
    CameraRig rig = (*map_)->rig();
    for (RigCamera& camera : rig.cameras) {
      camera.vehicle_from_camera.reset();
    }
    return rig;
  }

  static std::unique_ptr<MapRigCalibrator> drive(const TestDrive& drive) {
    auto calibrator = std::make_unique<MapRigCalibrator>(*map_, bareRig(), MapRigCalibratorOptions());
    RigidTransform map_from_vehicle, odom_from_vehicle;
    std::mt19937 random(11);
    std::normal_distribution<double> noise(0.0, 1.0);
    for (int k = 0; k < drive.num_keyframes; ++k) {
      testing::TestViewOptions view;
      view.seed = static_cast<uint32_t>(100 + k);
      view.camera_without_image = drive.covered_camera;
      calibrator->addKeyframe(Timestamp::fromNanoseconds(int64_t{200000000} * (k + 1)),
                              drive.is_elsewhere ? testing::makeForeignView(**map_, view.seed)
                                                 : testing::makeTestView(**map_, map_from_vehicle, view),
                              odom_from_vehicle);
      // Drives along the circle of 20 m, with a heading that oscillates around the tangent.
      const double heading_before = drive.weave_rad * std::sin(0.25 * k);
      const double heading_after = drive.weave_rad * std::sin(0.25 * (k + 1));
      const double turn_rad = 0.5 / 20.0 + heading_after - heading_before;
      const auto step = [&](double length_m, double angle_rad) {
        return RigidTransform::planar(length_m * std::cos(0.5 * angle_rad),
                                      length_m * std::sin(0.5 * angle_rad), angle_rad);
      };
      map_from_vehicle = map_from_vehicle * step(0.5, turn_rad);
      odom_from_vehicle = odom_from_vehicle * step(drive.odometry_scale * (0.5 + 0.001 * noise(random)),
                                                   turn_rad + 0.0003 * noise(random));
    }
    return calibrator;
  }

  static std::shared_ptr<const SparseMap>* map_;
};
std::shared_ptr<const SparseMap>* MapRigCalibratorTest::map_ = nullptr;

TEST_F(MapRigCalibratorTest, FindsTheExtrinsicsInTheScaleOfTheMap) {
  TestDrive weaving;
  weaving.odometry_scale = 1.02;
  const auto calibrator = drive(weaving);
  const RigCalibration result = calibrator->finish(nullptr);
  ASSERT_NE(result.verdict, Verdict::kFail) << (result.remarks.empty() ? "" : result.remarks.front());
  for (size_t i = 0; i < result.rig->cameras.size(); ++i) {
    const RigidTransform& found = *result.rig->cameras[i].vehicle_from_camera;
    const RigidTransform& truth = *(*map_)->rig().cameras[i].vehicle_from_camera;
    EXPECT_LT((found.translation() - truth.translation()).norm(), 0.015)
        << found.translation().transpose() << ", expected " << truth.translation().transpose();
    EXPECT_LT(angleOfRotation(found.rotation() * truth.rotation().conjugate()), 0.1 * kDegree);
    const Eigen::Matrix<double, 6, 1> sigmas = result.cameras[i].covariance.diagonal().cwiseSqrt();
    EXPECT_LT(sigmas.head<2>().maxCoeff(), 0.01);
  }
  EXPECT_NEAR(calibrator->state().data.odometry_distance_scale, 1.0 / 1.02, 0.001);
  EXPECT_NE(calibrator->reportSection().find("<svg"), std::string::npos);
}

TEST_F(MapRigCalibratorTest, GivesTheSameBitsOnOneThread) {
  TestDrive brief;
  brief.num_keyframes = 40;
  const RigCalibration parallel = drive(brief)->finish(nullptr);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const RigCalibration serial = drive(brief)->finish(nullptr);
  ASSERT_NE(parallel.rig, nullptr) << parallel.remarks.front();
  for (size_t i = 0; i < parallel.rig->cameras.size(); ++i) {
    EXPECT_EQ(parallel.rig->cameras[i].vehicle_from_camera->translation(),
              serial.rig->cameras[i].vehicle_from_camera->translation());
    EXPECT_EQ(*parallel.rig->cameras[i].covariance, *serial.rig->cameras[i].covariance);
  }
}

TEST_F(MapRigCalibratorTest, NamesACoveredCamera) {
  TestDrive covered;
  covered.covered_camera = 1;
  covered.num_keyframes = 30;
  const RigCalibration result = drive(covered)->finish(nullptr);
  EXPECT_EQ(result.verdict, Verdict::kFail);
  ASSERT_EQ(result.remarks.size(), 1U);
  EXPECT_THAT(result.remarks[0], HasSubstr("camera 'left' was found in the map at only 0 of 30"));
  EXPECT_EQ(result.rig, nullptr);
}

TEST_F(MapRigCalibratorTest, RefusesADriveInAnotherPlace) {
  TestDrive elsewhere;
  elsewhere.is_elsewhere = true;
  elsewhere.num_keyframes = 30;
  const RigCalibration result = drive(elsewhere)->finish(nullptr);
  EXPECT_EQ(result.verdict, Verdict::kFail);
  ASSERT_EQ(result.remarks.size(), 2U);
  EXPECT_THAT(result.remarks[0], HasSubstr("another place"));
}

TEST_F(MapRigCalibratorTest, AsksForTurns) {
  MapRigCalibrator calibrator(*map_, bareRig(), MapRigCalibratorOptions());
  for (int k = 0; k < 20; ++k) {
    testing::TestViewOptions view;
    view.seed = static_cast<uint32_t>(k + 1);
    const RigidTransform pose = RigidTransform::planar(0.5 * k, 0.0, 0.0);
    calibrator.addKeyframe(Timestamp::fromNanoseconds(int64_t{200000000} * (k + 1)),
                           testing::makeTestView(**map_, pose, view), pose);
  }
  const RigCalibration result = calibrator.finish(nullptr);
  EXPECT_EQ(result.verdict, Verdict::kFail);
  EXPECT_THAT(result.remarks.at(0), HasSubstr("no turn"));
}

TEST_F(MapRigCalibratorTest, ReportsAnEmptyDrive) {
  MapRigCalibrator calibrator(*map_, bareRig(), MapRigCalibratorOptions());
  const RigCalibration result = calibrator.finish(nullptr);
  EXPECT_EQ(result.verdict, Verdict::kFail);
  EXPECT_THAT(result.remarks.at(0), HasSubstr("no images"));
  EXPECT_THROW(MapRigCalibrator(*map_, CameraRig(), MapRigCalibratorOptions()), InputError);
}

}  // namespace
}  // namespace vcharge
