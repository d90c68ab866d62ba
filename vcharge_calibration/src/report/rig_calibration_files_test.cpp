#include "vcharge_calibration/report/rig_calibration_files.h"

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

namespace fs = std::filesystem;

class RigFilesTest : public ::testing::Test {
 protected:
  RigFilesTest() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~RigFilesTest() override { fs::remove_all(folder_); }

  /// Writes a rig with one camera at `forwards_m`, and returns the name of its file.
  std::string write(Verdict verdict, double forwards_m) const {
    RigCamera camera{"front", "camera_front_optical", cv::Size(640, 400),
                     KannalaBrandtCamera(
                         (KannalaBrandtCamera::Parameters() << 200.0, 200.0, 319.5, 199.5, 0.0, 0.0, 0.0, 0.0)
                             .finished())};
    camera.vehicle_from_camera = RigidTransform::planar(forwards_m, 0.0, 0.0);
    auto rig = std::make_shared<CameraRig>();
    rig->cameras.push_back(camera);
    RigCalibration result;
    result.verdict = verdict;
    result.rig = rig;
    return fs::path(writeRigAndTrajectory(path_, "", result, ReconstructionState(),
                                          {{"verdict", toString(verdict)}}))
        .filename()
        .string();
  }
  double forwardsOf(const std::string& name) const {
    return readCameraRig((folder_ / name).string()).cameras[0].vehicle_from_camera->translation().x();
  }

  const fs::path folder_ = fs::temp_directory_path() / "vcharge_rig_files_test";
  const std::string path_ = (folder_ / "rig.yaml").string();
};

TEST_F(RigFilesTest, ARigThatPassedIsReplacedOnlyByOneThatPassed) {
  EXPECT_EQ(write(Verdict::kWarn, 1.0), "rig.yaml");
  EXPECT_EQ(write(Verdict::kWarn, 2.0), "rig.yaml");
  EXPECT_EQ(write(Verdict::kPass, 3.0), "rig.yaml");
  EXPECT_EQ(write(Verdict::kWarn, 4.0), "rig_WARN.yaml");
  EXPECT_EQ(forwardsOf("rig.yaml"), 3.0);
  EXPECT_EQ(forwardsOf("rig_WARN.yaml"), 4.0);
  EXPECT_EQ(write(Verdict::kPass, 5.0), "rig.yaml");
  EXPECT_EQ(forwardsOf("rig.yaml"), 5.0);
}

TEST_F(RigFilesTest, AFileThatIsNoRigIsReplaced) {
  std::ofstream(path_) << "cameras: [";
  EXPECT_EQ(write(Verdict::kWarn, 1.0), "rig.yaml");
  EXPECT_EQ(forwardsOf("rig.yaml"), 1.0);
}

}  // namespace
}  // namespace vcharge
