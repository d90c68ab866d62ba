#include "report/rig_pictures.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "matching/rectified_matches.h"
#include "report/bird_view.h"
#include "vcharge_calibration/report/rig_report.h"
#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/testing/test_camera.h"

namespace vcharge {
namespace {

using testing::makeExtrinsics;

constexpr double kRightAngle_rad = 1.5707963267948966;
const cv::Size kImageSize_px(640, 400);

/// Four fisheye cameras around a car.
std::shared_ptr<CameraRig> makeRig() {
  auto rig = std::make_shared<CameraRig>();
  const std::pair<const char*, Eigen::Vector3d> positions[] = {{"front", {3.6, 0.0, 0.7}},
                                                               {"left", {1.9, 1.0, 0.9}},
                                                               {"rear", {-0.9, 0.0, 0.8}},
                                                               {"right", {1.9, -1.0, 0.9}}};
  double yaw_rad = 0.0;
  for (const auto& [name, position_m] : positions) {
    rig->cameras.push_back({name,
                            std::string("camera_") + name + "_optical",
                            kImageSize_px,
                            MeiCamera(1.0, 300.0, 300.0, 320.0, 200.0),
                            3.0,
                            "",
                            {},
                            makeExtrinsics(yaw_rad, 0.5, 0.0, position_m),
                            {}});
    yaw_rad += kRightAngle_rad;
  }
  return rig;
}

/// Gray levels of the ground: waves of 3 m.
double groundLevel(double x_m, double y_m) {
  return 128.0 + 60.0 * std::sin(2.1 * x_m) * std::cos(2.1 * y_m);
}

cv::Mat drawGround(const RigCamera& camera) {
  cv::Mat image(camera.image_size_px, CV_8UC1, cv::Scalar(0));
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      Eigen::Vector3d ray;
      if (!camera.model.unproject(Eigen::Vector2d(column, row), &ray)) {
        continue;
      }
      ray = camera.vehicle_from_camera->rotation() * ray;
      if (ray.z() < -0.02) {
        const Eigen::Vector3d& from = camera.vehicle_from_camera->translation();
        const Eigen::Vector3d ground = from - from.z() / ray.z() * ray;
        image.at<uint8_t>(row, column) = cv::saturate_cast<uint8_t>(groundLevel(ground.x(), ground.y()));
      }
    }
  }
  return image;
}

/// Median gray-level difference between the bird's-eye view and the ground within some metres.
double medianError(const CameraRig& rig, const std::vector<cv::Mat>& images) {
  BirdViewArea area;
  area.front_m = 7.0;
  area.rear_m = 4.0;
  area.side_m = 5.0;
  area.metres_per_px = 0.05;
  const cv::Mat view = makeBirdView(rig, images, area);
  EXPECT_EQ(view.size(), cv::Size(200, 220));
  std::vector<double> errors;
  for (int row = 0; row < view.rows; ++row) {
    for (int column = 0; column < view.cols; ++column) {
      const auto& pixel = view.at<cv::Vec3b>(row, column);
      if (pixel != cv::Vec3b::all(0)) {
        const double x_m = area.front_m - (row + 0.5) * area.metres_per_px;
        const double y_m = area.side_m - (column + 0.5) * area.metres_per_px;
        errors.push_back(std::abs(pixel[0] - groundLevel(x_m, y_m)));
      }
    }
  }
  EXPECT_GT(errors.size(), static_cast<size_t>(view.rows) * view.cols / 2);
  std::nth_element(errors.begin(), errors.begin() + static_cast<ptrdiff_t>(errors.size() / 2), errors.end());
  return errors[errors.size() / 2];
}

TEST(BirdViewTest, ProjectsTheGround) {
  const auto rig = makeRig();
  std::vector<cv::Mat> images;
  for (const RigCamera& camera : rig->cameras) {
    images.push_back(drawGround(camera));
  }
  EXPECT_LT(medianError(*rig, images), 2.0);
  // Smaller images give the same view, slightly blurred.
  std::vector<cv::Mat> small(images.size());
  for (size_t i = 0; i < images.size(); ++i) {
    cv::resize(images[i], small[i], cv::Size(), 0.5, 0.5, cv::INTER_AREA);
  }
  EXPECT_LT(medianError(*rig, small), 3.0);
  // A displacement of half a metre is a sixth of a wave.
  for (RigCamera& camera : rig->cameras) {
    camera.vehicle_from_camera =
        RigidTransform(camera.vehicle_from_camera->rotation(),
                       camera.vehicle_from_camera->translation() + Eigen::Vector3d(0.5, 0.0, 0.0));
  }
  EXPECT_GT(medianError(*rig, images), 10.0);
}

