#include "range_mapping/inter_camera_stereo.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/task_arena.h>
#include <opencv2/imgproc.hpp>

#include "range_mapping/range_fusion.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
// Two cameras are not swept if less than this fraction of either image is common.
constexpr double kMinOverlap = 0.02;
// The cameras see ground nearer than this too differently.
constexpr double kMinGroundRange_m = 1.25;
// A point this far below the ground is a wrong match.
constexpr double kMaxDepthBelowGround_m = 0.3;
// Planes are 2 to 3 pixels apart in images of 384 pixels with a baseline of 2 m. On a slanted surface windows
// agree only near the right plane of the right orientation; a second sweep around the smoothed surface of the
// first, as in motion stereo, bends them and doubles the errors.
constexpr double kNearestPlane_m = 1.2;
constexpr int kNumPlanes = 64, kNumGroundPlanes = 64;
// Errors of the extrinsics and of a vehicle body that is not quite rigid.
constexpr double kTranslationNoise_m = 0.01, kRotationNoise_rad = 0.001;
// Largest difference between the matches of the two cameras, as an angle across the baseline.
constexpr double kMaxMismatch_rad = 0.02;

PlaneSweepOptions stereoOptions(PlaneSweepOptions options) {
  options.min_distance_m = kNearestPlane_m;
  options.num_planes = kNumPlanes;
  options.num_ground_planes = kNumGroundPlanes;
  options.near_spacing = 1.0;
  options.num_refinement_steps = 0;
  options.num_fill_levels = 0;
  options.coarse_pass = false;  // loses a fifth of the ranges
  options.aggregation = Aggregation::kMean;
  options.pose_noise.scale = 0.0;
  options.pose_noise.translation_m = kTranslationNoise_m;
  options.pose_noise.translation_m_per_sqrt_m = 0.0;
  options.pose_noise.rotation_rad = kRotationNoise_rad;
  options.pose_noise.rotation_rad_per_sqrt_m = 0.0;
  return options;
}

/// Inverse range along a ray at which it is this far below the ground; not positive for rays upwards.
double inverseRangeBelowGround(const StereoCamera& camera, const Eigen::Vector3d& ray, double below_m) {
  const double down = -(camera.vehicle_from_camera.rotation() * ray).z();
  return down / (camera.vehicle_from_camera.translation().z() + below_m);
}

/// Pixels of `camera` whose farthest point that counts, on the ground or at kMaxRange_m, is seen by `other`.
cv::Mat findOverlap(const StereoCamera& camera, const StereoCamera& other) {
  const RigidTransform other_from_camera = other.vehicle_from_camera.inverse() * camera.vehicle_from_camera;
  const cv::Rect inside(cv::Point(), other.working.size());
  cv::Mat overlap(camera.working.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < overlap.rows; ++y) {
    for (int x = 0; x < overlap.cols; ++x) {
      Eigen::Vector3d ray;
      if (camera.working.validMask().at<uint8_t>(y, x) == 0 ||
          !camera.working.model().unproject({x, y}, &ray)) {
        continue;
      }
      const double inverse_range =
          std::max(inverseRangeBelowGround(camera, ray, 0.0), 1.0 / InterCameraStereo::kMaxRange_m);
      Eigen::Vector2d pixel;
      if (inverse_range > 1.0 / kMinGroundRange_m ||
          !other.working.model().project(other_from_camera * (ray / inverse_range), &pixel)) {
        continue;
      }
      const cv::Point at(cvRound(pixel.x()), cvRound(pixel.y()));
      if (inside.contains(at) && other.working.validMask().at<uint8_t>(at) != 0) {
        overlap.at<uint8_t>(y, x) = 255;
      }
    }
  }
  return overlap;
}

/// The rectangle that the overlap's windows cover, large enough for a sweep.
cv::Rect regionOf(const cv::Mat& overlap) {
  constexpr int kMargin_px = 16;
  const cv::Rect around = cv::boundingRect(overlap);
  return cv::Rect(around.x - kMargin_px, around.y - kMargin_px, around.width + 2 * kMargin_px,
                  around.height + 2 * kMargin_px) &
         cv::Rect(cv::Point(), overlap.size());
}

