#include "matching/rectified_matches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "report/report_pictures.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

const cv::Size kViewSize_px(560, 420);
constexpr double kFocal_px = 230.0;  // 101 degrees across
constexpr size_t kMaxLines = 60;
constexpr size_t kMaxCandidates = 8;  // candidates per pair of cameras

using CameraPair = std::pair<int32_t, int32_t>;
using KeyframePair = std::pair<int32_t, int32_t>;

RigidTransform mapFromCamera(const ReconstructionData& data, int32_t keyframe, size_t camera) {
  return data.keyframes[static_cast<size_t>(keyframe)].map_from_vehicle *
         *data.rig->cameras[camera].vehicle_from_camera;
}

/// Rotations of the cameras to the rectified views of a pair.
struct Rectification {
  Eigen::Matrix3d first_from_view, second_from_view;
};

Rectification rectify(const ReconstructionData& data, const CameraPairView& pair) {
  const Eigen::Quaterniond first = mapFromCamera(data, pair.first_keyframe, pair.first_camera).rotation();
  const Eigen::Quaterniond second = mapFromCamera(data, pair.second_keyframe, pair.second_camera).rotation();
  const Eigen::Quaterniond average = first.slerp(0.5, second);
  return {(first.conjugate() * average).toRotationMatrix(),
          (second.conjugate() * average).toRotationMatrix()};
}

/// Position of an observation in its rectified view; empty outside of it.
std::optional<cv::Point2d> inView(const CameraModel& model, const Eigen::Vector2d& position_px,
                                  const Eigen::Matrix3d& camera_from_view) {
  Eigen::Vector3d ray;
  if (!model.unproject(position_px, &ray)) {
    return std::nullopt;
  }
  const Eigen::Vector3d in_view = camera_from_view.transpose() * ray;
  if (in_view.z() < 0.1) {
    return std::nullopt;
  }
  const cv::Point2d at(kFocal_px * in_view.x() / in_view.z() + 0.5 * (kViewSize_px.width - 1),
                       kFocal_px * in_view.y() / in_view.z() + 0.5 * (kViewSize_px.height - 1));
  return cv::Rect2d(cv::Point2d(), cv::Size2d(kViewSize_px)).contains(at) ? std::make_optional(at)
                                                                          : std::nullopt;
}

const TrackObservation* findObservation(const Track& track, int32_t keyframe, size_t camera) {
  for (const TrackObservation& observation : track.observations) {
    if (observation.keyframe == keyframe && observation.camera == static_cast<int32_t>(camera)) {
      return &observation;
    }
  }
  return nullptr;
}

std::optional<ViewMatch> matchOf(const ReconstructionData& data, const CameraPairView& pair,
                                 const Rectification& views, const Track& track) {
  const TrackObservation* first = findObservation(track, pair.first_keyframe, pair.first_camera);
  const TrackObservation* second = findObservation(track, pair.second_keyframe, pair.second_camera);
  if (!track.position_m || first == nullptr || second == nullptr) {
    return std::nullopt;
  }
  const auto at_first =
      inView(data.rig->cameras[pair.first_camera].model, first->position_px, views.first_from_view);
  const auto at_second =
      inView(data.rig->cameras[pair.second_camera].model, second->position_px, views.second_from_view);
  return at_first && at_second ? std::make_optional(ViewMatch{*at_first, *at_second}) : std::nullopt;
}

/// Number of common landmarks of two cameras, by keyframes with images.
std::map<CameraPair, std::map<KeyframePair, int>> countCommonLandmarks(const ReconstructionData& data,
                                                                       const KeyframeImages& images) {
  std::vector<bool> has_image(data.keyframes.size(), false);
  for (const int32_t keyframe : images.keyframes()) {
    has_image[static_cast<size_t>(keyframe)] = true;
  }
  std::map<CameraPair, std::map<KeyframePair, int>> counts;
  for (const Track& track : data.tracks) {
    if (!track.position_m) {
      continue;
    }
    std::vector<const TrackObservation*> seen;
    for (const TrackObservation& observation : track.observations) {
      if (has_image[static_cast<size_t>(observation.keyframe)]) {
        seen.push_back(&observation);
      }
    }
    for (const TrackObservation* a : seen) {
      for (const TrackObservation* b : seen) {
        if (a->camera < b->camera) {
          ++counts[{a->camera, b->camera}][{a->keyframe, b->keyframe}];
        }
      }
    }
  }
  return counts;
}

