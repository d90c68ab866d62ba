// Observations of slightly different points of a wall are aligned with one point.
#include "vcharge_reconstruction/landmarks/landmark_alignment.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "vcharge_core/base/quantile.h"
#include "vcharge_reconstruction/testing/wall_scene.h"

namespace vcharge {
namespace {

using testing::kKeyframes;
using testing::WallScene;

constexpr double kError_px = 0.7;

/// Observations of all cameras and keyframes with errors up to kError_px.
WallScene makeScene() {
  WallScene scene;
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> aside_px(-kError_px, kError_px);
  for (Track& track : scene.data.tracks) {
    track.observations.clear();
    for (int32_t k = 0; k < kKeyframes; ++k) {
      for (int32_t camera = 0; camera < 2; ++camera) {
        Eigen::Vector2d pixel;
        if (scene.see(*track.position_m, k, camera, &pixel)) {
          track.observations.push_back(
              {k, camera, -1, pixel + Eigen::Vector2d(aside_px(generator), aside_px(generator)), 0.6});
        }
      }
    }
  }
  return scene;
}

/// Differences between a landmark's position errors at consecutive keyframes.
std::vector<double> differencesOf(const WallScene& scene) {
  std::vector<double> differences_px;
  for (const Track& track : scene.data.tracks) {
    for (size_t i = 0; i < track.observations.size(); ++i) {
      for (size_t j = i + 1; j < track.observations.size(); ++j) {
        const TrackObservation &a = track.observations[i], &b = track.observations[j];
        Eigen::Vector2d in_a, in_b;
        if (a.camera == b.camera && scene.see(*track.position_m, a.keyframe, a.camera, &in_a) &&
            scene.see(*track.position_m, b.keyframe, b.camera, &in_b)) {
          differences_px.push_back(((a.position_px - in_a) - (b.position_px - in_b)).norm());
        }
      }
    }
  }
  return differences_px;
}

size_t numObservations(const WallScene& scene) {
  size_t number = 0;
  for (const Track& track : scene.data.tracks) {
    number += track.observations.size();
  }
  return number;
}

TEST(LandmarkAlignmentTest, AlignsAllObservationsWithOnePoint) {
  WallScene scene = makeScene();
  ASSERT_GT(quantile(differencesOf(scene), 0.5), 0.6);
  const int64_t num_aligned = alignLandmarks(LandmarkAlignmentOptions(), scene.images, &scene.data);
  EXPECT_GT(num_aligned, 0.7 * static_cast<double>(numObservations(scene)));
  // Errors grow with the scale: 0.7 pixels at the first keyframe are 0.8 at the last.
  EXPECT_LT(quantile(differencesOf(scene), 0.5), 0.1);
  EXPECT_LT(quantile(differencesOf(scene), 0.9), 0.25);
  for (const Track& track : scene.data.tracks) {
    for (const TrackObservation& seen : track.observations) {
      EXPECT_TRUE(seen.sigma_px < 0.3 || seen.sigma_px == kImpreciseSigma_px) << seen.sigma_px;
    }
  }
}

TEST(LandmarkAlignmentTest, LeavesAWrongObservationWithLessWeight) {
  WallScene scene = makeScene();
  Track& track = *std::find_if(scene.data.tracks.begin(), scene.data.tracks.end(),
                               [](const Track& t) { return t.observations.size() == 6; });
  TrackObservation& last = track.observations.back();
  last.position_px += Eigen::Vector2d(30.0, 10.0);
  const Eigen::Vector2d before_px = last.position_px;
  alignLandmarks(LandmarkAlignmentOptions(), scene.images, &scene.data);
  EXPECT_EQ(last.position_px, before_px);
  EXPECT_EQ(last.sigma_px, kImpreciseSigma_px);
}

TEST(LandmarkAlignmentTest, ChangesNothingWithoutImages) {
  WallScene scene = makeScene();
  const std::vector<double> before_px = differencesOf(scene);
  EXPECT_EQ(alignLandmarks(LandmarkAlignmentOptions(), KeyframeImages::ofAllKeyframes(), &scene.data), 0);
  EXPECT_EQ(differencesOf(scene), before_px);
}

TEST(LandmarkAlignmentTest, GivesTheSameOnOneThread) {
  WallScene parallel = makeScene(), serial = makeScene();
  alignLandmarks(LandmarkAlignmentOptions(), parallel.images, &parallel.data);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  alignLandmarks(LandmarkAlignmentOptions(), serial.images, &serial.data);
  EXPECT_EQ(differencesOf(parallel), differencesOf(serial));
}

}  // namespace
}  // namespace vcharge
