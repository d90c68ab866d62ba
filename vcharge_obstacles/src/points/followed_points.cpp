#include "points/followed_points.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

// Above this elevation nothing is followed: a person one metre away reaches up to it.
constexpr double kMaxElevation_rad = 0.7;
// Side of the cells of which each has at most one point, and its least distance from older points. Where the
// ground is near, every other cell in rows and columns has one: objects there are large.
constexpr int kCell_px = 8;
constexpr double kNearGround_m = 4.0;
constexpr float kMinDistance_px = 5.0F;
// Least smaller eigenvalue of the gradients in a window (gray levels over 255, squared).
constexpr float kMinCorner = 1.5e-4F;
constexpr int kCornerWindow_px = 3;

PatchTrackerOptions trackerOptions() {
  PatchTrackerOptions options;
  options.window_px = 11;  // people at 8 m are about as wide
  options.num_levels = 2;  // motion is predicted
  options.max_iterations = 15;
  return options;
}

}  // namespace

FollowedPoints::FollowedPoints(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera)
    : camera_(camera), vehicle_from_camera_(vehicle_from_camera), tracker_(trackerOptions()) {
  region_ = camera.validMask().clone();
  is_start_cell_ = cv::Mat(region_.size(), CV_8UC1, cv::Scalar(255));
  for (int y = 0; y < region_.rows; ++y) {
    for (int x = 0; x < region_.cols; ++x) {
      Eigen::Vector3d ray;
      if (!camera.model().unproject({static_cast<double>(x), static_cast<double>(y)}, &ray)) {
        region_.at<uint8_t>(y, x) = 0;
        continue;
      }
      const Eigen::Vector3d direction = vehicle_from_camera.rotation() * ray.normalized();
      if (std::asin(direction.z()) > kMaxElevation_rad) {
        region_.at<uint8_t>(y, x) = 0;
      } else if (-direction.z() * kNearGround_m > vehicle_from_camera.translation().z()) {
        is_start_cell_.at<uint8_t>(y, x) = y / kCell_px % 2 == 0 && x / kCell_px % 2 == 0 ? 255 : 0;
      }
    }
  }
  // Patches must not reach the car's own body.
  const int side = trackerOptions().window_px;
  cv::erode(region_, region_, cv::Mat::ones(side, side, CV_8U), cv::Point(-1, -1), 1, cv::BORDER_CONSTANT,
            cv::Scalar(0));
}

void FollowedPoints::clear() {
  tracks_.clear();
  pyramid_ = ImagePyramid();
}

/// Points continue their image motion; new ones are expected on the ground, or far away above the horizon.
cv::Point2f FollowedPoints::predict(const PointTrack& track, Timestamp stamp,
                                    const RigidTransform& now_from_previous) const {
  const PointObservation& last = track.back();
  if (track.size() > 1) {
    const PointObservation& earlier = track[track.size() - 2];
    const auto steps =
        static_cast<float>(toSeconds(stamp - last.stamp) / toSeconds(last.stamp - earlier.stamp));
    return last.position_px + steps * (last.position_px - earlier.position_px);
  }
  const Eigen::Vector3d ray = vehicle_from_camera_.rotation() * last.ray_in_camera;
  constexpr double kFar_m = 30.0;
  const double height_m = vehicle_from_camera_.translation().z();
  const double range_m = ray.z() < 0.0 ? std::min(kFar_m, -height_m / ray.z()) : kFar_m;
  const Eigen::Vector3d point = now_from_previous * (vehicle_from_camera_.translation() + range_m * ray);
  Eigen::Vector2d pixel;
  return camera_.model().project(vehicle_from_camera_.inverse() * point, &pixel)
             ? cv::Point2f(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()))
             : last.position_px;
}

void FollowedPoints::add(Timestamp stamp, const cv::Mat& image, const RigidTransform& previous_from_now) {
  ImagePyramid pyramid = tracker_.buildPyramid(image);
  std::vector<PointTrack> kept;
  if (!tracks_.empty()) {
    const RigidTransform now_from_previous = previous_from_now.inverse();
    std::vector<cv::Point2f> points, predicted;
    for (const PointTrack& track : tracks_) {
      points.push_back(track.back().position_px);
      predicted.push_back(predict(track, stamp, now_from_previous));
    }
    const std::vector<TrackedPoint> found = tracker_.track(pyramid_, pyramid, points, region_, predicted);
    for (size_t i = 0; i < found.size(); ++i) {
      Eigen::Vector3d ray;
      if (found[i].status != TrackStatus::kTracked ||
          !camera_.model().unproject({found[i].position_px.x, found[i].position_px.y}, &ray)) {
        continue;
      }
      PointTrack track = std::move(tracks_[i]);
      track.push_back({stamp, found[i].position_px, ray.normalized()});
      while (toSeconds(stamp - track.front().stamp) > kHistory_s) {
        track.pop_front();
      }
      kept.push_back(std::move(track));
    }
  }
  tracks_ = std::move(kept);
  pyramid_ = std::move(pyramid);
  startTracks(stamp, image);
}

/// Starts a track at the strongest corner of every cell that has one far enough from the tracks.
void FollowedPoints::startTracks(Timestamp stamp, const cv::Mat& image) {
  cv::Mat corner;
  cv::cornerMinEigenVal(image, corner, kCornerWindow_px, 3);
  cv::Mat is_free = region_.clone();
  const auto occupy = [&](const cv::Point2f& position_px) {
    cv::circle(is_free, position_px, cvRound(kMinDistance_px), cv::Scalar(0), cv::FILLED);
  };
  // Where points have run into each other, the older one stays.
  std::stable_sort(tracks_.begin(), tracks_.end(), [](const PointTrack& a, const PointTrack& b) {
    return a.front().stamp < b.front().stamp;
  });
  std::vector<PointTrack> separate;
  for (PointTrack& track : tracks_) {
    if (is_free.at<uint8_t>(track.back().position_px) != 0) {
      occupy(track.back().position_px);
      separate.push_back(std::move(track));
    }
  }
  tracks_ = std::move(separate);
  for (int top = 0; top + kCell_px <= image.rows; top += kCell_px) {
    for (int left = 0; left + kCell_px <= image.cols; left += kCell_px) {
      const cv::Rect cell(left, top, kCell_px, kCell_px);
      if (is_start_cell_.at<uint8_t>(top + kCell_px / 2, left + kCell_px / 2) == 0) {
        continue;
      }
      double strongest = 0.0;
      cv::Point at;
      cv::minMaxLoc(corner(cell), nullptr, &strongest, nullptr, &at, is_free(cell));
      Eigen::Vector3d ray;
      const cv::Point position = at + cell.tl();
      if (static_cast<float>(strongest) > kMinCorner &&
          camera_.model().unproject({static_cast<double>(position.x), static_cast<double>(position.y)},
                                    &ray)) {
        tracks_.push_back({{stamp, cv::Point2f(position), ray.normalized()}});
        occupy(tracks_.back().back().position_px);
      }
    }
  }
}

}  // namespace vcharge
