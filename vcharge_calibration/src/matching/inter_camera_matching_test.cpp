// Two cameras in front of a textured wall: landmarks of one are found in the image of the other.
#include "matching/inter_camera_matching.h"

#include <memory>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "vcharge_core/base/quantile.h"
#include "vcharge_reconstruction/testing/wall_scene.h"

namespace vcharge {
namespace {

using testing::kKeyframes;
using testing::WallScene;

InterCameraOptions makeOptions() {
  InterCameraOptions options;
  options.keyframe_step = 1;
  options.min_overlap = 5;
  return options;
}

TEST(InterCameraMatchingTest, FindsLandmarksOfTheNeighbour) {
  WallScene scene;
  const int64_t num_found = matchBetweenCameras(makeOptions(), scene.images, &scene.data);
  EXPECT_GT(num_found, 60);
  int64_t num_added = 0;
  std::vector<int> by_keyframe(kKeyframes, 0);
  std::vector<double> errors_px;
  for (const Track& track : scene.data.tracks) {
    for (const TrackObservation& observation : track.observations) {
      if (observation.camera != 1) {
        continue;
      }
      ++num_added;
      ++by_keyframe[observation.keyframe];
      Eigen::Vector2d truth;
      ASSERT_TRUE(scene.see(*track.position_m, observation.keyframe, 1, &truth));
      errors_px.push_back((observation.position_px - truth).norm());
    }
  }
  EXPECT_EQ(num_added, num_found);
  EXPECT_LT(quantile(errors_px, 0.5), 0.35);
  EXPECT_LT(quantile(errors_px, 1.0), 1.5) << "a wrong match is some pixels off";
  for (const int count : by_keyframe) {
    EXPECT_GT(count, 10);
  }
}

TEST(InterCameraMatchingTest, FindsLandmarksWithAnInaccurateRig) {
  WallScene scene;
  const auto truth = scene.data.rig;
  auto wrong = std::make_shared<CameraRig>(*truth);
  const RigidTransform& extrinsics = *wrong->cameras[1].vehicle_from_camera;
  wrong->cameras[1].vehicle_from_camera = RigidTransform(
      rotationFromVector({0.0, 0.004, 0.008}) * extrinsics.rotation(), extrinsics.translation());
  scene.data.rig = wrong;
  EXPECT_GT(matchBetweenCameras(makeOptions(), scene.images, &scene.data), 50);
  scene.data.rig = truth;
  std::vector<double> errors_px;
  for (const Track& track : scene.data.tracks) {
    for (const TrackObservation& observation : track.observations) {
      Eigen::Vector2d pixel;
      ASSERT_TRUE(scene.see(*track.position_m, observation.keyframe, observation.camera, &pixel));
      errors_px.push_back(observation.camera == 1 ? (observation.position_px - pixel).norm() : 0.0);
    }
  }
  // The errors of the predictions are 1.5 pixels and more.
  EXPECT_LT(quantile(errors_px, 0.9), 0.8);
}

TEST(InterCameraMatchingTest, HandlesMissingImagesAndASingleCamera) {
  WallScene scene;
  EXPECT_EQ(matchBetweenCameras(makeOptions(), KeyframeImages::ofAllKeyframes(), &scene.data), 0);
  auto one = std::make_shared<CameraRig>();
  one->cameras = {scene.data.rig->cameras[0]};
  scene.data.rig = one;
  EXPECT_EQ(matchBetweenCameras(makeOptions(), scene.images, &scene.data), 0);
}

TEST(InterCameraMatchingTest, GivesTheSameOnOneThread) {
  WallScene parallel, serial;
  matchBetweenCameras(makeOptions(), parallel.images, &parallel.data);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  matchBetweenCameras(makeOptions(), serial.images, &serial.data);
  for (size_t t = 0; t < parallel.data.tracks.size(); ++t) {
    const auto& a = parallel.data.tracks[t].observations;
    const auto& b = serial.data.tracks[t].observations;
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].position_px, b[i].position_px);
    }
  }
}

}  // namespace
}  // namespace vcharge
