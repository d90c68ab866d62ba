#include "vcharge_calibration/intrinsics/intrinsics_files.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <opencv2/core/persistence.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

namespace fs = std::filesystem;

class IntrinsicsFilesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("vcharge_intrinsics_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }
  static std::string errorOf(const std::string& file) {
    try {
      readIntrinsics(file, 3.2);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_;
};

CameraModel modelOf(const std::string& name) {
  Eigen::VectorXd parameters(name == "mei" ? 9 : 8);
  if (name == "mei") {
    parameters << 1.15, 895.5, 894.7, 649.6, 398.7, -0.33, 0.0865, -0.00067, -0.00004;
  } else if (name == "kannala_brandt") {
    parameters << 420.1, 421.7, 645.3, 402.9, 0.021, -0.0063, 0.0017, -0.00041;
  } else {
    parameters << 501.3, 502.9, 639.2, 401.1, -0.21, 0.034, 0.0004, -0.0003;
  }
  return CameraModel::create(name, parameters);
}

RigCamera cameraOf(const std::string& name, const std::string& model) {
  return {name, "camera_" + name + "_optical", {1280, 800}, modelOf(model), 3.0, "", {}, {}, {}};
}

TEST_F(IntrinsicsFilesTest, EveryModelSurvivesEveryFormatToTheLastBit) {
  for (const char* model : {"mei", "kannala_brandt", "pinhole"}) {
    CameraRig rig;
    rig.cameras = {cameraOf("left", model)};
    for (const char* format : {"rig", "kalibr", "camodocal"}) {
      const std::string file = path(std::string(model) + format);
      writeIntrinsics(rig, intrinsicsFormat(format), file);
      const CameraRig read = readIntrinsics(file, 3.0);
      ASSERT_EQ(read.cameras.size(), 1U);
      const RigCamera& camera = read.cameras[0];
      EXPECT_EQ(camera.model.name(), model) << format;
      EXPECT_EQ(camera.model.parameters(), rig.cameras[0].model.parameters()) << model << " " << format;
      EXPECT_EQ(camera.image_size_px, cv::Size(1280, 800));
      EXPECT_EQ(camera.field_of_view_rad, 3.0);
      EXPECT_EQ(camera.name, std::string(format) == "kalibr" ? "cam0" : "left");
    }
  }
}

TEST_F(IntrinsicsFilesTest, KalibrsCamchainIsReadAsKalibrDefinesIt) {
  // A camchain as written by Kalibr, including keys that are not used here.
  const CameraRig rig = readIntrinsics(write("camchain.yaml", R"(cam0:
  cam_overlaps: [1]
  camera_model: omni
  distortion_coeffs: [-0.33, 0.0865, -0.00067, -4.0e-05]
  distortion_model: radtan
  intrinsics: [1.15, 895.5, 894.7, 649.6, 398.7]
  resolution: [1280, 800]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [0.021, -0.0063, 0.0017, -0.00041]
  distortion_model: equidistant
  intrinsics: [420.1, 421.7, 645.3, 402.9]
  resolution: [1280, 800]
  rostopic: /cam1/image_raw
  timeshift_cam_imu: 0.001
)"),
                                       3.1);
  ASSERT_EQ(rig.cameras.size(), 2U);
  EXPECT_EQ(rig.cameras[0].model.parameters(), modelOf("mei").parameters());
  EXPECT_EQ(rig.cameras[1].model.parameters(), modelOf("kannala_brandt").parameters());
  EXPECT_FALSE(rig.hasExtrinsics());
  // Kalibr's omni projection by its formula: x / (z + xi d), radial-tangential distortion, focal length.
  const Eigen::Vector3d point(0.8, -0.5, -0.1);
  const double depth = point.z() + 1.15 * point.norm();
  const double x = point.x() / depth;
  const double y = point.y() / depth;
  const double rho = x * x + y * y;
  const double radial = -0.33 * rho + 0.0865 * rho * rho;
  const double p1 = -0.00067;
  const double p2 = -0.00004;
  const Eigen::Vector2d expected(895.5 * (x + x * radial + 2 * p1 * x * y + p2 * (rho + 2 * x * x)) + 649.6,
                                 894.7 * (y + y * radial + 2 * p2 * x * y + p1 * (rho + 2 * y * y)) + 398.7);
  Eigen::Vector2d pixel;
  ASSERT_TRUE(rig.cameras[0].model.project(point, &pixel));
  EXPECT_LT((pixel - expected).norm(), 1e-9);
}

TEST_F(IntrinsicsFilesTest, CamodocalsKannalaBrandtIsReadAsCamodocalDefinesIt) {
  const CameraRig rig = readIntrinsics(write("camera.yaml", R"(%YAML:1.0
---
model_type: KANNALA_BRANDT
camera_name: camera_left
image_width: 1280
image_height: 800
projection_parameters:
   k2: 2.1e-02
   k3: -6.3e-03
   k4: 1.7e-03
   k5: -4.1e-04
   mu: 420.1
   mv: 421.7
   u0: 645.3
   v0: 402.9
)"),
                                       3.1);
  ASSERT_EQ(rig.cameras.size(), 1U);
  EXPECT_EQ(rig.cameras[0].name, "camera_left");
  // r(theta) = theta + k2 theta^3 + k3 theta^5 + k4 theta^7 + k5 theta^9.
  const double theta = 1.2;
  const double phi = 0.4;
  const double r = theta + 0.021 * std::pow(theta, 3) - 0.0063 * std::pow(theta, 5) +
                   0.0017 * std::pow(theta, 7) - 0.00041 * std::pow(theta, 9);
  Eigen::Vector2d pixel;
  ASSERT_TRUE(rig.cameras[0].model.project(
      Eigen::Vector3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)),
      &pixel));
  EXPECT_LT(
      (pixel - Eigen::Vector2d(420.1 * r * std::cos(phi) + 645.3, 421.7 * r * std::sin(phi) + 402.9)).norm(),
      1e-9);
}

