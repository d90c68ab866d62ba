#include "check/image_motion.h"

#include <algorithm>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "check/check_findings.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_features/feature_extractor.h"

namespace vcharge::internal {
namespace {

constexpr int kEvery = 3;
constexpr int kSmallWidth_px = 640;
constexpr int kMaxCorners = 250;
constexpr double kCornerQuality = 0.01;
constexpr int kMinTracks = 30;
constexpr double kMinInlierRatio = 0.5;
/// Least cosine of the angle to the optical axis: rays further out are too long on the plane at depth 1.
constexpr double kMinCosine = 0.35;
constexpr double kThreshold = 0.003;

}  // namespace

ImageMotionMeter::ImageMotionMeter(const RigCamera& camera)
    : model_(camera.model),
      size_px_(camera.image_size_px),
      scale_(std::min(1.0, static_cast<double>(kSmallWidth_px) / camera.image_size_px.width)) {
  cv::resize(makeFeatureMask(camera), mask_, cv::Size(), scale_, scale_, cv::INTER_AREA);
  cv::threshold(mask_, mask_, 254, 255, cv::THRESH_BINARY);
}

std::optional<ImageMotion> ImageMotionMeter::add(Timestamp stamp, const cv::Mat& pixels) {
  if (pixels.size() != size_px_ || (!last_small_.empty() && ++num_skipped_ < kEvery)) {
    return std::nullopt;
  }
  num_skipped_ = 0;
  cv::Mat small;
  cv::resize(pixels, small, mask_.size(), 0, 0, cv::INTER_AREA);
  const ImagePyramid pyramid = tracker_.buildPyramid(small);
  std::optional<ImageMotion> motion;
  if (!last_small_.empty() && last_stamp_ < stamp) {
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(last_small_, corners, kMaxCorners, kCornerQuality, 8.0, mask_);
    std::vector<cv::Point2f> from, to;
    std::vector<double> ways;
    if (!corners.empty()) {
      const std::vector<TrackedPoint> tracked = tracker_.track(last_, pyramid, corners, mask_);
      for (size_t i = 0; i < tracked.size(); ++i) {
        if (tracked[i].status == TrackStatus::kTracked) {
          from.push_back(corners[i]);
          to.push_back(tracked[i].position_px);
          ways.push_back(cv::norm(to.back() - from.back()) / scale_);
        }
      }
    }
    if (static_cast<int>(from.size()) >= kMinTracks) {
      motion = ImageMotion{last_stamp_, stamp, quantile(ways, 0.5), {}, Eigen::Vector3d::UnitZ()};
      estimate(from, to, &*motion);
    }
  }
  last_ = pyramid;
  last_small_ = small;
  last_stamp_ = stamp;
  return motion;
}

std::vector<Eigen::Vector3d> ImageMotionMeter::raysOf(const std::vector<cv::Point2f>& points_px) const {
  std::vector<Eigen::Vector3d> rays(points_px.size(), Eigen::Vector3d::Zero());
  for (size_t i = 0; i < rays.size(); ++i) {
    // Pixel centres are at whole coordinates in both images.
    const Eigen::Vector2d pixel((points_px[i].x + 0.5) / scale_ - 0.5, (points_px[i].y + 0.5) / scale_ - 0.5);
    if (!model_.unproject(pixel, &rays[i])) {
      rays[i].setZero();
    }
  }
  return rays;
}

void ImageMotionMeter::estimate(const std::vector<cv::Point2f>& from_px,
                                const std::vector<cv::Point2f>& to_px, ImageMotion* motion) const {
  const std::vector<Eigen::Vector3d> from_rays = raysOf(from_px), to_rays = raysOf(to_px);
  std::vector<cv::Point2d> from, to;
  for (size_t i = 0; i < from_rays.size(); ++i) {
    if (from_rays[i].z() > kMinCosine && to_rays[i].z() > kMinCosine) {
      from.emplace_back(from_rays[i].x() / from_rays[i].z(), from_rays[i].y() / from_rays[i].z());
      to.emplace_back(to_rays[i].x() / to_rays[i].z(), to_rays[i].y() / to_rays[i].z());
    }
  }
  if (static_cast<int>(from.size()) < kMinTracks) {
    return;
  }
  cv::Mat inliers;
  const cv::Mat essential =
      cv::findEssentialMat(from, to, cv::Mat::eye(3, 3, CV_64F), cv::RANSAC, 0.999, kThreshold, inliers);
  if (essential.rows != 3 || cv::countNonZero(inliers) < kMinInlierRatio * static_cast<double>(from.size())) {
    return;
  }
  // Two rotations fit; the wrong one differs by half a turn about the direction of motion.
  cv::Mat rotations[2], translation;
  cv::decomposeEssentialMat(essential, rotations[0], rotations[1], translation);
  Eigen::Matrix3d begin_from_end;
  double smallest_rad = 4.0;
  for (const cv::Mat& rotation : rotations) {
    Eigen::Matrix3d matrix;
    for (int i = 0; i < 9; ++i) {
      matrix(i / 3, i % 3) = rotation.at<double>(i / 3, i % 3);
    }
    const double angle_rad = angleOfRotation(Eigen::Quaterniond(matrix));
    if (angle_rad < smallest_rad) {
      smallest_rad = angle_rad;
      begin_from_end = matrix.transpose();
    }
  }
  motion->rotation_rad = vectorFromRotation(Eigen::Quaterniond(begin_from_end));
  // The sign of the direction follows from the points, since near points move against it.
  Eigen::Vector3d direction(translation.at<double>(0), translation.at<double>(1), translation.at<double>(2));
  direction = -(begin_from_end * direction).normalized();
  int64_t votes = 0;
  for (size_t i = 0; i < from.size(); ++i) {
    if (inliers.at<uint8_t>(static_cast<int>(i)) == 0) {
      continue;
    }
    const Eigen::Vector3d before(from[i].x, from[i].y, 1.0);
    const Eigen::Vector3d after = begin_from_end * Eigen::Vector3d(to[i].x, to[i].y, 1.0);
    // Points move away from the direction of motion: `before` is nearer to it than `after`.
    votes += (before.normalized() - after.normalized()).dot(direction) > 0.0 ? 1 : -1;
  }
  motion->direction = votes >= 0 ? direction : -direction;
}

}  // namespace vcharge::internal