cv::Mat viewOf(const ReconstructionData& data, const KeyframeImages& images, int32_t keyframe, size_t camera,
               const Eigen::Matrix3d& camera_from_view) {
  const cv::Mat image = images.image(keyframe, camera);
  cv::Mat view;
  cv::cvtColor(perspectiveView(image, data.rig->cameras[camera], camera_from_view, kViewSize_px, kFocal_px),
               view, cv::COLOR_GRAY2BGR);
  return view;
}

}  // namespace

std::vector<CameraPairView> findCameraPairViews(const ReconstructionData& data,
                                                const KeyframeImages& images) {
  std::vector<CameraPairView> found;
  for (const auto& [cameras, by_keyframes] : countCommonLandmarks(data, images)) {
    std::vector<std::pair<KeyframePair, int>> candidates(by_keyframes.begin(), by_keyframes.end());
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const auto& a, const auto& b) { return a.second > b.second; });
    candidates.resize(std::min(candidates.size(), kMaxCandidates));
    CameraPairView best;
    for (const auto& [keyframes, count] : candidates) {
      CameraPairView pair;
      pair.first_camera = static_cast<size_t>(cameras.first);
      pair.second_camera = static_cast<size_t>(cameras.second);
      pair.first_keyframe = keyframes.first;
      pair.second_keyframe = keyframes.second;
      const Rectification views = rectify(data, pair);
      for (size_t i = 0; i < data.tracks.size(); ++i) {
        if (matchOf(data, pair, views, data.tracks[i])) {
          pair.tracks.push_back(static_cast<int32_t>(i));
        }
      }
      best = pair.tracks.size() > best.tracks.size() ? pair : best;
    }
    if (!best.tracks.empty()) {
      found.push_back(best);
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const CameraPairView& a, const CameraPairView& b) {
    return a.tracks.size() > b.tracks.size();
  });
  return found;
}

std::vector<ViewMatch> matchesInViews(const ReconstructionData& data, const CameraPairView& pair) {
  const Rectification views = rectify(data, pair);
  std::vector<ViewMatch> matches;
  for (const int32_t track : pair.tracks) {
    const auto match = matchOf(data, pair, views, data.tracks[static_cast<size_t>(track)]);
    check(match.has_value(), "matchesInViews: expected landmarks that both views show");
    matches.push_back(*match);
  }
  return matches;
}

cv::Mat drawCameraPairView(const ReconstructionData& data, const KeyframeImages& images,
                           const CameraPairView& pair) {
  const Rectification views = rectify(data, pair);
  cv::Mat picture;
  cv::hconcat(viewOf(data, images, pair.first_keyframe, pair.first_camera, views.first_from_view),
              viewOf(data, images, pair.second_keyframe, pair.second_camera, views.second_from_view),
              picture);
  const std::vector<ViewMatch> matches = matchesInViews(data, pair);
  const size_t step = matches.size() / kMaxLines + 1;
  for (size_t i = 0; i < matches.size(); i += step) {
    cv::Mat colour(1, 1, CV_8UC3, cv::Scalar(static_cast<double>(i * 37 % 180), 220.0, 255.0));
    cv::cvtColor(colour, colour, cv::COLOR_HSV2BGR);
    const auto bgr = cv::Scalar(colour.at<cv::Vec3b>(0, 0));
    const cv::Point2d second_px = matches[i].second_px + cv::Point2d(kViewSize_px.width, 0.0);
    cv::line(picture, matches[i].first_px, second_px, bgr, 1, cv::LINE_AA);
    cv::circle(picture, matches[i].first_px, 3, bgr, 1, cv::LINE_AA);
    cv::circle(picture, second_px, 3, bgr, 1, cv::LINE_AA);
  }
  return picture;
}

}  // namespace vcharge
