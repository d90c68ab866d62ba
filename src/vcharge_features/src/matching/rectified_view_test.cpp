#include "vcharge_features/rectified_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "extraction/test_images.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_features/feature_extractor.h"

namespace vcharge {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// vehicle_from_camera of a camera that points `yaw_rad` to the left of the vehicle's x axis and `down_rad`
/// down.
Eigen::Quaterniond cameraRotation(double yaw_rad, double down_rad) {
  Eigen::Matrix3d forward;
  forward << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return rotationFromYawPitchRoll(yaw_rad, down_rad, 0.0) * Eigen::Quaterniond(forward);
}

RigCamera makeCamera(const std::string& name, double yaw_rad, double down_rad) {
  RigCamera camera{
      name,
      "camera_" + name + "_optical",
      {640, 400},
      CameraModel::create(
          "mei",
          (Eigen::VectorXd(9) << 1.15, 448, 447, 321, 199, -0.33, 0.0865, -0.0007, -0.00004).finished()),
      3.2,
      "",
      {},
      RigidTransform(cameraRotation(yaw_rad, down_rad), Eigen::Vector3d(1, 2, 0.6)),
      {}};
  return camera;
}

/// Image of a texture painted on a sphere around the camera (longitude and latitude).
cv::Mat render(const RigCamera& camera) {
  static const cv::Mat texture = randomTexture({2200, 1100}, 4);
  cv::Mat image = cv::Mat::zeros(camera.image_size_px, CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      Eigen::Vector3d ray;
      if (camera.model.unproject(Eigen::Vector2d(x, y), &ray)) {
        ray = camera.vehicle_from_camera->rotation() * ray;
        const double longitude = std::atan2(ray.y(), ray.x()) / (2.0 * kPi) + 0.5;
        const double latitude = std::asin(ray.z()) / kPi + 0.5;
        cv::Mat pixel;
        cv::getRectSubPix(texture, {1, 1},
                          {static_cast<float>(longitude * 2199.0), static_cast<float>(latitude * 1099.0)},
                          pixel);
        image.at<uint8_t>(y, x) = pixel.at<uint8_t>(0, 0);
      }
    }
  }
  return image;
}

std::shared_ptr<const CameraRig> makeRig() {
  auto rig = std::make_shared<CameraRig>();
  rig->cameras = {makeCamera("front", 0.0, 0.2), makeCamera("left", kPi / 2.0, 0.35),
                  makeCamera("rear", kPi, 0.2)};
  return rig;
}

TEST(RectifiedViewTest, PixelsMapToTheFisheyeImageExactly) {
  const RigCamera camera = makeCamera("front", 0.0, 0.0);
  const Eigen::Quaterniond view_from_camera = rotationFromVector({0.1, 0.7, -0.05});
  const RectifiedView view(camera, view_from_camera);
  int count = 0;
  for (double y = 0.25; y < view.validMask().rows - 1; y += 7.3) {
    for (double x = 0.25; x < view.validMask().cols - 1; x += 7.1) {
      Eigen::Vector2d sensor;
      Eigen::Vector3d ray_in_view, ray_in_camera;
      if (view.toSensor(Eigen::Vector2d(x, y), &sensor)) {
        ASSERT_TRUE(view.model().unproject(Eigen::Vector2d(x, y), &ray_in_view));
        ASSERT_TRUE(camera.model.unproject(sensor, &ray_in_camera));
        EXPECT_LT((view_from_camera * ray_in_camera - ray_in_view).norm(), 1e-9);
        ++count;
      }
    }
  }
  EXPECT_GT(count, 5000);
}

TEST(RectifiedViewTest, ViewsOfCamerasAtOnePositionAreOneImage) {
  const auto rig = makeRig();
  RectifiedViewCache cache(rig);
  const auto pair = cache.pair(0, 1, 0.0);
  ASSERT_TRUE(pair);
  const cv::Mat first = pair->first->rectify(render(rig->cameras[0]));
  const cv::Mat second = pair->second->rectify(render(rig->cameras[1]));
  const cv::Mat both = pair->first->validMask() & pair->second->validMask();
  ASSERT_GT(cv::countNonZero(both), 0.2 * static_cast<double>(both.total()));
  cv::Mat first_smooth, second_smooth, difference;
  // The two fisheye images sample the texture at different scales.
  cv::GaussianBlur(first, first_smooth, {0, 0}, 3.0);
  cv::GaussianBlur(second, second_smooth, {0, 0}, 3.0);
  cv::absdiff(first_smooth, second_smooth, difference);
  cv::Mat inner;
  cv::erode(both, inner, cv::Mat(), {-1, -1}, 10, cv::BORDER_CONSTANT, cv::Scalar(0));
  EXPECT_LT(cv::mean(difference, inner)[0], 3.0);
}

TEST(RectifiedViewTest, MatchesCamerasThatTheFisheyeImagesCannotMatch) {
  const auto rig = makeRig();
  RectifiedViewCache cache(rig);
  const auto pair = cache.pair(0, 1, 0.0);
  const auto extractor = makeFeatureExtractor();
  const auto countRight = [&](const ImageFeatures& a, const ImageFeatures& b) {
    int right = 0;
    for (const FeatureMatch& match : matchDescriptors(a.descriptors, b.descriptors)) {
      Eigen::Vector3d rays[2];
      const cv::Point2f p = a.keypoints[match.first_index].position_px;
      const cv::Point2f q = b.keypoints[match.second_index].position_px;
      right += rig->cameras[0].model.unproject(Eigen::Vector2d(p.x, p.y), &rays[0]) &&
               rig->cameras[1].model.unproject(Eigen::Vector2d(q.x, q.y), &rays[1]) &&
               (rig->cameras[0].vehicle_from_camera->rotation() * rays[0] -
                rig->cameras[1].vehicle_from_camera->rotation() * rays[1])
                       .norm() < 0.01;
    }
    return right;
  };
  const cv::Mat images[2] = {render(rig->cameras[0]), render(rig->cameras[1])};
  const auto inView = [&](const RectifiedView& view, const cv::Mat& image) {
    return view.toSensor(extractor->extract(view.rectify(image), view.validMask()));
  };
  const int in_views = countRight(inView(*pair->first, images[0]), inView(*pair->second, images[1]));
  const int in_images = countRight(extractor->extract(images[0]), extractor->extract(images[1]));
  EXPECT_GT(in_views, 60);
  EXPECT_GT(in_views, 4 * in_images);
}

