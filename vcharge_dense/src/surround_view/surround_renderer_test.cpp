#include "surround_view/surround_renderer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "surround_view/test_world.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr size_t kFront = 0, kLeft = 1;

SurroundViewOptions smallOptions() {
  SurroundViewOptions options;
  options.pixel_m = 0.05;
  options.reach_m = 4.0;
  return options;
}

std::vector<bool> all(const CameraRig& rig) {
  return std::vector<bool>(rig.cameras.size(), true);
}

/// A map of one occupied square around a point of the frame odom.
ObstacleMap mapWithObstacle(const Eigen::Vector2d& position_m, double half_side_m) {
  ObstacleMap map = ObstacleMap::unobserved({300, 300}, 0.1);
  map.frame_id = "odom";
  map.origin_m = {-15.0, -15.0};
  for (int row = 0; row < map.state.rows; ++row) {
    for (int column = 0; column < map.state.cols; ++column) {
      const Eigen::Vector2d middle(map.origin_m.x() + 0.1 * (column + 0.5),
                                   map.origin_m.y() + 0.1 * (row + 0.5));
      const bool is_near = (middle - position_m).cwiseAbs().maxCoeff() < half_side_m;
      map.state.at<int8_t>(row, column) = is_near ? kCellOccupied : kCellFree;
    }
  }
  return map;
}

class SurroundRendererTest : public ::testing::Test {
 protected:
  /// Calls visit(position in the vehicle frame, gray level, label) for all pixels outside the vehicle.
  template <class Visit>
  static void forEachPixel(const SurroundRenderer& renderer, const Visit& visit) {
    const ViewGrid& grid = renderer.grid();
    for (int row = 0; row < grid.size().height; ++row) {
      for (int column = 0; column < grid.size().width; ++column) {
        const Eigen::Vector2d position_m = grid.positionOf({column, row});
        if (grid.distanceToVehicle_m(position_m) > 0.1) {
          visit(position_m, renderer.image().at<uint8_t>(row, column),
                renderer.labels().at<uint8_t>(row, column));
        }
      }
    }
  }
  /// Root mean square of the view minus the formula, where cameras show the ground.
  static double groundError(const SurroundRenderer& renderer, const TestWorld& world,
                            const RigidTransform& odom_from_vehicle, double factor = 1.0) {
    double sum = 0.0;
    int count = 0;
    forEachPixel(renderer, [&](const Eigen::Vector2d& position_m, uint8_t gray, uint8_t label) {
      if (label < kSurroundMemory) {
        const Eigen::Vector3d in_odom =
            odom_from_vehicle * Eigen::Vector3d(position_m.x(), position_m.y(), 0.0);
        const double error = gray - factor * world.grayAt(in_odom.head<2>());
        sum += error * error;
        ++count;
      }
    });
    EXPECT_GT(count, 10000);
    return std::sqrt(sum / count);
  }
  uint8_t labelAt(const Eigen::Vector2d& position_m, const ImageFrame& frame, const CameraRig& rig) const {
    SurroundRenderer renderer(rig, options_, all(rig));
    renderer.render(frame);
    return labelAt(position_m, renderer);
  }
  static uint8_t labelAt(const Eigen::Vector2d& position_m, const SurroundRenderer& renderer) {
    const Eigen::Vector2d pixel = renderer.grid().pixelOf(position_m);
    return renderer.labels().at<uint8_t>(cv::Point(cvRound(pixel.x()), cvRound(pixel.y())));
  }
  /// Middles of the seam between the front and the left camera, at different distances from the vehicle.
  std::vector<Eigen::Vector2d> findSeam() const {
    SurroundRenderer renderer(rig_, options_, all(rig_));
    renderer.render(makeTestFrame(TestWorld(), rig_, RigidTransform()));
    std::vector<Eigen::Vector2d> middles;
    for (double x = 4.8; x < 6.9; x += 0.5) {
      double sum = 0.0;
      int count = 0;
      for (double y = 1.2; y < 4.8; y += 0.02) {
        if (labelAt({x, y}, renderer) == kSurroundBlend) {
          sum += y;
          ++count;
        }
      }
      if (count > 0) {
        middles.emplace_back(x, sum / count);
      }
    }
    return middles;
  }
  static int countLabel(const SurroundRenderer& renderer, uint8_t label) {
    return cv::countNonZero(renderer.labels() == label);
  }

  const CameraRig rig_ = makeTestRig();
  const SurroundViewOptions options_ = smallOptions();
};

