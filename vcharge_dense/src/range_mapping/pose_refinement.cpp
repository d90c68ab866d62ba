#include "range_mapping/pose_refinement.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace vcharge {
namespace {

constexpr int kMaxCorners = 200;
constexpr double kCornerQuality = 0.01, kCornerDistance_px = 12.0;
constexpr int kPyramidLevels = 4;
const cv::Size kTrackWindow_px(15, 15);
constexpr float kMaxReturnError_px = 0.5f;
constexpr double kTrackNoise_px = 0.2;
constexpr int kMinTracks = 30;
// Initial position of a track: where a point at this inverse range would be.
constexpr double kInitialInverseRange_per_m = 0.15;
// Rays closer to the direction of travel (sine of the angle) do not determine an epipolar plane.
constexpr double kMinSine = 0.1;
constexpr int kMaxSteps = 10;
constexpr double kConverged = 1e-3;     // largest remaining step, in standard deviations
constexpr double kMaxDeviations = 4.0;  // largest correction per axis, in standard deviations

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct Track {
  Eigen::Vector3d from, to;  // unit rays
};

/// Applies a correction: rotation vector and translation in the neighbour's frame.
RigidTransform corrected(const RigidTransform& pose, const Vector6& correction) {
  return RigidTransform(rotationFromVector(correction.head<3>()) * pose.rotation(),
                        pose.translation() + correction.tail<3>());
}

/// Sine of a track's angle to its epipolar plane; returns false where the plane is not determined.
bool epipolarError(const RigidTransform& pose, const Track& track, double* sine) {
  const Eigen::Vector3d normal = pose.translation().cross(pose.rotation() * track.from);
  const double length = normal.norm();
  if (!(length > kMinSine * pose.translation().norm())) {
    return false;
  }
  *sine = track.to.dot(normal) / length;
  return true;
}

}  // namespace

PoseRefinement::PoseRefinement(const MeiCamera& camera, const cv::Mat& reference, const cv::Mat& valid_mask,
                               const PoseNoiseOptions& noise)
    : camera_(camera), valid_mask_(valid_mask), noise_(noise) {
  cv::buildOpticalFlowPyramid(reference, pyramid_, kTrackWindow_px, kPyramidLevels);
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(reference, corners, kMaxCorners, kCornerQuality, kCornerDistance_px, valid_mask);
  for (const cv::Point2f& corner : corners) {
    Eigen::Vector3d ray;
    if (camera.unproject({corner.x, corner.y}, &ray)) {
      corners_.push_back(corner);
      rays_.push_back(ray.normalized());
    }
  }
}

