#include "vcharge_reconstruction/map_localizer.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "vcharge_core/base/error.h"
#include "vcharge_reconstruction/testing/test_map.h"

namespace vcharge {
namespace {

std::shared_ptr<const CameraRig> rigOf(const std::shared_ptr<const SparseMap>& map) {
  return std::shared_ptr<const CameraRig>(map, &map->rig());
}

/// A pose half way between two keyframes, slightly beside the path.
RigidTransform posesBetween(const SparseMap& map, size_t keyframe) {
  const RigidTransform between = interpolate(map.keyframes()[keyframe].map_from_vehicle,
                                             map.keyframes()[keyframe + 1].map_from_vehicle, 0.5);
  return between * RigidTransform::planar(0.1, 0.4, 0.05);
}

PosePrior priorAbout(const RigidTransform& truth, double shift_m, double turn_rad) {
  PosePrior prior;
  prior.map_from_vehicle = truth * RigidTransform::planar(shift_m, -0.5 * shift_m, turn_rad);
  prior.covariance.diagonal() << 0.04, 0.04, 0.0004, 1e-5, 1e-5, 4e-4;
  return prior;
}

std::shared_ptr<const TiledMap> tiled(const std::shared_ptr<const SparseMap>& map) {
  return std::make_shared<const TiledMap>(map);
}

double positionError(const PoseFix& fix, const RigidTransform& truth) {
  return (fix.map_from_vehicle.translation() - truth.translation()).norm();
}

double turnError(const PoseFix& fix, const RigidTransform& truth) {
  return angleOfRotation(fix.map_from_vehicle.rotation().conjugate() * truth.rotation());
}

class MapLocalizerTest : public ::testing::Test {
 protected:
  const std::shared_ptr<const SparseMap> map_ = testing::makeTestMap({});
  const MapLocalizer localizer_{tiled(map_), rigOf(map_)};
};

TEST_F(MapLocalizerTest, FindsThePoseNearAnExpectedOne) {
  for (const double wrong : {0.0, 0.4}) {
    testing::TestViewOptions view;
    view.wrong_ratio = wrong;
    for (size_t keyframe = 2; keyframe + 2 < map_->keyframes().size(); keyframe += 5) {
      const RigidTransform truth = posesBetween(*map_, keyframe);
      const PoseFix fix =
          localizer_.localizeNear(testing::makeTestView(*map_, truth, view), priorAbout(truth, 0.15, 0.01));
      ASSERT_EQ(fix.status, LocalizationStatus::kLocalized) << "keyframe " << keyframe;
      EXPECT_LT(positionError(fix, truth), 0.02);
      EXPECT_LT(turnError(fix, truth), 0.002);
      EXPECT_GT(fix.numInliers(), 100);
      EXPECT_EQ(std::accumulate(fix.inliers_of_camera.begin(), fix.inliers_of_camera.end(), 0),
                fix.numInliers());
    }
  }
}

TEST_F(MapLocalizerTest, CovarianceMatchesTheError) {
  double sum = 0.0;
  int count = 0;
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    const RigidTransform truth = posesBetween(*map_, 3 + seed % 16);
    testing::TestViewOptions view;
    view.seed = seed;
    const PoseFix fix =
        localizer_.localizeNear(testing::makeTestView(*map_, truth, view), priorAbout(truth, 0.1, 0.0));
    ASSERT_EQ(fix.status, LocalizationStatus::kLocalized);
    Eigen::Matrix<double, 6, 1> error;
    error << fix.map_from_vehicle.translation() - truth.translation(),
        vectorFromRotation(fix.map_from_vehicle.rotation() * truth.rotation().conjugate());
    sum += error.dot(fix.covariance.inverse() * error) / 6.0;
    ++count;
  }
  EXPECT_GT(sum / count, 0.6);
  EXPECT_LT(sum / count, 1.6);
}

TEST_F(MapLocalizerTest, LocalizesWithOneCamera) {
  const RigidTransform truth = posesBetween(*map_, 8);
  testing::TestViewOptions view;
  view.camera_without_image = 1;
  const PoseFix fix =
      localizer_.localizeNear(testing::makeTestView(*map_, truth, view), priorAbout(truth, 0.1, 0.0));
  ASSERT_EQ(fix.status, LocalizationStatus::kLocalized);
  EXPECT_GT(fix.inliers_of_camera[0], 20);
  EXPECT_EQ(fix.inliers_of_camera[1], 0);
  EXPECT_LT(positionError(fix, truth), 0.03);
}

TEST_F(MapLocalizerTest, RelocalizesWithoutAPrior) {
  for (size_t keyframe = 2; keyframe + 2 < map_->keyframes().size(); keyframe += 4) {
    const RigidTransform truth = posesBetween(*map_, keyframe);
    const PoseFix fix = localizer_.localizeAnywhere(testing::makeTestView(*map_, truth, {}));
    ASSERT_EQ(fix.status, LocalizationStatus::kLocalized) << "keyframe " << keyframe;
    EXPECT_LT(positionError(fix, truth), 0.02);
    EXPECT_LT(turnError(fix, truth), 0.002);
  }
}

TEST_F(MapLocalizerTest, RelocalizationNeedsInliersPerCamera) {
  const RigidTransform truth = posesBetween(*map_, 8);
  const RigFeatures view = testing::makeTestView(*map_, truth, {});
  const PoseFix fix = localizer_.localizeAnywhere(view);
  ASSERT_EQ(fix.status, LocalizationStatus::kLocalized);
  MapLocalizerOptions options;
  options.min_inliers_per_camera_without_prior = fix.numInliers() / 2 + 20;  // two cameras
  const MapLocalizer stricter(tiled(map_), rigOf(map_), options);
  EXPECT_NE(stricter.localizeAnywhere(view).status, LocalizationStatus::kLocalized);
  EXPECT_EQ(stricter.localizeNear(view, priorAbout(truth, 0.1, 0.0)).status, LocalizationStatus::kLocalized);
}

TEST_F(MapLocalizerTest, RefusesViewsOfAnotherPlace) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    const RigFeatures foreign = testing::makeForeignView(*map_, seed);
    EXPECT_NE(localizer_.localizeAnywhere(foreign).status, LocalizationStatus::kLocalized);
    const PosePrior prior = priorAbout(posesBetween(*map_, seed), 0.0, 0.0);
    EXPECT_NE(localizer_.localizeNear(foreign, prior).status, LocalizationStatus::kLocalized);
  }
}