TEST(RectifiedViewTest, OwnCarAndWhatLiesOutsideTheFieldOfViewAreNotValid) {
  RigCamera camera = makeCamera("front", 0.0, 0.0);
  camera.field_of_view_rad = 1.0;
  camera.mask = cv::Mat(400, 640, CV_8UC1, cv::Scalar(255));
  camera.mask.rowRange(220, 400) = 0;
  const RectifiedView view(camera, Eigen::Quaterniond::Identity());
  const cv::Mat white = view.rectify(cv::Mat(400, 640, CV_8UC1, cv::Scalar(200)));
  const cv::Mat& valid = view.validMask();
  EXPECT_EQ(valid.at<uint8_t>(290, 400), 255);
  EXPECT_EQ(valid.at<uint8_t>(400, 400), 0) << "mask";
  EXPECT_EQ(valid.at<uint8_t>(290, 100), 0) << "field of view";
  EXPECT_EQ(white.at<uint8_t>(290, 400), 200);
  EXPECT_EQ(white.at<uint8_t>(290, 100), 0);
  Eigen::Vector2d pixel(7, 7);
  EXPECT_FALSE(view.toSensor(Eigen::Vector2d(100, 290), &pixel));
  EXPECT_FALSE(view.toSensor(Eigen::Vector2d(-1, 290), &pixel));
  EXPECT_EQ(pixel, Eigen::Vector2d(7, 7));
}

TEST(RectifiedViewCacheTest, MakesAPairOnceAndForgetsTheOldest) {
  RectifiedViewCacheOptions options;
  options.view.width_px = 64;
  options.view.height_px = 48;
  options.max_pairs = 2;
  RectifiedViewCache cache(makeRig(), options);
  const auto pair = cache.pair(0, 1, 0.0);
  EXPECT_EQ(cache.pair(0, 1, 0.3 * RectifiedViewCache::kYawStep_rad)->first, pair->first);
  EXPECT_EQ(cache.pair(0, 1, 2.0 * kPi)->first, pair->first);
  EXPECT_NE(cache.pair(0, 1, RectifiedViewCache::kYawStep_rad)->first, pair->first);
  EXPECT_EQ(cache.pair(0, 1, 0.0)->first, pair->first);
  EXPECT_NE(cache.pair(1, 2, 0.0)->first, pair->first);
  EXPECT_EQ(cache.numPairs(), 2U);
  EXPECT_EQ(cache.pair(0, 1, 0.0)->first, pair->first) << "used last but one";
}

TEST(RectifiedViewCacheTest, PlanesAreParallelWhenTheVehicleTurned) {
  const auto rig = makeRig();
  RectifiedViewCache cache(rig);
  const double yaw_rad = 10 * RectifiedViewCache::kYawStep_rad;
  const auto pair = cache.pair(0, 1, yaw_rad);
  const Eigen::Quaterniond start_from_first =
      rig->cameras[0].vehicle_from_camera->rotation() * pair->first->viewFromCamera().conjugate();
  const Eigen::Quaterniond start_from_second = rotationFromYawPitchRoll(yaw_rad, 0.0, 0.0) *
                                               rig->cameras[1].vehicle_from_camera->rotation() *
                                               pair->second->viewFromCamera().conjugate();
  EXPECT_LT(start_from_first.angularDistance(start_from_second), 1e-9);
  EXPECT_NEAR((start_from_first * Eigen::Vector3d::UnitX()).z(), 0.0, 1e-12) << "level";
  EXPECT_LT((start_from_first * Eigen::Vector3d::UnitY()).z(), 0.0) << "y looks down";
}

TEST(RectifiedViewCacheTest, BadArgumentsAreNamed) {
  RectifiedViewCache cache(makeRig());
  EXPECT_FALSE(cache.pair(0, 2, 0.0)) << "front and rear";
  EXPECT_THROW(cache.pair(0, 3, 0.0), std::logic_error);
  EXPECT_THROW(cache.pair(0, 1, NAN), std::logic_error);
  auto uncalibrated = std::make_shared<CameraRig>(*makeRig());
  uncalibrated->cameras[1].vehicle_from_camera.reset();
  EXPECT_THROW(RectifiedViewCache{uncalibrated}, std::logic_error);
  RectifiedViewCacheOptions options;
  options.view.horizontal_field_of_view_rad = NAN;
  EXPECT_THAT([&] { RectifiedViewCache(makeRig(), options); },
              ::testing::ThrowsMessage<std::invalid_argument>(
                  ::testing::HasSubstr("view.horizontal_field_of_view_rad")));
  EXPECT_THAT([&] { cache.pair(0, 1, 0.0)->first->rectify(cv::Mat::zeros(3, 3, CV_8UC1)); },
              ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr("image: expected")));
}

}  // namespace
}  // namespace vcharge