TEST(BirdViewTest, PropagatesTheCovarianceToTheGround) {
  const RigidTransform vehicle_from_camera = makeExtrinsics(0.7, 0.4, 0.0, {1.9, 0.9, 0.9});
  const Eigen::Vector2d ground(4.0, 5.0);
  const Eigen::Vector3d ray_in_camera = vehicle_from_camera.inverse() * Eigen::Vector3d(4.0, 5.0, 0.0);
  constexpr double kStep = 1e-6;
  Eigen::Matrix<double, 2, 6> numeric;
  for (int i = 0; i < 6; ++i) {
    Eigen::Matrix<double, 6, 1> step = Eigen::Matrix<double, 6, 1>::Zero();
    step[i] = kStep;
    const RigidTransform moved(rotationFromVector(step.tail<3>()) * vehicle_from_camera.rotation(),
                               vehicle_from_camera.translation() + step.head<3>());
    const Eigen::Vector3d ray = moved.rotation() * ray_in_camera;
    const Eigen::Vector3d there = moved.translation() - moved.translation().z() / ray.z() * ray;
    numeric.col(i) = (there.head<2>() - ground) / kStep;
  }
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, 6, 6> root;
  for (double& entry : root.reshaped()) {
    entry = 0.01 * normal(random);
  }
  const Eigen::Matrix<double, 6, 6> covariance = root * root.transpose();
  const Eigen::Matrix2d expected = numeric * covariance * numeric.transpose();
  EXPECT_LT((groundCovariance(vehicle_from_camera, covariance, ground) - expected).norm(),
            1e-4 * expected.norm());
}

TEST(BirdViewTest, SeamsAreBetweenNeighboursAndGrowWithDistance) {
  const auto rig = makeRig();
  for (RigCamera& camera : rig->cameras) {
    camera.covariance = Eigen::Matrix<double, 6, 6>::Identity() * 1e-6;  // 1 mm, 1 mrad
  }
  CameraRig before = *rig;
  before.cameras[1].vehicle_from_camera =
      RigidTransform(rig->cameras[1].vehicle_from_camera->rotation(),
                     rig->cameras[1].vehicle_from_camera->translation() + Eigen::Vector3d(0.1, 0.0, 0.0));
  const std::vector<SeamPoint> points = seamPoints(*rig, &before, {2.0, 5.0});
  ASSERT_EQ(points.size(), 8U);
  for (const SeamPoint& point : points) {
    EXPECT_NE((point.first + point.second) % 2, 0U) << "front and rear, left and right are no neighbours";
    EXPECT_TRUE(point.is_seen);
    // Only the left camera was moved, along the ground.
    EXPECT_NEAR(point.before_m, point.first == 1 || point.second == 1 ? 0.1 : 0.0, 1e-9);
  }
  for (size_t i = 0; i < points.size(); i += 2) {
    EXPECT_LT(points[i].sigma_m, points[i + 1].sigma_m);
    // A milliradian of tilt moves the ray's end by d^2 / h milliradians; both cameras contribute.
    EXPECT_NEAR(points[i + 1].sigma_m, std::sqrt(2.0) * 0.001 * 5.0 * 5.0 / 0.8, 0.015);
  }
}

/// Two cameras at one keyframe that see very distant points.
struct FarPoints {
  ReconstructionData data;
  KeyframeImages images;

  FarPoints() {
    data.rig = makeRig();
    data.keyframes.resize(1);
    images.add(0, std::vector<Image>(4, Image{cv::Mat(kImageSize_px, CV_8UC1, cv::Scalar(90)), nullptr}));
    for (int i = 0; i < 40; ++i) {
      const double yaw_rad = -1.0 + 3.6 * i / 40.0;
      Track track;
      track.position_m = 1e6 * Eigen::Vector3d(std::cos(yaw_rad), std::sin(yaw_rad), 0.05);
      for (const int camera : {0, 1}) {
        TrackObservation observation;
        observation.camera = camera;
        const RigCamera& sees = data.rig->cameras[static_cast<size_t>(camera)];
        const Eigen::Vector3d in_camera = sees.vehicle_from_camera->inverse() * *track.position_m;
        if (in_camera.normalized().z() > 0.1 && sees.model.project(in_camera, &observation.position_px)) {
          track.observations.push_back(observation);
        }
      }
      data.tracks.push_back(track);
    }
  }
};