TEST_F(SurroundRendererTest, ShowsTheGroundWithinTheErrorOfInterpolation) {
  const TestWorld world;
  SurroundRenderer renderer(rig_, options_, all(rig_));
  renderer.render(makeTestFrame(world, rig_, RigidTransform()));
  // Rounding alone gives 0.3; half a pixel of the view is up to 4 gray levels of this ground.
  EXPECT_LT(groundError(renderer, world, RigidTransform()), 1.5);
  for (size_t camera = 0; camera < rig_.cameras.size(); ++camera) {
    EXPECT_GT(countLabel(renderer, static_cast<uint8_t>(camera)), 2000) << rig_.cameras[camera].name;
  }
  EXPECT_GT(countLabel(renderer, kSurroundBlend), 500);
}

TEST_F(SurroundRendererTest, ShowsTheBowlLikeTheGroundNearTheVehicle) {
  SurroundViewOptions bowl = options_;
  bowl.view = SurroundSurface::kBowl;
  const TestWorld world;
  const ImageFrame frame = makeTestFrame(world, rig_, RigidTransform());
  SurroundRenderer flat_renderer(rig_, options_, all(rig_)), bowl_renderer(rig_, bowl, all(rig_));
  flat_renderer.render(frame);
  bowl_renderer.render(frame);
  double near = 0.0, far = 0.0;
  forEachPixel(flat_renderer, [&](const Eigen::Vector2d& position_m, uint8_t gray, uint8_t) {
    const Eigen::Vector2d pixel = bowl_renderer.grid().pixelOf(position_m);
    const int difference =
        std::abs(gray - bowl_renderer.image().at<uint8_t>(cv::Point(cvRound(pixel.x()), cvRound(pixel.y()))));
    double& largest = flat_renderer.grid().distanceToVehicle_m(position_m) < 1.3 ? near : far;
    largest = std::max<double>(largest, difference);
  });
  EXPECT_LE(near, 3.0);  // the exposure is compared at other places
  EXPECT_GT(far, 50.0);
}

TEST_F(SurroundRendererTest, EqualizesTheGainsOfTheCameras) {
  const TestWorld world;
  const std::vector<double> gains = {1.0, 1.5, 0.7, 1.2};
  SurroundRenderer renderer(rig_, options_, all(rig_));
  const ImageFrame frame = makeTestFrame(world, rig_, RigidTransform(), gains);
  renderer.render(frame);
  const double common = renderer.gains()[0] * gains[0];
  for (size_t camera = 0; camera < gains.size(); ++camera) {
    EXPECT_NEAR(renderer.gains()[camera] * gains[camera], common, 0.02) << rig_.cameras[camera].name;
  }
  EXPECT_LT(groundError(renderer, world, RigidTransform(), common), 2.5);
}

TEST_F(SurroundRendererTest, BrightensTheRimsOfTheImages) {
  TestWorld world;
  world.rim_loss = 0.4;
  const std::vector<double> gains = {1.1, 1.0, 0.8, 1.2};
  SurroundRenderer renderer(rig_, options_, all(rig_));
  renderer.render(makeTestFrame(world, rig_, RigidTransform(), gains));
  const double common = renderer.gains()[0] * gains[0];
  for (size_t camera = 0; camera < gains.size(); ++camera) {
    EXPECT_NEAR(renderer.gains()[camera] * gains[camera], common, 0.04) << rig_.cameras[camera].name;
  }
  // Without the correction, the ground at the rims is up to 40 % darker: 45 gray levels.
  EXPECT_LT(groundError(renderer, world, RigidTransform(), common), 5.0);
}

TEST_F(SurroundRendererTest, KeepsGainsWhereSomethingUnknownStandsInAnOverlap) {
  TestWorld world;
  world.posts = {{{4.9, 2.1}, 0.3, 1.5, 250.0}, {{-2.3, -2.0}, 0.3, 1.5, 10.0}};
  SurroundRenderer renderer(rig_, options_, all(rig_));
  renderer.render(makeTestFrame(world, rig_, RigidTransform()));
  for (const double gain : renderer.gains()) {
    EXPECT_NEAR(gain, 1.0, 0.02);
  }
}

/// Bright pixels behind a post on the lines of sight of two cameras.
struct ShownPost {
  int by_front = 0, by_left = 0;
};

ShownPost findPost(const SurroundRenderer& renderer, const CameraRig& rig, const Eigen::Vector2d& post_m) {
  ShownPost shown;
  const ViewGrid& grid = renderer.grid();
  for (const size_t camera : {kFront, kLeft}) {
    const Eigen::Vector2d from = rig.cameras[camera].vehicle_from_camera->translation().head<2>();
    const Eigen::Vector2d direction = (post_m - from).normalized();
    for (double distance_m = 0.5; distance_m < 1.4; distance_m += 0.05) {
      const Eigen::Vector2d pixel = grid.pixelOf(post_m + distance_m * direction);
      const int gray = renderer.image().at<uint8_t>(cv::Point(cvRound(pixel.x()), cvRound(pixel.y())));
      (camera == kFront ? shown.by_front : shown.by_left) += gray > 150 ? 1 : 0;
    }
  }
  return shown;
}