TEST_F(MapLocalizerTest, ReportsTooFewMatchesWithoutFeatures) {
  RigFeatures nothing;
  nothing.images.resize(2);
  nothing.rays_in_camera.resize(2);
  EXPECT_EQ(localizer_.localizeAnywhere(nothing).status, LocalizationStatus::kTooFewMatches);
  const PosePrior far = priorAbout(RigidTransform::planar(500.0, 0.0, 0.0), 0.0, 0.0);
  const RigFeatures view = testing::makeTestView(*map_, posesBetween(*map_, 5), {});
  EXPECT_EQ(localizer_.localizeNear(view, far).status, LocalizationStatus::kTooFewMatches);
}

TEST_F(MapLocalizerTest, GivesTheSameOnOneThread) {
  const RigFeatures view = testing::makeTestView(*map_, posesBetween(*map_, 6), {});
  const PoseFix parallel = localizer_.localizeAnywhere(view);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const PoseFix serial = localizer_.localizeAnywhere(view);
  EXPECT_EQ(parallel.map_from_vehicle.matrix(), serial.map_from_vehicle.matrix());
  EXPECT_EQ(parallel.numInliers(), serial.numInliers());
}

TEST(MapLocalizerTwinsTest, ReportsTwoEqualPlacesAsAmbiguous) {
  testing::TestMapOptions options;
  options.twin_offset_m = 100.0;
  const auto map = testing::makeTestMap(options);
  const MapLocalizer localizer(tiled(map), rigOf(map));
  const RigidTransform truth = posesBetween(*map, 8);
  testing::TestViewOptions view;
  const RigFeatures features = testing::makeTestView(*map, truth, view);
  const PoseFix fix = localizer.localizeAnywhere(features);
  EXPECT_EQ(fix.status, LocalizationStatus::kAmbiguous);
  EXPECT_GT(fix.second_best_ratio, 0.7);
  // A prior resolves the ambiguity.
  const PoseFix expected = localizer.localizeNear(features, priorAbout(truth, 0.1, 0.0));
  EXPECT_EQ(expected.status, LocalizationStatus::kLocalized);
  EXPECT_LT(positionError(expected, truth), 0.02);
}

