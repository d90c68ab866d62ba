#include "matching/inter_camera_matching.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "vcharge_features/patch_tracker.h"
#include "vcharge_features/rectified_view.h"

namespace vcharge {
namespace {

/// Maximum number of views per keyframe: those with most common landmarks.
constexpr size_t kNumViews = 2;
/// Largest differences of directions and ranges between two views of a landmark.
constexpr double kMaxViewAngle_rad = 0.5;
constexpr double kMaxRangeRatio = 1.5;
/// Largest distance in the rectified view from the predicted position.
constexpr double kMaxShift_px = 8.0;

RectifiedViewCacheOptions smallViews() {
  RectifiedViewCacheOptions options;
  options.view.width_px = 640;
  options.view.height_px = 480;
  return options;
}

PatchTrackerOptions patchOptions() {
  PatchTrackerOptions options;
  options.window_px = 15;
  options.num_levels = 2;
  options.max_forward_backward_px = 0.3;
  return options;
}

/// Observation of a landmark in the image of a keyframe.
struct LandmarkPixel {
  int32_t track = 0;
  Eigen::Vector2d position_px = Eigen::Vector2d::Zero();
};

/// A match of a landmark in the image of another camera.
struct Found {
  int32_t keyframe = 0, camera = 0, track = 0;
  Eigen::Vector2d position_px = Eigen::Vector2d::Zero();
};

/// Searches for the landmarks of one camera in the images of another.
class NeighbourSearch {
 public:
  NeighbourSearch(const InterCameraOptions& options, const KeyframeImages& images,
                  const ReconstructionData& data, const std::vector<std::vector<LandmarkPixel>>& observations,
                  size_t first, size_t second)
      : options_(options),
        images_(images),
        data_(data),
        observations_(observations),
        first_(first),
        second_(second),
        cache_(data.rig, smallViews()),
        tracker_(patchOptions()) {}

  std::vector<Found> run(size_t first_of_new) {
    const auto step = static_cast<size_t>(options_.keyframe_step);
    for (size_t k = (first_of_new + step - 1) / step * step; k < data_.keyframes.size(); k += step) {
      for (const HistoryView& earlier : chooseHistory(k)) {
        matchViews(earlier, k);
      }
    }
    return std::move(found_);
  }

 private:
  /// An earlier keyframe, and the landmarks of its first camera that the second one should see now.
  struct HistoryView {
    size_t keyframe = 0;
    std::vector<LandmarkPixel> common;
  };

  const std::vector<LandmarkPixel>& observationsAt(size_t keyframe, size_t camera) const {
    return observations_[keyframe * data_.rig->cameras.size() + camera];
  }

  RigidTransform cameraFromMap(size_t keyframe, size_t camera) const {
    return (data_.keyframes[keyframe].map_from_vehicle * *data_.rig->cameras[camera].vehicle_from_camera)
        .inverse();
  }

  /// Keyframes at which the first camera observes most landmarks that the second should see at `k`; latest
  /// first.
  std::vector<HistoryView> chooseHistory(size_t k) const {
    std::vector<HistoryView> views;
    const Keyframe& now = data_.keyframes[k];
    const auto step = static_cast<size_t>(options_.keyframe_step);
    for (size_t back = 0; back <= k; back += step) {
      const size_t h = k - back;
      if (now.travelled_m - data_.keyframes[h].travelled_m > options_.history_m) {
        break;
      }
      HistoryView view{h, commonLandmarks(h, k)};
      if (view.common.size() >= static_cast<size_t>(options_.min_overlap)) {
        views.push_back(std::move(view));
      }
    }
    std::stable_sort(views.begin(), views.end(), [](const HistoryView& a, const HistoryView& b) {
      return a.common.size() > b.common.size();
    });
    views.resize(std::min(views.size(), kNumViews));
    return views;
  }