TEST_F(SurroundRendererTest, ShowsAPostInAnOverlapOnceWithTheObstacleMap) {
  TestWorld world;
  world.amplitude = 20.0;
  int num_spoiled = 0;
  // On the seam, and before it, seen from the front camera, whose image of the post crosses it.
  std::vector<Eigen::Vector2d> posts_m = findSeam();
  ASSERT_GE(posts_m.size(), 2U);
  posts_m.resize(2);
  posts_m.push_back(posts_m[0] - Eigen::Vector2d(0.0, 0.5));
  posts_m.push_back(posts_m[1] - Eigen::Vector2d(0.0, 0.7));
  for (const Eigen::Vector2d& post_m : posts_m) {
    world.posts = {{post_m}};
    const ImageFrame frame = makeTestFrame(world, rig_, RigidTransform());
    SurroundRenderer without(rig_, options_, all(rig_));
    without.render(frame);
    const ShownPost mixed = findPost(without, rig_, post_m);
    const bool is_whole = std::max(mixed.by_front, mixed.by_left) >= 15;
    num_spoiled += !is_whole || std::min(mixed.by_front, mixed.by_left) > 0 ? 1 : 0;
    SurroundRenderer renderer(rig_, options_, all(rig_));
    renderer.setObstacles(mapWithObstacle(post_m, 0.15));
    renderer.render(frame);
    const ShownPost shown = findPost(renderer, rig_, post_m);
    EXPECT_EQ(std::min(shown.by_front, shown.by_left), 0) << post_m.transpose();
    EXPECT_GE(std::max(shown.by_front, shown.by_left), 15) << post_m.transpose();
  }
  EXPECT_GE(num_spoiled, 1);  // otherwise the map changed nothing
}

TEST_F(SurroundRendererTest, KeepsTheCameraThatShowsAnObstacle) {
  const TestWorld world;
  SurroundRenderer renderer(rig_, options_, all(rig_));
  const ImageFrame frame = makeTestFrame(world, rig_, RigidTransform());
  // An obstacle that trembles across the line where both cameras see it equally well.
  const std::vector<Eigen::Vector2d> middles_m = findSeam();
  ASSERT_FALSE(middles_m.empty());
  const Eigen::Vector2d& middle_m = middles_m.front();
  int num_changes = 0;
  uint8_t last = kNoCamera;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector2d position_m = middle_m + Eigen::Vector2d(0.0, i % 2 == 0 ? 0.1 : -0.1);
    renderer.setObstacles(mapWithObstacle(position_m, 0.15));
    renderer.render(frame);
    const uint8_t label = labelAt(position_m, renderer);
    EXPECT_LT(label, kSurroundBlend);
    num_changes += last != kNoCamera && label != last ? 1 : 0;
    last = label;
  }
  EXPECT_EQ(num_changes, 0);
  // Well on either side, it is shown by the camera that sees it best.
  for (const auto& [offset_m, camera] : {std::make_pair(0.8, kLeft), std::make_pair(-0.8, kFront)}) {
    const Eigen::Vector2d position_m = middle_m + Eigen::Vector2d(0.0, offset_m);
    SurroundRenderer fresh(rig_, options_, all(rig_));
    fresh.setObstacles(mapWithObstacle(position_m, 0.15));
    fresh.render(frame);
    EXPECT_EQ(labelAt(position_m, fresh), camera);
  }
}

TEST_F(SurroundRendererTest, ShowsTheRestWithoutACamera) {
  const TestWorld world;
  SurroundRenderer renderer(rig_, options_, all(rig_));
  ImageFrame frame = makeTestFrame(world, rig_, RigidTransform());
  frame.images[kLeft] = Image();
  frame.has_image[kLeft] = false;
  renderer.render(frame);
  EXPECT_EQ(countLabel(renderer, kLeft), 0);
  EXPECT_LT(groundError(renderer, world, RigidTransform()), 1.5);
  EXPECT_EQ(labelAt({1.9, 2.5}, renderer), kSurroundUnknown);
  EXPECT_EQ(labelAt({6.0, 3.0}, renderer), kFront);
}

