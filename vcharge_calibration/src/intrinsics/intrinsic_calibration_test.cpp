#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/SVD>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "boards/board_pose.h"
#include "intrinsics/intrinsic_optimizer.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

const cv::Size kSize(1280, 800);

CameraModel meiCamera() {
  Eigen::Matrix<double, 9, 1> parameters;
  parameters << 1.15, 895.5, 894.7, 649.6, 398.7, -0.33, 0.0865, -0.00067, -0.00004;
  return CameraModel::create("mei", parameters);
}

/// Views of a board in random poses up to the rim, with Gaussian noise on the corners.
std::vector<BoardView> randomViews(const CalibrationBoard& board, const CameraModel& model, int count,
                                   double noise_px, uint32_t seed,
                                   std::vector<RigidTransform>* poses = nullptr) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<BoardView> views;
  while (static_cast<int>(views.size()) < count) {
    const double angle_rad = uniform(0.0, 1.45);
    const double azimuth_rad = uniform(0.0, 6.28);
    const double distance_m = uniform(0.5, 1.2);
    const Eigen::Vector3d middle =
        distance_m * Eigen::Vector3d(std::sin(angle_rad) * std::cos(azimuth_rad),
                                     std::sin(angle_rad) * std::sin(azimuth_rad), std::cos(angle_rad));
    // The board faces the camera, then is rotated and tilted.
    const Eigen::Quaterniond facing = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), middle);
    const double turn_rad = uniform(-0.6, 0.6);
    const double tilt_x_rad = uniform(-0.5, 0.5);
    const double tilt_y_rad = uniform(-0.5, 0.5);
    const RigidTransform pose =
        RigidTransform(facing, middle) *
        RigidTransform(rotationFromYawPitchRoll(turn_rad, tilt_y_rad, tilt_x_rad), Eigen::Vector3d::Zero()) *
        RigidTransform(Eigen::Quaterniond::Identity(),
                       -0.5 * (board.corner(0) + board.corner(board.numCorners() - 1)));
    BoardView view;
    view.image = "view" + std::to_string(views.size());
    for (int i = 0; i < board.numCorners(); ++i) {
      Eigen::Vector2d pixel;
      if (model.project(pose * board.corner(i), &pixel) && pixel.x() > 5 && pixel.y() > 5 &&
          pixel.x() < kSize.width - 6 && pixel.y() < kSize.height - 6) {
        const double x = noise_px * noise(random);
        const double y = noise_px * noise(random);
        view.corners.push_back({i, pixel + Eigen::Vector2d(x, y)});
      }
    }
    // Boards that extend beyond the image cover its rim.
    if (2 * static_cast<int>(view.corners.size()) >= board.numCorners()) {
      views.push_back(view);
      if (poses != nullptr) {
        poses->push_back(pose);
      }
    }
  }
  return views;
}