PoseRefinement::Result PoseRefinement::refine(const cv::Mat& pixels,
                                              const RigidTransform& neighbour_from_reference) const {
  Result result;
  result.neighbour_from_reference = neighbour_from_reference;
  const double baseline_m = neighbour_from_reference.translation().norm();
  if (corners_.empty() || !(baseline_m > 0.0)) {
    return result;
  }
  std::vector<cv::Mat> pyramid;
  cv::buildOpticalFlowPyramid(pixels, pyramid, kTrackWindow_px, kPyramidLevels);
  std::vector<cv::Point2f> found(corners_), returned(corners_);
  for (size_t i = 0; i < corners_.size(); ++i) {
    Eigen::Vector2d initial_px;
    if (camera_.project(neighbour_from_reference.rotation() * rays_[i] +
                            kInitialInverseRange_per_m * neighbour_from_reference.translation(),
                        &initial_px)) {
      found[i] = cv::Point2f(static_cast<float>(initial_px.x()), static_cast<float>(initial_px.y()));
    }
  }
  std::vector<uint8_t> forward, backward;
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 20, 0.01);
  cv::calcOpticalFlowPyrLK(pyramid_, pyramid, corners_, found, forward, cv::noArray(), kTrackWindow_px,
                           kPyramidLevels, criteria, cv::OPTFLOW_USE_INITIAL_FLOW);
  cv::calcOpticalFlowPyrLK(pyramid, pyramid_, found, returned, backward, cv::noArray(), kTrackWindow_px,
                           kPyramidLevels, criteria, cv::OPTFLOW_USE_INITIAL_FLOW);
  std::vector<Track> tracks;
  for (size_t i = 0; i < corners_.size(); ++i) {
    const cv::Point2f error = returned[i] - corners_[i];
    const cv::Point at(cvRound(found[i].x), cvRound(found[i].y));
    Eigen::Vector3d ray;
    if (forward[i] != 0 && backward[i] != 0 && error.dot(error) <= kMaxReturnError_px * kMaxReturnError_px &&
        cv::Rect({}, valid_mask_.size()).contains(at) && valid_mask_.at<uint8_t>(at) != 0 &&
        camera_.unproject({found[i].x, found[i].y}, &ray)) {
      tracks.push_back({rays_[i], ray.normalized()});
    }
  }
  result.num_tracks = static_cast<int>(tracks.size());
  if (result.num_tracks < kMinTracks) {
    return result;
  }

  const auto deviation = [&](double constant, double per_sqrt_m) {
    return std::sqrt(constant * constant + per_sqrt_m * per_sqrt_m * baseline_m);
  };
  Vector6 sigma;
  sigma << Eigen::Vector3d::Constant(deviation(noise_.rotation_rad, noise_.rotation_rad_per_sqrt_m)),
      Eigen::Vector3d::Constant(deviation(noise_.translation_m, noise_.translation_m_per_sqrt_m));
  // Angle of a pixel in the middle of the image, where the unified camera has its highest resolution.
  const double noise = kTrackNoise_px * (1.0 + camera_.xi()) / camera_.gamma1();
  // Gauss-Newton with Cauchy weights; the unknowns are in units of the pose's standard deviations.
  Vector6 x = Vector6::Zero();
  Matrix6 hessian;
  bool converged = false;
  int agreeing = 0;
  for (int step = 0; step < kMaxSteps && !converged; ++step) {
    hessian.setIdentity();
    Vector6 gradient = x;
    agreeing = 0;
    const RigidTransform pose = corrected(neighbour_from_reference, x.cwiseProduct(sigma));
    constexpr double kDifference = 0.01;
    RigidTransform moved[6];
    for (int i = 0; i < 6; ++i) {
      const Vector6 changed = x + kDifference * Vector6::Unit(i);
      moved[i] = corrected(neighbour_from_reference, changed.cwiseProduct(sigma));
    }
    for (const Track& track : tracks) {
      double error = 0.0, changed = 0.0;
      if (!epipolarError(pose, track, &error)) {
        continue;
      }
      Vector6 slope = Vector6::Zero();
      for (int i = 0; i < 6; ++i) {
        if (epipolarError(moved[i], track, &changed)) {
          slope[i] = (changed - error) / (kDifference * noise);
        }
      }
      const double scaled = error / noise;
      const double weight = 1.0 / (1.0 + 0.25 * scaled * scaled);
      agreeing += weight > 0.5 ? 1 : 0;
      hessian += weight * slope * slope.transpose();
      gradient += weight * scaled * slope;
    }
    const Vector6 change = -hessian.ldlt().solve(gradient);
    x += change;
    converged = change.cwiseAbs().maxCoeff() < kConverged;
  }
  if (converged && 2 * agreeing >= result.num_tracks && agreeing >= kMinTracks &&
      x.cwiseAbs().maxCoeff() <= kMaxDeviations) {
    result.neighbour_from_reference = corrected(neighbour_from_reference, x.cwiseProduct(sigma));
    result.is_refined = true;
    const Vector6 variance_left = hessian.inverse().diagonal();
    result.rotation_variance_left = variance_left.head<3>().mean();
    result.translation_variance_left = variance_left.tail<3>().mean();
  }
  return result;
}

}  // namespace vcharge