TEST_F(IntrinsicsFilesTest, OpenCvReadsWhatIsWrittenForCamodocal) {
  CameraRig rig;
  rig.cameras = {cameraOf("left", "mei")};
  writeIntrinsics(rig, IntrinsicsFormat::kCamodocal, path("camera.yaml"));
  cv::FileStorage file(path("camera.yaml"), cv::FileStorage::READ);
  ASSERT_TRUE(file.isOpened());
  EXPECT_EQ(static_cast<std::string>(file["model_type"]), "MEI");
  EXPECT_EQ(static_cast<int>(file["image_width"]), 1280);
  EXPECT_EQ(static_cast<double>(file["mirror_parameters"]["xi"]), 1.15);
  EXPECT_EQ(static_cast<double>(file["distortion_parameters"]["p2"]), -0.00004);
  EXPECT_EQ(static_cast<double>(file["projection_parameters"]["gamma2"]), 894.7);
}

TEST_F(IntrinsicsFilesTest, KalibrsExtrinsicsLeadFromThePreviousCamera) {
  CameraRig rig;
  rig.cameras = {cameraOf("left", "mei"), cameraOf("right", "mei")};
  rig.cameras[0].vehicle_from_camera = RigidTransform(Eigen::Quaterniond::Identity(), {0.0, 1.0, 0.0});
  rig.cameras[1].vehicle_from_camera = RigidTransform(Eigen::Quaterniond::Identity(), {0.0, 0.75, 0.0});
  writeIntrinsics(rig, IntrinsicsFormat::kKalibr, path("camchain.yaml"));
  std::ifstream file(path("camchain.yaml"));
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  // A point of the left camera is 0.25 m further along y in the right one.
  EXPECT_NE(text.find("- [0.0, 1.0, 0.0, 0.25]"), std::string::npos) << text;
  EXPECT_EQ(readIntrinsics(path("camchain.yaml"), 3.0).cameras.size(), 2U);
}