/// RMS difference per coordinate, in pixels, between the images of the same rays in two cameras over the
/// whole image. The camera frames may differ by a rotation, which boards in unknown poses cannot distinguish
/// from a shifted principal point.
double projectionDifference(const CameraModel& truth, const CameraModel& fitted) {
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector3d>> pixels;
  for (int y = 10; y < kSize.height; y += 20) {
    for (int x = 10; x < kSize.width; x += 20) {
      Eigen::Vector3d true_ray;
      Eigen::Vector3d fitted_ray;
      if (truth.unproject({x, y}, &true_ray) && fitted.unproject({x, y}, &fitted_ray) && true_ray.z() > 0.1) {
        correlation += fitted_ray * true_ray.transpose();
        pixels.emplace_back(Eigen::Vector2d(x, y), true_ray);
      }
    }
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d fitted_from_truth = svd.matrixU() * svd.matrixV().transpose();
  double squared = 0.0;
  for (const auto& [pixel, ray] : pixels) {
    Eigen::Vector2d projected;
    EXPECT_TRUE(fitted.project(fitted_from_truth * ray, &projected));
    squared += (projected - pixel).squaredNorm();
  }
  EXPECT_GT(pixels.size(), 1000U);
  return std::sqrt(squared / (2.0 * static_cast<double>(pixels.size())));
}

TEST(BoardPoseTest, IsExactWithoutNoiseUpToTheRim) {
  const CalibrationBoard board{9, 6, 0.1};
  const CameraModel model = meiCamera();
  std::vector<RigidTransform> poses;
  const std::vector<BoardView> views = randomViews(board, model, 50, 0.0, 3, &poses);
  for (size_t v = 0; v < views.size(); ++v) {
    const auto pose = boardPose(board, views[v].corners, model);
    ASSERT_TRUE(pose.has_value());
    EXPECT_LT((pose->translation() - poses[v].translation()).norm(), 1e-6);
    EXPECT_LT(angleOfRotation(pose->rotation().conjugate() * poses[v].rotation()), 1e-6);
  }
}

TEST(BoardPoseTest, TooFewOrCollinearRaysHaveNone) {
  const CalibrationBoard board{9, 6, 0.1};
  const CameraModel model = meiCamera();
  std::vector<BoardCorner> row = randomViews(board, model, 1, 0.0, 3)[0].corners;
  row.resize(3);
  EXPECT_FALSE(boardPose(board, row, model).has_value());
  EXPECT_FALSE(boardPoseFromRays({}).has_value());
  const BoardRay same{{0.0, 0.0}, Eigen::Vector3d::UnitZ()};
  EXPECT_FALSE(boardPoseFromRays({same, same, same, same, same}).has_value());
}

TEST(IntrinsicOptimizerTest, FindsEveryModelWithoutAnInitialFocalLength) {
  const CalibrationBoard board{9, 6, 0.1};
  Eigen::Matrix<double, 8, 1> kannala_brandt;
  kannala_brandt << 420.0, 421.0, 645.0, 402.0, 0.02, -0.006, 0.002, -0.0004;
  for (const CameraModel& truth : {meiCamera(), CameraModel::create("kannala_brandt", kannala_brandt)}) {
    const std::vector<BoardView> views = randomViews(board, truth, 30, 0.0, 5);
    const auto fit = fitFromScratch(truth.name(), kSize, board, views);
    ASSERT_TRUE(fit.has_value());
    EXPECT_LT(projectionDifference(truth, fit->model), 1e-3) << truth.name();
  }
}

TEST(IntrinsicOptimizerTest, KnowsItsErrors) {
  // Normalized squared error over 20 seeds: chi-squared with 9 x 20 degrees of freedom.
  const CalibrationBoard board{9, 6, 0.1};
  const CameraModel truth = meiCamera();
  constexpr double kNoise_px = 0.15;
  double sum = 0.0;
  int beyond_three_sigma = 0;
  double squared_px = 0.0;
  constexpr int kSeeds = 20;
  for (uint32_t seed = 1; seed <= kSeeds; ++seed) {
    const std::vector<BoardView> views = randomViews(board, truth, 60, kNoise_px, seed);
    const auto fit = fitCamera(board, views, truth, {});
    ASSERT_TRUE(fit.has_value());
    const auto covariance = intrinsicsCovariance(board, views, *fit, {Loss::kSquared, kNoise_px});
    ASSERT_TRUE(covariance.has_value());
    const Eigen::VectorXd error = fit->model.parameters() - truth.parameters();
    sum += error.dot(covariance->ldlt().solve(error));
    beyond_three_sigma +=
        static_cast<int>((error.array().abs() > 3.0 * covariance->diagonal().array().sqrt()).count());
    const double difference_px = projectionDifference(truth, fit->model);
    squared_px += difference_px * difference_px / kSeeds;
  }
  const double freedom = 9.0 * kSeeds;
  std::printf("normalized error squared %.1f of %.0f, %d beyond 3 sigma, %.3f px RMS over the image\n", sum,
              freedom, beyond_three_sigma, std::sqrt(squared_px));
  EXPECT_LT(std::sqrt(squared_px), 0.1);
  EXPECT_NEAR(sum, freedom, 3.5 * std::sqrt(2.0 * freedom));
  EXPECT_LE(beyond_three_sigma, 3);
}

TEST(CalibrationBoardTest, SizesThatAreNoneAreNamed) {
  for (const char* bad : {"9", "9x", "x6", "2x6", "9x2", "9*6", "-9x6", "9x6x2", ""}) {
    EXPECT_THROW(CalibrationBoard::parse(bad, 0.1), std::invalid_argument) << bad;
  }
  EXPECT_THROW(CalibrationBoard::parse("9x6", 0.0), std::invalid_argument);
  EXPECT_THROW(CalibrationBoard::parse("9x6", std::nan("")), std::invalid_argument);
  EXPECT_EQ(CalibrationBoard::parse("9x6", 0.1).numCorners(), 54);
}

const auto kNoProgress = [](double /*fraction*/) {};

TEST(CalibrateIntrinsicsTest, WithoutABoardItFailsAndSaysSo) {
  const cv::Mat gray(200, 300, CV_8UC1, cv::Scalar(90));
  const IntrinsicCalibration result = calibrateIntrinsics({9, 6, 0.1}, {{"a", gray}, {"b", gray}},
                                                          IntrinsicCalibrationOptions(), kNoProgress);
  EXPECT_EQ(result.verdict, Verdict::kFail);
  EXPECT_FALSE(result.model.has_value());
  ASSERT_EQ(result.remarks.size(), 1U);
  EXPECT_NE(result.remarks[0].find("9x6"), std::string::npos);
}

TEST(CalibrateIntrinsicsTest, ImagesOfTwoSizesAreAnError) {
  const std::vector<CalibrationImage> images = {{"a.png", cv::Mat(200, 300, CV_8UC1)},
                                                {"b.png", cv::Mat(300, 200, CV_8UC1)}};
  try {
    calibrateIntrinsics({9, 6, 0.1}, images, IntrinsicCalibrationOptions(), kNoProgress);
    FAIL() << "expected an error";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("b.png"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("300x200"), std::string::npos);
  }
}

std::vector<CalibrationImage> realImages(const std::string& name) {
  const char* data = std::getenv("VCHARGE_DATA");
  std::vector<CalibrationImage> images;
  if (data == nullptr) {
    return images;
  }
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(data) + "/" + name + "/images")) {
    paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  for (const std::string& path : paths) {
    images.push_back(
        {std::filesystem::path(path).filename().string(), cv::imread(path, cv::IMREAD_GRAYSCALE)});
  }
  return images;
}

