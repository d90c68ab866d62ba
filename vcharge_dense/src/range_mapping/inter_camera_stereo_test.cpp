#include "range_mapping/inter_camera_stereo.h"

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "reference/plane_sweep_test_support.h"

namespace vcharge {
namespace {

/// Two cameras whose axes are 90 degrees and whose centres are 2 m apart, with different models and sizes.
struct Corner {
  static constexpr size_t kFrontIndex = 0, kLeftIndex = 1;
  MeiCamera models[2] = {MeiCamera(1.158, 224.0, 223.5, 162.0, 99.5),
                         MeiCamera(1.05, 230.0, 231.0, 150.0, 105.0)};
  cv::Size sizes[2] = {{320, 200}, {304, 208}};
  RigidTransform poses[2] = {cameraPose({3.6, 0.0, 0.7}, 0.0, 0.2), cameraPose({1.9, 1.0, 0.9}, 1.5708, 0.5)};
  cv::Mat masks[2];

  std::vector<std::optional<StereoCamera>> cameras() const {
    std::vector<std::optional<StereoCamera>> cameras;
    WorkingCameraOptions full_size;
    full_size.image_scale = 1.0;
    for (size_t i = 0; i < 2; ++i) {
      cameras.push_back(StereoCamera{WorkingCamera(models[i], sizes[i], 3.1, masks[i], full_size), poses[i]});
    }
    return cameras;
  }
  std::vector<cv::Mat> render(const AnalyticScene& scene) const {
    std::vector<cv::Mat> images;
    for (size_t i = 0; i < 2; ++i) {
      images.push_back(scene.render(models[i], sizes[i], poses[i], 1.0, static_cast<uint32_t>(i + 1)));
    }
    return images;
  }
};

const Timestamp kStamp = Timestamp::fromNanoseconds(1000000000);

/// Ground and a box that faces the corner between the two cameras, 3 m from both.
AnalyticScene boxScene() {
  return AnalyticScene({{{0, 0, 0}, {0, 0, 1}}, {{5.1, 3.4, 0.6}, {-1, -1, 0}, {0.9, 0.9, 0.6}}}, 5);
}

struct Counts {
  int known = 0, right = 0, possible = 0;
};

/// Known and right ranges on surfaces from 1.5 m up to `max_range_m` inside the overlap.
Counts count(const RangeMap& map, const cv::Mat& truth, const cv::Mat& overlap, double max_range_m) {
  Counts counts;
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const double true_range = truth.at<double>(y, x);
      if (overlap.at<uint8_t>(y, x) != 0 && true_range > 1.5 && true_range < max_range_m) {
        const float range = map.range_m.at<float>(y, x);
        ++counts.possible;
        counts.known += std::isnan(range) ? 0 : 1;
        counts.right += std::abs(range - true_range) <= 0.05 * true_range ? 1 : 0;
      }
    }
  }
  return counts;
}

TEST(InterCameraStereoTest, MeasuresGroundAndABoxWithoutMotion) {
  const Corner corner;
  const AnalyticScene scene = boxScene();
  const InterCameraStereo stereo(corner.cameras(), PlaneSweepOptions());
  const auto images = stereo.instant(kStamp, corner.render(scene));
  for (const size_t i : {Corner::kFrontIndex, Corner::kLeftIndex}) {
    ASSERT_TRUE(stereo.canMeasure(*images, i));
    const RangeMap map = stereo.rangeMap(*images, i);
    const cv::Mat truth = scene.range(corner.models[i], corner.sizes[i], corner.poses[i]);
    EXPECT_EQ(map.stamp, kStamp);
    ASSERT_EQ(map.range_m.size(), corner.sizes[i]);
    const Counts counts = count(map, truth, stereo.overlap(i), 5.0);
    EXPECT_GE(counts.possible, 0.05 * corner.sizes[i].area());
    EXPECT_GE(counts.known, 0.5 * counts.possible);
    EXPECT_GE(counts.right, 0.97 * counts.known);
    EXPECT_EQ(cv::countNonZero((map.range_m == map.range_m) & (stereo.overlap(i) == 0)), 0);
    EXPECT_EQ(cv::countNonZero((map.confidence > 0.0) & (map.range_m != map.range_m)), 0);
    EXPECT_EQ(cv::countNonZero(map.range_m > InterCameraStereo::kMaxRange_m), 0);
  }
}

TEST(InterCameraStereoTest, FindsTheBoxAndNotTheGroundBehindIt) {
  const Corner corner;
  const AnalyticScene scene = boxScene();
  const InterCameraStereo stereo(corner.cameras(), PlaneSweepOptions());
  const RangeMap map = stereo.rangeMap(*stereo.instant(kStamp, corner.render(scene)), Corner::kFrontIndex);
  const cv::Mat truth = scene.range(corner.models[0], corner.sizes[0], corner.poses[0]);
  int on_box = 0, known = 0, right = 0;
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      Eigen::Vector3d ray;
      ASSERT_TRUE(corner.models[0].unproject(Eigen::Vector2d(x, y), &ray));
      const Eigen::Vector3d point = corner.poses[0] * (truth.at<double>(y, x) * ray);
      if (stereo.overlap(0).at<uint8_t>(y, x) != 0 && point.z() > 0.1) {  // false for NaN
        const float range = map.range_m.at<float>(y, x);
        ++on_box;
        known += std::isnan(range) ? 0 : 1;
        right += std::abs(range - truth.at<double>(y, x)) <= 0.05 * truth.at<double>(y, x) ? 1 : 0;
      }
    }
  }
  EXPECT_GE(on_box, 500);
  EXPECT_GE(known, 0.3 * on_box);
  EXPECT_GE(right, 0.95 * known);
}