/// A quarter of the image size: pixels are four times as wide, features still accurate to half a pixel.
TEST(MapLocalizerSizeTest, AcceptsThePixelErrorsOfSmallImages) {
  SparseMapContents contents = testing::makeTestMap({})->contents();
  contents.rig = parseCameraRig(R"(cameras:
  front:
    image_size_px: [320, 200]
    model: mei
    intrinsics: {xi: 1.15, gamma1: 223.9, gamma2: 223.7, u0: 162.4, v0: 99.7, k1: -0.33, k2: 0.0865, p1: -0.00067, p2: -0.00004}
    field_of_view_rad: 3.2289
    vehicle_from_camera: {translation_m: [3.6, 0.0, 0.6], rotation_xyzw: [0.5, -0.5, 0.5, -0.5]}
  left:
    image_size_px: [160, 120]
    model: kannala_brandt
    intrinsics: {fx: 47.5, fy: 47.75, cx: 80, cy: 60, k1: 0.01, k2: -0.002, k3: 0, k4: 0}
    vehicle_from_camera: {translation_m: [1.7, 1.0, 0.9], rotation_xyzw: [-0.70710678, 0, 0, 0.70710678]}
)",
                                "quarter", "");
  const auto map = std::make_shared<const SparseMap>(std::move(contents));
  const MapLocalizer localizer(tiled(map), rigOf(map));
  for (size_t keyframe = 2; keyframe + 2 < map->keyframes().size(); keyframe += 5) {
    const RigidTransform truth = posesBetween(*map, keyframe);
    testing::TestViewOptions view;
    view.noise_px = 0.5;
    const PoseFix fix =
        localizer.localizeNear(testing::makeTestView(*map, truth, view), priorAbout(truth, 0.1, 0.0));
    ASSERT_EQ(fix.status, LocalizationStatus::kLocalized) << "keyframe " << keyframe;
    EXPECT_GT(fix.numInliers(), 0.6 * fix.num_matches);
    EXPECT_LT(positionError(fix, truth), 0.05);
  }
}

/// A view of the map with the bits of the descriptors as numbers 0 and `one`.
RigFeatures withNumbers(RigFeatures features, float one) {
  for (ImageFeatures& image : features.images) {
    image.descriptors = testing::descriptorsAsNumbers(image.descriptors, one);
  }
  return features;
}

/// Distances depend on the descriptor: hundreds for SIFT, about 1 for RootSIFT.
TEST(MapLocalizerDescriptorTest, LocalizesWithRealDescriptorsAsWithBinaryOnes) {
  const auto map = testing::makeTestMap({});
  const RigidTransform truth = posesBetween(*map, 8);
  testing::TestViewOptions view;
  view.wrong_ratio = 0.3;
  const RigFeatures bits = testing::makeTestView(*map, truth, view);
  const PoseFix by_bits =
      MapLocalizer(tiled(map), rigOf(map)).localizeNear(bits, priorAbout(truth, 0.1, 0.0));
  ASSERT_EQ(by_bits.status, LocalizationStatus::kLocalized);
  for (const float one : {1.0F / 16.0F, 40.0F}) {
    SparseMapContents contents = map->contents();
    contents.descriptors = testing::descriptorsAsNumbers(contents.descriptors, one);
    contents.feature_options = "type: root_sift\n";
    const auto map_of_numbers = std::make_shared<const SparseMap>(std::move(contents));
    const MapLocalizer localizer(tiled(map_of_numbers), rigOf(map_of_numbers));
    const RigFeatures numbers = withNumbers(bits, one);
    const PoseFix near = localizer.localizeNear(numbers, priorAbout(truth, 0.1, 0.0));
    ASSERT_EQ(near.status, LocalizationStatus::kLocalized) << one;
    EXPECT_GT(near.numInliers(), by_bits.numInliers() / 2);
    const PoseFix anywhere = localizer.localizeAnywhere(numbers);
    ASSERT_EQ(anywhere.status, LocalizationStatus::kLocalized) << one;
    EXPECT_LT(positionError(anywhere, truth), 0.03);
    const RigFeatures foreign = withNumbers(testing::makeForeignView(*map, 3), one);
    EXPECT_NE(localizer.localizeAnywhere(foreign).status, LocalizationStatus::kLocalized);
    // Descriptors as different as those of two landmarks are not matched.
    EXPECT_LT(localizer.localizeNear(foreign, priorAbout(truth, 0.0, 0.0)).num_matches, 10);
  }
}

TEST(MapLocalizerInputTest, NamesTheDefectOfAMap) {
  const auto map = testing::makeTestMap({});
  const auto expectError = [&](const char* text, const auto& change) {
    SparseMapContents contents = map->contents();
    change(&contents);
    const auto bad = std::make_shared<const SparseMap>(std::move(contents));
    try {
      MapLocalizer localizer(tiled(bad), rigOf(map));
      FAIL() << "expected an error with: " << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
    }
  };
  expectError("feature_options", [](SparseMapContents* contents) { contents->feature_options = "type: {"; });
  expectError("feature_options",
              [](SparseMapContents* contents) { contents->feature_options = "detector: another\n"; });
  expectError("descriptors",
              [](SparseMapContents* contents) { contents->feature_options = "type: root_sift\n"; });
  CameraRig bare = map->rig();
  bare.cameras[0].vehicle_from_camera.reset();
  EXPECT_THROW(MapLocalizer(tiled(map), std::make_shared<const CameraRig>(bare)), InputError);
  MapLocalizerOptions options;
  options.max_radius_px = 1.0;
  EXPECT_THROW(MapLocalizer(tiled(map), rigOf(map), options), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
