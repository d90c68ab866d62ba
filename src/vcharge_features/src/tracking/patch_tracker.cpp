#include "vcharge_features/patch_tracker.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include <opencv2/video/tracking.hpp>

namespace vcharge {
namespace {

/// A smaller step ends the iterations.
constexpr double kMinStep_px = 0.01;
/// A patch has no texture if the smaller eigenvalue of its gradients (per pixel, gray levels over 255) is
/// below.
constexpr double kMinEigenvalue = 1e-4;

void require(bool condition, const std::string& message) {
  if (!condition) {
    throw std::invalid_argument("PatchTracker: " + message);
  }
}

bool isInside(const cv::Point2f& point, cv::Size size) {
  return point.x >= 0.0F && point.y >= 0.0F && point.x <= static_cast<float>(size.width - 1) &&
         point.y <= static_cast<float>(size.height - 1);  // false for NaN
}

}  // namespace

void PatchTrackerOptions::checkFields() const {
  requireField(window_px % 2 == 1, "window_px", "must be odd", window_px);
}

PatchTracker::PatchTracker(const PatchTrackerOptions& options) : options_(options) {
  options.validate();
}

ImagePyramid PatchTracker::buildPyramid(const cv::Mat& image) const {
  require(!image.empty() && image.dims == 2 && image.type() == CV_8UC1,
          "image: expected a non-empty 8UC1, got " + std::to_string(image.cols) + "x" +
              std::to_string(image.rows) + " " + cv::typeToString(image.type()));
  ImagePyramid pyramid;
  pyramid.size_px = image.size();
  // Otherwise OpenCV would read pixels outside of a sub-image.
  const cv::Mat isolated = image.isSubmatrix() ? image.clone() : image;
  constexpr bool kWithGradients = true;
  constexpr bool kReuseImage = false;
  cv::buildOpticalFlowPyramid(isolated, pyramid.levels, cv::Size(options_.window_px, options_.window_px),
                              options_.num_levels - 1, kWithGradients, cv::BORDER_REFLECT_101,
                              cv::BORDER_CONSTANT, kReuseImage);
  return pyramid;
}

std::vector<TrackedPoint> PatchTracker::track(const ImagePyramid& previous, const ImagePyramid& current,
                                              const std::vector<cv::Point2f>& points_px, const cv::Mat& mask,
                                              const std::vector<cv::Point2f>& predicted_px) const {
  require(!previous.levels.empty() && !current.levels.empty() && previous.size_px == current.size_px,
          "previous and current: expected pyramids of images of one size");
  require(mask.empty() || (mask.size() == current.size_px && mask.type() == CV_8UC1),
          "mask: expected 8UC1 of the image's size");
  require(predicted_px.empty() || predicted_px.size() == points_px.size(),
          "predicted_px: expected one per point (" + std::to_string(points_px.size()) + "), got " +
              std::to_string(predicted_px.size()));
  std::vector<TrackedPoint> tracked(points_px.size());
  std::vector<size_t> sources;
  std::vector<cv::Point2f> start, found;
  for (size_t i = 0; i < points_px.size(); ++i) {
    if (isInside(points_px[i], previous.size_px)) {
      sources.push_back(i);
      start.push_back(points_px[i]);
      const bool predicted = !predicted_px.empty() && isInside(predicted_px[i], current.size_px);
      found.push_back(predicted ? predicted_px[i] : points_px[i]);
    }
  }
  if (sources.empty()) {
    return tracked;
  }
  const cv::Size window(options_.window_px, options_.window_px);
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, options_.max_iterations,
                                  kMinStep_px);
  std::vector<uint8_t> forward, backward;
  std::vector<float> ignored;
  cv::calcOpticalFlowPyrLK(previous.levels, current.levels, start, found, forward, ignored, window,
                           options_.num_levels - 1, criteria, cv::OPTFLOW_USE_INITIAL_FLOW, kMinEigenvalue);
  // Tracking backwards starts at the original point, since the way back is short for a correct track.
  std::vector<cv::Point2f> returned = start;
  cv::calcOpticalFlowPyrLK(current.levels, previous.levels, found, returned, backward, ignored, window,
                           options_.num_levels - 1, criteria, cv::OPTFLOW_USE_INITIAL_FLOW, kMinEigenvalue);
  for (size_t k = 0; k < sources.size(); ++k) {
    TrackedPoint& point = tracked[sources[k]];
    point.position_px = found[k];
    if (forward[k] == 0 || !isInside(found[k], current.size_px)) {
      point.status = TrackStatus::kLost;
    } else if (backward[k] == 0 || !(cv::norm(returned[k] - start[k]) <= options_.max_forward_backward_px)) {
      point.status = TrackStatus::kInconsistent;
    } else if (!mask.empty() && mask.at<uint8_t>(cvRound(found[k].y), cvRound(found[k].x)) == 0) {
      point.status = TrackStatus::kMasked;
    } else {
      point.status = TrackStatus::kTracked;
    }
  }
  return tracked;
}

}  // namespace vcharge