TEST_F(IntrinsicsFilesTest, BadFilesAreNamedWithTheirKey) {
  const std::string cam =
      "cam0: {camera_model: omni, distortion_model: radtan, distortion_coeffs: [0, 0, 0, 0], "
      "intrinsics: [1, 2, 3, 4, 5], resolution: [10, 10]}";
  const auto with = [&](const std::string& what, const std::string& by) {
    std::string text = cam;
    text.replace(text.find(what), what.size(), by);
    return write("bad.yaml", text);
  };
  EXPECT_NE(errorOf(with("omni", "ds")).find("cam0.camera_model"), std::string::npos);
  EXPECT_NE(errorOf(with("[1, 2, 3, 4, 5]", "[1, 2, 3, 4]")).find("cam0.intrinsics"), std::string::npos);
  EXPECT_NE(errorOf(with("[1, 2, 3, 4, 5]", "[1, -2, 3, 4, 5]")).find("bad.yaml: cam0"), std::string::npos);
  EXPECT_NE(errorOf(with("[1, 2, 3, 4, 5]", "[1, .nan, 3, 4, 5]")).find("finite"), std::string::npos);
  EXPECT_NE(errorOf(with("[10, 10]", "[10]")).find("cam0.resolution"), std::string::npos);
  EXPECT_NE(errorOf(with("[10, 10]", "[0, 10]")).find("cam0.resolution"), std::string::npos);
  EXPECT_NE(errorOf(write("bad.yaml", "cam0: [1]")).find("cam0: expected a map"), std::string::npos);
  EXPECT_NE(errorOf(write("bad.yaml", "model_type: SCARAMUZZA")).find("KANNALA_BRANDT"), std::string::npos);
  EXPECT_NE(errorOf(write("bad.yaml", "model_type: MEI\nmirror_parameters: {xi: many}"))
                .find("mirror_parameters.xi"),
            std::string::npos);
  EXPECT_NE(errorOf(write("bad.yaml", "[1, 2")).find("bad.yaml"), std::string::npos);
  EXPECT_NE(errorOf(write("bad.yaml", "other: 1")).find("model_type"), std::string::npos);
  EXPECT_NE(errorOf(path("none.yaml")).find("none.yaml"), std::string::npos);
  EXPECT_THROW(intrinsicsFormat("opencv"), std::invalid_argument);
  CameraRig two;
  two.cameras = {cameraOf("left", "mei"), cameraOf("right", "mei")};
  EXPECT_THROW(writeIntrinsics(two, IntrinsicsFormat::kCamodocal, path("two.yaml")), InputError);
  EXPECT_FALSE(fs::exists(path("two.yaml")));
}

TEST(ConvertCameraTest, StatesWhatTheNewModelLeavesOver) {
  const cv::Size size(1280, 800);
  for (const char* from : {"mei", "kannala_brandt"}) {
    for (const char* to : {"mei", "kannala_brandt"}) {
      const CameraModel camera = modelOf(from);
      const ConvertedCamera converted = convertCamera(camera, size, 3.0, to);
      EXPECT_EQ(converted.model.name(), to);
      EXPECT_LT(converted.rms_px, 0.5) << from << " " << to;
      EXPECT_LE(converted.rms_px, converted.max_px);
      EXPECT_GT(converted.covered_fraction, 0.99);
      // Computes the error independently, on rays between the samples.
      double worst_px = 0.0;
      for (double theta = 0.013; theta < 1.3; theta += 0.1) {
        const Eigen::Vector3d ray(std::sin(theta), 0.0, std::cos(theta));
        Eigen::Vector2d a;
        Eigen::Vector2d b;
        ASSERT_TRUE(camera.project(ray, &a) && converted.model.project(ray, &b));
        worst_px = std::max(worst_px, (a - b).norm());
      }
      EXPECT_LE(worst_px, converted.max_px + 0.02) << from << " " << to;
    }
  }
}

TEST(ConvertCameraTest, OfTheSameModelIsTheCameraItself) {
  const ConvertedCamera same = convertCamera(modelOf("mei"), {1280, 800}, 3.0, "mei");
  EXPECT_EQ(same.model.parameters(), modelOf("mei").parameters());
  EXPECT_LT(same.max_px, 1e-6);
}

TEST(ConvertCameraTest, APinholeCameraTakesTheMiddleOfAFisheye) {
  const ConvertedCamera middle = convertCamera(modelOf("mei"), {1280, 800}, 1.6, "pinhole");
  EXPECT_LT(middle.rms_px, 1.0);
  EXPECT_GT(middle.covered_fraction, 0.99);
  const ConvertedCamera all = convertCamera(modelOf("mei"), {1280, 800}, 3.2, "pinhole");
  EXPECT_GT(all.rms_px, middle.rms_px);
  EXPECT_LT(all.covered_fraction, 0.95);
  EXPECT_GT(all.covered_fraction, 0.5);
}

}  // namespace
}  // namespace vcharge