/// A map of the whole image of which only a part was swept.
RangeMap pasted(const RangeMap& part, const SweepCamera& camera, const cv::Rect& region) {
  const cv::Size size = camera.valid_mask.size();
  RangeMap map{part.stamp,
               "",
               "",
               camera.model,
               cv::Mat(size, CV_32FC1, cv::Scalar(kNaN)),
               cv::Mat(size, CV_32FC1, cv::Scalar(kNaN)),
               cv::Mat(size, CV_32FC1, cv::Scalar(0)),
               {}};
  part.range_m.copyTo(map.range_m(region));
  part.standard_deviation_m.copyTo(map.standard_deviation_m(region));
  part.confidence.copyTo(map.confidence(region));
  return map;
}

}  // namespace

bool InterCameraStereo::Pair::hasImages(const InstantImages& images) const {
  return !images.pixels[sides[0].index].empty() && !images.pixels[sides[1].index].empty();
}

InterCameraStereo::Side InterCameraStereo::makeSide(size_t index, const StereoCamera& camera,
                                                    const StereoCamera& other,
                                                    const PlaneSweepOptions& options) {
  const MeiCamera& model = camera.working.model();
  Side side;
  side.index = index;
  side.vehicle_from_camera = camera.vehicle_from_camera;
  side.camera = std::make_shared<SweepCamera>(SweepCamera{model, camera.working.validMask()});
  side.overlap = findOverlap(camera, other);
  if (cv::countNonZero(side.overlap) < kMinOverlap * static_cast<double>(side.overlap.total())) {
    return side;
  }
  side.region = regionOf(side.overlap);
  side.min_inverse_range_per_m = cv::Mat(side.region.size(), CV_32FC1);
  for (int y = 0; y < side.region.height; ++y) {
    for (int x = 0; x < side.region.width; ++x) {
      double least = 1.0 / kMaxRange_m;
      Eigen::Vector3d ray;
      if (model.unproject(Eigen::Vector2d(side.region.x + x, side.region.y + y), &ray)) {
        least = std::max(least, inverseRangeBelowGround(camera, ray, kMaxDepthBelowGround_m));
      }
      side.min_inverse_range_per_m.at<float>(y, x) = static_cast<float>(least);
    }
  }
  const RigidTransform camera_from_other = camera.vehicle_from_camera.inverse() * other.vehicle_from_camera;
  const Eigen::Vector3d bisector =
      Eigen::Vector3d::UnitZ() + camera_from_other.rotation() * Eigen::Vector3d::UnitZ();
  if (bisector.norm() < 1e-3) {
    return side;  // opposite cameras
  }
  const MeiCamera cropped(model.xi(), model.gamma1(), model.gamma2(), model.u0() - side.region.x,
                          model.v0() - side.region.y);
  side.sweep = std::make_shared<PlaneSweep>(cropped, side.overlap(side.region), options,
                                            groundInCamera(camera.vehicle_from_camera),
                                            PlaneAxes{bisector.normalized()});
  return side;
}

InterCameraStereo::InterCameraStereo(const std::vector<std::optional<StereoCamera>>& cameras,
                                     const PlaneSweepOptions& motion) {
  const PlaneSweepOptions options = stereoOptions(motion);
  for (const std::optional<StereoCamera>& camera : cameras) {
    overlaps_.push_back(camera ? cv::Mat(camera->working.size(), CV_8UC1, cv::Scalar(0)) : cv::Mat());
  }
  for (size_t a = 0; a < cameras.size(); ++a) {
    for (size_t b = a + 1; b < cameras.size(); ++b) {
      if (!cameras[a] || !cameras[b]) {
        continue;
      }
      Pair pair{
          {makeSide(a, *cameras[a], *cameras[b], options), makeSide(b, *cameras[b], *cameras[a], options)}};
      if (pair.sides[0].sweep && pair.sides[1].sweep) {
        for (const Side& side : pair.sides) {
          overlaps_[side.index].setTo(255, side.overlap);
        }
        pairs_.push_back(std::move(pair));
      }
    }
  }
}

