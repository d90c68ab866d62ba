#include "vcharge_core/camera/camera_rig.h"

#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const char* const kRig = R"(vehicle_frame: base_link
cameras:
  front:
    frame_id: camera_front_optical
    image_size_px: [1280, 800]
    model: mei
    intrinsics: {xi: 1.15, gamma1: 895.5, gamma2: 894.7, u0: 649.6, v0: 398.7, k1: -0.33, k2: 0.0865, p1: -0.00067, p2: -0.00004}
    field_of_view_rad: 3.2289
    vehicle_from_camera:
      translation_m: [3.6, 0.0, 0.6]
      rotation_xyzw: [0.5, -0.5, 0.5, -0.5]
  rear:
    image_size_px: [640, 480]
    model: kannala_brandt
    intrinsics: {fx: 200, fy: 201, cx: 320, cy: 240, k1: 0.01, k2: 0, k3: 0, k4: 0}
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t position = text.find(from);
  EXPECT_NE(position, std::string::npos) << from;
  return text.replace(position, from.size(), to);
}

std::string errorOf(const std::string& text) {
  try {
    parseCameraRig(text, "rig.yaml", ".");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(CameraRigTest, MasksAreWrittenBesideARelativeFile) {
  const std::string folder = ::testing::TempDir() + "camera_rig_relative_test";
  const std::filesystem::path before = std::filesystem::current_path();
  createFolder(folder);
  std::filesystem::current_path(folder);
  CameraRig rig = parseCameraRig(kRig, "rig.yaml", ".");
  for (const std::string mask_file : {"", "masks/front.png"}) {
    rig.cameras[0].mask = cv::Mat(rig.cameras[0].image_size_px, CV_8UC1, cv::Scalar(255));
    rig.cameras[0].mask_file = mask_file;
    writeCameraRig(rig, "rig.yaml");
    EXPECT_FALSE(readCameraRig("rig.yaml").cameras[0].mask.empty());
  }
  std::filesystem::current_path(before);
}

TEST(CameraRigTest, ReadsTheDocumentedFile) {
  const CameraRig rig = parseCameraRig(kRig, "rig.yaml", ".");
  ASSERT_EQ(rig.cameras.size(), 2U);
  EXPECT_EQ(rig.cameras[0].name, "front");
  EXPECT_EQ(rig.cameras[0].frame_id, "camera_front_optical");
  EXPECT_EQ(rig.cameras[0].image_size_px, cv::Size(1280, 800));
  EXPECT_EQ(rig.cameras[0].model.name(), "mei");
  // [0.5, -0.5, 0.5, -0.5]: the camera looks along the vehicle's x, its x to the right, its y down.
  const RigidTransform& vehicle_from_camera = *rig.cameras[0].vehicle_from_camera;
  EXPECT_LE((vehicle_from_camera * Eigen::Vector3d(1, 2, 3) - Eigen::Vector3d(3.6 + 3, -1, 0.6 - 2)).norm(),
            1e-12);
  EXPECT_EQ(rig.cameras[1].frame_id, "camera_rear_optical");
  EXPECT_FALSE(rig.cameras[1].vehicle_from_camera);
  EXPECT_FALSE(rig.hasExtrinsics());
  EXPECT_EQ(rig.cameraIndex("rear"), 1U);
  EXPECT_THROW(rig.cameraIndex("left"), InputError);
}

TEST(CameraRigTest, SurvivesWritingAndReadingExactly) {
  const std::string folder = ::testing::TempDir() + "camera_rig_test";
  createFolder(folder);
  CameraRig rig = parseCameraRig(kRig, "rig.yaml", ".");
  rig.cameras[0].vehicle_from_camera =
      RigidTransform(Eigen::Quaterniond(0.1, 0.2, 0.3, 0.4), Eigen::Vector3d(1.0 / 3.0, M_PI, -1e-7));
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Identity() * 1e-6;
  covariance(0, 5) = covariance(5, 0) = 1.0 / 3.0 * 1e-7;
  rig.cameras[0].covariance = covariance;
  rig.cameras[0].mask = cv::Mat(800, 1280, CV_8UC1, cv::Scalar(255));
  rig.cameras[0].mask.at<uint8_t>(3, 4) = 0;
  rig.scale_sigma = 0.1 / 3.0;
  rig.stamp_tolerance_s = 0.04 / 3.0;
  rig.cameras[0].focal_sigma = 1e-4 / 3.0;
  rig.cameras[0].principal_point_sigma_px = 0.1 / 3.0;
  rig.cameras[0].timing = {0.02 / 3.0, ReadoutDirection::kLeft, -0.01 / 3.0};
  rig.provenance = {{"bag", "a: \"b\" # c.bag"}, {"options", "{a: 1,\n b: [2]}"}, {"verdict", "yes"}};
  writeCameraRig(rig, folder + "/rig.yaml");
  const CameraRig read = readCameraRig(folder + "/rig.yaml");
  EXPECT_EQ(read.provenance, rig.provenance);
  EXPECT_EQ(read.scale_sigma, rig.scale_sigma);
  EXPECT_EQ(read.stamp_tolerance_s, rig.stamp_tolerance_s);
  EXPECT_EQ(read.cameras[0].focal_sigma, rig.cameras[0].focal_sigma);
  EXPECT_EQ(read.cameras[0].principal_point_sigma_px, rig.cameras[0].principal_point_sigma_px);
  EXPECT_EQ(read.cameras[1].focal_sigma, 0.0);
  EXPECT_EQ(read.cameras[0].timing.readout_s, rig.cameras[0].timing.readout_s);
  EXPECT_EQ(read.cameras[0].timing.readout_direction, ReadoutDirection::kLeft);
  EXPECT_EQ(read.cameras[0].timing.clock_offset_s, rig.cameras[0].timing.clock_offset_s);
  EXPECT_TRUE(read.cameras[1].timing.isInstant());
  EXPECT_EQ(read.cameras[0].model.parameters(), rig.cameras[0].model.parameters());
  EXPECT_EQ(read.cameras[0].vehicle_from_camera->translation(),
            rig.cameras[0].vehicle_from_camera->translation());
  EXPECT_LE((read.cameras[0].vehicle_from_camera->rotation().coeffs() -
             rig.cameras[0].vehicle_from_camera->rotation().coeffs())
                .norm(),
            1e-15);
  EXPECT_EQ(*read.cameras[0].covariance, covariance);
  EXPECT_EQ(cv::norm(read.cameras[0].mask, rig.cameras[0].mask, cv::NORM_INF), 0.0);
  EXPECT_FALSE(read.cameras[1].vehicle_from_camera);
}

TEST(CameraRigTest, LinesAreExposedInTheirOrder) {
  RigCamera camera = parseCameraRig(kRig, "rig.yaml", ".").cameras[0];  // 1280 x 800
  EXPECT_EQ(camera.exposedAt({100.0, 700.0}), 0.0);
  camera.timing.readout_s = 0.08;
  camera.timing.clock_offset_s = 0.007;
  EXPECT_NEAR(camera.exposedAt({100.0, -0.5}), 0.007 - 0.04, 1e-15);
  EXPECT_NEAR(camera.exposedAt({100.0, 799.5}), 0.007 + 0.04, 1e-15);
  camera.timing.readout_direction = ReadoutDirection::kUp;
  EXPECT_NEAR(camera.exposedAt({100.0, 799.5}), 0.007 - 0.04, 1e-15);
  camera.timing.readout_direction = ReadoutDirection::kRight;
  EXPECT_NEAR(camera.exposedAt({319.5, 700.0}), 0.007 - 0.02, 1e-15);
  camera.timing.readout_direction = ReadoutDirection::kLeft;
  EXPECT_NEAR(camera.exposedAt({319.5, 700.0}), 0.007 + 0.02, 1e-15);
}

TEST(CameraRigTest, ScaleAddsToTheCovarianceAlongTheTranslation) {
  CameraRig rig = parseCameraRig(kRig, "rig.yaml", ".");
  EXPECT_FALSE(rig.covarianceWithScale(0));
  const Eigen::Vector3d translation_m(2.0, -1.0, 0.5);
  rig.cameras[0].vehicle_from_camera = RigidTransform(Eigen::Quaterniond::Identity(), translation_m);
  rig.cameras[0].covariance = 1e-6 * Eigen::Matrix<double, 6, 6>::Identity();
  EXPECT_EQ(*rig.covarianceWithScale(0), *rig.cameras[0].covariance);
  rig.scale_sigma = 0.01;
  Eigen::Matrix<double, 6, 6> expected = *rig.cameras[0].covariance;
  expected.topLeftCorner<3, 3>() += 1e-4 * translation_m * translation_m.transpose();
  EXPECT_TRUE(rig.covarianceWithScale(0)->isApprox(expected, 1e-12));
}

TEST(CameraRigTest, EveryErrorNamesFileKeyAndExpectation) {
  EXPECT_THAT(errorOf(replaced(kRig, "cameras:", "stamp_tolerance_s: 40\ncameras:")),
              AllOf(HasSubstr("rig.yaml"), HasSubstr("stamp_tolerance_s"), HasSubstr("from 0 to 0.1")));
  EXPECT_THAT(errorOf(replaced(kRig, "cameras:", "scale_sigma: -0.1\ncameras:")),
              AllOf(HasSubstr("rig.yaml"), HasSubstr("scale_sigma"), HasSubstr("at least 0")));
  EXPECT_THAT(errorOf(replaced(kRig, "  front:", "  front left:")),
              AllOf(HasSubstr("rig.yaml"), HasSubstr("cameras.front left"), HasSubstr("underscores")));
  EXPECT_THAT(errorOf(replaced(kRig, "cameras:", "provenance: [a]\ncameras:")),
              AllOf(HasSubstr("rig.yaml"), HasSubstr("provenance"), HasSubstr("a map of texts")));
  EXPECT_THAT(errorOf(replaced(kRig, "cameras:", "provenance: {a: [b]}\ncameras:")),
              HasSubstr("provenance.a"));
  EXPECT_THAT(errorOf("- a\n"), AllOf(HasSubstr("rig.yaml"), HasSubstr("cameras")));
  EXPECT_THAT(errorOf("cameras: {a: [1\n"), AllOf(HasSubstr("rig.yaml"), HasSubstr("not valid YAML")));
  EXPECT_THAT(errorOf(replaced(kRig, "field_of_view_rad", "fov")),
              AllOf(HasSubstr("rig.yaml"), HasSubstr("cameras.front.fov"), HasSubstr("unknown key")));
  EXPECT_THAT(errorOf(replaced(kRig, "xi: 1.15", "xi: .nan")),
              AllOf(HasSubstr("cameras.front.intrinsics.xi"), HasSubstr("finite")));
  EXPECT_THAT(errorOf(replaced(kRig, "xi: 1.15, ", "")),
              AllOf(HasSubstr("cameras.front.intrinsics.xi"), HasSubstr("missing")));
  EXPECT_THAT(errorOf(replaced(kRig, "gamma1: 895.5", "gamma1: -1")), HasSubstr("must be positive"));
  EXPECT_THAT(errorOf(replaced(kRig, "model: mei", "model: unified")),
              AllOf(HasSubstr("cameras.front.model"), HasSubstr("mei, kannala_brandt or pinhole")));
  EXPECT_THAT(errorOf(replaced(kRig, "[0.5, -0.5, 0.5, -0.5]", "[0.5, -0.5, 0.5, -0.6]")),
              AllOf(HasSubstr("vehicle_from_camera.rotation_xyzw"), HasSubstr("unit quaternion")));
  EXPECT_THAT(errorOf(replaced(kRig, "[0.5, -0.5, 0.5, -0.5]", "[.nan, -0.5, 0.5, -0.6]")),
              AllOf(HasSubstr("vehicle_from_camera.rotation_xyzw"), HasSubstr("finite")));
  EXPECT_THAT(errorOf(replaced(kRig, "[3.6, 0.0, 0.6]", "[3.6, 0.0]")), HasSubstr("a list of 3 numbers"));
  EXPECT_THAT(errorOf(replaced(kRig, "[1280, 800]", "[1280, 800.5]")),
              HasSubstr("cameras.front.image_size_px"));
  EXPECT_THAT(errorOf(replaced(kRig, "3.2289", "-1")), HasSubstr("field_of_view_rad"));
  EXPECT_THAT(errorOf(replaced(kRig, "field_of_view_rad: 3.2289", "readout_s: 22")),
              AllOf(HasSubstr("cameras.front.readout_s"), HasSubstr("seconds from 0 to 0.2")));
  EXPECT_THAT(errorOf(replaced(kRig, "field_of_view_rad: 3.2289", "readout_direction: top")),
              AllOf(HasSubstr("cameras.front.readout_direction"), HasSubstr("up")));
  EXPECT_THAT(errorOf(replaced(kRig, "field_of_view_rad: 3.2289", "clock_offset_s: 7")),
              AllOf(HasSubstr("cameras.front.clock_offset_s"), HasSubstr("seconds from -1 to 1")));
  EXPECT_THAT(errorOf(replaced(kRig, "rear:", "front:")), HasSubstr("twice"));
  EXPECT_THAT(
      errorOf(replaced(kRig, "    vehicle_from_camera:", "    mask: none.png\n    vehicle_from_camera:")),
      AllOf(HasSubstr("cameras.front.mask"), HasSubstr("none.png")));
  EXPECT_THROW(readCameraRig("/nonexistent/rig.yaml"), InputError);
}

TEST(CameraRigTest, RejectsAMaskOfAnotherSize) {
  const std::string folder = ::testing::TempDir() + "camera_rig_mask_test";
  createFolder(folder);
  cv::imwrite(folder + "/small.png", cv::Mat::zeros(40, 64, CV_8UC1));
  const std::string text =
      replaced(kRig, "    vehicle_from_camera:", "    mask: small.png\n    vehicle_from_camera:");
  writeTextFileAtomically(folder + "/rig.yaml", text);
  try {
    readCameraRig(folder + "/rig.yaml");
    FAIL() << "a mask of another size was taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("1280x800"), HasSubstr("64x40")));
  }
}

TEST(CameraRigTest, ImagesAreTheSameWithOtherExtrinsics) {
  const CameraRig rig = parseCameraRig(kRig, "rig.yaml", ".");
  CameraRig other = rig;
  other.cameras[0].vehicle_from_camera.reset();
  EXPECT_TRUE(haveSameImages(rig, other));
  std::swap(other.cameras[0], other.cameras[1]);
  EXPECT_FALSE(haveSameImages(rig, other));
  other = rig;
  other.cameras[1].image_size_px = {641, 480};
  EXPECT_FALSE(haveSameImages(rig, other));
  other = rig;
  other.cameras.pop_back();
  EXPECT_FALSE(haveSameImages(rig, other));
}

TEST(CameraRigTest, NamesBothSizesOfAnImageUnlikeTheRig) {
  const CameraRig rig = parseCameraRig(kRig, "rig.yaml", ".");
  EXPECT_NO_THROW(checkImageSize(rig.cameras[0], cv::Size(1280, 800), "/camera/front/image_raw"));
  try {
    checkImageSize(rig.cameras[0], cv::Size(640, 400), "/camera/front/image_raw");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("/camera/front/image_raw"), HasSubstr("1280x800"), HasSubstr("640x400")));
  }
}

}  // namespace
}  // namespace vcharge
