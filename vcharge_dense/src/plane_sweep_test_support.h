#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "analytic_scene.h"
#include "vcharge_core/mei_camera.h"
#include "vcharge_core/rigid_transform.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge::testing {

inline const cv::Size kSize(320, 200);
inline const MeiCamera kCamera(1.158, 224.0, 223.5, 162.0, 99.5);

/// A camera at the given place (vehicle axes: x forward, y left, z up) that looks along an azimuth, tilted
/// downwards.
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

inline cv::Mat allValid() {
  return cv::Mat(kSize, CV_8UC1, cv::Scalar(255));
}

inline PlaneSweepOptions plainOptions() {
  PlaneSweepOptions options;
  options.families = PlaneFamilies::kFrontoParallel;
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

}  // namespace vcharge::testing