  /// Landmarks of the first camera at `earlier` that the second should see at `k` from a similar direction.
  std::vector<LandmarkPixel> commonLandmarks(size_t earlier, size_t k) const {
    const RigCamera& camera = data_.rig->cameras[second_];
    const RigidTransform camera_from_map = cameraFromMap(k, second_);
    const Eigen::Vector3d here = camera_from_map.inverse().translation();
    const Eigen::Vector3d there = cameraFromMap(earlier, first_).inverse().translation();
    const double min_cos_angle = std::cos(kMaxViewAngle_rad);
    const double min_cos_field = std::cos(0.5 * camera.field_of_view_rad);
    std::vector<LandmarkPixel> common;
    for (const LandmarkPixel& observation : observationsAt(earlier, first_)) {
      const Eigen::Vector3d& point = *data_.tracks[observation.track].position_m;
      const double range = (point - here).norm(), other_range = (point - there).norm();
      const Eigen::Vector3d in_camera = camera_from_map * point;
      if (range < kMaxRangeRatio * other_range && other_range < kMaxRangeRatio * range &&
          (point - here).dot(point - there) > min_cos_angle * range * other_range &&
          in_camera.z() > min_cos_field * range) {
        common.push_back(observation);
      }
    }
    return common;
  }

  static std::optional<cv::Point2f> toView(const RectifiedView& view, const Eigen::Vector3d& in_camera) {
    Eigen::Vector2d pixel;
    const Eigen::Vector3d in_view = view.viewFromCamera() * in_camera;
    if (in_view.z() <= 0.0 || !view.model().project(in_view, &pixel)) {
      return std::nullopt;
    }
    const cv::Point2f point(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
    const cv::Mat& mask = view.validMask();
    const auto column = static_cast<int>(std::lround(point.x)), row = static_cast<int>(std::lround(point.y));
    const bool is_inside = column >= 0 && row >= 0 && column < mask.cols && row < mask.rows &&
                           mask.at<uint8_t>(row, column) != 0;
    return is_inside ? std::make_optional(point) : std::nullopt;
  }

  ImagePyramid viewOf(const RectifiedView& view, size_t keyframe, size_t camera) const {
    const cv::Mat image = images_.image(static_cast<int32_t>(keyframe), camera);
    return image.size() == data_.rig->cameras[camera].image_size_px
               ? tracker_.buildPyramid(view.rectify(image))
               : ImagePyramid();
  }

  void matchViews(const HistoryView& earlier, size_t k) {
    const RigidTransform between =
        data_.keyframes[earlier.keyframe].map_from_vehicle.inverse() * data_.keyframes[k].map_from_vehicle;
    const std::optional<RectifiedPair> pair = cache_.pair(first_, second_, yawOfRotation(between.rotation()));
    if (!pair) {
      return;
    }
    std::vector<int32_t> tracks;
    std::vector<cv::Point2f> seen_px, expected_px;
    const MovingCamera second = cameraAt(data_.keyframes[k], *data_.rig, second_);
    for (const LandmarkPixel& observation : earlier.common) {
      Eigen::Vector3d ray;
      if (!data_.rig->cameras[first_].model.unproject(observation.position_px, &ray)) {
        continue;
      }
      const auto seen = toView(*pair->first, ray);
      const auto expected =
          toView(*pair->second, second.pointInCamera(*data_.tracks[observation.track].position_m));
      if (seen && expected) {
        tracks.push_back(observation.track);
        seen_px.push_back(*seen);
        expected_px.push_back(*expected);
      }
    }
    if (tracks.empty()) {
      return;
    }
    const ImagePyramid first_view = viewOf(*pair->first, earlier.keyframe, first_);
    const ImagePyramid second_view = viewOf(*pair->second, k, second_);
    if (first_view.levels.empty() || second_view.levels.empty()) {
      return;  // an image is missing
    }
    const std::vector<TrackedPoint> points =
        tracker_.track(first_view, second_view, seen_px, pair->second->validMask(), expected_px);
    for (size_t i = 0; i < points.size(); ++i) {
      const cv::Point2f shift = points[i].position_px - expected_px[i];
      Eigen::Vector2d sensor_px;
      if (points[i].status == TrackStatus::kTracked && std::hypot(shift.x, shift.y) <= kMaxShift_px &&
          pair->second->toSensor({points[i].position_px.x, points[i].position_px.y}, &sensor_px)) {
        found_.push_back({static_cast<int32_t>(k), static_cast<int32_t>(second_), tracks[i], sensor_px});
      }
    }
  }

  const InterCameraOptions& options_;
  const KeyframeImages& images_;
  const ReconstructionData& data_;
  const std::vector<std::vector<LandmarkPixel>>& observations_;
  const size_t first_, second_;
  RectifiedViewCache cache_;
  const PatchTracker tracker_;
  std::vector<Found> found_;
};

/// Ordered pairs of cameras with neighbouring viewing directions.
std::vector<std::pair<size_t, size_t>> neighboursOf(const CameraRig& rig) {
  std::vector<std::pair<double, size_t>> by_yaw;
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    const Eigen::Vector3d axis = rig.cameras[i].vehicle_from_camera->rotationMatrix().col(2);
    by_yaw.emplace_back(std::atan2(axis.y(), axis.x()), i);
  }
  std::sort(by_yaw.begin(), by_yaw.end());
  std::vector<std::pair<size_t, size_t>> pairs;
  for (size_t i = 0; i < by_yaw.size(); ++i) {
    const size_t first = by_yaw[i].second;
    const size_t second = by_yaw[(i + 1) % by_yaw.size()].second;
    if (first != second) {
      pairs.emplace_back(first, second);
      pairs.emplace_back(second, first);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

bool isSeenAt(const Track& track, int32_t keyframe, int32_t camera) {
  return std::any_of(track.observations.begin(), track.observations.end(),
                     [&](const TrackObservation& o) { return o.keyframe == keyframe && o.camera == camera; });
}

}  // namespace

int64_t matchBetweenCameras(const InterCameraOptions& options, const KeyframeImages& images,
                            ReconstructionData* data, size_t first_of_new) {
  std::vector<std::vector<LandmarkPixel>> observations(data->keyframes.size() * data->rig->cameras.size());
  for (size_t t = 0; t < data->tracks.size(); ++t) {
    if (!data->tracks[t].position_m) {
      continue;
    }
    for (const TrackObservation& o : data->tracks[t].observations) {
      observations[static_cast<size_t>(o.keyframe) * data->rig->cameras.size() +
                   static_cast<size_t>(o.camera)]
          .push_back({static_cast<int32_t>(t), o.position_px});
    }
  }
  const std::vector<std::pair<size_t, size_t>> pairs = neighboursOf(*data->rig);
  std::vector<std::vector<Found>> found(pairs.size());
  tbb::parallel_for(size_t{0}, pairs.size(), [&](size_t i) {
    found[i] = NeighbourSearch(options, images, *data, observations, pairs[i].first, pairs[i].second)
                   .run(first_of_new);
  });
  int64_t num_added = 0;
  for (const std::vector<Found>& of_pair : found) {
    for (const Found& match : of_pair) {
      Track& track = data->tracks[match.track];
      if (!isSeenAt(track, match.keyframe, match.camera)) {
        TrackObservation observation{match.keyframe, match.camera, -1, match.position_px, options.sigma_px};
        const auto later = std::upper_bound(track.observations.begin(), track.observations.end(), observation,
                                            [](const TrackObservation& a, const TrackObservation& b) {
                                              return std::make_pair(a.keyframe, a.camera) <
                                                     std::make_pair(b.keyframe, b.camera);
                                            });
        track.observations.insert(later, observation);
        ++num_added;
      }
    }
  }
  return num_added;
}

}  // namespace vcharge
