#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "rig/rig_judgement.h"
#include "vcharge_reconstruction/testing/test_camera.h"

namespace vcharge {
namespace {

using testing::makeExtrinsics;

/// A good calibration of three cameras.
RigCalibration makeGood() {
  RigCalibration result;
  result.distance_m = 150.0;
  result.left_turn_rad = result.right_turn_rad = 6.0;
  result.num_loop_edges = 50;
  for (const char* name : {"front", "left", "rear"}) {
    CameraCalibration camera;
    camera.name = name;
    camera.covariance.diagonal() << 1e-5, 1e-5, 1e-5, 1e-7, 1e-7, 1e-7;
    camera.num_common_landmarks = 500;
    camera.num_tracked = camera.num_observations = 10000;
    camera.rms_px = 0.5;
    camera.structure_px = 0.03;
    result.cameras.push_back(camera);
  }
  return result;
}

/// Verdict and first remark of a good calibration with one fault.
template <class Spoil>
std::string judge(const Spoil& spoil, Verdict* verdict) {
  RigCalibration result = makeGood();
  spoil(&result);
  findVerdict(&result);
  *verdict = result.verdict;
  return result.remarks.empty() ? "" : result.remarks.front();
}

void expectRemark(const std::string& remark, const std::string& part) {
  EXPECT_NE(remark.find(part), std::string::npos) << remark;
}

TEST(RigVerdictTest, PassesAGoodCalibration) {
  Verdict verdict = Verdict::kFail;
  EXPECT_EQ(judge([](RigCalibration*) {}, &verdict), "");
  EXPECT_EQ(verdict, Verdict::kPass);
}

TEST(RigVerdictTest, NamesUncertainDegreesOfFreedom) {
  Verdict verdict = Verdict::kPass;
  expectRemark(judge([](RigCalibration* r) { r->cameras[1].covariance(2, 2) = 0.02 * 0.02; }, &verdict),
               "'left': height is known only to 2.0 cm");
  EXPECT_EQ(verdict, Verdict::kWarn);
  judge([](RigCalibration* r) { r->cameras[1].covariance(2, 2) = 0.2 * 0.2; }, &verdict);
  EXPECT_EQ(verdict, Verdict::kFail);
  judge([](RigCalibration* r) { r->cameras[0].covariance.setZero(); }, &verdict);
  EXPECT_EQ(verdict, Verdict::kFail);
}

TEST(RigVerdictTest, ComparesTheHalvesOfTheDrive) {
  Verdict verdict = Verdict::kPass;
  expectRemark(judge([](RigCalibration* r) { r->cameras[0].half_difference[1] = 0.05; }, &verdict),
               "camera 'front': two halves of the drive differ by 5.0 cm");
  EXPECT_EQ(verdict, Verdict::kWarn);
  judge([](RigCalibration* r) { r->cameras[0].half_difference[1] = 0.3; }, &verdict);
  EXPECT_EQ(verdict, Verdict::kFail);
}

TEST(RigVerdictTest, NamesTheMissingManoeuvre) {
  Verdict verdict = Verdict::kPass;
  expectRemark(judge([](RigCalibration* r) { r->right_turn_rad = 0.5; }, &verdict), "degrees to the right");
  EXPECT_EQ(verdict, Verdict::kWarn);
  expectRemark(judge([](RigCalibration* r) { r->num_loop_edges = 0; }, &verdict), "no loop was closed");
  expectRemark(judge([](RigCalibration* r) { r->distance_m = 20.0; }, &verdict), "drive 100 m or more");
  expectRemark(judge([](RigCalibration* r) { r->cameras[0].num_common_landmarks = 0; }, &verdict),
               "camera 'front' shares only 0 landmarks");
}

TEST(RigVerdictTest, TellsThatAnImageDeviatesFromItsIntrinsics) {
  const auto withFocalLength = [](double deviation, double sigma, bool is_corrected) {
    return [=](RigCalibration* r) {
      r->cameras[1].intrinsics = {{deviation, 0.1, 0.0}, {sigma, 0.1, 0.1}, {0.003, 2.0, 2.0}, is_corrected};
    };
  };
  Verdict verdict = Verdict::kPass;
  expectRemark(judge(withFocalLength(-0.0015, 0.0002, false), &verdict),
               "camera 'left': its image deviates from its intrinsics: focal length -0.150 +- 0.020 %");
  EXPECT_EQ(verdict, Verdict::kWarn);
  EXPECT_EQ(judge(withFocalLength(-0.0015, 0.0005, false), &verdict), "") << "it may be noise";
  EXPECT_EQ(judge(withFocalLength(-0.0003, 0.00001, false), &verdict), "") << "it does not matter";
  EXPECT_EQ(judge(withFocalLength(-0.0015, 0.0002, true), &verdict), "");
}

TEST(RigVerdictTest, TellsThatLinesAreExposedAtOtherTimesThanTheRigSays) {
  const auto withReadouts = [](double known_s, double found_s, double sigma_s, bool is_corrected) {
    return [=](RigCalibration* r) {
      r->cameras[1].timing = {{known_s}, {found_s}, {sigma_s, 0.001}, is_corrected};
    };
  };
  Verdict verdict = Verdict::kPass;
  expectRemark(
      judge(withReadouts(0.0, 0.022, 0.0001, false), &verdict),
      "camera 'left': its images look as if exposed in lines from top to bottom within 22.0 ms +- 0.10 ms, "
      "clock offset 0.0 ms +- 1.00 ms; the rig said all at the stamp");
  EXPECT_EQ(verdict, Verdict::kWarn);
  expectRemark(judge(withReadouts(0.02, -0.02, 0.0001, false), &verdict),
               "lines from bottom to top within 20.0 ms +- 0.10 ms, clock offset 0.0 ms +- 1.00 ms; the rig "
               "said lines from top to bottom within 20.0 ms");
  EXPECT_EQ(judge(withReadouts(0.0, 0.022, 0.01, false), &verdict), "") << "it may be noise";
  EXPECT_EQ(judge(withReadouts(0.02, 0.021, 0.0001, false), &verdict), "") << "it does not matter";
  EXPECT_EQ(judge(withReadouts(0.0, 0.022, 0.0001, true), &verdict), "");
}

TEST(RigVerdictTest, NamesDelayedStampsAndWrongIntrinsics) {
  Verdict verdict = Verdict::kPass;
  expectRemark(judge([](RigCalibration* r) { r->time_offset_s = 0.1; }, &verdict), "100 ms late");
  EXPECT_EQ(verdict, Verdict::kWarn) << "it is corrected for";
  judge([](RigCalibration* r) { r->time_offset_s = -0.4; }, &verdict);
  EXPECT_EQ(verdict, Verdict::kFail);
  expectRemark(judge([](RigCalibration* r) { r->cameras[0].num_observations = 5000; }, &verdict),
               "camera 'front': only 50 % as many observations fit");
  EXPECT_EQ(verdict, Verdict::kFail);
  expectRemark(judge([](RigCalibration* r) { r->cameras[1].structure_px = 0.4; }, &verdict),
               "camera 'left': errors correlate over the image");
  EXPECT_EQ(verdict, Verdict::kFail);
}

using NamesAndYaws = std::vector<std::pair<const char*, double>>;

CameraRig rigWith(const NamesAndYaws& names_and_yaws, const RigidTransform& vehicle_from_wrong = {}) {
  KannalaBrandtCamera::Parameters parameters;
  parameters << 200.0, 200.0, 319.5, 199.5, 0.0, 0.0, 0.0, 0.0;
  CameraRig rig;
  for (const auto& [name, yaw_rad] : names_and_yaws) {
    RigCamera camera{name, name, cv::Size(640, 400), KannalaBrandtCamera(parameters)};
    camera.vehicle_from_camera =
        vehicle_from_wrong * makeExtrinsics(yaw_rad, 0.3, 0.0, Eigen::Vector3d::Zero());
    rig.cameras.push_back(camera);
  }
  return rig;
}

TEST(WrongSignTest, FollowsFromNamesAndFromUpsideDownCameras) {
  const auto rigOf = [](const RigidTransform& vehicle_from_wrong) {
    return rigWith({{"front", 0.0}, {"left", 1.57}}, vehicle_from_wrong);
  };
  EXPECT_EQ(findWrongSign(rigOf(RigidTransform())), "");
  expectRemark(findWrongSign(rigOf(RigidTransform::planar(0.0, 0.0, 3.14159265))), "direction of travel");
  expectRemark(findWrongSign(rigOf(
                   RigidTransform(rotationFromVector({3.14159265, 0.0, 0.0}), Eigen::Vector3d::Zero()))),
               "turns have the wrong sign");
}

TEST(WrongSignTest, NamesSwappedCameras) {
  const auto judgeNames = [](const NamesAndYaws& names_and_yaws) {
    return findWrongSign(rigWith(names_and_yaws));
  };
  expectRemark(judgeNames({{"front", 0.0}, {"left", -1.57}, {"right", 1.57}}),
               "camera 'left' looks to the right, camera 'right' looks to the left: are cameras swapped?");
  expectRemark(judgeNames({{"front", 1.57}, {"left", 0.0}, {"rear", 3.14}}),
               "camera 'front' looks to the left, camera 'left' looks to the front");
  EXPECT_EQ(judgeNames({{"front", 0.9}, {"left", 2.4}, {"rear", 3.14}}), "") << "mounted at the corners";
  EXPECT_EQ(judgeNames({{"front", 0.0}, {"trailer", 3.14}}), "") << "a name that says no side";
}

}  // namespace
}  // namespace vcharge