TEST_F(SurroundRendererTest, RemembersTheGroundBelowTheVehicle) {
  const TestWorld world;
  SurroundRenderer renderer(rig_, options_, all(rig_));
  RigidTransform pose;
  for (int step = 0; step <= 9; ++step) {
    pose = RigidTransform::planar(0.6 * step, 0.04 * step * step, 0.08 * step);
    renderer.render(makeTestFrame(world, rig_, pose));
    if (step == 0) {
      EXPECT_EQ(countLabel(renderer, kSurroundMemory), 0);
    }
  }
  const ViewGrid& grid = renderer.grid();
  // The vehicle is translucent: the ground is compared below its body, away from windows and rims.
  double sum = 0.0, worst = 0.0;
  int count = 0;
  for (double x = 0.8; x < 1.6; x += 0.1) {
    for (double y = -0.6; y < 0.65; y += 0.1) {
      const Eigen::Vector2d pixel = grid.pixelOf({x, y});
      const cv::Point nearest(cvRound(pixel.x()), cvRound(pixel.y()));
      ASSERT_EQ(renderer.labels().at<uint8_t>(nearest), kSurroundMemory);
      const Eigen::Vector2d position_m = grid.positionOf({nearest.x, nearest.y});
      const Eigen::Vector3d in_odom = pose * Eigen::Vector3d(position_m.x(), position_m.y(), 0.0);
      const double expected = world.grayAt(in_odom.head<2>());
      const double shown = (renderer.image().at<uint8_t>(nearest) * 255.0 - 70.0 * 140.0) / 115.0;
      sum += std::abs(shown - expected);
      worst = std::max(worst, std::abs(shown - expected));
      ++count;
    }
  }
  EXPECT_LT(sum / count, 3.0);
  EXPECT_LT(worst, 10.0);
  renderer.clearMemory();
  renderer.render(makeTestFrame(world, rig_, pose));
  EXPECT_EQ(countLabel(renderer, kSurroundMemory), 0);
  EXPECT_GT(countLabel(renderer, kSurroundUnknown), 2000);
}

TEST_F(SurroundRendererTest, RemembersNothingWithoutOdometry) {
  const TestWorld world;
  SurroundRenderer renderer(rig_, options_, all(rig_));
  for (int step = 0; step < 3; ++step) {
    ImageFrame frame = makeTestFrame(world, rig_, RigidTransform::planar(1.5 * step, 0.0, 0.0));
    frame.odom_from_vehicle.reset();
    renderer.render(frame);
  }
  EXPECT_EQ(countLabel(renderer, kSurroundMemory), 0);
}

TEST_F(SurroundRendererTest, LeavesOutMasksAndTrustsTheCameraWithTheSmallerCovariance) {
  const TestWorld world;
  const ImageFrame frame = makeTestFrame(world, rig_, RigidTransform());
  CameraRig masked = rig_;
  masked.cameras[kLeft].mask = cv::Mat::zeros(masked.cameras[kLeft].image_size_px, CV_8UC1);
  SurroundRenderer without_left(masked, options_, all(rig_));
  without_left.render(frame);
  EXPECT_EQ(countLabel(without_left, kLeft), 0);

  // A place that the left camera sees best, until its extrinsics are uncertain.
  const std::vector<Eigen::Vector2d> middles_m = findSeam();
  ASSERT_FALSE(middles_m.empty());
  const Eigen::Vector2d position_m = middles_m.front() + Eigen::Vector2d(0.0, 0.6);
  CameraRig uncertain = rig_;
  uncertain.cameras[kLeft].covariance = 4e-4 * Eigen::Matrix<double, 6, 6>::Identity();
  EXPECT_EQ(labelAt(position_m, frame, rig_), kLeft);
  EXPECT_EQ(labelAt(position_m, frame, uncertain), kFront);
}

TEST_F(SurroundRendererTest, GivesTheSameViewOnAnyNumberOfThreads) {
  TestWorld world;
  world.posts = {{{5.5, 2.5}}};
  const ImageFrame frame = makeTestFrame(world, rig_, RigidTransform(), {1.0, 1.3, 0.8, 1.1});
  std::vector<cv::Mat> images;
  for (const int threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    SurroundRenderer renderer(rig_, options_, all(rig_));
    renderer.setObstacles(mapWithObstacle({5.5, 2.5}, 0.2));
    renderer.render(frame);
    renderer.render(frame);
    images.push_back(renderer.image().clone());
  }
  EXPECT_EQ(cv::countNonZero(images[0] != images[1]), 0);
}

TEST_F(SurroundRendererTest, RejectsRigsThatSeeNoGround) {
  CameraRig without_extrinsics = rig_;
  without_extrinsics.cameras[kLeft].vehicle_from_camera.reset();
  EXPECT_THROW(SurroundRenderer(without_extrinsics, options_, all(rig_)), InputError);
  CameraRig blind = rig_;
  for (RigCamera& camera : blind.cameras) {
    camera.mask = cv::Mat::zeros(camera.image_size_px, CV_8UC1);
  }
  EXPECT_THROW(SurroundRenderer(blind, options_, all(rig_)), InputError);
}

}  // namespace
}  // namespace vcharge