TEST(CalibrateIntrinsicsTest, FindsTheBoardsOfAPublishedFisheyeAndBeatsItsError) {
  const std::vector<CalibrationImage> images = realImages("chessboard_fisheye1");
  if (images.empty()) {
    GTEST_SKIP() << "VCHARGE_DATA is not set";
  }
  for (const char* model : {"mei", "kannala_brandt"}) {
    IntrinsicCalibrationOptions options;
    options.model = model;
    const IntrinsicCalibration result = calibrateIntrinsics({6, 8, 0.0325}, images, options, kNoProgress);
    EXPECT_EQ(result.verdict, Verdict::kPass) << model;
    const auto complete =
        std::count_if(result.views.begin(), result.views.end(),
                      [](const CalibratedView& view) { return view.view.corners.size() == 48; });
    EXPECT_GE(complete, 14) << model;
    EXPECT_LE(result.rms_px, 0.2838) << model;  // published result
    EXPECT_LE(result.cross_validated_px, 1.2 * result.rms_px) << model;
    std::printf("%s: %td complete boards of %zu, %.4f px RMS per coordinate, %.4f px unseen\n", model,
                complete, images.size(), result.rms_px, result.cross_validated_px);
  }
}

TEST(CalibrateIntrinsicsTest, CalibratesAVchargeCameraOnNearlyAllImages) {
  const std::vector<CalibrationImage> images = realImages("chessboard_vcharge");
  if (images.empty()) {
    GTEST_SKIP() << "VCHARGE_DATA is not set";
  }
  const IntrinsicCalibration result =
      calibrateIntrinsics({9, 6, 0.12}, images, IntrinsicCalibrationOptions(), kNoProgress);
  EXPECT_EQ(result.verdict, Verdict::kPass);
  const auto complete =
      std::count_if(result.views.begin(), result.views.end(),
                    [](const CalibratedView& view) { return view.view.corners.size() == 54; });
  EXPECT_GE(result.views.size(), 60U);
  EXPECT_GE(complete, 60);
  EXPECT_LE(result.rms_px, 0.26);
  EXPECT_LE(result.mean_error_px, 0.28);
  std::printf(
      "%td complete boards of %zu, %.4f px RMS per coordinate, %.4f px mean distance, %.4f px unseen\n",
      complete, images.size(), result.rms_px, result.mean_error_px, result.cross_validated_px);
}

}  // namespace
}  // namespace vcharge