TEST(InterCameraStereoTest, GivesTheSameBytesInAnyOrderAndOnAnyNumberOfThreads) {
  const Corner corner;
  const std::vector<cv::Mat> pixels = corner.render(boxScene());
  const InterCameraStereo stereo(corner.cameras(), PlaneSweepOptions());
  std::vector<std::string> hashes;
  for (const size_t threads : {1u, 2u, 5u}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const auto images = stereo.instant(kStamp, pixels);
    const size_t first = threads % 2;
    const std::string one = hashOf(stereo.rangeMap(*images, first));
    const std::string other = hashOf(stereo.rangeMap(*images, 1 - first));
    hashes.push_back(first == 0 ? one + other : other + one);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(InterCameraStereoTest, MaskedPixelsOfEitherCameraHaveNoEffect) {
  Corner corner;
  for (size_t i = 0; i < 2; ++i) {
    corner.masks[i] = cv::Mat(corner.sizes[i], CV_8UC1, cv::Scalar(255));
  }
  const cv::Rect front_hole(30, 60, 50, 60), left_hole(230, 60, 50, 60);
  corner.masks[0](front_hole).setTo(0);
  corner.masks[1](left_hole).setTo(0);
  const InterCameraStereo stereo(corner.cameras(), PlaneSweepOptions());
  std::vector<cv::Mat> pixels = corner.render(boxScene());
  const auto images = stereo.instant(kStamp, {pixels[0].clone(), pixels[1].clone()});
  pixels[0](front_hole).setTo(255);
  pixels[1](left_hole).setTo(0);
  const auto painted = stereo.instant(kStamp, pixels);
  for (const size_t i : {Corner::kFrontIndex, Corner::kLeftIndex}) {
    const RangeMap map = stereo.rangeMap(*images, i);
    EXPECT_EQ(hashOf(map), hashOf(stereo.rangeMap(*painted, i)));
    EXPECT_EQ(cv::countNonZero((map.range_m == map.range_m) & (corner.masks[i] == 0)), 0);
    EXPECT_GT(countKnown(map), 300);
  }
}

TEST(InterCameraStereoTest, NeedsTheImageOfACameraThatSeesTheSame) {
  Corner corner;
  const std::vector<cv::Mat> pixels = corner.render(boxScene());
  const InterCameraStereo stereo(corner.cameras(), PlaneSweepOptions());
  const auto front_only = stereo.instant(kStamp, {pixels[0], cv::Mat()});
  EXPECT_FALSE(stereo.canMeasure(*front_only, Corner::kFrontIndex));
  EXPECT_FALSE(stereo.canMeasure(*front_only, Corner::kLeftIndex));
  EXPECT_THROW(stereo.rangeMap(*front_only, Corner::kFrontIndex), std::logic_error);
  EXPECT_THROW(stereo.instant(kStamp, {pixels[0]}), std::logic_error);
  EXPECT_THROW(stereo.instant(kStamp, {pixels[1], pixels[0]}), std::logic_error);

  corner.poses[1] = cameraPose({-0.9, 0.0, 0.9}, 3.14159265358979, 0.2);  // a rear camera
  const InterCameraStereo apart(corner.cameras(), PlaneSweepOptions());
  EXPECT_FALSE(apart.canMeasure(*apart.instant(kStamp, pixels), Corner::kFrontIndex));
  EXPECT_EQ(cv::countNonZero(apart.overlap(Corner::kFrontIndex)), 0);
}

TEST(InterCameraStereoTest, ImagesWithoutTextureAreUnknown) {
  const Corner corner;
  const AnalyticScene bare({{{0, 0, 0}, {0, 0, 1}, Eigen::Vector3d::Constant(1e6), 0.0}}, 1);
  const InterCameraStereo stereo(corner.cameras(), PlaneSweepOptions());
  const RangeMap map = stereo.rangeMap(*stereo.instant(kStamp, corner.render(bare)), Corner::kFrontIndex);
  EXPECT_LE(countKnown(map), 10);
}

TEST(InterCameraStereoTest, RejectsOtherScenesInTheTwoImages) {
  const Corner corner;
  const AnalyticScene other({{{0, 0, 0}, {0, 0, 1}}}, 99);
  const InterCameraStereo stereo(corner.cameras(), PlaneSweepOptions());
  const auto images = stereo.instant(kStamp, {corner.render(boxScene())[0], corner.render(other)[1]});
  const RangeMap map = stereo.rangeMap(*images, Corner::kFrontIndex);
  // The left-right check accepts 2 x 0.01 1/m out of the 0.7 1/m between the nearest and farthest range.
  EXPECT_LE(countKnown(map), 0.03 * cv::countNonZero(stereo.overlap(Corner::kFrontIndex)));
}

}  // namespace
}  // namespace vcharge
