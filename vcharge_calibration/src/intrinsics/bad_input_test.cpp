#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "boards/board_renderer.h"
#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"
#include "vcharge_calibration/intrinsics/intrinsic_report.h"

namespace vcharge {
namespace {

const cv::Size kSize(640, 400);
const auto kNoProgress = [](double /*fraction*/) {};

// A lens of 170 degrees with a typical offset of the principal point.
CameraModel camera() {
  Eigen::Matrix<double, 8, 1> parameters;
  parameters << 212.0, 212.5, 326.0, 194.0, 0.01, -0.004, 0.001, -0.0002;
  return CameraModel::create("kannala_brandt", parameters);
}

IntrinsicCalibrationOptions options() {
  IntrinsicCalibrationOptions result;
  result.model = "kannala_brandt";
  return result;
}

const CalibrationBoard& board() {
  static const CalibrationBoard kBoard = CalibrationBoard::parse("9x6", 0.04);
  return kBoard;
}

/// 16 images of a board in all parts of the image, rendered once.
const std::vector<CalibrationImage>& goodImages() {
  static const std::vector<CalibrationImage> kImages =
      renderBoards(board(), camera(), kSize, boardPoses(board(), camera(), kSize, 16, {1.3, 0.35, 1.0}, 1));
  return kImages;
}

std::string firstRemark(const IntrinsicCalibration& result) {
  return result.remarks.empty() ? "" : result.remarks.front();
}

TEST(BadInputTest, GoodImagesPassSoThatTheOthersFailForTheirReason) {
  const IntrinsicCalibration result = calibrateIntrinsics(board(), goodImages(), options(), kNoProgress);
  EXPECT_NE(result.verdict, Verdict::kFail) << firstRemark(result);
  ASSERT_TRUE(result.model.has_value());
  EXPECT_LT(result.rms_px, 0.1);
  EXPECT_FALSE(result.bent_boards);
  EXPECT_GE(result.views.size(), 14U);
  const Eigen::VectorXd error = result.model->parameters() - camera().parameters();
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    EXPECT_LT(std::abs(error[i]), 4.0 * result.standard_deviations[i]) << i;
  }
  const double shift_px = (result.model->principalPoint() - camera().principalPoint()).cwiseAbs().maxCoeff();
  EXPECT_LT(shift_px, 4.0 * result.principal_point_sigma_px);
  EXPECT_LT(result.principal_point_sigma_px, 1.0);
  const auto radius_px = [](const CameraModel& model) {
    Eigen::Vector2d side_px;
    EXPECT_TRUE(model.project(Eigen::Vector3d(1.0, 0.0, 1.0), &side_px));
    return side_px.x() - model.principalPoint().x();
  };
  EXPECT_LT(std::abs(radius_px(*result.model) / radius_px(camera()) - 1.0), 4.0 * result.focal_sigma);
  EXPECT_LT(result.focal_sigma, 0.002);
  const std::string report = makeIntrinsicReport("title", board(), goodImages(), result);
  EXPECT_NE(report.find(toString(result.verdict)), std::string::npos);
  EXPECT_NE(report.find("image15"), std::string::npos);
  EXPECT_EQ(report.find("http://"), report.find("http://www.w3.org"));  // no external resources
}

TEST(BadInputTest, AnotherBoardIsNamed) {
  for (const auto& [columns, rows] : {std::pair<int, int>{8, 5}, {10, 7}}) {
    CalibrationBoard wrong = board();
    wrong.columns = columns;
    wrong.rows = rows;
    const std::vector<CalibrationImage> some(goodImages().begin(), goodImages().begin() + 2);
    const IntrinsicCalibration result = calibrateIntrinsics(wrong, some, options(), kNoProgress);
    EXPECT_EQ(result.verdict, Verdict::kFail) << columns << "x" << rows;
    EXPECT_FALSE(result.model.has_value());
    EXPECT_NE(firstRemark(result).find("9x6"), std::string::npos) << firstRemark(result);
  }
}

TEST(BadInputTest, OneImageIsNotEnough) {
  const IntrinsicCalibration result =
      calibrateIntrinsics(board(), {goodImages().front()}, options(), kNoProgress);
  EXPECT_EQ(result.verdict, Verdict::kFail);
  EXPECT_NE(firstRemark(result).find("1 of 1 images, at least 5"), std::string::npos) << firstRemark(result);
}

TEST(BadInputTest, BoardsInTheMiddleOnlyFailAndTheMissingPartsAreNamed) {
  const std::vector<CalibrationImage> images =
      renderBoards(board(), camera(), kSize, boardPoses(board(), camera(), kSize, 8, {0.15, 0.7, 1.0}, 2));
  const IntrinsicCalibration result = calibrateIntrinsics(board(), images, options(), kNoProgress);
  EXPECT_EQ(result.verdict, Verdict::kFail);
  EXPECT_FALSE(result.model.has_value());
  EXPECT_NE(firstRemark(result).find("only seen in the middle"), std::string::npos) << firstRemark(result);
  EXPECT_NE(firstRemark(result).find("upper left"), std::string::npos);
}

TEST(BadInputTest, SomeMirroredOrTurnedImagesAreNamed) {
  struct Case {
    int flip;
    size_t every;
    const char* how;
  };
  for (const Case& turn : {Case{1, 8, "mirrored left-right"}, Case{-1, 2, "turned by 180 degrees"}}) {
    {
      const size_t every = turn.every;
      std::vector<CalibrationImage> images = goodImages();
      for (size_t i = 0; i < images.size(); i += every) {
        cv::Mat flipped;
        cv::flip(images[i].pixels, flipped, turn.flip);
        images[i].pixels = flipped;
      }
      const IntrinsicCalibration result = calibrateIntrinsics(board(), images, options(), kNoProgress);
      EXPECT_EQ(result.verdict, Verdict::kFail) << turn.how << ", one in " << every;
      EXPECT_FALSE(result.model.has_value());
      EXPECT_NE(firstRemark(result).find(turn.how), std::string::npos) << firstRemark(result);
      if (every == 8U) {
        EXPECT_NE(firstRemark(result).find("image0, image8"), std::string::npos) << firstRemark(result);
      }
    }
  }
}

TEST(BadInputTest, ABlurredImageAndAWrongOneAreNamedAndLeftOut) {
  std::vector<CalibrationImage> images = goodImages();
  cv::Mat blurred;
  cv::blur(images[5].pixels, blurred, cv::Size(9, 1));
  images[5].pixels = blurred;
  cv::Mat warped;
  cv::resize(images[7].pixels, warped, cv::Size(), 1.0, 1.06, cv::INTER_CUBIC);
  // A stretched image: no view of this camera fits it.
  images[7].pixels = warped(cv::Rect(0, 0, kSize.width, kSize.height)).clone();
  const IntrinsicCalibration result = calibrateIntrinsics(board(), images, options(), kNoProgress);
  ASSERT_TRUE(result.model.has_value());
  const auto reasonFor = [&](const std::string& name) {
    for (const RejectedImage& image : result.rejected) {
      if (image.name == name) {
        return image.reason;
      }
    }
    return std::string();
  };
  EXPECT_NE(reasonFor("image7").find("times the usual one"), std::string::npos);
  const std::string blur = reasonFor("image5");
  EXPECT_TRUE(blur.find("blurred") != std::string::npos || blur.find("not found") != std::string::npos)
      << blur;
  EXPECT_TRUE(reasonFor("image3").empty());
}

TEST(AprilGridTest, IsCalibratedFromPartsAlsoAtTheRim) {
  const CalibrationBoard grid = CalibrationBoard::aprilGrid(6, 6, 0.088, 0.3);
  const std::vector<CalibrationImage> images =
      renderBoards(grid, camera(), kSize, boardPoses(grid, camera(), kSize, 12, {1.2, 0.55, 0.6}, 3));
  const IntrinsicCalibration result = calibrateIntrinsics(grid, images, options(), kNoProgress);
  ASSERT_TRUE(result.model.has_value()) << firstRemark(result);
  EXPECT_GE(result.views.size(), 10U);
  EXPECT_LT(result.rms_px, 0.15);
  const auto parts = std::count_if(result.views.begin(), result.views.end(), [&](const CalibratedView& view) {
    return static_cast<int>(view.view.corners.size()) < grid.numCorners();
  });
  EXPECT_GT(parts, 0);
  const Eigen::VectorXd error = result.model->parameters() - camera().parameters();
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    EXPECT_LT(std::abs(error[i]), 4.0 * result.standard_deviations[i]) << i;
  }
  std::printf("AprilGrid: %zu views, %.4f px RMS\n", result.views.size(), result.rms_px);
}

TEST(AprilGridTest, AMirroredImageIsNamed) {
  const CalibrationBoard grid = CalibrationBoard::aprilGrid(6, 6, 0.088, 0.3);
  std::vector<CalibrationImage> images =
      renderBoards(grid, camera(), kSize, boardPoses(grid, camera(), kSize, 2, {0.3, 0.7, 1.0}, 3));
  for (CalibrationImage& image : images) {
    cv::Mat flipped;
    cv::flip(image.pixels, flipped, 1);
    image.pixels = flipped;
  }
  const IntrinsicCalibration result = calibrateIntrinsics(grid, images, options(), kNoProgress);
  EXPECT_EQ(result.verdict, Verdict::kFail);
  EXPECT_NE(firstRemark(result).find("mirrored"), std::string::npos) << firstRemark(result);
}

}  // namespace
}  // namespace vcharge