std::shared_ptr<const InstantImages> InterCameraStereo::instant(Timestamp stamp, std::vector<cv::Mat> pixels,
                                                                std::vector<Exposure> exposures) const {
  check(pixels.size() == overlaps_.size(), "InterCameraStereo: expected one image per camera of the rig");
  for (size_t i = 0; i < pixels.size(); ++i) {
    check(pixels[i].empty() || (pixels[i].type() == CV_8UC1 && pixels[i].size() == overlaps_[i].size()),
          "InterCameraStereo: images must be CV_8UC1 of the working camera's size");
  }
  exposures.resize(overlaps_.size());
  return std::make_shared<InstantImages>(stamp, std::move(pixels), std::move(exposures), pairs_.size());
}

bool InterCameraStereo::canMeasure(const InstantImages& images, size_t camera) const {
  return std::any_of(pairs_.begin(), pairs_.end(),
                     [&](const Pair& pair) { return pair.has(camera) && pair.hasImages(images); });
}

RangeMap InterCameraStereo::sweepSide(const InstantImages& images, const Side& side, const Side& other) {
  const SweepImage reference{images.stamp,
                             images.pixels[side.index](side.region),
                             side.vehicle_from_camera,
                             nullptr,
                             {},
                             images.exposures[side.index]};
  const SweepImage neighbour{
      images.stamp, images.pixels[other.index],   other.vehicle_from_camera, other.camera,
      {},           images.exposures[other.index]};
  const RangeMap part = side.sweep->sweep(reference, {neighbour});
  RangeMap map = pasted(part, *side.camera, side.region);
  const cv::Mat is_possible = part.range_m.mul(side.min_inverse_range_per_m) <= 1.0;  // false for NaN
  map.range_m(side.region).setTo(kNaN, ~is_possible);
  map.standard_deviation_m(side.region).setTo(kNaN, ~is_possible);
  map.confidence(side.region).setTo(0.0f, ~is_possible);
  return map;
}

void InterCameraStereo::sweepPair(const InstantImages& images, const Pair& pair,
                                  InstantImages::PairMaps* result) {
  const auto& [a, b] = pair.sides;
  const RangeMap map_a = sweepSide(images, a, b);
  const RangeMap map_b = sweepSide(images, b, a);
  const RigidTransform b_from_a = b.vehicle_from_camera.inverse() * a.vehicle_from_camera;
  const double tolerance_per_m = kMaxMismatch_rad / b_from_a.translation().norm();
  result->maps[0] = confirmedRanges(map_a, map_b, b_from_a, tolerance_per_m);
  result->maps[1] = confirmedRanges(map_b, map_a, b_from_a.inverse(), tolerance_per_m);
}

RangeMap InterCameraStereo::rangeMap(const InstantImages& images, size_t camera) const {
  check(canMeasure(images, camera), "InterCameraStereo::rangeMap: no other camera sees the same");
  std::optional<RangeMap> map;
  for (size_t i = 0; i < pairs_.size(); ++i) {
    const Pair& pair = pairs_[i];
    if (!pair.has(camera) || !pair.hasImages(images)) {
      continue;
    }
    InstantImages::PairMaps& found = images.pairs[i];
    // Isolated: a thread that waits for its sweep must not start a task that waits for the same sweep.
    std::call_once(found.once,
                   [&] { tbb::this_task_arena::isolate([&] { sweepPair(images, pair, &found); }); });
    const RangeMap& of_pair = *found.maps[pair.sides[0].index == camera ? 0 : 1];
    map = map ? fuseRangeMaps(*map, of_pair) : copyOf(of_pair);
  }
  return *map;
}

}  // namespace vcharge