TEST(RectifiedMatchesTest, DistantPointsHaveEqualPositionsInBothViews) {
  const FarPoints scene;
  const std::vector<CameraPairView> pairs = findCameraPairViews(scene.data, scene.images);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(std::make_pair(pairs[0].first_camera, pairs[0].second_camera),
            std::make_pair(size_t{0}, size_t{1}));
  const std::vector<ViewMatch> matches = matchesInViews(scene.data, pairs[0]);
  EXPECT_GE(matches.size(), 10U);
  for (const ViewMatch& match : matches) {
    EXPECT_NEAR(match.first_px.x, match.second_px.x, 0.01);
    EXPECT_NEAR(match.first_px.y, match.second_px.y, 0.01);
  }
  const cv::Mat picture = drawCameraPairView(scene.data, scene.images, pairs[0]);
  EXPECT_EQ(picture.type(), CV_8UC3);
  cv::Mat bright;
  cv::extractChannel(picture, bright, 2);
  EXPECT_GT(cv::countNonZero(bright > 150), 100) << "lines";
}

TEST(RectifiedMatchesTest, FindsNoPairsWithoutImages) {
  EXPECT_TRUE(findCameraPairViews(FarPoints().data, KeyframeImages()).empty());
}

TEST(RigPicturesTest, AveragesErrorsByCell) {
  std::vector<CornerError> errors;
  for (int i = 0; i < 20; ++i) {
    errors.push_back({{10.0, 10.0}, {0.5, i % 2 == 0 ? 0.3 : -0.3}});
  }
  errors.push_back({{600.0, 390.0}, {9.0, 9.0}});  // an outlier alone in its cell
  const std::vector<CornerError> means = meanErrors(kImageSize_px, errors);
  ASSERT_EQ(means.size(), 1U);
  EXPECT_LT((means[0].pixel - Eigen::Vector2d(20.0, 20.0)).norm(), 1e-9);
  EXPECT_LT((means[0].error_px - Eigen::Vector2d(0.5, 0.0)).norm(), 1e-9);
}

TEST(RigPicturesTest, DrawsALineFromEachLandmarkToItsCameras) {
  const std::vector<LandmarkViews> landmarks = {{{5.0, 5.0, 0.0}, 0, {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}}},
                                                {{6.0, 5.0, 0.0}, 1, {}}};
  const std::string picture =
      drawLandmarkViews(landmarks, {{0.0, 0.0, 0.0}, {2.0, 0.0, 0.0}}, {"front", "<left>"});
  const auto count = [&](const std::string& text) {
    size_t found = 0;
    for (size_t at = picture.find(text); at != std::string::npos; at = picture.find(text, at + 1)) {
      ++found;
    }
    return found;
  };
  EXPECT_EQ(count(colourOfCamera(0)), 3U) << "lines, dots, legend";
  EXPECT_EQ(count(colourOfCamera(1)), 2U) << "dots, legend";
  EXPECT_EQ(count("&lt;left&gt;"), 1U);
}

/// Makes the page of a drive that passed or failed.
std::string makePage(bool passed) {
  FarPoints scene;
  ReconstructionState state;
  state.data = scene.data;
  state.data.keyframes.resize(2);
  state.data.keyframes[1].map_from_vehicle = RigidTransform::planar(5.0, 0.0, 0.0);
  RigCalibration result;
  result.verdict = passed ? Verdict::kWarn : Verdict::kFail;
  result.remarks = {"the drive <turned>"};
  for (const RigCamera& camera : scene.data.rig->cameras) {
    result.cameras.emplace_back();
    result.cameras.back().name = camera.name;
    result.cameras.back().covariance = Eigen::Matrix<double, 6, 6>::Identity() * 1e-6;
  }
  if (passed) {
    auto rig = std::make_shared<CameraRig>(*scene.data.rig);
    for (RigCamera& camera : rig->cameras) {
      camera.covariance = Eigen::Matrix<double, 6, 6>::Identity() * 1e-6;
    }
    result.rig = rig;
    result.first_scene = std::make_shared<const RigScene>(makeRigScene(scene.data));
  } else {
    auto rig = std::make_shared<CameraRig>(*scene.data.rig);
    for (RigCamera& camera : rig->cameras) {
      camera.vehicle_from_camera.reset();
    }
    state.data.rig = rig;
  }
  return makeRigReport("a & b", result, state, scene.images, "<h2>more</h2>");
}

TEST(RigReportTest, IsCompleteAndSelfContained) {
  const std::string page = makePage(true);
  for (const char* part : {"a &amp; b", "verdict WARN", "the drive &lt;turned&gt;", "Sparse map", "Before",
                           "After", "at 10 m (cm)", "front, left", "Landmarks that cameras share",
                           "Errors over the images", "Loops", "<h2>more</h2>", "data:image/jpeg;base64,"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
  EXPECT_EQ(page.find("\u00b1 nan"), std::string::npos);
}

TEST(RigReportTest, HasTheReasonOfAFailure) {
  const std::string page = makePage(false);
  EXPECT_NE(page.find("verdict FAIL"), std::string::npos);
  EXPECT_EQ(page.find("data:image"), std::string::npos);
  EXPECT_NE(page.find("<h2>more</h2>"), std::string::npos);
}

}  // namespace
}  // namespace vcharge
