#pragma once

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <tbb/global_control.h>
#include <opencv2/core.hpp>

#include "reference/analytic_scene.h"
#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {

inline const cv::Size kSize(320, 200);
inline const MeiCamera kCamera(1.158, 224.0, 223.5, 162.0, 99.5);

/// Pose of a camera at a position (x forward, y left, z up) that faces an azimuth and is tilted downwards.
inline RigidTransform cameraPose(const Eigen::Vector3d& position, double azimuth_rad, double down_rad) {
  const Eigen::Quaterniond vehicle_from_optical(0.5, -0.5, 0.5, -0.5);  // z forward, x right, y down
  return RigidTransform(rotationFromYawPitchRoll(azimuth_rad, down_rad, 0.0) * vehicle_from_optical,
                        position);
}

struct Sequence {
  SweepImage reference;
  std::vector<SweepImage> neighbours;
  cv::Mat truth;  // range, CV_64FC1
  Plane ground;
};

/// Images every `step_m` along x, numbered from `first` to `last`; number 0 is the reference.
inline Sequence makeSequence(const AnalyticScene& scene, const RigidTransform& start, double step_m,
                             int first, int last, double noise = 0.0) {
  Sequence sequence;
  for (int i = first; i <= last; ++i) {
    const RigidTransform pose(start.rotation(), start.translation() + Eigen::Vector3d(i * step_m, 0.0, 0.0));
    SweepImage image{Timestamp::fromNanoseconds(1000000000 + i * 80000000),
                     scene.render(kCamera, kSize, pose, noise, static_cast<uint32_t>(100 + i)), pose};
    if (i == 0) {
      sequence.reference = image;
    } else {
      sequence.neighbours.push_back(image);
    }
  }
  sequence.truth = scene.range(kCamera, kSize, start);
  sequence.ground = groundInCamera(start);
  return sequence;
}

/// Crops the images of a sequence, as if a smaller camera had taken them.
inline void crop(const cv::Rect& part, Sequence* sequence) {
  sequence->reference.pixels = sequence->reference.pixels(part).clone();
  for (SweepImage& image : sequence->neighbours) {
    image.pixels = image.pixels(part).clone();
  }
}
inline MeiCamera croppedCamera(const cv::Rect& part) {
  return MeiCamera(kCamera.xi(), kCamera.gamma1(), kCamera.gamma2(), kCamera.u0() - part.x,
                   kCamera.v0() - part.y);
}

/// Disturbs the poses of the neighbours, which are in order of time, by odometry errors: a common scale
/// error, a random walk from image to image, and the jitter of the reference, which is common to all pairs.
inline void disturb(const PoseNoiseOptions& noise, std::mt19937* generator, Sequence* sequence) {
  const auto randomVector = [&](double sigma) {
    Eigen::Vector3d vector;
    for (int i = 0; i < 3; ++i) {
      vector[i] = sigma * normalNumber(generator);
    }
    return vector;
  };
  const double scale = noise.scale * normalNumber(generator);
  const Eigen::Vector3d jitter_m = randomVector(noise.translation_m);
  const Eigen::Vector3d jitter_rad = randomVector(noise.rotation_rad);
  const Eigen::Vector3d origin = sequence->reference.world_from_camera.translation();
  const auto walk = [&](auto begin, auto end, const auto isOnThisSide) {
    Eigen::Vector3d walked_m = jitter_m, walked_rad = jitter_rad, last = origin;
    for (auto image = begin; image != end; ++image) {
      if (!isOnThisSide(*image)) {
        continue;
      }
      const RigidTransform pose = image->world_from_camera;
      const double root_m = std::sqrt((pose.translation() - last).norm());
      last = pose.translation();
      walked_m += randomVector(noise.translation_m_per_sqrt_m * root_m);
      walked_rad += randomVector(noise.rotation_rad_per_sqrt_m * root_m);
      image->world_from_camera =
          RigidTransform(rotationFromVector(walked_rad) * pose.rotation(),
                         pose.translation() + scale * (pose.translation() - origin) + walked_m);
    }
  };
  const Timestamp now = sequence->reference.stamp;
  auto& images = sequence->neighbours;
  walk(images.rbegin(), images.rend(), [&](const SweepImage& image) { return image.stamp < now; });
  walk(images.begin(), images.end(), [&](const SweepImage& image) { return image.stamp > now; });
}

/// Runs a function with each instruction set of this machine.
template <class Function>
void onEveryTarget(const Function& function) {
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    function();
  }
  hwy::SetSupportedTargetsForTest(0);
}

inline cv::Mat allValid() {
  return cv::Mat(kSize, CV_8UC1, cv::Scalar(255));
}

inline PlaneSweepOptions plainOptions() {
  PlaneSweepOptions options;
  options.num_ground_planes = 0;
  options.num_refinement_steps = 0;
  return options;
}

inline AnalyticScene lotScene(uint32_t seed) {
  return AnalyticScene({{{0, 0, 0}, {0, 0, 1}},
                        {{0, 6.5, 0}, {0, -1, 0}},
                        {{12.0, 0, 0}, {-1, 0, 0}},
                        {{1.5, 3.5, 0.6}, {0, -1, 0}, {1.0, 0.0, 0.6}}},
                       seed);
}

inline const RigidTransform kLeft = cameraPose({0.0, 1.0, 0.9}, 1.5, 0.6);
inline const RigidTransform kFront = cameraPose({3.6, 0.0, 0.7}, 0.0, 0.2);

/// Hash of a range map's contents.
inline std::string hashOf(const RangeMap& map) {
  ContentHasher hasher;
  addToHash(map, &hasher);
  return hasher.hex();
}

/// Range map of a sequence of test images.
inline RangeMap sweepOf(const Sequence& sequence, const PlaneSweepOptions& options,
                        SweepDetails* details = nullptr, const cv::Mat& valid_mask = allValid()) {
  const PlaneSweep sweep(kCamera, valid_mask, options, sequence.ground);
  return sweep.sweep(sequence.reference, sequence.neighbours, details);
}

inline int countKnown(const RangeMap& map) {
  return cv::countNonZero(map.range_m == map.range_m);
}

/// Number of pixels inside a border whose relative range error is within the tolerance.
inline int countRight(const RangeMap& map, const cv::Mat& truth, double tolerance, int border = 0) {
  int right = 0;
  for (int y = border; y < truth.rows - border; ++y) {
    for (int x = border; x < truth.cols - border; ++x) {
      const double true_range = truth.at<double>(y, x);
      right += std::abs(map.range_m.at<float>(y, x) - true_range) <= tolerance * true_range ? 1 : 0;
    }
  }
  return right;
}

inline void expectTheSameOnAnyNumberOfThreads(const PlaneSweepOptions& options, const Sequence& sequence) {
  std::vector<std::string> hashes;
  for (const size_t threads : {1u, 2u, 5u}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    hashes.push_back(hashOf(sweepOf(sequence, options)));
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

}  // namespace vcharge
